# SPDX-License-Identifier: Apache-2.0
"""`hotpath advise` as a user starts it: its ranking, its files, and its errors."""

import shutil
from pathlib import Path
from typing import Any

import package
from analyze_case import COMMAND, SENSOR, graph_text
from hotpath_command import CommandTest, csv_rows, document

SOURCE = Path(__file__).resolve().parents[2]
MEASURED = SOURCE / "reference_system" / "ros2_reference" / "rclcpp_autoware_phases.csv"
# A smaller ratio of medians is within the variation between repetitions on the real stack.
CLEAR = 1.15
SHORT = "--repetitions 2 --duration 2"


class Advise(CommandTest):
    def advise(self, graph: object, options: str, *more: object) -> tuple[Any, Any]:
        output = self.folder / "advice"
        out = self.accepted("advise", graph, *options.split(), *more, "--output", output)
        return out, document(output / "advice.json")

    def test_autoware_gets_a_ranking_an_advice_and_a_change_that_can_be_run(self) -> None:
        out, advice = self.advise("autoware", "--cores 2 --repetitions 3 --duration 3")
        rows = {row["name"]: row for row in advice["ranking"]}
        self.assertGreaterEqual(len(rows), 15)
        self.assertEqual(advice["recommended"], advice["ranking"][0]["name"])
        p99 = [row["p99_ms"]["value"] for row in advice["ranking"]]
        self.assertEqual(p99, sorted(p99))
        self.assertLess(rows["rm-ro"]["p99_ms"]["value"], rows["default"]["p99_ms"]["value"])
        self.assertGreater(rows["rm-ro"]["bound_ms"], rows["rm-ro"]["worst_ms"]["value"])
        self.assertIn("age of the data in ms, best first by p99; simulated, but for the bound", out)
        self.assertRegex(advice["sentences"][1], r"^Its hot-path latency, .*\(the paper's metric\): p99 \d")
        beside = [s for s in advice["sentences"] if "beside the executor thread" in s]
        self.assertEqual(len(beside), advice["recommended"].endswith("-re"))
        self.assertRegex(advice["causes"][0], r"is faster than default by \d")
        for sentence in advice["sentences"] + advice["causes"]:
            self.assertIn(sentence, " ".join(out.split()))
        assumptions = [d["assumption"] for d in advice["doubts"]]
        self.assertEqual(assumptions, ["execution times 20 % longer", "one more core"])
        folder = self.folder / "advice"
        graph = folder / "graph.yaml" if (folder / "graph.yaml").exists() else "autoware"
        run = self.measure(
            *("simulate", "--graph", graph, "--cores", 2, "--duration", 3, "--phases", "random"),
            *("--deployments", folder / "deployment.yaml", "--repetitions", 3),
        )
        median = run.summary()["executors"][0]["chains"][0]["end_to_end_latency_ms"]["p50"]
        self.assertLess(median, rows["default"]["median_ms"]["value"])

    def test_writes_the_options_of_the_executor_on_the_robot(self) -> None:
        out, advice = self.advise("autoware", "--executors default,rm-ro:first --repetitions 1 --duration 2")
        self.assertEqual(advice["recommended"], "rm-ro:first")
        (premises,) = (s for s in advice["sentences"] if s.startswith("It rests on: ") and "_us 1" in s)
        self.assertIn(premises[13:-1], (self.folder / "advice" / "contract.yaml").read_text())
        folder = self.folder / "advice"
        package.write_advice(self.folder, self.environment, folder)
        page = (folder / "report.md").read_text()
        for use in ('from_file("{}")', '"config": "{}"', "HOTPATH_EXECUTOR={}\n"):
            self.assertIn(use.format(folder / "executor.yaml"), out)
            self.assertIn(use.format(folder / "executor.yaml"), page)
        options = "executor: rm-ro:first\nthreads: 1\ngraph: graph.yaml\nservice_wait_ms: 100\n"
        self.assertTrue((folder / "executor.yaml").read_text().endswith("\n" + options))
        self.measure("simulate", folder / "graph.yaml", "--executors", "rm-ro:first", "--duration", 1)

    def test_ranks_as_the_real_executors_were_measured(self) -> None:
        """Uses the recorded phases, and ranks by the median for a crunch of 4.2 ms."""
        measured = {r["executor"].split()[0]: float(r["hot_path_p50_ms"]) for r in csv_rows(MEASURED)}
        variants = {"rm-ro": "rm-ro:first", "edf-ro": "edf-ro:first", "multi": "multi:2"}
        names = {name: variants.get(name, name) for name in measured}
        options = f"--cores 2 --for hot_path:median --duration 20 --executors {','.join(names.values())}"
        _, advice = self.advise("autoware", options, "--phases", MEASURED)
        self.assertEqual(advice["draws"], 1, "nothing is random")
        predicted = {row["name"]: row["median_ms"]["value"] for row in advice["ranking"]}
        pairs = [(a, b) for a in measured for b in measured if measured[b] > CLEAR * measured[a]]
        self.assertGreater(len(pairs), 5)
        for a, b in pairs:
            self.assertLess(predicted[names[a]], predicted[names[b]], (a, b))

    def test_draws_unknown_orders_of_delivery_and_says_what_they_are_worth(self) -> None:
        """Of two subscribers, rm-ro runs the last one reached first, and events-ro the first one."""
        graph = self.folder / "unknown.yaml"
        nodes = (SENSOR.format("S", 100, 1), COMMAND.format("A", "S", 2), COMMAND.format("B", "S", 3))
        chains = "chains: [{name: c, nodes: [S, A], sources: [S], sink: A}]"
        graph.write_text(graph_text(*nodes, more="topics: {S: {delivery: unknown}}\n" + chains))
        options = "--executors rm-ro,events-ro --now events-ro --costs graph --for c:p99"
        out, advice = self.advise(graph, f"{options} --repetitions 10 --duration 1")
        self.assertEqual(advice["draws"], 10)
        self.assertEqual({row["worst_ms"]["value"] for row in advice["ranking"]}, {4.0})
        self.assertIn("delivery in the order of creation: events-ro 1.0 ms, rm-ro 4.0 ms.", out)
        self.assertIn("delivery in the reverse order: rm-ro 1.0 ms, events-ro 4.0 ms.", out)
        exact = self.accepted("analyze", graph, "--executors", "rm-ro", "--phases", "synchronous")
        self.assertIn("needs the order in which samples of topic S reach its subscribers", exact)

    def test_keeps_the_current_executor_if_nothing_differs(self) -> None:
        graph = Path(__file__).parent / "field" / "nothing_to_gain.yaml"
        common = "--costs graph --now rm-ro --executors default,rm-ro --duration 1"
        for objective in ("losses", "worst_lateness", "hot_path:median", "hot_path:age", "hot_path<50"):
            for draws in (1, 3):
                _, advice = self.advise(graph, f"{common} --for {objective} --repetitions {draws}")
                self.assertEqual(advice["recommended"], "rm-ro", (objective, draws))
                self.assertEqual(advice["change"], "")
                guaranteed = ", so hot_path within 50 ms is guaranteed." in advice["sentences"][2]
                self.assertEqual(guaranteed, objective == "hot_path<50")
                self.assertFalse((self.folder / "advice" / "deployment.yaml").exists())
                shutil.rmtree(self.folder / "advice")

    def test_finds_chains_and_says_what_release_and_execute_costs(self) -> None:
        graph = self.folder / "mine.yaml"
        other = SENSOR.format("T", 50, 1), COMMAND.format("X", "T", 30)
        graph.write_text(graph_text(SENSOR.format("S", 100, 10), COMMAND.format("C", "S", 1), *other))
        options = f"--cores 2 --for chain_2<40 --executors default,rm-ro,rm-re {SHORT}"
        out, advice = self.advise(graph, options)
        self.assertIn("Found chain_2: S -> C", out)
        self.assertEqual((advice["objective"], advice["recommended"]), ("chain_2 within 40 ms", "rm-re"))
        self.assertIn("Timers run on a thread beside the executor thread", " ".join(advice["sentences"]))
        proven = f"--for chain_2<50 --executors default,cbg:2 --cores 2 {SHORT} --output proven"
        out = self.accepted("advise", graph, *proven.split())  # cbg:2 is better in simulation
        self.assertRegex(" ".join(out.split()), r"^Found .*Keep default: [^.]* surer .* limit \(proven\)\.")

    def test_timers_alone_are_ranked_by_lateness(self) -> None:
        _, advice = self.advise("timers_only_60", "--repetitions 2 --duration 5")
        self.assertEqual(advice["objective"], "worst lateness of timers")
        values = [row["objective"] for row in advice["ranking"]]
        self.assertEqual(values, sorted(values))

    def test_reports_overloaded_candidates(self) -> None:
        words = f"autoware --load 130 --executors default,rm-ro {SHORT} --output full".split()
        code, out, err = self.command("advise", *words)
        self.assertEqual((code, "median" in out), (0, False), "a table without rows")
        overload = "the graph has 130 % of one core of work for 1 core; give it 2"
        self.assertIn("no candidate keeps up, since " + overload, " ".join(out.split()))
        self.assertIn("note: autoware is overloaded: " + overload, err)
        out, advice = self.advise("autoware", f"--load 130 --cores 2 {SHORT}")
        self.assertIn("cannot keep up: it has 130 % of one core of work for 1 thread", out)
        self.assertNotEqual(advice["recommended"], "default")

    def test_the_budget_ends_it_after_a_whole_draw(self) -> None:
        out, advice = self.advise("autoware", "--repetitions 1000 --time-out 0.1 --executors default,rm-ro")
        self.assertLess(advice["draws"], 1000)
        rows = csv_rows(self.folder / "advice" / "latencies.csv")
        drawn = {(row["executor"], int(row["repetition"])) for row in rows}
        self.assertEqual(drawn, {(e, d) for e in ("default", "rm-ro") for d in range(advice["draws"])})
        self.assertIn("draws: the budget ended", out)

    def test_wrong_use_is_refused(self) -> None:
        self.rejected("advise --costs none", says="neither reference nor graph")
        self.rejected("advise --now nothing", says="no deployment of this name")
