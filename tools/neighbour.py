#!/usr/bin/env -S PYTHONPATH=bench /usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Measures how other participants of the DDS domain, publishing on another CPU, delay the hot path.

Live runs of Autoware under rm-ro on the last CPU alternate between: alone, alone again, beside
participants that take the graph's names in all partitions, and beside participants that read the
run's own names in the discovery traffic, so that its readers match them. Medians are compared with
the first. Exit code 1: unmatched participants move the median by more than a repeated run does.
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from evidence import ROOT, hotpath, parser, publish
from hotpath_report.run import Run
from hotpath_report.statistics import Samples, ratio

RESULT = "reliability/neighbour.json"
STRANGER = os.environ.get("STRANGER", str(ROOT / "build/bench/test/stranger"))
DOMAIN = 97
TOPICS = ("FrontLidarDriver", "PointsTransformerFront", "ObjectCollisionEstimator")
ALONE, AGAIN, UNMATCHED, MATCHED = "alone", "again", "unmatched", "matched"
OPTIONS = {UNMATCHED: ["--partition", "*"], MATCHED: ["--spy"]}


@contextmanager
def strangers(options: list[str] | None, processor: int) -> Iterator[list[int]]:
    """Starts the publishers on a CPU; at their end the list gets the number of samples of each."""
    written: list[int] = []
    words = [STRANGER, "--domain", str(DOMAIN), *(options or []), "--topic"]
    began = [
        subprocess.Popen(["taskset", "-c", str(processor), *words, topic], stdout=subprocess.PIPE, text=True)
        for topic in (TOPICS if options else ())
    ]
    try:
        yield written
    finally:
        for process in began:
            process.send_signal(signal.SIGTERM)
        written += [int(process.communicate()[0]) for process in began]


def measured(kind: str, seconds: float, processors: list[int]) -> tuple[list[float], int]:
    """Latencies of the hot path (ms), and the number of samples the strangers wrote meanwhile."""
    with tempfile.TemporaryDirectory(prefix="hotpath_neighbour_") as scratch:
        folder = Path(scratch) / "run"
        words = [
            "run",
            "--executors",
            "rm-ro",
            "--repetitions",
            1,
            "--load",
            80,
            "--warm-up",
            1,
            "--duration",
            f"{seconds:g}",
        ]
        words += ["--cpus", processors[-1], "--domain", DOMAIN, "--output", folder]
        with strangers(OPTIONS.get(kind), processors[0]) as written:
            hotpath(*words)
        latencies = Run(folder).latencies()
        of_hot_path = list(latencies[latencies["chain"] == "hot_path"]["hot_path_ms"])
        if not of_hot_path:
            sys.exit(f"neighbour.py: {kind}: no hot-path latency; use longer --seconds on an idle machine")
        return of_hot_path, sum(written)


def compared(samples: dict[str, Samples], first: Samples) -> dict[str, Any]:
    """Medians divided by the first one's, with 95 % intervals."""
    found = {kind: ratio(of, first, 0.5) for kind, of in samples.items()}
    return {kind: [round(v, 4) for v in (r.value, r.low, r.high)] for kind, r in found.items()}


def main() -> int:
    """The exit code."""
    arguments = parser(__doc__, RESULT)
    arguments.add_argument("--rounds", type=int, default=10)
    arguments.add_argument("--seconds", type=float, default=8, help="of each run")
    options = arguments.parse_args()
    processors = sorted(os.sched_getaffinity(0))
    if len(processors) < 2:
        sys.exit("neighbour.py: the neighbour needs a processor that is not the run's; there is only one")
    if options.rounds < 2 or options.seconds <= 0:
        arguments.error("--rounds: at least 2; --seconds: a positive number")
    kinds = [ALONE, AGAIN, UNMATCHED, MATCHED]
    latencies: dict[str, list[list[float]]] = {kind: [] for kind in kinds}
    written = dict.fromkeys(kinds, 0)
    for number in range(options.rounds):
        for kind in kinds[number % 4 :] + kinds[: number % 4]:
            of_run, samples = measured(kind, options.seconds, processors)
            latencies[kind].append(of_run)
            written[kind] += samples
        if sys.stderr.isatty():
            print(f"\r{number + 1} of {options.rounds} rounds ", end="", file=sys.stderr, flush=True)
    pooled = {kind: Samples(of_kind) for kind, of_kind in latencies.items()}
    first = pooled.pop(ALONE)
    told = {
        "rounds": options.rounds,
        "seconds": options.seconds,
        "median_ms": round(first.quantile(0.5), 3),
        "over_alone": compared(pooled, first),
        "written": {kind: count for kind, count in written.items() if count},
    }
    print(json.dumps(told, indent=2))
    value, low, high = told["over_alone"][AGAIN]
    moved = abs(told["over_alone"][UNMATCHED][0] - 1) > max(abs(1 - value), 1 - low, high - 1)
    if options.publish and not moved:
        publish(RESULT, told)
    return int(moved)


if __name__ == "__main__":
    sys.exit(main())
