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
from hotpath_report.run import Run
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
    rows = Run(folder).latencies()
    mine = rows[(rows["executor"].str.split("@").str[0] == name) & (rows["chain"] == "hot_path")]
    return median(mine.groupby("repetition")["hot_path_ms"].max().tolist())


def cpu_per_callback(folder: Path) -> dict[str, list[float]]:
    """By executor: CPU time per executed callback (us) of each repetition, sorted."""
    with open(folder / "jobs.csv", encoding="utf-8", newline="") as file:
        rows = csv.DictReader(file)
        ran = Counter((r["executor"], int(r["repetition"])) for r in rows if r["outcome"] == "ran")
    found: dict[str, list[float]] = {}
    for run in Run(folder)["runs"]:
        each = run["usage"]["cpu_time_ms"] * 1e3 / ran[run["executor"], run["repetition"]]
        found.setdefault(run["executor"].split("@")[0], []).append(each)
    return {name: sorted(values) for name, values in found.items()}


def worst_loss(executor: dict[str, Any]) -> float:
    """The largest share of a timer's timestamps without a job, in percent."""
    timers = [t["after_warm_up"] for t in executor["tasks"] if t["kind"] == "timer"]
    return max(t["dropped_percent"] for t in timers)


def voluntary_switches(process: int) -> int:
    """Of the threads of an executor: the spinning thread and the timer thread."""
    count = 0
    for task in Path(f"/proc/{process}/task").iterdir():
        name = (task / "comm").read_text(encoding="utf-8").strip()
        if task.name != str(process) and not name.startswith("hotpath_"):
            continue
        for line in (task / "status").read_text(encoding="utf-8").splitlines():
            if line.startswith("voluntary_ctxt_switches:"):
                count += int(line.split()[1])
    return count


def idle_wakeups() -> int:
    """Wake-ups in IDLE_S seconds of an executor whose node has nothing to do."""
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(":")
    found = [Path(p) / "lib/hotpath_rclcpp/component_container_hotpath" for p in prefixes]
    program = next((p for p in found if p.exists()), None)
    if program is None:
        sys.exit("ros2_bars.py: no sourced workspace has hotpath_rclcpp; run launch_scripts/ros2_build.sh")
    with subprocess.Popen([program], stderr=subprocess.DEVNULL) as container:
        time.sleep(3)
        before = voluntary_switches(container.pid)
        time.sleep(IDLE_S)
        count = voluntary_switches(container.pid) - before
        container.send_signal(signal.SIGINT)
    return count


def stolen(folder: Path, name: str) -> str:
    """Stolen time (ms) in each repetition of Autoware."""
    runs = [r for r in Run(folder / "autoware")["runs"] if r["executor"].split("@")[0] == name]
    return ", ".join(f"{r['usage']['stolen_ms']:.0f}" for r in runs)


def similarities(run: Path) -> dict[str, list[float]]:
    """By executor: similarity of job orders to the simulator's, of each repetition, sorted."""
    with tempfile.TemporaryDirectory(prefix="hotpath_bars_") as scratch:
        output = Path(scratch) / "validation"
        hotpath("diff", run, "--simulated", "--output", output)
        validation = json.loads((output / "validation.json").read_text(encoding="utf-8"))
    found: dict[str, list[float]] = {}
    for compared in validation["runs"]:
        found.setdefault(compared["executor"].split("@")[0], []).append(compared["comparison"]["similarity"])
    return {name: sorted(values) for name, values in found.items()}


def main() -> int:
    arguments = parser(__doc__, RESULT)
    arguments.add_argument("folder", type=Path, help="of launch_scripts/ros2_bars.sh")
    options = arguments.parse_args()
    folder: Path = options.folder
    autoware, timers = executors(folder / "autoware"), executors(folder / "timers")
    ours, default = hot_path(autoware["rm-ro"]), hot_path(autoware["default"])
    costs = cpu_per_callback(folder / "no_work")
    cpu = {name: median(values) for name, values in costs.items()}
    middle = {name: middle_worst(folder / "autoware", name) for name in ("default", "rm-ro")}
    crowded = "timestamps skipped at 90 % by"
    bars = [
        ("worst hot path, default / rm-ro", default["max"] / ours["max"], ">=", 2.6),
        ("the same, middle repetition", middle["default"] / middle["rm-ro"], ">=", 2.6),
        ("median hot path of rm-ro / five crunches", ours["p50"] / CRUNCHES_MS, "<=", 1.05),
        ("CPU of a callback without work, rm-ro / events-ro", cpu["rm-ro"] / cpu["events-ro"], "<=", 0.9),
        ("CPU of a callback without work, rm-ro / default", cpu["rm-ro"] / cpu["default"], "<=", 0.18),
        (f"{crowded} rm-ro", timers["rm-ro"]["skipped"], "<=", 0),
        (f"{crowded} edf-ro", timers["edf-ro"]["skipped"], "<=", 0),
        (f"wake-ups of an idle executor in {IDLE_S} s", idle_wakeups(), "<=", 0),
    ]
    for name in ("timers", "autoware"):
        alike = similarities(folder / name)
        for executor in ("rm-ro", "edf-ro"):
            what = f"order of jobs as simulated, {name}, {executor}, median"
            bars.append((what, median(alike[executor]), ">=", 0.98))
            print(f"{name}, {executor}, as simulated: {', '.join(f'{v:.3f}' for v in alike[executor])}")
    told = [
        {"what": what, "measured": round(value, 3), "bar": f"{relation} {bar:.3g}",
         "met": value >= bar if relation == ">=" else value <= bar}
        for what, value, relation, bar in bars
    ]  # fmt: skip
    for row in told:
        print(f"{row['what']:52} {row['measured']:8.3f}  {row['bar']}  {'met' if row['met'] else 'NOT MET'}")
    print(f"timestamps that default lost of one task at 90 %, at most: {worst_loss(timers['default']):.1f} %")
    for name in ("rm-ro", "edf-ro"):
        print(
            f"timestamps skipped in Autoware by {name}: {autoware[name]['skipped']};"
            f" ms stolen of each repetition: {stolen(folder, name)}"
        )
    for name, values in costs.items():
        print(f"CPU of a callback without work, us, {name}: {', '.join(f'{v:.1f}' for v in values)}")
    if options.publish:
        run = Run(folder / "autoware")
        facts = {"bars": told, "default_lost_percent": round(worst_loss(timers["default"]), 1)}
        publish(RESULT, facts | {"date": run["date"][:10], "machine": run["machine"]["cpu_model"]})
    return int(not all(row["met"] for row in told))


if __name__ == "__main__":
    sys.exit(main())
