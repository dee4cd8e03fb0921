#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the fuzz targets of build-fuzz/, which launch_scripts/fuzz.sh builds, and says what they tried.

What a target finds is kept in build-fuzz/found/; its input belongs into test/fuzz/corpus/TARGET/ of its package once it
is mended. `--replay` runs every input that is kept, and nothing else. With `--publish` the executions of a run without
a finding are added to results/reliability/fuzz.json, which docs/reliability.md shows.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
BUILD = ROOT / "build-fuzz"
RESULT = ROOT / "results" / "reliability" / "fuzz.json"

# Target: the shipped files that it starts from.
SEEDS = {
    "graph": "reference_system/graphs/*.yaml",
    "deployment": "reference_system/deployments/*.yaml",
    "cie": "",
    "phases": "reference_system/ros2_reference/rclcpp_autoware_phases.csv",
    "golden_trace": "reference_system/ros2_reference/traces*/*.csv",
    "sag_csv": "",
    "run_json": "bench/test/fuzz/run/run.json",
    "jobs_csv": "bench/test/fuzz/run/jobs.csv",
    "chains_csv": "bench/test/fuzz/run/chains.csv",
    "caret": "",
    "caret_stats": "",
    "irobot": "",
    "sweep": "",
    "messages": "",
    "telemetry": "",
    "parameters": "",
}
LONGEST_INPUT = 16384
# No hang above a second; no allocation beyond 4096 times the longest input, 256 MiB more for all together.
LIMITS = [f"-max_len={LONGEST_INPUT}", "-timeout=1", "-malloc_limit_mb=64", "-rss_limit_mb=1024"]


def corpus(target: str) -> list[Path]:
    """The inputs that are kept for a target."""
    return sorted(ROOT.glob(f"*/test/fuzz/corpus/{target}/*"))


def run(target: str, arguments: list[str], limit_s: float) -> tuple[int, str]:
    """Exit code and what the target wrote."""
    program = BUILD / "fuzz" / f"fuzz_{target}"
    environment = dict(os.environ, ASAN_OPTIONS="detect_leaks=1:allocator_may_return_null=0")
    done = subprocess.run(
        [program, *LIMITS, "-print_final_stats=1", *arguments],
        capture_output=True,
        text=True,
        errors="replace",
        timeout=limit_s + 300,
        env=environment,
        check=False,
    )
    return done.returncode, done.stderr


def executions(log: str) -> int:
    """As libFuzzer tells it at its end."""
    return sum(int(n) for n in re.findall(r"stat::number_of_executed_units: (\d+)", log))


def replay(target: str) -> tuple[str, int, list[str]]:
    """All inputs that are kept: name, executions, what went wrong."""
    inputs = [str(file) for file in [*corpus(target), *sorted(ROOT.glob(SEEDS[target] or "-"))]]
    if not inputs:
        return target, 0, []
    code, log = run(target, inputs, 60)
    return target, len(inputs), [] if code == 0 else [f"{target}: {log[-2000:]}"]


def fuzz(target: str, seconds: float, seed: int) -> tuple[str, int, list[str]]:
    """New inputs for so long, the same for a seed; goes on after a finding. Seed 0: others each time."""
    grown, seeds, found = (BUILD / name / target for name in ("corpus", "seeds", "found"))
    for folder in (grown, seeds, found):
        folder.mkdir(parents=True, exist_ok=True)
    for file in [*corpus(target), *ROOT.glob(SEEDS[target] or "-")]:
        link = seeds / f"{file.parent.name}-{file.name}"
        if not link.exists():
            link.symlink_to(file)
    count, wrong, end = 0, [], time.monotonic() + seconds
    while (left := end - time.monotonic()) >= 1:
        options = [f"-max_total_time={int(left)}", f"-seed={seed}", f"-artifact_prefix={found}/"]
        options += [str(grown), str(seeds)]
        code, log = run(target, options, left)
        count += executions(log)
        if code == 0:
            continue
        reason = re.search(r"(SUMMARY: .*|.*runtime error.*|terminate called.*\n.*)", log)
        artifact = re.search(r"Test unit written to (.*)", log)
        # Whoever else needs the processors may hold an input up, but hardly twice.
        if artifact and "timeout-" in artifact[1] and run(target, [artifact[1]], 60)[0] == 0:
            continue
        wrong.append(
            f"{target}: {reason[0] if reason else log[-500:]} ({artifact[1] if artifact else 'no input'})"
        )
        if len(wrong) == 5:
            break
    return target, count, wrong


def publish(counts: dict[str, int], seconds: float) -> None:
    """Adds them to those of earlier runs."""
    before: dict[str, Any] = {"seconds": 0, "targets": {}}
    if RESULT.exists():
        before = json.loads(RESULT.read_text(encoding="utf-8"))
    targets = before["targets"]
    for target, count in counts.items():
        so_far = targets.get(target, {"executions": 0})["executions"]
        targets[target] = {"executions": so_far + count, "kept": len(corpus(target))}
    facts = {
        "date": time.strftime("%Y-%m-%d"),
        "seconds": round(before["seconds"] + seconds),
        "targets": targets,
    }
    RESULT.parent.mkdir(parents=True, exist_ok=True)
    RESULT.write_text(json.dumps(facts, indent=2) + "\n", encoding="utf-8")


def main() -> int:
    """The exit code: 1 after a finding."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument(
        "minutes", type=float, nargs="?", default=1, help="for all targets together (default: 1)"
    )
    parser.add_argument("--replay", action="store_true", help="only the inputs that are kept")
    parser.add_argument(
        "--publish",
        action="store_true",
        help="add the executions of a run without a finding to results/reliability/",
    )
    parser.add_argument("--seed", type=int, default=0, help="other than 0: the same inputs each time")
    parser.add_argument("--only", help="targets, with commas between them")
    options = parser.parse_args()
    names = options.only.split(",") if options.only else list(SEEDS)
    targets = [t for t in names if (BUILD / "fuzz" / f"fuzz_{t}").exists()]
    if not targets:
        print("fuzz.py: there are no fuzz targets; build them with launch_scripts/fuzz.sh", file=sys.stderr)
        return 2
    processors = len(os.sched_getaffinity(0))
    seconds = 60 * options.minutes
    share = max(2.0, seconds * processors / len(targets))
    with ThreadPoolExecutor(processors) as pool:
        results = list(
            pool.map(replay if options.replay else lambda t: fuzz(t, share, options.seed), targets)
        )
    for target, count, wrong in results:
        print(f"{target:<14}{count:>12} executions, {len(wrong)} findings")
        for sentence in wrong:
            print(f"  {sentence}")
    if any(wrong for _, _, wrong in results):
        return 1
    if options.publish:
        publish({target: count for target, count, _ in results}, share * len(targets))
    return 0


if __name__ == "__main__":
    sys.exit(main())
