#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Says which bars of hotpath_rclcpp the runs of launch_scripts/ros2_bars.sh meet.

Counts the wake-ups of an idle component_container_hotpath, too, which the sourced workspace must have. With --publish
the figures go to results/ros2/bars.json. Exit code 1: a bar is not met.
"""

import argparse
import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
HOTPATH = os.environ.get("HOTPATH", str(ROOT / "build/bench/hotpath"))
CRUNCHES_MS = 5 * 0.8 / 190 * 1000  # on one thread, at 80 % and 190 crunches a second
IDLE_S = 10


def executors(folder: Path) -> dict[str, Any]:
    """What summary.json has of each executor, by its name without the stack."""
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    return {e["executor"].split("@")[0]: e for e in summary["executors"]}


def hot_path(executor: dict[str, Any]) -> dict[str, Any]:
    return next(c for c in executor["chains"] if c["chain"] == "hot_path")["hot_path_latency_ms"]


def worst_loss(executor: dict[str, Any]) -> float:
    """Share of the timestamps of a task, in percent, for which nothing ran: the largest."""
    timers = [t["after_warm_up"] for t in executor["tasks"] if t["kind"] == "timer"]
    return max(t["dropped_percent"] for t in timers)


def voluntary_switches(process: int) -> int:
    """Of the threads of an executor: the one that spins, and that of its timers."""
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
    """Of an executor whose node has nothing to do, in IDLE_S seconds."""
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(":")
    found = [Path(p) / "lib/hotpath_rclcpp/component_container_hotpath" for p in prefixes]
    program = next((p for p in found if p.exists()), None)
    if program is None:
        sys.exit(
            "ros2_bars.py: no sourced workspace has hotpath_rclcpp; build it with launch_scripts/ros2_build.sh"
        )
    with subprocess.Popen([program], stderr=subprocess.DEVNULL) as container:
        time.sleep(3)
        before = voluntary_switches(container.pid)
        time.sleep(IDLE_S)
        count = voluntary_switches(container.pid) - before
        container.send_signal(signal.SIGINT)
    return count


def stolen(folder: Path, name: str) -> str:
    """ms that the host of a virtual machine took from each repetition of Autoware."""
    runs = json.loads((folder / "autoware/run.json").read_text(encoding="utf-8"))["runs"]
    return ", ".join(f"{r['usage']['stolen_ms']:.0f}" for r in runs if r["executor"].split("@")[0] == name)


def similarities(run: Path) -> dict[str, list[float]]:
    """How alike the order of jobs is to the simulator's: by executor, of each repetition in rising order."""
    with tempfile.TemporaryDirectory(prefix="hotpath_bars_") as scratch:
        output = Path(scratch) / "validation"
        words = [HOTPATH, "validate", str(run), "--output", str(output)]
        subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
        validation = json.loads((output / "validation.json").read_text(encoding="utf-8"))
    found: dict[str, list[float]] = {}
    for compared in validation["runs"]:
        found.setdefault(compared["executor"].split("@")[0], []).append(compared["comparison"]["similarity"])
    return {name: sorted(values) for name, values in found.items()}


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("folder", type=Path, help="of launch_scripts/ros2_bars.sh")
    parser.add_argument("--publish", action="store_true")
    options = parser.parse_args()
    folder: Path = options.folder
    autoware, no_work, timers = (executors(folder / name) for name in ("autoware", "no_work", "timers"))
    ours, default = hot_path(autoware["rm-ro"]), hot_path(autoware["default"])
    cpu = {name: e["cpu_per_callback_us"] for name, e in no_work.items()}
    crowded = "timestamps skipped at 90 % by"
    bars = [
        ("worst hot path, default / rm-ro", default["max"] / ours["max"], ">=", 2.0),
        ("median hot path of rm-ro / five crunches", ours["p50"] / CRUNCHES_MS, "<=", 1.1),
        ("CPU of a callback without work, rm-ro / events-ro", cpu["rm-ro"] / cpu["events-ro"], "<=", 1.15),
        ("CPU of a callback without work, rm-ro / default", cpu["rm-ro"] / cpu["default"], "<=", 0.333),
        (f"{crowded} rm-ro", timers["rm-ro"]["skipped"], "<=", 0),
        (f"{crowded} edf-ro", timers["edf-ro"]["skipped"], "<=", 0),
        (f"wake-ups of an idle executor in {IDLE_S} s", idle_wakeups(), "<=", 0),
    ]
    for name in ("timers", "autoware"):
        alike = similarities(folder / name)
        for executor in ("rm-ro", "edf-ro"):
            what = f"order of jobs as simulated, {name}, {executor}, median"
            bars.append((what, statistics.median(alike[executor]), ">=", 0.98))
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
    print("CPU of a callback without work, us: " + ", ".join(f"{n} {v:.1f}" for n, v in cpu.items()))
    if options.publish:
        run = json.loads((folder / "autoware/run.json").read_text(encoding="utf-8"))
        facts = {"bars": told, "default_lost_percent": round(worst_loss(timers["default"]), 1)}
        facts |= {"date": run["date"][:10], "machine": run["machine"]["cpu_model"]}
        file = ROOT / "results/ros2/bars.json"
        file.parent.mkdir(exist_ok=True)
        file.write_text(json.dumps(facts, indent=2) + "\n", encoding="utf-8")
    return int(not all(row["met"] for row in told))


if __name__ == "__main__":
    sys.exit(main())
