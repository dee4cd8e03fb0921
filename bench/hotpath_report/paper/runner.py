# SPDX-License-Identifier: Apache-2.0
"""Runs cells. Only a complete cell's folder gets its name, so that runs can resume."""

import concurrent.futures
import contextlib
import itertools
import os
import queue
import shutil
import signal
import subprocess
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hotpath_report.errors import InputError, RunError
from hotpath_report.hotpath_command import ENDS_WITH_US
from hotpath_report.paper.cells import Cell
from hotpath_report.paper.noise import noise_of
from hotpath_report.tables import name_durably, read_json, write_json


def facts_of(path: Path) -> dict[str, Any]:
    """Content of a JSON file; empty if it cannot be read."""
    try:
        content: dict[str, Any] = read_json(path)
        return content
    except InputError:
        return {}


class Runner:
    """Runs cells in output/cells; live cells use `cpus` in this order."""

    def __init__(self, hotpath: str, build: str, output: Path, cpus: list[int]) -> None:
        self.hotpath, self.build, self.cpus = hotpath, build, cpus
        self.folder = Path(output) / "cells"
        # Called when a cell starts (0) or ends (its expected seconds).
        self.on_change: Callable[[float], None] = lambda seconds: None
        self.running: dict[str, subprocess.Popen[str]] = {}
        self.failed: list[tuple[Cell, str]] = []
        self.command_file = self.signature()
        self.stopped = False
        self.lock = threading.Lock()  # guards `running` and `stopped`

    def signature(self) -> tuple[int, int, int]:
        """Identity of the program file; a rebuild changes it."""
        found = os.stat(self.hotpath)
        return found.st_ino, found.st_size, found.st_mtime_ns

    def cpus_of(self, cell: Cell, slot: int) -> list[int]:
        """Processors of a live cell: one of its own, or as many as it has cores."""
        if cell.source != "live":
            return []
        return sorted(self.cpus[slot : slot + 1] if cell.cores == 1 else self.cpus[: cell.cores])

    def command(self, cell: Cell, slot: int, output: object) -> list[str]:
        """Arguments of `hotpath`. Concurrent live cells use different DDS domains."""
        cpus = self.cpus_of(cell, slot)
        place = ("--cpus", ",".join(map(str, cpus)), "--domain", str(slot)) if cpus else ()
        return cell.command(output, place)

    def identity(self, cell: Cell, slot: int) -> dict[str, Any]:
        """Facts that two equivalent results of a cell share."""
        command = ["hotpath", *self.command(cell, slot, f"cells/{cell.name}")]
        return {"command": command, "build": self.build, "complete": True}

    def facts(self, cell: Cell) -> dict[str, Any]:
        """The stored facts of a cell; empty without a folder."""
        return facts_of(self.folder / cell.name / "cell.json")

    def complete(self, cell: Cell) -> bool:
        """Whether the cell's folder holds the planned result of this build."""
        facts = self.facts(cell)
        # Any of several equal processors will do.
        return any(self.identity(cell, k).items() <= facts.items() for k in range(max(1, len(self.cpus))))

    def set_aside(self, cell: Cell) -> None:
        """Moves a live result of another build aside; deletes a simulated one."""
        folder, aside = self.folder / cell.name, self.folder.parent / "superseded"
        if cell.source != "live":
            shutil.rmtree(folder, ignore_errors=True)
        elif folder.exists():
            aside.mkdir(exist_ok=True)
            names = (aside / f"{cell.name}.{attempt}" for attempt in itertools.count(1))
            os.replace(folder, next(name for name in names if not name.exists()))

    def start(self, cell: Cell, command: list[str]) -> subprocess.Popen[str] | None:
        """Starts a cell's process; None after an interruption. Raises RunError."""
        with self.lock:
            if self.stopped:
                return None
            if self.signature() != self.command_file:
                raise RunError(
                    f"{self.hotpath} was replaced during the measurement; complete cells are kept. The same command"
                    " measures everything again with the new program"
                )
            self.running[cell.name] = subprocess.Popen(
                [*ENDS_WITH_US, self.hotpath, *command],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
                errors="replace",
                env={**os.environ, "HOTPATH_FIGURES": "none"},
                start_new_session=True,  # this process forwards Ctrl-C once
            )
            return self.running[cell.name]

    def run(self, cell: Cell, slot: int, at_once: int) -> None:
        """Runs one cell to completion."""
        part = self.folder / f".{cell.name}.{os.getpid()}.part"
        used = self.cpus_of(cell, slot)
        started = time.time()
        process = self.start(cell, self.command(cell, slot, part))
        if process is None or process.stderr is None:
            return
        self.on_change(0)
        with process.stderr:
            errors = process.stderr.read()
        process.wait()
        elapsed = time.time() - started
        with self.lock:
            del self.running[cell.name]
            if self.stopped:
                return
        run = facts_of(part / "run.json")
        if process.returncode != 0 or run.get("complete", True) is not True:
            lines = errors.strip().splitlines() or [f"exit code {process.returncode}"]
            self.failed.append((cell, lines[-1]))
            shutil.rmtree(part, ignore_errors=True)
        else:
            part.mkdir(parents=True, exist_ok=True)
            facts = self.identity(cell, slot) | cell.facts() | {"cpus": used, "elapsed_s": elapsed}
            if cell.source == "live":
                facts |= {"at_once": at_once, "noise": noise_of(run, facts_of(part / "summary.json"))}
            write_json(part / "cell.json", facts)
            self.set_aside(cell)
            name_durably(part, self.folder / cell.name)
        self.on_change(cell.seconds / at_once)

    def run_all(self, cells: list[Cell], workers: int) -> None:
        """Runs the cells in order, `workers` at once. An exception, such as a signal's, interrupts
        all processes and skips the remaining cells; complete cells stay."""
        for part in self.folder.glob(".*.part"):  # leftovers of killed or interrupted reproductions
            shutil.rmtree(part, ignore_errors=True)
        slots: queue.SimpleQueue[int] = queue.SimpleQueue()
        for slot in range(workers):
            slots.put(slot)

        def work(cell: Cell) -> None:
            slot = slots.get()
            try:
                self.run(cell, slot, workers)
            finally:
                slots.put(slot)

        with concurrent.futures.ThreadPoolExecutor(workers) as pool:
            try:
                for future in concurrent.futures.as_completed([pool.submit(work, cell) for cell in cells]):
                    future.result()
            except BaseException:
                with self.lock:
                    self.stopped = True
                    for process in self.running.values():
                        # Popen.send_signal() might reap the exit status that run() waits for.
                        with contextlib.suppress(ProcessLookupError):
                            os.kill(process.pid, signal.SIGINT)
                pool.shutdown(cancel_futures=True)
                raise
