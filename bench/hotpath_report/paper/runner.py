# SPDX-License-Identifier: Apache-2.0
"""Runs cells: each into a folder that gets its name when the cell is whole, so that a killed reproduction goes on."""

import contextlib
import os
import queue
import shutil
import signal
import subprocess
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hotpath_report.errors import InputError
from hotpath_report.paper.cells import Cell
from hotpath_report.paper.noise import busy_seconds, noise_of
from hotpath_report.tables import read_json, write_json

# A cell that outlived a killed reproduction would disturb the next one's measurements.
ENDS_WITH_US = ("setpriv", "--pdeathsig", "TERM", "--")


class Interrupted(Exception):
    """A signal asked for the end."""


class Rebuilt(Exception):
    """The measured command is no longer the one that the first cells ran."""


@dataclass
class Running:
    """A cell and its process."""

    cell: Cell
    process: subprocess.Popen[str]
    started: float  # time.time()


@dataclass
class Outcome:
    """How a cell's process ended."""

    code: int
    errors: str  # standard error
    elapsed_s: float
    others_percent: float  # of its processors' time, used by other processes


def facts_of(folder: Path, name: str = "cell.json") -> dict[str, Any] | None:
    """Content of a JSON file of a cell; None where there is none that can be read."""
    try:
        content: dict[str, Any] = read_json(folder / name)
        return content
    except InputError:
        return None


