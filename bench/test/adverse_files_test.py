# SPDX-License-Identifier: Apache-2.0
"""Files that are damaged, and targets that cannot or must not be written."""

import re
import resource
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import adverse_tables as tables
import package
from adverse_tables import rows
from adverse_use_test import OPTION
from hotpath_command import CommandTest, state_of

# Damaged files: exit code 1 or 2 and one sentence that names the file; no crash, no hang, no
# unbounded memory.

DEEP = 200_000
DAMAGES = ("empty", "cut", "nested", "types", "nothing", "bytes", "device", "fifo", "folder", "missing")
OF_OTHER_READERS = ("cut", "types", "missing")
ACCEPTED = {("empty", "order.txt")}  # names no task: all come in the order of creation


def of_wrong_types(path: Path) -> str:
    """In JSON, turns numbers into texts, texts into numbers and lists into objects; in a text file, adds
    wrong types to every item."""

    def changed(token: re.Match[str]) -> str:
        swapped = {"[": '{"0": [', "]": "]}", '"': "5", "n": "5"}
        return token[0] if token[0][-1] == ":" else swapped.get(token[0][0], '"text"')

    text = path.read_text(errors="replace")
    if path.suffix == ".json":
        return re.sub(r'"([^"\\]|\\.)*"(\s*:)?|[][]|[\w.+-]+', changed, text)
    header, _, rest = text.partition("\n")
    return header + "\n" + rest.replace(":", ": [x], y:").replace(",", ",?,") + "?"


