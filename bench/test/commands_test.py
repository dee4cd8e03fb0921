# SPDX-License-Identifier: Apache-2.0
"""Runs each command once; fast enough for slow builds, such as a build without optimisation."""

import json
from typing import Any

import failing_calls_test
from command_uses import ELSEWHERE, NO_TABLES, PRINTS_JSON, USES, commands_of, prepare
from hotpath_command import CommandTest


NETWORKED = {"run", "compare", "replay"}  # second_host_test.py tests what they use


class Commands(CommandTest):
    def test_each_command_has_a_use(self) -> None:
        self.assertEqual(commands_of(self.accepted("--help")), set(USES) | ELSEWHERE)

    def test_each_command_does_its_work_and_only_live_runs_use_the_network(self) -> None:
        calls = self.folder / "calls"
        noted = {"LD_PRELOAD": failing_calls_test.LIBRARY, "HOTPATH_CALLS": str(calls)}
        for name, (arguments, result) in USES.items():
            with self.subTest(name):
                prepare(name, self.folder)
                calls.write_bytes(failing_calls_test.NO_PLACES)
                self.environment |= noted if name not in NETWORKED else {}
                out = self.accepted(name, *arguments)
                if name not in NETWORKED:
                    _, places = failing_calls_test.noted_places(calls)
                    self.assertEqual((places["socket"], places["bind"]), ([], []))
                    self.assertNotEqual(places["malloc"], [], "the calls are not noted")
                    for variable in noted:
                        del self.environment[variable]
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
                    if name in ("export", "import"):  # later uses read their files
                        self.accepted(name, *arguments)
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
        self.assertEqual({row["task"] for row in data("paper", "table1")}, {"IMU", "Camera", "LiDAR"})
        gate = data("diff", "run", "run", "--gate")
        self.assertFalse(any(row["worse"] for row in gate))
