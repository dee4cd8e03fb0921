# SPDX-License-Identifier: Apache-2.0
"""Frames of samples and counts, grouped for figures, tables and claims."""

from collections.abc import Hashable
from typing import Any

import numpy as np
import pandas as pd

from hotpath_report.errors import InputError
from hotpath_report.run import Run
from hotpath_report.statistics import Samples

GROUPS = {
    "camera": "cameras",
    "lidar": "LiDARs",
    "imu": "IMU",
}  # of the timers-only sets, by part of a task's name
COUNTS = ["reached", "ran", "skipped", "deadline_overruns"]

Setting = Hashable  # a utilisation in percent, or the name of a graph with its load


def group_of(task: str) -> str | None:
    """The group of timers that a task belongs to."""
    return next((group for group in GROUPS if group in task.lower()), None)


def samples_by(frame: pd.DataFrame, keys: list[str], value: str, exact: bool) -> dict[Any, Samples]:
    """Samples of each group of rows with equal keys, in the order of their first rows; repetitions are told apart by
    the column `repetition`."""
    return {
        key: Samples((r[value].to_numpy() for _, r in rows.groupby("repetition", sort=False)), exact)
        for key, rows in frame.groupby(keys if len(keys) > 1 else keys[0], sort=False)
    }


def in_turns(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows of several timers of one period in the order of time, each timer's rows being in that order."""
    of_task = rows.groupby(["repetition", "task"], sort=False)["response_ms"]
    when = of_task.cumcount() / of_task.transform("size")
    return rows.loc[when.sort_values(kind="stable").index]


class TimerRuns:
    """Timers of several runs after the warm-up.

    `counts` has one row for each setting, source, executor, repetition and task, with COUNTS, deadline_ms and
    bound_ms; `responses` one row for each job that ran, with response_ms.
    """

    KEY = ["setting", "source", "executor"]

    def __init__(self, counts: pd.DataFrame, responses: pd.DataFrame) -> None:
        self.counts, self.responses = counts, responses
        self._counts = {key: rows for key, rows in counts.groupby(self.KEY, sort=False)}
        self._responses = {key: rows for key, rows in responses.groupby(self.KEY, sort=False)}
        self._samples: dict[Hashable, Samples | None] = {}

    @classmethod
    def of_runs(cls, runs: list[Run]) -> "TimerRuns":
        """Of run folders. A second run of one setting and source gets a number."""
        seen: list[tuple[str, str]] = []
        counts, responses = [], []
        for run in runs:
            seen.append((run.setting, run.source))
            number = seen.count(seen[-1])
            setting = run.setting if number == 1 else f"{run.setting} ({number})"
            key = {"setting": setting, "source": run.source}
            responses.append(run.responses().assign(**key))
            counts.append(run.timer_counts().assign(**key, repetition=0))
            if not counts[-1]["reached"].sum():
                raise InputError(f"{run.folder / 'jobs.csv'}: no row of a timer, there is nothing to draw")
        return cls(pd.concat(counts), pd.concat(responses))

    def settings(self) -> list[Any]:
        """In the order of the runs."""
        return list(self.counts["setting"].unique())

    def executors(self) -> list[str]:
        """In the order of the runs."""
        return list(self.counts["executor"].unique())

    def rows(
        self, setting: Setting, source: str, executor: str, group: str | None = None
    ) -> pd.DataFrame | None:
        """Counts of a group of timers; None where this executor did not run."""
        rows = self._counts.get((setting, source, executor))
        if rows is None or group is None:
            return rows
        return rows[rows["task"].map(group_of) == group]

    def total(
        self, what: str, setting: Setting, source: str, executor: str, group: str | None = None
    ) -> int | None:
        """Sum of a column of COUNTS."""
        rows = self.rows(setting, source, executor, group)
        return None if rows is None else int(rows[what].sum())

    def drop_percent(
        self, setting: Setting, source: str, executor: str, group: str | None = None
    ) -> float | None:
        """Skipped timestamps in percent of those that were reached."""
        rows = self.rows(setting, source, executor, group)
        if rows is None or not rows["reached"].sum():
            return None
        return float(100 * rows["skipped"].sum() / rows["reached"].sum())

    def worst_ms(self, setting: Setting, source: str, executor: str, group: str) -> float | None:
        """The largest response time; None where it is not known."""
        rows = self.rows(setting, source, executor, group)
        return None if rows is None or "response_max_ms" not in rows else float(rows["response_max_ms"].max())

    def jobs(self, setting: Setting, source: str, executor: str) -> pd.DataFrame | None:
        """Rows of `responses` of one executor."""
        return self._responses.get((setting, source, executor))

    def samples(
        self, setting: Setting, source: str, executor: str, group: str | None = None
    ) -> Samples | None:
        """Response times in ms; None where no job ran."""
        key = (setting, source, executor, group)
        if key not in self._samples:
            rows = self.jobs(setting, source, executor)
            if rows is not None and group is not None:
                rows = in_turns(rows[rows["task"].map(group_of) == group])
            found = None
            if rows is not None and len(rows):
                repetitions = (r["response_ms"].to_numpy() for _, r in rows.groupby("repetition"))
                found = Samples(repetitions, exact=source == "simulated")
            self._samples[key] = found
        return self._samples[key]

    def of_group(self, column: str, group: str, setting: Setting | None = None) -> set[float]:
        """The different values of a column of counts (deadline_ms, for example) of a group of timers."""
        rows = self.counts[self.counts["task"].map(group_of) == group]
        if setting is not None:
            rows = rows[rows["setting"] == setting]
        return {float(v) for v in rows[column] if not np.isnan(v)}
