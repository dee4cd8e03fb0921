# SPDX-License-Identifier: Apache-2.0
"""Every option that names an output file or folder handles each kind of target safely.

--help supplies the options. A device, a FIFO and an open descriptor are written to; a link is
followed; a file is replaced by a complete new file with the same permissions; neighbouring files
stay unchanged. A target that cannot be written, or that holds other content, is rejected before
anything is computed.
"""

import contextlib
import os
import re
import shutil
import stat
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hotpath_command import CommandTest

NOBODY = 65534
IS_ROOT = os.geteuid() == 0
PLAIN_USER = {"user": NOBODY, "group": NOBODY} if IS_ROOT else {}
WRONG_USE = 2
LONG = ("--duration", 3000)

# Options that take a file or folder to read.
INPUTS = """
--against --deployment --golden --phases-file --reference --ros2-runner --stats
""".split()
WATCHED_CONTRACT = ("watch", "--contract")  # also read
# {(command, option): the rest of the command line}; RUN is a short simulation.
FILES = {
    ("doctor", "--output"): ["machine", "--duration", 0.01],
    ("summarize", "--responses"): ["summarize", "RUN"],
    ("analyze", "--csv"): ["analyze", "timers_only_60", "--executors", "rm-ro"],
    ("analyze", "--contract"): ["analyze", "timers_only_60", "--executors", "rm-ro"],
    ("timeline", "--csv"): ["timeline", "RUN"],
    ("timeline", "--perfetto"): ["timeline", "RUN"],
}
# These also start Python, where one function writes all files.
FILES_OF_PYTHON = {
    ("timeline", "--svg"): ["timeline", "RUN", "--to", 30],
    ("diff", "--csv"): ["diff", "RUN", "RUN"],
    ("diff", "--junit"): ["diff", "RUN", "RUN", "--gate"],
    ("diff", "--markdown"): ["diff", "RUN", "RUN", "--gate"],
}
# These measure for minutes and write like compare-results.
FILES_OF_LONG_RUNS = {
    ("compare", "--junit"): ["compare", "--against", "hotpath", *LONG],
    ("compare", "--markdown"): ["compare", "--against", "hotpath", *LONG],
}
ALL_FILES = FILES | FILES_OF_PYTHON | FILES_OF_LONG_RUNS
FOLDERS = {
    ("run", "--output"): ["run", *LONG],
    ("compare", "--output"): ["compare", *LONG],
    ("simulate", "--output"): ["simulate", *LONG],
    ("sweep", "--output"): ["sweep", "sweep.yaml"],
    ("capacity", "--output"): ["capacity", *LONG],
    ("validate", "--output"): ["validate", "RUN"],
    ("analyze", "--page"): ["analyze", "timers_only_60"],
    ("analyze", "--witness"): ["analyze", "timers_only_60", "--phases", "creation"],
    ("experiment wcrt-table", "--output"): ["experiment", "wcrt-table"],
    ("experiment waters", "--output"): ["paper", "waters", "--sets", 1000000],
    ("bench", "--output"): ["bench"],
    ("report", "--output"): ["report", "RUN"],
    ("diff", "--page"): ["diff", "RUN", "RUN"],
    ("advise", "--output"): ["advise", *LONG],
    ("import ctf", "--output"): ["import", "ctf", "trace"],
    ("export ctf", "--output"): ["export", "ctf", "RUN"],
    ("watch", "--record"): ["watch", "--once", "true"],
}
# The file that marks a folder as replaceable by the same command.
MARKS = {
    "analyze --page": "bounds.json",
    "experiment wcrt-table --output": "wcrt_table.csv",
    "experiment waters --output": "waters.csv",
    "report --output": "report.html",
    "compare-results --page": "report.html",
    "sweep --output": "sweep.json",
}
SWEEP = "command: simulate\nfixed: {executors: default, duration: 1e5}\naxes: {load: [10, 20]}\n"
OPTION = re.compile(r"^  (?:-\w,)?(--[\w-]+)(?:,--[\w-]+)* ([^ =\[:]+)(?= |=|$)", re.M)
NUMBERS = "N SECONDS MS US PERCENT LEVEL X JOBS FLOAT".split()


def state_of(folder: Path) -> Any:
    """The state of everything below a folder: link targets, contents, kinds and permissions."""
    found = {}
    for path in sorted(folder.rglob("*")):
        facts = path.lstat()
        content = os.readlink(path) if path.is_symlink() else path.read_bytes() if path.is_file() else None
        found[str(path.relative_to(folder))] = (content, stat.filemode(facts.st_mode))
    return found


