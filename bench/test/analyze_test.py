# SPDX-License-Identifier: Apache-2.0
"""hotpath analyze: bounds hold where an earlier version's bounds failed, and a violated bound is
reported."""

import json
from pathlib import Path

from analyze_case import FUSION, SENSOR, TRANSFORM, AnalyzeCase
from hotpath_command import csv_rows


class AnalyzeTest(AnalyzeCase):
    """Observations that exceeded a bound of an earlier version, and what `analyze` says."""

    def test_at_equal_priority_subscriptions_run_before_timers(self) -> None:
        self.check("sequences_high_utilisation", "rm-ro", "localization", 158.1)

    def test_what_a_service_activates_may_run_before_its_siblings_sample(self) -> None:
        """By deadline, both services of a timer are pending together; the newest sample runs first."""
        nodes = [
            "{name: N, type: callbacks, callbacks:"
            " [{timer: r, period_ms: 100, execution_time_ms: 1, publishes: t}]}",
            "{name: S, type: callbacks, callbacks:"
            " [{subscription: t, service: true, execution_time_ms: 1, publishes: ty},"
            " {subscription: tx, execution_time_ms: 1}, {subscription: ty, execution_time_ms: 5}]}",
            "{name: P, type: callbacks, callbacks: [{subscription: t, execution_time_ms: 6, publishes: tx}]}",
        ]
        self.check(self.graph(*nodes, more="service_wait_ms: 5"), "edf-ro", "S/tx", 3, repetitions=1)

    def test_costs_count(self) -> None:
        costs = ("--platform", "release_cost_us=300,dispatch_cost_us=500", "--platform", "wake_up_us=400")
        self.check("sequences", "rm-ro", "localization", 70, *costs)
        more = (*costs, "--platform", "wait_cost_us=300")
        for executor in ("default", "events-ro", "edf-ro", "static"):
            with self.subTest(executor=executor):
                self.check("sequences", executor, "localization", 0, *more, seconds=3, repetitions=10)
        one = self.rows("sequences", "rm-ro", "--platform", "release_cost_us=100")
        self.assertGreater(one["localization"], self.rows("sequences", "rm-ro")["localization"])

    def test_a_delay_of_delivery_counts(self) -> None:
        delayed = "--executors rm-ro,default,edf-ro --platform delivery_delay_us=100"
        out = self.accepted("analyze", "sequences", *delayed.split())
        self.assertIn("rm-ro, busy windows by priority", out)
        self.assertIn("default, processing windows", out)
        self.assertIn("edf-ro, busy windows in any order", out)
        self.assertNotIn("busy windows by deadline", out)

    def test_a_chain_without_a_bound_says_why(self) -> None:
        nodes = [SENSOR.format("S", 100, 5), TRANSFORM.format("T", "S", 100)]
        out = self.accepted("analyze", self.graph(*nodes, chain="S T"), "--executors", "rm-ro")
        self.assertIn("from S to T/S there is no bound", out)

    def test_the_table(self) -> None:
        table = self.folder / "bounds.csv"
        out = self.accepted("analyze", "sequences", "--executors", "rm-ro,multi", "--csv", table)
        self.assertRegex(out, r"multi: no bound is known\n(  .*\n)*  processing windows: ")
        chains = [row for row in csv_rows(table) if row["kind"] == "chain"]
        self.assertEqual([row["name"] for row in chains], ["localization", "lane_detection"])
        self.assertIn("blocked by Localization/PointsTransformer", chains[1]["dominated_by"])
        blocked = "^19.900 blocked by Localization/PointsTransformer; 0.900 IMU"
        self.assertRegex(self.of_timer(table, "IMU"), blocked)
        self.accepted("analyze", "sequences", "--executors", "edf-ro", "--csv", table)
        self.assertIn("blocked by Localization/PointsTransformer", self.of_timer(table, "IMU"))

    def of_timer(self, table: Path, name: str) -> str:
        """The composition of the timer's tightest bound."""
        rows = [row for row in csv_rows(table) if row["name"] == name and row["dominated_by"]]
        return min(rows, key=lambda row: int(row["bound_ns"]))["dominated_by"]

    def tampered(self, kind: str) -> Path:
        """A run with one impossible chain latency."""
        costs = ("--platform", "dispatch_cost_us=20") if kind == "simulated" else ()
        run = self.simulated("sequences", "rm-ro", *costs, seconds=1, repetitions=1)
        lines = (run / "chains.csv").read_text().splitlines()
        cells = lines[-1].split(",")
        cells[lines[0].split(",").index("end_to_end_latency_ns")] = "900000000"
        (run / "chains.csv").write_text("\n".join([*lines[:-1], ",".join(cells)]) + "\n")
        facts = json.loads((run / "run.json").read_text())
        (run / "run.json").write_text(json.dumps({**facts, "kind": kind}))
        return run

    def test_a_wrong_bound_is_a_failure(self) -> None:
        compared = ("analyze", "sequences", "--executors", "rm-ro", "--trace")
        err = self.rejected(*compared, self.tampered("simulated"), code=1, out=None)
        observed = r"1 of \d+ observed values \(.*%\) exceed their bound, first chain .* under rm-ro by busy"
        report = "A bound is wrong; please report the graph .*sequences.yaml and .*: "
        for says in (observed, f"{report}hotpath simulate --executors=rm-ro --graph=sequences"):
            self.assertRegex(err, says)
        reproduce = err.strip().split("reproduces it: hotpath ")[1].split()
        self.assertIn("--platform=dispatch_cost_us=20", reproduce)
        self.accepted(*reproduce, "--output", self.folder / "again")

    def test_a_live_run_may_exceed_bounds_unless_strict(self) -> None:
        compared = ("analyze", "sequences", "--executors", "rm-ro", "--trace", self.tampered("live"))
        code, out, err = self.command(*compared)
        self.assertEqual((code, err), (0, ""))
        self.assertRegex(out, r"1 of \d+ observed values .* exceed their bound")
        self.rejected(*compared, "--strict", says="--strict: 1 of ", code=1, out=None)

    def test_inputs_of_a_join_may_take_different_times(self) -> None:
        publishes = "publishes: {topic: f, when: all_new, of: [a, b]}"
        nodes = [
            "{name: A, type: sensor, period_ms: 20, execution_time_ms: 1, priority: 1, output: a}",
            "{name: B, type: sensor, period_ms: 20, execution_time_ms: 1, priority: 2, output: b}",
            "{name: F, type: callbacks, callbacks: ["
            f"{{subscription: a, execution_time_ms: 1, {publishes}}}, "
            f"{{subscription: b, execution_time_ms: 9, {publishes}}}]}}",
            "{name: L, type: sensor, period_ms: 40, execution_time_ms: 2, priority: 9, output: l}",
        ]
        for executor in ("fp-ro", "default", "edf-ro", "static"):
            with self.subTest(executor=executor):
                self.check(self.graph(*nodes), executor, "F/b", 8.9)

    def test_deployments_of_pinned_fifo_threads_have_bounds(self) -> None:
        nodes = [SENSOR.format("A", 20, 4), SENSOR.format("B", 50, 6)]
        nodes += [TRANSFORM.format("T", "A", 5), TRANSFORM.format("O", "B", 1)]
        graph = self.graph(*nodes, chain="A T")
        mine = self.folder / "mine.yaml"
        rows = (
            'name: first, policy: "fifo:20", processors: [0], owns: [A]',
            'name: second, policy: "fifo:10", processors: [1], owns: [T]',
            'name: third, policy: "fifo:5", processors: [1], owns: [B]',
            "name: others, owns: rest",
        )
        mine.write_text("name: mine\nexecutors:\n" + "".join(f"  - {{{row}}}\n" for row in rows))
        out = self.accepted("analyze", graph, "--cores", 2, "--deployments", mine, "--phases", "synchronous")
        for row in "A +4.000|B +11.000|T/A +5.000|O/B +-|chain +9.000|chain +4.000\n".split("|"):
            self.assertRegex(out, "\n" + row)
        self.assertIn("No exact values: several executors are not explored", out)
        simulation = ("simulate", graph, "--cores", 2, "--deployments", f"{mine},rm-threads")
        run = self.stored(*simulation, "--duration", 2)
        compared = self.accepted("analyze", graph, "--trace", run.path)
        self.assertRegex(compared, r"\nchain +9\.000 .* 9\.000 +1\.000")
        self.assertIn("may run on several processors", compared)
        missing = "mine.yaml:4: executor second: the simulated machine has no processor 1"
        self.rejected("analyze", graph, "--deployments", mine, says=missing, out=None)

    def test_a_run_is_compared_with_bounds_for_what_ran(self) -> None:
        graph = self.graph(SENSOR.format("A", 20, 5), SENSOR.format("B", 30, 5))
        run = self.simulated(graph, "rm-ro", seconds=1, repetitions=2)
        for options, why in (
            (("--load", 10), "--load excludes --trace|--trace excludes --load"),
            (("--executors", "default"), "no bound covers its tasks under these executors; it ran rm-ro"),
            (("--phases", "synchronous"), "had other phases than these bounds assume"),
            (("--phases", run), "its repetition 1 had other phases"),
        ):
            self.assertRegex(self.rejected("analyze", graph, "--trace", run, *options, out=None), why)
        self.accepted("analyze", graph, "--trace", run)  # with the run's executors
        graph.write_text(graph.read_text().replace("execution_time_ms: 5", "execution_time_ms: 4"))
        self.rejected("analyze", graph, "--trace", run, says="the graph has changed since", out=None)

    def test_timers_that_start_far_apart_need_their_phases(self) -> None:
        nodes = [
            SENSOR.format("A", 1000, 1)[:-1] + ", phase_ms: 0}",
            SENSOR.format("B", 50, 1)[:-1] + ", phase_ms: 950}",
        ]
        nodes.append(FUSION.format("F", "A", "B", 1))
        graph = self.graph(*nodes, chain="A B F")
        run = self.simulated(graph, "fp-ro", "--warm-up", 0, seconds=3, repetitions=1, phases="given")
        apart = "start further apart than bounds for any phases cover"
        self.rejected("analyze", graph, "--trace", run, says=apart, out=None)
        bound, observed = self.rows(graph, "fp-ro", "--trace", run, "--phases", "given")["chain"]
        self.assertGreater(observed, 900)
        self.assertLessEqual(observed, bound)

    def test_the_order_of_entities_is_that_of_the_run(self) -> None:
        timers = (("A", 1003, 1, 1020.0005), ("B", 17, 10, 0), ("E", 1003, 7, 1003))
        nodes = [SENSOR.format(n, t, c)[:-1] + f", phase_ms: {f}}}" for n, t, c, f in timers]
        graph = self.graph(*nodes, TRANSFORM.format("X", "E", 20))
        run = self.simulated(
            graph, "default", "--entity-order", "reverse", seconds=3, repetitions=1, phases="given"
        )
        bound, observed = self.rows(graph, "default", "--trace", run, "--phases", "given")["A"]
        self.assertLessEqual(observed, bound)
        self.assertGreater(observed, self.rows(graph, "default", "--phases", "given")["A"][0])

    def test_another_machine_than_that_of_the_run_is_refused(self) -> None:
        run = self.simulated("sequences", "rm-ro", seconds=1, repetitions=1)
        other = ("--trace", run, "--platform", "dispatch_cost_us=5")
        self.rejected("analyze", "sequences", *other, says="leave out options that change it", out=None)
