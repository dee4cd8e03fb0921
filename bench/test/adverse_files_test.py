# SPDX-License-Identifier: Apache-2.0
"""Files that are damaged, and targets that cannot or must not be written."""

import json
import os
import resource
import shutil
import signal
import stat
import subprocess
from pathlib import Path
from typing import Any

import pytest

import adverse_tables as tables
import package
from adverse_tables import rows, words
from adverse_use_test import OPTION, WRONG_USE, assert_says
from hotpath_command import CommandTest

NOBODY = {"user": 65534, "group": 65534} if os.geteuid() == 0 else {}


def state_of(folder: Path) -> Any:
    """The state of everything below a folder: link targets, contents, kinds and permissions."""
    found = {}
    for path in sorted(folder.rglob("*")):
        content = os.readlink(path) if path.is_symlink() else path.read_bytes() if path.is_file() else None
        found[str(path.relative_to(folder))] = (content, stat.filemode(path.lstat().st_mode))
    return found


# Damaged files: exit code 1 or 2 and one sentence that names the file; no crash, no hang, no
# unbounded memory.

MOST_MEMORY = 1 << 30
MOST_SECONDS = 20  # a guard against hanging for ever
DEEP = 200_000
DAMAGES = ("empty", "cut", "nested", "types", "nothing", "bytes", "device", "fifo", "folder", "missing")
OF_OTHER_READERS = ("cut", "types", "missing")
ACCEPTED = {("empty", "order.txt")}  # names no task: all come in the order of creation


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


def damage(path: Path, kind: str) -> None:
    text = path.read_bytes()
    lines = text.splitlines(keepends=True)
    half = len(lines) // 2
    opening, closing = ("[", "]") if path.suffix in (".json", ".yaml") else ("a,", "")
    contents: dict[str, Any] = {
        "empty": lambda: b"",
        "cut": lambda: b"".join(lines[:half]) + lines[half][: max(len(lines[half]) // 2, 1)],
        "nested": lambda: (opening * DEEP + closing * DEEP).encode(),
        "types": lambda: of_wrong_types(path).encode(),
        "nothing": lambda: b"{}\n",
        "bytes": lambda: b"\xff\x00\x1b[2J" * 1000,
    }
    content = contents[kind]() if kind in contents else None
    path.unlink()
    if content is not None:
        path.write_bytes(content)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "fifo":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()


def reads(table: str) -> list[tuple[str, str, str]]:
    """(file, command, damage) of a table of readers."""
    return [
        (file, command, kind)
        for file, *readers in rows(table)
        for command in readers
        for kind in (DAMAGES if command == readers[0] else OF_OTHER_READERS)
    ]


def limit(which: int, most: int) -> Any:
    """Options of a command that limit a resource."""
    return {"preexec_fn": lambda: resource.setrlimit(which, (most, most))}


def assert_damage_is_reported(path: Path, kind: str, code: int, err: str) -> None:
    if (kind, path.name) in ACCEPTED:
        assert (code, err) == (0, "")
        return
    assert code in (1, WRONG_USE), err
    assert len([line for line in err.splitlines() if not line.startswith("note: ")]) == 1, err
    assert path.name in err or path.parent.name in err
    assert "Traceback" not in err and "\x1b" not in err and len(err) < 5000


def damaged_copy(stock: Path, folder: Path, file: str, kind: str) -> Path:
    """The file, damaged, in a copy of all inputs that links to those outside its folder."""
    for name in stock.iterdir():
        if name.name == Path(file).parts[0]:
            copy: Any = shutil.copytree if name.is_dir() else shutil.copy
            copy(name, folder / name.name)
        else:
            (folder / name.name).symlink_to(name)
    damage(folder / file, kind)
    return folder / file


@pytest.mark.parametrize("file, command, kind", reads(tables.READERS))
def test_a_damaged_file(shell: CommandTest, stock: Path, file: str, command: str, kind: str) -> None:
    path = damaged_copy(stock, shell.folder, file, kind)
    line = words(command, stock, f=path, d=path.parent, o="--output o")
    code, _, err = shell.command(*line, errors="replace", **limit(resource.RLIMIT_AS, MOST_MEMORY))
    assert_damage_is_reported(path, kind, code, err)


@pytest.fixture
def limited_process() -> Any:
    """Limits the memory and the time of this process, in which the Python package runs."""
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (4 * MOST_MEMORY, before[1]))
    alarm = signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.alarm(MOST_SECONDS)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, alarm)
    resource.setrlimit(resource.RLIMIT_AS, before)


@pytest.mark.parametrize("file, command, kind", reads(tables.PYTHON_READERS))
def test_a_damaged_file_of_the_package(
    limited_process: Any, stock: Path, tmp_path: Path, file: str, command: str, kind: str
) -> None:
    path = damaged_copy(stock, tmp_path, file, kind)
    line = words(command, stock, f=path, d=path.parent, o=f"--output {tmp_path}/o")
    environment = {**os.environ, "HOTPATH_FIGURES": "none"}
    done = package.call(tmp_path, environment, *tables.as_the_program_starts_it(line))
    assert_damage_is_reported(path, kind, done.returncode, done.stderr)


