# SPDX-License-Identifier: Apache-2.0
"""Short runs of the real command on real transports. All assertions hold on slow and noisy
machines: orders, counts, and values recomputed from the rows of jobs.csv."""

import collections
import json
import os
import subprocess
import sys
from collections.abc import Iterable
from typing import Any

from hotpath_command import CHAIN_COLUMNS, CommandTest, HOTPATH, JOB_COLUMNS, ONE, RunFolder
from known_graphs import AUTOWARE, MANY_TO_MANY, SEQUENCES, TIMERS_ONLY

from hotpath_report.run import Run

EXECUTORS = (
    "default static multi multi-jazzy multi-fair cbg events-ro events-re "
    "rm-ro rm-re dm-ro dm-re edf-ro edf-re fp-ro fp-re"
).split()
FILES = {"run.json", "summary.json", "jobs.csv", "chains.csv"}
STARTED = {"ran", "running"}
SHORT = ("--duration", 0.7, "--warm-up", 0.2)


class Repetition:
    """The jobs of one repetition of a known graph, and values derived from them."""

    def __init__(self, graph: Any, jobs: Any) -> None:
        self.graph = graph
        self.jobs = jobs
        self.of_task = collections.defaultdict(list)
        for job in jobs:
            self.of_task[job.task].append(job)
        self.started = {(j.task, j.sequence): j for j in jobs if j.outcome in STARTED}
        self.fused = self._fused()

    def started_in_order(self, node: Any) -> list[Any]:
        return sorted((j for j in self.started.values() if j.node == node), key=lambda j: j.start)

    def _fused(self) -> Any:
        """{completing job of a fusion node: the jobs whose samples it fuses}; replays upstream's
        slots."""
        fused = {}
        for node in self.graph.nodes:
            slots = {}
            for job in self.started_in_order(node.name) if node.kind == "fusion" else []:
                slots[job.topic] = job
                if len(slots) == len(node.inputs):
                    fused[job.task, job.sequence] = list(slots.values())
                    slots = {}
        return fused

    def published(self, task: Any) -> list[Any]:
        """The task's jobs that published."""
        node = next(n for n in self.graph.nodes if n.name == task.partition("/")[0])
        jobs = [key for key in self.started if key[0] == task]
        return [key for key in jobs if node.kind != "fusion" or key in self.fused]

    def sources(self, job: Any) -> Any:
        """Timer jobs whose data the job processes or publishes (up to the next cyclic node)."""
        if job.kind == "timer":
            return {job.task: job}
        found: dict[str, Any] = {}
        for contributor in self.fused.get((job.task, job.sequence), [job]):
            for task, source in self.sources(self.started[contributor.parent]).items():
                found[task] = min(found.get(task, source), source, key=lambda s: s.sequence)
        return found

    def chain_rows(self, warm_up: Any) -> list[Any]:
        """The expected rows of chains.csv, recomputed along the parents of each sink job."""
        rows = []
        for name, (sources, sink) in self.graph.chains.items():
            for job in self.started_in_order(sink):
                if job.timestamp < warm_up:
                    continue
                seen = [s for s in self.sources(job).values() if s.task in sources]
                if not seen:
                    continue
                oldest = min(s.timestamp for s in seen)
                end_to_end = job.finish - oldest if job.outcome == "ran" else None
                rows.append((name, job.sequence, job.start - max(s.start for s in seen), end_to_end))
        return sorted(rows)


