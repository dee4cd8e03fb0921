# SPDX-License-Identifier: Apache-2.0
"""Compares `hotpath import ctf` with an independent reader's findings in traces of the real ROS 2
stack, and with hotpath's own runs written by `export ctf`. HOTPATH_TRACES names another folder of
traces (NAME.tar.xz and truth.json)."""

import json
import os
import random
import shutil
import tarfile
from pathlib import Path
from typing import Any

from ctf_trace import MS, CtfTrace, run_on, sensor_and_filter
from evidence import publish_on_request
from hotpath_command import CommandTest, RunFolder

GRAPHS = Path(__file__).resolve().parents[2] / "reference_system" / "graphs"
SHIPPED = Path(__file__).resolve().parents[2] / "reference_system" / "ros2_reference" / "ctf"
TRACES = Path(os.environ.get("HOTPATH_TRACES", SHIPPED))
HOT_PATH = ("--chain", "FrontLidarDriver,RearLidarDriver:ObjectCollisionEstimator")
QUANTILES = ("p50", "p99", "max")
# Limits for a good prediction: percent of median and p99, percentage points of losses.
MEDIAN, P99, LOST = 3, 8, 1


class ImportTest(CommandTest):
    def imported(self, trace: Any, *arguments: object) -> tuple[Any, Any]:
        """(content of import.json, output folder) of an import; the folder is beside the trace."""
        output = trace.parent / f"{trace.name}_imported"
        code, out, err = self.command("import", "ctf", trace, "--output", output, *arguments)
        self.assertEqual(code, 0, err)
        self.assertIn("Reproduction:", out)
        return json.loads((output / "import.json").read_text()), output

    def unpacked(self, name: str) -> Any:
        with tarfile.open(TRACES / f"{name}.tar.xz") as archive:
            archive.extractall(self.folder / "traces")
        return self.folder / "traces" / name

    def refused(self, code: int, words: Any, *arguments: object) -> None:
        found, out, err = self.command("import", "ctf", *arguments, "--output", self.folder / "refused")
        self.assertEqual((found, out), (code, ""))
        self.assertEqual(len(err.strip().splitlines()), 1, err)
        self.assertIn(words, err)


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
        self.accepted("summarize", output / "run")
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
                plan = ("--graph", file, "--executors", "rm-ro", "--phases-of", other / "run")
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
                    options = ("--executors", executor, "--dispatch-cost-us", 5)
                    self.check(graph, f"{graph}-{executor}", options, ("--executor", executor))

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
                options = ("--executors", executor, "--dispatch-cost-us", 5)
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
        self.accepted("check", output / "simulated")
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