class OutputTargets(CommandTest):
    holder: tempfile.TemporaryDirectory[str]

    @classmethod
    def setUpClass(cls) -> None:
        cls.holder = tempfile.TemporaryDirectory(prefix="hotpath_test_")
        cls.addClassCleanup(cls.holder.cleanup)

    def setUp(self) -> None:
        super().setUp()
        self.run_folder = Path(self.holder.name) / "run"
        if not self.run_folder.exists():
            words = "--executors default --duration 0.5 --warm-up 0 --repetitions 3 --phases random".split()
            self.accepted("simulate", *words, "--output", self.run_folder)
        self.place = self.folder / "place"
        self.place.mkdir()
        self.place.chmod(0o777)

    def words(self, words: Any) -> list[Any]:
        return [self.run_folder if word == "RUN" else word for word in words]

    def with_target(self, at: Any, target: Any, **options: Any) -> Any:
        """(exit code, standard output, standard error) of the command with this target."""
        return self.command(
            *self.words(ALL_FILES[at] if at in ALL_FILES else FOLDERS[at]), at[1], target, **options
        )

    def target(self, at: Any) -> Any:
        return self.place / ("out.svg" if at[1] == "--svg" else "out")

    @contextlib.contextmanager
    def trying(self, at: Any) -> Iterator[Any]:
        """A subtest for one option, with an empty folder."""
        with self.subTest(" ".join(at)):
            shutil.rmtree(self.place)
            self.place.mkdir()
            self.place.chmod(0o777)
            yield

    def assert_written(self, at: Any, target: Any, **options: Any) -> None:
        code, _, err = self.with_target(at, target, **options)
        self.assertEqual(code, 0, err)

    def assert_refused(self, at: Any, target: Any, **options: Any) -> None:
        """Checks that the error names the option, that nothing else is printed, and that no file
        changes."""
        before = state_of(self.folder)
        code, out, err = self.with_target(at, target, **options)
        self.assertEqual((code, out), (WRONG_USE, ""), err)
        self.assertRegex(err, rf"^hotpath: {at[1]}: .*\n$")
        self.assertNotIn("filesystem error", err)
        self.assertEqual(state_of(self.folder), before)


class Commands(OutputTargets):
    """The options that --help lists."""

    def commands(self, *above: Any) -> list[Any]:
        """(words, help text) of all commands."""
        found = self.accepted(*above, "--help")
        below = re.search(r"^Subcommands:\n((?:  .*\n)+)", found, re.M)
        if not below:
            return [(above, found)]
        names = re.findall(r"^  (\S+)", below.group(1), re.M)
        return [entry for name in names for entry in self.commands(*above, name)]

    def test_every_option_has_its_targets_here(self) -> None:
        commands = self.commands()
        self.assertGreater(len(commands), 20)
        written = set()
        for words, text in commands:
            for option, kind in OPTION.findall(text):
                self.assertNotEqual(kind, "TEXT", f"{words} {option}: its help does not say what it takes")
                if kind in ("FILE", "FOLDER") and option not in INPUTS:
                    written.add((" ".join(words), option))
        self.assertEqual(written - {WATCHED_CONTRACT}, {*ALL_FILES, *FOLDERS})

    def test_an_empty_name_is_refused(self) -> None:
        tried = 0
        for words, text in self.commands():
            for option, kind in OPTION.findall(text):
                if kind in NUMBERS or "|" in kind and "FILE" not in kind:
                    continue
                with self.subTest(f"{' '.join(words)} {option} {kind}"):
                    code, out, err = self.command(*words, option, "")
                    self.assertEqual((code, out), (WRONG_USE, ""), err)
                    self.assertRegex(err, rf"^hotpath: {option}\b.*\n$")
                    tried += 1
        self.assertGreater(tried, 60)