def damage(path: Path, kind: str) -> None:
    lines = path.read_bytes().splitlines(keepends=True)
    half = len(lines) // 2
    opening, closing = ("[", "]") if path.suffix in (".json", ".yaml") else ("a,", "")
    contents = {
        "empty": b"",
        "cut": b"".join(lines[:half]) + lines[half][: max(len(lines[half]) // 2, 1)],
        "nested": (opening * DEEP + closing * DEEP).encode(),
        "types": of_wrong_types(path).encode(),
        "nothing": b"{}\n",
        "bytes": b"\xff\x00\x1b[2J" * 1000,
    }
    path.unlink()
    if kind in contents:
        path.write_bytes(contents[kind])
    elif kind != "missing":
        make = {"device": "ln -s /dev/zero", "fifo": "mkfifo", "folder": "mkdir"}[kind]
        subprocess.run([*make.split(), path], check=True)


def damaged_copy(stock: Path, folder: Path, file: str, kind: str) -> Path:
    """The file, damaged, in a copy of all inputs that links to those outside its folder."""
    copied = Path(file).parts[0]
    for item in stock.iterdir():
        if item.name != copied:
            (folder / item.name).symlink_to(item)
    subprocess.run(["cp", "-r", stock / copied, folder], check=True)
    damage(folder / file, kind)
    return folder / file


def reads() -> Iterator[tuple[str, str, str, bool]]:
    """(file, command, damage, whether the Python package reads it) of the tables."""
    for table in (tables.READERS, tables.READERS_OF_THE_PACKAGE):
        for file, *readers in rows(table):
            for command in readers:
                for kind in DAMAGES if command == readers[0] else OF_OTHER_READERS:
                    yield file, command, kind, table == tables.READERS_OF_THE_PACKAGE


@pytest.mark.parametrize("file, command, kind, of_package", reads())
def test_a_damaged_file(
    shell: CommandTest, stock: Path, file: str, command: str, kind: str, of_package: bool
) -> None:
    path = damaged_copy(stock, shell.folder, file, kind)
    shell.places |= {"f": path, "d": path.parent, "o": "--output o"}
    if of_package:
        before = resource.getrlimit(resource.RLIMIT_AS)
        resource.setrlimit(resource.RLIMIT_AS, (4 << 30, before[1]))
        done = package.call(shell.folder, shell.environment, *shell.words(command))
        resource.setrlimit(resource.RLIMIT_AS, before)
        code, err = done.returncode, done.stderr
    else:
        code, _, err = shell.command(command, given="ulimit -v 1048576;", errors="replace")
    if (kind, path.name) in ACCEPTED:
        assert (code, err) == (0, "")
        return
    assert code in (1, 2), err
    assert len([line for line in err.splitlines() if not line.startswith("note: ")]) == 1, err
    assert path.name in err or path.parent.name in err
    assert "Traceback" not in err and "\x1b" not in err and len(err) < 5000


# Targets of output: a device, a FIFO and an open descriptor are written to; a link is followed; a
# file is replaced by a complete new one with the same permissions; neighbouring files stay. What
# cannot be written, or holds other content, is rejected before anything is computed.

FILES, LONG_RUNS, FOLDERS = (
    [line for line, *_ in rows(table)] for table in (tables.FILES, tables.FILES_OF_LONG_RUNS, tables.FOLDERS)
)
MARKS = {"run.json"} | {mark for _, mark in rows(tables.FOLDERS, 2) if mark}


def prepare(folder: Path, given: str) -> dict[str, Any]:
    """The state of a folder after this shell code. Skips the test if it cannot make a device."""
    code = subprocess.call(["sh", "-c", given], cwd=folder)
    if code != 0 and "mknod" in given:
        pytest.skip("this user, or this file system, has no devices")
    assert code == 0
    return state_of(folder)


@pytest.mark.parametrize(
    "line, own", [[line, "a file"] for line in FILES + LONG_RUNS] + rows(tables.FOLDERS, 2)
)
def test_targets_that_are_refused(shell: CommandTest, line: str, own: str) -> None:
    """Those of the table and, for folders, results of other commands, whose marks are not its own."""
    others = "".join(f"mkdir of_{mark}; echo {{}} >of_{mark}/{mark};" for mark in MARKS)
    prepare(shell.folder, tables.CROWDED + others)
    refused = rows(tables.REFUSED_FILES if own == "a file" else tables.REFUSED_FOLDERS)
    refused += [["", f"of_{mark}"] for mark in MARKS - {own} if own != "a file"]
    for given, targets in refused:
        for target in targets.split():
            shell.refused(f"{line} {target}", says=f"hotpath: {line.split()[-1]}: ", given=given)


@pytest.mark.parametrize("line", FILES)
def test_a_full_device(shell: CommandTest, line: str) -> None:
    before = prepare(shell.folder, "mknod -m 666 out c 1 7 && : >out")
    code, _, err = shell.command(f"{line} out")
    assert code == 2 and "Traceback" not in err, err
    assert f"{line.split()[-1]}: out cannot be written (No space left on device)" in err
    assert state_of(shell.folder) == before


@pytest.mark.parametrize(
    "line, given, target, written",
    [[line, *row] for line in FILES for row in rows(tables.TAKEN_FILES)] + rows(tables.TAKEN_FOLDERS),
)
def test_a_target_that_is_taken(shell: CommandTest, line: str, given: str, target: str, written: str) -> None:
    """Nothing else changes. A new file is private to the user; a replaced file keeps its permissions."""
    before = prepare(shell.folder, given.format(links=tables.LINKS, beside=tables.BESIDE))
    path = shell.folder / written
    shell.accepted(f"{line} {target}")
    after = state_of(shell.folder)
    for name in before.keys() | after.keys():
        is_written = written and path in [shell.folder / name, *(shell.folder / name).parents]
        assert is_written or before.get(name) == after.get(name), name
    if path.is_file():
        shell.wait_for(lambda: path.stat().st_size > 0, "nothing is written")  # by a FIFO's reader
        assert path.stat().st_mode == (before[written][1] if written in before else 0o100600)
    else:
        assert not written or any(path.iterdir())
        assert all(file.stat().st_size > 0 for file in path.rglob("*") if file.is_file())


@pytest.mark.parametrize("line", FILES)
def test_standard_output(shell: CommandTest, line: str) -> None:
    """A link like /dev/stdout, to a pipe and to a file; the file is not replaced."""
    link, file = shell.folder / "out", shell.folder / "file"
    shell.accepted(f"{line} out")
    begin = link.read_bytes()[:5]
    link.unlink()
    link.symlink_to("/proc/self/fd/1")
    printed = shell.accepted(f"{line} out").encode()
    file.touch()
    inode = file.stat().st_ino
    shell.accepted(f"{line} out", given="exec >file; echo before;")
    stored = file.read_bytes()
    assert begin in printed and begin in stored and stored.startswith(b"before\n" + printed[:10])
    assert len(stored) > 0.9 * len(printed), "output is lost"
    assert link.is_symlink() and file.stat().st_ino == inode


def test_every_option_that_writes_has_a_table(commands: Any) -> None:
    for command, text in commands.items():
        for option, kind in OPTION.findall(text):
            writes = kind in ("FILE", "FOLDER") and option not in tables.INPUTS
            if writes and (*command, option) not in tables.ELSEWHERE:
                whole = re.compile(f"{' '.join(command)} (.* )?{option}")
                assert any(map(whole.fullmatch, FILES + LONG_RUNS + FOLDERS)), (command, option)
