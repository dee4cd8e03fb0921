# SPDX-License-Identifier: Apache-2.0
"""Runs cells. Only a complete cell's folder gets its name, so that runs can resume."""

import contextlib
import itertools
import os
import shutil
import signal
import subprocess
from pathlib import Path
from typing import Any

from hotpath_report.errors import InputError, Interrupted, RunError
from hotpath_report.files import name_durably, read_json, write_json
from hotpath_report.hotpath_command import ENDS_WITH_US
from hotpath_report.paper.cells import Cell

CAUSES = ("stolen", "throttled", "others")  # of disturbances: the kernel's counters in run.json


def noise_of(run: dict[str, Any], summary: dict[str, Any]) -> dict[str, Any]:
    """Disturbances of a live cell's one repetition in percent of its time, and the marks that `hotpath` gave it. Marked
    repetitions are shown and counted like all others."""
    (usage,) = (r["usage"] for r in run["runs"])
    shares = {f"{cause}_percent": 100 * usage[f"{cause}_ms"] / usage["wall_ms"] for cause in CAUSES}
    return {**shares, "marks": [m for e in summary["executors"] for r in e["disturbed"] for m in r["marks"]]}


def facts_of(path: Path) -> dict[str, Any]:
    """Content of a JSON file; empty if it cannot be read."""
    with contextlib.suppress(InputError):
        return dict(read_json(path))
    return {}


class Runner:
    """Runs cells in output/cells; live cells use `cpus` in this order."""

    def __init__(self, hotpath: Path, build: str, output: Path, cpus: list[int]) -> None:
        self.hotpath, self.build, self.cpus, self.folder = hotpath, build, cpus, output / "cells"
        self.program = self.identity()
        self.failed: list[tuple[Cell, str]] = []
        for part in self.folder.glob(".*.part"):  # leftovers of killed or interrupted reproductions
            shutil.rmtree(part, ignore_errors=True)

    def identity(self) -> tuple[int, int, int]:
        """Of the program's file; a rebuild changes it."""
        found = self.hotpath.stat()
        return found.st_ino, found.st_size, found.st_mtime_ns

    def command(self, cell: Cell, output: object) -> list[str]:
        """Arguments of `hotpath`. A live cell gets as many processors as it has cores."""
        cpus = ",".join(map(str, self.cpus_of(cell)))
        place = ["--cpus", cpus, "--domain", "0"] if cpus else []
        return [*cell.command(), *place, "--output", str(output)]

    def cpus_of(self, cell: Cell) -> list[int]:
        """Processors of a live cell."""
        return sorted(self.cpus[: cell.cores]) if cell.source == "live" else []

    def planned(self, cell: Cell) -> dict[str, Any]:
        """Facts that two equivalent results of a cell share."""
        command = ["hotpath", *self.command(cell, f"cells/{cell.name}")]
        facts = {"command": command, "build": self.build, "complete": True}
        return facts | cell.facts() | {"cpus": self.cpus_of(cell)}

    def complete(self, cell: Cell) -> bool:
        """Whether the cell's folder holds the planned result of this build."""
        return self.planned(cell).items() <= facts_of(self.folder / cell.name / "cell.json").items()

    def run(self, cell: Cell) -> None:
        """Runs one cell to completion. Raises RunError, and Interrupted after the end of the program."""
        if self.identity() != self.program:
            kept = "was replaced during the measurement; complete cells are kept"
            again = "The same command measures everything again with the new program"
            raise RunError(f"{self.hotpath} {kept}. {again}")
        part = self.folder / f".{cell.name}.{os.getpid()}.part"
        process = subprocess.Popen(
            [*ENDS_WITH_US, self.hotpath, *self.command(cell, part)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            env={**os.environ, "HOTPATH_FIGURES": "none"},
            start_new_session=True,  # this process forwards Ctrl-C once
        )
        try:
            _, errors = process.communicate()
        except Interrupted:
            process.send_signal(signal.SIGINT)
            process.communicate()
            raise
        run, facts = facts_of(part / "run.json"), self.planned(cell)
        if process.returncode != 0 or run.get("complete", True) is not True:
            lines = errors.strip().splitlines() or [f"exit code {process.returncode}"]
            self.failed.append((cell, lines[-1]))
            shutil.rmtree(part, ignore_errors=True)
            return
        if cell.source == "live":
            facts["noise"] = noise_of(run, facts_of(part / "summary.json"))
        write_json(part / "cell.json", facts)
        self.name(cell, part)

    def name(self, cell: Cell, part: Path) -> None:
        """Gives a complete result its name. Moves a live result of another build aside, and deletes a simulated one."""
        folder, aside = self.folder / cell.name, self.folder.parent / "superseded"
        if cell.source == "live" and folder.exists():
            aside.mkdir(exist_ok=True)
            names = (aside / f"{cell.name}.{attempt}" for attempt in itertools.count(1))
            os.replace(folder, next(name for name in names if not name.exists()))
        shutil.rmtree(folder, ignore_errors=True)
        name_durably(part, folder)
