# SPDX-License-Identifier: Apache-2.0
"""Stored results survive a power loss.

disk_calls.cpp logs each sync, mkdir and rename. A model disk keeps only synced content; when the
command has ended, it must hold the same content as the folder. During the command:
- a file is renamed only after its content is synced;
- a new name is synced before another name is created in the same folder or below;
- run.json names only repetitions whose rows are synced;
- a file that grows under its final name has that name synced before its content.

To prove that the check can fail, the test removes each necessary sync from the log and expects a
defect.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from hotpath_command import CommandTest, processes_of

LIBRARY = os.environ.get("DISK_CALLS", "")
BENCH = Path(__file__).resolve().parents[1]  # holds the package
SHORT = ("--duration", "0.5", "--warm-up", "0")
SWEEP = "command: simulate\nfixed: {executors: default, duration: 0.1, warm-up: 0}\naxes: {load: [10, 20]}\n"
REPORT = (
    "import sys, pathlib; from hotpath_report import tables; f = pathlib.Path(sys.argv[1]);"
    "tables.make_folder(f / 'a' / 'b'); tables.write_file(f / 'a' / 'b' / 'page', 'text');"
    "tables.write_json(f / 'a' / 'facts', {'a': 1})"
)


class Event:
    """An entry of the log."""

    def __init__(self, line: bytes, content: Any) -> None:
        facts, self.path, self.renamed = line.decode().rstrip("\n").split("\t")
        self.kind, inode, _ = facts.split(" ")
        self.inode, self.content = int(inode), content

    def __repr__(self) -> str:
        return f"{self.kind} {self.path} {self.renamed}"


def events_of(log: Any) -> Any:
    found = []
    with open(log, "rb") as file:
        while line := file.readline():
            found.append(Event(line, file.read(int(line.split(b"\t")[0].split(b" ")[2]))))
    return found


def state_of(folder: Path) -> Any:
    """{path: (inode, content)}; a folder's content is its names with their inodes."""
    found = {}
    for path in [folder, *folder.rglob("*")]:
        names = {p.name: p.stat().st_ino for p in path.iterdir()} if path.is_dir() else path.read_bytes()
        found[path] = (path.stat().st_ino, names)
    return found


class Disk:
    """A model disk that keeps synced content by inode; `first`: the state before the command."""

    def __init__(self, first: Any) -> None:
        self.kept = dict(first.values())
        self.names = {path: content for path, (_, content) in first.items() if isinstance(content, dict)}
        self.rows = {path.name: content for path, (_, content) in first.items() if path.suffix == ".part"}
        self.unkept_names: set[Any] = set()  # folders with a new name that is not synced
        self.defects: list[Any] = []

    def take(self, event: Any) -> None:
        path = Path(event.path)
        if event.kind == "rename-file":
            if self.kept.get(event.inode) != event.content:
                self.defects.append(f"{event}: before its content was kept")
        named = Path(event.renamed or event.path)
        if event.kind.startswith(("rename", "make")) and named.suffix != ".part":
            if self.unkept_names & set(named.parents):
                self.defects.append(f"{event}: before the name given before was kept")
            self.unkept_names.add(named.parent)
        elif event.kind == "wait-folder":
            lines = (line.split(" ", 1) for line in event.content.decode().splitlines())
            self.kept[event.inode] = self.names[path] = {name: int(inode) for inode, name in lines}
            self.unkept_names.discard(path)
        else:
            self.kept[event.inode] = event.content
            self.rows[path.name] = event.content
            parts = any(name.endswith(".part") for name in path.parts)
            if not parts and self.names.get(path.parent, {}).get(path.name) != event.inode:
                self.defects.append(f"{event}: before its name was kept")
            if path.name.startswith(".run.json."):
                self.check_rows(event)

    def check_rows(self, event: Any) -> None:
        for run in json.loads(event.content).get("runs", []):
            beginning = f"\n{run['executor']},{run['repetition']},".encode()
            for name in ("jobs.csv.part", "chains.csv.part"):
                if beginning not in self.rows.get(name, b""):
                    self.defects.append(f"{event}: names rows that {name} does not keep")

    def compare(self, state: Any) -> None:
        for path, (inode, content) in state.items():
            if self.kept.get(inode) != content:
                self.defects.append(f"{path} is not kept as it is")


