# SPDX-License-Identifier: Apache-2.0
"""Runs each command once; fast enough for slow builds, such as a build without optimisation."""

import json
from typing import Any

from command_uses import ELSEWHERE, NO_TABLES, PRINTS_JSON, USES, commands_of, prepare
from hotpath_command import CommandTest


class Commands(CommandTest):
    def test_each_command_has_a_use(self) -> None:
        self.assertEqual(commands_of(self.accepted("--help")), set(USES) | ELSEWHERE)

    def test_each_command_does_its_work(self) -> None:
        for name, (arguments, result) in USES.items():
            with self.subTest(name):
                prepare(name, self.folder)
                out = self.accepted(name, *arguments)
                self.assertNotIn("Usage: hotpath", out)
                if result and result.startswith(">"):
                    self.assertIn(result[1:], out)
                elif result:
                    self.assertGreater((self.folder / result).stat().st_size, 0)

    def test_each_command_that_prints_tables_prints_them_as_json(self) -> None:
        for name, (arguments, _) in USES.items():
            with self.subTest(name):
                prepare(name, self.folder)
                if name in NO_TABLES:
                    code, _, errors = self.command(name, *arguments, "--json")
                    self.assertEqual(code, 2, errors)
                    self.accepted(name, *arguments)  # later uses read its files
                    continue
                words: tuple[object, ...] = PRINTS_JSON.get(name) or (*arguments, "--json")
                code, out, errors = self.command(name, *words)
                self.assertEqual(code, 0, errors)
                self.assertTrue(json.loads(out), "no data")

    def test_json_has_numbers_under_the_names_of_the_stored_files(self) -> None:
        def data(*words: object) -> Any:
            code, out, errors = self.command(*words, "--json")
            self.assertEqual(code, 0, errors)
            return json.loads(out)

        simulated = data("simulate", "--executors", "rm-ro", "--duration", 1, "--output", "run")
        self.assertEqual(simulated, json.loads((self.folder / "run" / "summary.json").read_text()))
        bounds = data("analyze", "timers_only_60", "--executors", "rm-ro")
        camera = [row for row in bounds if row["kind"] == "task" and row["name"] == "FrontCamera"]
        self.assertTrue(camera, bounds)
        for row in camera:
            self.assertGreater(row["bound_ns"], 0)
            self.assertIsNone(row["observed_ns"])
        chain = data("analyze", "timers_only_60", "--executors", "rm-ro", "--chain", "IMU,FrontCamera")
        self.assertTrue(any(isinstance(row["bound_ns"], int) for row in chain), chain)
        self.assertIn("autoware", [graph["name"] for graph in data("list", "graphs")])
        self.assertIn("isolated", [deployment["name"] for deployment in data("list", "deployments")])
        self.assertEqual(
            {row["task"] for row in data("experiment", "wcrt-table")}, {"IMU", "Camera", "LiDAR"}
        )
        gate = data("compare-results", "run", "run", "--gate")
        self.assertFalse(any(row["worse"] for row in gate))
