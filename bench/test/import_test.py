# SPDX-License-Identifier: Apache-2.0
"""Compares `hotpath import ctf` with an independent reader's findings in traces of the real ROS 2
stack."""

import json
from pathlib import Path
from typing import Any

from hotpath_command import RunFolder
from import_case import TRACES, ImportTest

HOT_PATH = ("--chain", "FrontLidarDriver,RearLidarDriver:ObjectCollisionEstimator")
QUANTILES = ("p50", "p99", "max")
# Limits for a good prediction: percent of median and p99, percentage points of losses.
MEDIAN, P99, LOST = 3, 8, 1


class Truth(ImportTest):
    """Counts are equal, durations agree within 0.1 microseconds, and the self-check stays within
    its limits."""

    def test_recorded_traces(self) -> None:
        truth = json.loads((TRACES / "truth.json").read_text())
        for name, expected in truth.items():
            with self.subTest(trace=name):
                chain = HOT_PATH if "hot_path_us" in expected else ()
                facts, output = self.imported(self.unpacked(name), *chain)
                self.assertEqual(facts["events"], expected["events"])
                self.check_tasks(facts, expected)
                self.check_chain(output, facts["self_check"], expected)
                self.check_run(output, facts)

    def check_tasks(self, facts: Any, expected: Any) -> None:
        timers = {t["node"].lstrip("/"): t for t in facts["tasks"] if t["kind"] == "timer"}
        self.assertEqual(
            {node: (t["period_ms"], t["created_ns"]) for node, t in timers.items()},
            {node: (t["period_ms"], t["created_ns"]) for node, t in expected["timers"].items()},
        )
        tasks = {(t["node"] + t.get("topic", "")).lstrip("/"): t for t in facts["tasks"]}
        self.assertEqual(set(tasks), set(expected["tasks"]))
        for name, task in tasks.items():
            true = expected["tasks"][name]
            for key in ("jobs", "threads", "published"):
                self.assertEqual(task[key], true[key], f"{key} of {name}")
            for q in QUANTILES:
                self.assertAlmostEqual(task["duration_us"][q], true["duration_us"][q], delta=0.1, msg=name)

    def check_chain(self, output: Path, check: Any, expected: Any) -> None:
        self.assertLessEqual(
            abs(check["lost_percent"]["recorded"] - check["lost_percent"]["simulated"]), LOST
        )
        if "hot_path_us" not in expected:
            return
        (chain,) = check["chains"]
        ((_, rows),) = RunFolder(output / "run").chains().items()
        latencies, true = sorted(row[2] / 1000 for row in rows), expected["hot_path_us"]
        self.assertEqual(len(latencies), true["samples"])
        for q, share in (("p50", 50), ("p90", 90), ("p99", 99)):
            self.assertAlmostEqual(latencies[len(latencies) * share // 100], true[q], delta=0.1)
        self.assertLessEqual(abs(chain["median_error_percent"]), MEDIAN)
        self.assertLessEqual(abs(chain["p99_error_percent"]), P99)

    def check_run(self, output: Path, facts: Any) -> None:
        """Checks that other commands can read the folder of the recorded run."""
        run = RunFolder(output / "run")
        self.assertTrue(run.run["complete"])
        ran = sum(task["jobs"] for task in facts["tasks"])
        (jobs,) = run.jobs().values()
        self.assertEqual(sum(job.outcome == "ran" for job in jobs), ran)
        self.accepted("report", "--summary", output / "run")
        self.assertTrue(run.accounts_for_all())


class Deliveries(ImportTest):
    """Upstream's reference system on Jazzy: the order of delivery, and predictions that need it."""

    # Fast DDS reaches subscribers created before the publisher in the order of its table of readers.
    # PriorityExecutor, which runs the latest of two equals first, ran them in the reverse order.
    ORDERS = (
        "PointCloudFusion: {delivery: [RayGroundFilter, VoxelGridDownsampler]}",
        "Lanelet2MapLoader: {delivery: [LanePlanner, ParkingPlanner, BehaviorPlanner]}",
        "NDTLocalizer: {delivery: [Lanelet2GlobalPlanner, BehaviorPlanner]}",
    )

    def test_prediction_of_another_executor(self) -> None:
        facts, output = self.imported(
            self.unpacked("quiet_default", "upstream_jazzy_quiet_default"), *HOT_PATH
        )
        graph = output / "graph.yaml"
        for order in self.ORDERS:
            self.assertIn(order, graph.read_text())
        self.assertEqual({d["source"] for d in facts["deliveries"]}, {"ids", "creation"})
        recorded, other = self.imported(
            self.unpacked("quiet_rm-ro", "upstream_jazzy_quiet_rm-ro"), *HOT_PATH, "--executor", "rm-ro"
        )
        words = ("import", "ctf", other.with_name("quiet_rm-ro"), "--executors", "rm-ro,cbg:9")
        self.rejected(*words, says="--executors cbg:9: no threads of the trace can be its own")
        for order in self.ORDERS:
            self.assertIn(order, (other / "graph.yaml").read_text())
        order, swapped = "RayGroundFilter, VoxelGridDownsampler", graph.with_name("swapped.yaml")
        swapped.write_text(graph.read_text().replace(order, "VoxelGridDownsampler, RayGroundFilter"))
        for name, file in (("stated", graph), ("swapped", swapped)):  # its median is too short by a sixth
            with self.subTest(name):
                run = self.folder / name
                plan = ("--graph", file, "--executors", "rm-ro", "--phases", other / "run")
                self.accepted("simulate", *plan, "--duration", 15, "--warm-up", 1, "--output", run)
                chain = RunFolder(run).summary()["executors"][0]["chains"][0]
                true = recorded["self_check"]["chains"][0]["recorded_ms"]["p50"]
                error = abs(chain["hot_path_latency_ms"]["p50"] / true - 1)
                self.assertEqual(error < 0.05, name == "stated", (name, error))


class StatedExecutor(ImportTest):
    """A recording of hotpath_rclcpp's PriorityExecutor on ROS 2 Jazzy with its own events."""

    def test_name_releases_and_a_service_with_its_client(self) -> None:
        facts, output = self.imported(self.unpacked("priority_executor", "priority_executor"))
        recognition = facts["executors"][0]["recognition"]
        self.assertEqual((recognition["stated"], recognition["verdict"]), ("rm-ro:first", "recognised"))
        jobs = dict.fromkeys(("sensor/timer", "filter/scan", "planner/points"), 60)
        jobs |= dict.fromkeys(("planner/timer", "filter/map", "planner/map/response"), 24)
        self.assertEqual({task["task"]: task["jobs"] for task in facts["tasks"]}, jobs)
        graph = (output / "graph.yaml").read_text()
        for trigger in ("{topic: map, last_of: [points]}", "publishes: map/response"):
            self.assertIn(trigger, graph)
        (rows,) = RunFolder(output / "run").jobs().values()
        for job in rows:  # queued by the timer thread after the nominal instant, before the start
            if job.task == "sensor/timer" and job.outcome == "ran":
                self.assertTrue(job.timestamp < job.release < job.start, job)
