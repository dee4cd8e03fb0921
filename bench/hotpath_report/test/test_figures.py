# SPDX-License-Identifier: Apache-2.0
"""Figure scripts on tiny run folders: which files appear, and what is said of unfit input."""

import json
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

PLOTS = Path(__file__).resolve().parent
CHAINS_HEADER = "executor,repetition,chain,sequence,hot_path_latency_ns,end_to_end_latency_ns\n"
JOBS_HEADER = (
    "executor,repetition,task,kind,sequence,outcome,timestamp_ns,release_ns,start_ns,finish_ns,cpu_ns,"
    "deadline_ns,worker,cpu,process,parent_task,parent_sequence\n"
)


def run_json(**changes):
    facts = {
        "graph": {"name": "tiny"},
        "transport": "intra_process",
        "load_percent": 80,
        "phases": "creation",
        "cpus": [0, 1, 2, 5],
        "repetitions": 1,
        "duration_s": 3,
        "warm_up_s": 1,
        "machine": {"cpu_model": "a processor", "kernel": "6.1"},
        "executors": ["default", "rm-ro"],
        "limits": [{"label": "4 crunches (one core per branch)", "ms": 16.8}],
        "complete": True,
    }
    facts.update(changes)
    return json.dumps(facts)


SIMULATED = {
    "kind": "simulated",
    "execution_times": "worst",
    "platform": {"cores": 1, "timer_thread": "by_executor", "dispatch_cost_us": 20},
}


def chain_rows(executor, latencies_ms):
    return "".join(
        f"{executor},0,hot_path,{k},{int(ms * 1e6)},{int(ms * 1e6) + 1000}\n"
        for k, ms in enumerate(latencies_ms)
    )


def job_rows(executor, task, responses_ms, period_ms=30, skipped=0):
    rows = []
    for k, response in enumerate(responses_ms):
        timestamp = k * period_ms * 1_000_000
        finish, deadline = timestamp + int(response * 1e6), timestamp + period_ms * 1_000_000
        rows.append(
            f"{executor},0,{task},timer,{k},ran,{timestamp},{timestamp},{timestamp},{finish},,{deadline}"
            ",0,0,0,,\n"
        )
    for k in range(len(responses_ms), len(responses_ms) + skipped):
        rows.append(f"{executor},0,{task},timer,{k},skipped,{k * period_ms * 1_000_000},,,,,,,,0,,\n")
    return "".join(rows)


