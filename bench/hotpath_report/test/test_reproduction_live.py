# SPDX-License-Identifier: Apache-2.0
"""Cells of a reproduction: results, disturbances, failures and order."""

import dataclasses
import json
import os
import subprocess
import tempfile
import unittest
from pathlib import Path
from typing import Any

from hotpath_report.paper import cells
from hotpath_report.paper import evidence as evidence_of
from hotpath_report.paper import noise
from hotpath_report.paper import runner as runner_of

HOTPATH = os.environ.get("HOTPATH", "hotpath")


class Live(unittest.TestCase):
    def folder(self) -> Any:
        return Path(self.enterContext(tempfile.TemporaryDirectory(prefix="hotpath_reproduction_")))

    def test_a_cell_stores_its_disturbances(self) -> None:
        output = self.folder()
        (output / "cells").mkdir()
        mode = cells.MODES["quick"]
        cell = next(c for c in cells.live_cells(mode) if c.study == "timers" and c.executors == ("rm-ro",))
        cell = dataclasses.replace(cell, duration_s=0.5)
        cpu = max(os.sched_getaffinity(0))
        runner = runner_of.Runner(HOTPATH, "a build", output, [cpu])
        runner.run_all([cell], 1)
        self.assertEqual(runner.failed, [])
        self.assertTrue(runner.complete(cell))
        facts = json.loads((output / "cells" / cell.name / "cell.json").read_text())
        measured = {"stolen_percent", "others_percent", "held_up_ms", "slow_percent", "marks"}
        self.assertEqual(set(facts["noise"]), measured)
        self.assertIsNone(facts["noise"]["slow_percent"], "jobs until an instant of the clock do not tell")
        self.assertEqual(facts["at_once"], 1)
        self.assertIn(str(cpu), facts["command"])
        self.assertFalse(runner_of.Runner(HOTPATH, "another build", output, [cpu]).complete(cell))
        found = evidence_of.collect(output, [cell])
        self.assertEqual(set(found.timers["source"]), {"live"})
        self.assertEqual(set(found.timers["repetition"]), {cell.repetition})
        self.assertGreater(len(found.responses), 0)

    def test_a_failed_cell_leaves_a_message_and_no_folder(self) -> None:
        output = self.folder()
        (output / "cells").mkdir()
        cell = cells.Cell("timers", "simulated", "broken", 1, ("default",), "nowhere", duration_s=1)
        runner = runner_of.Runner(HOTPATH, "a build", output, [0])
        runner.run_all([cell], 1)
        self.assertEqual([failed.name for failed, _ in runner.failed], ["simulated.timers.broken"])
        self.assertIn("nowhere", runner.failed[0][1])
        self.assertEqual([f for f in (output / "cells").iterdir() if not f.name.startswith(".")], [])

    def test_marks_follow_the_thresholds(self) -> None:
        def run(
            stolen_ms: float = 0.0, hiccup_ns: int = 0, disturbed: bool = False, **entry: Any
        ) -> dict[Any, Any]:
            return {
                "duration_s": 9,
                "warm_up_s": 1,
                "cpus": [1],
                "runs": [{"usage": {"stolen_ms": stolen_ms}, **entry}],
                "calibration": {"disturbed": disturbed},
                "machine": {
                    "noise": {"hiccups": [{"cpu": 0, "max_ns": 10**9}, {"cpu": 1, "max_ns": hiccup_ns}]}
                },
            }

        def summary(*periods: Any, observed: int = 1) -> dict[Any, Any]:
            slow_s = sum(p["until_s"] - p["from_s"] for p in periods)
            slow = [{"repetition": 0, "periods": list(periods), "slow_s": slow_s}] if periods else []
            return {"executors": [{"processor_speed": {"observed": observed, "slow": slow}}]}

        slow = {"cpu": 1, "from_s": 3.5, "until_s": 8, "factor": 1.28}
        quiet = noise.noise_of(run(), summary(), 0)
        self.assertEqual((quiet["marks"], quiet["slow_percent"]), ([], 0))
        self.assertIsNone(noise.noise_of(run(), summary(observed=0), 0)["slow_percent"])
        for noisy in (
            noise.noise_of(run(stolen_ms=51), summary(), 0),
            noise.noise_of(run(hiccup_ns=5_100_000), summary(), 0),
            noise.noise_of(run(disturbed=True), summary(), 0),
            noise.noise_of(run(), summary(slow), 0),
            noise.noise_of(run(), summary(), 5.1),
        ):
            self.assertEqual(len(noisy["marks"]), 1)
        self.assertEqual(noise.noise_of(run(), summary(slow), 0)["slow_percent"], 50)
        self.assertEqual(noise.noise_of(run(stolen_ms=51, replaced_by=1), summary(), 0)["marks"], [])

    def test_reads_stolen_time_of_runs(self) -> None:
        output = self.folder() / "run"
        command = [HOTPATH, "run", "--transport", "intra_process", "--duration", "0.1", "--warm-up", "0"]
        done = subprocess.run(
            [*command, "--output", output], env={**os.environ, "HOTPATH_FIGURES": "none"}, check=False
        )
        self.assertEqual(done.returncode, 0)
        run = json.loads((output / "run.json").read_text())
        run["runs"][0]["usage"]["stolen_ms"] = 60.0
        summary = json.loads((output / "summary.json").read_text())
        self.assertEqual(round(noise.noise_of(run, summary, 0)["stolen_percent"]), 60)

    def test_the_order_is_fixed_and_mixes_executors(self) -> None:
        mode = cells.MODES["standard"]
        order = [c.name for c in cells.live_order(cells.live_cells(mode), 1)]
        self.assertEqual(order, [c.name for c in cells.live_order(cells.live_cells(mode), 1)])
        self.assertNotEqual(order, [c.name for c in cells.live_order(cells.live_cells(mode), 2)])
        self.assertEqual(len(order), len(set(order)))
        rounds = [int(name.rsplit(".", 1)[1]) for name in order]
        self.assertEqual(rounds, sorted(rounds), "each executor runs once before any runs again")