class FileTargets(OutputTargets):
    def device(self, name: str, major: int, minor: int) -> Any:
        """A device made for the test, so that a defect cannot replace a device of the machine."""
        path = self.place / name
        try:
            os.mknod(path, stat.S_IFCHR | 0o666, os.makedev(major, minor))
            path.open("wb").close()
        except PermissionError:
            self.skipTest("this user, or this file system, has no devices")
        return path

    def test_full_device(self) -> None:
        for at in [*FILES, ("diff", "--junit")]:
            with self.trying(at):
                device = self.device("full", 1, 7)
                code, _, err = self.with_target(at, device)
                self.assertEqual(code, WRONG_USE, err)
                self.assertIn(f"{at[1]}: {device} cannot be written (No space left on device)", err)
                self.assertNotIn("Traceback", err)
                self.assertTrue(device.is_char_device())
                self.assertEqual(list(self.place.iterdir()), [device])

    def test_device_that_takes_all(self) -> None:
        for at in FILES:
            with self.trying(at):
                device = self.device("null", 1, 3)
                self.assert_written(at, device)
                self.assertTrue(device.is_char_device())

    def test_standard_output(self) -> None:
        """A link like /dev/stdout, to a pipe and to a file; the file is not replaced."""
        for at in FILES:
            with self.trying(at):
                link, file = self.target(at), self.place / "file"
                self.assert_written(at, link)
                content = link.read_bytes()
                link.unlink()
                link.symlink_to("/proc/self/fd/1")
                out = self.with_target(at, link)[1].encode()
                self.assertIn(content[:5], out)
                with open(file, "wb") as stream:
                    stream.write(b"before\n")
                    stream.flush()
                    self.assert_written(at, link, stdout=stream)
                    self.assertEqual(os.fstat(stream.fileno()).st_ino, file.stat().st_ino)
                found = file.read_bytes()
                self.assertTrue(found.startswith(b"before\n" + out[:10]))
                self.assertIn(content[:5], found)
                self.assertGreater(len(found), 0.9 * len(out), "output is lost")
                self.assertTrue(link.is_symlink())

    def test_fifo(self) -> None:
        for at in FILES:
            with self.trying(at):
                fifo = self.target(at)
                os.mkfifo(fifo)
                with tempfile.TemporaryFile() as read, subprocess.Popen(["cat", fifo], stdout=read) as reader:
                    try:
                        self.assert_written(at, fifo)
                        self.assertTrue(fifo.is_fifo())
                        reader.wait(60)
                    finally:
                        reader.kill()
                    self.assertGreater(os.fstat(read.fileno()).st_size, 0)

    def test_links_are_followed_and_what_is_beside_stays(self) -> None:
        """Keeps the user's own FILE.part, and links with names that a writer might use for
        temporary files."""
        for at in FILES | FILES_OF_PYTHON:
            with self.trying(at):
                (self.place / "there").mkdir()
                link, middle, file = self.target(at), self.place / "middle", self.place / "there" / "file"
                link.symlink_to(middle)
                middle.symlink_to("there/file")
                precious = self.place / "precious"
                precious.write_text("years of work")
                for target in (link, file):
                    target.with_name(f"{target.name}.part").write_text("mine")
                    for name in ("{}.tmp", ".{}.part", "{}~", "{}.new"):
                        target.with_name(name.format(target.name)).symlink_to(precious)
                before = state_of(self.place)
                self.assert_written(at, link)  # it is still dangling
                after = state_of(self.place)
                self.assertGreater(len(after.pop("there/file", [b""])[0]), 0)
                after.pop("out.png", None)
                self.assertEqual(after, before)
                if at in FILES_OF_PYTHON:
                    continue
                file.write_text("old")
                self.assert_written(at, link)
                self.assertGreater(file.stat().st_size, len("old"))
                self.assertEqual(state_of(self.place).keys(), {*before, "there/file"})

    def test_permissions(self) -> None:
        """A new file is private to the user (by the command's umask); a replaced file keeps its
        permissions."""
        for at in FILES:
            with self.trying(at):
                target = self.target(at)
                for mode in (0o600, 0o664):
                    if target.exists():
                        target.chmod(mode)
                    self.assert_written(at, target)
                    self.assertEqual(target.stat().st_mode & 0o777, mode)

    def test_what_cannot_be_written_is_refused_before_anything_is_computed(self) -> None:
        for at in ALL_FILES:
            with self.trying(at):
                name = self.target(at).name
                (self.place / "file").write_text("")
                (self.place / "folder" / name).mkdir(parents=True)
                loop = self.place / "loop" / name
                loop.parent.mkdir()
                loop.symlink_to(loop)
                for place in ("folder", "missing", "file", "loop", "file/below"):
                    self.assert_refused(at, self.place / place / name)

    def test_no_permission(self) -> None:
        self.run_folder.parent.chmod(0o755)
        for at in ALL_FILES:
            with self.trying(at):
                name = self.target(at).name
                theirs, closed = self.place / "theirs" / name, self.place / "closed" / name
                for path in (theirs, closed):
                    path.parent.mkdir()
                    path.write_text("old")
                    path.chmod(0o444)
                theirs.parent.chmod(0o777)
                closed.chmod(0o666)
                closed.parent.chmod(0o555)
                for path in (theirs, closed, closed.with_name(f"new{name}")):
                    self.assert_refused(at, path, **PLAIN_USER)


