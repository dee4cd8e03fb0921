# SPDX-License-Identifier: Apache-2.0
"""`hotpath simulate` as a user starts it: every executor on every graph, repeatable bytes, wrong
use."""

import json
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from hotpath_command import CommandTest, RunFolder, document, executors

GRAPHS = (
    ["autoware", "callbacks", "many_to_many", "sequences", "sequences_high_utilisation"]
    + [f"timers_only_{level}" for level in (60, 80, 90)]
    + [f"timers_only_{level}_authors" for level in (60, 80, 90)]
)
REFERENCE_SYSTEM = Path(__file__).resolve().parents[2] / "reference_system"
TRACES = REFERENCE_SYSTEM / "ros2_reference" / "traces"
NS = 1e6  # per ms
BRIEF = ("--duration", 3, "--warm-up", 0)
TINY_CHAIN = """name: tiny_chain
nodes:
  - {name: S, type: sensor, period_ms: %s}
  - {name: T, type: transform, input: S, execution_time_ms: %s}
  - {name: C, type: command, input: T}
chains:
  - {name: path, nodes: [S, T, C], sources: [S], sink: C}
"""


class SimulateTest(CommandTest):
    def simulate(self, *arguments: object, output: str = "run") -> RunFolder:
        return self.stored("simulate", *arguments, output=output)

    def files(self, run: Any, *names: str) -> dict[Any, Any]:
        return {name: (run.path / name).read_bytes() for name in names}


class Experiments(SimulateTest):
    def test_every_executor_on_every_graph(self) -> None:
        for graph in GRAPHS:
            with self.subTest(graph=graph):
                run = self.simulate("--graph", graph, "--executors", "all", *BRIEF, output=graph)
                self.assertTrue(run.run["complete"])
                self.assertEqual(run.run["kind"], "simulated")
                self.assertEqual([e["executor"] for e in run.summary()["executors"]], [*executors()])
                self.assertTrue(run.accounts_for_all())
                for executor in run.summary()["executors"]:
                    self.assertGreater(executor["callbacks_executed"], 100)

    def test_same_seed_same_bytes_whatever_the_number_of_threads(self) -> None:
        options: Any = ("--executors", "default,multi,rm-ro,edf-re", "--repetitions", 3, "--phases", "random")
        options += ("--execution-times", "uniform", "--seed", 5, *BRIEF)
        names = ("run.json", "jobs.csv", "chains.csv", "summary.json")
        one = self.files(self.simulate(*options, "--threads", 1, output="one"), *names)
        self.assertEqual(one, self.files(self.simulate(*options, "--threads", 7, output="seven"), *names))
        other = self.simulate(*options[:-6], "--seed", 6, *BRIEF, output="other_seed")
        self.assertNotEqual(one["jobs.csv"], self.files(other, "jobs.csv")["jobs.csv"])

    def test_the_platform_of_a_graph_is_what_options_override(self) -> None:
        platform = (
            "platform: {cores: 2, dispatch_cost_us: 10, delivery_delay_us: 100, execution_times: uniform}\n"
        )
        graph = self.written("platform.yaml", TINY_CHAIN % (10, 4) + platform)
        run = self.simulate("--graph", graph, "--executors", "events-ro", *BRIEF, output="file")
        self.assertEqual(run.run["platform"]["dispatch_cost_us"], 10)
        options = ("--cores", 1, "--platform", "dispatch_cost_us=0", "--execution-times", "worst")
        over = self.simulate("--graph", graph, "--executors", "events-ro", *options, *BRIEF, output="options")
        for found, cores, times, latency in ((run, 2, "uniform", 4_220_000), (over, 1, "worst", 4_200_000)):
            self.assertEqual((found.run["platform"]["cores"], found.run["execution_times"]), (cores, times))
            (chains,) = found.chains().values()
            self.assertEqual({output[2] for output in chains}, {latency})
        out = self.accepted("graph", graph)
        self.assertIn("2 cores, timer thread by_executor, execution times uniform, dispatch_cost_us 10", out)

    def test_without_trace_the_counts_are_the_same(self) -> None:
        options = ("--executors", "default,rm-ro", "--repetitions", 2, "--phases", "random", "--duration", 5)
        kept = self.simulate(*options, output="kept").summary()["executors"]
        run = self.simulate(*options, "--no-trace", output="not_kept")
        self.assertNotIn("jobs.csv", run.files())
        exact = {"response_ms": "n min max", "period_ms": "n min max", "period_deviation_ms": "n min max"}
        for a, b in zip(kept, run.summary()["executors"], strict=True):
            for key in "callbacks_executed skipped overwritten deadline_overruns loss_equations".split():
                self.assertEqual(a[key], b[key], key)
            for latency in ("hot_path_latency_ms", "end_to_end_latency_ms"):
                self.assertEqual(a["chains"][0][latency], b["chains"][0][latency])
                self.assertGreater(a["chains"][0][latency]["n"], 30)
            for task_a, task_b in zip(a["tasks"], b["tasks"], strict=True):
                self.assertEqual(task_a["longest_wait_ms"], task_b["longest_wait_ms"])
                for measure, keys in exact.items():
                    self.assertEqual(measure in task_a, measure in task_b, measure)
                    if measure not in task_a:
                        continue
                    for key in keys.split():
                        self.assertEqual(task_a[measure][key], task_b[measure][key], (measure, key))
                    if measure != "response_ms":
                        self.assertAlmostEqual(task_a[measure]["mean"], task_b[measure]["mean"])


