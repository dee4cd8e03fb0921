# SPDX-License-Identifier: Apache-2.0
"""What the commands say of overload, starvation and callback groups, on small graphs of field/."""

import json
from typing import Any

from analyze_case import COMMAND, SENSOR, graph_text
from field_test import FIELD
from hotpath_command import CommandTest, RunFolder

SLOW, PONG, EXCLUSIVE = (FIELD / f"{name}.yaml" for name in ("slow_timer", "pong", "exclusive"))
GROUP = "the callback group of listener/process has 150 % of one core of work for 1 thread"


class Overload(CommandTest):
    def advise(self, *arguments: object) -> tuple[str, Any]:
        out = self.accepted("advise", *arguments, "--costs", "graph", "--cores", 2, "--output", "advice")
        return out, json.loads((self.folder / "advice" / "advice.json").read_text())

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
        self.rejected(*"simulate full.yaml --executors rm-ro --duration 20".split(), says="overload")

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

    def test_advice_keeps_a_timer_and_its_group_apart(self) -> None:
        out, advice = self.advise(SLOW, "--repetitions", 2, "--duration", 5)
        self.assertIsNone(advice["recommended"])
        self.assertIn("the timer thread runs listener/process beside the other callbacks of its", out)
        self.assertIn(f"cannot keep up: {GROUP}", out)
        of = {row["name"]: row for row in advice["ranking"]}
        self.assertEqual([of[n]["timer_beside_group"] for n in ("rm-re", "rm-ro")], ["listener/process", ""])

    def test_a_reader_that_leaves_out_samples_loses_nothing(self) -> None:
        _, advice = self.advise(PONG, "--repetitions", 1, "--duration", 20, "--for", "losses")
        lost = {row["name"]: row["lost_percent"] for row in advice["ranking"] if not row["overload"]}
        self.assertGreater(lost["default"], 50)
        self.assertLess(lost["isolated"], 0.1)
        self.assertLess(lost[advice["recommended"]], 0.1)

    def test_real_time_threads_and_idle_threads_are_named(self) -> None:
        words = ("simulate", PONG, "--deployments", FIELD / "pong_fifo.yaml", "--cores", 2, "--duration", 5)
        err = self.command(*words)[2]
        self.assertRegex(
            err, "note: fifo50: executor pong has 100 % .* at SCHED_FIFO .* up to 6.11 .* 6.12 on"
        )
        err = self.command("simulate", EXCLUSIVE, "--executors", "cbg:2", "--cores", 2, "--duration", 1)[2]
        self.assertIn("cbg:2: it has 2 threads for 1 mutually exclusive group, so more than 1 of", err)

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
