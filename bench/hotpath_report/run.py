# SPDX-License-Identifier: Apache-2.0
"""Reads run folders. Times in their files are relative to the run's epoch."""

import functools
import io
import itertools
import math
import shlex
from pathlib import Path
from typing import Any

import pandas as pd

from hotpath_report import hotpath_command
from hotpath_report.errors import InputError
from hotpath_report.tables import NS_PER_MS, read_json, read_table

SOURCES = ("simulated", "live")
TIMER_MANAGEMENT = 1  # worker number in events executors
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
COUNTS = ["reached", "ran", "skipped", "deadline_overruns"]  # per timer


def cpu_list(cpus: list[int]) -> str:
    """CPU numbers in the kernel's list format: 0-3,8."""
    neighbours = itertools.groupby(enumerate(sorted(cpus)), lambda place: place[1] - place[0])
    ranges = [[cpu for _, cpu in found] for _, found in neighbours]
    return ",".join(f"{cpus[0]}-{cpus[-1]}" if len(cpus) > 1 else str(cpus[0]) for cpus in ranges)


class Run:
    """One run folder."""

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        self.path = self.folder / "run.json"
        self.facts: dict[str, Any] = read_json(self.path)
        self.executors: list[str] = self["executors"]
        if not self.executors:
            raise InputError(f"{self.path}: `executors` is empty, there is nothing to draw")
        if any("replaced_by" in r for r in self.facts.get("runs", [])):
            raise InputError(
                f"{self.path}: repetitions were measured again because the processor was slow; measure it again"
            )
        self.partial = self.facts.get("complete") is not True  # the run did not finish
        self.simulated = self.facts.get("kind") == "simulated"
        self.recorded = self.facts.get("kind") == "recorded"  # imported from a trace of another system
        self.source = SOURCES[not self.simulated]

    def __getitem__(self, key: str) -> Any:
        """The value of a dotted key of run.json. Raises InputError."""
        value: Any = self.facts
        for part in key.split("."):
            if not isinstance(value, dict) or part not in value:
                raise InputError(f"{self.path}: key `{key}` is missing")
            value = value[part]
        return value

    def conditions(self) -> str:
        """Conditions of the run, without graph and load."""
        if self.simulated or self.recorded:
            cores = self["platform.cores"]
            where = "one core" if cores == 1 else f"{cores} cores"
        else:
            where = f"CPU {cpu_list(self['cpus'])}"
        length = f"{self['repetitions']} × {self['duration_s']:.3g} s"
        disturbed = len(self.disturbances())
        planned = self["repetitions"] * len(self.executors)
        length += f", {disturbed} of {planned} repetitions disturbed" if disturbed else ""
        work = "".join(f"{words} · " for words in (self.work() or ())[:1])
        return f"{work}phases: {self['phases']} · on {where} · {length}"

    def work(self) -> tuple[str, str] | None:
        """How the jobs of a live run spend their execution time, and why."""
        return None if self.simulated or self.recorded else WORK[self["work"]]

    def what_ran(self) -> str:
        """Two lines: the experiment, and its machine."""
        how = self.facts["kind"] if self.simulated or self.recorded else self["transport"]
        load = f"{self['load_percent']:.3g} % load"
        return f"{self['graph.name']} · {how} · {load} · {self.conditions()}\n{self.where()}"

    def where(self) -> str:
        """The machine, or the costs of the simulated platform."""
        if self.recorded:
            return "read from a trace of ros2_tracing"
        if not self.simulated:
            return f"{self['machine.cpu_model']} · Linux {self['machine.kernel']}"
        charged = [
            f"{key.removesuffix('_us').replace('_', ' ')} {value:g} µs"
            for key, value in self["platform"].items()
            if key.endswith("_us") and value
        ]
        return " · ".join([*(charged or ["no costs"]), f"execution times: {self['execution_times']}"])

    def disturbances(self) -> list[tuple[str, int, list[str]]]:
        """Executor, repetition and marks of each disturbed repetition; empty without a summary."""
        path = self.folder / "summary.json"
        executors = self.summary() if not self.simulated and path.exists() else []
        return [
            (e["executor"], r["repetition"], r["marks"]) for e in executors for r in e.get("disturbed", [])
        ]

    def latencies(self) -> pd.DataFrame:
        """Chain outputs after the warm-up: executor, repetition, chain, hot_path_ms."""
        columns = ["executor", "chain", "hot_path_latency_ns", "repetition"]
        frame = read_table(self.folder / "chains.csv", columns)[columns]
        frame["hot_path_ms"] = frame.pop("hot_path_latency_ns") / NS_PER_MS
        return frame

    def jobs_file(self) -> Path:
        """Path of jobs.csv. Raises InputError if the run kept no jobs."""
        path = self.folder / "jobs.csv"
        if not path.exists():
            why = "the run kept no jobs (--no-trace), or the file was removed"
            again = self.command(without="--no-trace")
            raise InputError(f"{path}: {why}" + (f"; repeat it: {again}" if again else ""))
        return path

    def jobs(self, executor: str, repetition: int, begin: float, end: float) -> pd.DataFrame:
        """Rows of jobs.csv that touch [begin, end), with times in ms (NaN if the event did not
        happen). `late` marks a timer's job that finished after its deadline. `hotpath` selects the
        rows, because a run can exceed memory. Raises InputError if the repetition did not run."""
        path = self.jobs_file()
        words = ["--executors", executor, "--repetition", repetition, "--from", begin]
        if math.isfinite(end):
            words += ["--to", end]
        text = hotpath_command.output_of("feed", "jobs", self.folder, *words)
        instants = ["timestamp", "release", "start", "finish", "deadline"]
        named = ["executor", "repetition", "task", "kind", "sequence", "outcome"]
        more = ["worker", "process", "parent_task", "parent_sequence"]
        jobs = read_table(path, named, [*more, *(f"{name}_ns" for name in instants)], io.StringIO(text))
        # Subscriptions inherit deadlines, under EDF for their order; they never overrun.
        jobs["late"] = (jobs["kind"] == "timer") & (jobs["finish_ns"] > jobs["deadline_ns"])
        jobs = jobs.assign(**{name: jobs.pop(f"{name}_ns") / NS_PER_MS for name in instants})
        for name in ("worker", "process"):
            jobs[name] = jobs[name].fillna(0).astype(int)
        return jobs

    def worker_name(self, executor: str, worker: int) -> str:
        """Display name of a worker. Events executors release timers in a thread of their own."""
        traits = hotpath_command.executor_named(executor)  # None: a deployment
        if traits is None or traits.family == "wait_set":
            return f"worker {worker}"
        return "timer management thread" if worker == TIMER_MANAGEMENT else "executor thread"

    def all_responses(self) -> pd.DataFrame:
        """Jobs that ran after the warm-up: executor, repetition, task, response_ms. `hotpath`
        computes them from jobs.csv."""
        path = self.jobs_file()
        text = hotpath_command.output_of("feed", "responses", self.folder)
        columns = ["executor", "repetition", "task", "response_ns"]
        frame = read_table(path, columns, rows=io.StringIO(text))
        frame["response_ms"] = frame.pop("response_ns") / NS_PER_MS
        return frame

    def responses(self) -> pd.DataFrame:
        """The rows of all_responses() of timers."""
        timers = self.timer_counts()[["executor", "task"]]
        return self.all_responses().merge(timers, on=["executor", "task"])  # keeps the left frame's order

    @functools.cache
    def summary(self) -> list[dict[str, Any]]:
        """The executors of summary.json."""
        executors: list[dict[str, Any]] = read_json(self.folder / "summary.json")["executors"]
        return executors

    @functools.cache
    def timer_counts(self) -> pd.DataFrame:
        """Timers after the warm-up: executor, task, COUNTS, deadline_ms, response_max_ms, bound_ms."""
        bounds = {(b["executor"], b["task"]): b["ms"] for b in self.facts.get("bounds", [])}
        rows = [
            t
            | t["after_warm_up"]
            | {"executor": e["executor"], "bound_ms": bounds.get((e["executor"], t["task"]))}
            | {"response_max_ms": (t.get("response_ms") or {}).get("max")}
            for e in self.summary()
            for t in e["tasks"]
            if "after_warm_up" in t
        ]
        columns = ["executor", "task", *COUNTS, "deadline_ms", "response_max_ms", "bound_ms"]
        return pd.DataFrame(rows, columns=columns).astype({"response_max_ms": float})

    def command(self, without: str = "") -> str:
        """Command line that repeats the run, omitting `without`; empty: imported, or an older version."""
        words = [word for word in self.facts.get("command", []) if word != without]
        return shlex.join(["hotpath", *words]) if words else ""
