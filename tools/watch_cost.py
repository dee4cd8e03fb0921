#!/usr/bin/env -S PYTHONPATH=bench /usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Measures what `hotpath watch` costs a program: CPU time with and without the watcher, by turns.

    tools/watch_cost.py --pairs 40 -- chrt -f 50 faulty_program single load 35000 5 1000
    tools/watch_cost.py --pairs 16 --jobs -- hotpath run --stack rclcpp --work fixed --load 45 --graph FILE

The command must do the same work in every run, and end by itself. With --jobs, it is `hotpath run` with
one executor, and only the CPU time of its callbacks and executor counts, per callback; the medians of
its chains' latencies are compared as well.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from evidence import parser
from hotpath_report.run import Run
from hotpath_report.statistics import Samples

Costs = dict[str, float]  # of one run: `cpu` (s; with --jobs, of a callback), `events`, medians of chains...


def children_s() -> float:
    """CPU time of all children that have ended."""
    return os.times().children_user + os.times().children_system


def measure(hotpath: str, command: list[str], watched: bool, jobs: bool) -> Costs:
    """One run. A shell between watcher and command stores the CPU time of the command."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        words = ["bash", "-c", 'file=$1; shift; "$@" >/dev/null; code=$?; times >"$file"; exit $code', "bash"]
        words += [str(folder / "times"), *command, *(["--output", str(folder / "run")] if jobs else [])]
        words = [hotpath, "watch", "--json", "--", *words] if watched else words
        before, began = children_s(), time.monotonic()
        done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        length, all_s = time.monotonic() - began, children_s() - before
        if done.returncode != 0:
            sys.exit(f"watch_cost.py: `{' '.join(words)}` failed with code {done.returncode}")
        # The second line of `times` is of the children: 0m1.234s 0m0.056s.
        of_command = (folder / "times").read_text().splitlines()[1].replace("s", "").split()
        cpu = sum(60 * float(m) + float(s) for m, s in (word.split("m") for word in of_command))
        report = json.loads(done.stdout.splitlines()[-1]) if watched else {"events": 0}
        costs = {"cpu": cpu, "watcher": (all_s - cpu) / length, "events": report["events"], "length": length}
        if jobs:
            executor = Run(folder / "run").summary()[0]
            costs["cpu"] = executor["cpu_per_callback_us"] / 1e6
            costs |= {c["chain"]: c["hot_path_latency_ms"]["p50"] for c in executor["chains"]}
    return costs


def main() -> None:
    """Prints the cost, with its interval over pairs."""
    arguments = parser(__doc__)
    arguments.add_argument("--hotpath", default="hotpath", help="the command (default: along PATH)")
    arguments.add_argument("--pairs", type=int, default=20, help="of runs (default: 20)")
    arguments.add_argument("--jobs", action="store_true", help="the command is `hotpath run`; per callback")
    arguments.add_argument("command", nargs="+", help="program and arguments, after --")
    options = arguments.parse_args()
    pairs: list[tuple[Costs, Costs]] = []
    for pair in range(options.pairs):
        costs = {
            on: measure(options.hotpath, options.command, on, options.jobs)
            for on in (pair % 2 == 0, pair % 2 == 1)
        }
        pairs.append((costs[True], costs[False]))
        print(f"pair {pair + 1}: {costs[True]['cpu']:.4g} s, without {costs[False]['cpu']:.4g} s", flush=True)
    compared = pairs[0][0].keys() - {"watcher", "events", "length"}
    rows = {f"{name}, %": [100 * (a[name] / b[name] - 1) for a, b in pairs] for name in sorted(compared)}
    rows["the watcher itself, % of one core"] = [100 * watched["watcher"] for watched, _ in pairs]
    if pairs[0][0]["events"] and not options.jobs:
        rows["cpu per event, ns"] = [1e9 * (a["cpu"] - b["cpu"]) / a["events"] for a, b in pairs]
    for title, values in rows.items():
        median = Samples([value] for value in values).estimate(0.5)
        print(f"{title}: median {median.value:+.2f} (95 % interval {median.low:+.2f} to {median.high:+.2f})")
    events = sum(watched["events"] / watched["length"] for watched, _ in pairs) / len(pairs)
    print(f"{options.pairs} pairs, {events:.0f} events a second, load average {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
