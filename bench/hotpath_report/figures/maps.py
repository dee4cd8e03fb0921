# SPDX-License-Identifier: Apache-2.0
"""Hot-path latency over load and over random phases."""

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hotpath_report import style
from hotpath_report.figures import violins
from hotpath_report.figures.violins import Row
from hotpath_report.hotpath_command import executor_named
from hotpath_report.run import SOURCES
from hotpath_report.statistics import Samples
from hotpath_report.style import FAINT, INK

TICKS_MS = [5, 10, 20, 50, 100, 200, 500, 1000]
OUTLINED = {"markeredgecolor": INK, "markeredgewidth": 0.7, "markersize": 5}
CREATION: dict[str, Any] = {"linewidth": 1.2, "linestyle": (0, (2, 1.5))}

# {(source, executor): {load in percent: latencies in ms}}
Points = Mapping[tuple[str, str], Mapping[int, Samples]]
# {(source, executor): [(median, worst)]} in ms
Draws = Mapping[tuple[str, str], Sequence[tuple[float, float]]]


def dashes(executor: str) -> Any:
    """Line style: EDF is dashed, because its line often covers RM's."""
    known = executor_named(executor)
    return (0, (3, 2)) if known and (known.policy or "").lower() == "edf" else "-"


def draw_load(axes: Axes, points: Points, executor: str, p: float) -> None:
    """A simulated curve and live dots of the quantile `p`."""
    colour = style.colour_of(executor)
    simulated = sorted(points.get(("simulated", executor), {}).items())
    if simulated:
        loads, values = zip(*((load, samples.quantile(p)) for load, samples in simulated))
        axes.plot(loads, values, color=colour, linewidth=1.8, linestyle=dashes(executor), zorder=2)
    for load, samples in points.get(("live", executor), {}).items():
        e = samples.estimate(p)
        gaps = [[max(0, e.value - e.low)], [max(0, e.high - e.value)]] if e.has_interval else None
        axes.errorbar([load], [e.value], yerr=gaps, fmt="o", color=colour, elinewidth=1, zorder=4, **OUTLINED)


def over_load(points: Points, executors: Sequence[str]) -> Figure:
    """Median and worst case over load."""
    figure, panels = style.new_figure(3.9, 1, 2)
    for axes, p, title in zip(panels, (0.5, 1.0), ("Median", "Worst case")):
        for executor in executors:
            draw_load(axes, points, executor, p)
        axes.set_yscale("log")
        low, high = axes.get_ylim()
        ticks = [t for t in TICKS_MS if low <= t <= high]
        axes.set_yticks(ticks, list(map(str, ticks)))
        axes.minorticks_off()
        axes.axvline(100, color=FAINT, linewidth=1, linestyle=style.DASHED)
        axes.set(title=title, xlabel="load (% of one core)", ylabel="hot-path latency (ms)")
    shown = [e for e in executors if any(e == other for _, other in points)]
    handles = [style.line(e, color=style.colour_of(e), linewidth=1.8, linestyle=dashes(e)) for e in shown]
    if any(source == "live" for source, _ in points):
        handles.append(style.dot("live", color=FAINT, markeredgecolor=INK))
    style.add_key(figure, handles, 8)
    return figure


def over_phases(draws: Draws, creation_ms: Mapping[str, float], executors: Sequence[str]) -> Figure:
    """Worst latencies of random phase draws, beside that of the creation order."""
    shown = [e for e in executors if draws.get(("simulated", e))]
    rows = [Row(e, e, [Samples([w] for _, w in draws["simulated", e]), None]) for e in shown]
    live = {e: [w for _, w in draws.get(("live", e), [])] for e in shown}
    figure, (axes,) = style.new_figure(1 + 0.5 * len(rows))
    limit = violins.axis_limit(rows, [w for worst in live.values() for w in worst])
    violins.draw_rows(axes, rows, limit, SOURCES)
    for y, executor in enumerate(shown):
        dots = [y + 0.2] * len(live[executor])
        axes.plot(live[executor], dots, "o", color=style.colour_of(executor), **OUTLINED)
        if executor in creation_ms:
            axes.plot([creation_ms[executor]] * 2, [y - 0.42, y + 0.1], color=INK, zorder=5, **CREATION)
    axes.set_xlabel("worst hot-path latency of a draw of phases (ms)")
    handles: list[Any] = [
        style.patch("draws, simulated", alpha=0.42),
        style.line("median draw", linewidth=1.6),
        style.line("creation order, simulated", **CREATION),
    ]
    if any(live.values()):
        handles.append(style.dot("draws, live", color=FAINT, markeredgecolor=INK))
    style.add_key(figure, handles, 4)
    return figure
