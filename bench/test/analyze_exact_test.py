# SPDX-License-Identifier: Apache-2.0
"""hotpath analyze: the exact worst cases of known phases, and their witnesses."""

import json
import signal
from pathlib import Path

from analyze_case import FUSION, RANGE, SENSOR, AnalyzeCase
from hotpath_command import csv_rows


class ExactTest(AnalyzeCase):
    """Each case is a graph whose phases are known."""

    def test_an_overload_is_never_schedulable(self) -> None:
        graph = self.graph(SENSOR.format("A", 10, 6), SENSOR.format("B", 20, 12))
        out = self.accepted("analyze", graph, "--executors", "rm-ro", "--exact", "--phases", "synchronous")
        self.assertNotIn("Schedulable", out)
        self.assertIn("the timers alone overload the thread", out)

    def test_the_exact_worst_case_of_known_phases(self) -> None:
        own = [
            *(SENSOR.format(name, f"20, priority: {k}", 1) for name, k in (("A", 1), ("B", 2))),
            "{name: X, type: transform, input: {topic: A, priority: 9}, execution_time_ms: 3}",
            "{name: Y, type: transform, input: {topic: B, priority: 9}, execution_time_ms: 5}",
        ]
        sparse = [
            "{name: A, type: callbacks, callbacks: "
            "[{timer: a, period_ms: 10, priority: 1, execution_time_ms: 1, publishes: {topic: t, every: 2}}]}",
            "{name: T, type: transform, input: t, execution_time_ms: 4}",
        ]
        for nodes, why in ((own, r"\nB +2\.000 "), (sparse, r"\nA/a +1\.000 ")):
            exact = ("--executors", "fp-ro", "--phases", "synchronous", "--exact")
            out = self.accepted("analyze", self.graph(*nodes), *exact)
            self.assertRegex(out.partition("exploration: exact")[2], why)

    def test_a_witness_reaches_the_exact_worst_case(self) -> None:
        nodes = [SENSOR.format("A", 20, 2), SENSOR.format("B", 30, 3), FUSION.format("F", "A", "B", 5)]
        nodes.append(
            "{name: C, type: callbacks, callbacks: [{timer: t, period_ms: 60, release_jitter_ms: 3, "
            "execution_time_ms: {min: 1, max: 9}}, {subscription: F, execution_time_ms: 1}]}"
        )
        graph, folder, table = self.graph(*nodes, chain="A B F"), self.folder / "w", self.folder / "w.csv"
        exact = ("analyze", graph, "--executors", "rm-ro:fifo", "--exact", "--csv", table, "--witness")
        self.accepted(*exact, folder, "--phases", "synchronous")
        rows = [row for row in csv_rows(table) if "exact" in row["method"] and row["bound_ns"]]
        names = {"task": "response", "chain": "age", "hot_path": "hot_path"}
        self.assertEqual({row["kind"] for row in rows}, set(names))
        for row in rows:
            run = folder / "rm-ro:fifo" / f"{names[row['kind']]}_{row['name'].replace('/', '_')}"
            worst = int(row["bound_ns"])
            latency = {"chain": "end_to_end_latency_ns", "hot_path": "hot_path_latency_ns"}.get(row["kind"])
            if latency:
                reached = [int(chain[latency]) for chain in csv_rows(run / "chains.csv")]
            else:
                ran = (row["name"], "ran")
                jobs = [j for j in csv_rows(run / "jobs.csv") if (j["task"], j["outcome"]) == ran]
                reached = [int(j["finish_ns"]) - int(j["timestamp_ns"]) for j in jobs]
            self.assertEqual(max(reached), worst, row)
            again = self.folder / f"again_{run.name}"
            self.accepted(*json.loads((run / "run.json").read_text())["command"], "--output", again)
            for stored in ("run.json", "jobs.csv", "chains.csv"):
                self.assertEqual((again / stored).read_bytes(), (run / stored).read_bytes())
            self.assertIn("a valid schedule", self.accepted("doctor", run))
        self.accepted("report", folder / "rm-ro:fifo" / "age_chain")
        self.rejected(*exact, self.folder / "w2", says="give --phases", out=None)

    def test_jittery_runs_stay_within_exact_values_and_repeat(self) -> None:
        nodes = [SENSOR.format("A", "20, release_jitter_ms: 5", 2), SENSOR.format("B", 30, 3)]
        graph = self.graph(*nodes, FUSION.format("F", "A", "B", 5), chain="A B F")
        system = "--executors default,events-ro --phases synchronous --warm-up 0"
        options = ("--graph", graph, *system.split())
        first, second = self.folder / "first", self.folder / "second"
        for run, seed in ((first, 1), (second, 2)):
            self.accepted("simulate", *options, "--seed", seed, "--duration", 3, "--output", run)
        self.assertNotEqual((first / "jobs.csv").read_bytes(), (second / "jobs.csv").read_bytes())
        again = self.folder / "again"
        self.accepted("simulate", *options, "--seed", 1, "--duration", 3, "--output", again)
        self.assertEqual((first / "jobs.csv").read_bytes(), (again / "jobs.csv").read_bytes())
        out = self.accepted("analyze", graph, "--trace", first, "--phases", "synchronous")
        self.assertIn("exploration: exact for these phases", out)
        self.assertIn("busy windows in any order", out)
        self.assertIn("a valid schedule", self.accepted("doctor", first))
        self.accepted("diff", first, "--simulated")
        self.accepted("explain", first, "--executors", "default")

    def test_bounds_near_phases_exceed_the_exact_values_and_refuse_deadlines(self) -> None:
        graph = self.graph(
            RANGE.format("A", 20, "{min: 1, max: 8}"), RANGE.format("B", 30, "{min: 1, max: 9}")
        )
        table = self.folder / "near.csv"
        known = ("analyze", graph, "--executors", "rm-ro,edf-ro", "--phases", "synchronous", "--csv", table)

        def explored(*options: str | int) -> dict[str, int]:
            self.accepted(*known, *options)
            rows = [row for row in csv_rows(table) if row["method"].startswith("exploration")]
            return {row["name"]: int(row["bound_ns"]) for row in rows if row["executor"] == "rm-ro"}

        # All is 0.5 ms later, since no phase precedes the beginning: A, released at 1 ms, may wait for B,
        # released 1 ns earlier, and B for A.
        self.assertEqual(explored(), {"A/t": 8_000_000, "B/t": 17_000_000})
        self.assertEqual(explored("--phase-uncertainty-us", 500), {"A/t": 17_999_999, "B/t": 18_000_000})
        out = self.accepted(*known, "--phase-uncertainty-us", 500)
        self.assertIn("exploration: bound near these phases", out)
        self.assertIn("it does not cover uncertain phases under an order by deadlines", out)
        out = self.accepted(*known, "--phase-uncertainty-us", 20_000)
        self.assertIn("timer A/t may be off by its period", out)

    def test_exact_values_have_a_limit_of_states(self) -> None:
        few = self.graph(RANGE.format("A", 20, "{min: 1, max: 8}"), RANGE.format("B", 30, "{min: 1, max: 9}"))
        known = ("--executors", "default", "--phases", "synchronous")
        self.assertIn("exploration: exact for these phases", self.accepted("analyze", few, *known))
        self.assertNotIn("xact", self.accepted("analyze", few, *known[:2]))
        unknown = self.accepted("analyze", few, *known[:2], "--exact")
        self.assertIn("No exact values: worst cases are exact for known phases only", unknown)
        for periods, why in (
            ((10.000019, 7.919), "there are more than 50000 states; --exact allows more"),
            ((9.999991, 9.999973, 8.999993), "no common multiple of their periods below 36 years"),
        ):
            nodes = [RANGE.format(f"N{p}".replace(".", "_"), p, "{min: 0.1, max: 2}") for p in periods]
            out = self.accepted("analyze", self.graph(*nodes), *known)
            self.assertIn("processing windows", out)
            self.assertRegex(out, "No exact values: .*" + why)

    def test_an_interrupt_leaves_the_bounds(self) -> None:
        nodes = [RANGE.format("A", 10.000019, "{min: 0.1, max: 2}"), RANGE.format("B", 7.919, 1)]
        words = "--executors default,rm-ro --phases synchronous --exact"
        process = self.start("analyze", self.graph(*nodes), *words.split())
        stat = Path(f"/proc/{process.pid}/stat")
        self.wait_for(lambda: int(stat.read_text().rpartition(")")[2].split()[11]) > 50, "it does not work")
        process.send_signal(signal.SIGINT)
        code, out, _ = self.finish(process)
        self.assertEqual(code, 128 + signal.SIGINT)
        self.assertEqual(out.count("No exact values: it was interrupted"), 2)
        self.assertIn("processing windows", out)
