# SPDX-License-Identifier: Apache-2.0
"""The figure of `hotpath sweep`: lines with intervals."""

from dataclasses import dataclass
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
from hotpath_report.statistics import Estimate, Samples
from hotpath_report.tables import read_json, read_table


@dataclass(frozen=True)
class Measure:
    """A column of the table; a point is its quantile `over_repetitions`."""

    column: str
    title: str
    over_repetitions: float = 0.5


OF_CHAINS = [
    Measure("hot_path_p50_ms", "median hot-path latency (ms)"),
    Measure("hot_path_max_ms", "worst hot-path latency (ms)", 1.0),
    Measure("lost", "lost: skipped and overwritten", 1.0),
]
OF_TIMERS = [
    Measure("response_share_max", "worst response time / deadline", 1.0),
    Measure("deadline_overruns", "deadline overruns", 1.0),
    Measure("lost", "lost: skipped and overwritten", 1.0),
]


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
        self.repetitions: int = facts["repetitions"]
        self.axes = [a for a in facts["axes"] if a in self.rows and self.rows[a].nunique() > 1]
        numeric = [a for a in self.axes if pd.api.types.is_numeric_dtype(self.rows[a])]
        if not numeric:
            raise InputError(f"{folder / 'table.csv'}: no numeric axis to draw over")
        self.x = numeric[0]
        self.others = [a for a in self.axes if a != self.x]
        self.executors = list(self.rows["executor"].unique())
        self.failed = int(self.rows["failure"].notna().sum())
        self.what = "Latency" if self.chain else "Response times"

    def points(self, rows: pd.DataFrame, measure: Measure) -> dict[float, Estimate]:
        """{x: quantile over the repetitions with its interval}"""
        found = {}
        for x, at in rows.groupby(self.x):
            values = at[measure.column].dropna()
            if len(values):
                found[float(x)] = Samples([v] for v in values).estimate(measure.over_repetitions)
        return found

    def subtitle(self) -> str:
        """Axes and size of the sweep."""
        cells = f"{self.rows['cell'].nunique()} cells, {self.repetitions} repetitions"
        chain = f"chain {self.chain} · " if self.chain else ""
        fails = f" · {self.failed} cells not finished (overload)" if self.failed else ""
        return f"{chain}over {', '.join(self.axes)} · {cells}{fails}"


def draw_lines(axes: Axes, table: Table, measure: Measure) -> None:
    """A line per executor, with a band for the intervals."""
    for executor in table.executors:
        points = table.points(table.rows[table.rows["executor"] == executor], measure)
        if not points:
            continue
        colour, x = style.colour_of(executor), list(points)
        value, low, high = np.array(list(points.values())).T
        ends = [np.where(np.isnan(end), value, end) for end in (low, high)]
        axes.fill_between(x, *ends, color=colour, alpha=0.18, linewidth=0)
        look: Any = {"linestyle": dashes(executor), "marker": "o" if len(x) < 30 else ""}
        axes.plot(x, value, color=colour, markersize=2.8, **look)
    axes.set(xlabel=table.x)
    if measure.column.endswith("_ms") and axes.get_ylim()[1] > 8 * max(axes.get_ylim()[0], 1e-9):
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.yaxis.set_minor_locator(NullLocator())
        axes.yaxis.set_major_formatter("{x:g}")


def lines(table: Table) -> Figure:
    """Median and worst case over x; other axes are pooled."""
    figure, panels = style.new_figure(3.6, 1, 2)
    for axes, measure in zip(panels, table.measures):
        draw_lines(axes, table, measure)
        axes.set_title(measure.title)
    names = table.executors
    handles = [style.line(e, color=style.colour_of(e), linestyle=dashes(e)) for e in names]
    style.add_key(figure, [*handles, style.patch("95 % interval over repetitions", alpha=0.3)], 6)
    return figure