def defects_of(first: Any, events: Any, last: Any) -> Any:
    disk = Disk(first)
    for event in events:
        disk.take(event)
    disk.compare(last)
    return disk.defects


def is_needed(events: Any, k: Any) -> bool:
    """Whether the sync is necessary: it keeps new content, and a rename or mkdir relies on it
    before the next sync of the same inode. Any name relies on a folder's sync; the file's own name
    and run.json rely on a file's sync."""
    same = [i for i, e in enumerate(events) if (e.kind, e.inode) == (events[k].kind, events[k].inode)]
    before, after = [i for i in same if i < k], [i for i in same if i > k]
    if before and events[before[-1]].content == events[k].content:
        return False
    if not after:
        return True
    names = [Path(e.path) for e in events[k : after[0]] if not e.kind.startswith("wait")]
    if events[k].kind == "wait-folder":
        return names != []
    return any(name == Path(events[k].path) or name.name.startswith(".run.json.") for name in names)


class PowerLoss(CommandTest):
    def setUp(self) -> None:
        super().setUp()
        self.disk = self.folder / "disk"
        self.disk.mkdir()
        self.log = self.folder / "log"

    def assert_survives(self, *arguments: object, program: Any = None) -> None:
        """Checks that the command's result survives a power loss, and that each necessary sync is
        needed for that."""
        self.log.write_bytes(b"")
        first = state_of(self.disk)
        self.environment |= {"LD_PRELOAD": LIBRARY, "HOTPATH_DISK_LOG": str(self.log),
                             "HOTPATH_DISK_FOLDER": str(self.disk)}  # fmt: skip
        code, _, err = self.command(*arguments) if program is None else self.finish(program())
        for name in ("LD_PRELOAD", "HOTPATH_DISK_LOG", "HOTPATH_DISK_FOLDER"):
            del self.environment[name]
        self.assertEqual(code, 0, err)
        events, last = events_of(self.log), state_of(self.disk)
        self.assertGreater(len(events), 2)
        self.assertEqual(defects_of(first, events, last), [])
        needed = [k for k, e in enumerate(events) if e.kind.startswith("wait") and is_needed(events, k)]
        self.assertGreater(len(needed), 1)
        for k in needed:
            without = events[:k] + events[k + 1 :]
            self.assertNotEqual(defects_of(first, without, last), [], f"the check does not need {events[k]}")

    def test_simulate(self) -> None:
        self.assert_survives(
            "simulate", "--executors", "default,rm-ro", *SHORT, "--output", self.disk / "a" / "run"
        )

    def test_run(self) -> None:
        self.assert_survives(
            "run", "--transport", "intra_process", "--load", 1, *SHORT, "--output", self.disk / "run"
        )

    def test_summarize_and_export(self) -> None:
        self.accepted("simulate", "--executor", "default", *SHORT, "--output", self.disk / "run")
        self.assert_survives("summarize", self.disk / "run", "--responses", self.disk / "responses.csv")
        self.assert_survives("export", "ctf", self.disk / "run", "--output", self.disk / "new" / "trace")

    def test_recover(self) -> None:
        run = ("compare", "--executors", "default,rm-ro", "--repetitions", 9, "--transport", "intra_process")
        process = self.start(*run, "--load", 1, *SHORT, "--output", self.disk / "run")
        facts = self.disk / "run" / "run.json"
        self.wait_for(
            lambda: facts.exists() and json.loads(facts.read_text())["runs"], "no repetition is stored"
        )
        process.kill()
        self.finish(process)
        self.wait_for(lambda: not processes_of(process.pid), "a process lives on")
        self.assert_survives("recover", self.disk / "run")

    def test_sweep(self) -> None:
        (self.folder / "sweep.yaml").write_text(SWEEP)
        self.assert_survives("sweep", "sweep.yaml", "--threads", 1, "--output", self.disk / "sweep")

    def test_python(self) -> None:
        self.assert_survives(program=lambda: subprocess.Popen(
            [sys.executable, "-B", "-c", REPORT, str(self.disk)], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            text=True, cwd=BENCH, env=self.environment, start_new_session=True))  # fmt: skip
