# SPDX-License-Identifier: Apache-2.0
"""Figures of `hotpath sweep`: lines with intervals, heat maps and small multiples."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from hotpath_report import style
from hotpath_report.figures.maps import dashes
from hotpath_report.figures.sweep_table import Measure, Table
from hotpath_report.style import FAINT, GRID, INK

MOST_PANELS = 9  # small multiples
MOST_NUMBERED = 20  # columns of a map with room for numbers in its cells


def draw_lines(axes: Axes, table: Table, rows: pd.DataFrame, measure: Measure) -> None:
    """A line per executor, with a band for the intervals."""
    for executor in table.executors:
        points = table.points(rows[rows["executor"] == executor], measure)
        if not points:
            continue
        colour, x = style.colour_of(executor), list(points)
        low = [e.low if e.has_interval else e.value for e in points.values()]
        high = [e.high if e.has_interval else e.value for e in points.values()]
        axes.fill_between(x, low, high, color=colour, alpha=0.18, linewidth=0)
        look: Any = {"linestyle": dashes(executor), "marker": "o" if len(x) < 30 else ""}
        axes.plot(x, [e.value for e in points.values()], color=colour, markersize=2.8, **look)
    axes.set(xlabel=table.x)
    if measure.column.endswith("_ms") and axes.get_ylim()[1] > 8 * max(axes.get_ylim()[0], 1e-9):
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.yaxis.set_minor_locator(NullLocator())
        axes.yaxis.set_major_formatter("{x:g}")


def key(figure: Figure, table: Table) -> None:
    """Adds the legend."""
    names = table.executors
    handles = [style.line(e, color=style.colour_of(e), linestyle=dashes(e)) for e in names]
    style.add_key(figure, [*handles, style.patch("95 % interval over repetitions", alpha=0.3)], 6)


def lines(table: Table, width: float = style.WIDE) -> Figure:
    """Median and worst case over x; other axes are pooled."""
    figure, panels = style.new_figure(width, 3.6, 1, 2)
    for axes, measure in zip(panels, table.measures):
        draw_lines(axes, table, table.rows, measure)
        axes.set_title(measure.title)
    key(figure, table)
    return figure


def multiples(table: Table, width: float = style.WIDE) -> Figure:
    """A small panel per value of the second axis."""
    axis, measure = table.others[0], table.multiplied
    values = list(table.rows[axis].unique())[:MOST_PANELS]
    columns = min(3, len(values))
    figure, panels = style.new_figure(width, 2.4, math.ceil(len(values) / columns), columns, True)
    for axes, value in zip(panels, values):
        draw_lines(axes, table, table.rows[table.rows[axis] == value], measure)
        axes.set_title(f"{axis} {value}", fontsize=10)
    for axes in panels[len(values) :]:
        axes.set_visible(False)
    key(figure, table)
    return figure


def number_text(value: float) -> str:
    """At most four characters."""
    if value >= 9999:
        return f"{value / 1000:.0f}k"
    return f"{value:.1f}" if 0 < value < 10 and value != round(value) else f"{value:.0f}"


def draw_map(axes: Axes, table: Table, measure: Measure) -> None:
    """Executors in rows, x in columns; grey cells could not run."""
    xs = sorted(table.rows[table.x].unique())
    grid = np.full((len(table.executors), len(xs)), np.nan)
    for i, executor in enumerate(table.executors):
        points = table.points(table.rows[table.rows["executor"] == executor], measure)
        for x, estimate in points.items():
            grid[i, xs.index(x)] = estimate.value
    positive = grid[np.isfinite(grid) & (grid > 0)]
    axes.set_facecolor(GRID)
    norm: Any = LogNorm(positive.min(), max(positive.max(), positive.min() * 1.01)) if len(positive) else None
    colours = plt.get_cmap("YlOrRd").with_extremes(under="white")  # for zero
    shown = np.where(grid <= 0, positive.min() / 2 if len(positive) else 0, grid)
    axes.imshow(shown, aspect="auto", cmap=colours if len(positive) else "Greys", norm=norm)
    axes.grid(False)
    if len(xs) <= MOST_NUMBERED:
        write_numbers(axes, grid, norm)
    step = math.ceil(len(xs) / 16)
    axes.set_xticks(range(0, len(xs), step), [f"{x:g}" for x in xs[::step]])
    axes.set_yticks(range(len(table.executors)), table.executors)
    axes.tick_params(length=0)
    axes.set_title(measure.title)


def write_numbers(axes: Axes, grid: Any, norm: Any) -> None:
    """Writes each cell's value in a legible colour."""
    for (i, j), value in np.ndenumerate(grid):
        if math.isnan(value):
            continue
        dark = norm is not None and value > 0 and norm(value) > 0.7
        axes.text(
            j, i, number_text(value), ha="center", va="center", fontsize=7.5, color="white" if dark else INK
        )


def heat_map(table: Table, width: float = style.WIDE) -> Figure:
    """Median, worst case and losses over x and executor."""
    rows = 0.5 + 0.27 * len(table.executors)
    figure, panels = style.new_figure(width, rows, len(table.measures))
    for axes, measure in zip(panels, table.measures):
        draw_map(axes, table, measure)
    panels[-1].set_xlabel(table.x)
    if table.failed:
        style.add_key(
            figure,
            [style.patch("run not finished: overload", facecolor=GRID, edgecolor=FAINT)],
            1,
        )
    return figure


def draw(table: Table, figures: Sequence[tuple[str, str, Callable[[Table], Figure]]], folder: str) -> None:
    """Writes sweep_NAME.svg and .png for each name, title and function that draws."""
    for name, title, made in figures:
        figure = made(table)
        style.add_title(figure, title, table.subtitle())
        style.save(figure, folder, f"sweep_{name}")