def test_a_stack_that_is_too_small(shell: CommandTest, stock: Path) -> None:
    code, _, err = shell.command(*words(tables.REPORT, stock), **limit(resource.RLIMIT_STACK, 1 << 16))
    assert (code, err.count("\n")) == (1, 1), err
    assert "ulimit -s" in err


# Targets of output: a device, a FIFO and an open descriptor are written to; a link is followed; a
# file is replaced by a complete new one with the same permissions; neighbouring files stay. What
# cannot be written, or holds other content, is rejected before anything is computed.


def files(*tables_of_files: str) -> list[str]:
    return [row[0] for table in tables_of_files for row in rows(table)]


ANY_FILE = files(tables.FILES, tables.FILES_OF_PYTHON, tables.FILES_OF_LONG_RUNS)
ANY_FOLDER = files(tables.FOLDERS)
FIRST_FILES = [files(tables.FILES)[0], files(tables.FILES_OF_PYTHON)[0]]  # of the two functions that write


class Place:
    """An empty folder for the outputs of a command line that ends in an option."""

    def __init__(self, shell: CommandTest, stock: Path) -> None:
        self.shell, self.stock, self.path = shell, stock, shell.folder / "place"
        self.path.mkdir()
        self.path.chmod(0o777)

    def run(self, line: str, target: Path, **options: Any) -> Any:
        return self.shell.command(*words(line, self.stock), target, **options)

    def assert_written(self, line: str, target: Path, **options: Any) -> Any:
        code, out, err = self.run(line, target, **options)
        assert code == 0, err
        return out

    def assert_refused(self, line: str, target: Any, **options: Any) -> None:
        before = state_of(self.path)
        code, out, err = self.run(line, target, **options)
        assert (code, out) == (WRONG_USE, ""), err
        assert_says(err, f"hotpath: {line.split()[-1]}: ")
        assert state_of(self.path) == before


@pytest.fixture
def place(shell: CommandTest, stock: Path) -> Place:
    return Place(shell, stock)


def test_every_option_that_writes_has_a_table(commands: Any) -> None:
    lines = [*ANY_FILE, *ANY_FOLDER]
    for command, text in commands.items():
        for option, kind in OPTION.findall(text):
            writes = kind in ("FILE", "FOLDER") and option not in tables.INPUTS
            if writes and (*command, option) not in tables.ELSEWHERE:
                begin = " ".join(command) + " "
                found = [line for line in lines if line.startswith(begin) and line.endswith(option)]
                assert found, (command, option)


def device(path: Path, major: int, minor: int) -> Path:
    """A device made for the test, so that a defect cannot replace a device of the machine."""
    try:
        os.mknod(path, stat.S_IFCHR | 0o666, os.makedev(major, minor))
        path.open("wb").close()
    except PermissionError:
        pytest.skip("this user, or this file system, has no devices")
    return path


@pytest.mark.parametrize("line", [*files(tables.FILES), FIRST_FILES[1]])
def test_a_full_device(place: Place, line: str) -> None:
    full = device(place.path / "full", 1, 7)
    code, _, err = place.run(line, full)
    assert code == WRONG_USE, err
    assert f"{line.split()[-1]}: {full} cannot be written (No space left on device)" in err
    assert "Traceback" not in err
    assert full.is_char_device()
    assert list(place.path.iterdir()) == [full]


@pytest.mark.parametrize("line", files(tables.FILES))
def test_standard_output(place: Place, line: str) -> None:
    """A link like /dev/stdout, to a pipe and to a file; the file is not replaced."""
    link, file = place.path / "out", place.path / "file"
    place.assert_written(line, link)
    content = link.read_bytes()
    link.unlink()
    link.symlink_to("/proc/self/fd/1")
    out = place.assert_written(line, link).encode()
    assert content[:5] in out
    with open(file, "wb") as stream:
        stream.write(b"before\n")
        stream.flush()
        place.assert_written(line, link, stdout=stream)
        assert os.fstat(stream.fileno()).st_ino == file.stat().st_ino
    found = file.read_bytes()
    assert found.startswith(b"before\n" + out[:10])
    assert content[:5] in found
    assert len(found) > 0.9 * len(out), "output is lost"
    assert link.is_symlink()


def test_a_fifo_and_a_device_that_takes_all(place: Place) -> None:
    fifo = place.path / "out"
    os.mkfifo(fifo)
    with subprocess.Popen(["cat", fifo], stdout=subprocess.PIPE) as reader:
        place.assert_written(FIRST_FILES[0], fifo)
        assert len(reader.communicate(timeout=60)[0]) > 0
    assert fifo.is_fifo()
    null = device(place.path / "null", 1, 3)
    place.assert_written(FIRST_FILES[0], null)
    assert null.is_char_device()


