# SPDX-License-Identifier: Apache-2.0
"""Damages each file that hotpath reads, for each command that reads it: empty, cut off, deeply
nested, of wrong types, an endless device, a FIFO without a writer, a folder, missing. The command
must end with exit code 1 or 2 and one sentence that names the file, and must not crash, hang or
take unbounded memory."""

import contextlib
import io
import json
import os
import resource
import shutil
import signal
import subprocess
import tempfile
from pathlib import Path
from typing import Any
from unittest import mock

from hotpath_command import HOTPATH, CommandTest, processes_of
from hotpath_report.__main__ import main
from test_inputs import make_inputs

BENCH = Path(__file__).resolve().parents[1]

MOST_MEMORY = 1 << 30
MOST_SECONDS = 20  # a guard against hanging for ever
DEEP = 200_000

# By file below the folder of inputs: the commands that read it. `{f}` is the file, `{d}` its
# folder.
READERS = {
    "run/run.json": [
        "summarize {d}",
        "check {d}",
        "explain {d}",
        "recover {d}",
        "export ctf {d} --output exported",
        "validate {d} --output v",
    ],
    "run/jobs.csv": ["summarize {d}", "check {d}", "explain {d}", "export ctf {d} --output exported"],
    "run/chains.csv": ["summarize {d}", "explain {d}"],
    "graph.yaml": [
        "graph {f}",
        "simulate --graph {f} --duration 1 --output r",
        "analyze {f}",
        "advise {f} --draws 1 --duration 1 --output a",
    ],
    "times.csv": ["graph {d}/callbacks.yaml"],
    "imported/deployment.yaml": ["simulate --graph {d}/graph.yaml --deployments {f} --output r"],
    "cie.yaml": ["simulate --graph sequences --deployments cie:{f} --output r"],
    "phases.csv": ["simulate --graph sequences --executors default --phases-file {f} --output r"],
    "order.txt": ["simulate --graph sequences --executors default --entity-order {f} --output r"],
    "golden.csv": ["summarize --golden {f}", "simulate --graph timers_only_60 --phases-file {f} --output r"],
    "sweep.yaml": ["sweep {f} --output s"],
    "swept/sweep.json": ["sweep {d}/../sweep.yaml --output {d}"],
    "swept/sweep.yaml": ["sweep {d}/../sweep.yaml --output {d}"],
    "reference/rclcpp_timers_only.csv": ["validate --reference {d} --output v"],
    "reference/rclcpp_autoware_phases.csv": ["validate --reference {d} --output v"],
    "ctf/rm-ro-0/metadata": ["import ctf {d} --output i"],
    "ctf/rm-ro-0/stream": ["import ctf {d} --output i"],
}
# The same for the Python package, which runs in this process: a new process takes a second for its
# imports.
PYTHON_READERS = {
    "run/run.json": [
        "report {d} --output p",
        "timeline {d}",
        "compare-results {d} {d}",
        "hot-path {d} --output p",
    ],
    "run/summary.json": [
        "timers-only {d} --output p",
        "report {d} --output p",
        "compare-results {d} {d} --gate",
    ],
    "run/chains.csv": ["hot-path {d} --output p", "report {d} --output p"],
    "run/jobs.csv": ["timeline {d}"],
    "bench/bench.json": ["bench-report {d}", "compare-results {d} {d}"],
    "swept/table.csv": ["sweep {d}"],
    "capacity/levels.csv": ["capacity {d}"],
    "advice/advice.json": ["advice {d}"],
    "bounds/bounds.json": ["guarantees {d}"],
    "bounds/bounds.csv": ["guarantees {d}"],
    "validation/validation.json": ["validate {d}"],
}
# Defects that a file may have, with the reason.
ACCEPTED = {
    ("empty", "order.txt"): "names no task: all come in the order of creation",
    ("nothing", "stats.yaml"): "no callback was measured",
}


def nested(path: Path) -> str:
    opening, closing = ("[", "]") if path.suffix in (".json", ".yaml") else ("a,", "")
    return opening * DEEP + closing * DEEP


def of_wrong_types(path: Path) -> str:
    """Turns numbers into texts and texts into numbers; in a text file, adds wrong types to every
    item."""
    text = path.read_text(errors="replace")

    def changed(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: changed(item) for key, item in value.items()}
        if isinstance(value, list):
            return {"0": [changed(item) for item in value]}
        return "text" if isinstance(value, (int, float)) else 5

    if path.suffix == ".json":
        return json.dumps(changed(json.loads(text)))
    header, _, rest = text.partition("\n")
    return header + "\n" + rest.replace(":", ": [x], y:").replace(",", ",?,") + "?"


