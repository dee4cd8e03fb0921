# SPDX-License-Identifier: Apache-2.0
"""Graph files, and simulations for the tests of `hotpath analyze`."""

from pathlib import Path
from typing import Any

from hotpath_command import CommandTest, csv_rows

SENSOR = "{{name: {0}, type: sensor, period_ms: {1}, execution_time_ms: {2}}}"
TRANSFORM = "{{name: {0}, type: transform, input: {1}, execution_time_ms: {2}}}"
COMMAND = "{{name: {0}, type: command, input: {1}, execution_time_ms: {2}}}"
RANGE = "{{name: {0}, type: callbacks, callbacks: " "[{{timer: t, period_ms: {1}, execution_time_ms: {2}}}]}}"
FUSION = "{{name: {0}, type: fusion, inputs: [{1}, {2}], execution_time_ms: {3}}}"


def graph_text(*nodes: str, more: str = "") -> str:
    """A graph file of these nodes. `more`: lines before them."""
    return "\n".join(["name: graph", more, "nodes:", *(f"  - {node}" for node in nodes)]) + "\n"


class AnalyzeCase(CommandTest):
    """Analyses of a graph and of its simulations."""

    def graph(self, *nodes: str, chain: str = "", more: str = "") -> Path:
        """Writes a graph file of these nodes. `chain`: its sources, then its sink."""
        names = ", ".join(node.split("name: ")[1].split(",")[0] for node in nodes)
        if chain:
            *sources, sink = chain.split()
            of = f"name: chain, nodes: [{names}], sources: [{', '.join(sources)}], sink: {sink}"
            more += f"\nchains: [{{{of}}}]"
        return self.written("graph.yaml", graph_text(*nodes, more=more))

    def simulated(
        self,
        graph: Any,
        executor: str,
        *options: object,
        seconds: int = 10,
        repetitions: int = 40,
        phases: str = "random",
    ) -> Path:
        output = self.folder / f"run{len(list(self.folder.iterdir()))}"
        self.accepted(
            *("simulate", "--graph", graph, "--executors", executor, "--phases", phases),
            *("--repetitions", repetitions, "--duration", seconds, "--output", output, *options),
        )
        return output

    def rows(self, graph: Any, executor: str, *options: object) -> dict:
        """The tightest bound and the observed value of each task and chain from `analyze`, in ms."""
        table = self.folder / "bounds.csv"
        self.accepted("analyze", graph, "--executors", executor, "--csv", table, *options)
        rows: dict = {}
        for row in csv_rows(table):
            if row["bound_ns"] and row["kind"] != "hot_path":
                bound = int(row["bound_ns"]) / 1e6
                observed = int(row["observed_ns"]) / 1e6 if row["observed_ns"] else 0.0
                known = rows.get(row["name"], (bound, observed))
                rows[row["name"]] = (min(bound, known[0]), observed)
        return rows

    def check(
        self, graph: Any, executor: str, name: str, at_least: float, *options: object, **more: Any
    ) -> None:
        """Checks that the observed value of `name` exceeds `at_least`, an earlier version's bound,
        but not today's."""
        rows = self.rows(graph, executor, "--trace", self.simulated(graph, executor, *options, **more))
        bound, observed = rows[name]
        self.assertGreater(observed, at_least)
        self.assertLessEqual(observed, bound)
