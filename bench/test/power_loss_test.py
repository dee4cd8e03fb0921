# SPDX-License-Identifier: Apache-2.0
"""The results of a command survive a power loss.

disk_calls.cpp logs each sync, mkdir and rename. A model disk keeps only synced content; when the command
has ended, it must hold the same content as the folder. During the command, a file is renamed only after
its content is synced; a new name is synced before another name is created in the same folder or below;
run.json names only repetitions whose rows are synced; a file that grows under its final name has that
name synced before its content. Without any sync of the log, there is a defect."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from adverse_tables import rows
from hotpath_command import BENCH, HOTPATH, CommandTest, processes_of

# Command lines of each test, whose results, in the folder `disk`, must survive.
SURVIVE = """
simulate --executors default,rm-ro --duration 0.5 --warm-up 0 --output disk/a/run
run {brief} --output disk/run
report disk/run0 --summary | export ctf disk/run0 --output disk/new/trace
sweep {stock}/short.yaml --threads 1 --output disk/sweep
"""


class Event:
    """An entry of the log."""

    def __init__(self, line: bytes, content: bytes) -> None:
        facts, path, renamed = line.decode().rstrip("\n").split("\t")
        self.kind, inode, _ = facts.split(" ")
        self.inode, self.content = int(inode), content
        self.path, self.named = Path(path), Path(renamed or path)


def events_of(log: Path) -> list[Event]:
    found = []
    with open(log, "rb") as file:
        while line := file.readline():
            found.append(Event(line, file.read(int(line.split(b"\t")[0].split(b" ")[2]))))
    return found


def disk_state(folder: Path) -> Any:
    """{path: (inode, content)}; a folder's content is its names with their inodes."""
    return {
        p: (p.stat().st_ino, {q.name: q.stat().st_ino for q in p.iterdir()} if p.is_dir() else p.read_bytes())
        for p in [folder, *folder.rglob("*")]
    }


def defects_of(first: Any, events: list[Event], last: Any) -> list[str]:
    """What is wrong with the model disk during these events and after them."""
    kept = dict(first.values())  # by inode
    names = {path: content for path, (_, content) in first.items() if isinstance(content, dict)}
    stored = {path.name: content for path, (_, content) in first.items() if path.suffix == ".part"}
    unkept_names: set[Path] = set()  # folders with a new name that is not synced
    defects = []
    for event in events:
        if event.kind == "rename-file" and kept.get(event.inode) != event.content:
            defects.append(f"{event.path} is renamed before its content was kept")
        if event.kind.startswith(("rename", "make")) and event.named.suffix != ".part":
            if unkept_names & set(event.named.parents):
                defects.append(f"{event.path} is named before the name given before was kept")
            unkept_names.add(event.named.parent)
        elif event.kind == "wait-folder":
            lines = (line.split(" ", 1) for line in event.content.decode().splitlines())
            kept[event.inode] = names[event.path] = {name: int(inode) for inode, name in lines}
            unkept_names.discard(event.path)
        else:
            kept[event.inode] = stored[event.path.name] = event.content
            parts = any(name.endswith(".part") for name in event.path.parts)
            if not parts and names.get(event.path.parent, {}).get(event.path.name) != event.inode:
                defects.append(f"{event.path} is kept before its name was kept")
            for run in (
                json.loads(event.content).get("runs", []) if event.path.name.startswith(".run.json.") else []
            ):
                row = f"\n{run['executor']},{run['repetition']},".encode()
                if any(row not in stored.get(name, b"") for name in ("jobs.csv.part", "chains.csv.part")):
                    defects.append(f"{event.path} names rows that are not kept")
    return defects + [
        f"{p} is not kept as it is" for p, (inode, content) in last.items() if kept.get(inode) != content
    ]


def assert_survives(shell: CommandTest, line: list[Any], program: str = HOTPATH) -> None:
    """Checks that the command's result survives a power loss."""
    disk, log = shell.folder / "disk", shell.folder / "log"
    log.write_bytes(b"")
    first = disk_state(disk)
    noted = {
        "LD_PRELOAD": os.environ["DISK_CALLS"],
        "HOTPATH_DISK_LOG": str(log),
        "HOTPATH_DISK_FOLDER": str(disk),
    }
    done = subprocess.run(
        [program, *line], cwd=shell.folder, env=shell.environment | noted, capture_output=True, check=False
    )
    assert done.returncode == 0, done.stderr
    events, last = events_of(log), disk_state(disk)
    assert defects_of(first, events, last) == []
    assert defects_of(
        first, [e for e in events if not e.kind.startswith("wait")], last
    ), "the check needs no sync"


@pytest.mark.parametrize("lines", rows(SURVIVE), ids=lambda lines: lines[0].split()[0])
def test_a_power_loss(shell: CommandTest, stock: Path, lines: list[str]) -> None:
    (shell.folder / "disk").mkdir()
    shutil.copytree(stock / "run", shell.folder / "disk" / "run0")
    for line in lines:
        assert_survives(shell, shell.words(line))


def test_a_power_loss_during_a_recovery(shell: CommandTest) -> None:
    (shell.folder / "disk").mkdir()
    run = "run --executors default,rm-ro --repetitions 2 --load 5 --duration 1.5 --warm-up 0"
    process = shell.start(*run.split(), "--output", "disk/run")
    facts = shell.folder / "disk" / "run" / "run.json"
    shell.wait_for(
        lambda: facts.exists() and json.loads(facts.read_text())["runs"], "no repetition is stored"
    )
    process.kill()
    shell.finish(process)
    shell.wait_for(lambda: not processes_of(process.pid), "a process lives on")
    assert_survives(shell, ["doctor", "disk/run", "--recover"])


def test_a_power_loss_of_the_python_package(shell: CommandTest) -> None:
    (shell.folder / "disk").mkdir()
    shell.environment["PYTHONPATH"] = str(BENCH)
    code = (
        "import sys, pathlib; from hotpath_report import files; f = pathlib.Path(sys.argv[1]);"
        "files.make_folder(f / 'a' / 'b'); files.write_file(f / 'a' / 'b' / 'page', 'text');"
        "files.write_json(f / 'a' / 'facts', {'a': 1})"
    )
    assert_survives(shell, ["-B", "-c", code, shell.folder / "disk"], sys.executable)
