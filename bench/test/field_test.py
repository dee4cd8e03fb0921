# SPDX-License-Identifier: Apache-2.0
"""Small graphs from reports, in field/, with values that were checked by hand; and what a run stores is
read back."""

import json
import os
import random
import shutil
from pathlib import Path
from typing import Any

from analyze_case import SENSOR, graph_text
from hotpath_command import CommandTest, RunFolder, csv_rows

FIELD = Path(__file__).with_name("field")
JITTERED = FIELD / "jittered_timers.yaml"
BURST = graph_text(SENSOR.format("Hog", 4000, 2000), SENSOR.format("Fast", 2, 0.1))


class FieldTest(CommandTest):
    def simulate(self, output: str, *arguments: object) -> RunFolder:
        return self.stored("simulate", *arguments, output=output)

    def rows(self, name: str) -> list[Any]:
        return csv_rows(self.folder / name)


class Judgements(FieldTest):
    def test_a_level_holds_if_every_repetition_does(self) -> None:
        words = "--executors fp-ro --over rate --from 50 --to 100 --resolution 50 --warm-up 0"
        graph = FIELD / "no_output.yaml"
        require = ("--require", "no-loss,latency:50", "--repetitions", 20)
        self.accepted("capacity", "--graph", graph, *words.split(), *require, "--output", "levels")
        rows = self.rows("levels/levels.csv")
        levels = {row["rate"]: (row["holds"], row["why"]) for row in rows if row["source"] == "simulated"}
        self.assertEqual(levels["100"], ("0", "a task never ran (14 of 20 repetitions)"))

    def test_a_chain_from_a_subscription_that_only_stores(self) -> None:
        self.rejected("graph", FIELD / "chain_from_fusion.yaml", says="source F/a of chain c0 stores samples")

    def test_a_job_that_waits_past_its_deadline_is_a_miss(self) -> None:
        hog, starved = SENSOR.format("Hog", 10, "10, priority: 1"), SENSOR.format("S", 100, "1, priority: 2")
        (self.folder / "starved.yaml").write_text(graph_text(hog, starved))
        for trace in ((), ("--no-trace",)):
            words = ("--graph", "starved.yaml", "--executors", "fp-ro", "--warm-up", 0, "--duration", 1)
            run = self.simulate(f"run{len(trace)}", *words, "--max-backlog", 1000, *trace)
            self.assertGreater(run.summary()["executors"][0]["deadline_overruns"], 0)

    def bounds(self, graph: str, executor: str, *more: str) -> dict[tuple[str, str, bool], dict[str, str]]:
        """Rows with a bound, by kind, name, and whether it is exact."""
        words = ("--executors", executor, "--phases", "given", "--exact", "--csv", "bounds.csv")
        self.accepted("analyze", FIELD / f"{graph}.yaml", *words, *more)
        rows = csv_rows(self.folder / "bounds.csv")
        return {(row["kind"], row["name"], "exact" in row["method"]): row for row in rows if row["bound_ns"]}

    def test_a_value_that_hangs_on_delivery_stands_beside_the_one_with_delivery(self) -> None:
        row = self.bounds("delivery", "rm-ro")["hot_path", "c", True]
        self.assertEqual((row["bound_ns"], row["delivered_ns"]), ("5000000", "35000000"))
        self.assertIn("delivery takes no time", row["assumed"])
        row = self.bounds("delivery", "rm-ro", "--platform", "delivery_delay_us=1")["hot_path", "c", True]
        self.assertEqual((row["bound_ns"], row["delivered_ns"]), ("35000000", ""))
        self.assertIn("delivery takes 1 us", row["rests_on"])

    def test_chains_on_several_threads(self) -> None:
        for graph, executor, ms in (
            ("four_chains", "multi:4", [6.242, 17.914, 35.279, 126.159]),
            ("three_chains", "multi:2", [58.2, 72.3, 58.2]),
            ("three_chains", "multi-jazzy:2", [58.2, 72.3, 58.2]),
        ):
            words = ("analyze", graph, "--executors", executor, "--csv", "bounds.csv", "--cores")
            self.accepted(*words, executor[-1])
            rows = [row for row in self.rows("bounds.csv") if row["kind"] == "chain"]
            self.assertEqual([float(row["bound_ns"]) / 1e6 for row in rows], ms)
            self.assertIn("no thread idles", rows[0]["assumed"])
            _, out, _ = self.command(*words, 1)
            self.assertIn(f"need {executor[-1]} cores, one each", out)
        exact = self.bounds(
            "../../../reference_system/graphs/three_chains", "multi:2", "--cores", "2", "--witness", "worst"
        )
        for k, expected in enumerate((42.0, 53.0, 55.7), 1):
            value = int(exact["chain", f"chain{k}", True]["bound_ns"]) / 1e6
            self.assertAlmostEqual(value, expected, delta=1.5e-6)  # 1 ns: jobs that end at one instant

    def test_searches_and_advice_have_the_exact_values_of_several_threads(self) -> None:
        words = "three_chains --cores 3 --executors multi:2,cbg:2 --duration 1 --repetitions 1".split()
        levels = "--require age:56 --from 90 --to 96 --resolution 1".split()
        for phases, multi, cbg in (("synchronous", "93 for t", "- for t"), ("random", "- ", "no method ")):
            out = self.accepted("capacity", *words, *levels, "--phases", phases, "--output", phases)
            self.assertRegex(out, rf"(?s)\nmulti:2 [ >=]+\d+ +{multi}.*\ncbg:2 +- +{cbg}")
        self.assertIn("\ncbg:2, load 90: chains on several threads: it covers no reentrant groups", out)
        known = (*words, "--now", "multi:2", "--phases", "synchronous")
        out = self.accepted("advise", *known, "--costs", "graph", "--output", "exact")
        self.assertIn("never exceeds 42.0 ms (exploration: exact for these phases).", out)
        self.assertIn("; the given phases", out)
        out = self.accepted("advise", *known, "--output", "costs")
        self.assertRegex(out, r"\nmulti:2.* without a bound: exploration: .* it covers no costs")

    def test_published_values_for_several_threads(self) -> None:
        out = self.accepted("paper", "threads", "--output", "threads", "--json")
        for row in json.loads(out):
            published, reached = float(row["published"]), float(row["reached"])
            most = float("inf" if row["at most"] == "-" else row["at most"])
            self.assertLessEqual(reached, most)
            proven = "confirmed" if published >= most else "open"
            self.assertEqual(row["verdict"], "refuted" if reached > published else proven)
            self.assertTrue(row["least % of C"] < 100 or published == reached, "there is one schedule")
        (run,) = self.folder.glob("threads/schedule3/*/age_chain3")
        self.assertEqual(csv_rows(run / "chains.csv")[-1]["end_to_end_latency_ns"], "58200000")

    def test_copies_have_names_of_their_own(self) -> None:
        graph = FIELD / "names_with_numbers.yaml"
        words = "--executors rm-ro --copies 2 --duration 10 --warm-up 0"
        run = self.simulate("run", "--graph", graph, *words.split())
        self.assertEqual(run.run["load_percent"], 90)
        (executor,) = run.summary()["executors"]
        self.assertTrue(run.accounts_for_all())
        names = [task["task"] for task in executor["tasks"]]
        self.assertEqual(len(names), len(set(names)))
        ran = sorted(t["ran"] for t in executor["tasks"] if t["kind"] == "subscription")
        self.assertEqual([round(n, -1) for n in ran], [100, 100, 200, 200])

    def test_outputs_are_counted_by_the_jobs_that_make_them(self) -> None:
        graph = FIELD / "sink_with_two_rates.yaml"
        words = ("--executors", "default,rm-ro,multi:2", "--duration", 300, "--warm-up", 2)
        run = self.simulate("run", "--graph", graph, *words)
        for executor in run.summary()["executors"]:
            self.assertIn(executor["chains"][0]["hot_path_latency_ms"]["n"], range(298, 301))

    def test_jobs_that_end_out_of_order(self) -> None:
        words = "--executors multi:4 --cores 4 --execution-times uniform --seed 2 --duration 10"
        found = []
        for trace in ((), ("--no-trace",)):
            graph = FIELD / "reentrant_timer.yaml"
            run = self.simulate(f"run{len(trace)}", "--graph", graph, *words.split(), *trace)
            (task,) = run.summary()["executors"][0]["tasks"]
            found.append({key: task["period_ms"][key] for key in ("n", "min", "max")})
            self.assertEqual(task["period_ms"]["n"], 665)
            self.assertGreaterEqual(task["period_ms"]["min"], 0)
        self.assertEqual(found[0], found[1])

    def test_a_burst_below_full_load_is_no_overload(self) -> None:
        (self.folder / "burst.yaml").write_text(BURST)
        run = self.simulate("run", "--graph", "burst.yaml", "--executors", "events-ro", "--duration", 12)
        self.assertTrue(run.run["complete"])
        words = ("simulate", "--graph", "burst.yaml", "--executors", "events-ro", "--duration", 60)
        for more in (("--load", 150), ("--max-backlog", 100)):
            self.rejected(*words, *more, says="overload")

    def test_release_jitter_belongs_to_its_timer_in_a_deployment(self) -> None:
        (self.folder / "apart.yaml").write_text(
            "name: apart\nexecutors:\n"
            "  - {name: b, executor: events-ro, processors: [1], owns: [B]}\n"
            "  - {name: others, executor: events-ro, processors: [0], owns: rest}\n"
        )
        words = ("--graph", JITTERED, "--cores", 2, "--duration", 5, "--warm-up", 0)
        starts = []
        for name, more in (("apart", "--deployments apart.yaml"), ("together", "--executors multi:2")):
            self.simulate(name, *words, *more.split())
            rows = self.rows(f"{name}/jobs.csv")
            starts.append({row["sequence"]: row["start_ns"] for row in rows if row["task"] == "B/u"})
        self.assertGreater(len(starts[0]), 100)
        self.assertEqual(starts[0], starts[1])

    def test_a_ratio_to_nothing_is_none(self) -> None:
        words = "--executors default,fp-ro --duration 5 --warm-up 0 --platform dispatch_cost_us=4000"
        run = self.simulate("run", "--graph", FIELD / "silent_chain.yaml", *words.split())
        chains = {e["executor"]: e["chains"][0] for e in run.summary()["executors"]}
        self.assertEqual(chains["fp-ro"]["hot_path_latency_ms"]["n"], 0)
        self.assertEqual(chains["fp-ro"]["ratio_to_default"], {"median": None, "max": None})


