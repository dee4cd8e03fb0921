# SPDX-License-Identifier: Apache-2.0
"""Cells of a reproduction: results, disturbances, failures and order."""

import json
import os
import tempfile
import unittest
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from hotpath_report.paper import cells, reproduce
from hotpath_report.paper import evidence as evidence_of

HOTPATH = os.environ.get("HOTPATH", "hotpath")


class Live(unittest.TestCase):
    def folder(self) -> Any:
        output = Path(self.enterContext(tempfile.TemporaryDirectory(prefix="hotpath_reproduction_")))
        (output / "cells").mkdir()
        return output

    def test_a_cell_stores_its_disturbances(self) -> None:
        output, cpu = self.folder(), max(os.sched_getaffinity(0))
        brief = SimpleNamespace(**{**vars(cells.MODES["quick"]), "live_timers": [1, 0.5]})
        every = cells.cells_of("live", brief, [cpu], "a build")
        cell = next(c for c in every if c["study"] == "timers" and c["executors"] == ["rm-ro"])
        self.assertEqual(reproduce.run(Path(HOTPATH), output, cell), "")
        self.assertTrue(reproduce.complete(output, cell))
        facts = json.loads((output / "cells" / cell["name"] / "cell.json").read_text())
        measured = {"stolen_percent", "throttled_percent", "others_percent", "marks"}
        self.assertEqual(set(facts["noise"]), measured)
        self.assertIn(str(cpu), facts["command"])
        self.assertFalse(reproduce.complete(output, cell | {"build": "another build"}))
        found = evidence_of.collect(output, [cell])
        self.assertEqual({row["source"] for row in found.timers}, {"live"})
        self.assertEqual({row["repetition"] for row in found.timers}, {cell["repetition"]})
        self.assertGreater(len(found.responses), 0)

    def test_a_failed_cell_leaves_a_message_and_no_folder(self) -> None:
        output = self.folder()
        cell = next(cells.cells_of("simulated", cells.MODES["quick"]))
        cell |= {"name": "broken", "command": ["hotpath", "simulate", "--graph", "nowhere", "--output", ""]}
        self.assertIn("nowhere", reproduce.run(Path(HOTPATH), output, cell))
        self.assertEqual([f for f in (output / "cells").iterdir() if not f.name.startswith(".")], [])

    def test_noise_is_what_the_kernel_counted(self) -> None:
        usage = {"wall_ms": 10_000, "stolen_ms": 60, "throttled_ms": 0, "others_ms": 250}
        marks = ["0.6 % of the time stolen by the hypervisor"]
        summary = {"executors": [{"disturbed": [{"repetition": 0, "marks": marks}]}]}
        self.assertEqual(
            reproduce.noise_of({"runs": [{"usage": usage}]}, summary),
            {"stolen_percent": 0.6, "throttled_percent": 0, "others_percent": 2.5, "marks": marks},
        )

    def test_the_order_is_fixed_and_mixes_executors(self) -> None:
        plans = (cells.all_cells(cells.MODES["standard"], seed) for seed in (1, 1, 2))
        order, again, other = ([c["name"] for c in plan if c["source"] == "live"] for plan in plans)
        self.assertEqual(order, again)
        self.assertNotEqual(order, other)
        self.assertEqual(len(order), len(set(order)))
        rounds = [int(name.rsplit(".", 1)[1]) for name in order]
        self.assertEqual(rounds, sorted(rounds), "each executor runs once before any runs again")
