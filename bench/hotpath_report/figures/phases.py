# SPDX-License-Identifier: Apache-2.0
"""Hot-path latency over random phases."""

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure

from hotpath_report import style
from hotpath_report.figures import violins
from hotpath_report.figures.violins import Row
from hotpath_report.run import SOURCES
from hotpath_report.statistics import Samples
from hotpath_report.style import FAINT, INK

OUTLINED = {"markeredgecolor": INK, "markeredgewidth": 0.7, "markersize": 5}
CREATION: dict[str, Any] = {"linewidth": 1.2, "linestyle": (0, (2, 1.5))}

# {(source, executor): [(median, worst)]} in ms
Draws = Mapping[tuple[str, str], Sequence[tuple[float, float]]]


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
