# SPDX-License-Identifier: Apache-2.0
"""Graphs from files of CARET, the rejection of other files, and the recorded graphs that ship."""

from pathlib import Path
from typing import Any

from hotpath_command import CommandTest

SOURCE = Path(__file__).resolve().parents[2]
RECORDED = SOURCE / "reference_system" / "graphs" / "recorded" / "deployments"

# Two nodes in series and one whose timer takes what is newest; CARET could not tell who publishes /c.
ARCHITECTURE = """
named_paths:
- path_name: all
  node_chain:
  - {node_name: /ns/first, publish_topic_name: /a, subscribe_topic_name: UNDEFINED}
  - {node_name: /second, publish_topic_name: /b, subscribe_topic_name: /a}
  - {node_name: /third, publish_topic_name: UNDEFINED, subscribe_topic_name: /b}
- path_name: broken
  node_chain:
  - {node_name: /ns/first, publish_topic_name: /nowhere, subscribe_topic_name: UNDEFINED}
executors:
- {executor_type: multi_threaded_executor, executor_name: executor_0, callback_group_names: [/ns/first/g0, /second/g0]}
- {executor_type: single_threaded_executor, executor_name: executor_1, callback_group_names: [/third/g0]}
- {executor_type: single_threaded_executor, executor_name: executor_2, callback_group_names: []}
nodes:
- node_name: /ns/first
  callback_groups:
  - {callback_group_type: mutually_exclusive, callback_group_name: /ns/first/g0, callback_names: [/ns/first/c0]}
  callbacks: [{callback_name: /ns/first/c0, callback_type: timer_callback, period_ns: 50000000, symbol: x}]
  publishes: [{topic_name: /a, callback_names: [/ns/first/c0]}]
- node_name: /second
  callback_groups:
  - callback_group_type: reentrant
    callback_group_name: /second/g0
    callback_names: [/second/c0, /second/c1, /second/c2]
  callbacks:
  - {callback_name: /second/c0, callback_type: subscription_callback, topic_name: /a, symbol: x}
  - {callback_name: /second/c1, callback_type: timer_callback, period_ns: 1000000000, symbol: diagnostics}
  - {callback_name: /second/c2, callback_type: subscription_callback, topic_name: /outside, symbol: x}
  - {callback_name: /second/c3, callback_type: service_callback, symbol: x}
  variable_passings: [{callback_name_write: UNDEFINED, callback_name_read: UNDEFINED}]
  publishes: [{topic_name: /b, callback_names: [UNDEFINED]}, {topic_name: /unheard, callback_names: [UNDEFINED]}]
- node_name: /third
  callback_groups:
  - {callback_group_type: mutually_exclusive, callback_group_name: /third/g0, callback_names: [/third/c0, /third/c1]}
  callbacks:
  - {callback_name: /third/c0, callback_type: subscription_callback, topic_name: /b, symbol: x}
  - {callback_name: /third/c1, callback_type: subscription_callback, topic_name: /never, symbol: x}
- {node_name: /empty, callback_groups: []}
"""


def statistics(callback: Any, period: Any, times: Any) -> str:
    values = zip(("min", "p50", "p95", "p99", "max"), times)
    latency = "".join(f"        {key}: {value}\n" for key, value in values)
    return f"    {callback}:\n      Period:\n        avg: {period}\n      Latency:\n{latency}"


STATISTICS = {
    "first": "/ns/first:\n  callbacks:\n" + statistics("/ns/first/c0", 50.0, (1, 2, 3, 4, 5)),
    "others": "/second:\n  callbacks:\n"
    + statistics("/second/c0", 50.1, (1, 1, 1, 1, 2))
    + statistics("/second/c1", 1000.0, (0, 0, 0, 0, 0))
    + statistics("/second/c2", 20.0, (0, 0, 0, 0, 1))
    + "/third:\n  callbacks:\n"
    + statistics("/third/c0", 50.0, (7, 7, 7, 7, 7))
    + statistics("/third/c1", "---", ["---"] * 5),
}


