# SPDX-License-Identifier: Apache-2.0
"""One small file of every format that hotpath reads, written by hotpath itself where possible."""

import csv
import json
import os
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from bench_command_test import Report

SYSTEM = Path(__file__).resolve().parents[2] / "reference_system"
GOLDEN = SYSTEM / "ros2_reference" / "traces" / "timers_only_60.default.csv"
GOLDEN_LINES = 200

CALLBACKS = """
name: small
nodes:
- name: camera
  callbacks:
  - {timer: image, period_ms: 100, execution_time_ms: {file: times.csv}, publishes: image}
- name: detector
  callbacks:
  - {subscription: image, execution_time_ms: 1}
"""
TINY = """name: tiny
nodes:
  - {name: S, type: sensor, period_ms: 100}
  - {name: C, type: command, input: S}
chains:
  - {name: path, nodes: [S, C], sources: [S], sink: C}
"""
SWEEP = (
    "command: simulate\nfixed: {graph: sequences, executors: rm-ro, duration: 1}\naxes: {load: [20, 40]}\n"
)
RUNS = {
    "autoware": "--executors default,rm-ro --repetitions 3 --phases random --seed 5",
    "timers": "--graph timers_only_60 --executors default,rm-ro --phases synchronous",
    "tiny": "--graph tiny.yaml --executors default,rm-ro",
}
MEASURED = {
    "name": "push_pop/std::priority_queue/ready/100",
    "real_time": 50,
    "cpu_time": 50,
    "time_unit": "ns",
}


def call(hotpath: Any, folder: Path, *words: object) -> Any:
    """Standard output of a command that must succeed."""
    environment = dict(os.environ, HOTPATH_FIGURES="none")
    done = subprocess.run(
        [hotpath, *map(str, words)], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, (words, done.stderr)
    return done.stdout


def make_run(hotpath: Any, folder: Path) -> None:
    """Makes a run, and files that refer to its tasks."""
    brief = ("--executors", "default,rm-ro", "--duration", "1", "--warm-up", "0.1")
    call(hotpath, folder, "simulate", "--graph", "sequences", *brief, "--output", "run")
    facts = json.loads((folder / "run" / "run.json").read_text())
    phases = facts["runs"][0]["first_timestamps_ms"]
    with open(folder / "phases.csv", "w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([("task", "first_release_ms"), *phases.items()])
    (folder / "order.txt").write_text("".join(task["task"] + "\n" for task in facts["tasks"]))
    call(hotpath, folder, "export", "ctf", "run", "--output", "ctf")


def make_inputs(hotpath: Any) -> Any:
    """Makes all inputs and returns their folder."""
    folder = Path(tempfile.mkdtemp(prefix="hotpath_inputs_"))
    make_run(hotpath, folder)
    shutil.copy(SYSTEM / "graphs" / "sequences.yaml", folder / "graph.yaml")
    (folder / "imported").mkdir()
    shutil.copy(SYSTEM / "graphs" / "sequences.yaml", folder / "imported" / "graph.yaml")
    texts = {
        "imported/deployment.yaml": "name: mine\nexecutors:\n  - {name: all, executor: rm-ro, owns: rest}\n",
        "callbacks.yaml": CALLBACKS,
        "tiny.yaml": TINY,
        "nobody.yaml": "name: none\nexecutors:\n  - {name: a, owns: [Nobody]}\n",
        "static.yaml": "name: mine\nexecutors:\n  - {name: all, executor: static, owns: rest}\n",
        "long.yaml": "command: simulate\nfixed: {executors: default, duration: 1e5}\naxes: {load: [10, 20]}\n",
        "short.yaml": "command: simulate\nfixed: {executors: default, duration: 0.1}\naxes: {load: [10, 20]}\n",
        "times.csv": "execution_time_ms\n4.2\n4.5\n",
        "golden.csv": "".join(GOLDEN.read_text().splitlines(keepends=True)[:GOLDEN_LINES]),
        "sweep.yaml": SWEEP,
        "bench/bench.json": json.dumps(
            {
                "context": {"complete": True, "date": "today", "repetitions": 3, "machine": Report.MACHINE},
                "benchmarks": [MEASURED],
            }
        ),
    }
    for name, text in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    for name, line in RUNS.items():
        call(hotpath, folder, "simulate", *line.split(), "--duration", 1, "--warm-up", 0, "--output", name)
    call(hotpath, folder, "export", "ctf", "autoware", "--output", "exported")
    (folder / "cie.yaml").write_text(call(hotpath, folder, "graph", "autoware", "--as", "cie"))
    call(hotpath, folder, "sweep", "sweep.yaml", "--output", "swept")
    words = "--executors rm-ro --duration 1 --resolution 20 --output capacity"
    call(hotpath, folder, "capacity", *words.split())
    brief = ("--repetitions", 1, "--duration", 1)
    call(hotpath, folder, "advise", "sequences", "--output", "advice", *brief)
    call(hotpath, folder, "paper", "golden", "--output", "validation")
    (folder / "reference" / "traces").mkdir(parents=True)
    shutil.copy(folder / "golden.csv", folder / "reference" / "traces" / GOLDEN.name)
    for name in ("rclcpp_timers_only.csv", "rclcpp_autoware_phases.csv"):
        shutil.copy(SYSTEM / "ros2_reference" / name, folder / "reference")
    return folder
