# SPDX-License-Identifier: Apache-2.0
"""Gantt chart of part of a trace: one row per task."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from hotpath_report import style
from hotpath_report.errors import InputError
from hotpath_report.hotpath_command import executor_named
from hotpath_report.run import TIMER_MANAGEMENT, Run
from hotpath_report.style import FAINT, INK, SERIES, WARNING

BAR, ARROW = 0.56, 0.42  # height of a bar, and of a release arrow above the row's middle
MOST_MARKS = 20000
MARKS: dict[str, dict[str, Any]] = {
    "skipped timestamp": dict(marker="x", color=WARNING, markersize=7, markeredgewidth=1.8, zorder=5),
    "overwritten sample": dict(marker="D", color="white", markeredgecolor=WARNING, markersize=5, zorder=4),
    "deadline missed": dict(marker="D", color=WARNING, markersize=5.5, markeredgecolor="white", zorder=5),
}
MARK_OF = {"skipped": "skipped timestamp", "overwritten": "overwritten sample"}  # by outcome

Interval = tuple[float, float]  # ms


class Window:
    """The jobs of one repetition that touch [begin, end), in ms; NaN: did not happen."""

    def __init__(self, run: Run, executor: str, repetition: int, part: Interval) -> None:
        self.run, self.executor, (self.begin, self.end) = run, executor, part
        self.traits = executor_named(executor)
        self.jobs = self.read(repetition)
        self.late = self.jobs["late"]
        self.timer_thread = run.has_timer_thread(executor)
        self.release_slots = self.paid_releases()
        one_core = (
            run["platform.cores"] if run.simulated or run.recorded else len(run.facts.get("cpus", []))
        ) == 1
        self.displaced = self.displacements() if one_core and self.timer_thread else {}

    def read(self, repetition: int) -> pd.DataFrame:
        """The rows of jobs.csv. Raises InputError if there are none or too many."""
        path = self.run.folder / "jobs.csv"
        jobs = self.run.jobs(self.executor, repetition, self.begin, self.end)
        jobs["released"] = jobs["release"].fillna(jobs["timestamp"])
        last = jobs["finish"].fillna(jobs["start"] * 0 + self.end).fillna(jobs["timestamp"])
        jobs = jobs[(jobs["timestamp"] < self.end) & (np.maximum(last, jobs["timestamp"]) >= self.begin)]
        part = f"from {self.begin:g} to {self.end:g} ms"
        if jobs.empty:
            raise InputError(f"{path}: nothing happens {part}; choose other times")
        if len(jobs) > MOST_MARKS:
            raise InputError(
                f"{len(jobs)} jobs {part} are too many for a chart; choose a shorter part, or the trace for Perfetto"
            )
        return jobs.reset_index(drop=True)

    def paid_releases(self) -> list[Interval]:
        """Intervals that a simulated executor's releaser spends on releases."""
        if not self.run.simulated or self.traits is None or not self.timer_thread:
            return []
        delta, k = (self.run[f"platform.{name}_cost_us"] / 1e3 for name in ("release", "pass"))
        runs_at_once = self.traits.family == "events" and self.traits.timers == "release_and_execute"
        if runs_at_once or delta + k == 0:
            return []
        timers = self.jobs[self.jobs["kind"] == "timer"]["release"].value_counts().sort_index()
        return [(float(at), float(at) + k + n * delta) for at, n in timers.items()]

    def displacements(self) -> dict[int, list[Interval]]:
        """{index of a job: intervals in which another thread had its core}. On one core, a thread
        that starts during a job of another thread has displaced it."""
        ran = self.jobs[self.jobs["finish"].notna()].sort_values("start")
        of_timers = ran[ran["worker"] == TIMER_MANAGEMENT]
        intruders = [*zip(of_timers["start"], of_timers["finish"]), *self.release_slots]
        found = {}
        for job in ran[ran["worker"] != TIMER_MANAGEMENT].itertuples():
            parts = [(max(a, job.start), min(b, job.finish)) for a, b in intruders]
            found[job.Index] = [(a, b) for a, b in parts if a < b]
        return {index: parts for index, parts in found.items() if parts}

    def tasks(self) -> list[str]:
        """Tasks with jobs in the window, in graph order if known."""
        found = list(dict.fromkeys(self.jobs["task"]))
        try:
            order = [task["task"] for task in self.run.summary()[0]["tasks"]]
        except (InputError, KeyError, IndexError):
            order = found
        return sorted(found, key=lambda task: order.index(task) if task in order else len(order))


def colour_of(worker: int) -> str:
    """The colour of a worker's bars."""
    return SERIES[worker % len(SERIES)]


