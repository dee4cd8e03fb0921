# SPDX-License-Identifier: Apache-2.0
"""What the real ROS 2 stack measured on the same workloads (reference_system/ros2_reference), in this program's
names."""

import json
from typing import Any

import pandas as pd

from hotpath_report.figures.timers import Real
from hotpath_report.hotpath_command import PACKAGE, output_of
from hotpath_report.paper.cells import UTILISATIONS
from hotpath_report.samples import GROUPS, group_of

FOLDERS = (PACKAGE.parents[1] / "reference_system" / "ros2_reference", PACKAGE.parent / "ros2_reference")
# The fork's prioritised queues give every subscription one top priority (rule `first`).
TIMERS_NAMES = {"default": "default", "static": "static", "events": "events-ro", "rm": "rm-ro", "edf": "edf-ro"}
AUTOWARE_NAMES = {
    "singlethreaded": "default",
    "staticsinglethreaded": "static",
    "multithreaded": "multi",
    "events": "events-ro",
    "events_re": "events-re",
    "rm": "rm-ro",
    "edf": "edf-ro",
}
TRACED = ("events-re",)  # not among the authors' programs, but in the golden traces
AUTOWARE_CRUNCH_LIMIT = 6000  # 80 % of one core on the reference machine


def traced_rows(path: Any) -> list[dict[str, Any]]:
    """The columns of rclcpp_timers_only.csv from a golden trace."""
    return [
        {
            "task": t["task"],
            "released": t["reached"],
            "dropped": t["skipped"],
            "deadline_overruns": t["deadline_overruns"],
            "response_max_ms": t["response_authors_ms"]["max"],
        }
        for t in json.loads(output_of("summarize", "--golden", path))["tasks"]
    ]


class Reference:
    """Timers by set and executor, hot path by executor; both empty where the measurements are missing."""

    def __init__(self) -> None:
        self.timers = pd.DataFrame(columns=["percent", "executor", "group"])
        self.hot_path = pd.DataFrame()
        folder = next((f for f in FOLDERS if f.is_dir()), None)
        if folder is None:
            return
        timers = pd.read_csv(folder / "rclcpp_timers_only.csv").rename(columns={"utilisation_percent": "percent"})
        timers["executor"] = timers["executor"].map(TIMERS_NAMES)
        traced = [
            {"percent": percent, "executor": executor, **row}
            for executor in TRACED
            for percent in UTILISATIONS
            for row in traced_rows(folder / "traces" / f"timers_only_{percent}.{executor}.csv")
        ]
        self.timers = pd.concat([timers, pd.DataFrame(traced)])
        self.timers["group"] = self.timers["task"].map(group_of)
        autoware = pd.read_csv(folder / "rclcpp_autoware.csv")
        autoware = autoware[autoware["crunch_limit"] == AUTOWARE_CRUNCH_LIMIT]
        self.hot_path = autoware.assign(executor=autoware["executor"].map(AUTOWARE_NAMES)).set_index("executor")

    def rows(self, percent: int, executor: str, group: str | None = None) -> pd.DataFrame:
        """Timers of one set under one executor."""
        rows = self.timers[(self.timers["percent"] == percent) & (self.timers["executor"] == executor)]
        return rows if group is None else rows[rows["group"] == group]

    def total(self, what: str, percent: int, executor: str, group: str | None = None) -> int | None:
        """Sum of a column; None where this executor was not measured."""
        rows = self.rows(percent, executor, group)
        return int(rows[what].sum()) if len(rows) else None

    def drop_percent(self, percent: int, executor: str, group: str | None = None) -> float | None:
        """Share of the timestamps for which no job was released."""
        rows = self.rows(percent, executor, group)
        return float(100 * rows["dropped"].sum() / rows["released"].sum()) if len(rows) else None

    def hot_path_ms(self, executor: str, quantile: str) -> float | None:
        """`quantile` is p50, p90, p99 or max."""
        if executor not in self.hot_path.index:
            return None
        return float(self.hot_path.loc[executor, f"hot_path_{quantile}_ms"])

    def samples(self, executor: str) -> int:
        """How many latencies of the hot path were measured."""
        return int(self.hot_path.loc[executor, "samples"])

    def of_timers(self) -> Real:
        """What figures show of the timers."""
        real: dict[str, dict[Any, float | None]] = {"drop_percent": {}, "worst_ms": {}}
        for (percent, executor), rows in self.timers.groupby(["percent", "executor"]):
            for group in (None, *GROUPS):
                real["drop_percent"][percent, executor, group] = self.drop_percent(percent, executor, group)
            for group in GROUPS:
                worst = rows[rows["group"] == group]["response_max_ms"].max()
                real["worst_ms"][percent, executor, group] = float(worst)
        return Real(**real)
