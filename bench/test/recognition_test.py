# SPDX-License-Identifier: Apache-2.0
"""Simulates runs under the executors of the registry, exports them as traces, and checks which
executor `hotpath import ctf` recognises. HOTPATH_RECOGNITIONS sets the number of random graphs,
HOTPATH_RECOGNITION_SEED the first seed."""

import json
import os
import random
from collections import Counter
from typing import Any

from import_case import ImportTest

COUNT = int(os.environ.get("HOTPATH_RECOGNITIONS", "8"))
FIRST_SEED = int(os.environ.get("HOTPATH_RECOGNITION_SEED", "1000"))
PERIODS = (10, 20, 25, 30, 40, 50, 50, 60, 80, 100, 100, 120, 200)


def random_graph(numbers: random.Random) -> list[Any]:
    """Nodes of a graph: three to seven timers, and subscriptions in trees and joins behind them.
    Half of the timers have given priorities."""
    nodes: list[Any] = []
    topics: list[str] = []
    for i in range(numbers.randint(3, 7)):
        period = numbers.choice(PERIODS)
        nodes.append({"type": "sensor", "period_ms": period, "priority": numbers.randint(0, 5)})
        topics.append(f"N{i}")
    for i in range(len(nodes), len(nodes) + numbers.randint(3, 10)):
        join = len(topics) > 1 and numbers.random() < 0.25
        inputs = numbers.sample(topics, 2 if join else 1)
        depth = numbers.choice((1, 5, 10))
        if join:
            nodes.append({"type": "fusion", "inputs": [{"topic": t, "depth": depth} for t in inputs]})
        else:
            nodes.append({"type": "transform", "input": {"topic": inputs[0], "depth": depth}})
        topics.append(f"N{i}")
    for i, node in enumerate(nodes):
        node |= {"name": f"N{i}", "execution_time_ms": round(numbers.uniform(0.5, 8), 2)}
    return nodes


class Recognition(ImportTest):
    def recognised(self, graph: Any, executor: str, *options: object) -> Any:
        """(content of import.json) of a simulated run under the executor."""
        return self.reimported("--graph", graph, "--executors", executor, "--warm-up", 0, *options)[0]

    def test_unlikely_executors(self) -> None:
        """Executors that few decisions contradict remain in a tie, apart from those that explain all,
        and do not hide the design that ran."""
        graph = self.folder / "graph.yaml"
        graph.write_text(json.dumps({"name": "random", "nodes": random_graph(random.Random(6060))}))
        facts = self.recognised(
            graph, "edf-ro", "--duration", 20, "--load", 63, "--phases", "random", "--seed", 60,
            "--cores", 1, "--platform", "dispatch_cost_us=5",
        )  # fmt: skip
        found = facts["executors"][0]["recognition"]
        self.assertEqual(found["verdict"], "tie", found)
        self.assertIn("edf-ro", found["executors"])
        unlikely = {r["executor"] for r in found["ranking"] if r["unlikely"]}
        self.assertEqual(unlikely, {"cbg:1", "cbg-3178:1", "events-ro"})
        self.assertIn("cbg:1, events-ro, cbg-3178:1 cannot be excluded", found["sentence"])

    def test_random_graphs(self) -> None:
        """No executor is named wrongly, and nine in ten are recognised, alone or in a tie."""
        outcomes: Counter[str] = Counter()
        executors = self.executors()
        for i in range(COUNT):
            numbers = random.Random(FIRST_SEED + i)
            executor = executors[i % len(executors)]
            cores = 2 if executor.endswith(":2") else 1
            graph = self.folder / "graph.yaml"
            graph.write_text(json.dumps({"name": "random", "nodes": random_graph(numbers)}))
            load = round(numbers.uniform(60, 95) * cores)
            facts = self.recognised(
                graph, executor, "--duration", 20, "--load", load, "--cores", cores, "--phases", "random",
                "--seed", i, "--platform", "dispatch_cost_us=5",
            )  # fmt: skip
            found = [e["recognition"] for e in facts["executors"]]
            right = len(found) == 1 and executor in found[0]["executors"]
            verdict = found[0]["verdict"] if len(found) == 1 else "several executors"
            outcome = verdict if right or verdict not in ("recognised", "tie") else "wrong"
            outcomes[outcome] += 1
            if os.environ.get("HOTPATH_RECOGNITIONS"):
                told = (facts["self_check"]["light"], [r["sentence"] for r in found])
                print(FIRST_SEED + i, executor, load, outcome, *told, flush=True)
        if os.environ.get("HOTPATH_RECOGNITIONS"):
            print(dict(outcomes))
        self.assertEqual(outcomes["wrong"], 0, outcomes)
        self.assertGreaterEqual(outcomes["recognised"] + outcomes["tie"], 0.9 * COUNT, outcomes)
