# SPDX-License-Identifier: Apache-2.0
"""Runs graphs with nodes of type `callbacks` through every command that takes them."""

import shutil
from typing import Any

from hotpath_command import CommandTest

TASKS = {
    *("Driver/imu", "Driver/lidar", "Localizer/imu", "Localizer/points", "Localizer/diagnostics"),
    *("Planner/odometry", "Planner/pose", "Controller/path"),
}


class Callbacks(CommandTest):
    def check(self, run: Any) -> None:
        self.assertTrue(run.run["complete"])
        self.assertEqual(run.run["failures"], [])
        for executor in run.summary()["executors"]:
            self.assertTrue(executor["loss_equations"]["hold"], executor["executor"])
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
        self.assertIn(
            "diagnostics, every 500 ms, works 0.1 ms", self.accepted("graph", "callbacks", "--as", "dot")
        )
        if shutil.which("dot"):
            self.assertIn("</svg>", self.accepted("graph", "callbacks", "--as", "svg"))

    def test_deployments_are_listed_and_colour_the_graph(self) -> None:
        listed = self.accepted("list", "deployments")
        for name, description in (("isolated", "a default executor"), ("picas", "chain-aware priorities")):
            self.assertRegex(listed, f"(?m)^{name} +{description}")
        self.assertIn(
            "<b>Localizer</b>: default",
            self.accepted("graph", "callbacks", "--as", "dot", "--deployments", "isolated"),
        )
        for arguments, reason in (
            (("--deployments", "isolated"), "--deployments: add --as svg, dot or cie"),
            (("--as", "dot", "--deployments", "isolatd"), "isolated"),
        ):
            code, out, err = self.command("graph", "callbacks", *arguments)
            self.assertEqual((code, out), (2, ""))
            self.assertIn(reason, err)

    def test_simulate_and_what_reads_its_run(self) -> None:
        run = self.measure(
            "simulate", "--graph", "callbacks", "--executors", "all", "--duration", 5, "--warm-up", 0
        )
        self.check(run)
        summary = run.summary()
        self.accepted("report", "--summary", run.path)
        self.assertEqual(run.summary(), summary)
        perfetto = self.folder / "trace.json"
        self.accepted("export", "perfetto", run.path, "--executors", "rm-ro", "--output", perfetto)
        self.assertIn("Localizer/points", perfetto.read_text())

    def test_measured_execution_times_are_drawn(self) -> None:
        run = self.measure(
            *("simulate", "--graph", "callbacks", "--executors", "rm-ro,edf-ro", "--duration", 60),
            *("--execution-times", "measured", "--seed", 3),
        )
        self.assertEqual(run.run["execution_times"], "measured")
        worked = [
            {
                (j.sequence, j.finish - j.start)
                for j in jobs
                if j.task == "Localizer/points" and j.outcome == "ran"
            }
            for jobs in run.jobs().values()
        ]
        self.assertEqual({t for _, t in worked[0]}, {8_100_000, 7_900_000, 8_400_000, 8_000_000, 12_300_000})
        shared = {s for s, _ in worked[0]} & {s for s, _ in worked[1]}
        of = [{s: t for s, t in w if s in shared} for w in worked]
        self.assertEqual(of[0], of[1], "every executor draws the same")

    def test_live_runs_lose_nothing(self) -> None:
        for options in (("--transport", "intra_process"), (), ("--processes", 2)):
            with self.subTest(options=options):
                output = self.folder / "-".join(map(str, ("run", *options)))
                self.accepted(
                    *(
                        "run",
                        "--graph",
                        "callbacks",
                        "--executor",
                        "events-ro",
                        "--duration",
                        1,
                        "--warm-up",
                        0,
                    ),
                    *("--load", 5, *options, "--output", output),
                )
                self.check(self.checked(output))

    def test_analyze_refuses_them_with_the_reason(self) -> None:
        code, out, err = self.command("analyze", "callbacks")
        self.assertEqual((code, out), (2, ""))
        self.assertIn("no method covers callback Planner/odometry, which waits for a set", err)

    def test_timers_of_one_node_have_bounds(self) -> None:
        graph = self.folder / "timers.yaml"
        graph.write_text(
            "name: timers\nnodes:\n  - name: A\n    type: callbacks\n    callbacks:\n"
            "      - {timer: t, period_ms: 10, execution_time_ms: 1}\n"
            "      - {timer: u, period_ms: 20, execution_time_ms: 1}\n"
        )
        run = self.measure(
            "simulate", "--graph", graph, "--executors", "rm-ro", "--duration", 1, "--warm-up", 0
        )
        self.assertEqual([(b["task"], b["ms"]) for b in run.run["bounds"]], [("A/t", 2), ("A/u", 2)])
