# SPDX-License-Identifier: Apache-2.0
"""Gantt chart of part of a trace: a row per task; jobs have the colour of their chain."""

import itertools
from collections.abc import Mapping, Sequence
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

# Colours of chains, the first one as in pictures of graphs and in RViz.
CHAINS = ("#C62828", SERIES[0], SERIES[2], SERIES[5])
OTHER_TASKS = "other tasks"

Interval = tuple[float, float]  # ms
Chains = Mapping[str, Sequence[str]]  # tasks by name of the chain


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
        self.has_releases = bool(self.timer_thread and (self.jobs["kind"] == "timer").any())

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


def paint(windows: Sequence[Window], chains: Chains) -> dict[str, str]:
    """Sets the column `colour` of all jobs; returns the colours by name. Jobs have the colour of
    their task's first chain if one thread ran them all, otherwise of their thread."""
    chain_of = {task: name for name, tasks in reversed(chains.items()) for task in tasks}
    threads: dict[str, str] = {}
    one_thread = True
    for window in windows:
        workers = sorted(window.jobs[window.jobs["start"].notna()]["worker"].unique())
        one_thread &= len(workers) <= 1
        threads |= {window.run.worker_name(w, window.timer_thread): thread_colour(w) for w in workers}
        window.jobs["colour"] = window.jobs["worker"].map(thread_colour)
    if not (one_thread and chain_of):
        return threads
    colours = dict(zip(chains, itertools.cycle(CHAINS)))
    for window in windows:
        window.jobs["colour"] = window.jobs["task"].map(chain_of).map(colours).fillna(FAINT)
    return {f"chain {name}": colour for name, colour in colours.items()} | {OTHER_TASKS: FAINT}


def rows_of(windows: Sequence[Window], chains: Chains) -> list[str]:
    """The rows of each chart, from the column `row` of the jobs, which it sets. Several charts have
    a row for each task of a chain, by its first start, and one for all other tasks."""
    members = {task for tasks in chains.values() for task in tasks}
    if len(windows) == 1 or not members:
        for window in windows:
            window.jobs["row"] = window.jobs["task"]
        return list(dict.fromkeys(task for window in windows for task in window.tasks()))
    jobs = pd.concat(window.jobs for window in windows)
    first = jobs[jobs["task"].isin(members)].groupby("task", sort=False)["start"].min()
    for window in windows:
        window.jobs["row"] = window.jobs["task"].where(window.jobs["task"].isin(members), OTHER_TASKS)
    return [*first.sort_values(kind="stable").index, OTHER_TASKS]


def thread_colour(worker: int) -> str:
    """The colour of a worker's bars."""
    return SERIES[worker % len(SERIES)]


def draw_spans(axes: Axes, spans: list[Interval], y: float, **look: Any) -> None:
    """Bars from begin to end."""
    axes.broken_barh([(begin, end - begin) for begin, end in spans], (y - BAR / 2, BAR), **look)


def draw_job(axes: Axes, window: Window, job: Any, y: float) -> None:
    """Draws execution and displacement of a job."""
    finish = window.end if np.isnan(job.finish) else job.finish
    if finish - job.start < (window.end - window.begin) / 2000:
        axes.vlines(job.start, y - BAR / 2, y + BAR / 2, color=job.colour, linewidth=1.4, zorder=3)
    else:
        draw_spans(axes, [(job.start, finish)], y, facecolor=job.colour, alpha=0.85, linewidth=0, zorder=3)
    look = {"facecolor": "white", "edgecolor": job.colour, "hatch": "/////", "linewidth": 0.5, "zorder": 3.5}
    draw_spans(axes, window.displaced.get(job.Index, []), y, **look)
    if window.late[job.Index]:
        axes.plot(finish, y, linestyle="", **MARKS["deadline missed"])


def draw_row(axes: Axes, window: Window, row: str, y: float) -> None:
    """Draws the jobs of a row; arrows mark releases, dotted lines waiting jobs. The row of other
    tasks has no room for them."""
    arrow = dict(arrowstyle="-|>", color=INK, linewidth=0.9, mutation_scale=7, shrinkA=0, shrinkB=0)
    dotted = {"color": FAINT, "linewidth": 1, "linestyle": (0, (1, 1.5)), "zorder": 2}
    for job in window.jobs[window.jobs["row"] == row].itertuples():
        if job.outcome in MARK_OF:
            axes.plot(job.timestamp, y, linestyle="", **MARKS[MARK_OF[job.outcome]])
        elif job.outcome != "empty" and row != OTHER_TASKS:
            ends = (job.released, y - ARROW), (job.released, y + BAR / 2)
            axes.annotate("", *ends, zorder=4, annotation_clip=True, arrowprops=arrow)
            if not np.isnan(job.start):
                axes.hlines(y, job.released, job.start, **dotted)
        if not np.isnan(job.start):
            draw_job(axes, window, job, y)


def draw_releaser(axes: Axes, window: Window, y: float) -> str:
    """Draws the releases of a separate releaser thread. Returns the row's label."""
    colour = thread_colour(TIMER_MANAGEMENT)
    if window.release_slots:
        look = {"facecolor": colour, "edgecolor": colour, "linewidth": 0.8, "zorder": 3}
        draw_spans(axes, window.release_slots, y, **look)
        return "timer management thread"
    instants = window.jobs[window.jobs["kind"] == "timer"]["release"].dropna().unique()
    axes.vlines(sorted(instants), y - BAR / 2, y + BAR / 2, color=colour, linewidth=1.4, zorder=3)
    return "releases of timers"


def add_key(figure: Any, windows: Sequence[Window], colours: dict[str, str]) -> None:
    """Adds the legend: colours of jobs, and the marks used."""
    handles = [style.patch(name, facecolor=colour, alpha=0.85) for name, colour in colours.items()]
    handles.append(style.dot("release", style.glyph("↑"), markersize=9))
    if any(window.displaced for window in windows):
        handles.append(style.patch("displaced", facecolor="white", edgecolor=SERIES[0], hatch="/////"))
    found = {MARK_OF.get(outcome) for window in windows for outcome in window.jobs["outcome"]}
    if any(window.late.any() for window in windows):
        found.add("deadline missed")
    handles += [style.dot(name, **look) for name, look in MARKS.items() if name in found]
    style.add_key(figure, handles, 8)


def draw(windows: Sequence[Window], chains: Chains, path: Path, option: str) -> None:
    """Writes a chart per window, one below the other, as .svg and .png; `option` named the file, if
    any. `chains`: the tasks of each chain. Raises InputError."""
    colours, run = paint(windows, chains), windows[0].run
    rows = rows_of(windows, chains)
    height = len(rows) + any(window.has_releases for window in windows)
    figure, panels = style.new_figure(13.5, 0.7 + 0.34 * height, len(windows))
    for axes, window in zip(panels, windows):
        for y, row in enumerate(rows):
            draw_row(axes, window, row, y)
        releases = [draw_releaser(axes, window, len(rows))] if window.has_releases else []
        style.rows_of_labels(axes, rows + releases, xlim=(window.begin, window.end))
        axes.set_ylim(height - 0.45, None)  # the same scale in all charts
        if len(windows) > 1:
            axes.set_title(window.executor)
    panels[-1].set_xlabel("time since the epoch of the run (ms)")
    add_key(figure, windows, colours)
    names = " and ".join(window.executor for window in windows)
    style.add_title(figure, f"Timeline of {names}", run.what_ran(), run.partial)
    style.save(figure, path.parent, path.stem, option)
