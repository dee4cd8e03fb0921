#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Measures what `hotpath watch` costs a program: CPU time with and without the watcher, by turns.

    tools/watch_cost.py --pairs 40 -- chrt -f 50 faulty_program single load 35000 5 1000

The command must do the same work in every run, and end by itself. CPU time is user and system time of
the command and its children; the watcher's own CPU time is stated separately.

    tools/watch_cost.py --pairs 16 --jobs -- hotpath run --stack rclcpp --work fixed --load 45 --graph FILE

With --jobs, the command is `hotpath run` with one executor, and only the CPU time of its callbacks
and executor counts, per callback: not what hotpath itself needs to prepare the run and to draw. The
medians of its chains' latencies are compared as well.
"""

import argparse
import json
import os
import random
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

DRAWS = 10_000  # of the bootstrap


class Cost(NamedTuple):
    """Seconds of one run, with --jobs `program` of one callback."""

    program: float
    watcher: float
    length: float
    events: int
    chains: dict[str, float]  # with --jobs: median of each hot-path latency, ms


def children_s() -> float:
    """CPU time of all children that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def run_child(folder: Path, command: list[str]) -> None:
    """Runs the command and stores its CPU time."""
    code = subprocess.run(command, stdout=subprocess.DEVNULL).returncode
    (folder / "cpu_s").write_text(str(children_s()))
    sys.exit(code)


def summary_of(run: Path) -> tuple[float, dict[str, float]]:
    """Of a run with one executor: CPU time of one callback, executor included, and medians of chains."""
    executor = json.loads((run / "summary.json").read_text())["executors"][0]
    chains = {c["chain"]: float(c["hot_path_latency_ms"]["p50"]) for c in executor["chains"]}
    return float(executor["cpu_per_callback_us"]) / 1e6, chains


def measure(hotpath: str, command: list[str], watched: bool, jobs: bool) -> Cost:
    """One run."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        words = [sys.executable, os.path.abspath(__file__), "--child", name, "--", *command]
        if jobs:
            words += ["--output", str(folder / "run")]
        if watched:
            words = [hotpath, "watch", "--json", "--", *words]
        before, began = children_s(), time.monotonic()
        done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        length = time.monotonic() - began
        if done.returncode != 0:
            sys.exit(f"watch_cost.py: `{' '.join(words)}` failed with code {done.returncode}")
        total = float((folder / "cpu_s").read_text())
        program, chains = summary_of(folder / "run") if jobs else (total, {})
    report = json.loads(done.stdout.splitlines()[-1]) if watched else {"events": 0}
    if watched and report["dropped"] + report["damaged"] > 0:
        print(f"watch_cost.py: note: {report['dropped']} events were dropped", file=sys.stderr)
    return Cost(program, children_s() - before - total, length, report["events"], chains)


def interval(values: list[float]) -> tuple[float, float, float]:
    """Median, and its 95 % interval over pairs (bootstrap, percentiles)."""
    draw = random.Random(1)
    medians = sorted(statistics.median(draw.choices(values, k=len(values))) for _ in range(DRAWS))
    return statistics.median(values), medians[int(DRAWS * 0.025)], medians[int(DRAWS * 0.975)]


def main() -> None:
    """Prints the cost, with its interval over pairs."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--hotpath", default="hotpath", help="the command (default: along PATH)")
    parser.add_argument("--pairs", type=int, default=20, help="of runs (default: 20)")
    parser.add_argument("--jobs", action="store_true", help="the command is `hotpath run`; per callback")
    parser.add_argument("--child", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("command", nargs="+", help="program and arguments, after --")
    options = parser.parse_args()
    if options.child:
        run_child(options.child, options.command)
    pairs: list[tuple[Cost, Cost]] = []
    for pair in range(options.pairs):
        first = measure(options.hotpath, options.command, pair % 2 == 0, options.jobs)
        second = measure(options.hotpath, options.command, pair % 2 == 1, options.jobs)
        pairs.append((first, second) if pair % 2 == 0 else (second, first))
        with_it, without = pairs[-1]
        ratio = with_it.program / without.program
        print(
            f"pair {pair + 1}: {with_it.program:.4g} s, without {without.program:.4g} s, {ratio:.4f}",
            flush=True,
        )
    shares = [100 * (with_it.program / without.program - 1) for with_it, without in pairs]
    each_ns = [1e9 * (with_it.program - without.program) / with_it.events for with_it, without in pairs]
    own = [100 * with_it.watcher / with_it.length for with_it, _ in pairs]
    rows = [("CPU time with the sensor", shares, "%"), ("the watcher itself, of one core", own, "%")]
    if not options.jobs:
        rows.append(("CPU time with the sensor, per event", each_ns, "ns"))
    for chain in pairs[0][0].chains:
        changes = [100 * (with_it.chains[chain] / without.chains[chain] - 1) for with_it, without in pairs]
        rows.append((f"median latency of {chain}", changes, "%"))
    for title, values, unit in rows:
        middle, low, high = interval(values)
        print(f"{title}: median {middle:+.2f} {unit} (95 % interval {low:+.2f} to {high:+.2f})")
    events = sum(with_it.events / with_it.length for with_it, _ in pairs) / len(pairs)
    print(f"{options.pairs} pairs, {events:.0f} events a second, load average {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
