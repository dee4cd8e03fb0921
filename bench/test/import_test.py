# SPDX-License-Identifier: Apache-2.0
"""Compares `hotpath import ctf` with an independent reader's findings in traces of the real ROS 2
stack, and with hotpath's own runs written by `export ctf`."""

import json
import tarfile
from pathlib import Path
from typing import Any

from hotpath_command import RunFolder
from import_case import SHIPPED, TRACES, ImportTest

GRAPHS = Path(__file__).resolve().parents[2] / "reference_system" / "graphs"
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
        for executor in run.summary()["executors"]:
            self.assertTrue(executor["loss_equations"]["hold"], executor["loss_equations"])


class Deliveries(ImportTest):
    """Upstream's reference system on Jazzy: the order of delivery, and predictions that need it."""

    # Fast DDS reaches subscribers created before the publisher in the order of its table of readers.
    # PriorityExecutor, which runs the latest of two equals first, ran them in the reverse order.
    ORDERS = (
        "PointCloudFusion: {delivery: [RayGroundFilter, VoxelGridDownsampler]}",
        "Lanelet2MapLoader: {delivery: [LanePlanner, ParkingPlanner, BehaviorPlanner]}",
        "NDTLocalizer: {delivery: [Lanelet2GlobalPlanner, BehaviorPlanner]}",
    )

    def upstream(self, name: str) -> Path:
        with tarfile.open(SHIPPED / f"upstream_jazzy_{name}.tar.xz") as archive:
            archive.extractall(self.folder)
        return Path(self.folder / name)

    def test_prediction_of_another_executor(self) -> None:
        facts, output = self.imported(self.upstream("quiet_default"), *HOT_PATH)
        graph = output / "graph.yaml"
        for order in self.ORDERS:
            self.assertIn(order, graph.read_text())
        self.assertEqual({d["source"] for d in facts["deliveries"]}, {"ids", "creation"})
        recorded, other = self.imported(self.upstream("quiet_rm-ro"), *HOT_PATH, "--executor", "rm-ro")
        for order in self.ORDERS:
            self.assertIn(order, (other / "graph.yaml").read_text())
        for name, file in (("stated", graph), ("swapped", self.swapped(graph))):
            with self.subTest(name):
                run = self.folder / name
                plan = ("--graph", file, "--executors", "rm-ro", "--phases", other / "run")
                self.accepted("simulate", *plan, "--duration", 15, "--warm-up", 1, "--output", run)
                chain = RunFolder(run).summary()["executors"][0]["chains"][0]
                true = recorded["self_check"]["chains"][0]["recorded_ms"]["p50"]
                error = abs(chain["hot_path_latency_ms"]["p50"] / true - 1)
                self.assertEqual(error < 0.05, name == "stated", (name, error))

    def swapped(self, graph: Path) -> Path:
        """The graph with the first order reversed: its median would be too short by a sixth."""
        text = graph.read_text()
        first, second = "RayGroundFilter", "VoxelGridDownsampler"
        self.assertIn(f"[{first}, {second}]", text)
        copy = graph.with_name("swapped.yaml")
        copy.write_text(text.replace(f"[{first}, {second}]", f"[{second}, {first}]"))
        return copy


class StatedExecutor(ImportTest):
    """A recording of hotpath_rclcpp's PriorityExecutor on ROS 2 Jazzy with its own events."""

    def test_name_releases_and_a_service_with_its_client(self) -> None:
        with tarfile.open(SHIPPED / "priority_executor.tar.xz") as archive:
            archive.extractall(self.folder)
        facts, output = self.imported(Path(self.folder / "priority_executor"))
        recognition = facts["executors"][0]["recognition"]
        self.assertEqual((recognition["stated"], recognition["verdict"]), ("rm-ro:first", "recognised"))
        self.assertEqual(
            {task["task"]: task["jobs"] for task in facts["tasks"]},
            {
                "sensor/timer": 60,
                "filter/scan": 60,
                "planner/points": 60,
                "planner/timer": 24,
                "filter/map": 24,
                "planner/map/response": 24,
            },
        )
        graph = (output / "graph.yaml").read_text()
        for trigger in ("{topic: map, last_of: [points]}", "publishes: map/response"):
            self.assertIn(trigger, graph)
        (jobs,) = RunFolder(output / "run").jobs().values()
        timers = [job for job in jobs if job.task == "sensor/timer" and job.outcome == "ran"]
        for job in timers:  # queued by the timer thread after the nominal instant, before the start
            self.assertLess(job.timestamp, job.release)
            self.assertLess(job.release, job.start)