class Timeline(SimulateTest):
    def assert_chrome_trace(self, text: str) -> None:
        """Reads the object form of the Trace Event Format like an importer: events are sorted by
        `ts`, ties keep the order of the file, and the end of a flow binds to the latest slice of
        its thread."""
        trace = json.loads(text)
        self.assertEqual(set(trace), {"displayTimeUnit", "traceEvents"})
        keys = {
            "M": {"ph", "name", "pid", "args"},
            "X": {"ph", "name", "cat", "pid", "tid", "ts", "dur", "args"},
            "i": {"ph", "name", "cat", "pid", "tid", "ts", "s"},
            "s": {"ph", "name", "cat", "pid", "tid", "ts", "id", "bp"},
            "f": {"ph", "name", "cat", "pid", "tid", "ts", "id", "bp"},
        }
        named: set[Any] = set()
        slices: dict[Any, Any] = {}
        begun: dict[Any, Any] = {}
        ended: dict[Any, Any] = {}
        for e in trace["traceEvents"]:
            self.assertEqual(set(e) - {"tid"}, keys[e["ph"]] - {"tid"})
            self.assertGreater(e["pid"], 0, "0 is the idle process")
            thread = (e["pid"], e.get("tid"))
            if e["ph"] == "M":
                named.add(thread)
                continue
            self.assertIn(thread, named)
            self.assertGreaterEqual(e["ts"], 0)
            if e["ph"] == "X":
                before = slices.get(thread)
                if before:
                    self.assertGreaterEqual(round(e["ts"], 3), round(before["ts"] + before["dur"], 3))
                self.assertGreaterEqual(e["dur"], 0)
                slices[thread] = e
            elif e["ph"] in "sf":
                ends = begun if e["ph"] == "s" else ended
                self.assertNotIn(e["id"], ends)
                self.assertEqual(e["ts"], slices[thread]["ts"])
                ends[e["id"]] = slices[thread]
        self.assertEqual(set(begun), set(ended))
        for flow, end in ended.items():
            self.assertGreaterEqual(end["ts"], begun[flow]["ts"])

    def test_perfetto_trace_has_every_job_and_the_flows_between_them(self) -> None:
        graph = self.written("chain.yaml", TINY_CHAIN % (10, 4))
        run = self.simulate("--graph", graph, "--executors", "events-ro,rm-re", *BRIEF)
        file = self.folder / "trace.json"
        out = self.accepted("export", "perfetto", run.path, "--executors", "rm-re", "--output", file)
        self.assertEqual(out, f"{file}\n")
        self.assert_chrome_trace(file.read_text())
        events = json.loads(file.read_text())["traceEvents"]
        slices = [e for e in events if e["ph"] == "X"]
        jobs = [j for j in run.jobs()[("rm-re", 0)] if j.outcome == "ran"]
        self.assertEqual(len(slices), len(jobs))
        for job, of_job in zip(jobs, slices):
            self.assertEqual((job.task, job.start), (of_job["name"], round(of_job["ts"] * 1000)))
            self.assertEqual(job.finish - job.start, round(of_job["dur"] * 1000))
        starts, ends = ({e["id"] for e in events if e["ph"] == phase} for phase in "sf")
        self.assertEqual(starts, ends)
        self.assertEqual(len(starts), sum(job.parent is not None for job in jobs))

    def test_perfetto_trace_names_the_threads_that_run_jobs(self) -> None:
        named = {
            "cbg:2": ["executor thread"] * 2,
            "rm-ro": ["executor thread"],
            "rm-re": ["executor thread", "timer management thread"],
            "multi:2": ["worker 0", "worker 1"],
        }
        run = self.simulate("--graph", "sequences", "--executors", ",".join(named), "--cores", 2, *BRIEF)
        file = self.folder / "trace.json"
        for executor, names in named.items():
            self.accepted("export", "perfetto", run.path, "--executors", executor, "--output", file)
            threads = [e for e in json.loads(file.read_text())["traceEvents"] if e["name"] == "thread_name"]
            self.assertEqual([e["args"]["name"] for e in sorted(threads, key=itemgetter("tid"))], names)