class BadInput(ImportTest):
    """Unusable inputs: each ends with one clear sentence and exit code 2."""

    def test_what_is_no_trace(self) -> None:
        self.refused(2, "is not a folder", self.folder / "nowhere")
        self.refused(2, "holds no CTF trace", self.folder)

    def test_formats(self) -> None:
        for content, words in ((b'\x1e{"type": "preamble"}', "ctf-1.8"), (b"text", "is not CTF")):
            (self.folder / "metadata").write_bytes(content)
            self.refused(2, words, self.folder)

    def test_streams_that_end_within_a_packet(self) -> None:
        trace = self.unpacked("autoware_static")
        whole, _ = self.imported(trace)
        stream = max(trace.rglob("ros2_*"), key=lambda f: f.stat().st_size)
        stream.write_bytes(stream.read_bytes()[:-100])
        temporary = self.folder / "tmp"
        temporary.mkdir()
        os.environ["TMPDIR"] = str(temporary)
        self.addCleanup(os.environ.pop, "TMPDIR")
        cut, _ = self.imported(trace.rename(self.folder / "cut"))
        (warning,) = [w for w in cut["warnings"] if "breaks off" in w]
        self.assertIn(f"within a packet of {stream.name}", warning)
        self.assertTrue(0 < cut["jobs"] < whole["jobs"])
        self.assertEqual(list(temporary.iterdir()), [])

    def test_nothing_before_the_cut(self) -> None:
        trace = self.unpacked("timers_only_default")
        stream = max(trace.rglob("ros2_*"), key=lambda f: f.stat().st_size)
        stream.write_bytes(stream.read_bytes()[:-100])
        self.refused(2, f"breaks off within a packet of {stream.name}", trace)

    def test_an_output_folder_in_use(self) -> None:
        trace = self.unpacked("timers_only_default")
        self.imported(trace)
        code, _, err = self.command("import", "ctf", trace, "--output", f"{trace}_imported")
        self.assertEqual(code, 2)
        self.assertIn("holds files already", err)

    def test_chains(self) -> None:
        trace = self.unpacked("sequences_default")
        for chain, words in (("A", "is not SOURCE"), ("nobody:nothing", "is not a node or task")):
            self.refused(2, words, trace, "--chain", chain)

    def test_a_chain_without_outputs_is_not_green(self) -> None:
        graph, run, trace = (self.folder / name for name in ("graph.yaml", "run", "trace"))
        nodes = (
            "{name: Source, type: sensor, period_ms: 100}",
            "{name: Sink, type: command, input: Source, execution_time_ms: 5000}",
        )
        graph.write_text("\n".join(["name: slow", "nodes:", *(f"  - {node}" for node in nodes)]))
        brief = ("--graph", graph, "--executors", "events-re", "--duration", 0.5, "--warm-up", 0)
        self.accepted("simulate", *brief, "--output", run)
        self.accepted("export", "ctf", run, "--output", trace)
        check = self.imported(trace, "--chain", "Source:Sink")[0]["self_check"]
        self.assertNotEqual(check["light"], "green")
        self.assertEqual([c["recorded_ms"]["n"] for c in check["chains"]], [0])
        self.assertIn("No output of Sink was recorded", "".join(check["reasons"]))

    def test_an_import_that_fails_leaves_nothing(self) -> None:
        trace = self.unpacked("timers_only_default")
        deployment = self.folder / "deployment.yaml"
        deployment.write_text("name: none\nexecutors:\n  - {name: a, owns: [Nobody]}\n")
        for output in ("new", "old"):
            (self.folder / "old").mkdir(exist_ok=True)
            arguments = ("import", "ctf", trace, "--output", self.folder / output, "--deployment", deployment)
            code, _, err = self.command(*arguments)
            self.assertEqual(code, 2, err)
            self.assertIn("Nobody", err)
        self.assertFalse((self.folder / "new").exists())
        self.assertEqual(list((self.folder / "old").iterdir()), [])