class RoundTrip(ImportTest):
    """A run that is exported and imported again has the same tasks, jobs and outputs, and a legal
    schedule."""

    # By graph: the chain whose outputs are compared, as sources and sink, and its name in the
    # graph.
    CHAINS = {
        "autoware": (HOT_PATH[1], "hot_path"),
        "many_to_many": ("SensorA:SinkLogger", "sensor_a"),
        "sequences": ("LidarDriver:Localization", "localization"),
    }
    RUNS = {
        "autoware": ("default", "static", "events-ro", "events-re", "rm-ro", "edf-re", "cbg:2", "multi:2"),
        "callbacks": ("default", "events-re"),
        "timers_only_90": ("default", "rm-ro"),
        "sequences": ("edf-ro", "multi-jazzy:2"),
        "many_to_many": ("events-ro", "rm-re", "multi:2"),
    }
    RCL_VERSIONS = {"default": "8.0.0", "multi-jazzy:2": "9.2.0"}
    # The export may shift simultaneous events of several CPUs by this much, to give them an order.
    APART_NS = 100
    TWO_PROCESSES = """name: two
executors:
  - {name: front, executor: rm-ro, process: a, owns: [FrontLidarDriver, PointsTransformerFront]}
  - {name: rear, executor: default, process: b, owns: [RearLidarDriver]}
  - {name: others, executor: multi, process: b, owns: rest}
"""

    def test_graphs_and_executors(self) -> None:
        for graph, executors in self.RUNS.items():
            for executor in executors:
                with self.subTest(graph=graph, executor=executor):
                    options = ("--executors", executor, "--platform", "dispatch_cost_us=5")
                    output = self.check(graph, f"{graph}-{executor}", options, ("--executor", executor))
                    if executor in self.RCL_VERSIONS:
                        facts = json.loads((output / "import.json").read_text())
                        self.assertEqual(facts["rcl_version"], self.RCL_VERSIONS[executor])

    def test_waits(self) -> None:
        """Two timers that are always due together run after one wait."""
        graph = self.folder / "pair.yaml"
        node = "{name: %s, type: sensor, period_ms: 10, execution_time_ms: 1}"
        graph.write_text(f"name: pair\nnodes:\n  - {node % 'A'}\n  - {node % 'B'}\n")
        options = ("--executors", "default", "--phases", "synchronous")
        output = self.check(str(graph), "pair", options, ())
        (executor,) = json.loads((output / "import.json").read_text())["executors"]
        self.assertEqual((executor["dispatch"]["n"], executor["wait"]["n"]), (300, 0))

    def test_options_of_the_run(self) -> None:
        cases: Any = (
            ("no_work", "events-ro", "--load", 0),
            ("no_work_threads", "multi:3", "--load", 0),
            ("scaled", "default", "--rate", 110, "--copies", 2, "--load", 40),
        )
        for name, executor, *options in cases:
            with self.subTest(name):
                self.check("autoware", name, ("--executors", executor, *options), ("--executor", executor))

    def test_order_of_delivery(self) -> None:
        order = "PointCloudFusion: {delivery: [RayGroundFilter, VoxelGridDownsampler]}"
        text = (GRAPHS / "autoware.yaml").read_text()
        graph = self.folder / "delivered.yaml"
        graph.write_text(text.replace("\nnodes:", f"\ntopics: {{{order}}}\nnodes:", 1))
        for executor in ("default", "events-ro", "rm-ro", "cbg:1"):
            with self.subTest(executor):
                options = ("--executors", executor, "--platform", "dispatch_cost_us=5")
                output = self.check(str(graph), f"delivered-{executor}", options, ("--executor", executor))
                self.assertIn(order, (output / "graph.yaml").read_text())

    def test_deployments(self) -> None:
        two = self.folder / "two.yaml"
        two.write_text(self.TWO_PROCESSES)
        deployments: Any = (two, "picas", "isolated")
        for deployment in deployments:
            for load in (80, 0):
                with self.subTest(deployment=deployment, load=load):
                    options = ("--deployments", deployment, "--load", load)
                    output = self.check("autoware", f"{Path(deployment).stem}-{load}", options, ())
                    owners = (output / "deployment.yaml").read_text()
                    self.assertEqual(owners.count("process_1000_") > 0, deployment == two)
                    self.assertEqual(owners.count("process_2000_") > 0, deployment == two)

    def check(self, graph: Any, name: str, options: Any, import_options: Any) -> Any:
        folder, trace = self.folder / name, self.folder / f"trace-{name}"
        plan = ("--graph", graph, "--duration", 3, "--warm-up", 0, "--cores", 2)
        self.accepted("simulate", *plan, *options, "--output", folder)
        self.accepted("export", "ctf", folder, "--output", trace)
        chain, chain_name = self.CHAINS.get(graph, ("", ""))
        facts, output = self.imported(trace, *import_options, *(("--chain", chain) if chain else ()))
        run, recorded = RunFolder(folder), self.checked(output / "run")
        self.accepted("doctor", output / "simulated")
        self.assertEqual(len(facts["tasks"]), len(run.run["tasks"]))
        self.assertEqual(self.periods(recorded), self.periods(run))
        self.assert_near(self.jobs(recorded), self.jobs(run))
        if chain:
            sink = chain.rpartition(":")[2]
            expected = self.latencies(run, chain_name)
            self.assertGreater(len(expected), 10)
            self.assert_near({"": self.latencies(recorded, sink)}, {"": expected})
            self.assertEqual([len(expected)], [c["recorded_ms"]["n"] for c in facts["self_check"]["chains"]])
        return output

    def assert_near(self, found: Any, expected: Any) -> None:
        """Checks that both have the same keys, and for each key the same number of values within
        APART_NS."""
        self.assertEqual({k: len(v) for k, v in found.items()}, {k: len(v) for k, v in expected.items()})
        for name, values in found.items():
            for value, other in zip(values, expected[name]):
                self.assertLessEqual(abs(value - other), self.APART_NS, name)

    def latencies(self, run: Any, chain: str) -> list[Any]:
        (rows,) = run.chains().values()
        return sorted(row[2] for row in rows if row[0] == chain or row[0].partition("/")[0] == chain)

    def periods(self, run: Any) -> list[Any]:
        return sorted(task["period_ns"] for task in run.run["tasks"] if task["kind"] == "timer")

    def jobs(self, run: Any) -> dict[Any, Any]:
        """Starts and finishes of the jobs that ran, by node and topic or, for timers, by node and
        period."""
        periods = {t["task"]: t["period_ns"] for t in run.run["tasks"] if t["kind"] == "timer"}
        seen: dict[Any, Any] = {}
        (jobs,) = run.jobs().values()
        ran = [job for job in jobs if job.outcome == "ran"]
        first = min(job.start for job in ran)
        for job in ran:
            name = (job.node, periods[job.task]) if job.kind == "timer" else (job.node, job.topic)
            seen.setdefault(name, []).extend((job.start - first, job.finish - first))
        return {name: sorted(instants) for name, instants in seen.items()}
