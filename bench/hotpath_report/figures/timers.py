# SPDX-License-Identifier: Apache-2.0
"""Dropped jobs and response times of timers-only sets, as in the paper's Section VII-A."""

import functools
import itertools
import math
from collections.abc import Mapping, Sequence
from operator import itemgetter
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hotpath_report import style
from hotpath_report.figures import violins
from hotpath_report.figures.violins import Row
from hotpath_report.files import Rows
from hotpath_report.run import SOURCES
from hotpath_report.statistics import Samples, grouped, percent_of, total
from hotpath_report.style import FAINT, INK

BAND = 0.82  # share of a row's height for all settings
# Groups of timers, by part of the task name.
GROUPS = {"camera": "cameras", "lidar": "LiDARs", "imu": "IMU"}


def group_of(task: str) -> str | None:
    """The group of a timer."""
    return next((group for group in GROUPS if group in task.lower()), None)


class TimerRuns:
    """Timers of several runs after the warm-up.

    `counts` has a row per utilisation, source, executor, repetition and task: COUNTS, deadline_ms,
    bound_ms and, if known, response_max_ms. `responses` has one, too, with all response_ms in the order of time.
    """

    KEY = ("utilisation_percent", "source", "executor")

    def __init__(self, counts: Rows, responses: Rows) -> None:
        self.counts: Rows = [row | {"group": group_of(row["task"])} for row in counts]
        self.executors = list(grouped(counts, "executor"))
        self._counts, self._responses = (grouped(rows, *self.KEY) for rows in (self.counts, responses))

    def rows(self, setting: int, source: str, executor: str, group: str | None = None) -> Rows:
        """Counts of a group of timers; empty if the executor did not run."""
        rows = self._counts.get((setting, source, executor), [])
        return [row for row in rows if group in (None, row["group"])]

    def drop_percent(self, *key: Any) -> float:
        """Skipped in percent of reached timestamps; NaN if none was reached."""
        skipped, reached = total(self.rows(*key), "skipped", "reached") or (0, 0)
        return percent_of(skipped, reached) if reached else math.nan

    def jobs(self, *key: Any) -> Rows:
        """Rows of `responses` of a setting, source and executor."""
        return self._responses.get(key, [])

    @functools.cache
    def samples(self, setting: int, source: str, executor: str, group: str) -> Samples:
        """Response times (ms) of several timers of one period, merged in time order."""
        rows = [row for row in self.jobs(setting, source, executor) if group_of(row["task"]) == group]
        repetitions = []
        for _, of in sorted(grouped(rows, "repetition").items()):
            jobs = [(k / len(ms), ms[k]) for ms in (row["response_ms"] for row in of) for k in range(len(ms))]
            repetitions.append([ms for _, ms in sorted(jobs, key=itemgetter(0))])
        return Samples(repetitions, exact=source == "simulated")


def draw_rates(axes: Axes, y: float, height: float, rates: Sequence[float], look: dict[str, Any]) -> None:
    """Simulated bar, live and real marks of one executor and setting; ✓ if nothing was dropped."""
    known = [rate for rate in rates if not math.isnan(rate)]
    if not any(known):
        style.note(axes, "✓" if known else "no data", (0, y), (4, 0))
        return
    simulated, live, real = rates
    bar = live if math.isnan(simulated) else simulated
    if not math.isnan(bar):
        axes.barh(y, bar, height=0.9 * height, zorder=2, **look)
    if not math.isnan(simulated + live):
        axes.plot([live], [y], "o", color=INK, markersize=4.5, zorder=4)
    if not math.isnan(real):
        axes.plot([real], [y], **style.reference_mark(markersize=5.5, zorder=3))
    number = bar if bar > 0 else max(known)
    text = f"{number:.1f}" if number >= 0.1 else f"{number:.2g}"
    style.note(axes, text, (max(known), y), (7, 0), color=FAINT)


