#!/usr/bin/env -S PYTHONPATH=bench /usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Runs large graphs live, one after the other, and checks every schedule with `hotpath doctor`.

The graphs: 5000 nodes in one process, 10,000 tasks, 100 processes, 1000 publications a second on
one topic. A simulation of half a day takes sequence numbers, and instants in microseconds, beyond
32 bits. Exit code 1 if a run fails or its schedule is not legal.
"""

import json
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from evidence import hotpath, parser, publish
from hotpath_report.run import Run

RESULT = "reliability/load.json"
DURATION_S = 10
HALF_A_DAY_S = 43200
# The timer skips 99 of its 100 timestamps.
LATE_TIMER = """name: late_timer
nodes:
  - {name: Sensor, type: sensor, period_ms: 0.01, execution_time_ms: 0.9}
  - {name: Reader, type: transform, input: Sensor, execution_time_ms: 0.1}
"""
NUMBERS = "numbers"


def chains(nodes: int, length: int, period_ms: float) -> str:
    """A graph of chains: a sensor and `length` - 1 transforms, one after the other."""
    lines = []
    for chain in range(nodes // length):
        before = f"Sensor{chain}"
        lines.append(f"{{name: {before}, type: sensor, period_ms: {period_ms}}}")
        for place in range(1, length):
            name = f"Transform{chain}_{place}"
            lines.append(f"{{name: {name}, type: transform, input: {before}, execution_time_ms: 0.001}}")
            before = name
    return "name: chains\nnodes:\n" + "".join(f"  - {line}\n" for line in lines)


def one_topic(readers: int, period_ms: float) -> str:
    """A sensor whose topic `readers` nodes read."""
    sensor = f"  - {{name: Sensor, type: sensor, period_ms: {period_ms}}}\n"
    reader = "  - {{name: Reader{}, type: transform, input: Sensor, execution_time_ms: 0.001}}\n"
    return "name: one_topic\nnodes:\n" + sensor + "".join(map(reader.format, range(readers)))


@dataclass(frozen=True)
class Case:
    """A live run."""

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


def measured(case: Case, folder: Path) -> dict[str, Any]:
    """The figures of one case."""
    graph, run = folder / "graph.yaml", folder / "run"
    graph.write_text(case.graph(), encoding="utf-8")
    words = [
        "run",
        "--graph",
        graph,
        "--executors",
        "rm-ro",
        "--repetitions",
        1,
        "--duration",
        DURATION_S,
        "--warm-up",
        0,
    ]
    began = time.monotonic()
    hotpath(*words, *case.options, "--output", run)
    took = time.monotonic() - began
    print(hotpath("doctor", run), end="")
    facts, executor = Run(run).facts, Run(run).summary()[0]
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
    }


def counted_in_virtual_time(folder: Path) -> dict[str, Any]:
    """The counts of half a day."""
    graph, run = folder / "graph.yaml", folder / "run"
    graph.write_text(LATE_TIMER, encoding="utf-8")
    words = ["simulate", "--graph", graph, "--executors", "default", "--no-trace", "--warm-up", 0]
    hotpath(*words, "--duration", HALF_A_DAY_S, "--output", run)
    executor = Run(run).summary()[0]
    if not executor["loss_equations"]["hold"]:
        sys.exit("load.py: the loss equations of half a day do not hold")
    return {
        "virtual_s": HALF_A_DAY_S,
        "timestamps": executor["after_warm_up"]["reached"],
        "jobs": executor["callbacks_executed"],
    }


def main() -> int:
    """The exit code."""
    arguments = parser(__doc__, RESULT)
    names = [*CASES, NUMBERS]
    arguments.add_argument("--only", choices=names, action="append", help="may be given several times")
    options = arguments.parse_args()
    for name in options.only or names:
        with tempfile.TemporaryDirectory(prefix="hotpath_load_") as folder:
            case = CASES.get(name)
            facts = measured(case, Path(folder)) if case else counted_in_virtual_time(Path(folder))
        print(json.dumps(facts, indent=2))
        if options.publish:
            publish(RESULT, facts, name)
    return 0


if __name__ == "__main__":
    sys.exit(main())
