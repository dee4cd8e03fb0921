# SPDX-License-Identifier: Apache-2.0
"""Gantt chart of a part of a trace, live or simulated: one row per task."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from hotpath_report import style
from hotpath_report.errors import InputError
from hotpath_report.hotpath_command import executor_named
from hotpath_report.run import Run
from hotpath_report.style import FAINT, INK, SERIES, WARNING
from hotpath_report.tables import milliseconds, read_columns

TIMER_MANAGEMENT = 1  # worker of the events executors
BAR, ARROW = 0.56, 0.42  # height of a bar and of a release above the middle of its row
MOST_MARKS = 20000
INSTANTS = ["timestamp", "release", "start", "finish", "deadline"]
COLUMNS = [
    "executor",
    "repetition",
    "task",
    "kind",
    "outcome",
    "worker",
    *(f"{name}_ns" for name in INSTANTS),
]
MARKS: dict[str, dict[str, Any]] = {
    "skipped timestamp": {
        "marker": "x",
        "color": WARNING,
        "markersize": 7,
        "markeredgewidth": 1.8,
        "zorder": 5,
    },
    "overwritten sample": {
        "marker": "D",
        "color": "white",
        "markeredgecolor": WARNING,
        "markersize": 5,
        "zorder": 4,
    },
    "deadline missed": {
        "marker": "D",
        "color": WARNING,
        "markersize": 5.5,
        "markeredgecolor": "white",
        "zorder": 5,
    },
}
MARK_OF = {"skipped": "skipped timestamp", "overwritten": "overwritten sample"}  # by outcome

Interval = tuple[float, float]  # ms


class Window:
    """The jobs of one executor's repetition that touch [begin, end), in ms since the epoch; NaN for an instant that did
    not come."""

    def __init__(self, run: Run, executor: str, repetition: int, part: Interval) -> None:
        self.run, self.executor, (self.begin, self.end) = run, executor, part
        self.path = run.folder / "jobs.csv"
        self.traits = executor_named(executor)
        self.jobs = self.read(repetition)
        self.timer_thread = self.traits is not None and self.traits.has_timer_thread
        self.release_slots = self.paid_releases()
        self.displaced = self.displacements() if run.one_core and self.timer_thread else {}

    def read(self, repetition: int) -> pd.DataFrame:
        """The rows of jobs.csv. Raises InputError where there are none, or too many."""
        jobs = read_columns(self.path, COLUMNS)
        jobs = jobs[(jobs["executor"] == self.executor) & (jobs["repetition"] == str(repetition))].copy()
        if jobs.empty:
            raise InputError(
                f"{self.path}: no job of executor {self.executor}, repetition {repetition}; "
                f"the run has {', '.join(self.run.executors)}"
            )
        for name in INSTANTS:
            jobs[name] = milliseconds(jobs.pop(f"{name}_ns"), self.path)
        jobs["worker"] = pd.to_numeric(jobs["worker"]).fillna(0).astype(int)
        jobs["released"] = jobs["release"].fillna(jobs["timestamp"])
        last = jobs["finish"].fillna(jobs["start"] * 0 + self.end).fillna(jobs["timestamp"])
        jobs = jobs[(jobs["timestamp"] < self.end) & (np.maximum(last, jobs["timestamp"]) >= self.begin)]
        part = f"from {self.begin:g} to {self.end:g} ms"
        if jobs.empty:
            raise InputError(f"{self.path}: nothing happens {part}; choose other times")
        if len(jobs) > MOST_MARKS:
            raise InputError(
                f"{len(jobs)} jobs {part} are too many for a chart; choose a shorter part, or the trace for Perfetto"
            )
        return jobs.reset_index(drop=True)

    @property
    def late(self) -> pd.Series:
        """Which jobs finished after their deadline."""
        return self.jobs["finish"] > self.jobs["deadline"] + 1e-9

    def paid_releases(self) -> list[Interval]:
        """Intervals in which the releaser of a simulated executor pays for its releases."""
        if not self.run.simulated or self.traits is None or not self.timer_thread:
            return []
        delta, k = (self.run[f"platform.{name}_cost_us"] / 1e3 for name in ("release", "pass"))
        runs_at_once = self.traits.family == "events" and self.traits.timers == "release_and_execute"
        if runs_at_once or delta + k == 0:
            return []
        timers = self.jobs[self.jobs["kind"] == "timer"]["release"].value_counts().sort_index()
        return [(float(at), float(at) + k + n * delta) for at, n in timers.items()]

    def displacements(self) -> dict[int, list[Interval]]:
        """{index of a job: when another thread had its core}: on one core, a thread that starts while a job of another
        one runs has taken the core from it."""
        ran = self.jobs[self.jobs["finish"].notna()].sort_values("start")
        of_timers = ran[ran["worker"] == TIMER_MANAGEMENT]
        intruders = [*zip(of_timers["start"], of_timers["finish"]), *self.release_slots]
        found = {}
        for job in ran[ran["worker"] != TIMER_MANAGEMENT].itertuples():
            parts = [(max(a, job.start), min(b, job.finish)) for a, b in intruders]
            found[job.Index] = [(a, b) for a, b in parts if a < b]
        return {index: parts for index, parts in found.items() if parts}

    def tasks(self) -> list[str]:
        """Those that do something here, in the order of the graph if it is known."""
        found = list(dict.fromkeys(self.jobs["task"]))
        try:
            order = [task["task"] for task in self.run.summary()[0]["tasks"]]
        except (InputError, KeyError, IndexError):
            return found
        return sorted(found, key=lambda task: order.index(task) if task in order else len(order))

    def worker_name(self, worker: int) -> str:
        """What a worker is in this executor."""
        if not self.timer_thread:
            return f"worker {worker}"
        return "timer management thread" if worker == TIMER_MANAGEMENT else "executor thread"


def colour_of(worker: int) -> str:
    """The colour of a worker's bars."""
    return SERIES[worker % len(SERIES)]


