# SPDX-License-Identifier: Apache-2.0
"""Rows of violins: upper half simulated, lower half live; with one source the whole violin."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hotpath_report import style
from hotpath_report.files import Rows
from hotpath_report.run import SOURCES
from hotpath_report.statistics import PERCENTILES, Samples, Values
from hotpath_report.style import FAINT, INK

HEIGHT = 0.42  # half a violin, in rows


class Drawing(NamedTuple):
    """A figure and its data."""

    figure: Figure
    table: Rows


@dataclass(frozen=True)
class Row:
    """Samples (ms) of one executor by source, simulated first; `notes` stand beside the worst values."""

    label: str
    executor: str
    samples: Mapping[str, Samples]
    notes: Mapping[str, str] = field(default_factory=dict)


def sources_of(rows: Sequence[Row]) -> list[str]:
    """Sources with samples in any row, simulated first."""
    return [source for source in SOURCES if any(source in row.samples for row in rows)]


def axis_limit(rows: Iterable[Row], marks: Iterable[float] = ()) -> float:
    """Axis limit (ms): fits all worst values except outliers, which get an arrow."""
    samples, known = [s for row in rows for s in row.samples.values()], list(marks)
    everything = max([s.worst for s in samples] + known, default=0)
    bulk = max([s.quantile(0.99) for s in samples] + known, default=0)
    return 1.12 * min(everything, 1.6 * bulk) or 1


def density(samples: Values, limit: float, points: int) -> tuple[Values, Values]:
    """Square root of a smoothed histogram, scaled to a maximum of one. The kernel, 0.6 % of the
    axis, keeps clusters of latencies apart; the root keeps single samples visible."""
    counts, edges = np.histogram(samples, bins=points, range=(0, limit))
    deviation = 1.4 * points / 240
    kernel = np.exp(-0.5 * (np.arange(-6, 7) / deviation) ** 2)
    smooth = np.convolve(counts, kernel / kernel.sum(), "same")
    peak = smooth.max()
    return (edges[:-1] + edges[1:]) / 2, np.sqrt(smooth / peak) if peak > 0 else smooth


def draw_violin(axes: Axes, y: float, samples: Samples, look: dict[str, Any], sides: Sequence[int]) -> None:
    """Draws a violin on row y with its median; `sides`: -1 is the upper half, 1 the lower half."""
    limit = axes.get_xlim()[1]
    values = samples.pooled
    low, high = float(values.min()), float(values.max())
    small = axes.get_subplotspec().get_gridspec().ncols > 1  # it needs fewer points
    x, share = density(values, limit, 120 if small else 240)
    inside = (x >= low - limit / 200) & (x <= high + limit / 200)
    x, share = x[inside], share[inside]
    for side in sides:
        if len(x):  # close the outline with one edge along the row
            edge = y + side * HEIGHT * share
            axes.fill([x[0], *x, x[-1]], [y, *edge, y], linewidth=0, zorder=2, **look)
    axes.plot([low, high], [y, y], color=look["color"], linewidth=1, zorder=3)
    median = samples.quantile(0.5)
    ends = [y + HEIGHT * min((*sides, 0)), y + HEIGHT * max((*sides, 0))]
    axes.plot([median, median], ends, color=INK, linewidth=1.6, zorder=4, solid_capstyle="butt")


def draw_rows(axes: Axes, rows: Sequence[Row], limit: float, sources: Sequence[str], unit: str = "") -> None:
    """Draws rows downwards with the worst value of each source at the end of its violin; the axis ends at `limit` (ms),
    and an arrow marks a value beyond it."""
    style.rows_of_labels(axes, [row.label for row in rows], xlim=(0, limit))
    for y, row in enumerate(rows):
        if not row.samples:
            axes.text(0.01 * limit, y, "no data", va="center", color=FAINT)
        for source, samples in row.samples.items():
            upper = source == "simulated"
            sides = (-1, 1) if len(sources) == 1 else (-1,) if upper else (1,)
            paler = upper and len(sources) > 1
            look: dict[str, Any] = {"color": style.colour_of(row.executor), "alpha": 0.42 if paler else 0.85}
            draw_violin(axes, y, samples, look, sides)
            digits = 1 if samples.worst >= 10 or not unit else 2
            text = f"{samples.worst:.{digits}f}{unit}" + row.notes.get(source, "")
            beyond = samples.worst > limit
            place = (min(samples.worst, limit), y + (0 if len(sources) == 1 else sides[0] * 0.2))
            look = {"ha": "right" if beyond else "left", "color": FAINT if paler else INK, "zorder": 7}
            text += " →" if beyond else ""
            style.note(axes, text, place, (0 if beyond else 4, 0), bbox=style.OPAQUE, **look)


def add_key(figure: Figure, sources: Sequence[str], marks: Sequence[Artist] = ()) -> None:
    """Adds the legend: sources, median and marks."""
    handles = [style.patch(source, alpha=0.85) for source in sources]
    if len(sources) > 1:
        halves = {"upper half: simulated": 0.42, "lower half: live": 0.95}
        handles = [style.patch(half, alpha=alpha) for half, alpha in halves.items()]
    style.add_key(figure, [*handles, style.line("median", linewidth=1.6), *marks], 6)


def percentile_table(found: Iterable[tuple[dict[str, Any], Samples]]) -> Rows:
    """A row per percentile: the keys of the samples, then value and interval (ms)."""
    return [
        {**keys, "repetitions": len(of.repetitions), "samples": len(of), "percentile": name}
        | dict(zip(("value_ms", "low_95_ms", "high_95_ms"), of.estimate(p)))
        for keys, of in found
        for p, name in PERCENTILES.items()
        if of
    ]