class FigureTest(unittest.TestCase):
    def setUp(self):
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.folder = Path(holder.name)

    def write(self, name, text):
        (self.folder / name).write_text(text, encoding="utf-8")

    def call(self, script, *arguments):
        command = [sys.executable, "-B", str(PLOTS / script), *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, timeout=100, check=False)

    def assert_refused(self, result, *words, code=2):
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertEqual(result.stderr.count("\n"), 1, f"not one sentence: {result.stderr}")
        self.assertNotIn("Traceback", result.stderr)
        for word in words:
            self.assertIn(word, result.stderr)
        self.assertEqual([f.name for f in self.folder.rglob("*") if f.suffix in (".svg", ".png")], [])

    def assert_drawn(self, result, folder, *names):
        self.assertEqual(result.returncode, 0, result.stderr)
        drawn = sorted(f.name for f in folder.iterdir() if f.suffix in (".svg", ".png"))
        self.assertEqual(drawn, sorted(name + suffix for name in names for suffix in (".svg", ".png")))
        for file in folder.glob("*.png"):
            self.assertEqual(file.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
        for file in folder.glob("*.svg"):
            self.assertTrue(file.read_text(encoding="utf-8").rstrip().endswith("</svg>"))

    def svg_texts(self, name):
        """The lines of text of a figure: Matplotlib draws outlines and leaves the text in comments."""
        svg = (self.folder / name).read_text(encoding="utf-8")
        return "\n".join(re.findall(r"<!-- (.*?) -->", svg))


class HotPath(FigureTest):
    def write_run(self, **changes):
        self.write("run.json", run_json(**changes))
        rows = chain_rows("default", [35.4, 36, 58.6, 40]) + chain_rows("rm-ro", [21.2, 21.5, 22.6, 21.3])
        self.write("chains.csv", CHAINS_HEADER + rows)

    def test_writes_both_formats_next_to_the_data(self):
        self.write_run()
        self.assert_drawn(self.call("hot_path.py", self.folder), self.folder, "hot_path")

    def test_output_names_another_folder(self):
        self.write_run()
        other = self.folder / "figures" / "new"
        self.assert_drawn(self.call("hot_path.py", self.folder, "--output", other), other, "hot_path")

    def test_says_what_ran_how_many_samples_and_the_ratio_of_worst_cases(self):
        self.write_run()
        self.call("hot_path.py", self.folder)
        texts = self.svg_texts("hot_path.svg")
        expected = ["tiny · intra_process · 80 % load", "on CPU 0-2,5", "a processor · Linux 6.1"]
        for text in expected + ["n = 4", "58.6 ms", "2.6× lower"]:
            self.assertIn(text, texts)
        self.assertIn("(one core per branch)", texts)
        self.assertNotIn("partial", texts)

    def test_says_that_a_run_is_partial(self):
        self.write_run(complete=False)
        self.call("hot_path.py", self.folder)
        self.assertIn("partial", self.svg_texts("hot_path.svg"))

    def test_same_data_give_the_same_bytes(self):
        self.write_run()
        bytes_of = []
        for _ in range(2):
            self.call("hot_path.py", self.folder)
            bytes_of.append([(self.folder / f"hot_path.{suffix}").read_bytes() for suffix in ("svg", "png")])
        self.assertEqual(bytes_of[0], bytes_of[1])

    def test_one_sample_equal_samples_and_none_are_drawn(self):
        self.write("run.json", run_json(executors=["default", "rm-ro", "edf-ro"], limits=[]))
        rows = chain_rows("default", [35.4]) + chain_rows("rm-ro", [0, 0, 0, 0])
        self.write("chains.csv", CHAINS_HEADER + rows)
        self.assert_drawn(self.call("hot_path.py", self.folder), self.folder, "hot_path")
        self.assertIn("no data", self.svg_texts("hot_path.svg"))

    def test_missing_folder(self):
        self.assert_refused(self.call("hot_path.py", self.folder / "nowhere"), "run.json", "No such file")

    def test_broken_run_json(self):
        self.write("run.json", "{")
        self.assert_refused(self.call("hot_path.py", self.folder), "run.json", "not valid JSON")

    def test_missing_key(self):
        self.write_run()
        facts = json.loads(run_json())
        del facts["machine"]["kernel"]
        self.write("run.json", json.dumps(facts))
        self.assert_refused(self.call("hot_path.py", self.folder), "`machine.kernel` is missing")

    def test_missing_chains(self):
        self.write("run.json", run_json())
        self.assert_refused(self.call("hot_path.py", self.folder), "chains.csv", "No such file")

    def test_chains_without_rows(self):
        self.write("run.json", run_json())
        self.write("chains.csv", CHAINS_HEADER)
        self.assert_refused(self.call("hot_path.py", self.folder), "chains.csv", "no rows")

    def test_wrong_column_short_row_and_bad_number(self):
        self.write("run.json", run_json())
        self.write("chains.csv", "executor,chain\n")
        self.assert_refused(self.call("hot_path.py", self.folder), "chains.csv:1", "`hot_path_latency_ns`")
        self.write("chains.csv", CHAINS_HEADER + "default,0,hot_path\n")
        self.assert_refused(self.call("hot_path.py", self.folder), "chains.csv:2", "3 columns instead of 6")
        self.write("chains.csv", CHAINS_HEADER + "default,0,hot_path,1,fast,2\n")
        self.assert_refused(self.call("hot_path.py", self.folder), "chains.csv", "`fast`")

    def test_output_that_is_a_file(self):
        self.write_run()
        self.write("taken", "")
        result = self.call("hot_path.py", self.folder, "--output", self.folder / "taken")
        self.assert_refused(result, "cannot write", code=1)

    def test_live_and_simulated_runs_stand_side_by_side(self):
        runs = []
        for name, changes in (("live", {}), ("simulated", SIMULATED)):
            (self.folder / name).mkdir()
            self.write(f"{name}/run.json", run_json(**changes))
            rows = chain_rows("default", [35.4, 36, 58.6]) + chain_rows("rm-ro", [21.2, 21.5, 22.6, 21.3])
            self.write(f"{name}/chains.csv", CHAINS_HEADER + rows)
            runs.append(self.folder / name)
        other = self.folder / "figures"
        self.assert_drawn(self.call("hot_path.py", *runs, "--output", other), other, "hot_path")
        texts = self.svg_texts("figures/hot_path.svg").split("\n")
        for text in ("live", "simulated", "n = 3, 3", "n = 4, 4"):
            self.assertIn(text, texts)

    def test_runs_of_different_graphs_do_not_meet(self):
        self.write_run()
        (self.folder / "other").mkdir()
        self.write("other/run.json", run_json(graph={"name": "large"}))
        result = self.call("hot_path.py", self.folder, self.folder / "other")
        self.assert_refused(result, "tiny and large", "one graph")


class TimersOnly(FigureTest):
    def write_run(self, name, rows, **changes):
        folder = self.folder / name
        folder.mkdir()
        self.write(f"{name}/run.json", run_json(graph={"name": name}, **changes))
        self.write(f"{name}/jobs.csv", JOBS_HEADER + rows)
        return folder

    def test_two_graphs_in_one_figure_set(self):
        responses = [1 + k % 7 for k in range(60)]
        runs = []
        for name, load in (("timers_only_90", 90), ("timers_only_60", 60)):
            rows = "".join(
                job_rows(executor, task, responses, skipped=5 if executor == "default" else 0)
                for executor in ("default", "rm-ro")
                for task in ("FrontCamera", "RearLidarDriver", "IMU")
            )
            bounds = [{"executor": "rm-ro", "task": "IMU", "ms": 12.67}]
            runs.append(self.write_run(name, rows, load_percent=load, bounds=bounds))
        output = self.folder / "figures"
        result = self.call("timers_only.py", *runs, "--output", output)
        self.assert_drawn(result, output, "timers_only_dropped", "timers_only_response")
        dropped = self.svg_texts("figures/timers_only_dropped.svg")
        self.assertIn("7.7", dropped.split("\n"), "5 of 65 timestamps are 7.7 %")
        self.assertIn("✓", dropped)
        self.assertLess(dropped.index("timers_only_60 (60 %)"), dropped.index("timers_only_90 (90 %)"))
        response = self.svg_texts("figures/timers_only_response.svg")
        for text in ("deadline 30 ms", "analytical bound", "cameras", "LiDARs", "IMU"):
            self.assertIn(text, response)

    def test_live_and_simulated_runs_of_three_utilisations_meet(self):
        runs = []
        for load in (60, 80, 90):
            for kind, changes in (("live", {}), ("simulated", SIMULATED)):
                rows = "".join(
                    job_rows(e, "IMU", [1 + k % 5 for k in range(60)]) for e in ("default", "rm-ro")
                )
                runs.append(self.write_run(f"{kind}_{load}", rows, load_percent=load, **changes))
                facts = json.loads((runs[-1] / "run.json").read_text())
                facts["graph"]["name"] = f"timers_only_{load}"
                self.write(f"{kind}_{load}/run.json", json.dumps(facts))
        output = self.folder / "figures"
        result = self.call("timers_only.py", *runs, "--output", output)
        self.assert_drawn(result, output, "timers_only_dropped", "timers_only_response")
        texts = self.svg_texts("figures/timers_only_response.svg")
        for load in (60, 80, 90):
            for kind in ("live", "simulated"):
                self.assertIn(f"timers_only_{load} ({load} %), {kind}", texts)

    def test_nothing_dropped(self):
        run = self.write_run("timers_only_60", job_rows("rm-ro", "IMU", [1] * 50), executors=["rm-ro"])
        result = self.call("timers_only.py", run)
        self.assert_drawn(result, run, "timers_only_dropped", "timers_only_response")

    def test_jobs_of_the_warm_up_are_no_response_times(self):
        run = self.write_run("timers_only_60", job_rows("rm-ro", "IMU", [1] * 30), executors=["rm-ro"])
        self.assert_refused(self.call("timers_only.py", run), "after the warm-up no timer ran")

    def test_run_without_timers(self):
        run = self.write_run("empty", "")
        self.assert_refused(self.call("timers_only.py", run), "jobs.csv", "no row of a timer")

    def test_missing_jobs(self):
        run = self.write_run("empty", "")
        (run / "jobs.csv").unlink()
        self.assert_refused(self.call("timers_only.py", run), "jobs.csv", "No such file")

    def test_more_graphs_than_colours(self):
        runs = [self.write_run(f"g{k}", job_rows("rm-ro", "IMU", [1] * 50)) for k in range(6)]
        self.assert_refused(self.call("timers_only.py", *runs), "6 graphs", "at most 5")


if __name__ == "__main__":
    unittest.main()
