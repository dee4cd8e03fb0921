# SPDX-License-Identifier: Apache-2.0
"""Starts the command `hotpath` like a user and reads its results, for tests of the whole program.
"""

import contextlib
import csv
import functools
import json
import os
import re
import signal
import subprocess
import tempfile
import time
import unittest
from collections.abc import Callable
from pathlib import Path
from stat import S_ISREG
from typing import Any, cast

import jsonschema
from shared_memory import expect_nothing_left_behind

ONE = ("--executors", "rm-ro", "--repetitions", 1)  # of `run`, whose default is all of the paper's
HOTPATH = os.environ.get("HOTPATH", "hotpath")
BENCH = Path(__file__).resolve().parents[1]
TIME_LIMIT_S = 60
AS_ROOT = "setpriv --reuid 65534 --regid 65534 --clear-groups" if os.geteuid() == 0 else ""
NOBODY = f'nobody() {{ {AS_ROOT} "$@"; }};'
# A command in --help, behind its group or not.
COMMAND = re.compile(r"^(?:[A-Z][a-z ]{9}  | {12}|  )([a-z][a-z0-9-]+)(?:, [a-z]+)? ", re.MULTILINE)
CRASH = re.compile(
    "terminate called|what\\(\\):|Aborted|core dumped|Traceback|std::|filesystem error|internal error"
)

JOB_COLUMNS = (
    "executor,repetition,task,kind,sequence,outcome,timestamp_ns,release_ns,start_ns,finish_ns,cpu_ns,"
    "deadline_ns,worker,cpu,process,parent_task,parent_sequence"
).split(",")
CHAIN_COLUMNS = (
    "executor,repetition,chain,sequence,hot_path_latency_ns,end_to_end_latency_ns,sink_task,"
    "finish_ns,disparity_ns".split(",")
)


@functools.cache
def executors() -> Any:
    """What `hotpath list` says of each executor, by name."""
    words = [HOTPATH, "list", "executors", "--json"]
    return {e["name"]: e for e in json.loads(subprocess.run(words, check=True, capture_output=True).stdout)}


@functools.cache
def schema(name: str) -> Any:
    """Checks documents of this name."""
    path = BENCH / "hotpath_report" / "schemas" / name
    content = json.loads(path.read_text())
    jsonschema.Draft202012Validator.check_schema(content)
    return jsonschema.Draft202012Validator(content, resolver=jsonschema.RefResolver(path.as_uri(), content))


def document(file: Path, text: str = "") -> Any:
    """The JSON document in a file, or this text of one, checked against the schema of the file's name."""
    content = json.loads(text or file.read_text())
    schema(file.name).validate(content)
    return content


class Job:
    """One row of jobs.csv; instants and sequences are integers, empty cells None."""

    sequence: Any

    def __init__(self, row: Any) -> None:
        self.task, self.kind, self.outcome = row["task"], row["kind"], row["outcome"]
        self.node, _, self.topic = self.task.partition("/")
        self.cpu_time = int(row["cpu_ns"]) if row["cpu_ns"] else None
        for name in ("sequence", "worker", "cpu", "process"):
            setattr(self, name, int(row[name]) if row[name] else None)
        for name in ("timestamp", "release", "start", "finish", "deadline"):
            setattr(self, name, int(row[name + "_ns"]) if row[name + "_ns"] else None)
        self.parent = (row["parent_task"], int(row["parent_sequence"])) if row["parent_task"] else None

    def __repr__(self) -> str:
        return f"{self.task} {self.sequence} ({self.outcome})"


class RunFolder:
    """The result folder of a run."""

    def __init__(self, path: Any) -> None:
        self.path = Path(path)
        self.run = document(self.path / "run.json")

    def files(self) -> set[Any]:
        return {f.name for f in self.path.iterdir()}

    def rows(self, name: str) -> list[dict[str, str]]:
        return csv_rows(self.path / name)

    def summary(self) -> Any:
        """summary.json, which must name executors: checks that loop over them would pass otherwise."""
        summary = document(self.path / "summary.json")
        assert summary["executors"], f"{self.path}/summary.json names no executor"
        return summary

    def accounts_for_all(self) -> bool:
        """Whether each sample ran, waits, or is counted as lost, under all executors."""
        return all(executor["loss_equations"]["hold"] for executor in self.summary()["executors"])

    def by_repetition(self, name: str, read: Callable[[Any], Any]) -> dict[tuple[str, int], list[Any]]:
        """{(executor, repetition): what `read` makes of the rows of a file, in their order}"""
        runs: dict[tuple[str, int], list[Any]] = {}
        for row in self.rows(name):
            runs.setdefault((row["executor"], int(row["repetition"])), []).append(read(row))
        return runs

    def jobs(self) -> Any:
        return self.by_repetition("jobs.csv", Job)

    def chains(self) -> Any:
        """{(executor, repetition): [(chain, sequence, hot path latency, end-to-end latency)]}"""

        def output(row: Any) -> tuple[Any, ...]:
            end_to_end = int(row["end_to_end_latency_ns"]) if row["end_to_end_latency_ns"] else None
            return row["chain"], int(row["sequence"]), int(row["hot_path_latency_ns"]), end_to_end

        return self.by_repetition("chains.csv", output)


def csv_rows(path: Path) -> list[dict[str, str]]:
    """The rows of a CSV file."""
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file, strict=True))


