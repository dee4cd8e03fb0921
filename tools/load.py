#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Runs large graphs live, each by itself, and holds every schedule against `hotpath check`.

5000 nodes in one process, 10,000 tasks, 100 processes, 1000 publications a second on one topic; and half a day in
virtual time, in which sequence numbers, and instants in microseconds, pass 32 bits. With --publish the figures are
written to results/reliability/load.json. Exit code 1 when a run fails or its schedule is not legal.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
HOTPATH = os.environ.get("HOTPATH", str(ROOT / "build/bench/hotpath"))
DURATION_S = 10
HALF_A_DAY_S = 43200
NUMBERS = "numbers"


def chains(nodes: int, length: int, period_ms: float) -> str:
    """A graph of chains: a sensor and `length` - 1 transforms, one after the other."""

    def lines() -> Iterator[str]:
        for chain in range(nodes // length):
            before = f"Sensor{chain}"
            yield f"{{name: {before}, type: sensor, period_ms: {period_ms}}}"
            for place in range(1, length):
                name = f"Transform{chain}_{place}"
                yield f"{{name: {name}, type: transform, input: {before}, execution_time_ms: 0.001}}"
                before = name

    return "name: chains\nnodes:\n" + "".join(f"  - {line}\n" for line in lines())


def one_topic(readers: int, period_ms: float) -> str:
    """A sensor whose topic so many nodes read."""
    transforms = "".join(
        f"  - {{name: Reader{i}, type: transform, input: Sensor, execution_time_ms: 0.001}}\n"
        for i in range(readers)
    )
    return (
        f"name: one_topic\nnodes:\n  - {{name: Sensor, type: sensor, period_ms: {period_ms}}}\n{transforms}"
    )


def late_timer() -> str:
    """A timer that skips 99 of its 100 timestamps, and a reader."""
    return (
        "name: late_timer\nnodes:\n"
        "  - {name: Sensor, type: sensor, period_ms: 0.01, execution_time_ms: 0.9}\n"
        "  - {name: Reader, type: transform, input: Sensor, execution_time_ms: 0.1}\n"
    )


@dataclass(frozen=True)
class Case:
    """What is run live."""

    title: str
    graph: Callable[[], str]
    options: tuple[str, ...] = ()


CASES = {
    "nodes": Case("5000 nodes in one process", lambda: chains(5000, 5, 1000), ("--phases", "random")),
    "tasks": Case(
        "10,000 tasks in one process, intra-process",
        lambda: chains(10000, 5, 1000),
        ("--transport", "intra_process", "--phases", "random"),
    ),
    "processes": Case("100 processes", lambda: chains(200, 2, 100), ("--processes", "100")),
    "rate": Case("1000 publications a second on a topic, 5 readers", lambda: one_topic(5, 1)),
}


def output_of(*command: str) -> str:
    """What a command prints; one that fails ends this program."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(
            f"load.py: {' '.join(command)} ended with exit code {done.returncode}: {done.stderr.strip()}"
        )
    return done.stdout


def measured(case: Case, folder: Path) -> dict[str, Any]:
    """The figures of one case."""
    graph, run = folder / "graph.yaml", folder / "run"
    graph.write_text(case.graph(), encoding="utf-8")
    began = time.monotonic()
    output_of(
        *(HOTPATH, "run", "--graph", str(graph), "--executor", "rm-ro", "--duration", str(DURATION_S)),
        *("--warm-up", "0", *case.options, "--output", str(run)),
    )
    took = time.monotonic() - began
    print(output_of(HOTPATH, "check", str(run)), end="")
    facts = json.loads((run / "run.json").read_text(encoding="utf-8"))
    executor = json.loads((run / "summary.json").read_text(encoding="utf-8"))["executors"][0]
    return {
        "title": case.title,
        "tasks": len(facts["tasks"]),
        "around_s": round(took - DURATION_S, 1),
        "peak_memory_mib": round(executor["usage"]["peak_memory_kib"] / 1024),
        "jobs": executor["callbacks_executed"],
        "skipped": executor["skipped"],
        "overwritten": executor["overwritten"],
        "machine": {key: facts["machine"][key] for key in ("cpu_model", "kernel", "compiler")},
        "cpus": len(facts["cpus"]),
        "date": facts["date"][:10],
    }


def counted_in_virtual_time(folder: Path) -> dict[str, Any]:
    """How far numbers went in half a day."""
    graph, run = folder / "graph.yaml", folder / "run"
    graph.write_text(late_timer(), encoding="utf-8")
    output_of(
        *(
            HOTPATH,
            "simulate",
            "--graph",
            str(graph),
            "--executors",
            "default",
            "--no-trace",
            "--warm-up",
            "0",
        ),
        *("--duration", str(HALF_A_DAY_S), "--output", str(run)),
    )
    executor = json.loads((run / "summary.json").read_text(encoding="utf-8"))["executors"][0]
    if not executor["loss_equations"]["hold"]:
        sys.exit("load.py: the loss equations of half a day do not hold")
    return {
        "virtual_s": HALF_A_DAY_S,
        "timestamps": executor["after_warm_up"]["reached"],
        "jobs": executor["callbacks_executed"],
    }


def main() -> int:
    """The exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument(
        "--only", choices=[*CASES, NUMBERS], action="append", help="may be given several times"
    )
    parser.add_argument("--publish", action="store_true", help="write results/reliability/load.json")
    options = parser.parse_args()
    file = ROOT / "results/reliability/load.json"
    published = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    for name in options.only or [*CASES, NUMBERS]:
        with tempfile.TemporaryDirectory(prefix="hotpath_load_") as folder:
            if name == NUMBERS:
                published[name] = counted_in_virtual_time(Path(folder))
            else:
                published[name] = measured(CASES[name], Path(folder))
        print(json.dumps(published[name], indent=2))
        if options.publish:
            file.write_text(json.dumps(published, indent=2) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