class FolderTargets(OutputTargets):
    def setUp(self) -> None:
        super().setUp()
        (self.folder / "sweep.yaml").write_text(SWEEP)
        (self.folder / "trace").mkdir()
        (self.folder / "trace" / "metadata").write_text("")

    def test_what_is_no_place_for_results_is_refused(self) -> None:
        for at in FOLDERS:
            with self.trying(at):
                (self.place / "file").write_text("mine")
                (self.place / "theirs").mkdir()
                (self.place / "theirs" / "thesis.tex").write_text("years of work")
                (self.place / "link").symlink_to("theirs")
                (self.place / "dangling").symlink_to("nowhere")
                names = ("file", "file/below", "file/far/below", "theirs", "theirs/", "link", "dangling")
                # One function judges the folders of all commands.
                all_names = at == ("simulate", "--output")
                for name in names if all_names else ("file/below", "theirs"):
                    self.assert_refused(at, self.place / name)
                for device in ("/dev/full", "/dev/full/below") if all_names else ("/dev/full",):
                    self.assert_refused(at, device)

    def test_no_permission(self) -> None:
        for at in FOLDERS:
            with self.trying(at):
                (self.place / "closed").mkdir()
                (self.place / "closed").chmod(0o555)
                for name in ("closed", "closed/far/below"):
                    self.assert_refused(at, self.place / name, **PLAIN_USER)

    def test_only_a_result_of_the_same_kind_is_replaced(self) -> None:
        for at in FOLDERS:
            with self.trying(at):
                mark_of_it = MARKS.get(" ".join(at))
                marks = {*MARKS.values(), "run.json"} - {mark_of_it} if mark_of_it else {"run.json"}
                for mark in marks:
                    (self.place / mark).mkdir()
                    (self.place / mark / mark).write_text("{}")
                    self.assert_refused(at, self.place / mark)
        cases: Any = (
            (["analyze", "timers_only_60", "--executors", "rm-ro", "--page"], "bounds.json"),
            (["experiment", "wcrt-table", "--output"], "wcrt_table.csv"),
            (
                ["paper", "waters", "--sets", 1, "--utilisations", 0.5, "--paper-only", "--output"],
                "waters.csv",
            ),
        )
        for words, file in cases:
            with self.subTest(words=words):
                shutil.rmtree(self.place)
                self.place.mkdir()
                (self.place / file).write_text("")
                self.accepted(*words, self.place)
                self.assertGreater((self.place / file).stat().st_size, 0)
        # A page takes seconds: a missing run shows that the folder was accepted before it was read.
        shutil.rmtree(self.place)
        self.place.mkdir()
        (self.place / "report.html").write_text("")
        code, _, err = self.command("report", "no_run", "--output", self.place)
        self.assertIn(code, (1, WRONG_USE), err)
        self.assertIn("no_run", err)
        self.assertNotIn("holds other files", err)

    def test_an_empty_folder_and_a_link_to_one_are_taken(self) -> None:
        for words in (["simulate", "--duration", 0.1, "--warm-up", 0], ["export", "ctf", self.run_folder]):
            for name in ("empty", "link"):
                (self.place / "empty").mkdir()
                (self.place / "link").symlink_to("empty")
                self.accepted(*words, "--output", self.place / name)
                self.assertTrue((self.place / "link").is_symlink())
                self.assertTrue(any((self.place / "empty").iterdir()))
                self.assertEqual({p.name for p in self.place.iterdir()}, {"empty", "link"})
                shutil.rmtree(self.place)
                self.place.mkdir()

    def test_an_export_leaves_what_is_beside_it(self) -> None:
        words = "--executors default --duration 0.1 --warm-up 0".split()  # one trace, so one folder
        self.accepted("simulate", *words, "--output", self.folder / "one")
        (self.place / "trace.part").mkdir()
        (self.place / "trace.part" / "thesis.tex").write_text("years of work")
        self.accepted("export", "ctf", self.folder / "one", "--output", self.place / "trace")
        self.assertEqual((self.place / "trace.part" / "thesis.tex").read_text(), "years of work")
