# SPDX-License-Identifier: Apache-2.0
"""Samples and counts, grouped for figures, tables and claims."""

import functools
import math
from collections.abc import Hashable
from typing import Any

import pandas as pd

from hotpath_report.run import Run
from hotpath_report.statistics import Samples, percent_of

# Groups of timers, by part of the task name.
GROUPS = {"camera": "cameras", "lidar": "LiDARs", "imu": "IMU"}

Setting = Hashable  # a utilisation in percent, or the name of a graph with its load


def group_of(task: str) -> str | None:
    """The task's group of timers."""
    return next((group for group in GROUPS if group in task.lower()), None)


def samples_by(frame: pd.DataFrame, keys: list[str], value: str) -> dict[Any, Samples]:
    """Samples of each group of rows with equal keys, in order of first appearance, by the column
    `repetition`; one key must be `source`."""
    found = {}
    for key, rows in frame.groupby(keys, sort=False):
        of = (r[value].to_numpy() for _, r in rows.groupby("repetition", sort=False))
        found[key] = Samples(of, exact=key[keys.index("source")] == "simulated")
    return found


def samples_of_run(frame: pd.DataFrame, name: str, value: str, run: Run) -> dict[str, dict[str, Samples]]:
    """{name: {executor: samples}}, in order of first appearance; `name` is a column."""
    made: dict[str, dict[str, Samples]] = {}
    keys = [name, "source", "executor"]
    for (key, _, executor), samples in samples_by(frame.assign(source=run.source), keys, value).items():
        made.setdefault(key, {})[executor] = samples
    return made


class TimerRuns:
    """Timers of several runs after the warm-up.

    `counts` has a row per setting, source, executor, repetition and task: COUNTS, deadline_ms,
    bound_ms and, if known, response_max_ms. `responses` has a row per job that ran: response_ms.
    Both have the task's group.
    """

    KEY = ["setting", "source", "executor"]

    def __init__(self, counts: pd.DataFrame, responses: pd.DataFrame) -> None:
        self.counts, self.responses = (f.assign(group=f["task"].map(group_of)) for f in (counts, responses))
        self.executors = list(self.counts["executor"].unique())
        self._counts = dict(list(self.counts.groupby(self.KEY, sort=False)))
        self._responses = dict(list(self.responses.groupby(self.KEY, sort=False)))

    def rows(self, setting: Setting, source: str, executor: str, group: str | None = None) -> pd.DataFrame:
        """Counts of a group of timers; empty if the executor did not run."""
        rows = self._counts.get((setting, source, executor), self.counts.iloc[:0])
        return rows if group is None else rows[rows["group"] == group]

    def drop_percent(self, *key: Any) -> float:
        """Skipped in percent of reached timestamps; NaN if none was reached."""
        skipped, reached = self.rows(*key)[["skipped", "reached"]].sum()
        return percent_of(skipped, reached) if reached else math.nan

    def jobs(self, setting: Setting, source: str, executor: str) -> pd.DataFrame:
        """Rows of `responses` of one executor."""
        return self._responses.get((setting, source, executor), self.responses.iloc[:0])

    @functools.cache
    def samples(self, setting: Setting, source: str, executor: str, group: str) -> Samples:
        """Response times (ms) of several timers of one period, merged in time order."""
        rows = self.jobs(setting, source, executor)
        rows = rows[rows["group"] == group]
        of_task = rows.groupby(["repetition", "task"], sort=False)["response_ms"]
        when = of_task.cumcount() / of_task.transform("size")
        rows = rows.loc[when.sort_values(kind="stable").index]
        repetitions = (r["response_ms"].to_numpy() for _, r in rows.groupby("repetition"))
        return Samples(repetitions, exact=source == "simulated")