class ImportFiles(CommandTest):
    def write(self, name: str, text: str) -> Any:
        path = self.folder / name
        path.write_text(text)
        return path

    def imported(self, *arguments: object) -> tuple[Any, str]:
        out = self.accepted("import", *arguments, "--output", self.folder / "out")
        return out, (self.folder / "out" / "graph.yaml").read_text()

    def refused(self, *arguments: object) -> Any:
        code, _, err = self.command("import", *arguments, "--output", self.folder / "out")
        self.assertEqual(code, 2, err)
        self.assertFalse((self.folder / "out").exists())
        return err

    def caret(self) -> Any:
        for name, text in STATISTICS.items():
            (self.folder / "stats").mkdir(exist_ok=True)
            (self.folder / "stats" / f"{name}.yaml").write_text(text)
        return self.write("architecture.yaml", ARCHITECTURE)

    def test_an_architecture_of_caret_becomes_a_graph(self) -> None:
        out, graph = self.imported("caret", self.caret(), "--stats", self.folder / "stats", "--cores", 4)
        self.assertIn("4 nodes, 3 timers, 3 subscriptions, 3 executors, 1 chains", out)
        self.assertIn("1 publications by callbacks that CARET names, 1 guessed", out)
        self.assertIn("1 callbacks that did not run", out)
        self.assertIn("1 callbacks of services", out)
        self.assertIn("path broken is not a chain: no callback of ns.first publishes /nowhere", out)
        self.assertIn("cores: 4", graph)
        self.assertIn("name: ns.first\n", graph)
        self.assertIn("execution_time_ms: {min: 1, p50: 2, p95: 3, p99: 4, max: 5}", graph)
        # The frequency rules the timer out.
        self.assertRegex(graph, r"subscription: a,.* publishes: b}  # guessed: publishes b")
        self.assertRegex(graph, r"name: external .*\n.*\n.*\n.*\n +- {timer: outside, period_ms: 20,")
        self.assertIn("nodes: [ns.first/c0, second/a, third/b]", graph)
        run = self.measure(
            *("simulate", "--graph", self.folder / "out" / "graph.yaml", "--duration", 10),
            *("--deployments", self.folder / "out" / "deployment.yaml"),
        )
        (executor,) = run.summary()["executors"]
        self.assertTrue(executor["loss_equations"]["hold"])
        latency = executor["chains"][0]["hot_path_latency_ms"]
        self.assertTrue(2 <= latency["min"] <= latency["max"] <= 7, latency)

    def test_without_statistics_a_timer_is_taken_for_the_publisher(self) -> None:
        out, graph = self.imported("caret", self.caret())
        self.assertIn("--stats FOLDER", out)
        self.assertIn("--cores", out)
        self.assertRegex(graph, r"timer: c1,.* publishes: {topic: b, last_of: \[a\]}}  # guessed")

    def test_what_caret_would_not_write_is_refused_with_its_line(self) -> None:
        good = self.caret()
        self.assertIn("no statistics", self.refused("caret", good, "--stats", self.folder / "nothing"))
        self.assertIn(":1: ", self.refused("caret", self.write("bad.yaml", "executors: []\n")))
        err = self.refused(
            "caret", self.write("bad.yaml", ARCHITECTURE.replace("period_ns: 50000000", "period_ns: x"))
        )
        self.assertRegex(err, r"bad\.yaml:\d+: .*whole number")
        self.assertIn("not valid YAML", self.refused("caret", self.write("bad.yaml", "nodes: [")))
        (self.folder / "stats" / "first.yaml").write_text("/ns/first:\n  callback: {}\n")
        err = self.refused("caret", good, "--stats", self.folder / "stats")
        self.assertIn("a node has no `callbacks`", err)

    def test_existing_results_stay(self) -> None:
        architecture = self.caret()
        self.imported("caret", architecture)
        code, _, err = self.command("import", "caret", architecture, "--output", self.folder / "out")
        self.assertEqual(code, 2)
        self.assertIn("holds files already", err)

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
        run = self.measure(
            *(
                "simulate",
                "--graph",
                "autoware_universe",
                "--deployments",
                RECORDED / "autoware_universe.yaml",
            ),
            *("--phases", "random", "--repetitions", 5, "--duration", 40),
        )
        (executor,) = run.summary()["executors"]
        predicted = {c["chain"]: c["end_to_end_latency_ms"] for c in executor["chains"]}
        for chain, (p50, p99) in measured.items():
            self.assertLess(abs(predicted[chain]["p50"] / p50 - 1), 0.15, chain)
            self.assertLess(abs(predicted[chain]["p99"] / p99 - 1), 0.15, chain)
