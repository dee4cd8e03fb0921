# SPDX-License-Identifier: Apache-2.0
"""The recorded graphs that ship."""

from pathlib import Path

from hotpath_command import CommandTest

SOURCE = Path(__file__).resolve().parents[2]
RECORDED = SOURCE / "reference_system" / "graphs" / "recorded" / "deployments"


class RecordedGraphs(CommandTest):
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
        deployment = RECORDED / "autoware_universe.yaml"
        words = "--graph autoware_universe --phases random --repetitions 5 --duration 40".split()
        run = self.measure("simulate", *words, "--deployments", deployment)
        (executor,) = run.summary()["executors"]
        predicted = {c["chain"]: c["end_to_end_latency_ms"] for c in executor["chains"]}
        for chain, (p50, p99) in measured.items():
            self.assertLess(abs(predicted[chain]["p50"] / p50 - 1), 0.15, chain)
            self.assertLess(abs(predicted[chain]["p99"] / p99 - 1), 0.15, chain)