def cut(content: bytes) -> bytes:
    """Cuts the text in the middle of the middle line."""
    lines = content.splitlines(keepends=True)
    before, middle = lines[: len(lines) // 2], (lines or [b""])[len(lines) // 2]
    return b"".join(before) + middle[: max(len(middle) // 2, 1)]


def damage(path: Path, defect: str) -> None:
    """Gives the file a defect."""
    text = path.read_bytes()
    contents = {
        "empty": b"",
        "cut": cut(text),
        "nested": nested(path).encode(),
        "types": of_wrong_types(path).encode() if defect == "types" else b"",
        "nothing": b"{}\n",
        "bytes": b"\xff\x00\x1b[2J" * 1000,
    }
    path.unlink()
    if defect in contents:
        path.write_bytes(contents[defect])
    elif defect == "device":
        path.symlink_to("/dev/zero")
    elif defect == "fifo":
        os.mkfifo(path)
    elif defect == "folder":
        path.mkdir()


def remove(path: Path) -> None:
    """Removes a file of any kind or a folder, if there is one."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


DEFECTS = ("empty", "cut", "nested", "types", "nothing", "bytes", "device", "fifo", "folder", "missing")


class Readers(CommandTest):
    inputs: Path

    @classmethod
    def setUpClass(cls) -> None:
        cls.inputs = make_inputs(HOTPATH)
        cls.addClassCleanup(shutil.rmtree, cls.inputs)

    def each(self, readers: Any, call: Any) -> None:
        """Calls each command with each defect of its file, in a copy of the inputs."""
        for name, commands in readers.items():
            for command in commands:
                folder = Path(tempfile.mkdtemp(dir=self.folder))
                shutil.copytree(self.inputs, folder, dirs_exist_ok=True)
                path = folder / name
                for defect in DEFECTS:
                    with self.subTest(defect=defect, file=name, command=command):
                        damage(path, defect)
                        code, err = call(folder, command.format(f=path, d=path.parent).split())
                        self.assert_refused(path, defect, code, err)
                    self.restore(folder, name)
                shutil.rmtree(folder)

    def restore(self, folder: Path, name: str) -> None:
        """Gives a damaged file its content again, and removes what the command wrote."""
        for left in {file.name for file in folder.iterdir()} - {file.name for file in self.inputs.iterdir()}:
            remove(folder / left)
        remove(folder / name)
        shutil.copy(self.inputs / name, folder / name)

    def assert_refused(self, path: Any, defect: Any, code: int, err: str) -> None:
        if (defect, path.name) in ACCEPTED:
            self.assertEqual((code, err), (0, ""))
            return
        self.assertIn(code, (1, 2), err)
        sentences = [line for line in err.splitlines() if not line.startswith("note: ")]
        self.assertEqual(len(sentences), 1, err)
        self.assertRegex(err, rf"{path.name}|{path.parent.name}")
        self.assertNotIn("Traceback", err)
        self.assertNotIn("\x1b", err)
        self.assertLess(len(err), 5000)

    def run_program(self, folder: Path, words: Any) -> tuple[Any, Any]:
        limit = (MOST_MEMORY, MOST_MEMORY)
        done = subprocess.run(
            [HOTPATH, *words], capture_output=True, text=True, errors="replace", check=False, timeout=MOST_SECONDS,
            cwd=folder, env=self.environment, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, limit),
        )  # fmt: skip
        return done.returncode, done.stderr

    def test_the_program(self) -> None:
        self.each(READERS, self.run_program)

    def test_the_package(self) -> None:
        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        self.addCleanup(resource.setrlimit, resource.RLIMIT_AS, resource.getrlimit(resource.RLIMIT_AS))
        self.addCleanup(
            signal.signal, signal.SIGALRM, signal.signal(signal.SIGALRM, signal.default_int_handler)
        )
        resource.setrlimit(resource.RLIMIT_AS, (4 * MOST_MEMORY, hard))
        self.each(PYTHON_READERS, self.call_package)

    def call_package(self, folder: Path, words: Any) -> tuple[Any, Any]:
        if words[0] == "timeline":
            options = {
                "run": words[1],
                "executors": [],
                "chains": [],
                "repetition": 0,
                "from_ms": 0,
                "to_ms": 900,
                "svg": "",
            }
            words = ["timeline", json.dumps({**options, "perfetto": str(folder / "t.json")})]
        words = [str(folder / word) if word == "p" else word for word in words]
        output, errors = io.StringIO(), io.StringIO()
        with mock.patch.dict(os.environ, {**self.environment, "HOTPATH": HOTPATH}):
            with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors):
                signal.alarm(MOST_SECONDS)
                code = main(words)
                signal.alarm(0)
        return code, errors.getvalue()

    def test_a_folder_of_files_that_vanish(self) -> None:
        code, _, err = self.command("import", "ctf", "/proc")
        self.assertEqual((code, err.count("\n")), (2, 1), err)
        self.assertRegex(err, "hotpath: /proc (holds|cannot be read)")

    def test_a_stack_that_is_too_small(self) -> None:
        limit = (1 << 16, 1 << 16)
        code, _, err = self.command(
            "report", self.inputs / "run", preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_STACK, limit)
        )
        self.assertEqual((code, err.count("\n")), (1, 1), err)
        self.assertIn("ulimit -s", err)

    def test_a_killed_report_leaves_no_program(self) -> None:
        program = self.folder / "hotpath"
        program.write_text("#!/bin/sh\necho $$ >%s\nexec sleep 60\n" % (self.folder / "started"))
        program.chmod(0o755)
        library = Path(HOTPATH).with_name("libhotpath_python.so")
        environment = {**self.environment, "HOTPATH": str(program), "HOTPATH_LIBRARY": str(library)}
        report = subprocess.Popen(
            ["/usr/bin/python3", "-I", "-B", BENCH, "report", self.inputs / "run"],
            env=environment, start_new_session=True,
        )  # fmt: skip
        self.wait_for(lambda: (self.folder / "started").exists(), "it asks the program")
        report.kill()
        report.wait()
        self.wait_for(lambda: not processes_of(report.pid), "its program lives on")
