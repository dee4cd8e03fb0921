# SPDX-License-Identifier: Apache-2.0
"""`hotpath machine` and `hotpath bench` as a user starts them. Stand-ins that immediately write
figures replace the benchmark programs, since a test must not depend on measured values."""

import json
import os
import shutil
import unittest
from pathlib import Path
from typing import Any

import hotpath_command
import package
from hotpath_command import CommandTest

STAND_IN = """#!/bin/sh
for word in "$@"; do
  case "$word" in --benchmark_out=*) out="${{word#*=}}";; esac
done
{body}
"""
ROWS = """cat > "$out" <<END
{"context": {}, "benchmarks": [{"name": "push_pop/x/ready/10", "run_name": "push_pop/x/ready/10",
 "run_type": "iteration", "iterations": 5, "real_time": 12.5, "cpu_time": 12, "time_unit": "ns", "extra_ns": 3}]}
END"""


class BenchCommand(CommandTest):
    def setUp(self) -> None:
        super().setUp()
        # A copy of the command finds the programs next to it.
        self.programs = self.folder / "bin"
        self.programs.mkdir()
        real = hotpath_command.HOTPATH
        shutil.copy(shutil.which(real) or real, self.programs / "hotpath")
        self.addCleanup(setattr, hotpath_command, "HOTPATH", real)
        hotpath_command.HOTPATH = str(self.programs / "hotpath")

    def stand_in(self, name: str, body: str) -> None:
        path = self.programs / f"bench_{name}"
        path.write_text(STAND_IN.format(body=body))
        path.chmod(0o755)

    def bench_json(self, folder: str | Path) -> Any:
        return json.loads((self.folder / folder / "bench.json").read_text())

    def test_runs_each_repetition_in_a_process_of_its_own(self) -> None:
        self.stand_in("scheduler", ROWS)
        self.stand_in("executor", ROWS)
        words = "bench --only scheduler,executor --repetitions 3 --seed 2 --output out"
        self.assertIn("Results: out", self.accepted(*words.split()))
        content = self.bench_json("out")
        self.assertTrue(content["context"]["complete"])
        rows = [(row["name"], row["real_time"], row["extra_ns"]) for row in content["benchmarks"]]
        self.assertEqual(rows, [("push_pop/x/ready/10", 12.5, 3)] * 6)
        self.assertIn("hiccups", content["context"]["machine"]["noise"])
        raw = {f.name for f in (self.folder / "out" / "raw").iterdir() if f.suffix == ".json"}
        self.assertEqual(raw, {f"{p}-{r}.json" for p in ("scheduler", "executor") for r in range(3)})

    def test_quick_runs_once_and_tells_the_programs(self) -> None:
        self.stand_in("scheduler", 'echo "$@"\n' + ROWS)
        self.accepted("bench", "--quick", "--only", "scheduler", "--output", "out")
        self.assertIn("--quick", (self.folder / "out" / "raw" / "scheduler-0.txt").read_text())

    def test_says_what_to_install_when_the_programs_are_missing(self) -> None:
        says = ("bench_scheduler was not built", "install libbenchmark-dev")
        self.rejected("bench", says=says, out=None)

    def test_a_program_that_fails_is_reported_and_the_rest_is_kept(self) -> None:
        self.stand_in("scheduler", ROWS)
        self.stand_in("executor", "exit 3")
        words = "bench --only scheduler,executor --repetitions 1 --output out"
        err = self.rejected(*words.split(), says="the rest is in out", code=1, out=None)
        self.assertIn("bench_executor-0 failed", err)
        self.assertFalse(self.bench_json("out")["context"]["complete"])
        self.assertEqual(len(self.bench_json("out")["benchmarks"]), 1)

    def test_a_program_that_hangs_is_ended(self) -> None:
        self.stand_in("scheduler", "exec tail -f /dev/null")
        words = "bench --only scheduler --repetitions 1 --time-out 1 --output out"
        self.rejected(*words.split(), says="did not end in time", code=1, out=None)

    def test_refuses_to_mix_two_runs_and_unknown_programs(self) -> None:
        self.stand_in("scheduler", ROWS)
        (self.folder / "taken").mkdir()
        (self.folder / "taken" / "bench.json").write_text("{}")
        for words, says in (
            ("--only scheduler --output taken", "holds files already"),
            ("--only everything", "everything"),
        ):
            self.rejected("bench", *words.split(), says=says, out=None)

    def test_compare_results_rejects_a_folder_without_measurements(self) -> None:
        folder = self.folder / "old"
        folder.mkdir()
        for content, words in (
            ("{}", "not written by `hotpath bench`"),
            ('{"context": {"machine": {}}, "benchmarks": []}', "nothing to report"),
        ):
            (folder / "bench.json").write_text(content)
            err = self.rejected("diff", "old", "old", says=("old/bench.json: ", words), out=None)
            self.assertEqual(err.count("\n"), 1, err)

    def test_machine_prints_and_stores_the_noise_of_every_core(self) -> None:
        code, out, err = self.command("doctor", "--duration", 0.05, "--output", "machine.json")
        self.assertEqual(code, 0, err)
        stored = json.loads((self.folder / "machine.json").read_text())
        cores = [h["cpu"] for h in stored["noise"]["hiccups"]]
        self.assertEqual(cores, sorted(os.sched_getaffinity(0)))
        for word in "real-time throttling|timer slack|stolen time|turbo|boot parameters|p99.9".split("|"):
            self.assertIn(word, out)
        for line in err.splitlines():
            self.assertRegex(line, r"^note: .*\.$")


