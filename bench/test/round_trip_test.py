# SPDX-License-Identifier: Apache-2.0
"""Exports a simulated run of each executor and of each deployment preset as a trace and imports it:
the import must find the same graph, jobs, losses and outputs, reproduce the run, and name the
executor."""

import json
from collections import Counter
from pathlib import Path
from typing import Any

from hotpath_command import RunFolder
from import_case import ImportTest

AUTOWARE = Path(__file__).resolve().parents[2] / "reference_system" / "graphs" / "autoware.yaml"
# By graph: the chain whose outputs are compared, as sources and sink, and its name in the graph.
CHAINS = {
    "autoware": ("FrontLidarDriver,RearLidarDriver:ObjectCollisionEstimator", "hot_path"),
    "many_to_many": ("SensorA:SinkLogger", "sensor_a"),
    "sequences": ("LidarDriver:Localization", "localization"),
}
OTHERS = {
    "callbacks": ("default", "events-re"),
    "timers_only_90": ("default", "rm-ro"),
    "sequences": ("edf-ro", "multi-jazzy:2"),
    "many_to_many": ("events-ro", "rm-re", "multi:2"),
}
TWO_PROCESSES = """name: two
executors:
  - {name: front, executor: rm-ro, process: a, owns: [FrontLidarDriver, PointsTransformerFront]}
  - {name: rear, executor: default, process: b, owns: [RearLidarDriver]}
  - {name: others, executor: multi, process: b, owns: rest}
"""
# Executors of a deployment's threads, where they are not the default one.
EXECUTORS = {"picas": "fp-ro"}
# A job takes a sample between two publications of one instant. The trace has no order of the events of
# several processors within an instant, so the import counts the first sample as overwritten.
ONE_INSTANT = ("picas",)
# Of each job of a timer and of a subscription, in microseconds.
COSTS = ("--platform", "timer_dispatch_cost_us=3", "--platform", "subscription_dispatch_cost_us=9")
ENOUGH_DISPATCHES = 100
# The export separates simultaneous events of several processors by a few nanoseconds.
APART_NS = 100


def named(run: RunFolder) -> dict[str, str]:
    """By task, a name that a run and its import share: node and topic, or node and period."""
    names = {}
    for task in run.run["tasks"]:
        node, _, topic = task["task"].partition("/")
        names[task["task"]] = f"{node} {task['period_ns'] if task['kind'] == 'timer' else topic}"
    return names