class WholeProgram(CommandTest):
    timer_thread_runs_timers: set[str]
    maxDiff = 2000

    @classmethod
    def setUpClass(cls) -> None:
        listed = subprocess.run([HOTPATH, "list", "executors", "--json"], check=True, capture_output=True)
        executors = json.loads(listed.stdout)
        cls.timer_thread_runs_timers = {e["name"] for e in executors if e["timers"] == "release_and_execute"}
        assert cls.timer_thread_runs_timers, "no executor is listed as release_and_execute"

    def check(
        self,
        folder: RunFolder,
        graph: Any,
        executors: Iterable[Any] = ("rm-ro",),
        repetitions: int = 1,
        processes: int = 1,
        figures: bool = False,
    ) -> None:
        run = folder.run
        self.assertTrue(run["complete"])
        self.assertFalse(run["partial"])
        self.assertEqual(run["failures"], [])
        self.assertEqual(run["executors"], list(executors))
        pictures = {"hot_path.svg", "hot_path.png"} if figures else set()
        self.assertEqual(folder.files(), FILES | {"input_graph.yaml"} | pictures)
        self.assertEqual(folder.rows("jobs.csv")[0], JOB_COLUMNS)
        self.assertEqual(folder.rows("chains.csv")[0], CHAIN_COLUMNS)

        jobs, chains = folder.jobs(), folder.chains()
        phases = {(r["executor"], r["repetition"]): r["first_timestamps_ms"] for r in run["runs"]}
        expected = {(e, r) for e in executors for r in range(repetitions)}
        self.assertEqual(jobs.keys(), expected)
        self.assertEqual(phases.keys(), expected)
        end = round((run["duration_s"] + run["warm_up_s"]) * 1e9)
        for key in sorted(expected):
            with self.subTest(executor=key[0], repetition=key[1]):
                repetition = Repetition(graph, jobs[key])
                self.check_columns(repetition, end, run["cpu_time"])
                self.check_timers(repetition, phases[key], end)
                self.check_subscriptions(repetition)
                self.check_exclusion(repetition, key[0])
                self.check_processes(repetition, processes)
                warm_up = round(run["warm_up_s"] * 1e9)
                self.assertEqual(sorted(chains.get(key, [])), repetition.chain_rows(warm_up))
        self.check_summary(folder, jobs, chains)

    def check_columns(self, repetition: Any, end: Any, timed: bool) -> None:
        known = set(repetition.graph.timers()) | set(repetition.graph.subscriptions())
        for j in repetition.jobs:
            self.assertIn(j.task, known)
            self.assertEqual(j.kind, "subscription" if j.topic else "timer", j)
            allowed = STARTED | {"queued"} | ({"overwritten", "empty"} if j.topic else {"skipped"})
            self.assertIn(j.outcome, allowed, j)
            started = j.outcome in STARTED | {"empty"}
            for value in (j.start, j.worker, j.cpu):
                self.assertEqual(value is not None, started, j)
            self.assertEqual(j.finish is not None, j.outcome in ("ran", "empty"), j)
            self.assertEqual(j.cpu_time is not None, timed and j.outcome == "ran", j)
            instants = [i for i in (j.timestamp, j.release, j.start, j.finish) if i is not None]
            self.assertEqual(instants, sorted(instants), j)
            if started:
                self.assertIsNotNone(j.release, j)
                self.assertLess(j.start, end, j)
            if j.finish is not None:
                self.assertLessEqual(j.finish, end, j)

    def check_timers(self, repetition: Any, phases: Any, end: Any) -> None:
        """Checks that timestamps reached = ran + skipped + queued + running, each once and on the
        timer's grid."""
        periods = repetition.graph.timers()
        self.assertEqual(phases.keys(), periods.keys())
        for timer, period in periods.items():
            first = round(phases[timer] * 1e6)
            reached = list(range(first, end, period))
            rows = sorted(repetition.of_task[timer], key=lambda j: j.sequence)
            self.assertEqual([j.timestamp for j in rows], reached, timer)
            self.assertEqual([j.sequence for j in rows], list(range(len(reached))), timer)
            starts = [j.start for j in rows if j.start is not None]
            self.assertEqual(starts, sorted(starts), timer)

    def check_subscriptions(self, repetition: Any) -> None:
        """Checks that samples matched = ran + overwritten + unread + running, each once."""
        for task in repetition.graph.subscriptions():
            topic = task.partition("/")[2]
            published = []
            for publisher in repetition.graph.publishers(topic):
                published += repetition.published(publisher)
            rows = [j for j in repetition.of_task[task] if j.outcome != "empty"]
            self.assertEqual(sorted(j.parent for j in rows), sorted(published), task)
            for j in rows:
                parent = repetition.started[j.parent]
                self.assertGreaterEqual(j.timestamp, parent.start, j)
                if parent.finish is not None:
                    self.assertLessEqual(j.timestamp, parent.finish, j)

    def check_exclusion(self, repetition: Any, executor: str) -> None:
        """Checks that jobs of one worker never overlap, nor jobs of one node (a mutually exclusive
        callback group), unless the timer thread runs timers."""
        groups = collections.defaultdict(list)
        for j in repetition.started.values():
            groups[f"worker {j.worker} of process {j.process}"].append(j)
            if executor.partition(":")[0] not in self.timer_thread_runs_timers:
                groups[j.node].append(j)
        for name, jobs in groups.items():
            jobs.sort(key=lambda j: j.start)
            for earlier, later in zip(jobs, jobs[1:]):
                self.assertEqual(earlier.outcome, "ran", name)
                self.assertLessEqual(earlier.finish, later.start, f"{name}: {earlier}, {later}")

    def check_processes(self, repetition: Any, processes: Any) -> None:
        """Checks that each process has a contiguous share of the nodes, in creation order."""
        nodes = repetition.graph.nodes
        process = {n.name: i * processes // len(nodes) for i, n in enumerate(nodes)}
        for j in repetition.jobs:
            self.assertEqual(j.process, process[j.node], j)

    def check_summary(self, folder: RunFolder, jobs: Any, chains: Any) -> None:
        self.assertEqual([e["executor"] for e in folder.summary()["executors"]], folder.run["executors"])
        for executor in folder.summary()["executors"]:
            name = executor["executor"]
            self.assertTrue(executor["loss_equations"]["hold"], executor["loss_equations"])
            self.assertEqual(executor["lost_records"], 0)
            own = [j for (e, _), rows in jobs.items() if e == name for j in rows]
            count = collections.Counter(j.outcome for j in own)
            self.assertEqual(executor["callbacks_executed"], count["ran"])
            self.assertEqual(executor["skipped"], count["skipped"])
            self.assertEqual(executor["overwritten"], count["overwritten"])
            rows = [row[0] for (e, _), found in chains.items() if e == name for row in found]
            self.assertLessEqual(set(rows), {chain["chain"] for chain in executor["chains"]})
            for chain in executor["chains"]:
                self.assertEqual(chain["hot_path_latency_ms"]["n"], rows.count(chain["chain"]))

    def test_autoware_on_fastdds_with_figure(self) -> None:
        del self.environment["HOTPATH_FIGURES"]
        folder = self.measure("run", *ONE, *SHORT)
        self.check(folder, AUTOWARE, figures=True)
        self.assertEqual(folder.run["transport"], "fastdds")
        self.assertGreater(len(folder.chains()["rm-ro", 0]), 0)

    def test_autoware_in_two_processes_over_udp(self) -> None:
        folder = self.measure("run", *ONE, "--processes", 2, "--network", "udp", *SHORT)
        self.check(folder, AUTOWARE, processes=2)

    def test_autoware_in_two_processes_over_shared_memory(self) -> None:
        folder = self.measure(
            "run",
            "--executors",
            "events-ro",
            "--repetitions",
            1,
            "--processes",
            2,
            "--network",
            "shared_memory",
            *SHORT,
        )
        self.check(folder, AUTOWARE, ["events-ro"], processes=2)

    def test_every_executor_on_autoware_in_one_process(self) -> None:
        folder = self.measure(
            "compare", "--executors", "all", "--transport", "intra_process", "--repetitions", 1,
            "--load", 20, "--duration", 0.3, "--warm-up", 0.1,
        )  # fmt: skip
        self.check(folder, AUTOWARE, EXECUTORS)

    def test_overload_loses_timestamps_and_samples_but_accounts_for_them(self) -> None:
        folder = self.measure(
            "compare", "--executors", "default,events-re,rm-ro", "--load", 200, "--repetitions", 1, *SHORT
        )
        self.check(folder, AUTOWARE, ["default", "events-re", "rm-ro"])
        lost = [j for rows in folder.jobs().values() for j in rows if j.outcome in ("skipped", "overwritten")]
        self.assertGreater(len(lost), 0)

    def test_sequences_repeated_with_variants(self) -> None:
        executors = ["edf-ro", "rm-re:first", "multi:3"]
        folder = self.measure(
            "compare", "--graph", "sequences", "--executors", ",".join(executors), "--repetitions", 2,
            "--transport", "intra_process", "--duration", 0.4, "--warm-up", 0,
        )  # fmt: skip
        self.check(folder, SEQUENCES, executors, repetitions=2)
        self.assertLessEqual({j.worker for j in folder.jobs()["multi:3", 0]} - {None}, {0, 1, 2})

    def test_many_to_many_on_fastdds(self) -> None:
        self.check(self.measure("run", *ONE, "--graph", "many_to_many", *SHORT), MANY_TO_MANY)

    def test_timers_only_has_no_chain_and_no_figure(self) -> None:
        executors = ["default", "dm-ro"]
        folder = self.measure(
            "compare", "--graph", "timers_only_60", "--executors", ",".join(executors), "--repetitions", 1,
            "--phases", "synchronous", "--duration", 0.5, "--warm-up", 0,
        )  # fmt: skip
        self.check(folder, TIMERS_ONLY, executors)
        self.assertEqual(folder.chains(), {})

    def test_jobs_work_for_an_amount_of_cpu_time_by_default(self) -> None:
        """4.2 ms, whatever the processor's speed; only a fixed amount of work is calibrated."""
        short = ("run", *ONE, "--transport", "intra_process", "--duration", 0.3, "--warm-up", 0)
        folder = self.measure(*short)
        self.assertEqual(folder.run["work"], "cpu_time")
        self.assertNotIn("calibration", folder.run)
        transformers = ("PointsTransformerFront/FrontLidarDriver", "PointsTransformerRear/RearLidarDriver")
        ran = [j for rows in folder.jobs().values() for j in rows if j.outcome == "ran"]
        times = [j.cpu_time for j in ran if j.task in transformers]
        self.assertGreater(len(times), 0)
        for time in times:
            self.assertGreaterEqual(time, 4_200_000)
        self.accepted(*short, "--work", "fixed", "--output", self.folder / "fixed")
        self.assertIn("calibration", json.loads((self.folder / "fixed" / "run.json").read_text()))

    def test_other_processes_disturb_a_repetition(self) -> None:
        cpu = max(os.sched_getaffinity(0))
        spin = f"import os\nos.sched_setaffinity(0, {{{cpu}}})\nprint(flush=True)\nwhile True: pass"
        with subprocess.Popen([sys.executable, "-c", spin], stdout=subprocess.PIPE) as other:
            self.addCleanup(other.kill)
            if other.stdout is not None:
                other.stdout.readline()
            output = self.folder / "disturbed"
            options = ("--transport", "intra_process", "--cpus", cpu, *SHORT, "--output", output)
            table = self.accepted("run", *ONE, *options)
            other.kill()
        self.assertRegex(table, r"Disturbed: rm-ro, repetition 0: .*% of the time used by other processes")
        reported = Run(output)
        ((executor, repetition, marks),) = reported.disturbances()
        self.assertEqual((executor, repetition), ("rm-ro", 0))
        self.assertRegex(marks[-1], "used by other processes")
        self.assertIn("1 of 1 repetitions disturbed", reported.what_ran())
        self.assertIn("work in CPU time", reported.what_ran())
        before = (output / "summary.json").read_text()
        (output / "summary.json").unlink()
        self.assertIn("Disturbed: rm-ro, repetition 0", self.accepted("report", "--summary", output))
        self.assertEqual((output / "summary.json").read_text(), before)
