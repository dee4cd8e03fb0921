# SPDX-License-Identifier: Apache-2.0
"""The figure and the page of `hotpath capacity`: tried levels, and the capacity of each executor."""

import math
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hotpath_report import style
from hotpath_report.errors import InputError
from hotpath_report.figures.violins import Drawing
from hotpath_report.pages.interactive import Points, plot, without_jobs
from hotpath_report.pages.writer import Section, Table, make_figure, table_of, write_page
from hotpath_report.statistics import Estimate
from hotpath_report.style import FAINT, INK, WARNING
from hotpath_report.tables import read_table

ANALYSIS = "analysis"
# Column of levels.csv and title of each plot; latencies have the columns of an interval.
LATENCIES = {"age_p99": "p99 of the age of the data (ms)", "age_worst": "worst age of the data (ms)"}
LATENCIES |= {"p99": "p99 of the hot-path latency (ms)", "worst": "worst hot-path latency (ms)"}
COUNTS = {
    "lost": "lost: skipped and overwritten",
    "deadline_overruns": "deadline overruns",
    "response_share_max": "worst response time / deadline",
}


def draw_row(axes: Axes, y: float, executor: str, rows: pd.DataFrame, over: str) -> None:
    """Bar: capacity; dots: passing levels; crosses: failing levels; triangle: analysis."""
    measured, bounds = rows[rows["source"] != ANALYSIS], rows[rows["source"] == ANALYSIS]
    colour = style.colour_of(executor)
    for capacity in measured[measured["capacity"] == 1][over]:
        axes.barh(y, capacity, height=0.5, color=colour, alpha=0.3, linewidth=0)
        style.note(axes, f"{capacity:g}", (capacity, y - 0.33), (0, 0), ha="right")
    for rows, shift, marker, colour in (
        (measured[measured["holds"] == 1], 0, "o", colour),
        (measured[measured["holds"] == 0], 0, "x", WARNING),
        (bounds[bounds["capacity"] == 1], 0.36, "^", INK),
    ):
        size = 6 if marker == "^" else 4
        axes.plot(rows[over], [y + shift] * len(rows), marker, color=colour, markersize=size)


def levels(rows: pd.DataFrame) -> Figure:
    """A row of marks per executor."""
    over, by_executor = rows.columns[2], dict(list(rows.groupby("executor", sort=False)))
    figure, (axes,) = style.new_figure(0.9 + 0.5 * len(by_executor))
    style.rows_of_labels(axes, list(by_executor), xlabel=over)
    for y, (executor, found) in enumerate(by_executor.items()):
        draw_row(axes, y, executor, found, over)
    axes.set_xlim(left=0)
    marks = [style.patch("capacity", alpha=0.3), style.dot("passes", color=FAINT)]
    marks += [style.dot("fails", "x", color=WARNING)]
    style.add_key(figure, [*marks, style.dot("largest level that an analysis accepts", "^")], 4)
    return figure


def plots(rows: pd.DataFrame, over: str) -> list[dict[str, Any]]:
    """A plot per measure that any level has; results of older versions lack some."""
    made = []
    for column, title in (LATENCIES | COUNTS).items():
        parts = [f"{column}_{part}ms" for part in ("", "low_", "high_")] if column in LATENCIES else [column]
        if not set(parts) <= set(rows.columns):
            continue
        lines: list[tuple[str, str, Points]] = []
        for executor, of in rows[rows["source"] != ANALYSIS].groupby("executor", sort=False):
            found = zip(of[over].astype(float), *(of[part].astype(float) for part in parts))
            points = {x: Estimate(*values) for x, *values in found if not math.isnan(values[0])}
            lines.append((str(executor), str(executor), points))
        made.append(plot(title, over, lines))
    return [p for p in made if p["lines"]]


def write(folder: str) -> None:
    """Draws the figure of a search, and writes report.html and report.md. Raises InputError."""
    path = Path(folder) / "levels.csv"
    rows = read_table(path, ["executor", "source", "holds", "capacity"])
    if rows.empty:
        raise InputError(f"{path}: no rows, there is nothing to draw")
    over = rows.columns[2]
    title = f"Highest {over} that each executor sustains"
    style.save(levels(rows), folder, "capacity", title, "simulated; each mark is a tried level")
    drawn = plots(rows, over)
    made = make_figure("capacity", title, Drawing(levels(rows), rows))
    text = "Each point is a tried level, over all repetitions; bands are 95 % intervals."
    executors = ", ".join(rows["executor"].unique())
    cells = [
        [r["executor"], r["source"], f"{r[over]:g}", "holds" if r["holds"] else "fails", r["why"]]
        for r in rows.fillna({"why": ""}).to_dict("records")
    ]
    tried = Table("Tried levels", ["executor", "source", over, "", "why"], cells, folded=True)
    write_page(
        Path(folder),
        [Section("levels", "Levels", executors, text, [made], [tried, *map(table_of, drawn)])],
        without_jobs(plots=drawn) if drawn else None,
        title=title,
        facts=[f"{executors}; the table with confidence: capacity.md"],
        made_by="`hotpath capacity`. Every tried level: levels.csv.",
    )
    print(Path(folder) / "report.html")
