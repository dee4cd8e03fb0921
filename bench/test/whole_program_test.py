# SPDX-License-Identifier: Apache-2.0
"""Short runs of the real command on real transports, whose schedules `hotpath check` accepts. All
assertions hold on slow and noisy machines."""

import collections
import json
import os
import subprocess
import sys
from collections.abc import Iterable
from typing import Any

from hotpath_command import CHAIN_COLUMNS, JOB_COLUMNS, ONE, CommandTest, RunFolder, executors

from hotpath_report.run import Run

FILES = {"run.json", "summary.json", "jobs.csv", "chains.csv"}
STARTED = {"ran", "running"}
SHORT = ("--duration", 0.7, "--warm-up", 0.2)


class WholeProgram(CommandTest):
    maxDiff = 2000

    def check(
        self,
        folder: RunFolder,
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
        for name, columns in (("jobs.csv", JOB_COLUMNS), ("chains.csv", CHAIN_COLUMNS)):
            with open(folder.path / name, encoding="utf-8") as file:
                self.assertEqual(file.readline(), ",".join(columns) + "\n")

        jobs, chains = folder.jobs(), folder.chains()
        phases = {(r["executor"], r["repetition"]): r["first_timestamps_ms"] for r in run["runs"]}
        expected = {(e, r) for e in executors for r in range(repetitions)}
        self.assertEqual(jobs.keys(), expected)
        self.assertEqual(phases.keys(), expected)
        for key in sorted(expected):
            with self.subTest(executor=key[0], repetition=key[1]):
                self.check_exclusion(jobs[key], key[0])
                self.check_chains(jobs[key], chains.get(key, []))
                self.assertEqual({j.process for j in jobs[key]}, set(range(processes)))
        self.check_summary(folder, jobs, chains)

    def check_exclusion(self, jobs: Any, executor: str) -> None:
        """Checks that jobs of one node (a mutually exclusive callback group) never overlap, unless the
        timer thread runs timers."""
        if executors()[executor.partition(":")[0]]["timers"] == "release_and_execute":
            return
        groups = collections.defaultdict(list)
        for j in jobs:
            if j.outcome in STARTED:
                groups[j.node].append(j)
        for name, of_node in groups.items():
            of_node.sort(key=lambda j: j.start)
            for earlier, later in zip(of_node, of_node[1:]):
                self.assertEqual(earlier.outcome, "ran", name)
                self.assertLessEqual(earlier.finish, later.start, f"{name}: {earlier}, {later}")

    def check_chains(self, jobs: Any, chains: Any) -> None:
        """Checks that the outputs are started jobs whose data began no later than they did."""
        starts = {j.sequence: j.start for j in jobs if j.outcome in STARTED}
        self.assertEqual(len({(chain, sequence) for chain, sequence, _, _ in chains}), len(chains))
        for _, sequence, latency, end_to_end in chains:
            self.assertIn(sequence, starts)
            self.assertGreaterEqual(latency, 0)
            self.assertTrue(end_to_end is None or end_to_end >= latency)

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
        self.check(folder, figures=True)
        self.assertEqual(folder.run["transport"], "fastdds")
        self.assertGreater(len(folder.chains()["rm-ro", 0]), 0)

    def test_autoware_in_two_processes_over_udp(self) -> None:
        folder = self.measure("run", *ONE, "--processes", 2, "--network", "udp", *SHORT)
        self.check(folder, processes=2)

    def test_autoware_in_two_processes_over_shared_memory(self) -> None:
        words = "--executors events-ro --repetitions 1 --processes 2 --network shared_memory".split()
        folder = self.measure("run", *words, *SHORT)
        self.check(folder, ["events-ro"], processes=2)

    def test_every_executor_on_autoware_in_one_process(self) -> None:
        folder = self.measure(
            "run", "--executors", "all", "--transport", "intra_process", "--repetitions", 1,
            "--load", 20, "--duration", 0.3, "--warm-up", 0.1,
        )  # fmt: skip
        self.check(folder, executors())

    def test_overload_loses_timestamps_and_samples_but_accounts_for_them(self) -> None:
        folder = self.measure(
            "run", "--executors", "default,events-re,rm-ro", "--load", 200, "--repetitions", 1, *SHORT
        )
        self.check(folder, ["default", "events-re", "rm-ro"])
        lost = [j for rows in folder.jobs().values() for j in rows if j.outcome in ("skipped", "overwritten")]
        self.assertGreater(len(lost), 0)

    def test_sequences_repeated_with_variants(self) -> None:
        executors = ["edf-ro", "rm-re:first", "multi:3"]
        folder = self.measure(
            "run", "--graph", "sequences", "--executors", ",".join(executors), "--repetitions", 2,
            "--transport", "intra_process", "--duration", 0.4, "--warm-up", 0,
        )  # fmt: skip
        self.check(folder, executors, repetitions=2)
        self.assertLessEqual({j.worker for j in folder.jobs()["multi:3", 0]} - {None}, {0, 1, 2})

    def test_timers_only_has_no_chain_and_no_figure(self) -> None:
        executors = ["default", "dm-ro"]
        folder = self.measure(
            "run", "--graph", "timers_only_60", "--executors", ",".join(executors), "--repetitions", 1,
            "--phases", "synchronous", "--duration", 0.5, "--warm-up", 0,
        )  # fmt: skip
        self.check(folder, executors)
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
        spin = f"import os\nos.sched_setaffinity(0, {{{cpu}}})\nprint(flush=True)\n"
        spin += f"while os.getppid() == {os.getpid()}: pass"  # ends also when the test is killed
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
        (*place, marks), *others = reported.summarized("tables")[-1]["rows"]
        self.assertEqual((place, others), (["rm-ro", 0], []))
        self.assertRegex(marks, "used by other processes")
        self.assertIn("1 of 1 repetitions disturbed", reported.what_ran())
        self.assertIn("work in CPU time", reported.what_ran())
        before = (output / "summary.json").read_text()
        (output / "summary.json").unlink()
        self.assertIn("Disturbed: rm-ro, repetition 0", self.accepted("report", "--summary", output))
        self.assertEqual((output / "summary.json").read_text(), before)
