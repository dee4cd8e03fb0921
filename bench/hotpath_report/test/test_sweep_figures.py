# SPDX-License-Identifier: Apache-2.0
"""Points in figures of sweeps and capacities, from made-up tables."""

import json
import tempfile
import unittest
from collections.abc import Iterable
from itertools import product
from pathlib import Path
from typing import Any
from unittest.mock import patch

from hotpath_report import style
from hotpath_report.errors import InputError
from hotpath_report.hotpath_command import VERSION
from hotpath_report.pages import sweep_page

COLUMNS = "cell,load,phases,repetition,seed,failure,executor,chain,"
COLUMNS += "hot_path_p50_ms,hot_path_max_ms,lost,response_share_max,deadline_overruns"


class SweepFigures(unittest.TestCase):
    def setUp(self) -> None:
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def write(self, chain: str = "path", axes: Iterable[Any] = ("load", "executors", "phases")) -> None:
        rows: list[list[Any]] = []
        for load, executor, repetition in product((20, 40, 60), ("default", "rm-ro"), range(3)):
            failed = load == 60 and executor == "default"
            value = load / 2 + repetition
            measures: list[Any] = (
                [None] * 6 if failed else [chain or None, value, 2 * value, load - 20, 0.5, 0]
            )
            cell = [len(rows), load, "random", repetition, 1, "overloaded" if failed else None, executor]
            rows.append([*cell, *measures])
        facts = {"version": VERSION, "axes": axes, "repetitions": 3, "cells": len(rows)}
        facts |= {"columns": COLUMNS.split(","), "rows": rows}
        (self.folder / "sweep.json").write_text(json.dumps(facts))

    def test_overloaded_cells_are_counted_and_have_no_point(self) -> None:
        self.write()
        with patch.object(sweep_page, "write_with_figure") as write:
            sweep_page.write(str(self.folder))
        *_, subtitle, data = write.call_args[0]
        self.assertIn("3 cells not finished", subtitle)
        self.assertEqual([line["x"] for line in data["plots"][0]["lines"]], [[20, 40], [20, 40, 60]])

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
        of_latencies = [f"{of}_{part}ms" for of in sweep_page.LATENCIES for part in ("", "low_", "high_")]
        measures = ["lost", "deadline_overruns", "response_share_max", *of_latencies]
        columns = ["executor", "source", "load", "holds", "capacity", "why", *measures]
        rows = [["rm-ro", "simulated", load, int(load != 30), int(load == 20)] for load in (10, 20, 30, 40)]
        rows = [row + [None] * (len(measures) + 1) for row in [*rows, ["rm-ro", "analysis", 10, 1, 1]]]
        found = {"version": VERSION, "over": "load", "columns": columns, "rows": rows}
        (self.folder / "capacity.json").write_text(json.dumps(found))
        with patch.object(style, "save") as save:
            sweep_page.write_capacity(str(self.folder))
        (axes,) = save.call_args[0][0].axes
        self.assertEqual([bar.get_width() for bar in axes.patches], [20])
        self.assertEqual([text.get_text() for text in axes.texts], ["20"])
