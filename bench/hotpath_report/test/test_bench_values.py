# SPDX-License-Identifier: Apache-2.0
"""Values from Google Benchmark's JSON and `hotpath compare`, and their differences."""

import contextlib
import io
import json
import tempfile
import unittest
from pathlib import Path
from typing import Any
from unittest import mock

from hotpath_report.bench_suite import run_hot_path
from hotpath_report.bench_values import NOT_COMPARABLE, BenchValues, change, compare
from hotpath_report.errors import InputError


def row(name: str, time: Any, unit: str, **more: Any) -> dict[Any, Any]:
    fixed = {"run_type": "iteration", "iterations": 1, "cpu_time": 1.0, "family_index": 0, "threads": 1}
    return {"name": name, "run_name": name, "real_time": time, "time_unit": unit, **fixed, **more}


class BenchTest(unittest.TestCase):
    def setUp(self) -> None:
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def add(self, values: Any, *rows: Any) -> Any:
        path = self.folder / "output.json"
        path.write_text(json.dumps({"context": {}, "benchmarks": rows}))
        return values.add(path)

    def parsed(self, *rows: Any) -> Any:
        values = BenchValues()
        self.assertEqual(self.add(values, *rows), [])
        return values

    def stored(self, name: str, figures: Any) -> str:
        (self.folder / name).mkdir()
        rows = [{"benchmark": b, "metric": "time_ns", "values": v} for b, v in figures.items()]
        facts = {"figures": rows, "complexities": [], "machine": {}}
        (self.folder / name / "bench.json").write_text(json.dumps(facts))
        return str(self.folder / name)


class Values(BenchTest):
    def test_times_become_nanoseconds_named_by_benchmark(self) -> None:
        rows = (
            row("a/tasks:10/iterations:1/manual_time", 2, "us"),
            row("b/min_time:0.010", 3, "ns"),
            row("c", 1, "ms"),
        )
        figures = {("a/tasks:10", "time_ns"): [2000], ("b", "time_ns"): [3], ("c", "time_ns"): [1e6]}
        self.assertEqual(self.parsed(*rows).figures, figures)

    def test_counters_are_metrics_without_bookkeeping(self) -> None:
        figures = self.parsed(row("a", 2, "ns", delta_p50_ns=12.5)).figures
        self.assertEqual(figures, {("a", "time_ns"): [2], ("a", "delta_p50_ns"): [12.5]})

    def test_repetitions_are_grouped(self) -> None:
        values = BenchValues()
        for time in (3, 1, 2):
            self.add(values, row("a", time, "ns"))
        self.assertEqual(values.figures["a", "time_ns"], [3, 1, 2])

    def test_a_failed_benchmark_is_an_error_without_a_value(self) -> None:
        values = BenchValues()
        failed = row("a", 0, "ns", error_occurred=True, error_message="no result")
        self.assertEqual(self.add(values, failed), ["a: no result"])
        self.assertEqual((values.figures, values.errors), ({}, ["a: no result"]))

    def test_keeps_the_complexity_fit(self) -> None:
        name = {"run_name": "drain/manual_time", "run_type": "aggregate"}
        fit = {**name, "aggregate_name": "BigO", "real_coefficient": 0.5, "big_o": "NlgN", "time_unit": "us"}
        found = self.parsed(fit, {**name, "aggregate_name": "RMS", "rms": 0.07}).as_json()["complexities"]
        self.assertAlmostEqual(found[0].pop("rms_percent"), 7)
        self.assertEqual(found, [{"benchmark": "drain", "order": "NlgN", "coefficient_ns": 500}])

    def test_rejects_output_of_other_programs(self) -> None:
        path = self.folder / "output.json"
        for content in ("{}", "no JSON", '{"benchmarks": [{}]}'):
            path.write_text(content)
            self.assertIn("not written by Google Benchmark", BenchValues().add(path)[0])


