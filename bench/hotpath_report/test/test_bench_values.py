# SPDX-License-Identifier: Apache-2.0
"""Values from Google Benchmark's JSON and `hotpath run`."""

import json
import subprocess
import tempfile
import unittest
from pathlib import Path
from typing import Any
from unittest import mock

from hotpath_report.bench_suite import FILE, Bench, run_hot_path, run_program

COMPARE = Path("/usr/share/benchmark/compare.py")  # of libbenchmark-tools
OPTIONS = {"quick": True, "time_out_s": 1}


def row(name: str, time: Any, unit: str = "ns", **more: Any) -> dict[str, Any]:
    fixed = {"run_type": "iteration", "iterations": 1, "cpu_time": 1.0, "family_index": 0, "threads": 1}
    return {"name": name, "run_name": name, "real_time": time, "time_unit": unit, **fixed, **more}


class BenchTest(unittest.TestCase):
    def setUp(self) -> None:
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def stored(self, name: str, *rows: Any) -> str:
        (self.folder / name).mkdir()
        content = {"context": {"machine": {}}, "benchmarks": rows}
        (self.folder / name / FILE).write_text(json.dumps(content))
        return str(self.folder / name)


class Values(BenchTest):
    def test_times_become_nanoseconds_and_counters_metrics_named_by_benchmark(self) -> None:
        rows = [row("a/x:10/iterations:1/manual_time", time, "us", delta_p50_ns=12.5) for time in (3, 1, 2)]
        rows += row("b/min_time:0.010/real_time", 3), row("c", 1, "ms")
        found = {("a/x:10", "time_ns"): [3000, 1000, 2000], ("a/x:10", "delta_p50_ns"): [12.5, 12.5, 12.5]}
        found |= {("b", "time_ns"): [3], ("c", "time_ns"): [1e6]}
        _, measured = self.program(json.dumps({"benchmarks": rows}))
        self.assertEqual(Bench(self.stored("x", *measured)).values, found)

    def program(self, content: str) -> tuple[list[str], list[Any]]:
        output = self.folder / "a-0.json"
        rows: list[Any] = []
        output.write_text(content)
        with mock.patch("hotpath_report.bench_suite.execute", return_value=""):
            return run_program(Path("bench_a"), output, OPTIONS, rows), rows

    def test_a_failed_benchmark_is_an_error_without_a_value(self) -> None:
        failed = row("a", 0, error_occurred=True, error_message="no result")
        found = self.program(json.dumps({"benchmarks": [failed, row("b", 1)]}))
        self.assertEqual(found, (["a: no result"], [row("b", 1)]))

    def test_rejects_output_of_other_programs(self) -> None:
        for content in ("{}", "no JSON", '{"benchmarks": [{}]}', '{"benchmarks": [5]}'):
            failures, rows = self.program(content)
            self.assertIn("not written by Google Benchmark", failures[0])
            self.assertEqual(rows, [])


class HotPath(BenchTest):
    def compare(self, words: Any, _log: Any, _time_out_s: Any) -> str:
        """Stands in for `hotpath run`."""
        folder = Path(words[words.index("--output") + 1])
        folder.mkdir()
        executor = {"executor": "rm-ro", "cpu_per_callback_us": 47.5}
        (folder / "run.json").write_text(json.dumps({"executors": ["rm-ro"]}))
        (folder / "summary.json").write_text(json.dumps({"executors": [executor]}))
        return "" if self.succeeds else "failed"

    def measured(self, succeeds: bool) -> tuple[list[str], list[Any]]:
        self.succeeds = succeeds
        rows: list[Any] = []
        with mock.patch("hotpath_report.bench_suite.execute", self.compare):
            return run_hot_path(Path("hotpath"), self.folder / "hot_path-0.json", OPTIONS, rows), rows

    def test_takes_the_cpu_time_of_a_callback_of_compare(self) -> None:
        failures, rows = self.measured(True)
        self.assertEqual(failures, [])
        found = {("callback/executor:rm-ro/transport:fastdds", "time_ns"): [47500]}
        self.assertEqual(Bench(self.stored("x", *rows)).values, found)

    def test_reports_failures(self) -> None:
        self.assertEqual(self.measured(False)[0], ["hot_path-0 failed"])


class Compare(BenchTest):
    @unittest.skipUnless(COMPARE.exists(), "libbenchmark-tools is not installed")
    def test_google_benchmark_compares_the_times_of_two_results(self) -> None:
        files = [
            Path(self.stored(name, *(row("a", t + k, cpu_time=t + k) for k in range(9)))) / FILE
            for name, t in (("old", 100.0), ("new", 200.0))
        ]
        words = ["/usr/bin/python3", str(COMPARE), "--no-color", "benchmarks", *map(str, files)]
        done = subprocess.run(words, capture_output=True, text=True, check=True)
        self.assertRegex(done.stdout, r"a_pvalue +0\.000")
