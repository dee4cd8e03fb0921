# SPDX-License-Identifier: Apache-2.0
"""One line on a terminal: how much is done, time left, what runs. Nothing in a log."""

import sys
import time
from typing import TextIO

from hotpath_report.paper.cells import Cell
from hotpath_report.paper.runner import Runner

SIMULATIONS_AT_ONCE = 2


def duration_text(seconds: float) -> str:
    """Hours and minutes, or minutes and seconds."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes:02} min"
    return f"{minutes} min {rest:02} s" if minutes else f"{rest} s"


class Progress:
    """Shows what a runner does; `jobs`: live cells at once."""

    def __init__(self, cells: list[Cell], runner: Runner, jobs: int, stream: TextIO = sys.stderr) -> None:
        self.cells, self.runner, self.jobs, self.stream = cells, runner, jobs, stream

    def show(self) -> None:
        """Writes the line anew."""
        if not self.stream.isatty():
            return
        with self.runner.lock:
            finished = {cell.name for cell in self.runner.done} | {
                cell.name for cell, _ in self.runner.failed
            }
            running = {name: time.time() - r.started for name, r in self.runner.running.items()}
        left = 0.0
        for cell in self.cells:
            if cell.name not in finished:
                at_once = (
                    SIMULATIONS_AT_ONCE if cell.source != "live" else self.jobs if cell.cores == 1 else 1
                )
                left += max(0, cell.seconds - running.get(cell.name, 0)) / at_once
        line = f"[{len(finished)}/{len(self.cells)}] {duration_text(left)} left  {', '.join(running)}"
        self.stream.write("\r\x1b[K" + line[:110])
        self.stream.flush()

    def end(self) -> None:
        """Removes the line."""
        if self.stream.isatty():
            self.stream.write("\r\x1b[K")
            self.stream.flush()
