# SPDX-License-Identifier: Apache-2.0
"""Measurements of the real ROS 2 stack on the same workloads (reference_system/ros2_reference)."""

import json

import pandas as pd

from hotpath_report.hotpath_command import PACKAGE, executor_named, output_of
from hotpath_report.paper.cells import UTILISATIONS

REAL = "real"  # the source of its rows
FOLDERS = tuple(
    PACKAGE.parents[1] / package / "ros2_reference"
    for package in ("reference_system", "hotpath_reference_system")
)
# Executor names there and here. The fork gives all subscriptions one top priority (rule `first`).
WORDS = {"singlethreaded": "default", "staticsinglethreaded": "static", "multithreaded": "multi"}
WORDS |= {"events_re": "events-re"}
TRACED = "events-re"  # only in the golden traces
AUTOWARE_CRUNCH_LIMIT = 6000  # 80 % of one core on the reference machine


def our_name(executor: str) -> str:
    """The registry's name for an executor; there, release-only executors lack the suffix `-ro`."""
    name = WORDS.get(executor, executor)
    return name if executor_named(name) else f"{name}-ro"


class Reference:
    """Timers (as TimerRuns.counts) and hot path (ms) by executor; empty if not measured."""

    def __init__(self) -> None:
        self.timers, self.hot_path = pd.DataFrame(), pd.DataFrame()
        folder = next((f for f in FOLDERS if f.is_dir()), None)
        if folder is None:
            return
        names = {"utilisation_percent": "setting", "released": "reached", "dropped": "skipped"}
        timers = pd.read_csv(folder / "rclcpp_timers_only.csv").rename(columns=names)
        tables = [timers.assign(executor=timers["executor"].map(our_name))]
        for percent in UTILISATIONS:
            path = folder / "traces" / f"timers_only_{percent}.{TRACED}.csv"
            traced = pd.DataFrame(json.loads(output_of("summarize", "--golden", path))["tasks"])
            worst = traced["response_authors_ms"].map(lambda values: values["max"])
            tables.append(traced.assign(setting=percent, executor=TRACED, response_max_ms=worst))
        timers = pd.concat(tables, ignore_index=True)
        timers["ran"] = timers["reached"] - timers["skipped"]
        self.timers = timers.assign(study="timers", source=REAL, repetition=0)
        autoware = pd.read_csv(folder / "rclcpp_autoware.csv")
        autoware = autoware[autoware["crunch_limit"] == AUTOWARE_CRUNCH_LIMIT]
        self.hot_path = autoware.assign(executor=autoware["executor"].map(our_name)).set_index("executor")

    def hot_path_ms(self, quantile: str) -> dict[str, float]:
        """By executor; `quantile` is p50, p90, p99 or max."""
        values = self.hot_path.get(f"hot_path_{quantile}_ms", pd.Series(dtype=float))
        return {str(executor): float(value) for executor, value in values.items()}
