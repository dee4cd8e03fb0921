# SPDX-License-Identifier: Apache-2.0
"""Runs commands under memory limits. Each limit is well above the need, but below the need of
structures that grow with the length of the run or with the square of the graph. And the check for
files that a test leaves in /dev/shm."""

import json
import os
import unittest
from pathlib import Path

import shared_memory
from hotpath_command import HOTPATH, CommandTest
from simulate_test import TINY_CHAIN

SECONDS = 200  # 1000 jobs per second of each of three nodes
NAME = f"hotpath_shared_memory_test_{os.getpid()}"


def lines_of_five(nodes: int) -> str:
    """A graph of this many nodes, in lines of five that begin with a timer."""
    text = ["name: lines", "nodes:"]
    for n in range(nodes):
        what = f"transform, input: N{n - 1}" if n % 5 else f"sensor, period_ms: {100 * (1 + n % 7)}"
        text.append(f"- {{name: N{n}, type: {what}, execution_time_ms: 0.02}}")
    line = ", ".join(f"N{n}" for n in range(5))
    text.append(f"chains: [{{name: path, nodes: [{line}], sources: [N0], sink: N4}}]")
    return "\n".join(text) + "\n"


def limit(megabytes: int) -> str:
    """Shell code that gives each process of a command this limit of writable memory."""
    return f"ulimit -d {1024 * megabytes};"


class Memory(CommandTest):
    def setUp(self) -> None:
        if b"__asan_init" in Path(HOTPATH).read_bytes():
            self.skipTest("what a sanitizer reserves counts as memory")
        super().setUp()
        self.environment["OPENBLAS_NUM_THREADS"] = "1"
        self.graph = self.folder / "graph.yaml"

    def test_a_stored_run_is_read_row_by_row(self) -> None:
        self.graph.write_text(TINY_CHAIN % (1, 0))
        words = ("--executors", "rm-ro", "--duration", SECONDS, "--warm-up", 0)
        run = self.stored("simulate", self.graph, *words).path
        summary = (run / "summary.json").read_bytes()
        (run / "summary.json").unlink()
        self.accepted("report", "--summary", run, given=limit(60))
        self.assertEqual((run / "summary.json").read_bytes(), summary)
        perfetto = self.folder / "part.json"
        part = ("--from", 1000, "--to", 1100, "--output", perfetto)
        self.accepted("export", "perfetto", run, *part, given=limit(30))
        slices = [e for e in json.loads(perfetto.read_text())["traceEvents"] if e["ph"] == "X"]
        self.assertIn(len(slices), range(290, 320))
        for reads in (("diff", run, "--simulated"), ("export", "ctf", run)):
            says = "GB of memory, but 0.084 GB are available"
            self.rejected(*reads, "--output", "refused", says=says, given=limit(80))

    def test_advice_grows_with_nodes_and_not_with_their_square(self) -> None:
        self.graph.write_text(lines_of_five(1500))
        asked = ("advise", self.graph, "--cores", 4, "--repetitions", 1, "--warm-up", 0, "--threads", 1)
        self.accepted(*asked, "--duration", 1, "--output", "advice", given=limit(400))
        says = "--duration 1e+05: the traces would take about"
        self.rejected(*asked, "--duration", 100000, "--output", "long", says=says, given=limit(400))
        self.rejected("analyze", self.graph, says="out of memory", code=1, out=None, given=limit(20))


class SharedMemory(unittest.TestCase):
    def test_a_test_that_leaves_a_file_fails(self) -> None:
        def leave() -> None:
            shared_memory.expect_nothing_left_behind(case)
            (shared_memory.FOLDER / NAME).touch()

        self.addCleanup((shared_memory.FOLDER / NAME).unlink, missing_ok=True)
        case, result = unittest.FunctionTestCase(leave), unittest.TestResult()
        case.run(result)
        self.assertEqual(len(result.failures), 1)
        self.assertIn(NAME, result.failures[0][1])
