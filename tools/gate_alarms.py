#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""How often `hotpath compare-results --gate` fires: on the same build measured twice (A/A), and when the latencies of
one executor are 10 % longer. In virtual time: each repetition has the samples of a measured one of the same executor
(DATA, of a published reproduction), moved by noise as large as that between the measured repetitions. Exit code 1 if
A/A fires more often than --most-alarms, or the injected slow-down is found less often than --least-found."""

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "bench"))

from hotpath_report.pages.compare import Key, losses, read  # noqa: E402
from hotpath_report.pages.judgement import judge  # noqa: E402
from hotpath_report.statistics import Samples  # noqa: E402

SLOWER = 1.10


class Noise:
    """Repetitions like those that were measured of one executor."""

    def __init__(self, measured: Samples) -> None:
        self.repetitions = measured.repetitions
        medians = np.log([np.median(r) for r in self.repetitions])
        self.centre, self.deviation = float(np.mean(medians)), float(np.std(medians, ddof=1))

    def draw(self, random: np.random.Generator, repetitions: int, factor: float = 1.0) -> Samples:
        """New repetitions, all `factor` times as long."""
        made = []
        for k in random.integers(len(self.repetitions), size=repetitions):
            shape = self.repetitions[k] / np.median(self.repetitions[k])
            made.append(shape * np.exp(random.normal(self.centre, self.deviation)) * factor)
        return Samples(made)


def fires(
    noise: Mapping[Key, Noise],
    lost: Mapping[Key, list[float]],
    random: np.random.Generator,
    repetitions: int,
    slower: Key | None,
) -> bool:
    """Whether the gate finds anything worse in one pair of builds; for `slower`, whether it finds that."""
    old = {key: n.draw(random, repetitions) for key, n in noise.items()}
    new = {key: n.draw(random, repetitions, SLOWER if key == slower else 1) for key, n in noise.items()}
    counts = [{key: random.choice(c, repetitions) for key, c in lost.items()} for _ in range(2)]
    worse = [j for j in judge(old, new, (counts[0], counts[1]), intervals=False) if j.worse]
    if slower is None:
        return bool(worse)
    return any(j.what == " ".join(filter(None, slower)) and j.measure == "p50" for j in worse)


def main() -> int:
    """Exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", nargs="?", type=Path, default=ROOT / "results" / "paper", metavar="DATA")
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--repetitions", type=int, default=20, help="of each build")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--most-alarms", type=float, default=0.01, help="share of the A/A runs")
    parser.add_argument("--least-found", type=float, default=0.95, help="share of the slow-downs")
    o = parser.parse_args()
    measured = {
        k: s
        for k, s in read(o.data).items()
        if k[:3] == ("hot path", "autoware", "live") and len(s.repetitions) > 2
    }
    noise = {key: Noise(samples) for key, samples in measured.items()}
    lost = {k: c for k, c in losses(o.data).items() if k[2] == "live" and len(c) > 2}
    for key, n in noise.items():
        print(f"{' '.join(filter(None, key))}: repetitions' medians differ by {100 * n.deviation:.1f} %")
    random = np.random.default_rng(o.seed)
    alarms = sum(fires(noise, lost, random, o.repetitions, None) for _ in range(o.runs))
    keys = list(noise)
    found = sum(fires(noise, lost, random, o.repetitions, keys[i % len(keys)]) for i in range(o.runs))
    data = f"{len(noise)} executors, {len(lost)} counts of losses, {o.repetitions} repetitions of each build"
    print(f"A/A: {alarms} of {o.runs} fire; 10 % slower: {found} of {o.runs} are found ({data})")
    return int(alarms > o.most_alarms * o.runs or found < o.least_found * o.runs)


if __name__ == "__main__":
    sys.exit(main())
