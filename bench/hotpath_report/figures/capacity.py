# SPDX-License-Identifier: Apache-2.0
"""Levels that `hotpath capacity` tried, and the capacity of each executor."""

from pathlib import Path

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hotpath_report import style
from hotpath_report.errors import InputError
from hotpath_report.style import FAINT, INK, WARNING
from hotpath_report.tables import read_table

ANALYSIS = "analysis"


def draw_row(axes: Axes, y: float, executor: str, rows: pd.DataFrame, over: str) -> None:
    """Bar: capacity; dots: passing levels; crosses: failing levels; triangle: analysis."""
    measured = rows[rows["source"] != ANALYSIS]
    colour = style.colour_of(executor)
    for capacity in measured[measured["capacity"] == 1][over]:
        axes.barh(y, capacity, height=0.5, color=colour, alpha=0.3, linewidth=0)
        style.note(axes, f"{capacity:g}", (capacity, y - 0.33), (0, 0), ha="right")
    for holds, look in ((1, {"color": colour, "marker": "o"}), (0, {"color": WARNING, "marker": "x"})):
        levels = measured[measured["holds"] == holds][over]
        axes.plot(levels, [y] * len(levels), linestyle="", markersize=4, **look)
    for bound in rows[(rows["source"] == ANALYSIS) & (rows["capacity"] == 1)][over]:
        axes.plot([bound], [y + 0.36], marker="^", color=INK, markersize=6, linestyle="")


def levels(rows: pd.DataFrame, width: float) -> Figure:
    """A row of marks per executor."""
    over = rows.columns[2]
    executors = list(rows["executor"].unique())
    figure, (axes,) = style.new_figure(width, 0.9 + 0.5 * len(executors))
    style.rows_of_labels(axes, executors, xlabel=over)
    for y, executor in enumerate(executors):
        draw_row(axes, y, executor, rows[rows["executor"] == executor], over)
    axes.set_xlim(left=0)
    marks = [style.patch("capacity", alpha=0.3), style.dot("passes", color=FAINT)]
    marks += [
        style.dot("fails", "x", color=WARNING),
        style.dot("largest level that an analysis accepts", "^"),
    ]
    style.add_key(figure, marks, 4)
    return figure


def draw(folder: str) -> None:
    """Writes capacity.svg and capacity.png. Raises InputError."""
    path = Path(folder) / "levels.csv"
    rows = read_table(path, ["executor", "source", "holds", "capacity"])
    if rows.empty:
        raise InputError(f"{path}: no rows, there is nothing to draw")
    figure = levels(rows, style.WIDE)
    source = "live" if (rows["source"] == "live").any() else "simulated"
    title = f"Highest {rows.columns[2]} that each executor sustains"
    style.add_title(figure, title, f"{source}; each mark is a tried level")
    style.save(figure, folder, "capacity")