class Report(unittest.TestCase):
    """report.md, made from known figures."""

    MACHINE = {
        "cpu_model": "a processor", "processors": 2, "kernel": "6.1", "compiler": "g++ 12", "build_type": "Release",
        "noise": {"clock_cost_ns": 22, "hiccups": [{"cpu": 0, "p999_ns": 1500, "max_ns": 40000}]},
    }  # fmt: skip

    def report(self, figures: Any, **changes: Any) -> tuple[Any, str]:
        folder = self.enterContext(hotpath_command.tempfile.TemporaryDirectory())
        facts = {"complete": True, "date": "today", "repetitions": 3, "machine": self.MACHINE, **changes}
        fixed = {"real_time": 0, "cpu_time": 0, "time_unit": "ns"}
        rows = [
            {"name": name, **fixed} | {"real_time" if k == "time_ns" else k: v for k, v in values.items()}
            for name, repetitions in figures.items()
            for values in repetitions
        ]
        (Path(folder) / "bench.json").write_text(json.dumps({"context": facts, "benchmarks": rows}))
        result = package.call(Path(folder), dict(os.environ), "bench-report", folder)
        path = Path(folder) / "report.md"
        return result, path.read_text() if path.exists() else ""

    def test_every_kind_of_bar(self) -> None:
        result, text = self.report({
            "push_pop/std::priority_queue/ready/100": [{"time_ns": t} for t in (50, 40, 60)],
            "timer_cycle/rm-ro/ready:100/tasks/1000": [{"decide_ns": v} for v in (80, 90, 85)],
            "simulate_600s/timers_only_90/rm-ro": [{"time_ns": 12_500_000, "jobs_per_s": 4e6}],
            "simulate_600s/autoware/rm-ro": [{"time_ns": 310_000_000}],
            "simulate_600s/autoware/default": [{"time_ns": 10_000_000}],
            "release_pass/rm-ro/due:1/wake:0": [{"delta_p50_ns": 1000}],
            "wake_up/policy:other": [{"ratio_to_bare_sleep": 1.25}],
            "one_way/fastdds_in_process/kib:4/subscribers:1/hotpath": [{"latency_p50_ns": 12000}],
            "one_way/fastdds_in_process/kib:4/subscribers:1/raw_fastdds": [{"latency_p50_ns": 10000}],
            "callback/executor:rm-ro/transport:fastdds": [{"time_ns": 20_000}],
        })  # fmt: skip
        self.assertEqual(result.returncode, 0, result.stderr)
        for line in (
            "| one decision of rm-ro, 100 ready jobs, ns | 85.0 | 100 | met |",
            "| … to push and pop of std::priority_queue (rm-ro) | 1.70 | 1.5 | **not met** |",
            "| one simulated job of timers_only_90 with rm-ro, ns | 250 | 333 | met |",
            "| 600 s of Autoware simulated, slowest executor, ms | 310 | 300 | **not met** |",
            "| delta of rm-ro, without wake-up, median, µs | 1.00 | 2 | met |",
            "| wake-up of the timer thread to a bare sleep, medians, other | 1.25 | 1.1 | **not met** |",
            "| publish to callback to raw Fast DDS, 4 KiB, in process, medians | 1.20 | 1.3 | met |",
            "| CPU of a callback without work, rm-ro on Fast DDS, µs | 20.0 | 24.0 | met |",
        ):
            self.assertIn(line, text)

    def test_a_part_of_the_programs_gives_a_part_of_the_report(self) -> None:
        result, text = self.report({"wake_up/policy:other": [{"ratio_to_bare_sleep": 1}]}, complete=False)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("Partial", text)
        self.assertEqual(text.count("| met |"), 1)
