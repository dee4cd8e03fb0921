#!/usr/bin/env -S PYTHONPATH=bench /usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Predicts, from the trace of a system under one executor, what traces under other executors recorded.

Phases differ between launches of a system; each prediction has those of the trace that it is compared
with. Outputs of the first second are left out: `PriorityExecutor` learns the graph there. Execution
times are replayed from another place in each draw. A second calculation also has the order in which the
executor of the predicted trace served nodes and callbacks, which may differ from that of their creation.
Since it comes from that trace, this is no blind prediction.
"""

import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from evidence import ROOT, hotpath, parser, publish
from hotpath_report.run import Run
from hotpath_report.statistics import Samples

RESULT = "import/across_executors.json"
TRACES = ROOT / "reference_system/ros2_reference/ctf"
CHAIN = "FrontLidarDriver,RearLidarDriver:ObjectCollisionEstimator"
WARM_UP_S = 1
PERIOD_S = 0.1  # of the LiDARs, and so of the outputs


@dataclass(frozen=True)
class Case:
    """A trace to predict."""

    trace: str
    executor: str
    source: str
    priorities: tuple[tuple[str, int], ...] = ()  # of timers, by node; given to the system as well


DRAWS = 10
QUIET, JAZZY, ROLLING = "upstream_jazzy_quiet_default", "jazzy_autoware_default", "autoware_default"
CASES = (
    Case("upstream_jazzy_quiet_rm-ro", "rm-ro", QUIET),
    Case(
        "upstream_jazzy_quiet_fp-given",
        "fp-ro",
        QUIET,
        (("FrontLidarDriver", 1), ("RearLidarDriver", 1), ("BehaviorPlanner", 2)),
    ),
    Case("jazzy_autoware_events", "events-ro", JAZZY),
    Case("jazzy_autoware_cbg1", "cbg:1", JAZZY),
    Case("autoware_events", "events-ro", ROLLING),
    Case("autoware_rm", "rm-ro:first:fifo", ROLLING),
    Case("autoware_static", "static", ROLLING),
)


def unpacked(folder: Path, name: str, into: Path) -> Path:
    """The folder of the only trace in NAME.tar.xz."""
    target = into / name
    target.mkdir()
    subprocess.run(["tar", "-xJf", folder / f"{name}.tar.xz", "-C", target], check=True)
    (trace,) = target.iterdir()
    return trace


def with_priorities(graph: Path, priorities: tuple[tuple[str, int], ...]) -> Path:
    """A copy of the imported graph in which the timers of these nodes have priorities."""
    text = graph.read_text(encoding="utf-8")
    for node, priority in priorities:
        head, name, rest = text.partition(f"- name: {node}\n")
        begin, timer, end = rest.partition("{timer: timer, ")
        if not name or not timer or "- name: " in begin:
            raise ValueError(f"{graph}: node {node} has no timer")
        text = f"{head}{name}{begin}{timer}priority: {priority}, {end}"
    copy = graph.with_name("graph_with_priorities.yaml")
    copy.write_text(text, encoding="utf-8")
    return copy


def parts(lines: list[str], start: str) -> tuple[list[str], dict[str, list[str]]]:
    """The lines before the first one that starts so, and from each such line on, by this line up to a comma."""
    head: list[str] = []
    found: dict[str, list[str]] = {}
    part = head
    for line in lines:
        if line.startswith(start):
            part = found.setdefault(line.split(",")[0].rstrip("}"), [])
        part.append(line)
    return head, found


def in_order_of(graph: Path, other: Path) -> Path | None:
    """A copy of an imported graph with nodes and callbacks in the order of another one of the same system;
    None if it is in this order."""

    def split(file: Path) -> tuple[str, str, str]:
        head, nodes, rest = file.read_text(encoding="utf-8").partition("\nnodes:\n")
        body, chains, tail = rest.partition("\nchains:\n")
        return head + nodes, body, chains + tail

    (head, body, tail), (_, model, _) = split(graph), split(other)
    own, wanted = (parts(text.split("\n"), "  - name: ")[1] for text in (body, model))
    if set(own) != set(wanted):
        raise ValueError(f"{graph} and {other} have different nodes")
    lines: list[str] = []
    same = list(own) == list(wanted)
    for name, node in wanted.items():
        before, callbacks = parts(own[name], "      - {")
        order = parts(node, "      - {")[1]
        if set(callbacks) != set(order):
            raise ValueError(f"{graph} and {other}: node {name} has different callbacks")
        same = same and list(callbacks) == list(order)
        lines += before + [line for callback in order for line in callbacks[callback]]
    if same:
        return None
    copy = graph.with_name("graph_in_order.yaml")
    copy.write_text(head + "\n".join(lines) + tail, encoding="utf-8")
    return copy


def latencies(run: Path, without: int) -> list[float]:
    """Hot-path latencies of a run without its first outputs."""
    return list(Run(run).latencies()["hot_path_ms"][without:])


def quantiles(values: list[float]) -> dict[str, float]:
    """The published quantiles in ms."""
    samples = Samples([values])
    return {"outputs": len(samples), "p50": samples.quantile(0.5), "p99": samples.quantile(0.99)}


def simulated(graph: Path, executor: str, recorded: Path) -> list[list[float]]:
    """Latencies by draw of the graph under the executor, with the phases and the duration of a recorded run."""
    duration = Run(recorded / "run").facts["duration_s"] - WARM_UP_S
    words = ["simulate", "--graph", graph, "--executors", executor, "--phases", recorded / "run"]
    words += ["--duration", f"{duration:.3f}", "--warm-up", WARM_UP_S]
    draws = []
    for seed in range(1, DRAWS + 1):
        run = recorded / f"{graph.stem}-{seed}"
        hotpath(*words, "--seed", seed, "--output", run)
        draws.append(latencies(run, 0))
    return draws


def predicted(case: Case, graph: Path, folder: Path, work: Path) -> dict[str, Any]:
    """Recorded and predicted latencies of one trace."""
    recorded = work / f"{case.trace}-imported"
    trace = unpacked(folder, case.trace, work)
    hotpath("import", "ctf", trace, "--executor", case.executor, "--chain", CHAIN, "--output", recorded)
    own = with_priorities(graph, case.priorities) if case.priorities else graph
    true = quantiles(latencies(recorded / "run", round(WARM_UP_S / PERIOD_S)))
    facts = {"from": case.source, "executor": case.executor, "recorded_ms": true}
    facts |= compared(simulated(own, case.executor, recorded), true)
    ordered = in_order_of(own, recorded / "graph.yaml")
    if ordered:
        facts["in_order"] = compared(simulated(ordered, case.executor, recorded), true)
    return facts


def compared(draws: list[list[float]], true: dict[str, float]) -> dict[str, Any]:
    """The outputs of all draws together, and how far they are off."""
    made = quantiles([latency for draw in draws for latency in draw])
    of_draws = [quantiles(draw) for draw in draws]
    return {
        "predicted_ms": made,
        "draws_ms": {q: [min(d[q] for d in of_draws), max(d[q] for d in of_draws)] for q in ("p50", "p99")},
        "error_percent": {q: 100 * (made[q] / true[q] - 1) for q in ("p50", "p99")},
    }


def main() -> None:
    """Prints and publishes the errors."""
    options = parser(__doc__, RESULT)
    options.add_argument("--traces", type=Path, default=TRACES, help="folder with the traces as *.tar.xz")
    chosen = options.parse_args()
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        for case in CASES:
            absent = [t for t in (case.source, case.trace) if not (chosen.traces / f"{t}.tar.xz").exists()]
            if absent:
                print(f"{case.trace}: {chosen.traces} lacks {' and '.join(absent)}")
                continue
            source = work / f"{case.source}-imported"
            if not source.exists():
                trace = unpacked(chosen.traces, case.source, work)
                hotpath("import", "ctf", trace, "--chain", CHAIN, "--output", source)
            facts = predicted(case, source / "graph.yaml", chosen.traces, work)
            print(case.trace, facts)
            if chosen.publish:
                publish(RESULT, facts, case.trace)


if __name__ == "__main__":
    main()