@pytest.mark.parametrize("line", FIRST_FILES)
def test_links_are_followed_and_what_is_beside_stays(place: Place, line: str) -> None:
    """Keeps the user's own FILE.part, and links with names that a writer might use for temporary
    files."""
    (place.path / "there").mkdir()
    link, middle, file = place.path / "out", place.path / "middle", place.path / "there" / "file"
    link.symlink_to(middle)
    middle.symlink_to("there/file")
    precious = place.path / "precious"
    precious.write_text("years of work")
    for target in (link, file):
        target.with_name(f"{target.name}.part").write_text("mine")
        for name in ("{}.tmp", ".{}.part", "{}~", "{}.new"):
            target.with_name(name.format(target.name)).symlink_to(precious)
    before = state_of(place.path)
    place.assert_written(line, link)  # it is still dangling
    after = state_of(place.path)
    assert len(after.pop("there/file")[0]) > 0
    assert after == before
    file.write_text("old")
    place.assert_written(line, link)
    assert file.stat().st_size > len("old")
    assert state_of(place.path).keys() == {*before, "there/file"}


def test_permissions(place: Place) -> None:
    """A new file is private to the user; a replaced file keeps its permissions."""
    target = place.path / "out"
    for mode in (0o600, 0o664):
        if target.exists():
            target.chmod(mode)
        place.assert_written(FIRST_FILES[0], target)
        assert target.stat().st_mode & 0o777 == mode


@pytest.mark.parametrize("line", ANY_FILE)
def test_a_file_that_cannot_be_written(place: Place, line: str) -> None:
    name = "out"
    (place.path / "file").write_text("")
    (place.path / "folder" / name).mkdir(parents=True)
    (place.path / "loop").mkdir()
    (place.path / "loop" / name).symlink_to(place.path / "loop" / name)
    first = ("file", "loop", "file/below") if line in FIRST_FILES else ()
    for where in ("folder", "missing", *first):
        place.assert_refused(line, place.path / where / name)


@pytest.mark.parametrize("line", FIRST_FILES)
def test_a_file_of_somebody_else(place: Place, line: str) -> None:
    theirs, closed = place.path / "theirs" / "out", place.path / "closed" / "out"
    for path in (theirs, closed):
        path.parent.mkdir()
        path.write_text("old")
        path.chmod(0o444)
    theirs.parent.chmod(0o777)
    closed.chmod(0o666)
    closed.parent.chmod(0o555)
    shutil.copytree(place.stock / "run", place.shell.folder / "readable")  # by the other user
    for path in (place.shell.folder / "readable", *(place.shell.folder / "readable").iterdir()):
        path.chmod(0o755)
    place.stock = place.shell.folder
    (place.stock / "readable").rename(place.stock / "run")
    for path in (theirs, closed, closed.with_name("new")):
        place.assert_refused(line, path, **NOBODY)


@pytest.mark.parametrize("line", ANY_FOLDER)
def test_a_folder_that_is_no_place_for_results(place: Place, line: str) -> None:
    (place.path / "file").write_text("mine")
    (place.path / "theirs").mkdir()
    (place.path / "theirs" / "thesis.tex").write_text("years of work")
    (place.path / "link").symlink_to("theirs")
    (place.path / "dangling").symlink_to("nowhere")
    names = ["file/below", "theirs"]
    if line == ANY_FOLDER[0]:
        names += ["file", "file/far/below", "theirs/", "link", "dangling", "/dev/full", "/dev/full/below"]
    for name in names:
        place.assert_refused(line, place.path / name)


def test_a_folder_of_somebody_else(place: Place) -> None:
    (place.path / "closed").mkdir(mode=0o555)
    for name in ("closed", "closed/far/below"):
        place.assert_refused(ANY_FOLDER[0], place.path / name, **NOBODY)


@pytest.mark.parametrize("line, mark", rows(tables.FOLDERS, 2))
def test_only_a_result_of_the_same_kind_is_replaced(place: Place, line: str, mark: str) -> None:
    marks = {row[1] for row in rows(tables.FOLDERS, 2)} - {""}
    for other in ({"run.json", *marks} if line == ANY_FOLDER[0] or mark else {"run.json"}) - {mark}:
        (place.path / other).mkdir()
        (place.path / other / other).write_text("{}")
        place.assert_refused(line, place.path / other)


@pytest.mark.parametrize("line, mark", rows(tables.REPLACES))
def test_a_result_of_the_same_kind_is_replaced(place: Place, line: str, mark: str) -> None:
    (place.path / mark).write_text("")
    place.assert_written(line, place.path)
    assert (place.path / mark).stat().st_size > 0


@pytest.mark.parametrize("name", ["empty", "link"])
@pytest.mark.parametrize("line", tables.INTO_EMPTY)
def test_an_empty_folder_and_a_link_to_one_are_taken(place: Place, line: str, name: str) -> None:
    (place.path / "empty").mkdir()
    (place.path / "link").symlink_to("empty")
    (place.path / "empty.part").mkdir()
    (place.path / "empty.part" / "thesis.tex").write_text("years of work")
    place.assert_written(line, place.path / name)
    assert (place.path / "link").is_symlink()
    assert any((place.path / "empty").iterdir())
    assert {p.name for p in place.path.iterdir()} == {"empty", "link", "empty.part"}
    assert (place.path / "empty.part" / "thesis.tex").read_text() == "years of work"