def processes_of(session: int) -> Any:
    """Living processes of a session."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[3]) == session and fields[0] != "Z":
            found.append(stat.parent.name)
    return found


def children(process: Any) -> list[int]:
    """Processes that a living process started."""
    try:
        return [int(p) for p in Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()]
    except OSError:
        return []


def commands_below(*above: str) -> dict[tuple[str, ...], str]:
    """The pages of --help-all of all commands below one, by the words of the command."""
    text = subprocess.run([HOTPATH, *above, "--help-all"], check=True, capture_output=True, text=True).stdout
    names = COMMAND.findall(text) if "SUBCOMMAND" in text else []
    below = [entry for name in names for entry in commands_below(*above, name).items()]
    return dict(below) if below else {above: text}


def state_of(folder: Path) -> dict[str, Any]:
    """What identifies everything below a folder: inode and kind and, of files, size and time."""
    found = {str(path.relative_to(folder)): path.lstat() for path in folder.rglob("*")}
    return {
        path: (
            facts.st_ino,
            facts.st_mode,
            S_ISREG(facts.st_mode) and (facts.st_size, facts.st_mtime_ns),
        )
        for path, facts in found.items()
    }


def sentences(err: str) -> list[str]:
    """The errors that a command printed. Notes and Fast DDS's log do not count."""
    return [line for line in err.splitlines() if line.startswith("hotpath: ")]


def assert_says(err: str, *parts: str) -> None:
    """Checks that a command did not crash, but printed exactly one error, which contains all parts."""
    assert len(sentences(err)) == 1 and not CRASH.search(err), err
    for part in parts:
        assert part in sentences(err)[0]


def clean_up(case: unittest.TestCase) -> None:
    """Ends the use of a case that no test runner runs."""
    with contextlib.ExitStack() as stack:  # doCleanups would hide what went wrong
        for function, arguments, options in cast(Any, case)._cleanups:
            stack.callback(function, *arguments, **options)


class CommandTest(unittest.TestCase):
    """A test that runs the command in a new folder, and checks that no file is left in /dev/shm."""

    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory(prefix="hotpath_test_")
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.folder.chmod(0o777)  # some tests run as another user
        self.places: dict[str, Any] = {}  # of command lines
        # Figures cost a second each.
        self.environment = dict(os.environ, HOTPATH_FIGURES="none")
        expect_nothing_left_behind(self)

    def written(self, name: str, text: str) -> Path:
        """A file in the folder with this text."""
        (self.folder / name).write_text(text)
        return self.folder / name

    def words(self, *arguments: object) -> list[str]:
        """The words of a command. A text with spaces alone is a command line with `places` in braces."""
        if len(arguments) == 1 and " " in str(arguments[0]):
            return str(arguments[0]).format(**self.places).split()
        return list(map(str, arguments))

    def start(self, *arguments: object, given: str = "", **options: Any) -> Any:
        """Starts a command. `given`: shell code before it, such as `ulimit -n 12;`, a redirection or, to run
        it as another user, if this user may, `nobody`. Variables may also begin its words."""
        words = self.words(*arguments)
        while words and "=" in words[0]:
            given += f" {words.pop(0)}"
        if "nobody" in given and subprocess.call(["sh", "-c", f"{NOBODY} nobody test -x {HOTPATH}"]) != 0:
            self.skipTest(f"another user cannot reach {HOTPATH}")
        options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options}
        return subprocess.Popen(
            [*(["sh", "-c", f'{NOBODY} {given} "$@"', "sh"] if given else []), HOTPATH, *words],
            text=True,
            cwd=self.folder,
            env=self.environment,
            start_new_session=True,
            **options,
        )

    def finish(self, process: Any) -> tuple[Any, Any, Any]:
        """(exit code, standard output, standard error)"""
        try:
            out, err = process.communicate(timeout=TIME_LIMIT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            for pid in processes_of(process.pid):  # of its session
                os.kill(int(pid), signal.SIGKILL)
            process.communicate()
            self.fail(f"{process.args} did not end")
        return process.returncode, out, err

    def command(self, *arguments: object, **options: Any) -> Any:
        return self.finish(self.start(*arguments, **options))

    def accepted(self, *arguments: object, given: str = "") -> Any:
        """Standard output of a command that must succeed."""
        code, out, err = self.command(*arguments, given=given)
        self.assertEqual(code, 0, err)
        return out

    def rejected(
        self, *arguments: object, says: Any = "", code: int = 2, out: str | None = "", given: str = ""
    ) -> str:
        """Standard error of a command that must end with this code, this output (None: any), and one
        sentence with this text or all of these texts."""
        found, printed, err = self.command(*arguments, given=given)
        self.assertEqual((found, printed if out is not None else None), (code, out), err)
        assert_says(err, *((says,) if isinstance(says, str) else says))
        return str(err)

    def refused(self, *arguments: object, says: Any = "", given: str = "") -> None:
        """The same for wrong use, which must change no file."""
        before = state_of(self.folder)
        err = self.rejected(*arguments, says=says, given=given)
        self.assertEqual(state_of(self.folder), before, err)

    def stored(self, *arguments: object, output: str | Path = "run") -> RunFolder:
        """The folder of a run that must succeed."""
        self.accepted(*arguments, "--output", self.folder / output)
        return RunFolder(self.folder / output)

    def measure(self, *arguments: object, output: str | Path = "run") -> RunFolder:
        """The same if `hotpath check` also accepts its schedule."""
        return self.checked(self.stored(*arguments, output=output).path)

    def checked(self, output: str | Path) -> RunFolder:
        """The folder of a run whose schedule `hotpath check` accepts."""
        self.accepted("doctor", self.folder / output)
        return RunFolder(self.folder / output)

    def wait_for(self, condition: Callable[[], Any], what: str) -> None:
        limit = time.monotonic() + TIME_LIMIT_S
        while not condition():
            self.assertLess(time.monotonic(), limit, what)
            time.sleep(0.02)
