# SPDX-License-Identifier: Apache-2.0
"""Points in figures of sweeps and capacities, from made-up tables."""

import json
import tempfile
import unittest
from collections.abc import Iterable
from pathlib import Path
from typing import Any
from unittest.mock import patch

from hotpath_report import style
from hotpath_report.errors import InputError
from hotpath_report.pages import capacity_page, sweep_page
from hotpath_report.pages.sweep_page import Table

COLUMNS = "cell,load,phases,repetition,seed,failure,executor,chain,"
COLUMNS += "hot_path_p50_ms,hot_path_max_ms,lost,response_share_max,deadline_overruns"


class SweepFigures(unittest.TestCase):
    def setUp(self) -> None:
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def write(self, chain: str = "path", axes: Iterable[Any] = ("load", "phases")) -> None:
        rows, cell = [COLUMNS], 0
        for load in (20, 40, 60):
            for executor in ("default", "rm-ro"):
                for repetition in range(3):
                    failed = load == 60 and executor == "default"
                    value = load / 2 + repetition
                    measures = [value, 2 * value, load - 20, 0.5, 0]
                    row = [cell, load, "random", repetition, 1, "overloaded" if failed else "", executor]
                    row += [""] * 6 if failed else [chain, *measures]
                    rows.append(",".join(map(str, row)))
                    cell += 1
        rows = [r[:-1] if r.endswith(",,,,,") else r for r in rows]
        (self.folder / "table.csv").write_text("\n".join(rows) + "\n")
        (self.folder / "sweep.json").write_text(json.dumps({"axes": axes, "repetitions": 3}))

    def test_points_are_medians_and_worst_cases_maxima(self) -> None:
        self.write()
        table = Table(self.folder)
        rows = table.rows[table.rows["executor"] == "rm-ro"]
        median, worst = (table.points(rows, column) for column in list(table.measures)[:2])
        self.assertEqual({x: e.value for x, e in median.items()}, {20: 11, 40: 21, 60: 31})
        self.assertEqual(worst[60].value, 64)
        self.assertTrue(median[20].has_interval)

    def test_overloaded_cells_are_counted_and_have_no_point(self) -> None:
        self.write()
        table = Table(self.folder)
        self.assertEqual(table.failed, 3)
        points = table.points(table.rows[table.rows["executor"] == "default"], "hot_path_p50_ms")
        self.assertEqual(list(points), [20, 40])

    def test_all_figures_are_drawn(self) -> None:
        self.write()
        sweep_page.write(str(self.folder))
        self.write(chain="", axes=("load",))
        sweep_page.write(str(self.folder))
        names = {p.name for p in self.folder.glob("*.svg")}
        self.assertEqual(names, {"sweep_lines.svg"})

    def test_rejects_a_sweep_without_a_numeric_axis(self) -> None:
        self.write(axes=("phases",))
        with self.assertRaisesRegex(InputError, "no numeric axis"):
            sweep_page.write(str(self.folder))

    def test_capacity_is_drawn_as_a_bar(self) -> None:
        lines = ["executor,source,load,holds,capacity,why"]
        lines += [f"rm-ro,simulated,{load},{int(load != 30)},{int(load == 20)}," for load in (10, 20, 30, 40)]
        lines += ["rm-ro,analysis,10,1,1,"]
        (self.folder / "levels.csv").write_text("\n".join(lines) + "\n")
        with patch.object(style, "save") as save:
            capacity_page.write(str(self.folder))
        (axes,) = save.call_args[0][0].axes
        self.assertEqual([bar.get_width() for bar in axes.patches], [20])
        self.assertEqual([text.get_text() for text in axes.texts], ["20"])
