# SPDX-License-Identifier: Apache-2.0
"""What the commands say of overload, starvation and callback groups, on small graphs."""

import json
from pathlib import Path
from typing import Any

import package
from analyze_case import COMMAND, SENSOR, graph_text
from field_test import FIELD
from hotpath_command import CommandTest, RunFolder, csv_rows, document

SLOW, PONG = FIELD / "slow_timer.yaml", FIELD / "pong.yaml"
GROUP = "the callback group of listener/process has 150 % of one core of work for 1 thread"

REFERENCE = Path(__file__).resolve().parents[2] / "reference_system" / "ros2_reference" / "starvation.csv"
EXAMPLES = (4, 5, 6)
# A timer's first release is one period after the start, so a 1 s timer has 16 releases in 16.5 s.
PLAN = ("--cores", 2, "--phases", "given", "--duration", 16.5, "--warm-up", 0)


class Overload(CommandTest):
    def advise(self, *arguments: object) -> tuple[str, Any]:
        out = self.accepted("advise", *arguments, "--costs", "graph", "--cores", 2, "--output", "advice")
        return out, document(self.folder / "advice" / "advice.json")

    def test_an_overloaded_executor_is_a_row_beside_the_others(self) -> None:
        (self.folder / "full.yaml").write_text(graph_text(SENSOR.format("Full", 10, 12)))
        words = "simulate full.yaml --executors default,rm-ro --duration 20 --repetitions 2 --output"
        for more in ((), ("--no-trace",)):
            output = f"run{len(more)}"
            out = self.accepted(*words.split(), output, *more)
            self.assertRegex(out, r"\nrm-ro +overloaded +-.*\n(.*\n)+rm-ro: overload: more than 100 ")
            run = RunFolder(self.folder / output)
            first, second = run.summary()["executors"]
            self.assertEqual((first["overload"], first["repetitions"], second["repetitions"]), ("", 2, 0))
            self.assertIn("utilisation is 1.200", second["overload"])
            self.assertEqual([bool(r["failure"]) for r in run.run["runs"]], [False, False, True, True])
            self.assertEqual(len(run.run["failures"]), 1)
            self.assertIn("rm-ro is overloaded: it has 120 % of", "".join(run.run["warnings"]))
        stored = (self.folder / "run0" / "summary.json").read_bytes()
        self.accepted("report", "--summary", "run0")
        self.assertEqual((self.folder / "run0" / "summary.json").read_bytes(), stored)
        self.checked("run0")
        self.rejected(
            "explain", "run0", "--task", "Full", "--executors", "rm-ro", says="rm-ro: overload: more than"
        )
        for limit, says in ("", "utilisation is 1.200"), ("--max-backlog 7", "more than 7"):
            overloaded = f"simulate full.yaml --executors rm-ro {limit}"
            self.rejected(*overloaded.split(), says=("overload", says))

    def test_every_command_states_overload_and_starvation(self) -> None:
        self.assertIn(f"slow_timer is overloaded: {GROUP}.\n", self.accepted("graph", SLOW))
        words = (SLOW, "--executors", "multi:2,default", "--cores", 2)
        code, out, err = self.command("simulate", *words, "--output", "run")
        self.assertEqual(code, 0, err)
        self.assertIn(f"note: multi:2 is overloaded: {GROUP}.\n", err)
        self.assertRegex(out, r"\nmulti:2: listener/chatter (never ran|ran \d of \d+ times)\n")
        starved = RunFolder(self.folder / "run").summary()["executors"][0]["starved"]
        self.assertIn("listener/chatter", starved[0])
        explained = json.loads(self.accepted("explain", "run", "--task", "talker/pub", "--json"))
        self.assertEqual(explained["warnings"][0], f"multi:2 is overloaded: {GROUP}.")
        self.assertEqual(explained["warnings"][-1], f"multi:2 starves callbacks: {starved[0]}.")
        self.assertIn("\nmulti:2 is overloaded: ", self.accepted("analyze", *words, "--csv", "bounds.csv"))
        self.assertIn(",150", (self.folder / "bounds.csv").read_text())
        self.accepted("simulate", "autoware", "--load", 140, "--duration", 2, "--output", "high")
        self.accepted("report", "high", "--output", "page")  # some of its tasks have no bound

    def test_advice_keeps_a_timer_and_its_group_apart(self) -> None:
        out, advice = self.advise(SLOW, "--repetitions", 2, "--duration", 5)
        self.assertIsNone(advice["recommended"])
        self.assertIn("the timer thread runs listener/process beside the other callbacks of its", out)
        self.assertIn(f"cannot keep up: {GROUP}", out)
        of = {row["name"]: row for row in advice["ranking"]}
        self.assertEqual([of[n]["timer_beside_group"] for n in ("rm-re", "rm-ro")], ["listener/process", ""])

    def test_the_page_of_an_advice(self) -> None:
        words = "--load 120 --executors default,multi:2 --now multi:2 --repetitions 1 --duration 2".split()
        _, advice = self.advise("autoware", *words)
        package.write_advice(self.folder, self.environment, self.folder / "advice")
        text = (self.folder / "advice" / "advice.svg").read_text()
        self.assertIn("multi:2 (now)", text)
        self.assertNotIn("default", text)
        page = (self.folder / "advice" / "report.md").read_text()
        self.assertIn(advice["sentences"][0], page)
        self.assertIn(f"| default |  |  |  |  |  | {advice['ranking'][1]['overload']} |", page)
        (self.folder / "advice" / "advice.json").write_text(json.dumps(advice | {"version": "0.0.1"}))
        done = package.call(self.folder, self.environment, "advice", "advice")
        self.assertRegex(f"{done.returncode} {done.stderr}", "^2 .* did not write it; run `hotpath adv")

    def test_a_reader_that_leaves_out_samples_loses_nothing(self) -> None:
        _, advice = self.advise(PONG, "--repetitions", 1, "--duration", 20, "--for", "losses")
        lost = {row["name"]: row["lost_percent"] for row in advice["ranking"] if not row["overload"]}
        self.assertGreater(lost["default"], 50)
        self.assertLess(lost["isolated"], 0.1)
        self.assertLess(lost[advice["recommended"]], 0.1)

    def test_advice_names_what_other_chains_get(self) -> None:
        nodes = [SENSOR.format(n, p, f"{c}, output: {n}") for n, p, c in (("Fast", 20, 1), ("Slow", 100, 30))]
        sinks = [COMMAND.format(f"{n}Sink", n, c) for n, c in (("Fast", 1), ("Slow", 20))]
        chain = "{{name: {0}, nodes: [{0}, {0}Sink], sources: [{0}], sink: {0}Sink}}"
        chains = f"chains: [{chain.format('Fast')}, {chain.format('Slow')}]"
        (self.folder / "two.yaml").write_text(graph_text(*nodes, *sinks, more=chains))
        words = "two.yaml --executors default,rm-ro --repetitions 2 --duration 5 --for Fast:p99"
        _, advice = self.advise(*words.split())
        self.assertEqual(advice["recommended"], "rm-ro")
        slow = [r["chains_ms"]["Slow"]["p99"] for r in advice["ranking"]]
        says = f"hot-path latency (p99): Slow {slow[0]:.1f} ms instead of {slow[1]:.1f} ms."
        self.assertIn(f"Chains beside the objective, {says}", advice["sentences"])


class Starvation(CommandTest):
    """The published examples against the jobs that the real executors ran."""

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
            if example == 4:
                self.assertAlmostEqual(tasks["multi:2"][1]["longest_wait_ms"], 16_500 - 1000.05)
                self.assertIn("\nmulti-fair:2: Node/timer2 waited up to 15", out)

    def test_multi_jazzy_starves_nobody(self) -> None:
        for example in EXAMPLES:
            # The timers of one node enter the wait set together, in the order of a hash map.
            run, out = self.simulate(example, "--executors", "multi-jazzy:2", "--entity-order", "reverse")
            self.check_counts(example, "jazzy", self.tasks(run)["multi-jazzy:2"])
            self.assertNotIn("never ran", out)
