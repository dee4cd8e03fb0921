# SPDX-License-Identifier: Apache-2.0
"""Reads run folders. Times in their files are relative to the run's epoch."""

import functools
import itertools
import shlex
from pathlib import Path
from typing import Any

from hotpath_report.errors import InputError
from hotpath_report.files import Rows, read_json
from hotpath_report.hotpath_command import ask
from hotpath_report.shown_text import printable
from hotpath_report.statistics import Samples, grouped

SOURCES = ("simulated", "live")
# How a live job spends its execution time, and why.
WORK = {
    "cpu_time": (
        "work in CPU time",
        "A job ends after an amount of its thread's CPU time, so that the load is the same on every processor.",
    ),
    "wall": (
        "work until an instant of the clock",
        "A job ends at an instant of the clock, as in the paper's task sets: a preemption shortens its work.",
    ),
    "fixed": (
        "a fixed amount of work",
        "A job does a fixed amount of work, as in ROS 2's reference system: a slow processor raises the load.",
    ),
}
LARGEST_ANALYZED = 200_000_000  # bytes of jobs.csv
COUNTS = ["reached", "ran", "skipped", "deadline_overruns"]  # per timer


def cpu_list(cpus: list[int]) -> str:
    """CPU numbers in the kernel's list format: 0-3,8."""
    neighbours = itertools.groupby(enumerate(sorted(cpus)), lambda place: place[1] - place[0])
    ranges = [[cpu for _, cpu in found] for _, found in neighbours]
    return ",".join(f"{cpus[0]}-{cpus[-1]}" if len(cpus) > 1 else str(cpus[0]) for cpus in ranges)


def samples_of(rows: Rows, value: str, exact: bool) -> dict[str, dict[str, Samples]]:
    """{name: {executor: samples}} (ms) of rows as Run.samples() has them, without unknown values."""
    found: dict[str, dict[str, Samples]] = {}
    for (name, executor), of in grouped(rows, "name", "executor").items():
        if samples := Samples(([ms for ms in row[value] if ms is not None] for row in of), exact):
            found.setdefault(name, {})[executor] = samples
    return found


class Run:
    """One run folder."""

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        self.path = self.folder / "run.json"
        self.facts: dict[str, Any] = read_json(self.path)
        self.executors: list[str] = self["executors"]
        if not self.executors:
            raise InputError(f"{self.path}: `executors` is empty, there is nothing to draw")
        self.partial = self.facts.get("complete") is not True  # the run did not finish
        self.simulated = self.facts.get("kind") == "simulated"
        self.recorded = self.facts.get("kind") == "recorded"  # imported from a trace of another system
        self.live = not self.simulated and not self.recorded
        self.source = SOURCES[not self.simulated]

    def __getitem__(self, key: str) -> Any:
        """The value of a dotted key of run.json. Raises InputError."""
        value: Any = self.facts
        for part in key.split("."):
            if not isinstance(value, dict) or part not in value:
                raise InputError(f"{self.path}: key `{key}` is missing")
            value = value[part]
        return value

    def work(self) -> tuple[str, str] | tuple[()]:
        """How the jobs of a live run spend their execution time, and why."""
        return WORK[self["work"]] if self.live else ()

    def what_ran(self) -> str:
        """Two lines: the experiment, and its machine or the costs of the simulated platform."""
        cores = self["platform.cores"] if not self.live else None
        place = (
            f"CPU {cpu_list(self['cpus'])}" if self.live else "one core" if cores == 1 else f"{cores} cores"
        )
        how = [self["graph.name"], self["transport"] if self.live else self.facts["kind"]]
        how += [f"{self['load_percent']:.3g} % load", *self.work()[:1], f"phases: {self['phases']}"]
        length = f"{self['repetitions']} × {self['duration_s']:.3g} s"
        if disturbed := sum(len(e.get("disturbed", [])) for e in self.summarized("executors")):
            length += f", {disturbed} of {len(self['runs'])} repetitions disturbed"
        if self.recorded:
            where = ["read from a trace of ros2_tracing"]
        elif self.live:
            where = [self["machine.cpu_model"], f"Linux {self['machine.kernel']}"]
        else:
            costs = [(k, v) for k, v in self["platform"].items() if k.endswith("_us") and v]
            where = [f"{key.removesuffix('_us').replace('_', ' ')} {us:g} µs" for key, us in costs]
            where = [*(where or ["no costs"]), f"execution times: {self['execution_times']}"]
        return " · ".join([*how, f"on {place}", length]) + "\n" + " · ".join(where)

    def samples(self, of: str) -> Rows:
        """Samples after the warm-up, by executor and repetition: of `chains` in the columns `hot_path_ms` and `age_ms`,
        or the `responses` of tasks in `response_ms`. Raises InputError without them."""
        found = ask(of, str(self.folder))
        rows = (row | {k: printable(row[k]) for k in ("name", "executor")} for row in found)
        return sorted(rows, key=lambda row: (self.executors.index(row["executor"]), row["repetition"]))

    @functools.cached_property
    def _summary(self) -> dict[str, Any]:
        return dict(read_json(self.folder / "summary.json"))

    def summarized(self, key: str) -> list[Any]:
        """A list of summary.json; empty without summary.json."""
        return list(self._summary.get(key, [])) if (self.folder / "summary.json").exists() else []

    def summary(self) -> list[dict[str, Any]]:
        """The executors of summary.json."""
        return list(self._summary["executors"])

    def timer_counts(self) -> Rows:
        """Timers after the warm-up: executor, task, COUNTS, deadline_ms, response_max_ms, bound_ms."""
        bounds = {(b["executor"], b["task"]): b["ms"] for b in self.facts.get("bounds", [])}
        return [
            {"executor": e["executor"], "task": t["task"]}
            | {count: t["after_warm_up"][count] for count in COUNTS}
            | {"deadline_ms": t["deadline_ms"], "response_max_ms": (t.get("response_ms") or {}).get("max")}
            | {"bound_ms": bounds.get((e["executor"], t["task"]))}
            for e in self.summary()
            for t in e["tasks"]
            if "after_warm_up" in t
        ]

    def is_quickly_read(self) -> bool:
        """Whether `hotpath analyze` and `explain`, which read its jobs, take a short time."""
        jobs = self.folder / "jobs.csv"
        return jobs.exists() and jobs.stat().st_size <= LARGEST_ANALYZED

    def command(self) -> str:
        """Command line that repeats the run; empty: imported."""
        words = self.facts.get("command", [])
        return shlex.join(["hotpath", *words]) if words else ""