class Validate(SimulateTest):
    def test_reference_and_a_run_against_their_simulations(self) -> None:
        run = self.simulate(
            *("--executors", "default,rm-re,edf-ro", "--phases", "random"),
            *("--execution-times", "uniform", *BRIEF),
        )
        out = self.accepted("paper", "golden", "--output", self.folder / "v")
        result = document(self.folder / "v" / "validation.json")
        golden = {(g["set"], g["executor"]): g for g in result["golden"]}
        self.assertEqual(len(golden), 18)
        for (name, executor), g in golden.items():
            costs = g["with_costs"]
            key = "similarity_by_period" if executor == "rm-ro" else "similarity"
            self.assertGreaterEqual(costs[key], 0.98, (name, executor))
            self.assertLessEqual(costs["largest_loss_difference_percent"], 2, (name, executor))
        for entry in result["autoware"]:
            ratio = entry["simulated_ms"]["p50"] / entry["measured_ms"]["p50"]
            self.assertAlmostEqual(ratio, 1, delta=0.10 if entry["executor"] == "multi" else 0.05)
        self.assertIn("which depends on the fork's heap", out)
        # A simulated run is predicted exactly, preempted jobs included.
        self.accepted("diff", run.path, "--simulated", "--output", "of_run")
        result = document(self.folder / "of_run" / "validation.json")
        for entry in result["runs"]:
            self.assertEqual(entry["comparison"]["similarity"], 1, entry["executor"])
            self.assertIsNone(entry["comparison"]["first_difference"])
            self.assertEqual(entry["latencies"]["measured_ms"], entry["latencies"]["simulated_ms"])

    def test_a_run_with_the_phases_of_a_golden_trace_is_shown_beside_it(self) -> None:
        trace = TRACES / "timers_only_80.edf-ro.csv"
        options = "--graph timers_only_80 --executors edf-ro,dm-re --duration 10 --warm-up 0".split()
        same = self.simulate(*options, "--phases", trace, output="same")
        other = self.simulate(*options, "--phases", "synchronous", output="other")
        out = self.accepted("diff", same.path, other.path, "--simulated", "--output", self.folder / "v")
        runs = document(self.folder / "v" / "validation.json")["runs"]
        beside = [(r["executor"], r["golden"] is not None) for r in runs]
        self.assertEqual(beside, [("edf-ro", True), ("dm-re", False)] * 2)
        golden, differs = runs[0]["golden"], runs[2]["golden"]["phases_differ_ms"]
        self.assertEqual((golden["phases_differ_ms"], golden["comparison"]["similarity"]), (0, 1))
        self.assertIn("similarity of order 1.000, lost jobs within 0.0 points.", out)
        for quantity in ("start_lateness_ms", "response_ms", "response_authors_ms"):
            real, live = (golden["comparison"][side][quantity]["p50"] for side in ("measured", "other"))
            self.assertAlmostEqual(real, live, delta=0.5)
        self.assertGreater(differs, 10)
        self.assertIn("--phases timers_only_80.edf-ro.csv", out)


