#!/usr/bin/env -S PYTHONPATH=bench /usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Predicts, from the trace of a system under one executor, what traces under other executors recorded.

Phases differ between launches of a system; each prediction has those of the trace that it is compared
with. Outputs of the first second are left out: `PriorityExecutor` learns the graph there. Execution
times are replayed from another place in each draw.
"""

import functools
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from evidence import ROOT, hotpath, parser, publish
from hotpath_report.run import Run
from hotpath_report.statistics import Samples

RESULT = "import/across_executors.json"
TRACES = ROOT / "reference_system/ros2_reference/ctf"
CHAIN = "FrontLidarDriver,RearLidarDriver:ObjectCollisionEstimator"
WARM_UP_S, PERIOD_S = 1, 0.1  # the period of the LiDARs, and so of the outputs
DRAWS = 10
QUIET, JAZZY, ROLLING = "upstream_jazzy_quiet_default", "jazzy_autoware_default", "autoware_default"
GIVEN = "upstream_jazzy_quiet_fp-given"
PRIORITIES = {"FrontLidarDriver": 1, "RearLidarDriver": 1, "BehaviorPlanner": 2}  # of timers in GIVEN
# By trace: its executor, and the trace that predicts it.
CASES = {
    "upstream_jazzy_quiet_rm-ro": ("rm-ro", QUIET),
    GIVEN: ("fp-ro", QUIET),
    "jazzy_autoware_events": ("events-ro", JAZZY),
    "jazzy_autoware_cbg1": ("cbg:1", JAZZY),
    "autoware_events": ("events-ro", ROLLING),
    "autoware_rm": ("rm-ro:first:fifo", ROLLING),
    "autoware_static": ("static", ROLLING),
}


@functools.cache
def imported(archive: Path, work: Path, *options: str) -> Path:
    """The folder into which the only trace of an archive was imported."""
    trace, output = work / archive.name, work / f"{archive.name}-imported"
    trace.mkdir()
    subprocess.run(["tar", "-xJf", archive, "-C", trace, "--strip-components=1"], check=True)
    hotpath("import", "ctf", trace, *options, "--chain", CHAIN, "--output", output)
    return output


def with_priorities(graph: Path) -> Path:
    """A copy of the imported graph in which timers have PRIORITIES."""
    text = graph.read_text(encoding="utf-8")
    for node, priority in PRIORITIES.items():
        head, name, rest = text.partition(f"- name: {node}\n")
        begin, timer, end = rest.partition("{timer: timer, ")
        if not name or not timer or "- name: " in begin:
            raise ValueError(f"{graph}: node {node} has no timer")
        text = f"{head}{name}{begin}{timer}priority: {priority}, {end}"
    copy = graph.with_name("graph_with_priorities.yaml")
    copy.write_text(text, encoding="utf-8")
    return copy


def quantiles(values: list[float]) -> dict[str, float]:
    """The published quantiles in ms."""
    samples = Samples([values])
    return {"outputs": len(samples), "p50": samples.quantile(0.5), "p99": samples.quantile(0.99)}


def predicted(graph: Path, executor: str, recorded: Path) -> dict[str, Any]:
    """Recorded latencies, and those of the graph under the executor of the recorded run, with its phases."""
    words = ["simulate", "--graph", graph, "--executors", executor, "--phases", recorded / "run"]
    words += ["--duration", f"{Run(recorded / 'run').facts['duration_s'] - WARM_UP_S:.3f}"]
    runs = [recorded / "run", *(recorded / f"draw-{seed}" for seed in range(1, DRAWS + 1))]
    for seed, run in enumerate(runs[1:], 1):
        hotpath(*words, "--warm-up", WARM_UP_S, "--seed", seed, "--output", run)
    of_recorded, *draws = (
        [ms for row in Run(run).samples("chains") for ms in row["hot_path_ms"]] for run in runs
    )
    true = quantiles(of_recorded[round(WARM_UP_S / PERIOD_S) :])
    made, each = quantiles(sum(draws, [])), [quantiles(draw) for draw in draws]
    return {
        "recorded_ms": true,
        "predicted_ms": made,
        "draws_ms": {q: [min(d[q] for d in each), max(d[q] for d in each)] for q in ("p50", "p99")},
        "error_percent": {q: 100 * (made[q] / true[q] - 1) for q in ("p50", "p99")},
    }


def main() -> None:
    """Prints and publishes the errors."""
    arguments = parser(__doc__, RESULT)
    arguments.add_argument("--traces", type=Path, default=TRACES, help="folder with the traces as *.tar.xz")
    options = arguments.parse_args()
    with tempfile.TemporaryDirectory() as name:
        for trace, (executor, source) in CASES.items():
            archives = [options.traces / f"{t}.tar.xz" for t in (source, trace)]
            if not all(archive.exists() for archive in archives):
                print(f"{trace}: {options.traces} lacks it or {source}")
                continue
            graph = imported(archives[0], Path(name)) / "graph.yaml"
            recorded = imported(archives[1], Path(name), "--executors", executor)
            graph = with_priorities(graph) if trace == GIVEN else graph
            facts = {"from": source, "executor": executor, **predicted(graph, executor, recorded)}
            print(trace, facts)
            if options.publish:
                publish(RESULT, facts, trace)


if __name__ == "__main__":
    main()
