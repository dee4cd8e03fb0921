# SPDX-License-Identifier: Apache-2.0
"""hotpath analyze: bounds that hold where earlier ones did not, and what happens when one does not."""

import csv
import json
import unittest
from pathlib import Path

from hotpath_command import CommandTest

SENSOR = "{{name: {0}, type: sensor, period_ms: {1}, execution_time_ms: {2}}}"
TRANSFORM = "{{name: {0}, type: transform, input: {1}, execution_time_ms: {2}}}"
FUSION = "{{name: {0}, type: fusion, inputs: [{1}, {2}], execution_time_ms: {3}}}"


class AnalyzeTest(CommandTest):
    """Each case is a graph and a simulation whose observations exceeded a bound of an earlier version."""

    def graph(self, *nodes: str, chain: str = "", more: str = "") -> Path:
        """A file of these nodes. `chain`: its sources and its sink."""
        path = self.folder / "graph.yaml"
        names = ", ".join(node.split("name: ")[1].split(",")[0] for node in nodes)
        lines = ["name: graph", more, "nodes:", *(f"  - {node}" for node in nodes)]
        if chain:
            *sources, sink = chain.split()
            lines += ["chains:", f"  - {{name: chain, nodes: [{names}], sources: [{', '.join(sources)}], sink: {sink}}}"]
        path.write_text("\n".join(lines) + "\n")
        return path

    def simulated(self, graph, executor: str, *options, seconds=10, repetitions=40, phases="random") -> Path:
        output = self.folder / f"run{len(list(self.folder.iterdir()))}"
        self.accepted(
            *("simulate", "--graph", graph, "--executors", executor, "--phases", phases, "--repetitions", repetitions),
            *("--duration", seconds, "--output", output, *options),
        )
        return output

    def rows(self, graph, executor: str, *options) -> dict:
        """Of `analyze`: the tightest bound and the observed value of each task and chain, in ms."""
        table = self.folder / "bounds.csv"
        self.accepted("analyze", graph, "--executors", executor, "--csv", table, *options)
        rows: dict = {}
        with table.open(encoding="utf-8") as file:
            for row in csv.DictReader(file):
                if not row["bound_ns"]:
                    continue
                bound = int(row["bound_ns"]) / 1e6
                observed = int(row["observed_ns"]) / 1e6 if row["observed_ns"] else 0.0
                known = rows.get(row["name"], (bound, observed))
                rows[row["name"]] = (min(bound, known[0]), observed)
        return rows

    def check(self, graph, executor: str, name: str, at_least: float, *options, **more) -> None:
        """`name` is observed with more than an earlier bound, and the bound covers it."""
        rows = self.rows(graph, executor, "--trace", self.simulated(graph, executor, *options, **more))
        bound, observed = rows[name]
        self.assertGreater(observed, at_least)
        self.assertLessEqual(observed, bound)

    def test_at_equal_priority_subscriptions_run_before_timers(self):
        self.check("sequences_high_utilisation", "rm-ro", "localization", 158.1)
        twins = [SENSOR.format(s, 100, 20) for s in "AB"] + [TRANSFORM.format("T" + s, s, 20) for s in "AB"]
        self.check(self.graph(*twins, chain="A TA"), "rm-ro", "chain", 40)

    def test_the_sink_of_a_sequence_counts(self):
        nodes = [
            SENSOR.format("S", 50, 5),
            "{name: C, type: cyclic, period_ms: 100, inputs: [S], execution_time_ms: 10}",
            "{name: K, type: command, input: C, execution_time_ms: 5}",
        ]
        self.check(self.graph(*nodes, chain="S K"), "rm-ro", "chain", 69)
        fused = [SENSOR.format("A", 50, 5), SENSOR.format("B", 110, 5), FUSION.format("F", "A", "B", 5)]
        self.check(self.graph(*fused, chain="A F"), "rm-ro", "chain", 25)

    def test_fusions_wait_under_the_default_executor(self):
        nodes = [SENSOR.format(s, p, 5) for s, p in (("A", 40), ("B", 70), ("C", 110))]
        nodes += [FUSION.format("F", "A", "B", 5), FUSION.format("G", "F", "C", 5)]
        self.check(self.graph(*nodes, chain="A B C G"), "default", "chain", 120)

    def test_samples_queue_under_the_default_executor(self):
        topic = "topics: {tf: {publishers: many}}"
        nodes = [SENSOR.format(f"S{i}", 100, 2)[:-1] + ", output: tf}" for i in range(6)]
        nodes += ["{name: R, type: transform, input: {topic: tf, depth: 20}, execution_time_ms: 10}"]
        self.check(self.graph(*nodes, chain="S5 R", more=topic), "default", "chain", 60, phases="synchronous")

    def test_data_passes_cyclic_nodes(self):
        nodes = [
            SENSOR.format("S", 50, 5),
            "{name: C, type: cyclic, period_ms: 100, inputs: [S], execution_time_ms: 10}",
        ]
        self.check(self.graph(*nodes, chain="S C"), "default", "chain", 60)

    def test_variants_have_bounds_of_their_own(self):
        nodes = [SENSOR.format("A", 20, 5), SENSOR.format("B", 100, 5), TRANSFORM.format("T", "B", 20)]
        graph = self.graph(*nodes, chain="B T")
        self.check(graph, "rm-ro:first", "A", 20)
        self.check(graph, "rm-ro:fifo", "A", 20)

    def test_costs_count(self):
        costs = ("--release-cost-us", 300, "--dispatch-cost-us", 500, "--wake-up-us", 400)
        self.check("sequences", "rm-ro", "localization", 70, *costs)
        for executor in ("default", "events-ro", "edf-ro", "static"):
            with self.subTest(executor=executor):
                run = self.simulated("sequences", executor, *costs, "--wait-cost-us", 300, seconds=3, repetitions=10)
                rows = self.rows("sequences", executor, "--trace", run)
                self.assertLessEqual(rows["localization"][1], rows["localization"][0])
        one = self.rows("sequences", "rm-ro", "--delta-us", 100)
        self.assertEqual(one, self.rows("sequences", "rm-ro", "--release-cost-us", 100))
        self.assertGreater(one["localization"], self.rows("sequences", "rm-ro")["localization"])

    def test_a_delay_of_delivery_is_refused_where_no_method_covers_it(self):
        _, out, _ = self.command("analyze", "sequences", "--executors", "rm-ro,default", "--delivery-delay-us", 100)
        self.assertIn("rm-ro: no bound is known", out)
        self.assertIn("it does not cover a delay of delivery; no method here does", out)
        self.assertIn("default, processing windows", out)

    def test_a_subscription_may_have_a_priority_of_its_own(self):
        nodes = [
            "{name: A, type: sensor, period_ms: 100, priority: 1, execution_time_ms: 5}",
            "{name: B, type: sensor, period_ms: 100, priority: 2, execution_time_ms: 10}",
            "{name: T, type: transform, input: {topic: A, priority: 9}, execution_time_ms: 5}",
        ]
        self.check(self.graph(*nodes, chain="A T"), "fp-ro", "chain", 19)

    def test_chains_of_timers_need_their_phases(self):
        graph = self.graph(SENSOR.format("A", 20, 2), SENSOR.format("B", 30, 2))
        _, unknown, _ = self.command("analyze", graph, "--executors", "rm-ro", "--chain", "A,B")
        self.assertRegex(unknown, r"Kloda 2018, Davis 2007 \(exact\) +- +it does not cover unknown phases")
        self.assertRegex(unknown, r"Duerr 2019, Davis 2007 \(exact\) +[0-9.]+")
        run = self.simulated(graph, "rm-ro", seconds=1, repetitions=1)
        known = ("analyze", graph, "--executors", "rm-ro", "--chain", "A,B", "--phases-of", run)
        _, shifted, _ = self.command(*known)
        self.assertRegex(shifted, r"Kloda 2018, Davis 2007 \(exact\) +- +it does not cover phases other than 0")
        self.assertRegex(shifted, r"Guenzel 2023, Davis 2007 \(exact\) +[0-9.]+")

    def test_an_overload_is_never_schedulable(self):
        graph = self.graph(SENSOR.format("A", 10, 6), SENSOR.format("B", 20, 12))
        _, out, _ = self.command("analyze", graph, "--executors", "rm-ro", "--exact", "--phases", "synchronous")
        self.assertNotIn("Schedulable", out)
        self.assertIn("utilisation", out)

    def test_a_chain_without_a_bound_says_why(self):
        nodes = [SENSOR.format("S", 100, 5), TRANSFORM.format("T", "S", 100)]
        _, out, _ = self.command("analyze", self.graph(*nodes, chain="S T"), "--executors", "rm-ro")
        self.assertIn("from S to T/S there is no bound", out)

    def tampered(self, kind: str) -> Path:
        """A run with a latency of one chain that no run can have."""
        run = self.simulated("sequences", "rm-ro", seconds=1, repetitions=1)
        lines = (run / "chains.csv").read_text().splitlines()
        cells = lines[-1].split(",")
        cells[lines[0].split(",").index("end_to_end_latency_ns")] = "900000000"
        (run / "chains.csv").write_text("\n".join([*lines[:-1], ",".join(cells)]) + "\n")
        facts = json.loads((run / "run.json").read_text())
        (run / "run.json").write_text(json.dumps({**facts, "kind": kind}))
        return run

    def test_a_wrong_bound_is_a_failure(self):
        code, _, err = self.command("analyze", "sequences", "--executors", "rm-ro", "--trace", self.tampered("simulated"))
        self.assertEqual(code, 1)
        self.assertRegex(err, r"1 of \d+ observed values \(.*%\) exceed their bound, first chain .* under rm-ro by busy")
        self.assertIn("A bound is wrong. To reproduce it:", err)

    def test_a_live_run_may_exceed_bounds_unless_strict(self):
        run = self.tampered("live")
        code, out, err = self.command("analyze", "sequences", "--executors", "rm-ro", "--trace", run)
        self.assertEqual((code, err), (0, ""))
        self.assertRegex(out, r"1 of \d+ observed values .* exceed their bound")
        code, _, err = self.command("analyze", "sequences", "--executors", "rm-ro", "--trace", run, "--strict")
        self.assertEqual(code, 1)
        self.assertIn("--strict: 1 of ", err)

    def test_another_machine_than_that_of_the_run_is_refused(self):
        run = self.simulated("sequences", "rm-ro", seconds=1, repetitions=1)
        code, _, err = self.command("analyze", "sequences", "--trace", run, "--dispatch-cost-us", 5)
        self.assertEqual(code, 2)
        self.assertIn("leave out the options that change it", err)


if __name__ == "__main__":
    unittest.main()
