# SPDX-License-Identifier: Apache-2.0
"""Runs commands under memory limits. Each limit is well above the need, but below the need of
structures that grow with the length of the run or with the square of the graph."""

import json
from pathlib import Path
from typing import Any

from hotpath_command import HOTPATH, CommandTest

# A chain of three nodes with 1000 jobs per second each, and rows as short as possible.
CHAIN = """name: chain
nodes:
  - {name: S, type: sensor, period_ms: 1}
  - {name: T, type: transform, input: S}
  - {name: C, type: command, input: T}
chains:
  - {name: path, nodes: [S, T, C], sources: [S], sink: C}
"""
SECONDS = 200  # 600,000 jobs


def lines_of_five(nodes: int) -> str:
    """A graph of this many nodes, in lines of five that begin with a timer."""
    text = ["name: lines", "nodes:"]
    for n in range(nodes):
        what = f"transform, input: N{n - 1}" if n % 5 else f"sensor, period_ms: {100 * (1 + n % 7)}"
        text.append(f"- {{name: N{n}, type: {what}, execution_time_ms: 0.02}}")
    line = ", ".join(f"N{n}" for n in range(5))
    text.append(f"chains: [{{name: path, nodes: [{line}], sources: [N0], sink: N4}}]")
    return "\n".join(text) + "\n"


class Memory(CommandTest):
    def setUp(self) -> None:
        if b"__asan_init" in Path(HOTPATH).read_bytes():
            self.skipTest("what a sanitizer reserves counts as memory")
        super().setUp()
        self.environment |= {"OPENBLAS_NUM_THREADS": "1", "HOTPATH_FIGURES": "none"}

    def limited(self, megabytes: int, *arguments: object) -> tuple[Any, Any]:
        """(exit code, standard error) of a command; each of its processes has this limit of
        writable memory."""
        code, _, err = self.command(*arguments, given=f"ulimit -d {1024 * megabytes};")
        return code, err

    def assert_enough(self, megabytes: int, *arguments: object) -> None:
        self.assertEqual(self.limited(megabytes, *arguments)[0], 0, f"{megabytes} MB for {arguments[0]}")

    def graph(self, text: str) -> Any:
        path = self.folder / "graph.yaml"
        path.write_text(text)
        return path

    def long_run(self) -> Any:
        path = self.folder / "run"
        self.accepted(
            *("simulate", "--graph", self.graph(CHAIN), "--executors", "rm-ro", "--duration", SECONDS),
            *("--warm-up", 0, "--output", path),
        )
        return path

    def test_a_stored_run_is_read_row_by_row(self) -> None:
        run = self.long_run()
        summary = (run / "summary.json").read_bytes()
        (run / "summary.json").unlink()
        self.assert_enough(60, "report", "--summary", run)
        self.assertEqual((run / "summary.json").read_bytes(), summary)
        perfetto = self.folder / "part.json"
        part = ("--from", 1000, "--to", 1100)
        self.assert_enough(30, "export", "perfetto", run, *part, "--output", perfetto)
        slices = [e for e in json.loads(perfetto.read_text())["traceEvents"] if e["ph"] == "X"]
        self.assertIn(len(slices), range(290, 320))
        self.refuses_what_would_not_fit(run)

    def refuses_what_would_not_fit(self, run: Any) -> None:
        for arguments in (
            ("diff", run, "--simulated", "--output", self.folder / "validation"),
            ("export", "ctf", run, "--output", self.folder / "trace"),
        ):
            code, err = self.limited(80, *arguments)
            self.assertEqual(code, 2, err)
            self.assertIn("GB of memory, but 0.084 GB are available", err)
            self.assertEqual(err.count("\n"), 1, err)

    def test_advice_grows_with_nodes_and_not_with_their_square(self) -> None:
        graph = self.graph(lines_of_five(1500))
        asked = ("advise", graph, "--cores", 4, "--repetitions", 1, "--warm-up", 0, "--threads", 1)
        output = ("--output", self.folder / "advice")
        self.assert_enough(400, *asked, "--duration", 1, *output)
        code, err = self.limited(400, *asked, "--duration", 100000, "--output", self.folder / "long")
        self.assertEqual(code, 2, err)
        self.assertIn("--duration 1e+05: the traces would take about", err)
        code, err = self.limited(20, "analyze", graph)
        self.assertEqual(code, 1, err)
        self.assertIn("out of memory", err)
