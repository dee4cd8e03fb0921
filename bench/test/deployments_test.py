# SPDX-License-Identifier: Apache-2.0
"""Runs deployments of the Autoware graph through the commands that take them, simulated and live.
"""

import os
import signal
from typing import Any

from hotpath_command import CommandTest, children

SHIPPED = ("single", "isolated", "cie", "prioritized", "upstream_cbg", "picas", "rm-threads")
CRUNCH_MS = 4.2


class Deployments(CommandTest):
    def write(self, name: str, *executors: str) -> Any:
        lines = ("name: mine", "executors:", *(f"  - {{{e}}}" for e in executors))
        return self.written(name, "\n".join(lines))

    def check(self, run: Any) -> None:
        """Checks that every job ran on a worker of its task's executor."""
        self.assertEqual(run.run["failures"], [])
        self.assertTrue(run.accounts_for_all())
        self.assertEqual({label for label, _ in run.jobs()}, set(run.run["executors"]))
        for (label, _), jobs in run.jobs().items():
            workers: dict[Any, Any] = {}
            for executor in run.run["deployments"][label]["executors"]:
                numbers = range(executor["first_worker"], executor["first_worker"] + executor["workers"])
                workers.update((task, numbers) for task in executor["tasks"])
            ran = [j for j in jobs if j.outcome == "ran"]
            self.assertEqual({j.task for j in ran}, set(workers))
            for job in ran:
                self.assertIn(job.worker, workers[job.task], job)

    def latency(self, run: Any, label: str, quantile: str) -> Any:
        (chain,) = next(e for e in run.summary()["executors"] if e["executor"] == label)["chains"]
        return chain["hot_path_latency_ms"][quantile]

    def test_all_that_ship_are_simulated_in_one_table(self) -> None:
        words = "simulate --cores 2 --load 80 --duration 20 --executors default --deployments"
        run = self.measure(*words.split(), ",".join(SHIPPED))
        self.assertEqual(run.run["executors"], ["default", *SHIPPED])
        jobs = run.jobs()
        self.assertEqual(repr(jobs[("default", 0)]), repr(jobs[("single", 0)]))
        run.run["deployments"]["default"] = run.run["deployments"]["single"]
        self.check(run)
        # The path takes four crunches with one core per branch, and more than five on one thread.
        self.assertLessEqual(self.latency(run, "prioritized", "p50"), 4.1 * CRUNCH_MS)
        self.assertLessEqual(self.latency(run, "prioritized", "max"), 5 * CRUNCH_MS)
        self.assertGreater(self.latency(run, "single", "p50"), 5 * CRUNCH_MS)

    def test_live_in_one_process(self) -> None:
        mine = self.write(
            "mine.yaml", "name: rest, policy: 'other:5', owns: rest", "name: imu, owns: [Visualizer]"
        )
        for transport in ("intra_process", "fastdds"):
            words = f"run --load 10 --duration 1 --warm-up 0 --repetitions 1 --transport {transport}"
            run = self.measure(*words.split(), "--deployments", f"isolated,{mine}", output=transport)
            self.assertEqual(run.run["executors"], ["isolated", "mine"])
            self.check(run)
        policies = {r["executor"]: r["thread_policies"] for r in run.run["runs"]}
        expected = {"isolated": ["24 x executor other"], "mine": ["executor other:5, executor other"]}
        self.assertEqual(policies, expected)

    def test_live_in_several_processes(self) -> None:
        mine = self.write(
            "mine.yaml",
            "name: rear, process: rear, owns: [RearLidarDriver, PointsTransformerRear]",
            "name: hot, process: hot, owns: [FrontLidarDriver, PointsTransformerFront, PointCloudFusion]",
            "name: imu, executor: 'multi:2', process: rear, owns: [Visualizer]",
            "name: rest, process: rest, owns: rest",
        )
        common = ("run", "--load", 10, "--warm-up", 0, "--repetitions", 1, "--deployments", mine)
        run = self.measure(*common, "--duration", 1)
        self.check(run)
        processes = {e["first_worker"]: e["process"] for e in run.run["deployments"]["mine"]["executors"]}
        self.assertEqual(processes, {0: 0, 1: 1, 2: 0, 4: 2})
        ran = {(j.worker, j.process) for j in run.jobs()[("mine", 0)] if j.outcome == "ran"}
        self.assertEqual(ran | {(2, 0), (3, 0)}, {(0, 0), (1, 1), (2, 0), (3, 0), (4, 2)})
        self.rejected(*common, "--transport", "intra_process", says="--transport fastdds")

        process = self.start(*common, "--duration", 30, "--output", self.folder / "killed")
        self.wait_for(lambda: len(children(process)) == 3, "three processes")
        os.kill(children(process)[0], signal.SIGKILL)
        code, _, err = self.finish(process)
        self.assertEqual(code, 1, err)
        ended = "process 1 of 3 with rear, imu (executor mine, repetition 0) was ended by a signal (Killed)"
        self.assertIn(ended, err)

    def test_replay_takes_a_run_of_deployments(self) -> None:
        options = ("--cores", 2, "--duration", 1, "--copies", 2, "--load", 40)
        run = self.measure("simulate", *options, "--deployments", "prioritized")
        self.accepted("replay", run.path, "--duration", 0.3)

    def test_refused_with_file_and_line_before_anything_runs(self) -> None:
        far = self.write("far.yaml", "name: a, owns: [Visualizer]", "name: b, processors: [63], owns: rest")
        for command in (("simulate", "--cores", 2), ("run",)):
            self.rejected(*command, "--deployments", far, "--output", "none", says="far.yaml:4: executor b")
        # Exceeds the share of one CPU that Linux grants to deadline threads: denied like a missing
        # permission.
        cpus = self.write("cpus.yaml", "name: a, policy: 'deadline:10/10/10', owns: rest")
        self.rejected("simulate", "--deployments", cpus, "--output", "none", says="cpus.yaml:3: ")
        if len(os.sched_getaffinity(0)) > 1:
            pinned = ["--cpus", min(os.sched_getaffinity(0)), "--output", "none"]
            self.rejected("run", "--deployments", cpus, *pinned, says="cpus.yaml:3: ")
        self.rejected("run", "--processes", 2, "--deployments", "isolated", says="--processes")
        self.assertFalse((self.folder / "none").exists())

    def test_callback_isolated_executor_configuration(self) -> None:
        written = self.accepted("graph", "autoware", "--as", "cie")
        cie = self.written(
            "threads.yaml", written.replace("SCHED_OTHER\n    nice: 0", "SCHED_FIFO\n    priority: 10", 1)
        )
        self.rejected("graph", "autoware", "--as", "cie", "--deployments", "single", says="callback group")
        words = f"simulate --cores 2 --duration 1 --warm-up 0 --deployments cie:{cie}"
        run = self.measure(*words.split())
        self.check(run)
        policies = [e["policy"] for e in run.run["deployments"]["cie:threads"]["executors"]]
        self.assertEqual(policies, ["fifo:10"] + ["other"] * 23)
