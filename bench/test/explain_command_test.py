# SPDX-License-Identifier: Apache-2.0
"""`hotpath explain` for simulated, live and imported runs: the causes of every output sum to its
measured latency, and what cannot be explained is refused."""

import json
import re
from pathlib import Path
from typing import Any

from hotpath_command import CommandTest, RunFolder

FIELD = Path(__file__).parent / "field"


class Explain(CommandTest):
    def explained(self, run: str | Path, *arguments: object) -> Any:
        return json.loads(self.accepted("explain", run, *arguments, "--json"))

    def simulated(self, options: str, folder: str = "run", seconds: float = 1) -> RunFolder:
        """Of Autoware, unless the options name another graph."""
        words = ("--duration", seconds, "--warm-up", 0, *options.split())
        return self.stored("simulate", *words, output=folder)

    def field(self, graph: str, options: str) -> RunFolder:
        """A simulation of a graph of the folder `field`, in `run`."""
        return self.simulated(f"--graph {FIELD / graph}.yaml {options}", seconds=0.4)

    def check_outputs(self, folder: str | Path) -> None:
        self.check_latencies(folder)
        self.check_latencies(folder, "--hot-path")

    def check_latencies(self, folder: str | Path, *metric: str) -> None:
        """All outputs of the first executor, together and one by one: ages, or hot-path latencies."""
        run = RunFolder(self.folder / folder)
        executor, chain = run.run["executors"][0], run.run["chains"][0]
        all_rows = [row for row in run.chains().get((executor, 0), []) if row[0] == chain]
        rows = [(row[1], row[2 if metric else 3]) for row in all_rows if metric or row[3] is not None]
        self.assertGreater(len(rows), 0)
        together = self.explained(folder, "--executors", executor, "--repetition", 0, *metric)
        self.assertEqual(together["latency"], "hot path" if metric else "age")
        outputs = (together["not_explained"], together["all"]["outputs"])
        self.assertEqual(outputs, (len(all_rows) - len(rows), len(rows)))
        self.assertEqual(together["all"]["latency_ns"], sum(latency for _, latency in rows))
        self.assertEqual(sum(together["all"]["causes_ns"].values()), together["all"]["latency_ns"])
        for sequence, latency in rows[:10]:
            of = ("--executors", executor, "--sequence", sequence, "--repetition", 0)
            one = self.explained(folder, *of, *metric)
            self.assertEqual((one["latency_ns"], one["complete"]), (latency, True))
            self.assertEqual(sum(part["ns"] for part in one["parts"]), latency)
            self.assertEqual(sum(one["causes_ns"].values()), latency)
            jobs = {(j.task, j.sequence): j for j in run.jobs()[executor, 0] if j.start is not None}
            path = [jobs[step["task"], step["sequence"]] for step in one["path"]]
            end, begin = (path[-1].start, path[0].start) if metric else (path[-1].finish, path[0].timestamp)
            self.assertEqual(end - begin, latency)

    def test_a_simulated_run_and_its_import(self) -> None:
        self.simulated("--executors default,rm-ro")
        self.check_outputs("run")
        worst = self.explained("run", "--worst")
        self.assertEqual(worst["causes_ns"]["unexplained"], 0)
        self.assertEqual(self.explained("run", "--quantile", 1)["latency_ns"], worst["latency_ns"])
        self.accepted("export", "ctf", "run", "--output", "traces")
        chain = ("--chain", "FrontLidarDriver:ObjectCollisionEstimator")
        self.accepted("import", "ctf", "traces/default-0", *chain, "--output", "imported")
        self.check_outputs("imported/run")
        self.check_outputs("imported/simulated")

    def test_a_live_run(self) -> None:
        options = "--executors default --repetitions 1 --transport intra_process --load 20"
        self.accepted("run", *options.split(), "--duration", 1, "--warm-up", 0, "--output", "live")
        self.check_outputs("live")

    def test_the_instant_of_a_displacement(self) -> None:
        self.field("displaced", f"--deployments {FIELD}/displaced_deployment.yaml --phases given")
        parts = self.explained("run", "--sequence", 2, "--hot-path")["parts"]
        causes = [(p["cause"], p["ns"]) for p in parts[:2]]
        self.assertEqual(causes, [("running", 2_000_000), ("displaced", 1_000_000)])
        self.assertEqual(parts[1]["behind"]["task"], "Hi")

    def test_jobs_of_one_group_wait_for_each_other(self) -> None:
        rules = (("cbg:1", "earlier event (FIFO)"), ("cbg:2", "same callback group in use"))
        self.field("exclusive", "--executors cbg:1,cbg:2 --cores 2")
        for executor, rule in rules:
            of = ("--chain", "t2", "--executors", executor, "--hot-path")
            (behind,) = self.explained("run", *of)["all"]["behind"]
            self.assertEqual(behind["rule"], rule)
            waits = "".join(self.explained("run", *of, "--worst").get("waits", []))
            held = r": thread \d ran .*consumer_node/topic_1 \d+ \(\S+ to \S+, in its callback group\)"
            self.assertEqual(len(re.findall(held, waits)), executor == "cbg:2", waits)

    def test_what_every_thread_did_during_a_wait(self) -> None:
        self.simulated("--graph three_chains --executors multi:2 --cores 2 --phases synchronous")
        threads = "thread 0 ran N/c 0 (23.100 to 34.100); thread 1 ran N/b 0 (22.300 to 40.200)"
        wait = f"\n\nN/a 0 waited from 23.100 to 34.100 ms: {threads}.\n"
        self.assertIn(wait, self.accepted("explain", "run", "--sequence", 0))

    def test_a_latency_of_zero(self) -> None:
        self.field("exclusive", "--executors multi:2 --cores 2")
        out = self.accepted("explain", "run", "--chain", "t1", "--hot-path")
        self.assertIn("takes 0.000 ms on average.\n", out)
        self.assertRegex(out, r"(?m)^latency +0\.000 ")

    def test_a_task(self) -> None:
        run = self.simulated("--graph timers_only_60 --executors rm-ro")
        task = run.jobs()["rm-ro", 0][-1].task
        jobs = [j for j in run.jobs()["rm-ro", 0] if j.task == task and j.outcome == "ran"]
        all_jobs = self.explained("run", "--task", task)["all"]
        self.assertEqual(all_jobs["latency_ns"], sum(j.finish - j.timestamp for j in jobs))
        self.assertEqual(sum(all_jobs["causes_ns"].values()), all_jobs["latency_ns"])
        self.assertIn("finished", self.accepted("explain", "run", "--task", task, "--worst"))
        self.rejected("explain", "run", says="--task")

    def test_two_executors_and_two_runs(self) -> None:
        for name, executors in (("both", "default,edf-ro"), ("a", "default"), ("b", "edf-ro")):
            self.simulated(f"--executors {executors} --load 104 --phases synchronous", name)
        one_run = self.explained("both", "--executors", "default,edf-ro")
        for side in "ab":
            self.assertEqual(sum(one_run[side]["causes_ns"].values()), one_run[side]["latency_ns"])
        self.assertEqual(self.explained("a", "b"), one_run)
        a, b = one_run["a"], one_run["b"]
        self.assertEqual((a["fewer_outputs"], b["fewer_outputs"]), (0, a["outputs"] - b["outputs"]))
        self.assertIn(", edf-ro lacks 1 output that default has: lost,", one_run["sentences"][1])

    def test_rows_out_of_order_are_refused(self) -> None:
        self.simulated("--executors default")
        file = self.folder / "run" / "jobs.csv"
        header, first, *rows = file.read_text().splitlines(keepends=True)
        file.write_text("".join([header, *rows, first]))
        self.assertRegex(self.rejected("explain", "run"), r"jobs\.csv:\d+: .*order of starts")