def draw_spans(axes: Axes, spans: list[Interval], y: float, **look: Any) -> None:
    """Bars from begin to end."""
    axes.broken_barh([(begin, end - begin) for begin, end in spans], (y - BAR / 2, BAR), **look)


def draw_job(axes: Axes, window: Window, job: Any, y: float) -> None:
    """Draws waiting time, execution and displacement of a job."""
    if np.isnan(job.start):
        return
    colour = colour_of(job.worker)
    finish = window.end if np.isnan(job.finish) else job.finish
    axes.hlines(y, job.released, job.start, color=FAINT, linewidth=1, linestyle=(0, (1, 1.5)), zorder=2)
    if finish - job.start < (window.end - window.begin) / 2000:
        axes.vlines(job.start, y - BAR / 2, y + BAR / 2, color=colour, linewidth=1.4, zorder=3)
    else:
        draw_spans(axes, [(job.start, finish)], y, facecolor=colour, alpha=0.85, linewidth=0, zorder=3)
    look = {"facecolor": "white", "edgecolor": colour, "hatch": "/////", "linewidth": 0.5, "zorder": 3.5}
    draw_spans(axes, window.displaced.get(job.Index, []), y, **look)
    if window.late[job.Index]:
        axes.plot(finish, y, linestyle="", **MARKS["deadline missed"])


def draw_row(axes: Axes, window: Window, task: str, y: float) -> None:
    """Draws the jobs of one task; release arrows point up."""
    arrow = dict(arrowstyle="-|>", color=INK, linewidth=0.9, mutation_scale=7, shrinkA=0, shrinkB=0)
    for job in window.jobs[window.jobs["task"] == task].itertuples():
        if job.outcome in MARK_OF:
            axes.plot(job.timestamp, y, linestyle="", **MARKS[MARK_OF[job.outcome]])
        elif job.outcome != "empty":
            ends = (job.released, y - ARROW), (job.released, y + BAR / 2)
            axes.annotate("", *ends, zorder=4, annotation_clip=True, arrowprops=arrow)
            draw_job(axes, window, job, y)


def draw_releaser(axes: Axes, window: Window, y: float) -> str:
    """Draws the releases of a separate releaser thread. Returns the row's label."""
    colour = colour_of(TIMER_MANAGEMENT)
    if window.release_slots:
        look = {"facecolor": colour, "edgecolor": colour, "linewidth": 0.8, "zorder": 3}
        draw_spans(axes, window.release_slots, y, **look)
        return "timer management thread"
    instants = window.jobs[window.jobs["kind"] == "timer"]["release"].dropna().unique()
    axes.vlines(sorted(instants), y - BAR / 2, y + BAR / 2, color=colour, linewidth=1.4, zorder=3)
    return "releases of timers"


def add_key(figure: Any, window: Window) -> None:
    """Adds the legend: colours of workers, and the marks used."""
    handles: list[Any] = []
    for worker in sorted(window.jobs[window.jobs["start"].notna()]["worker"].unique()):
        name = window.run.worker_name(worker, window.timer_thread)
        handles.append(style.patch(name, facecolor=colour_of(worker), alpha=0.85))
    handles.append(style.dot("release", style.glyph("↑"), markersize=9))
    if window.displaced:
        handles.append(style.patch("displaced", facecolor="white", edgecolor=SERIES[0], hatch="/////"))
    found = {MARK_OF.get(outcome) for outcome in window.jobs["outcome"]}
    if window.late.any():
        found.add("deadline missed")
    handles += [style.dot(name, **look) for name, look in MARKS.items() if name in found]
    style.add_key(figure, handles, 8)


def draw(run: Run, executor: str, repetition: int, part: Interval, path: Path, option: str) -> None:
    """Writes the chart as .svg and .png; `option` named the file, if any. Raises InputError."""
    window = Window(run, executor, repetition, part)
    labels = window.tasks()
    releaser = window.timer_thread and (window.jobs["kind"] == "timer").any()
    figure, (axes,) = style.new_figure(13.5, 0.7 + 0.34 * (len(labels) + releaser))
    for y, task in enumerate(labels):
        draw_row(axes, window, task, y)
    if releaser:
        labels.append(draw_releaser(axes, window, len(labels)))
    label = "time since the epoch of the run (ms)"
    style.rows_of_labels(axes, labels, xlim=part, xlabel=label)
    add_key(figure, window)
    style.add_title(figure, f"Timeline of {executor}", run.what_ran(), run.partial)
    style.save(figure, path.parent, path.stem, option)