def draw_job(axes: Axes, window: Window, job: Any, y: float) -> None:
    """Waiting time, bar, and what displaced it."""
    if np.isnan(job.start):
        return
    colour = colour_of(job.worker)
    finish = window.end if np.isnan(job.finish) else job.finish
    axes.hlines(y, job.released, job.start, color=FAINT, linewidth=1, linestyle=(0, (1, 1.5)), zorder=2)
    if finish - job.start < (window.end - window.begin) / 2000:
        axes.vlines(job.start, y - BAR / 2, y + BAR / 2, color=colour, linewidth=1.4, zorder=3)
    else:
        span = [(job.start, finish - job.start)]
        axes.broken_barh(span, (y - BAR / 2, BAR), facecolor=colour, alpha=0.85, linewidth=0, zorder=3)
    spans = [(begin, end - begin) for begin, end in window.displaced.get(job.Index, [])]
    look = {"facecolor": "white", "edgecolor": colour, "hatch": "/////", "linewidth": 0.5, "zorder": 3.5}
    axes.broken_barh(spans, (y - BAR / 2, BAR), **look)
    if finish > job.deadline + 1e-9 and not np.isnan(job.finish):
        axes.plot(finish, y, linestyle="", **MARKS["deadline missed"])


def draw_row(axes: Axes, window: Window, task: str, y: float) -> None:
    """The jobs of one task. Rows run downwards, so a release points up."""
    arrow = {
        "arrowstyle": "-|>",
        "color": INK,
        "linewidth": 0.9,
        "mutation_scale": 7,
        "shrinkA": 0,
        "shrinkB": 0,
    }
    for job in window.jobs[window.jobs["task"] == task].itertuples():
        if job.outcome in MARK_OF:
            axes.plot(job.timestamp, y, linestyle="", **MARKS[MARK_OF[job.outcome]])
        elif job.outcome != "empty":
            ends = (job.released, y - ARROW), (job.released, y + BAR / 2)
            axes.annotate("", *ends, zorder=4, annotation_clip=True, arrowprops=arrow)
            draw_job(axes, window, job, y)


def draw_releaser(axes: Axes, window: Window, y: float) -> None:
    """When timers were released: of interest where a separate thread does so."""
    colour = colour_of(TIMER_MANAGEMENT)
    if window.release_slots:
        spans = [(begin, end - begin) for begin, end in window.release_slots]
        axes.broken_barh(
            spans, (y - BAR / 2, BAR), facecolor=colour, edgecolor=colour, linewidth=0.8, zorder=3
        )
        return
    instants = window.jobs[window.jobs["kind"] == "timer"]["release"].dropna().unique()
    axes.vlines(sorted(instants), y - BAR / 2, y + BAR / 2, color=colour, linewidth=1.4, zorder=3)


def add_key(figure: Any, window: Window) -> None:
    """The workers' colours, and the marks that occur."""
    workers = sorted(window.jobs[window.jobs["start"].notna()]["worker"].unique())
    handles: list[Any] = [
        style.patch(window.worker_name(w), facecolor=colour_of(w), alpha=0.85) for w in workers
    ]
    handles.append(style.dot("release", "$↑$", markersize=9))
    if window.displaced:
        handles.append(style.patch("displaced", facecolor="white", edgecolor=SERIES[0], hatch="/////"))
    found = {MARK_OF[o] for o in window.jobs["outcome"].unique() if o in MARK_OF}
    if window.late.any():
        found.add("deadline missed")
    handles += [style.dot(name, **look) for name, look in MARKS.items() if name in found]
    style.add_key(figure, handles, 8)


def draw_run(
    folder: str, executor: str, repetition: int, begin: float, end: float, output: str | None
) -> None:
    """Writes the chart as .svg and, beside it, as .png. `begin` and `end` in ms. Raises InputError."""
    run = Run(folder)
    window = Window(run, executor, repetition, (begin, end))
    labels = window.tasks()
    releaser = window.timer_thread and (window.jobs["kind"] == "timer").any()
    figure, (axes,) = style.new_figure(13.5, 0.7 + 0.34 * (len(labels) + releaser))
    for y, task in enumerate(labels):
        draw_row(axes, window, task, y)
    if releaser:
        draw_releaser(axes, window, len(labels))
        labels.append("timer management thread" if window.release_slots else "releases of timers")
    style.rows_of_labels(axes, labels)
    axes.set_xlim(begin, end)
    axes.set_xlabel("time since the epoch of the run (ms)")
    add_key(figure, window)
    style.add_title(figure, f"Timeline of {executor}", run.what_ran(), run.partial)
    path = Path(output or run.folder / "timeline.svg")
    style.save(figure, path.parent, path.stem)