class RoundTrip(ImportTest):
    def round_trip(
        self, name: str, *plan: object, graph: Any = "autoware", seconds: int = 3, options: Any = ()
    ) -> tuple[Any, RunFolder, RunFolder]:
        """(content of import.json, the run, its import) of a legal schedule"""
        of_run = ("--graph", graph, "--duration", seconds, "--warm-up", 0, "--cores", 2, *plan)
        chain = ("--chain", CHAINS[graph][0]) if graph in CHAINS else ()
        facts, run, output = self.reimported(*of_run, options=(*chain, *options), name=name)
        self.checked(output / "simulated")
        return facts, RunFolder(run), self.checked(output / "run")

    def check(self, facts: Any, run: RunFolder, found: RunFolder) -> None:
        if run.run["executors"] != list(ONE_INSTANT):
            self.assertEqual(self.connections(found), self.connections(run))
            self.assertEqual(self.losses(found), self.losses(run))
        self.check_instants(run, found, "autoware")
        self.assertEqual(facts["self_check"]["light"], "green", facts["self_check"]["reasons"])

    def check_instants(self, run: RunFolder, found: RunFolder, graph: Any) -> None:
        jobs, expected = self.instants(found), self.instants(run)
        if graph in CHAINS:
            chain, name = CHAINS[graph]
            jobs["outputs"] = self.latencies(found, chain.rpartition(":")[2])
            expected["outputs"] = self.latencies(run, name)
            self.assertGreater(len(expected["outputs"]), 10)
        self.assertEqual({k: len(v) for k, v in jobs.items()}, {k: len(v) for k, v in expected.items()})
        for task, instants in jobs.items():
            for one, other in zip(instants, expected[task]):
                self.assertLessEqual(abs(one - other), APART_NS, task)

    def check_costs(self, facts: Any, run: RunFolder, imported: RunFolder) -> None:
        """The import finds the costs of each kind of which there were enough dispatches."""
        platform = imported.run["platform"]
        for kind in ("timer", "subscription"):
            if facts["executors"][0][f"{kind}_dispatch"]["n"] < ENOUGH_DISPATCHES:
                continue
            found = platform.get(f"{kind}_dispatch_cost_us", platform.get("dispatch_cost_us"))
            self.assertAlmostEqual(found, run.run["platform"][f"{kind}_dispatch_cost_us"], delta=0.2)

    def connections(self, run: RunFolder) -> Counter[Any]:
        """How often jobs of a task ran because of a job of another task."""
        names = named(run)
        (jobs,) = run.jobs().values()
        ran = (job for job in jobs if job.outcome == "ran")
        return Counter((names[job.task], job.parent and names[job.parent[0]]) for job in ran)

    def instants(self, run: RunFolder) -> dict[str, list[int]]:
        """By task: starts and finishes, relative to the first start."""
        names = named(run)
        (jobs,) = run.jobs().values()
        ran = [job for job in jobs if job.outcome == "ran"]
        first = min(job.start for job in ran)
        seen: dict[str, list[int]] = {}
        for job in ran:
            seen.setdefault(names[job.task], []).extend((job.start - first, job.finish - first))
        return {task: sorted(instants) for task, instants in seen.items()}

    def losses(self, run: RunFolder) -> Counter[Any]:
        """Jobs that did not run, besides those at the end, and timestamps skipped."""
        names = named(run)
        lost: Counter[Any] = Counter()
        (jobs,) = run.jobs().values()
        for job in jobs:
            if job.outcome == "overwritten":
                lost[names[job.task]] += 1
        for executor in run.summary()["executors"]:
            for task in executor["tasks"]:
                lost[names[task["task"]]] += task.get("skipped", 0)
        return +lost

    def latencies(self, run: RunFolder, chain: str) -> list[int]:
        (rows,) = run.chains().values()
        return sorted(row[2] for row in rows if row[0].partition("/")[0] == chain)

    def test_every_executor(self) -> None:
        for executor in self.executors():
            with self.subTest(executor):
                plan = ("--executors", executor, *COSTS, "--load", 80)
                facts, run, found = self.round_trip(executor, *plan, seconds=5)
                self.check_costs(facts, run, found)
                self.check(facts, run, found)
                (recognised,) = [e["recognition"] for e in facts["executors"]]
                self.assertIn(recognised["verdict"], ("recognised", "tie"), recognised)
                self.assertIn(executor, recognised["executors"])
                if executor == "multi-jazzy:2":  # the trace states the release
                    self.assertEqual(facts["executors"][0]["executor"], executor)
                if executor.startswith("cbg"):
                    open_one = "is cbg:2 or cbg-3178:2 (--executors cbg-3178:2), which does not matter"
                    self.assertIn(open_one, " ".join(facts["warnings"]))

    def test_every_deployment(self) -> None:
        """A thread whose callbacks never wait for each other may be undecided."""
        for name in (line.split()[0] for line in self.accepted("list", "deployments").splitlines() if line):
            with self.subTest(name):
                plan = ("--deployments", name, "--platform", "dispatch_cost_us=5", "--load", 80)
                facts, run, found = self.round_trip(name, *plan, seconds=5)
                self.check(facts, run, found)
                for executor in facts["executors"]:
                    recognised = executor["recognition"]
                    self.assertNotEqual(recognised["verdict"], "none fits", recognised)
                    self.assertIn(EXECUTORS.get(name, "default"), recognised["executors"])

    def test_other_graphs_and_options(self) -> None:
        order = "PointCloudFusion: {delivery: [RayGroundFilter, VoxelGridDownsampler]}"
        delivered = self.written(
            "delivered.yaml", AUTOWARE.read_text().replace("\nnodes:", f"\ntopics: {{{order}}}\nnodes:", 1)
        )
        two = self.written("two.yaml", TWO_PROCESSES)
        costs = ("--platform", "dispatch_cost_us=5")
        cases: list[Any] = [(g, "--executors", e, *costs) for g, of in OTHERS.items() for e in of]
        cases += [(delivered, "--executors", e, *costs) for e in ("default", "events-ro", "rm-ro")]
        cases += [
            ("autoware", "--executors", "events-ro", "--load", 0),
            ("autoware", "--executors", "multi:3", "--load", 0),
            ("autoware", "--executors", "default", "--rate", 110, "--copies", 2, "--load", 40),
            ("autoware", "--deployments", "isolated", "--load", 0),
            ("autoware", "--deployments", two, "--platform", "delivery_delay_us=300"),
        ]
        for number, (graph, kind, executor, *options) in enumerate(cases):
            with self.subTest(graph=graph, executor=executor, options=options):
                stated = ("--executors", executor.split(":")[0]) if kind == "--executors" else ()
                plan = (kind, executor, *options)
                facts, run, found = self.round_trip(str(number), *plan, graph=graph, options=stated)
                self.check_instants(run, found, graph)
                if stated:
                    self.assertEqual(facts["executors"][0]["executor"].split(":")[0], stated[1])
                if graph == delivered:
                    self.assertIn(order, (found.path.parent / "graph.yaml").read_text())
                if kind == "--deployments":
                    owners = (found.path.parent / "deployment.yaml").read_text()
                    for process in ("process_1000_", "process_2000_"):
                        self.assertEqual(process in owners, executor == two)
                if executor == two:
                    self.assertAlmostEqual(facts["delivery"]["least_us"], 300, delta=0.1)
                    analysis = f"analyze {found.path.parent}/graph.yaml --executors default"
                    self.assertIn(
                        f"; delivery measured, up to 300 us of {facts['delivery']['n']} samples, median 300 us",
                        self.accepted(*analysis.split()),
                    )

    def test_waits(self) -> None:
        """Two timers that are always due together run after one wait."""
        node = "{name: %s, type: sensor, period_ms: 10, execution_time_ms: 1}"
        graph = self.written("pair.yaml", f"name: pair\nnodes:\n  - {node % 'A'}\n  - {node % 'B'}\n")
        plan = ("--executors", "default", "--phases", "synchronous")
        facts, run, found = self.round_trip("pair", *plan, graph=graph)
        self.check_instants(run, found, graph)
        (executor,) = facts["executors"]
        self.assertEqual((executor["dispatch"]["n"], executor["wait"]["n"]), (300, 0))

    def test_pinned_threads_that_take_turns_are_not_green(self) -> None:
        """Of four threads without priority on two processors, three are pinned: no time slices on all
        processors explain the turns."""
        timers = {"A": (70, 12), "A2": (110, 12), "B": (30, 8), "C": (50, 20)}
        nodes = [
            {"name": name, "type": "sensor", "period_ms": period, "execution_time_ms": work}
            for name, (period, work) in timers.items()
        ]
        executors = [
            {"name": name, "executor": "default", "processors": [processor], "owns": [name]}
            for name, processor in (("A", 0), ("A2", 0), ("C", 1))
        ] + [{"name": "B", "executor": "default", "owns": "rest"}]
        graph, deployment = self.folder / "graph.yaml", self.folder / "pinned.yaml"
        graph.write_text(json.dumps({"name": "pinned", "nodes": nodes}))
        deployment.write_text(json.dumps({"name": "pinned", "executors": executors}))
        plan = ("--graph", graph, "--deployments", deployment, "--duration", 5, "--cores", 2)
        check = self.reimported(*plan)[0]["self_check"]
        self.assertEqual(check["light"], "yellow")
        self.assertIn("4 threads share processors", " ".join(check["reasons"]))
