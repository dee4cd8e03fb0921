#!/usr/bin/env -S PYTHONPATH=bench /usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Runs the fuzz targets in build-fuzz/ (built by launch_scripts/fuzz.sh) and reports findings.

build-fuzz/found/ keeps the input of a finding. After the fix, add the input to
test/fuzz/corpus/TARGET/ of its package; `--replay` runs these inputs and the shipped files, and no
others. `--publish` adds the executions of a run without a finding to
results/reliability/fuzz.json (results/reliability/README.md).
"""

import os
import re
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from evidence import ROOT, parser, publish, read

BUILD = ROOT / "build-fuzz"
PROGRAMS = {path.name.removeprefix("fuzz_"): path for path in sorted(BUILD.glob("fuzz/fuzz_*"))}
RESULT = "reliability/fuzz.json"

# The shipped files from which a target starts, besides its kept inputs.
SEEDS = {
    "graph": "reference_system/graphs/*.yaml",
    "deployment": "reference_system/deployments/*.yaml",
    "phases": "reference_system/ros2_reference/rclcpp_autoware_phases.csv",
    "golden_trace": "reference_system/ros2_reference/traces*/*.csv",
    "run_json": "bench/test/fuzz/run/run.json",
    "jobs_csv": "bench/test/fuzz/run/jobs.csv",
    "chains_csv": "bench/test/fuzz/run/chains.csv",
}
# A second for an input; 4096 times the longest input for an allocation, 1 GiB for all of them.
LIMITS = ["-max_len=16384", "-timeout=1", "-malloc_limit_mb=64", "-rss_limit_mb=1024"]


def corpus(target: str) -> list[Path]:
    """The kept inputs of a target."""
    return sorted(ROOT.glob(f"*/test/fuzz/corpus/{target}/*"))


def inputs(target: str) -> list[Path]:
    """The kept inputs of a target, and the shipped files from which it starts."""
    return corpus(target) + sorted(ROOT.glob(SEEDS.get(target, "-")))


def run(target: str, arguments: list[str], limit_s: float) -> tuple[int, str]:
    """The exit code and the log of a target."""
    environment = dict(os.environ, ASAN_OPTIONS="detect_leaks=1:allocator_may_return_null=0")
    command: list[str | Path] = [PROGRAMS[target], *LIMITS, "-print_final_stats=1", *arguments]
    text: Any = {"capture_output": True, "text": True, "errors": "replace"}
    done = subprocess.run(command, **text, timeout=limit_s + 300, env=environment, check=False)
    return done.returncode, done.stderr


def executions(log: str) -> int:
    """The count in libFuzzer's final statistics."""
    return sum(int(n) for n in re.findall(r"stat::number_of_executed_units: (\d+)", log))


def replay(target: str) -> tuple[str, int, list[str]]:
    """Runs the kept inputs; returns target, executions and findings."""
    files = list(map(str, inputs(target)))
    code, log = run(target, files, 60) if files else (0, "")
    return target, len(files), [f"{target}: {log[-2000:]}"] if code else []


def fuzz(target: str, seconds: float, seed: int) -> tuple[str, int, list[str]]:
    """Runs new inputs, the same for a seed other than 0, and continues after a finding."""
    grown, seeds, found = (BUILD / name / target for name in ("corpus", "seeds", "found"))
    for folder in (grown, seeds, found):
        folder.mkdir(parents=True, exist_ok=True)
    for file in inputs(target):
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
        # Other load on the CPUs may delay an input once, but hardly twice.
        if artifact and "timeout-" in artifact[1] and run(target, [artifact[1]], 60)[0] == 0:
            continue
        unit = artifact[1] if artifact else "no input"
        wrong.append(f"{target}: {reason[0] if reason else log[-500:]} ({unit})")
        if len(wrong) == 5:
            break
    return target, count, wrong


def add(counts: dict[str, int], seconds: float) -> None:
    """Adds the executions to those of earlier runs."""
    before = read(RESULT)
    targets = {name: facts for name, facts in before.get("targets", {}).items() if name in PROGRAMS}
    for target, count in counts.items():
        so_far = targets.get(target, {"executions": 0})["executions"]
        targets[target] = {"executions": so_far + count, "kept": len(corpus(target))}
    publish(RESULT, {"seconds": round(before.get("seconds", 0) + seconds), "targets": targets})


def main() -> int:
    """The exit code: 1 after a finding."""
    arguments = parser(__doc__, RESULT)
    arguments.add_argument("minutes", type=float, nargs="?", default=1, help="for all targets (default: 1)")
    arguments.add_argument("--replay", action="store_true", help="only the inputs that are kept")
    arguments.add_argument("--seed", type=int, default=0, help="other than 0: the same inputs each time")
    arguments.add_argument("--only", help="targets, with commas between them")
    options = arguments.parse_args()
    targets = [t for t in PROGRAMS if not options.only or t in options.only.split(",")]
    if not targets:
        print("fuzz.py: there are no fuzz targets; build them with launch_scripts/fuzz.sh", file=sys.stderr)
        return 2
    processors = len(os.sched_getaffinity(0))
    seconds = 60 * options.minutes
    share = max(2.0, seconds * processors / len(targets))
    with ThreadPoolExecutor(processors) as pool:
        one = replay if options.replay else lambda target: fuzz(target, share, options.seed)
        results = list(pool.map(one, targets))
    for target, count, wrong in results:
        print(f"{target:<14}{count:>12} executions, {len(wrong)} findings")
        for sentence in wrong:
            print(f"  {sentence}")
    if any(wrong for _, _, wrong in results):
        return 1
    if options.publish:
        add({target: count for target, count, _ in results}, share * len(targets))
    return 0


if __name__ == "__main__":
    sys.exit(main())