def start_distances(run: RunFolder, executor: str, task: str) -> list[int]:
    """Nanoseconds between the starts of consecutive counted jobs, over all repetitions."""
    warm_up = run.run["warm_up_s"] * 1e9
    distances = []
    for (name, _), jobs in run.jobs().items():
        starts = [
            (job.sequence, job.start)
            for job in jobs
            if name == executor and job.task == task and job.outcome == "ran" and job.timestamp >= warm_up
        ]
        starts.sort()
        distances += [after[1] - before[1] for before, after in zip(starts, starts[1:], strict=False)]
    return distances


class Periods(SimulateTest):
    """Period jitter of timers, computed a second time from jobs.csv, and in advice."""

    def check_periods(self, run: RunFolder) -> int:
        """Compares summary.json with jobs.csv; returns the number of timers with two jobs."""
        seen = 0
        for executor in run.summary()["executors"]:
            for task in executor["tasks"]:
                if task["kind"] != "timer":
                    self.assertNotIn("period_ms", task)
                    continue
                period = next(t["period_ns"] for t in run.run["tasks"] if t["task"] == task["task"]) / NS
                distances = start_distances(run, executor["executor"], task["task"])
                self.assertEqual(task["period_ms"]["n"], len(distances), task["task"])
                if not distances:
                    continue
                seen += 1
                off = [abs(d / NS - period) for d in distances]
                p99 = float(np.percentile(off, 99))
                expected = [min(distances) / NS, max(distances) / NS, p99, max(off)]
                found = [task["period_ms"]["min"], task["period_ms"]["max"]]
                found += [task["period_deviation_ms"]["p99"], task["period_deviation_ms"]["max"]]
                for a, b in zip(found, expected, strict=True):
                    self.assertAlmostEqual(a, b, places=6, msg=task["task"])
        return seen

    def test_simulated_runs(self) -> None:
        run = self.measure(
            *("simulate", "--executors", "default,rm-ro,rm-re", "--duration", 5, "--warm-up", 0.5),
            *("--repetitions", 2, "--phases", "random"),
        )
        self.assertGreaterEqual(self.check_periods(run), 21)

    def test_advice_names_who_pays(self) -> None:
        """The recommended executor delays a slow timer that today's executor serves in turn."""
        words = "autoware --executors default,rm-ro --repetitions 2 --duration 5 --phases creation".split()
        self.accepted("advise", *words, "--output", "advice")
        advice = document(self.folder / "advice" / "advice.json")
        rows = {row["name"]: row["periods_ms"] for row in advice["ranking"]}
        now, best = rows[advice["now"]], rows[advice["recommended"]]
        growth = {
            timer: (values["greatest"] - values["least"] - now[timer]["greatest"] + now[timer]["least"])
            / values["period"]
            for timer, values in best.items()
        }
        sentence = next(s for s in advice["sentences"] if "imer" in s and "pay" in s)
        payers = sorted((t for t in growth if growth[t] > 0.05), key=lambda t: -growth[t])
        if not payers:
            self.assertIn("No timer pays", sentence)
            return
        self.assertIn("Timers pay for it: " + payers[0], sentence)
        before, after = (v[payers[0]]["greatest"] - v[payers[0]]["least"] for v in (now, best))
        self.assertIn(f"varies by {after:.1f} ms instead of {before:.1f} ms", sentence)