class Faults(ImportTest):
    """Faults of a readable trace: each gives one warning, and the import uses the rest."""

    def warned(self, trace: Any, words: Any, jobs: Any) -> Any:
        facts, _ = self.imported(trace.write(self.folder / "trace"))
        self.assertTrue(any(words in w for w in facts["warnings"]), facts["warnings"])
        self.assertEqual(facts["jobs"], jobs)
        return facts

    def test_nothing_to_say(self) -> None:
        trace, _ = sensor_and_filter()
        facts, _ = self.imported(trace.write(self.folder / "trace"))
        self.assertEqual(facts["warnings"], [])
        self.assertEqual(facts["self_check"]["light"], "green")
        self.assertEqual(facts["self_check"]["similarity"], 1)

    def test_an_unknown_executor(self) -> None:
        trace, numbers = CtfTrace(), random.Random(1)
        node = trace.node(0, "sensor")
        timers = [trace.timer(MS, node, 20 * MS) for _ in range(6)]
        for period in range(1, 200):
            at = (1 + 20 * period) * MS
            for timer in numbers.sample(timers, len(timers)):
                trace.job(at, at + MS, timer)
                at += MS
        facts, _ = self.imported(trace.write(self.folder / "trace"))
        (executor,) = facts["executors"]
        self.assertEqual(executor["recognition"]["verdict"], "none fits", executor["recognition"])
        self.assertEqual(executor["recognition"]["executors"], [])
        self.assertNotEqual(facts["self_check"]["light"], "green")

    def test_no_initialisation_events(self) -> None:
        trace, _ = sensor_and_filter(initialised=False)
        self.refused(2, "no initialisation events", trace.write(self.folder / "trace"))

    def test_discarded_events(self) -> None:
        trace, _ = sensor_and_filter()
        trace.discarded = 17
        self.warned(trace, "discarded at least 17 events", 400)

    def test_a_clock_that_jumps(self) -> None:
        trace, handles = sensor_and_filter()
        run_on(trace, handles, handles["at"] + 60_000 * MS, 100)
        facts = self.warned(trace, "no event for 60.0 s from 2.0 s on", 600)
        self.assertNotEqual(facts["self_check"]["light"], "green")

    def test_a_clock_that_jumps_by_a_year(self) -> None:
        trace, handles = sensor_and_filter()
        run_on(trace, handles, handles["at"] + 365 * 24 * 3_600_000 * MS, 100)
        self.refused(
            2, "the trace's clock jumps, or the trace is damaged", trace.write(self.folder / "trace")
        )

    def test_a_clock_that_jumps_back(self) -> None:
        trace, handles = sensor_and_filter()
        run_on(trace, handles, handles["at"] - 1000 * MS, 100)
        self.warned(trace, "breaks off: its clock jumps back after 2.0 s", 400)

    def test_two_nodes_of_one_name(self) -> None:
        trace, handles = sensor_and_filter(0)
        second = trace.timer(3 * MS, trace.node(3 * MS, "sensor"), 10 * MS)
        for i in range(100):
            run_on(trace, handles, handles["at"] + 10 * i * MS, 1)
            trace.job(handles["at"] + (10 * i + 6) * MS, handles["at"] + (10 * i + 7) * MS, second)
        facts = self.warned(trace, "several nodes /sensor; one of them is called sensor_2", 300)
        self.assertEqual(
            {t["task"] for t in facts["tasks"]}, {"sensor/timer", "sensor_2/timer", "filter/points"}
        )

    def test_a_callback_that_never_ends(self) -> None:
        trace, handles = sensor_and_filter()
        trace.job(handles["at"], None, handles["timer"])
        self.warned(trace, "1 jobs have no end in the trace", 401)

    def test_a_trace_that_its_library_does_not_survive(self) -> None:
        trace = sensor_and_filter()[0].write(self.folder / "trace")
        metadata = trace / "metadata"
        metadata.write_text(metadata.read_text().replace("freq =", "frequency_hz ="))
        self.refused(2, "libbabeltrace2 does not survive it", trace)

    def test_a_name_that_is_no_text(self) -> None:
        trace = sensor_and_filter()[0].write(self.folder / "trace")
        stream = trace / "stream_0"
        stream.write_bytes(stream.read_bytes().replace(b"filter\0", b"fil\xffer\0"))
        self.refused(2, "a name in `ros2:rcl_node_init` is not valid UTF-8", trace)

    def test_handles_used_again(self) -> None:
        trace, handles = sensor_and_filter(100)
        timer = trace.timer(
            handles["at"], trace.node(handles["at"], "next"), 10 * MS, callback=handles["timer"]
        )
        for i in range(1, 101):
            trace.job(handles["at"] + 10 * i * MS, handles["at"] + (10 * i + 1) * MS, timer)
        facts = self.warned(trace, "1 addresses of callbacks were reused", 300)
        self.assertEqual({t["task"]: t["jobs"] for t in facts["tasks"]}["next/timer"], 100)

    def test_topics_without_publishers(self) -> None:
        trace, handles = sensor_and_filter(0)
        outer = trace.subscription(3 * MS, handles["nodes"][1], "/outer")
        trace.subscription(3 * MS, handles["nodes"][1], "/silent")
        for i in range(100):
            at = handles["at"] + 10 * i * MS
            run_on(trace, handles, at, 1)
            trace.job(at + 6 * MS, at + 7 * MS, outer[1], takes=(outer[0], at + 5 * MS))
        facts = self.warned(trace, "No callback of the trace publishes topic /outer", 300)
        self.assertTrue(any("Nobody published /silent" in w for w in facts["warnings"]))

    def test_services_are_tasks_whose_load_is_simulated(self) -> None:
        """A service of 6 ms every 20 ms keeps every second message waiting. One that ran twice is
        left out."""
        trace, handles = sensor_and_filter(0)
        service = trace.service(3 * MS, handles["nodes"][1], "/filter/set_parameters")
        rare = trace.service(3 * MS, handles["nodes"][1], "/filter/get_parameters")
        for i in range(200):
            at = handles["at"] + 10 * i * MS
            blocked = 6 * MS if i % 2 else 0
            if blocked:
                trace.job(at - 2 * MS, at + 4 * MS, service)
            start = at + (4 * MS + 50_000 if blocked else 20_000)
            stamp = trace.job(start, start + 2 * MS, handles["timer"], publishes=handles["publisher"])
            taken = (handles["rmw"], stamp)
            trace.job(start + 2 * MS + 50_000, start + 5 * MS, handles["subscription"], takes=taken)
            if i in (20, 40):
                trace.job(at + 6 * MS, at + 7 * MS, rare)
        trace.events.sort(key=lambda event: event[0])
        facts, output = self.imported(trace.write(self.folder / "served"))
        tasks = {t["task"]: t for t in facts["tasks"]}
        self.assertEqual(tasks["filter/filter/set_parameters"]["jobs"], 100)
        self.assertEqual(facts["left_out"]["jobs"], 2)
        self.assertTrue(any("requests to service /filter/set_param" in w for w in facts["warnings"]))
        responses = facts["self_check"]
        self.assertGreater(responses["response_p99_ms"]["recorded"], 5)
        self.assertAlmostEqual(
            responses["response_p99_ms"]["simulated"], responses["response_p99_ms"]["recorded"], delta=0.5
        )
        (jobs,) = RunFolder(output / "simulated").jobs().values()
        served = [job for job in jobs if job.task == "filter/filter/set_parameters"]
        self.assertEqual(sum(job.outcome == "ran" for job in served), 100)

    def test_publications_long_before_the_end(self) -> None:
        trace, handles = sensor_and_filter(0)
        for i in range(100):
            at = handles["at"] + 10 * i * MS
            trace.job(at + 20_000, at + 8 * MS, handles["timer"], publishes=handles["publisher"], after=MS)
            taken = (handles["rmw"], at + 20_000 + MS)
            trace.job(at + 8 * MS + 50_000, at + 9 * MS, handles["subscription"], takes=taken)
        facts, output = self.imported(trace.write(self.folder / "early"))
        self.assertEqual(facts["self_check"]["light"], "green", facts["self_check"]["reasons"])
        graph = (output / "graph.yaml").read_text()
        self.assertRegex(graph, r"publishes: \{topic: points, at_percent: 12\.5")
        (jobs,) = RunFolder(output / "simulated").jobs().values()
        waits = [job.start - job.timestamp for job in jobs if job.task == "filter/points"]
        self.assertGreater(min(waits), 6 * MS)


