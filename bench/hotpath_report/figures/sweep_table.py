# SPDX-License-Identifier: Apache-2.0
"""The table of `hotpath sweep`, and its measures in figures."""

from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from hotpath_report.errors import InputError
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
        self.multiplied = self.measures[1] if self.chain else self.measures[0]  # by the second axis

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
