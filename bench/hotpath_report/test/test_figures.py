# SPDX-License-Identifier: Apache-2.0
"""Commands that draw, on tiny run folders: their files, and their messages about unusable input."""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import package

BENCH = Path(__file__).resolve().parents[2]  # holds the package
HOTPATH = os.environ.get("HOTPATH", "hotpath")
CHAINS_HEADER = (
    "executor,repetition,chain,sequence,hot_path_latency_ns,end_to_end_latency_ns,"
    "sink_task,finish_ns,disparity_ns\n"
)
SINK = "ObjectCollisionEstimator/EuclideanClusterDetector,0,0\n"


def run_json(**changes: Any) -> Any:
    """The facts of a published run, changed to those of a tiny one."""
    facts = json.loads((BENCH.parent / "results" / "hot_path" / "run.json").read_text(encoding="utf-8"))
    facts["graph"]["name"] = "tiny"
    facts["machine"] |= {"cpu_model": "a processor", "kernel": "6.1"}
    facts["runs"] = [run for run in facts["runs"] if run["repetition"] == 0]
    facts |= {"transport": "intra_process", "load_percent": 80, "cpus": [0, 1, 2, 5], "repetitions": 1}
    facts |= {
        "executors": ["default", "rm-ro"],
        "limits": [{"label": "4 crunches (one core per branch)", "ms": 16.8}],
    }
    return json.dumps(facts | changes)


def chain_rows(executor: str, latencies_ms: Iterable[float]) -> str:
    return "".join(
        f"{executor},0,hot_path,{k},{int(ms * 1e6)},{int(ms * 1e6) + 1000},{SINK}"
        for k, ms in enumerate(latencies_ms)
    )


class FigureTest(unittest.TestCase):
    def setUp(self) -> None:
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def write(self, name: str, text: str) -> None:
        (self.folder / name).write_text(text, encoding="utf-8")

    def environment(self) -> Any:
        return {**os.environ, "HOTPATH": str(Path(shutil.which(HOTPATH) or HOTPATH))}

    def call(self, command: Any, *arguments: object) -> Any:
        """Runs the command in this process: a new process takes a second for imports."""
        return package.call(self.folder, self.environment(), command, *arguments)

    def call_process(self, command: Any, *arguments: object) -> Any:
        """Runs the command in a process, as `hotpath` does."""
        words = [sys.executable, "-I", "-B", BENCH, command, *map(str, arguments)]
        return subprocess.run(
            words, capture_output=True, text=True, timeout=100, check=False, env=self.environment()
        )

    def assert_refused(self, result: Any, *words: object) -> None:
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertEqual(result.stderr.count("\n"), 1, f"not one sentence: {result.stderr}")
        self.assertNotIn("Traceback", result.stderr)
        for word in words:
            self.assertIn(word, result.stderr)
        self.assertEqual([f.name for f in self.folder.rglob("*") if f.suffix in (".svg", ".png")], [])

    def assert_drawn(self, result: Any, folder: Path, *names: str) -> None:
        self.assertEqual(result.returncode, 0, result.stderr)
        drawn = sorted(f.name for f in folder.iterdir() if f.suffix in (".svg", ".png"))
        self.assertEqual(drawn, sorted(name + suffix for name in names for suffix in (".svg", ".png")))
        for file in folder.glob("*.png"):
            self.assertEqual(file.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
        for file in folder.glob("*.svg"):
            self.assertTrue(file.read_text(encoding="utf-8").rstrip().endswith("</svg>"))

    def svg_texts(self, name: str) -> str:
        """The lines of text of a figure: Matplotlib draws outlines and leaves the text in
        comments."""
        svg = (self.folder / name).read_text(encoding="utf-8")
        return "\n".join(re.findall(r"<!-- (.*?) -->", svg))


class HotPath(FigureTest):
    def write_run(
        self,
        default: Sequence[float] = (35.4, 36, 58.6, 40),
        rm_ro: Sequence[float] = (21.2, 21.5, 22.6, 21.3),
        **changes: Any,
    ) -> None:
        """A run with these latencies in ms."""
        self.write("run.json", run_json(**changes))
        self.write("chains.csv", CHAINS_HEADER + chain_rows("default", default) + chain_rows("rm-ro", rm_ro))

    def test_shows_conditions_sample_counts_and_worst_case_ratios(self) -> None:
        expected = ["tiny · intra_process · 80 % load", "on CPU 0-2,5", "a processor · Linux 6.1"]
        for complete in (True, False):
            self.write_run(complete=complete)
            self.call("hot-path", self.folder)
            texts = self.svg_texts("hot_path.svg")
            for text in expected + ["n = 4", "58.6 ms", "2.6× lower", "(one core per branch)"]:
                self.assertIn(text, texts)
            self.assertEqual("partial" in texts, not complete)

    def test_equal_data_give_equal_bytes(self) -> None:
        self.write_run()
        bytes_of = []
        for call in (self.call, self.call_process):
            self.assertEqual(call("hot-path", self.folder).returncode, 0)
            bytes_of.append([(self.folder / f"hot_path.{suffix}").read_bytes() for suffix in ("svg", "png")])
        self.assertEqual(bytes_of[0], bytes_of[1])

    def test_draws_one_sample_equal_samples_and_no_samples(self) -> None:
        self.write_run([35.4], [0, 0, 0, 0], executors=["default", "rm-ro", "edf-ro"], limits=[])
        self.assert_drawn(self.call("hot-path", self.folder), self.folder, "hot_path")
        self.assertIn("no data", self.svg_texts("hot_path.svg"))
        self.write_run([35.4] * 300 + [900])
        self.call("hot-path", self.folder)
        self.assertIn("900.0 ms →", self.svg_texts("hot_path.svg"), "an outlier stretches no axis")

    def test_refusals(self) -> None:
        facts = json.loads(run_json())
        del facts["machine"]["kernel"]
        for file, text, *parts in (
            ("run.json", json.dumps(facts), "'kernel' not found"),
            ("chains.csv", CHAINS_HEADER, "chains.csv", "no rows"),
            ("chains.csv", CHAINS_HEADER + "default,0,hot_path,1,fast,2," + SINK, "chains.csv:2", "`fast`"),
            (
                "chains.csv",
                CHAINS_HEADER + "edf,0,hot_path,1,1,2," + SINK,
                "edf (repetition 0) is not in this run",
            ),
        ):
            self.write_run()
            self.write(file, text)
            self.assert_refused(self.call("hot-path", self.folder), *parts)

    def test_a_recorded_run(self) -> None:
        """An imported run, whose transport and machine are unknown."""
        facts = json.loads((BENCH / "test" / "fuzz" / "run" / "run.json").read_text(encoding="utf-8"))
        simulated = {key: facts[key] for key in ("platform", "execution_times")}
        facts = json.loads(run_json(kind="recorded", executors=["default"], **simulated))
        for key in ("transport", "cpus", "machine"):
            del facts[key]
        self.write_run([35.4, 36, 58.6], [])
        self.write("run.json", json.dumps(facts))
        self.assert_drawn(self.call("hot-path", self.folder), self.folder, "hot_path")
        texts = self.svg_texts("hot_path.svg")
        for text in ("tiny · recorded", "on one core", "read from a trace of ros2_tracing"):
            self.assertIn(text, texts)
