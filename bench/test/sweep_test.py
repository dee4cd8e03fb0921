# SPDX-License-Identifier: Apache-2.0
"""`hotpath sweep` and `hotpath capacity` as a user starts them: bytes that do not depend on threads,
resumption, faults, wrong use."""

import shutil
import signal
from pathlib import Path
from typing import Any

from hotpath_command import HOTPATH, CommandTest, csv_rows, document

SWEEP = """command: simulate
fixed: {graph: autoware, duration: 2, warm-up: 0.5, phases: random}
axes:
  load: [40, 80, 300]
  executors: [default, rm-ro]
repetitions: 4
"""


class SweepTest(CommandTest):
    def sweep_file(self, text: Any = SWEEP) -> str:
        return self.written("sweep.yaml", text).name

    def table(self, folder: str | Path) -> Any:
        return (self.folder / folder / "table.csv").read_bytes()

    def rows(self, folder: str | Path) -> list[Any]:
        return csv_rows(self.folder / folder / "table.csv")

    def sweep(self, output: str | Path, *arguments: object, text: Any = SWEEP) -> Any:
        return self.accepted("sweep", self.sweep_file(text), "--output", output, *arguments)


class Sweeps(SweepTest):
    def test_the_table_does_not_depend_on_threads(self) -> None:
        out = self.sweep("one", "--threads", 1)
        self.assertRegex(out, r"20 of \d+ cells of `simulate` to do, about .* s on 1 thread\(s\)")
        self.sweep("seven", "--threads", 7)
        self.assertEqual(self.table("one"), self.table("seven"))
        rows = self.rows("one")
        self.assertEqual(len(rows), 24)
        self.assertEqual([int(row["cell"]) for row in rows], list(range(24)))
        self.assertEqual({row["executor"] for row in rows}, {"default", "rm-ro"})

    def test_the_example_runs(self) -> None:
        self.assertIn("next: hotpath sweep new.yaml", self.accepted("sweep", "--new", "new.yaml"))
        self.accepted("sweep", "new.yaml", "--output", "out")
        self.assertEqual(len(self.rows("out")), 5 * 2 * 5)
        self.assertEqual(document(self.folder / "out" / "sweep.json")["repetitions"], 5)

    def test_a_key_of_a_node_is_an_axis(self) -> None:
        key = "set.FrontLidarDriver.period_ms"
        fixed = "fixed: {executors: rm-ro, duration: 2, warm-up: 0}"
        self.sweep("out", text=f"command: simulate\n{fixed}\naxes: {{{key}: [50, 100]}}\n")
        fast, slow = self.rows("out")
        self.assertEqual((fast[key], slow[key]), ("50", "100"))
        more = 3 * 20  # of the driver and its two readers
        self.assertGreaterEqual(int(fast["callbacks"]), int(slow["callbacks"]) + more)

    def test_a_cell_is_what_simulate_says_of_it_and_overload_is_a_row(self) -> None:
        self.sweep("out")
        rows = self.rows("out")
        wanted = {"load": "80", "executor": "rm-ro", "repetition": "2"}
        row = next(r for r in rows if wanted.items() <= r.items())
        words = "--graph autoware --duration 2 --warm-up 0.5 --phases random --load 80 --executors rm-ro"
        run = self.measure("simulate", *words.split(), "--seed", row["seed"])
        chain = run.summary()["executors"][0]["chains"][0]
        self.assertAlmostEqual(float(row["hot_path_p50_ms"]), chain["hot_path_latency_ms"]["p50"])
        self.assertAlmostEqual(float(row["end_to_end_max_ms"]), chain["end_to_end_latency_ms"]["max"])
        overloaded = [r for r in rows if r["load"] == "300" and r["executor"] == "rm-ro"]
        self.assertEqual(len(overloaded), 4)
        self.assertTrue(all(r["failure"] or int(r["deadline_overruns"]) > 0 for r in overloaded))

    def test_an_interrupted_sweep_goes_on_with_the_same_result(self) -> None:
        text = SWEEP.replace("repetitions: 4", "repetitions: 40")
        self.sweep("whole", text=text)
        process = self.start("sweep", self.sweep_file(text), "--output", "cut", "--threads", "1")
        journal = self.folder / "cut" / "cells.journal"
        self.wait_for(lambda: journal.exists() and journal.stat().st_size > 0, "no cell is done")
        process.send_signal(signal.SIGSTOP)
        before = journal.read_bytes()
        resumed = ("sweep", "sweep.yaml", "--output", "cut")
        self.rejected(*resumed, says="another process runs the sweep in cut; wait until it ends")
        self.assertEqual(journal.read_bytes(), before)
        process.send_signal(signal.SIGKILL)
        self.finish(process)
        out = self.accepted(*resumed)
        self.assertRegex(out, r"\d+ of 240 cells are in cut already")
        self.assertEqual(self.table("cut"), self.table("whole"))
        journal.write_bytes(journal.read_bytes()[:-10])
        _, out, err = self.command(*resumed)
        self.assertIn("239 of 240 cells are in cut already", out)
        self.assertRegex(err, r"note: cut/cells.journal:.* run again\n")
        self.assertEqual(self.table("cut"), self.table("whole"))
        self.accepted(*resumed)  # nothing is left to do

    def test_kept_folders_and_analyses(self) -> None:
        self.sweep("kept", text=SWEEP.replace("300", "20") + "keep: all\n")
        folders = sorted(p.name for p in (self.folder / "kept" / "cells").iterdir())
        self.assertEqual(len(folders), 24)
        self.assertTrue((self.folder / "kept" / "cells" / folders[0] / "jobs.csv").exists())
        self.sweep("plain", text=SWEEP.replace("300", "20"))
        self.assertEqual(self.table("kept"), self.table("plain"))
        fixed = "fixed: {graph: timers_only_60, executors: [rm-ro]}"
        self.sweep("bounds", text=f"command: analyze\n{fixed}\naxes: {{load: [50, 60]}}\n")
        rows = self.rows("bounds")
        self.assertEqual({row["load"] for row in rows}, {"50", "60"})
        self.assertTrue(any(row["bound_ns"] for row in rows))

    def test_live_cells(self) -> None:
        text = "command: run\nfixed: {graph: timers_only_60, load: 5, duration: 0.3, warm-up: 0, "
        text += "transport: intra_process}\naxes: {executors: [default, rm-ro]}\n"
        self.sweep("live", text=text)
        rows = self.rows("live")
        self.assertEqual([row["executor"] for row in rows], ["default", "rm-ro"])
        self.assertTrue(all(row["failure"] == "" and int(row["callbacks"]) > 0 for row in rows))

    def test_wrong_use_names_file_and_line(self) -> None:
        analyze = "command: analyze\nfixed: {%s}\naxes: {load: [10]}\n"
        for text, said in (
            (SWEEP.replace("load: [40, 80", "laod: [40"), "sweep.yaml:4: `simulate` has no option --laod"),
            (SWEEP.replace("executors", "executor"), "sweep.yaml:5: `simulate` has no option --executor"),
            (SWEEP.replace("80, 300", "-1"), "sweep.yaml:4: --load: `-1` is not a number"),
            (SWEEP.replace("rm-ro]", "rm-or]"), "sweep.yaml:5: there is no executor `rm-or`"),
            (SWEEP.replace("re,", "re, seed: 3,", 1), "sweep.yaml:2: `seed` of a cell follows"),
            (analyze % "copies: 2", "sweep.yaml:3: --graph is required"),
            (analyze % "graph: autoware, strict: true", "sweep.yaml:3: --strict requires --trace"),
            (analyze % "graph: autoware, trace: x", "sweep.yaml:3: --load excludes --trace"),
        ):
            self.refused("sweep", self.sweep_file(text), "--output", "wrong", says=said)

    def test_a_long_sweep_asks_before_it_begins(self) -> None:
        text = SWEEP.replace("repetitions: 4", "repetitions: 10000").replace("duration: 2", "duration: 1000")
        words = ("sweep", self.sweep_file(text.replace("300]", "90]")), "--threads", 1, "--output", "long")
        code, out, err = self.command(*words)
        self.assertEqual((code, "--yes" in err), (2, True), err)
        self.assertIn("59996 of 60000 cells of `simulate` to do, about", out)


