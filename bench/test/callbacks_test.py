# SPDX-License-Identifier: Apache-2.0
"""Runs graphs with nodes of type `callbacks` through every command that takes them."""

import re
from typing import Any

from analyze_case import graph_text
from hotpath_command import CommandTest

TASKS = {
    *("Driver/imu", "Driver/lidar", "Localizer/imu", "Localizer/points", "Localizer/diagnostics"),
    *("Planner/odometry", "Planner/pose", "Controller/path"),
}


class Callbacks(CommandTest):
    def check(self, run: Any) -> None:
        self.assertTrue(run.run["complete"])
        self.assertEqual(run.run["failures"], [])
        self.assertTrue(run.accounts_for_all())
        for executor in run.summary()["executors"]:
            self.assertEqual({t["task"] for t in executor["tasks"]}, TASKS)
        self.assertEqual({executor for executor, _ in run.jobs()}, set(run.run["executors"]))
        for jobs in run.jobs().values():
            self.assertEqual({j.task for j in jobs if j.outcome == "ran"}, TASKS)
        self.assertEqual(run.chains().keys(), run.jobs().keys())
        for chains in run.chains().values():
            for _, _, hot_path, end_to_end in chains:
                self.assertGreaterEqual(end_to_end, hot_path)

    def test_graph_says_what_it_describes_and_draws_it(self) -> None:
        self.assertIn("4 nodes, 5 subscriptions, 3 timers", self.accepted("graph", "callbacks"))
        drawn = self.accepted("graph", "callbacks", "--as", "dot")
        self.assertIn("diagnostics, every 500 ms, works 0.1 ms", drawn)

    def test_deployments_are_listed_and_colour_the_graph(self) -> None:
        listed = self.accepted("list", "deployments")
        for name, description in (("isolated", "a default executor"), ("picas", "chain-aware priorities")):
            self.assertRegex(listed, f"(?m)^{name} +{description}")
        drawn = self.accepted("graph", "callbacks", "--as", "dot", "--deployments", "isolated")
        self.assertIn("<b>Localizer</b>: default", drawn)
        for words, reason in (
            ("--deployments isolated", "--deployments: add --as dot or cie"),
            ("--as dot --deployments isolatd", "isolated"),
        ):
            self.rejected("graph", "callbacks", *words.split(), says=reason)

    def test_measured_execution_times_are_drawn(self) -> None:
        words = "simulate --graph callbacks --executors rm-ro,edf-ro --duration 60 --seed 3"
        run = self.measure(*words.split(), "--execution-times", "measured")
        self.assertEqual(run.run["execution_times"], "measured")
        drawn = ("Localizer/points", "ran")
        one, other = (
            {j.sequence: j.finish - j.start for j in jobs if (j.task, j.outcome) == drawn}
            for jobs in run.jobs().values()
        )
        self.assertEqual(set(one.values()), {8_100_000, 7_900_000, 8_400_000, 8_000_000, 12_300_000})
        shared = one.keys() & other.keys()
        of = [{s: times[s] for s in shared} for times in (one, other)]
        self.assertEqual(of[0], of[1], "every executor draws the same")

    def test_live_runs_lose_nothing(self) -> None:
        common = "--graph callbacks --executors events-ro --duration 1 --warm-up 0 --load 5"
        for options in ("--transport intra_process", "", "--processes 2"):
            with self.subTest(options=options):
                output = self.folder / "-".join(["run", *options.split()])
                self.accepted("run", *common.split(), *options.split(), "--output", output)
                self.check(self.checked(output))

    def test_analyze_refuses_them_with_the_reason(self) -> None:
        reason = "no method covers callback Planner/odometry, which waits for a set"
        self.rejected("analyze", "callbacks", says=reason)

    def test_timers_of_one_node_have_bounds(self) -> None:
        graph = self.folder / "timers.yaml"
        timer = "{{timer: {0}, period_ms: {1}, deadline_ms: {2}, execution_time_ms: 1}}"
        timers = f"{timer.format('t', 10, 0.5)}, {timer.format('u', 20, 2)}"
        graph.write_text(graph_text(f"{{name: A, type: callbacks, callbacks: [{timers}]}}"))
        run = self.measure("simulate", "--graph", graph, "--executors", "rm-ro", "--duration", 1)
        self.assertEqual([(b["task"], b["ms"]) for b in run.run["bounds"]], [("A/t", 2), ("A/u", 2)])
        perfetto = self.folder / "trace.json"
        self.accepted("export", "perfetto", run.path, "--output", perfetto)
        self.assertEqual(set(re.findall('"deadline missed: (.*?)"', perfetto.read_text())), {"A/t"})