class Mutations(ImportTest):
    """Traces with a few changed bytes are read, or rejected with one sentence. HOTPATH_MUTATIONS
    sets their number.

    With HOTPATH_PUBLISH=1, the counts are published as results/reliability/mutations.json.
    """

    def test_any_bytes(self) -> None:
        whole = sensor_and_filter(20)[0].write(self.folder / "whole")
        numbers = random.Random(1)
        count = int(os.environ.get("HOTPATH_MUTATIONS", "40"))
        accepted = read = library_ended = 0
        for i in range(count):
            with self.subTest(i=i):
                trace = Path(shutil.copytree(whole, self.folder / "trace", dirs_exist_ok=True))
                file = numbers.choice(sorted(f for f in trace.iterdir() if f.is_file()))
                content = bytearray(file.read_bytes())
                for _ in range(numbers.choice((1, 1, 4))):
                    at = numbers.randrange(len(content))
                    size = numbers.choice((1, 1, 4, 8))
                    content[at : at + size] = numbers.choice(
                        (numbers.randbytes(size), b"\xff" * size, bytes(size), b"")
                    )
                file.write_bytes(content)
                output = self.folder / "imported"
                code, _, err = self.command("import", "ctf", trace, "--output", output)
                self.assertIn(code, (0, 2), err)
                if code == 2:  # a failed assertion of libbabeltrace2 may precede the sentence
                    lines = [line for line in err.strip().splitlines() if "Assertion" not in line]
                    self.assertEqual([line[:9] for line in lines], ["hotpath: "], err)
                shutil.rmtree(output, ignore_errors=True)
                accepted += 1
                read += code == 0
                library_ended += "libbabeltrace2 does not survive it" in err
        if count >= 40:
            self.assertTrue(0 < read < count, f"{read} of {count} were read")
        if accepted == count:
            facts = {"tried": count, "read": read, "library_ended": library_ended}
            publish_on_request("reliability/mutations.json", facts)
