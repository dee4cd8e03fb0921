# SPDX-License-Identifier: Apache-2.0
"""Compares `simulate` on the published starvation examples with the jobs that the real executors
ran."""

from pathlib import Path
from typing import Any

from hotpath_command import CommandTest, RunFolder, csv_rows

REFERENCE = Path(__file__).resolve().parents[2] / "reference_system" / "ros2_reference" / "starvation.csv"
EXAMPLES = (4, 5, 6)
# A timer's first release is one period after the start, so a 1 s timer has 16 releases in 16.5 s.
PLAN = ("--cores", 2, "--phases", "given", "--duration", 16.5, "--warm-up", 0)


class Starvation(CommandTest):
    def simulate(self, example: Any, *arguments: str) -> tuple[Any, Any]:
        """(run folder, standard output) of a simulation."""
        output = self.folder / f"{example}{'-'.join(arguments)}"
        out = self.accepted("simulate", f"starvation_{example}", *PLAN, *arguments, "--output", output)
        return RunFolder(output), out

    def tasks(self, run: Any) -> dict[Any, Any]:
        return {e["executor"]: e["tasks"] for e in run.summary()["executors"]}

    def check_counts(self, example: Any, ros2: Any, tasks: Any) -> None:
        rows = [r for r in csv_rows(REFERENCE) if r["ros2"] == ros2 and int(r["example"]) == example]
        (counts,) = ([int(n) for name, n in r.items() if name.startswith("timer") and n] for r in rows)
        for task, real in zip(tasks, counts, strict=True):
            started = task["ran"] + task["running"]
            with self.subTest(example=example, ros2=ros2, task=task["task"]):
                self.assertAlmostEqual(started, real, delta=1 if real else 0)
                self.assertEqual(task["never_ran"], real == 0)

    def test_multi_starves_as_humble_and_the_remedy_does_not(self) -> None:
        for example in EXAMPLES:
            run, out = self.simulate(example, "--executors", "multi:2,multi-fair:2")
            tasks = self.tasks(run)
            self.check_counts(example, "humble", tasks["multi:2"])
            starved = [t["task"] for t in tasks["multi:2"] if t["never_ran"]]
            self.assertEqual(starved, ["Node/timer2" if example == 4 else "Node/timer4"])
            self.assertIn(f"\nmulti:2: {starved[0]} never ran\n", out)
            self.assertFalse(any(t["never_ran"] for t in tasks["multi-fair:2"]))

    def test_multi_jazzy_starves_nobody(self) -> None:
        for example in EXAMPLES:
            # The timers of one node enter the wait set together, in the order of a hash map.
            run, out = self.simulate(example, "--executors", "multi-jazzy:2", "--entity-order", "reverse")
            self.check_counts(example, "jazzy", self.tasks(run)["multi-jazzy:2"])
            self.assertNotIn("never ran", out)

    def test_waits_are_the_same_without_a_trace(self) -> None:
        run, out = self.simulate(4, "--executors", "multi:2,multi-fair:2")
        waits = {e: [t["longest_wait_ms"] for t in tasks] for e, tasks in self.tasks(run).items()}
        self.assertAlmostEqual(waits["multi:2"][1], 16_500 - 1000.05)
        self.assertIn("\nmulti-fair:2: Node/timer2 waited up to 15", out)
        untraced, _ = self.simulate(4, "--executors", "multi:2,multi-fair:2", "--no-trace")
        self.assertEqual(
            {e: [t["longest_wait_ms"] for t in tasks] for e, tasks in self.tasks(untraced).items()}, waits
        )
