# SPDX-License-Identifier: Apache-2.0
"""Another program uses the CPU of a live run: the run reports it and repeats the disturbed
repetitions."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from hotpath_command import CommandTest

from hotpath_report.run import Run

SPIN = "import os\nos.sched_setaffinity(0, {%d})\nprint('spins', flush=True)\nwhile True: pass"


class SlowProcessor(CommandTest):
    def setUp(self) -> None:
        super().setUp()
        self.cpu = max(os.sched_getaffinity(0))

    def runs_in(self, output: Path) -> Any:
        """The entries of `runs` in run.json; None before the calibration has ended."""
        file = output / "run.json"
        return json.loads(file.read_text())["runs"] if file.exists() else None

    def measure_beside_a_sibling(self, *arguments: object) -> tuple[Any, Any]:
        """Measures a run while another thread keeps its CPU busy, from the calibration to the first
        repetition's end."""
        output = self.folder / "run"
        process = self.start(
            "run", "--executor", "rm-ro", "--transport", "intra_process", "--cpus", self.cpu, "--load", 80,
            "--warm-up", 0.5, "--output", output, *arguments,
        )  # fmt: skip
        self.wait_for(lambda: self.runs_in(output) is not None, "no calibration")
        sibling: Any = subprocess.Popen(
            [sys.executable, "-c", SPIN % self.cpu], stdout=subprocess.PIPE, text=True
        )
        self.addCleanup(sibling.stdout.close)
        self.addCleanup(sibling.wait)
        self.addCleanup(sibling.kill)
        self.assertEqual(sibling.stdout.readline(), "spins\n")
        self.wait_for(lambda: self.runs_in(output), "no repetition ends")
        sibling.kill()
        code, out, err = self.finish(process)
        self.assertEqual(code, 0, err)
        return self.checked(output), out

    def test_a_busy_sibling_is_marked_with_time_and_factor(self) -> None:
        run, table = self.measure_beside_a_sibling("--duration", 3)
        (executor,) = run.summary()["executors"]
        self.assertEqual(executor["processor_speed"]["observed"], 1)
        (slow,) = executor["processor_speed"]["slow"]
        self.assertEqual(slow["repetition"], 0)
        for period in slow["periods"]:
            self.assertEqual(period["cpu"], self.cpu)
            self.assertGreaterEqual(period["factor"], 1.1)
            self.assertLess(period["from_s"], period["until_s"])
        self.assertGreaterEqual(min(p["from_s"] for p in slow["periods"]), 0.5)
        self.assertRegex(table, r"Slow processor: rm-ro, repetition 0: from .* by a factor of \d")
        self.assertNotIn("replaced_by", run.run["runs"][0])

        reported = Run(run.path)
        self.assertEqual(reported.slow_repetitions(), [("rm-ro", 0, slow["periods"])])
        self.assertIn("1 of them on a slow processor", reported.what_ran())
        before = run.summary()
        (run.path / "summary.json").unlink()
        self.assertIn("Slow processor: rm-ro, repetition 0", self.accepted("summarize", run.path))
        self.assertEqual(run.summary(), before)

    def test_what_it_disturbed_is_measured_again_and_kept(self) -> None:
        run, _ = self.measure_beside_a_sibling("--duration", 2, "--repetitions", 2, "--repeat-slow", 1)
        entries = {r["repetition"]: r for r in run.run["runs"]}
        attempt = entries[0]["replaced_by"]
        self.assertGreaterEqual(attempt, 2)
        self.assertEqual(entries[attempt]["attempt_of"], 0)
        self.assertNotIn("replaced_by", entries[attempt])
        self.assertEqual(entries[attempt]["first_timestamps_ms"], entries[0]["first_timestamps_ms"])
        warnings = [w for w in run.run["warnings"] if w.startswith("rm-ro, repetition 0:")]
        self.assertRegex(
            warnings[0], rf"slow by a factor of \d.*; repetition {attempt} was measured instead and counts"
        )
        (executor,) = run.summary()["executors"]
        self.assertEqual(executor["repetitions"], 2)
        self.assertTrue(run.run["complete"])

        counted = {number for number, r in entries.items() if "replaced_by" not in r}
        self.assertEqual(len(counted), 2)
        self.assertEqual(
            {repetition for _, repetition in run.jobs()}, set(entries), "nothing measured is lost"
        )
        self.assertEqual({repetition for _, repetition in run.chains()}, set(entries))
        rows = self.accepted("summarize", run.path, "--responses", "-").splitlines()[1:]
        self.assertEqual({int(row.split(",")[1]) for row in rows}, counted)
        self.assertEqual(set(Run(run.path).latencies()["repetition"]), counted)
        before = run.summary()
        self.accepted("summarize", run.path)
        self.assertEqual(run.summary(), before)


class Refused(CommandTest):
    def test_repeat_slow_warns_without_known_work(self) -> None:
        run = self.measure(
            "run", "--transport", "intra_process", "--work", "wall", "--duration", 0.2, "--warm-up", 0,
            "--repeat-slow", 1,
        )  # fmt: skip
        self.assertIn("--repeat-slow has no effect", " ".join(run.run["warnings"]))
        self.assertEqual(run.summary()["executors"][0]["processor_speed"], {"observed": 0, "slow": []})

    def test_repeat_slow_excludes_live_alternate(self) -> None:
        code, _, err = self.command(
            "run", "--live-alternate", "--repetitions", 4, "--repeat-slow", 1, "--output", "never"
        )
        self.assertEqual(code, 2)
        self.assertIn("--repeat-slow: --live-alternate needs repetitions", err)
        self.assertFalse((self.folder / "never").exists())