class RecordedGraphs(SimulateTest):
    def test_the_recorded_graphs_ship(self) -> None:
        listed = self.accepted("list", "graphs")
        for name in ("autoware_universe", "cedar", "mont_blanc", "sierra_nevada", "white_mountain"):
            self.assertRegex(listed, rf"(?m)^{name} ")

    def test_autoware_universe_is_predicted_as_caret_measured_it(self) -> None:
        """Compares p50 and p99 with the end-to-end best case of stats_path.yaml, under the recorded
        executors."""
        measured = {
            "component_sensing_0": (83.672, 121.902),
            "component_localization_0": (44.722, 77.603),
            "component_control_0": (2.157, 5.751),
            "e2e_sensing-to-localization_0": (117.300, 169.257),
            # The report's files lack this one.
            "component_planning_0": (30.6, 92.7),
        }
        deployment = REFERENCE_SYSTEM / "graphs" / "recorded" / "deployments" / "autoware_universe.yaml"
        words = "--graph autoware_universe --phases random --repetitions 5 --duration 40".split()
        run = self.measure("simulate", *words, "--deployments", deployment)
        (executor,) = run.summary()["executors"]
        predicted = {c["chain"]: c["end_to_end_latency_ms"] for c in executor["chains"]}
        for chain, (p50, p99) in measured.items():
            self.assertLess(abs(predicted[chain]["p50"] / p50 - 1), 0.15, chain)
            self.assertLess(abs(predicted[chain]["p99"] / p99 - 1), 0.15, chain)


class StoredRuns(SimulateTest):
    def test_the_summary_of_a_stored_run_is_that_of_the_run(self) -> None:
        """Holds for any order of the repetitions in the files: live runs interleave them."""
        for graph in ("autoware", "timers_only_90"):
            several = ("--executors", "default,rm-ro,events-ro", "--repetitions", 2, "--phases", "random")
            run = self.simulate("--graph", graph, *several, "--duration", 3, "--warm-up", 0.5, output=graph)
            summary = (run.path / "summary.json").read_bytes()
            asked = f"echo '{json.dumps(['responses', str(run.path)])}' |"
            responses = self.accepted("feed", given=asked)
            golden = ["golden", str(REFERENCE_SYSTEM / "ros2_reference/traces/timers_only_60.default.csv")]
            others = f"echo '{json.dumps(['page', [str(run.path)]])}\n{json.dumps(golden)}' |"
            for answer in (responses, *self.accepted("feed", given=others).splitlines()):
                self.assertIn("answer", document(Path("feed.json"), answer))
            files = {}
            for name in ("jobs.csv", "chains.csv"):
                header, *rows = (run.path / name).read_text().splitlines()
                blocks: dict[Any, Any] = {}
                for row in rows:
                    blocks.setdefault(tuple(row.split(",")[:2]), []).append(row)
                files[name] = header, blocks
            for order in (lambda key: key, lambda key: (-int(key[1]), key[0]), lambda key: key[::-1]):
                for name, (header, blocks) in files.items():
                    rows = [row for key in sorted(blocks, key=order) for row in blocks[key]]
                    (run.path / name).write_text("\n".join([header, *rows]) + "\n")
                (run.path / "summary.json").unlink()
                self.accepted("report", "--summary", run.path)
                self.assertEqual((run.path / "summary.json").read_bytes(), summary)
                again = (
                    json.loads(answer)["answer"] for answer in (self.accepted("feed", given=asked), responses)
                )
                self.assertEqual(*(sorted(rows, key=itemgetter("executor", "repetition")) for rows in again))

    def test_a_row_of_another_run_is_named_with_its_line(self) -> None:
        run = self.simulate("--executors", "rm-ro", *BRIEF)
        header, first, *rows = (run.path / "chains.csv").read_text().splitlines()
        executor, repetition, *cells = first.split(",")
        for other, says in (
            ([executor, "7", *cells], "no such repetition of `rm-ro`"),
            ([executor, repetition, "elsewhere", *cells[1:]], "no chain `elsewhere`"),
        ):
            (run.path / "chains.csv").write_text("\n".join([header, first, ",".join(other), *rows]) + "\n")
            self.rejected("report", "--summary", run.path, says=("chains.csv:3: ", says))
