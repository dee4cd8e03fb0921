# SPDX-License-Identifier: Apache-2.0
"""The figure and the page of `hotpath sweep`: lines with intervals."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from hotpath_report import style
from hotpath_report.errors import InputError
from hotpath_report.figures.maps import dashes
from hotpath_report.figures.violins import Drawing
from hotpath_report.pages import interactive
from hotpath_report.pages.writer import Section, make_figure, table_of, write_page
from hotpath_report.statistics import Estimate, Samples
from hotpath_report.tables import read_json, read_table

MOST_VALUES = 9  # of the second axis


# Column of the table and title of each measure.
MEDIAN, LOST = "hot_path_p50_ms", {"lost": "lost: skipped and overwritten"}
OF_CHAINS = {
    MEDIAN: "median hot-path latency (ms)",
    "hot_path_max_ms": "worst hot-path latency (ms)",
} | LOST
OF_TIMERS = {
    "response_share_max": "worst response time / deadline",
    "deadline_overruns": "deadline overruns",
} | LOST


class Table:
    """table.csv: rows of one chain, or of timers without chains."""

    def __init__(self, folder: Path) -> None:
        self.rows = read_table(folder / "table.csv", ["executor"])
        facts = read_json(folder / "sweep.json", "hotpath sweep")
        chains = self.rows["chain"].dropna().unique() if "chain" in self.rows else []
        self.chain = str(chains[0]) if len(chains) else ""
        if self.chain:
            self.rows = self.rows[(self.rows["chain"] == self.chain) | self.rows["failure"].notna()]
        self.measures = OF_CHAINS if self.chain else OF_TIMERS
        self.axes = [a for a in facts["axes"] if a in self.rows and self.rows[a].nunique() > 1]
        numeric = [a for a in self.axes if pd.api.types.is_numeric_dtype(self.rows[a])]
        if not numeric:
            raise InputError(f"{folder / 'table.csv'}: no numeric axis to draw over")
        self.x = numeric[0]
        self.executors = list(self.rows["executor"].unique())
        self.failed = int(self.rows["failure"].notna().sum())
        cells = f"{self.rows['cell'].nunique()} cells, {facts['repetitions']} repetitions"
        chain = f"chain {self.chain} · " if self.chain else ""
        fails = f" · {self.failed} cells not finished (overload)" if self.failed else ""
        self.subtitle = f"{chain}over {', '.join(self.axes)} · {cells}{fails}"

    def points(self, rows: pd.DataFrame, column: str) -> dict[float, Estimate]:
        """{x: median or largest value over the repetitions with its interval}"""
        found = {}
        for x, at in rows.groupby(self.x):
            values = at[column].dropna()
            if len(values):
                found[float(x)] = Samples([v] for v in values).estimate(0.5 if column == MEDIAN else 1.0)
        return found


def draw_lines(axes: Axes, table: Table, column: str) -> None:
    """A line per executor, with a band for the intervals."""
    for executor in table.executors:
        points = table.points(table.rows[table.rows["executor"] == executor], column)
        if not points:
            continue
        colour, x = style.colour_of(executor), list(points)
        value, low, high = np.array(list(points.values())).T
        ends = [np.where(np.isnan(end), value, end) for end in (low, high)]
        axes.fill_between(x, *ends, color=colour, alpha=0.18, linewidth=0)
        look: Any = {"linestyle": dashes(executor), "marker": "o" if len(x) < 30 else ""}
        axes.plot(x, value, color=colour, markersize=2.8, **look)
    axes.set(xlabel=table.x)
    if column.endswith("_ms") and axes.get_ylim()[1] > 8 * max(axes.get_ylim()[0], 1e-9):
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.yaxis.set_minor_locator(NullLocator())
        axes.yaxis.set_major_formatter("{x:g}")


def lines(table: Table) -> Figure:
    """Median and worst case over x; other axes are pooled."""
    figure, panels = style.new_figure(3.6, 1, 2)
    for axes, (column, title) in zip(panels, table.measures.items()):
        draw_lines(axes, table, column)
        axes.set_title(title)
    handles = [style.line(e, color=style.colour_of(e), linestyle=dashes(e)) for e in table.executors]
    style.add_key(figure, [*handles, style.patch("95 % interval over repetitions", alpha=0.3)], 6)
    return figure


def plots(of: Table) -> list[dict[str, Any]]:
    """Each measure with the other axes pooled, then for each value of the second axis."""
    shown = [(of.rows, "", "lines")]
    for axis in [a for a in of.axes if a != of.x][:1]:
        for value in of.rows[axis].unique()[:MOST_VALUES]:
            shown.append((of.rows[of.rows[axis] == value], f", {axis} {value}", ""))
    made = []
    for rows, suffix, figure in shown:
        for column, title in of.measures.items():
            found = [(e, e, of.points(rows[rows["executor"] == e], column)) for e in of.executors]
            made.append(interactive.plot(title + suffix, of.x, found, figure))
    return [p for p in made if p["lines"]]


def write(folder: str) -> None:
    """Draws the figure of a sweep, and writes report.html and report.md. Raises InputError."""
    of = Table(Path(folder))
    title = f"{'Latency' if of.chain else 'Response times'} over {of.x}"
    style.save(lines(of), folder, "sweep_lines", title, of.subtitle)
    drawn = plots(of)
    values = [
        {"measure": p["title"], of.x: x, "executor": a["label"], "value": value, "low": low, "high": high}
        for p in drawn
        for a in p["lines"]
        for x, value, low, high in zip(a["x"], a["value"], a["low"], a["high"])
    ]
    made = make_figure("lines", title, Drawing(lines(of), pd.DataFrame(values)))
    text = "The value of a point is over the repetitions; bands are its 95 % interval."
    write_page(
        Path(folder),
        [Section("values", "Values", of.subtitle, text, [made], list(map(table_of, drawn)))],
        interactive.without_jobs(plots=drawn) if drawn else None,
        title=f"Sweep over {', '.join(of.axes)}",
        facts=[of.subtitle],
        made_by="`hotpath sweep`. Every row of every cell: table.csv.",
    )
    print(Path(folder) / "report.html")
