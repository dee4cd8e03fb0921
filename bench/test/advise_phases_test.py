# SPDX-License-Identifier: Apache-2.0
"""`hotpath advise --phases`: the phases that it chooses, what proves them, and what it refuses."""

import json
import re
from typing import Any

from analyze_case import SENSOR, graph_text
from hotpath_command import CommandTest, RunFolder, csv_rows

# A fusion of two sensors, and a busy timer that can come between.
GRAPH = """name: small
nodes:
- {name: P, type: sensor, period_ms: 40, execution_time_ms: 6, best_case_execution_time_ms: 2}
- {name: Q, type: sensor, period_ms: 40, execution_time_ms: 6, best_case_execution_time_ms: 2}
- {name: R, type: sensor, period_ms: 60, execution_time_ms: 9, best_case_execution_time_ms: 4}
- {name: F, type: fusion, inputs: [P, Q], execution_time_ms: 3, best_case_execution_time_ms: 1}
- {name: S, type: command, input: F, execution_time_ms: 1}
chains:
- {name: pq, nodes: [P, Q, F, S], sources: [P, Q], sink: S}
"""


class AdvisePhases(CommandTest):
    def setUp(self) -> None:
        super().setUp()
        self.graph = self.folder / "small.yaml"
        self.graph.write_text(GRAPH)

    def advise(self, options: str) -> tuple[str, Any]:
        output = self.folder / "advice"
        out = self.accepted("advise", self.graph, *options.split(), "--phases", "--output", output)
        return out, json.loads((output / "phases.json").read_text())

    def guaranteed(self, *phases: object) -> dict[str, float]:
        """Exact worst cases by `analyze`: hot path and age of the chain, in ms."""
        table = self.folder / "bounds.csv"
        self.accepted("analyze", self.graph, "--executors", "rm-ro", *phases, "--csv", table)
        rows = [r for r in csv_rows(table) if r["method"].startswith("exploration") and r["name"] == "pq"]
        return {row["kind"]: int(row["bound_ns"]) / 1e6 for row in rows}

    def test_chooses_phases_that_guarantee_less(self) -> None:
        out, advice = self.advise("--executors rm-ro,default --for pq:age --repetitions 4")
        for candidate in advice["candidates"]:
            self.assertTrue(candidate["complete"])
            self.assertLessEqual(candidate["chosen"]["objective"], candidate["within_margin"])
            self.assertLess(candidate["chosen"]["age_ms"], candidate["random"][-1]["age_ms"])
            if candidate["name"] == "default":
                self.assertLess(candidate["chosen"]["age_ms"], candidate["by_rule"]["creation"]["age_ms"])
        for sentence in advice["sentences"]:
            self.assertIn(sentence, out)
        self.assertEqual(advice["margin_ms"], 0.4, "1 % of the shortest period")

    def test_without_a_margin_exact_offsets_are_at_least_as_good_as_the_compared_ones(self) -> None:
        _, advice = self.advise("--executors rm-ro,default --for pq:age --repetitions 4 --margin 0")
        for candidate in advice["candidates"]:
            others = [v["objective"] for v in [*candidate["by_rule"].values(), *candidate["random"]]]
            self.assertLessEqual(candidate["chosen"]["objective"], min(others), candidate["name"])

    def test_the_file_is_that_of_all_commands_and_its_witness_reaches_the_guarantee(self) -> None:
        _, advice = self.advise("--executors rm-ro --now rm-ro --for pq:worst --repetitions 2")
        chosen, phases = advice["candidates"][0]["chosen"], self.folder / "advice" / "phases.csv"
        found = self.guaranteed("--phases", phases)
        self.assertAlmostEqual(found["hot_path"], chosen["hot_path_ms"])
        self.assertAlmostEqual(found["chain"], chosen["age_ms"])
        creation = self.guaranteed("--phases", "creation")
        by_creation = advice["candidates"][0]["by_rule"]["creation"]
        self.assertAlmostEqual(creation["hot_path"], by_creation["hot_path_ms"])
        rows = {row["task"]: float(row["first_release_ms"]) for row in csv_rows(phases)}
        self.assertEqual(rows, advice["candidates"][0]["first_release_ms"])
        witness = self.checked("advice/witness/rm-ro/hot_path_pq")
        ((_, chains),) = witness.chains().items()
        self.assertAlmostEqual(max(c[2] for c in chains) / 1e6, chosen["hot_path_ms"])
        run = self.measure(
            *("simulate", "--graph", self.graph, "--executors", "rm-ro", "--phases", phases),
            *("--execution-times", "uniform", "--duration", 20, "--warm-up", 0),
        )
        self.assertEqual(run.run["runs"][0]["first_timestamps_ms"], rows)
        (executor,) = run.summary()["executors"]
        self.assertLessEqual(executor["chains"][0]["hot_path_latency_ms"]["max"], chosen["hot_path_ms"])

    def test_depends_on_the_seed_alone(self) -> None:
        texts = []
        for threads in (1, 2):
            self.advise(f"--executors rm-ro --repetitions 2 --threads {threads}")
            output = (self.folder / "advice").rename(self.folder / f"by_{threads}")
            texts.append((output / "phases.csv").read_text())
        self.assertEqual(*texts)
        options = (output / "executor.yaml").read_text()
        self.assertIn("\nexecutor: rm-ro\nthreads: 1\ngraph: graph.yaml\n", options)
        self.assertIn("\nservice_wait_ms: 100\noffsets: phases.csv\n", options)

    def test_timers_alone_are_judged_by_lateness(self) -> None:
        timers, _, _ = GRAPH.partition("- {name: F,")
        self.graph.write_text(re.sub(", best_case_execution_time_ms: [0-9]+", "", timers))
        out, advice = self.advise("--executors rm-ro --repetitions 2")
        self.assertEqual(advice["objective"], "worst lateness of timers")
        self.assertIn("guaranteed worst lateness of timers", out)
        self.assertIn("Execution times are constant in this graph", out)

    def test_several_threads_and_deployments_are_refused_by_name(self) -> None:
        executors = "--cores 2 --executors rm-ro,multi:3 --deployments isolated"
        out, advice = self.advise(f"{executors} --repetitions 2 --for pq<60")
        refusals = {c["name"]: c["refusal"] for c in advice["candidates"]}
        self.assertIn("needs 3 cores", refusals["multi:3"])
        self.assertIn("deployment", refusals["isolated"])
        self.assertIn("multi:3 has no exact values", out)
        none = "--phases --cores 2 --executors multi:3 --now multi:3 --output none"
        says = "nothing is guaranteed; multi:3:"
        self.rejected("advise", self.graph, *none.split(), says=says, code=1, out=None)

    def test_wrong_use_is_refused(self) -> None:
        for words, message in (
            ("--phases --for pq:p99", "CHAIN:age or CHAIN:worst"),
            ("--phases nonsense", "is none of creation, synchronous, given, random, creation:MS"),
            ("--phases --phases x", "--phases"),
            ("--phases --margin 30", "half of the shortest period"),
            ("--margin 1", "add --phases"),
        ):
            self.rejected("advise", self.graph, *words.split(), "--output", "refused", says=message)
            self.assertFalse((self.folder / "refused").exists())

    def test_runs_with_given_phases_say_when_timers_are_skipped(self) -> None:
        """A job that takes longer than the period makes its own timer skip, on any machine."""
        graph = self.written("slow.yaml", graph_text(SENSOR.format("A", "20, phase_ms: 5", 30)))
        output = self.folder / "live"
        words = "--executors default --phases given --work wall --duration 0.5 --warm-up 0"
        options = (*words.split(), "--transport", "intra_process", "--output", output)
        _, _, err = self.command("run", "--graph", graph, *options)
        left = r"default, repetition 0: timers left the grid of their given phases: A skipped \d+ of"
        self.assertRegex(err, left)
        self.assertTrue(any("left the grid" in w for w in RunFolder(output).run["warnings"]))