class Capacities(SweepTest):
    def capacity(self, *arguments: object) -> tuple[Any, list[Any]]:
        words = ["capacity", "--duration", "2", "--repetitions", "3", "--output", "capacity", *arguments]
        out = self.accepted(*words)
        rows = csv_rows(self.folder / "capacity" / "levels.csv")
        self.assertEqual(len(document(self.folder / "capacity" / "capacity.json")["rows"]), len(rows))
        return out, rows

    def test_rm_ro_carries_what_the_analysis_accepts(self) -> None:
        out, levels = self.capacity("--graph", "timers_only_80", "--executors", "rm-ro", "--from", 40)
        sources = ("simulated", "analysis")
        held = [{float(r["load"]) for r in levels if (r["source"], r["holds"]) == (s, "1")} for s in sources]
        self.assertGreaterEqual(max(held[0]), max(held[1]))
        self.assertGreater(max(held[1]), 60)
        says = "3 of 3 repetitions of 2 s must hold: with 95 % confidence at least 36.8 % of all such runs do"
        self.assertIn(says, out)

    def test_rates_and_copies_multiply_the_load(self) -> None:
        _, levels = self.capacity(*"--load 30 --executors rm-ro --over copies --from 1 --to 5".split())
        simulated = [(r["holds"], r["capacity"]) for r in levels if r["source"] == "simulated"]
        self.assertEqual(simulated, [("1", "0"), ("1", "0"), ("1", "1"), ("0", "0"), ("0", "0")])
        shutil.rmtree(self.folder / "capacity")
        rates = "--load 40 --executors rm-ro --over rate --from 50 --to 400 --resolution 10"
        _, levels = self.capacity(*rates.split())
        most = max(float(r["rate"]) for r in levels if r["source"] == "simulated" and r["holds"] == "1")
        self.assertGreater(most, 150)
        self.assertLessEqual(most, 250)


