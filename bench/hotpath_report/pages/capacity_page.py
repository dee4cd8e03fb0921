# SPDX-License-Identifier: Apache-2.0
"""The page of `hotpath capacity`."""

import math
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from hotpath_report.figures import capacity
from hotpath_report.figures.violins import Drawing
from hotpath_report.pages import curves, interactive
from hotpath_report.pages.writer import Section, Table, make_figure, write_page
from hotpath_report.statistics import Estimate
from hotpath_report.tables import read_table

# Column of levels.csv and title of each plot; latencies have the columns of an interval.
LATENCIES = {"p99": "p99 of the hot-path latency (ms)", "worst": "worst hot-path latency (ms)"}
COUNTS = {
    "lost": "lost: skipped and overwritten",
    "deadline_overruns": "deadline overruns",
    "response_share_max": "worst response time / deadline",
}
TEXT = "Each point is a tried level, over all repetitions; bands are 95 % intervals."


def estimate(row: dict[str, Any], column: str) -> Estimate:
    """What a level measured; NaN if it did not."""
    if column in LATENCIES:
        return Estimate(*(float(row[f"{column}_{part}ms"]) for part in ("", "low_", "high_")))
    return Estimate(float(row[column]))


def plots(rows: pd.DataFrame, over: str) -> list[dict[str, Any]]:
    """A plot per measure that any level has."""
    made = []
    for column, title in (LATENCIES | COUNTS).items():
        lines: list[tuple[str, str, curves.Points]] = []
        for executor, of in rows[rows["source"] != capacity.ANALYSIS].groupby("executor", sort=False):
            points = {float(row[over]): estimate(row, column) for row in of.to_dict("records")}
            points = {x: e for x, e in points.items() if not math.isnan(e.value)}
            lines.append((str(executor), str(executor), points))
        made.append(curves.plot(title, over, curves.lines(lines)))
    return [p for p in made if p["lines"]]


def levels(rows: pd.DataFrame, over: str) -> Table:
    """The levels that were tried, with the reason of each failure."""
    shown = rows.fillna({"why": ""})
    cells = [
        [r["executor"], r["source"], f"{r[over]:g}", "holds" if r["holds"] else "fails", r["why"]]
        for r in shown.to_dict("records")
    ]
    return Table("Tried levels", ["executor", "source", over, "", "why"], cells, folded=True)


def write(folder: str) -> None:
    """Draws the figure of a search, and writes report.html and report.md. Raises InputError."""
    capacity.draw(folder)
    rows = read_table(Path(folder) / "levels.csv", ["executor", "source", "holds", "capacity"])
    over = rows.columns[2]
    measures = [f"{name}_{part}ms" for name in LATENCIES for part in ("", "low_", "high_")] + [*COUNTS]
    rows = rows.reindex(columns=list(dict.fromkeys([*rows.columns, *measures])))  # older: without measures
    drawn = plots(rows, over)
    title = f"Highest {over} that each executor sustains"
    figure = make_figure("capacity", title, partial(drawing, rows), [])
    tables = [levels(rows, over), *map(curves.table, drawn)]
    executors = ", ".join(rows["executor"].unique())
    write_page(
        Path(folder),
        "report",
        [Section("levels", "Levels", executors, TEXT, [figure], tables)],
        title=title,
        facts=[f"{executors}; the table with confidence: capacity.md"],
        losses=[],
        made_by="`hotpath capacity`. Every tried level: levels.csv.",
        **({"interactive": interactive.embedded(curves.document(drawn))} if drawn else {}),
    )
    print(Path(folder) / "report.html")


def drawing(rows: pd.DataFrame, width: float) -> Drawing:
    """The levels with their data."""
    return Drawing(capacity.levels(rows, width), rows)
