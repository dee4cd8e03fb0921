# SPDX-License-Identifier: Apache-2.0
"""Measurements of the real ROS 2 stack on the same workloads (reference_system/ros2_reference)."""

import json
from pathlib import Path

import pandas as pd

from hotpath_report.hotpath_command import PACKAGE, executor_named, output_of

REAL = "real"  # the source of its rows
FOLDERS = tuple(
    PACKAGE.parents[1] / package / "ros2_reference"
    for package in ("reference_system", "hotpath_reference_system")
)
# Executor names there and here. The fork gives all subscriptions one top priority (rule `first`).
WORDS = {"singlethreaded": "default", "staticsinglethreaded": "static", "multithreaded": "multi"}
WORDS |= {"events_re": "events-re"}
COUNTED_IN_TRACES = "events-re"  # the longer runs lack it
AUTOWARE_CRUNCH_LIMIT = 6000  # 80 % of one core on the reference machine


def our_name(executor: str) -> str:
    """The registry's name for an executor; there, release-only executors lack the suffix `-ro`."""
    name = WORDS.get(executor, executor)
    return name if executor_named(name) else f"{name}-ro"


def traced_timers(path: Path) -> pd.DataFrame:
    """The timers of a golden trace timers_only_PERCENT.EXECUTOR.csv."""
    graph, executor = path.stem.split(".")
    timers = pd.DataFrame(json.loads(output_of("feed", "golden", path))["tasks"])
    worst = [response["max"] for response in timers["response_ms"]]
    return timers.assign(setting=int(graph.split("_")[-1]), executor=executor, response_max_ms=worst)


class Reference:
    """Timers (as TimerRuns.counts) and hot path (ms) by executor; empty if not measured."""

    def __init__(self) -> None:
        self.timers, self.hot_path = pd.DataFrame(), pd.DataFrame()
        folder = next((f for f in FOLDERS if f.is_dir()), None)
        if folder is None:
            return
        names = {"utilisation_percent": "setting", "released": "reached", "dropped": "skipped"}
        timers = pd.read_csv(folder / "rclcpp_timers_only.csv").rename(columns=names)
        timers["executor"] = timers["executor"].map(our_name)
        traced = pd.concat(map(traced_timers, sorted((folder / "traces").glob("timers_only_*.csv"))))
        counted = pd.concat([timers, traced[traced["executor"] == COUNTED_IN_TRACES]], ignore_index=True)
        # The authors' programs measure another response time, see the reference's README.
        counted = counted.drop(columns="response_max_ms")
        keys = ["setting", "executor", "task"]
        timers = counted.merge(traced[[*keys, "response_max_ms"]], on=keys, how="left")
        timers["ran"] = timers["reached"] - timers["skipped"]
        self.timers = timers.assign(study="timers", source=REAL, repetition=0)
        autoware = pd.read_csv(folder / "rclcpp_autoware.csv")
        autoware = autoware[autoware["crunch_limit"] == AUTOWARE_CRUNCH_LIMIT]
        self.hot_path = autoware.assign(executor=autoware["executor"].map(our_name)).set_index("executor")

    def hot_path_ms(self, quantile: str) -> dict[str, float]:
        """By executor; `quantile` is p50, p90, p99 or max."""
        values = self.hot_path.get(f"hot_path_{quantile}_ms", pd.Series(dtype=float))
        return {str(executor): float(value) for executor, value in values.items()}