class Runner:
    """Runs cells in output/cells; live ones on `cpus`, in the order of their use."""

    def __init__(self, hotpath: str, build: str, output: Path, cpus: list[int]) -> None:
        self.hotpath, self.build, self.cpus = hotpath, build, cpus
        self.folder = Path(output) / "cells"
        self.on_change: Callable[
            [], None
        ] = lambda: None  # called when a cell has begun or ended, and now and then
        self.running: dict[str, Running] = {}
        self.done: list[Cell] = []
        self.failed: list[tuple[Cell, str]] = []
        self.at_once = 1
        self.command_file = self.signature()
        self.stop = threading.Event()
        self.interrupted_by = 0  # number of a signal
        self.lock = threading.RLock()  # a signal may find the main thread holding it

    def signature(self) -> tuple[int, int, int]:
        """What changes when the command is built anew."""
        found = os.stat(self.hotpath)
        return found.st_ino, found.st_size, found.st_mtime_ns

    def identity(self, cell: Cell, place: tuple[str, ...]) -> dict[str, Any]:
        """What two results of a cell must share to count as the same."""
        return {"command": ["hotpath", *cell.command(f"cells/{cell.name}", place)], "build": self.build}

    def cpus_of(self, cell: Cell, slot: int) -> list[int]:
        """The live cell's own processor, or as many as it has cores."""
        if cell.source != "live":
            return []
        return sorted(self.cpus[slot : slot + 1] if cell.cores == 1 else self.cpus[: cell.cores])

    def place(self, cell: Cell, slot: int) -> tuple[str, ...]:
        """Options of a live cell. In different DDS domains, cells at the same time do not discover each other."""
        cpus = self.cpus_of(cell, slot)
        return ("--cpus", ",".join(map(str, cpus)), "--domain", str(slot)) if cpus else ()

    def complete(self, cell: Cell) -> bool:
        """Whether the cell's folder holds what the plan asks for, made by this build."""
        facts = facts_of(self.folder / cell.name)
        if facts is None or facts.get("complete") is not True:
            return False
        # Which of several equal processors a cell was pinned to is no difference.
        options = [self.identity(cell, self.place(cell, slot)) for slot in range(max(1, len(self.cpus)))]
        return any(all(facts.get(key) == value for key, value in wanted.items()) for wanted in options)

    def of_another_build(self, cell: Cell) -> bool:
        """Whether another build made the cell's folder."""
        facts = facts_of(self.folder / cell.name)
        return facts is not None and facts.get("build") != self.build

    def set_aside(self, cell: Cell) -> None:
        """Keeps what another build measured; a simulation can be repeated."""
        folder = self.folder / cell.name
        if cell.source != "live":
            shutil.rmtree(folder, ignore_errors=True)
        if not folder.exists():
            return
        aside = self.folder.parent / "superseded"
        aside.mkdir(exist_ok=True)
        attempt = 1
        while (aside / f"{cell.name}.{attempt}").exists():
            attempt += 1
        os.replace(folder, aside / f"{cell.name}.{attempt}")

    def start(self, cell: Cell, command: list[str]) -> subprocess.Popen[str]:
        """Starts a cell's process. Raises Interrupted, or Rebuilt."""
        with self.lock:
            if self.stop.is_set():
                raise Interrupted
            if self.signature() != self.command_file:
                raise Rebuilt
            process = subprocess.Popen(
                [*ENDS_WITH_US, self.hotpath, *command],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
                errors="replace",
                env={**os.environ, "HOTPATH_FIGURES": "none"},
                start_new_session=True,  # Ctrl-C reaches it through us, once
            )
            self.running[cell.name] = Running(cell, process, time.time())
        return process

    def run(self, cell: Cell, slot: int = 0) -> None:
        """Runs one cell to its end."""
        part = self.folder / f".{cell.name}.{os.getpid()}.part"
        used = set(self.cpus_of(cell, slot))
        started, busy = time.time(), busy_seconds(used)
        process = self.start(cell, cell.command(part, self.place(cell, slot)))
        self.on_change()
        assert process.stderr is not None
        with process.stderr:
            errors = process.stderr.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        elapsed, own = time.time() - started, usage.ru_utime + usage.ru_stime
        others = 100 * max(0.0, busy_seconds(used) - busy - own) / (elapsed * len(used)) if used else 0.0
        with self.lock:
            del self.running[cell.name]
        if self.stop.is_set():
            raise Interrupted
        self.finish(cell, slot, part, Outcome(process.returncode, errors, elapsed, others))
        self.on_change()

    def finish(self, cell: Cell, slot: int, part: Path, outcome: Outcome) -> None:
        """Gives a complete cell its name, and removes what a failed one left."""
        run = facts_of(part, "run.json")
        if outcome.code != 0 or (run is not None and run.get("complete") is not True):
            lines = outcome.errors.strip().splitlines() or [f"exit code {outcome.code}"]
            self.failed.append((cell, lines[-1]))
            shutil.rmtree(part, ignore_errors=True)
            return
        part.mkdir(parents=True, exist_ok=True)
        facts = self.identity(cell, self.place(cell, slot)) | cell.facts()
        facts |= {"cpus": self.cpus_of(cell, slot), "elapsed_s": outcome.elapsed_s}
        if cell.source == "live" and run is not None:
            facts |= {"at_once": self.at_once, "noise": noise_of(run, outcome.others_percent)}
        write_json(part / "cell.json", {**facts, "complete": True})
        self.set_aside(cell)
        os.replace(part, self.folder / cell.name)
        self.done.append(cell)

    def interrupt(self, number: int = signal.SIGINT) -> None:
        """Ends all processes; what is complete stays."""
        with self.lock:
            self.interrupted_by = number
            self.stop.set()
            for running in self.running.values():
                # Not Popen's own way, which might take the exit status that run() awaits.
                with contextlib.suppress(ProcessLookupError):
                    os.kill(running.process.pid, signal.SIGINT)

    def run_all(self, cells: list[Cell], workers: int) -> None:
        """Takes the cells in their order, several at once; the rest is left alone after the first exception."""
        for part in self.folder.glob(".*.part"):  # what killed and interrupted reproductions left behind
            shutil.rmtree(part, ignore_errors=True)
        self.at_once = workers
        waiting: queue.SimpleQueue[Cell] = queue.SimpleQueue()
        problems: list[BaseException] = []
        for cell in cells:
            waiting.put(cell)

        def work(slot: int) -> None:
            while not problems and not self.stop.is_set():
                try:
                    self.run(waiting.get_nowait(), slot)
                except queue.Empty:
                    return
                except BaseException as error:  # reported by the main thread
                    problems.append(error)

        threads = [threading.Thread(target=work, args=(slot,)) for slot in range(workers)]
        for thread in threads:
            thread.start()
        for thread in threads:
            while thread.is_alive():
                thread.join(0.5)  # signals are handled in between
                self.on_change()
        for problem in problems:
            raise problem
        if self.stop.is_set():
            raise Interrupted