def drops(runs: TimerRuns, labels: Mapping[Any, str]) -> Figure:
    """Dropped jobs of all timers and of the IMU alone; `labels`: names of the settings."""
    step = BAND / len(labels)
    shades = list(np.linspace(0.4, 0.95, len(labels)))  # earlier settings are paler
    height = 0.8 + 0.17 * len(labels) * len(runs.executors)
    figure, panels = style.new_figure(height, 1, 2, share_y=True)
    for axes, group, title in zip(panels, (None, "imu"), ("All timers", "IMU alone")):
        style.rows_of_labels(axes, runs.executors)
        for y, executor in enumerate(runs.executors):
            for k, (setting, alpha) in enumerate(zip(labels, shades)):
                rates = [runs.drop_percent(setting, source, executor, group) for source in (*SOURCES, "real")]
                look = {"color": style.colour_of(executor), "alpha": alpha}
                draw_rates(axes, y + (k - (len(labels) - 1) / 2) * step, step, rates, look)
        axes.set(title=title, xlabel="dropped jobs (% of the timestamps)", xmargin=0.14)
        axes.set_xlim(0, max(1e-3, axes.get_xlim()[1]))
    handles: list[Any] = [style.patch(label, alpha=a) for label, a in zip(labels.values(), shades)]
    sources = {row["source"] for row in runs.counts}
    if {*SOURCES} <= sources:
        handles += [style.patch("bar: simulated", alpha=0.6), style.dot("live", markersize=5)]
    if "real" in sources:
        handles.append(style.dot("real ROS 2 stack", **style.reference_mark()))
    handles.append(style.patch("✓ no job dropped", alpha=0))
    style.add_key(figure, handles, 7)
    return figure


def largest(rows: Rows, column: str) -> float:
    """The largest known value of a column; infinite if none is known."""
    return max((row[column] for row in rows if row[column]), default=math.inf)


def draw_panel(axes: Axes, runs: TimerRuns, with_cost: TimerRuns, setting: int, group: str) -> None:
    """Draws deadlines (an arrow marks a deadline beyond the axis), analytical bounds and the real
    stack's worst values."""
    limit = axes.get_xlim()[1]
    here = (r for r in runs.counts if (r["utilisation_percent"], r["group"]) == (setting, group))
    for deadline in dict.fromkeys(row["deadline_ms"] for row in here if row.get("deadline_ms")):
        beyond = deadline > limit
        if not beyond:
            axes.axvline(deadline, color=FAINT, linewidth=1.1, linestyle=style.DASHED, zorder=1)
        text = f"deadline {deadline:g} ms" + (" →" if beyond else "")
        look = {"va": "baseline", "ha": "right" if beyond else "center", "color": FAINT}
        style.note(axes, text, (min(deadline, limit), 1), (0, 2), xycoords=style.ABOVE, **look)
    for y, executor in enumerate(runs.executors):
        bound = largest(with_cost.rows(setting, "simulated", executor, group), "bound_ms")
        if bound <= limit:
            colour, ends = style.colour_of(executor), [y - 0.45, y + 0.45]
            axes.plot([bound] * 2, ends, color=colour, linewidth=2.2, zorder=5)
        worst = largest(runs.rows(setting, "real", executor, group), "response_max_ms")
        if worst <= limit:
            axes.plot([worst], [y + 0.26], **style.reference_mark(zorder=6))


def responses(runs: TimerRuns, with_cost: TimerRuns, group: str, labels: Mapping[Any, str]) -> Figure:
    """Response times of a group of timers: a panel per setting. `with_cost`: simulations of executors with bounds."""
    figure, panels = style.new_figure(0.55 + 0.42 * len(runs.executors), 1, len(labels), share_y=True)
    rows = {
        setting: [
            Row(e, e, {s: of for s in SOURCES if (of := runs.samples(setting, s, e, group))})
            for e in runs.executors
        ]
        for setting in labels
    }
    everything = list(itertools.chain.from_iterable(rows.values()))
    sources, limit = violins.sources_of(everything), violins.axis_limit(everything)
    for axes, (setting, label) in zip(panels, labels.items()):
        violins.draw_rows(axes, rows[setting], limit, sources)
        draw_panel(axes, runs, with_cost, setting, group)
        axes.set_title(label, pad=14)
        axes.set_xlabel(f"{GROUPS[group]}: response time (ms)")
    marks: list[Any] = [style.line("deadline", color=FAINT, linewidth=1.1, linestyle=style.DASHED)]
    if with_cost.counts:
        marks.append(style.line("analytical bound", color=style.SERIES[0], linewidth=2.2))
    if any(row["source"] == "real" for row in runs.counts):
        marks.append(style.dot("worst of the real ROS 2 stack", **style.reference_mark()))
    violins.add_key(figure, sources, marks)
    return figure