class ReadBack(FieldTest):
    def test_a_replay_of_any_simulation_equals_it(self) -> None:
        generator = random.Random(45)
        executors = "default static multi:2 cbg:2 events-ro events-re rm-ro rm-re edf-re fp-ro".split()
        costs = "release pass dispatch timer_dispatch wait".split()
        for n in range(12):
            options: list[Any] = ["--executors", ",".join(generator.sample(executors, 3))]
            for cost in generator.sample(costs, 2):
                options += ["--platform", f"{cost}_cost_us={generator.choice((20, 150, 333.3))}"]
            options += ["--cores", generator.choice((1, 2))]
            if generator.random() < 0.3:
                options += ["--rate", 90]
            graph = generator.choice(["autoware", "callbacks", JITTERED])
            drawn = ["--phases", "random", "--seed", generator.randrange(100)]
            drawn += ["--execution-times", generator.choice(["worst", "uniform"])]
            if generator.random() < 0.4:
                drawn += ["--load", 60]
            common = ("--graph", graph, *options, "--duration", 2, "--warm-up", 0.5, "--repetitions", 2)
            with self.subTest(n=n, common=common, drawn=drawn):
                first = self.simulate(f"first{n}", *common, *drawn)
                for of, name in ((f"first{n}", f"again{n}"), (f"again{n}", f"twice{n}")):
                    run = self.simulate(name, *common, "--phases", of, "--execution-times", f"replay:{of}")
                    for file in ("jobs.csv", "chains.csv"):
                        same = (first.path / file).read_bytes() == (run.path / file).read_bytes()
                        self.assertTrue(same, f"{name}/{file}")

    def test_a_replay_has_the_load_of_its_run(self) -> None:
        self.simulate("run", "--executors", "rm-ro", "--load", 60, "--duration", 1)
        words = ("simulate", "--executors", "rm-ro", "--execution-times", "replay:run", "--duration", 1)
        self.rejected(*words, "--load", 60, says="--load")
        again = self.simulate("again", *words[1:])
        self.assertEqual(again.run["load_given"], 60)

    def test_a_run_keeps_its_inputs(self) -> None:
        shutil.copy(JITTERED, self.folder / "graph.yaml")
        mine = "name: mine\nexecutors:\n  - {name: all, executor: rm-ro, owns: rest}\n"
        (self.folder / "mine.yaml").write_text(mine)
        words = ("--graph", "graph.yaml", "--deployments", "mine.yaml", "--duration", 2)
        run = self.simulate("run", *words)
        kinds = {i["kind"]: i for i in run.run["inputs"]}
        self.assertEqual(set(kinds), {"graph", "deployment_1"})
        self.assertEqual((run.path / kinds["graph"]["file"]).read_text(), JITTERED.read_text())
        self.assertEqual(kinds["graph"]["original"], os.path.realpath(self.folder) + "/graph.yaml")
        before = self.accepted("explain", "run")
        elsewhere = self.folder / "elsewhere"
        elsewhere.mkdir()
        (self.folder / "run").rename(elsewhere / "moved")
        for change in ("changed", "gone"):
            graph = self.folder / "graph.yaml"
            graph.write_text(BURST) if change == "changed" else graph.unlink()
            code, out, err = self.command("explain", elsewhere / "moved")
            self.assertEqual((code, out.replace(str(elsewhere / "moved"), "run")), (0, before), err)
            self.assertEqual("has changed since the run" in err, change == "changed")

    def test_listed_times_are_checked(self) -> None:
        (self.folder / "one.yaml").write_text(graph_text(SENSOR.format("A", 10, 5)))
        listed = "task,sequence,execution_time_ns\n"
        for rows, says in (
            ("A,0,1\nA,1,2\n", "job 2 of A is not listed"),
            ("A,0,1\nA,0,1\n", ":3: job 0 of A is listed twice"),
            ("A,0,5000001\n", ":2: the execution time of A is 5000001"),
            ("A,0,-1\n", ":2: the execution time of A is -1; give 0 or more"),
            ("B,0,1\n", ":2: the graph has no task B"),
            ("A,x,1\n", ":2: .*whole"),
        ):
            (self.folder / "times.csv").write_text(listed + rows)
            words = "simulate --executors rm-ro --graph one.yaml --warm-up 0 --duration 1 --output refused"
            err = self.rejected(*words.split(), "--execution-times", "listed:times.csv")
            self.assertRegex(err, f"times.csv.*{says}")

    def test_no_output_is_an_input_or_another_output(self) -> None:
        self.simulate("run", "--executors", "default,rm-ro", "--duration", 1)
        (self.folder / "link").symlink_to("run")
        os.link(self.folder / "run" / "jobs.csv", self.folder / "hard")
        before = {path.name: path.read_bytes() for path in (self.folder / "run").iterdir()}
        for words in (
            ("export", "perfetto", "run", "--output", "run/jobs.csv"),
            ("export", "perfetto", "run", "--output", "link/run.json"),
            ("export", "perfetto", "link", "--output", f"{self.folder}/run/../run/chains.csv"),
            ("diff", "run", "run", "--csv", "run/input_graph.yaml"),
            ("diff", "run", "run", "--csv", "run/summary.json"),
            ("analyze", "autoware", "--deployments", "cie:link/run.json", "--csv", "run/run.json"),
        ):
            self.rejected(*words, says="is an input of the command")
        self.rejected(*"diff run run --gate --junit a --markdown ./a".split(), says="would be written twice")
        after = {path.name: path.read_bytes() for path in (self.folder / "run").iterdir()}
        self.assertEqual(before, after)

    def test_runs_that_begin_at_one_instant_have_folders_of_their_own(self) -> None:
        words = ("simulate", "--executors", "rm-ro", "--duration", 1)
        running = [self.start(*words) for _ in range(6)]
        for process in running:
            code, _, err = self.finish(process)
            self.assertEqual(code, 0, err)
        folders = list((self.folder / "runs").iterdir())
        self.assertEqual(len(folders), 6)
        for folder in folders:
            self.assertTrue(json.loads((folder / "run.json").read_text())["complete"])
        self.command(*words, "--load", "0.0001", "--graph", "no_such_graph")
        self.assertEqual(len(list((self.folder / "runs").iterdir())), 6)
