#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Reports which performance targets of hotpath_rclcpp the runs of launch_scripts/ros2_bars.sh meet.

Also counts the wake-ups of an idle component_container_hotpath of the sourced workspace. Exit code
1 if a target is missed.
"""

import csv
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

from evidence import hotpath, parser, publish
from hotpath_report.run import Run, samples_of
from hotpath_report.statistics import median

RESULT = "ros2/bars.json"
CRUNCHES_MS = 5 * 0.8 / 190 * 1000  # on one thread, at 80 % and 190 crunches a second
IDLE_S = 10


def executors(folder: Path) -> dict[str, Any]:
    """The summaries of the executors, by name without the stack."""
    return {e["executor"].split("@")[0]: e for e in Run(folder).summary()}


def hot_path(executor: dict[str, Any]) -> dict[str, Any]:
    return next(c for c in executor["chains"] if c["chain"] == "hot_path")["hot_path_latency_ms"]


def middle_worst(folder: Path, name: str) -> float:
    """Median of the repetitions' largest hot-path latencies, in ms."""
    found = samples_of(Run(folder).samples("chains"), "hot_path_ms", exact=False)["hot_path"]
    return next(of for executor, of in found.items() if executor.split("@")[0] == name).middle_worst()


def cpu_per_callback(folder: Path) -> dict[str, float]:
    """By executor: CPU time per executed callback (us), median of the repetitions."""
    with open(folder / "jobs.csv", encoding="utf-8", newline="") as file:
        rows = csv.DictReader(file)
        ran = Counter((r["executor"], int(r["repetition"])) for r in rows if r["outcome"] == "ran")
    found: dict[str, list[float]] = {}
    for run in Run(folder)["runs"]:
        each = run["usage"]["cpu_time_ms"] * 1e3 / ran[run["executor"], run["repetition"]]
        found.setdefault(run["executor"].split("@")[0], []).append(each)
    return {name: median(values) for name, values in found.items()}


def voluntary_switches(process: int) -> int:
    """Of the threads of an executor: the spinning thread and the timer thread."""
    count = 0
    for task in Path(f"/proc/{process}/task").iterdir():
        status = (task / "status").read_text(encoding="utf-8")
        if task.name == str(process) or status.startswith("Name:\thotpath_"):
            count += int(status.partition("\nvoluntary_ctxt_switches:")[2].split()[0])
    return count


def idle_wakeups() -> int:
    """Wake-ups in IDLE_S seconds of an executor whose node has nothing to do."""
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(":")
    programs = [Path(p, "lib/hotpath_rclcpp/component_container_hotpath") for p in prefixes]
    program = next(filter(Path.exists, programs), None)
    if program is None:
        sys.exit("ros2_bars.py: no sourced workspace has hotpath_rclcpp; run launch_scripts/ros2_build.sh")
    with subprocess.Popen([program], stderr=subprocess.DEVNULL) as container:
        time.sleep(3)
        before = voluntary_switches(container.pid)
        time.sleep(IDLE_S)
        count = voluntary_switches(container.pid) - before
        container.send_signal(signal.SIGINT)
    return count


def similarities(run: Path) -> dict[str, float]:
    """By executor: similarity of job orders to the simulator's, median of the repetitions."""
    found: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory(prefix="hotpath_bars_") as scratch:
        hotpath("diff", run, "--simulated", "--output", f"{scratch}/validation")
        for compared in json.loads(Path(scratch, "validation/validation.json").read_text("utf-8"))["runs"]:
            name = compared["executor"].split("@")[0]
            found.setdefault(name, []).append(compared["comparison"]["similarity"])
    return {name: median(values) for name, values in found.items()}


def main() -> int:
    arguments = parser(__doc__, RESULT)
    arguments.add_argument("folder", type=Path, help="of launch_scripts/ros2_bars.sh")
    options = arguments.parse_args()
    folder: Path = options.folder
    autoware, timers = executors(folder / "autoware"), executors(folder / "timers")
    ours, default = hot_path(autoware["rm-ro"]), hot_path(autoware["default"])
    cpu = cpu_per_callback(folder / "no_work")
    middle = {name: middle_worst(folder / "autoware", name) for name in ("default", "rm-ro")}
    bars = [
        ("worst hot path, default / rm-ro", default["max"] / ours["max"], ">=", 2.6),
        ("the same, middle repetition", middle["default"] / middle["rm-ro"], ">=", 2.6),
        ("median hot path of rm-ro / five crunches", ours["p50"] / CRUNCHES_MS, "<=", 1.05),
        ("CPU of a callback without work, rm-ro / events-ro", cpu["rm-ro"] / cpu["events-ro"], "<=", 0.9),
        ("CPU of a callback without work, rm-ro / default", cpu["rm-ro"] / cpu["default"], "<=", 0.18),
        ("timestamps skipped at 90 % by rm-ro", timers["rm-ro"]["skipped"], "<=", 0),
        ("timestamps skipped at 90 % by edf-ro", timers["edf-ro"]["skipped"], "<=", 0),
        (f"wake-ups of an idle executor in {IDLE_S} s", idle_wakeups(), "<=", 0),
    ]
    for name in ("timers", "autoware"):
        alike = similarities(folder / name)
        for executor in ("rm-ro", "edf-ro"):
            what = f"order of jobs as simulated, {name}, {executor}, median"
            bars.append((what, alike[executor], ">=", 0.98))
    told = [
        {"what": what, "measured": round(value, 3), "bar": f"{relation} {bar:.3g}",
         "met": value >= bar if relation == ">=" else value <= bar}
        for what, value, relation, bar in bars
    ]  # fmt: skip
    for row in told:
        print(f"{row['what']:52} {row['measured']:8.3f}  {row['bar']}  {'met' if row['met'] else 'NOT MET'}")
    if options.publish:
        run = Run(folder / "autoware")
        of_timers = [t["after_warm_up"] for t in timers["default"]["tasks"] if t["kind"] == "timer"]
        lost = max(t["dropped_percent"] for t in of_timers)
        facts = {"bars": told, "default_lost_percent": round(lost, 1)}
        publish(RESULT, facts | {"date": run["date"][:10], "machine": run["machine"]["cpu_model"]})
    return int(not all(row["met"] for row in told))


if __name__ == "__main__":
    sys.exit(main())
