#!/usr/bin/env -S PYTHONPATH=bench /usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Counts how often `hotpath diff --gate` fires, with and without a slowdown.

The builds are the same (A/A), or one is slower by 3, 5, 10 or 20 %. Live: each repetition has the
samples of a measured repetition of the same executor (DATA, of a published reproduction), scaled
by noise as large as the noise between the measured repetitions; one executor is slower. Simulated:
Autoware at random phases under two executors, with other seeds for A/A, otherwise with the same
seeds and more load. Exit code 1 if an A/A comparison fires more often than --most-alarms, or if 5 %
more simulated load is found less often than --least-found.
"""

import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from evidence import RESULTS, hotpath, parser
from hotpath_report.comparison.gate import of_hot_paths
from hotpath_report.comparison.sides import Key, Side, losses, read, regardless_of_load, side
from hotpath_report.comparison.judgement import judge
from hotpath_report.statistics import Samples, median

SLOWER = (1.0, 1.03, 1.05, 1.10, 1.20)  # the first is A/A
LOADS = (20, 40, 60, 80)


class Noise:
    """Draws repetitions like the measured repetitions of one executor."""

    def __init__(self, measured: Samples) -> None:
        self.repetitions = measured.repetitions
        self.medians = [median(r) for r in self.repetitions]
        logs = np.log(self.medians)
        self.centre, self.deviation = float(logs.mean()), float(logs.std(ddof=1))

    def draw(self, random: np.random.Generator, repetitions: int, factor: float = 1.0) -> Samples:
        """New repetitions, with all latencies times `factor`."""
        made = []
        for k in random.integers(len(self.repetitions), size=repetitions):
            shape = self.repetitions[k] / self.medians[k]
            made.append(shape * np.exp(random.normal(self.centre, self.deviation)) * factor)
        return Samples(made)


class Live:
    """Builds that differ by the noise between measured repetitions."""

    def __init__(self, data: Path, repetitions: int, random: np.random.Generator) -> None:
        self.noise = {
            key: Noise(samples)
            for key, samples in read(data).items()
            if key[:3] == ("hot path", "autoware", "live") and len(samples.repetitions) > 2
        }
        self.lost = {k: list(c.values()) for k, c in losses(data).items() if k[2] == "live" and len(c) > 2}
        self.repetitions, self.random = repetitions, random

    def counts(self) -> Mapping[Key, Mapping[int, float]]:
        """Losses of a build."""
        return {k: dict(enumerate(self.random.choice(c, self.repetitions))) for k, c in self.lost.items()}

    def fires(self, run: int, factor: float) -> bool:
        """Whether the gate finds the slower executor; for A/A, whether it finds anything."""
        slower = list(self.noise)[run % len(self.noise)]
        old = {k: n.draw(self.random, self.repetitions) for k, n in self.noise.items()}
        new = {
            k: n.draw(self.random, self.repetitions, factor if k == slower else 1)
            for k, n in self.noise.items()
        }
        worse = [j.what for j in judge(Side(old, self.counts(), {}), Side(new, self.counts(), {})) if j.worse]
        return bool(worse) if factor == 1 else " ".join(filter(None, slower)) in worse


def simulated_fires(repetitions: int, folder: Path, run: int, factor: float) -> bool:
    """Whether the gate fires between simulations with new seeds, or `factor` times the load."""
    load, seed, sides = LOADS[run % len(LOADS)], 1 + 2 * run * repetitions, []
    new_seed = seed + (factor == 1) * repetitions
    for name, work, first in (("old", load, seed), ("new", load * factor, new_seed)):
        output = folder / f"{run}-{factor}-{name}"
        words = f"simulate --executors default,rm-ro --phases random --duration 5 --load {work:g}".split()
        hotpath(*words, "--seed", first, "--repetitions", repetitions, "--output", output)
        sides.append(of_hot_paths(side(output)))
    return any(j.worse for j in judge(*regardless_of_load(*sides)))


def main() -> int:
    """Exit code."""
    arguments = parser(__doc__)
    arguments.add_argument("data", nargs="?", type=Path, default=RESULTS / "paper", metavar="DATA")
    arguments.add_argument("--runs", type=int, default=200)
    arguments.add_argument("--repetitions", type=int, default=5, help="of each build")
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--most-alarms", type=float, default=0.01, help="share of the A/A runs")
    arguments.add_argument("--least-found", type=float, default=1.0, help="share of the loads")
    o = arguments.parse_args()
    live = Live(o.data, o.repetitions, np.random.default_rng(o.seed))
    for key, n in live.noise.items():
        print(f"{' '.join(filter(None, key))}: repetitions' medians differ by {100 * n.deviation:.1f} %")
    print(f"\nAlarms in {o.runs} comparisons with {o.repetitions} repetitions a side:\n")
    print("| repetitions | A/A | " + " | ".join(f"+{100 * (f - 1):.0f} %" for f in SLOWER[1:]) + " |")
    print("| --- |" + " ---: |" * len(SLOWER))
    with tempfile.TemporaryDirectory() as folder:
        kinds: dict[str, Callable[[int, float], bool]] = {
            "live": live.fires,
            "simulated": lambda run, factor: simulated_fires(o.repetitions, Path(folder), run, factor),
        }
        shares = {}
        for kind, fires in kinds.items():
            alarms = [sum(fires(run, factor) for run in range(o.runs)) for factor in SLOWER]
            print(f"| {kind} | " + " | ".join(map(str, alarms)) + " |", flush=True)
            shares[kind] = [count / o.runs for count in alarms]
    found = shares["simulated"][SLOWER.index(1.05)]
    return int(max(s[0] for s in shares.values()) > o.most_alarms or found < o.least_found)


if __name__ == "__main__":
    sys.exit(main())