class HotPath(BenchTest):
    def compare(self, words: Any, _log: Any, _time_out_s: Any) -> str:
        """Stands in for `hotpath compare`."""
        folder = Path(words[words.index("--output") + 1])
        folder.mkdir()
        latency = {"p50": 20, "p99": 21, "p999": 22, "max": 23}
        executor = {"executor": "rm-ro", "cpu_per_callback_us": 47.5, "callbacks_executed": 995}
        executor["chains"] = [{"hot_path_latency_ms": latency}]
        (folder / "run.json").write_text(json.dumps({"executors": ["rm-ro"]}))
        (folder / "summary.json").write_text(json.dumps({"executors": [executor]}))
        return "" if "--load" not in words or self.succeeds else "failed"

    def measured(self, succeeds: Any) -> tuple[Any, Any]:
        self.succeeds, values = succeeds, BenchValues()
        with mock.patch("hotpath_report.bench_suite.execute", self.compare):
            options = {"quick": True, "time_out_s": 1}
            failures = run_hot_path(Path("hotpath"), self.folder / "hot_path-0.json", options, values)
        return failures, values.figures

    def test_takes_the_values_of_compare_with_and_without_work(self) -> None:
        failures, figures = self.measured(True)
        self.assertEqual(failures, [])
        for transport in ("intra_process", "fastdds"):
            variant = f"executor:rm-ro/transport:{transport}"
            self.assertEqual(figures[f"hot_path/{variant}", "time_ns"], [20e6])
            self.assertEqual(figures[f"hot_path/{variant}", "hot_path_max_ns"], [23e6])
            self.assertEqual(figures[f"callback/{variant}", "time_ns"], [47500])
            self.assertEqual(figures[f"callback/{variant}", "callbacks"], [995])

    def test_reports_failures(self) -> None:
        self.assertEqual(self.measured(False)[0], ["hot_path-0-intra_process-idle failed"])


class Compare(BenchTest):
    def test_a_large_shift_is_beyond_noise_in_its_direction(self) -> None:
        slow, fast = [100.0, 101, 99, 100, 102], [50.0, 51, 49, 50, 52]
        ratio: Any
        ratio, verdict = change(slow, fast)
        self.assertEqual((round(ratio.value, 3), verdict), (0.502, "smaller"))
        self.assertTrue(ratio.low < ratio.value < ratio.high < 1)
        self.assertEqual(change(fast, slow)[1], "larger")

    def test_a_shift_smaller_than_the_spread_is_noise(self) -> None:
        ratio: Any
        ratio, verdict = change([100, 80, 120, 95, 105], [103, 84, 118, 99, 101])
        self.assertEqual(verdict, "within noise")
        self.assertTrue(ratio.low < 1 < ratio.high)

    def test_equal_values_do_not_differ(self) -> None:
        for values in ([100.0, 80, 120], [7.0, 7, 7]):
            self.assertEqual(change(values, values)[1], "within noise")

    def test_too_few_repetitions_and_values_without_a_ratio_are_not_comparable(self) -> None:
        for values in ([1.0, 1], [0.0, 0, 0]):
            self.assertEqual(change(values, [9, 9, 9]), (None, NOT_COMPARABLE))

    def test_lists_changes_first_and_skips_values_of_one_side(self) -> None:
        before = self.stored("before", {"a": [100, 101, 102], "b": [100, 101, 102]})
        after = self.stored("after", {"a": [100, 101, 102], "b": [200, 201, 202], "new": [1, 2, 3]})
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            self.assertEqual(compare(before, after), 0)
        text = printed.getvalue()
        self.assertLess(text.index("b time_ns"), text.index("a time_ns"))
        self.assertIn("1 of 2 values differ beyond noise.", text)
        self.assertIn("larger", text)

    def test_rejects_folders_without_common_values(self) -> None:
        with self.assertRaisesRegex(InputError, "no value in common"):
            compare(self.stored("before", {"a": [1]}), self.stored("after", {"b": [1]}))