class ChildrenThatRefuse(SweepTest):
    """Wrong use that `run` or `analyze` rejects ends a sweep without a result."""

    def test_of_a_sweep(self) -> None:
        fixed = "graph: timers_only_60, duration: 0.3, warm-up: 0, transport: intra_process, processes: 2"
        loads = "axes: {load: [10, 20]}\n"
        said = "sweep.yaml: cell 0, load 10: --processes 2 needs --transport fastdds"
        for text, says, *more in (
            (f"command: run\nfixed: {{{fixed}}}\n{loads}", said),
            ("command: analyze\naxes: {graph: [nope, timers_only_60]}\n", "cell 0, graph nope: "),
            (f"command: run\n{loads}", "--threads", "--threads", "2"),
        ):
            shutil.rmtree(self.folder / "refused", ignore_errors=True)
            words = ("sweep", self.sweep_file(text), "--output", "refused", *more)
            self.rejected(*words, says=says, out=None)
            self.assertFalse((self.folder / "refused" / "table.csv").exists())


class TwoBuilds(CommandTest):
    def test_compare_against_the_same_build(self) -> None:
        words = "run --executors default --graph timers_only_60 --load 5 --duration 0.3 --warm-up 0"
        words += " --transport intra_process --repetitions 3 --output ab --junit gate.xml --markdown gate.md"
        code, out, err = self.command(*words.split(), "--against", HOTPATH)
        self.assertIn(code, (0, 1), err)  # noise decides on so short a run
        self.assertIn("; interleaved repetitions pair by pair; at most 1 % false alarms)", out, err)
        self.assertEqual(err.count("old build"), 3)
        self.assertEqual(len(list((self.folder / "ab" / "old").iterdir())), 3)
        self.assertIn("<testsuite ", (self.folder / "gate.xml").read_text())
        self.assertIn("| measure | old | new |", (self.folder / "gate.md").read_text())

    def test_a_missing_graph_or_program_is_rejected(self) -> None:
        for graph, program, expected, says in (
            ("nope", HOTPATH, 2, "(new|old) build, repetition 0: nope: there is no graph"),
            ("autoware", "/nonexistent", 1, "/nonexistent"),
        ):
            words = ("run", graph, "--against", program, "--output", "ab")
            self.assertRegex(self.rejected(*words, code=expected, out=None), says)
