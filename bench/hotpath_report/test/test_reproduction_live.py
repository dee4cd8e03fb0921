# SPDX-License-Identifier: Apache-2.0
"""Cells of a reproduction, live ones above all: what they leave, what disturbed them, and in which order they run."""

import dataclasses
import json
import os
import tempfile
import unittest
from pathlib import Path

from hotpath_report.paper import cells
from hotpath_report.paper import evidence as evidence_of
from hotpath_report.paper import noise
from hotpath_report.paper import runner as runner_of

HOTPATH = os.environ.get("HOTPATH", "hotpath")


class Live(unittest.TestCase):
    def folder(self):
        return Path(self.enterContext(tempfile.TemporaryDirectory(prefix="hotpath_reproduction_")))

    def test_a_cell_says_what_disturbed_it(self):
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
        self.assertEqual(set(facts["noise"]), {"stolen_percent", "others_percent", "held_up_ms", "marks"})
        self.assertEqual(facts["at_once"], 1)
        self.assertIn(str(cpu), facts["command"])
        self.assertFalse(runner_of.Runner(HOTPATH, "another build", output, [cpu]).complete(cell))
        found = evidence_of.collect(output, [cell])
        self.assertEqual(set(found.timers["source"]), {"live"})
        self.assertEqual(set(found.timers["repetition"]), {cell.repetition})
        self.assertGreater(len(found.responses), 0)

    def test_a_cell_that_fails_leaves_its_sentence_and_no_folder(self):
        output = self.folder()
        (output / "cells").mkdir()
        cell = cells.Cell("timers", "simulated", "broken", 1, ("default",), "nowhere", duration_s=1)
        runner = runner_of.Runner(HOTPATH, "a build", output, [0])
        runner.run_all([cell], 1)
        self.assertEqual([failed.name for failed, _ in runner.failed], ["simulated.timers.broken"])
        self.assertIn("nowhere", runner.failed[0][1])
        self.assertEqual([f for f in (output / "cells").iterdir() if not f.name.startswith(".")], [])

    def test_marks_follow_the_thresholds(self):
        def run(stolen_ms=0.0, hiccup_ns=0, disturbed=False):
            return {
                "duration_s": 9,
                "warm_up_s": 1,
                "cpus": [1],
                "runs": [{"stolen_ms": stolen_ms}],
                "calibration": {"disturbed": disturbed},
                "machine": {
                    "noise": {"hiccups": [{"cpu": 0, "max_ns": 10**9}, {"cpu": 1, "max_ns": hiccup_ns}]}
                },
            }

        self.assertEqual(noise.noise_of(run(), 0)["marks"], [])
        for noisy in (
            noise.noise_of(run(stolen_ms=51), 0),
            noise.noise_of(run(hiccup_ns=5_100_000), 0),
            noise.noise_of(run(disturbed=True), 0),
            noise.noise_of(run(), 5.1),
        ):
            self.assertEqual(len(noisy["marks"]), 1)

    def test_the_order_is_drawn_once_and_mixes_executors(self):
        mode = cells.MODES["standard"]
        order = [c.name for c in cells.live_order(cells.live_cells(mode), 1)]
        self.assertEqual(order, [c.name for c in cells.live_order(cells.live_cells(mode), 1)])
        self.assertNotEqual(order, [c.name for c in cells.live_order(cells.live_cells(mode), 2)])
        self.assertEqual(len(order), len(set(order)))
        rounds = [int(name.rsplit(".", 1)[1]) for name in order]
        self.assertEqual(rounds, sorted(rounds), "each executor runs once before any runs again")


if __name__ == "__main__":
    unittest.main()
