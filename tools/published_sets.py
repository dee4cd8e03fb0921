#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Judges the published task sets of Figure 6a of Radulescu et al. (ECRTS 2025): how many does each
method accept, and of how many does a schedule miss a deadline?

    tools/published_sets.py HOTPATH ARTIFACT > figure_6a.csv

ARTIFACT is a clone of github.com/RaduLucianR/sag-ros-experiments (3fcc836). A set has eight chains
of callbacks on four threads; a chain's deadline is its period. hotpath accepts a set if its bounds
for any phases, of which no execution time is longer than the file's, meet all deadlines. It shows a
miss if a chain of a simulated schedule lasts longer (all timers at one instant, or random phases)."""

import csv
import json
import os
import subprocess
import sys
import tempfile
from itertools import groupby
from pathlib import Path
from typing import Any

EXECUTOR = "multi:4"
PHASES = (["synchronous"], ["random", "--repetitions", "10"])
METHODS = {"Jiang 2022": "Jiang", "Sobhani 2023": "Sobhani", "Radulescu 2025": "Ours"}


def chains_of(text: str) -> list[list[list[int]]]:
    """The chains of a set: rows of period and execution time in ms, deadline, callback, chain."""
    rows = (list(map(int, line.split())) for line in text.strip().splitlines())
    return [list(chain) for _, chain in groupby(rows, lambda row: row[4])]


def graph_of(chains: list[list[list[int]]]) -> str:
    lines = ["name: set", "nodes:", "  - name: N", "    type: callbacks"]
    lines += ["    groups: {g: reentrant}", "    callbacks:"]
    ends = []
    for k, chain in enumerate(chains):
        for i, (period, wcet, *_) in enumerate(chain):
            task = f"timer: t{k}, period_ms: {period}" if i == 0 else f"subscription: s{k}_{i}"
            times = f"execution_time_ms: {{min: {wcet / 2}, max: {wcet}}}"
            lines.append(f"      - {{{task}, {times}, group: g, publishes: s{k}_{i + 1}}}")
        path = [f"N/t{k}", *(f"N/s{k}_{i}" for i in range(1, len(chain)))]
        ends.append(f"  - {{name: c{k}, nodes: [{', '.join(path)}], sources: [{path[0]}], sink: {path[-1]}}}")
    return "\n".join([*lines, "chains:", *ends, ""])


def run(hotpath: str, *words: str) -> Any:
    environment = {**os.environ, "HOTPATH_FIGURES": "none"}
    return json.loads(
        subprocess.run([hotpath, *words], env=environment, check=True, capture_output=True).stdout
    )


def verdict(hotpath: str, text: str) -> str:
    """`accepted`, `missed` or `open`."""
    chains = chains_of(text)
    deadline_ms = {f"c{k}": chain[0][2] for k, chain in enumerate(chains)}
    with tempfile.TemporaryDirectory() as folder:
        graph = Path(folder, "set.yaml")
        graph.write_text(graph_of(chains))
        of = [str(graph), "--executors", EXECUTOR, "--cores", "4", "--json"]
        bounds = {
            row["name"]: row["bound_ns"] for row in run(hotpath, "analyze", *of) if row["kind"] == "chain"
        }
        accepted = all(bounds[c] is not None and bounds[c] <= limit * 1e6 for c, limit in deadline_ms.items())
        missed = False
        for k, phases in enumerate(PHASES):
            end = ["--no-trace", "--duration", "10", "--output", f"{folder}/{k}", "--phases", *phases]
            (found,) = run(hotpath, "simulate", *of, *end)["executors"]
            latest = {chain["chain"]: chain["end_to_end_latency_ms"]["max"] for chain in found["chains"]}
            missed |= any(latest[c] > limit for c, limit in deadline_ms.items())
        if accepted and missed:
            sys.exit(f"a schedule exceeds a bound of {graph.read_text()}")
    return "accepted" if accepted else "missed" if missed else "open"


def main() -> None:
    hotpath, figure = sys.argv[1], Path(sys.argv[2]) / "data/JiangExp/Figure6"
    published = {m: dict(csv.reader((figure / f"Figure6a_data_{f}.csv").open())) for m, f in METHODS.items()}
    out = csv.writer(sys.stdout, lineterminator="\n")
    out.writerow(["utilisation", "sets", *METHODS, "accepted", "missed", "open"])
    for tenth in range(1, 10):
        u = f"0.{tenth}"
        sets = (figure / f"InputToSobhani/vary_Unorm/tasksets_unorm_{u}.txt").read_text().split("-\n")
        verdicts = [verdict(hotpath, text) for text in sets if text.strip()]
        shares = [verdicts.count(v) / len(verdicts) for v in ("accepted", "missed", "open")]
        out.writerow([u, len(verdicts), *(p[u] for p in published.values()), *shares])
        sys.stdout.flush()


main()
