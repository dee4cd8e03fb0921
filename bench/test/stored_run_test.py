# SPDX-License-Identifier: Apache-2.0
"""A stored run records all of its options: `hotpath validate` repeats a simulated run exactly, with
any options, even if the files that the options named have changed since."""

import json
import re
from pathlib import Path
from typing import Any

from hotpath_command import CommandTest, RunFolder

EXECUTORS = "default,events-re,rm-ro,rm-ro:first,multi,cbg:3"
BASE = {"--executors": EXECUTORS, "--duration": 1.5, "--warm-up": 0.5}
DEPLOYMENT = """name: mine
executors:
  - {name: front, executor: "%s", policy: "fifo:10", processors: [1], owns: [FrontLidarDriver, PointsTransformerFront]}
  - {name: others, executor: "multi", owns: rest}
"""
# By option of `simulate`, and what of it: the options of its test run. The test makes the files and folders.
USES: dict[str, dict[str, Any]] = {
    "--executors": {"--executors": "all"},
    "--deployments": {
        "--executors": "multi",
        "--deployments": "isolated,prioritized,mine.yaml",
        "--cores": 2,
    },
    "--graph": {"--graph": "callbacks"},
    "--load": {"--load": 60},
    "--rate": {"--rate": 110},
    "--copies": {"--copies": 2, "--load": 40},
    "--work": {"--work": "wall", "--load": 90},
    "--phases": {"--phases": "random", "--repetitions": 2},
    "--phases file": {"--phases": "phases.csv"},
    "--phases step": {"--phases": "creation:7"},
    "--executors variants": {"--executors": "rm-ro:first:fifo,edf-ro:first", "--load": 95},
    "--entity-order": {"--entity-order": "order.txt", "--phases": "synchronous"},
    "--phases run": {"--phases": "other"},
    "--duration": {"--duration": 3},
    "--warm-up": {"--warm-up": 1.5},
    "--repetitions": {"--repetitions": 3, "--execution-times": "uniform"},
    "--seed": {"--seed": 7, "--execution-times": "uniform"},
    "--max-backlog": {"--max-backlog": 100000, "--executors": "events-ro", "--load": 300, "--duration": 60},
    "--cores": {"--cores": 4, "--load": 250},
    "--platform timer thread": {"--platform": "timer_thread=equal", "--load": 95},
    "--platform release cost": {"--platform": "release_cost_us=333.3"},
    "--platform pass cost": {"--platform": "pass_cost_us=251"},
    "--platform dispatch cost": {"--platform": "dispatch_cost_us=40"},
    "--platform of timers": {"--platform": "timer_dispatch_cost_us=70"},
    "--platform of others": {"--platform": "dispatch_cost_us=30,subscription_dispatch_cost_us=90"},
    "--platform wait": {"--platform": "wait_cost_us=300"},
    "--platform wait per entity": {"--platform": "wait_cost_per_entity_us=4"},
    "--platform wake-up": {"--platform": "wake_up_us=500"},
    "--platform delivery": {"--platform": "delivery_delay_us=900"},
    "--execution-times": {"--execution-times": "replay:other", "--cores": 2},
    "--threads": {"--threads": 1},
}
NOT_STORED = {
    "--help": "runs nothing",
    "--json": "changes no result",
    "--output": "changes no result",
    "--no-trace": "leaves no jobs to compare",
}


class StoredRun(CommandTest):
    def write_files(self, executor: str, timers: Any, order: Any) -> None:
        (self.folder / "mine.yaml").write_text(DEPLOYMENT % executor)
        rows = [f"{timer},{5 * i % 13}" for i, timer in enumerate(timers)]
        (self.folder / "phases.csv").write_text("\n".join(["task,first_release_ms", *rows]) + "\n")
        (self.folder / "order.txt").write_text("\n".join(order) + "\n")

    def simulate(self, output: str | Path, options: Any) -> Any:
        words = [str(word) for option in options.items() for word in option]
        self.accepted("simulate", *words, "--output", self.folder / output)
        return RunFolder(self.folder / output)

    def test_validate_simulates_a_run_again_whatever_options_it_had(self) -> None:
        options = set(
            re.findall(r"^ +(?:-h,)?(--[a-z-]+)", self.accepted("simulate", "--help"), re.MULTILINE)
        )
        self.assertEqual(
            options,
            {use.split()[0] for use in USES} | set(NOT_STORED),
            "each option is tried here, or it says why not",
        )
        other = self.simulate(
            "other", BASE | {"--phases": "random", "--execution-times": "uniform", "--load": 70}
        )
        timers = [task["task"] for task in other.run["tasks"] if task["kind"] == "timer"]
        self.write_files("rm-ro:first", timers, [task["task"] for task in reversed(other.run["tasks"])])
        runs = {option: self.simulate(option[2:], BASE | use) for option, use in USES.items()}
        for option, run in runs.items():
            self.check_command(option, run)
        self.write_files("default", timers[::-1], timers[:1])  # validate must not read these files again
        self.accepted("diff", "--simulated", *(run.path for run in runs.values()), "--output", "validation")
        result = json.loads((self.folder / "validation" / "validation.json").read_text())
        compared: dict[Any, Any] = {}
        for entry in result["runs"]:
            option = "--" + entry["run"].rpartition("/")[2]
            compared[option] = compared.get(option, 0) + 1
            with self.subTest(option=option, executor=entry["executor"]):
                both = entry["comparison"]
                self.assertEqual(f"{both['similarity']:.4f}", "1.0000")
                self.assertIsNone(both["first_difference"])
                self.assertGreater(both["measured"]["jobs"], 100)
                self.assertEqual(both["measured"], both["other"])
                if entry["latencies"]:
                    self.assertEqual(entry["latencies"]["measured_ms"], entry["latencies"]["simulated_ms"])
        self.assertEqual(compared, {option: len(run.run["runs"]) for option, run in runs.items()})

    def check_command(self, option: str, run: RunFolder) -> None:
        """The command that run.json stores makes the same files again."""
        again = self.folder / f"again{option}"
        self.accepted(*run.run["command"], "--output", again)
        for name in ("run.json", "summary.json", "jobs.csv", "chains.csv"):
            with self.subTest(option=option, file=name):
                self.assertEqual((again / name).read_bytes(), (run.path / name).read_bytes())

    def test_the_command_is_stored_without_what_changes_no_result(self) -> None:
        run = self.simulate("run", {"--executors": "rm-ro", "--rate": 110, "--duration": 1, "--threads": 1})
        self.assertEqual(run.run["command"], ["simulate", "--executors=rm-ro", "--rate=110", "--duration=1"])
