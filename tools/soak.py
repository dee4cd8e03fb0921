#!/usr/bin/env -S PYTHONPATH=bench /usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Runs executors live for hours, all at the same time, and checks their memory, files and threads.

Each run must end well, keep its loss equations and pass `hotpath doctor`. Private memory (at most 1 %),
open files and threads of its processes must not grow from the second tenth of the time to the last.
"""

import contextlib
import statistics
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

from evidence import hotpath, parser, publish
from hotpath_report import hotpath_command
from hotpath_report.run import Run

RESULT = "reliability/soak.json"
EXECUTORS = ("default", "rm-ro", "cbg:2")
SAMPLES = 720
MOST_GROWTH_PERCENT = {"private_kib": 1, "files": 0.01, "threads": 0.01}


def usage_of(session: int) -> Counter[str]:
    """Private memory, open files and threads of all processes of a session."""
    usage: Counter[str] = Counter()
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError, KeyError):  # the process has ended meanwhile
            if int((process / "stat").read_text().rpartition(")")[2].split()[3]) == session:
                status = dict(line.split(":", 1) for line in (process / "status").read_text().splitlines())
                usage.update(private_kib=int(status["RssAnon"].split()[0]), threads=int(status["Threads"]))
                usage.update(files=sum(1 for _ in (process / "fd").iterdir()))
    return usage


def growth_percent(values: list[int]) -> float:
    """From the mean of the second tenth to that of the last."""
    tenth = len(values) // 10
    return 100 * (statistics.fmean(values[-tenth:]) / statistics.fmean(values[tenth : 2 * tenth]) - 1)


def main() -> int:
    """Exit code: 1 if a run fails or grows."""
    arguments = parser(__doc__, RESULT)
    arguments.add_argument("--hours", type=float, default=2)
    o = arguments.parse_args()
    seconds, failed = 3600 * o.hours, False
    with tempfile.TemporaryDirectory(prefix="hotpath_soak_") as scratch:
        runs = {}
        for domain, executor in enumerate(EXECUTORS, 40):
            words: list[Any] = [hotpath_command.program(), "run", "--repetitions", 1, "--load", 10]
            words += ["--executors", executor, "--domain", domain]
            words += ["--duration", f"{seconds:g}", "--output", f"{scratch}/{domain}"]
            runs[executor] = subprocess.Popen(list(map(str, words)), start_new_session=True)
        try:
            samples: dict[str, list[Counter[str]]] = {executor: [] for executor in runs}
            begin = time.monotonic()
            for k in range(1, SAMPLES):  # the last one before the runs end
                time.sleep(max(0, begin + seconds * k / SAMPLES - time.monotonic()))
                for executor, process in runs.items():
                    samples[executor].append(usage_of(process.pid))
            for domain, (executor, process) in enumerate(runs.items(), 40):
                failed |= process.wait() != 0
                hotpath("doctor", f"{scratch}/{domain}")
                summary = Run(Path(f"{scratch}/{domain}")).summary()[0]
                grown = {k: growth_percent([s[k] for s in samples[executor]]) for k in MOST_GROWTH_PERCENT}
                failed |= any(grown[k] > most for k, most in MOST_GROWTH_PERCENT.items())
                ended_early = samples[executor][-1]["threads"] == 0
                failed |= ended_early or not summary["loss_equations"]["hold"]
                mib = round(samples[executor][-1]["private_kib"] / 1024, 1)
                facts = {"hours": o.hours, "jobs": summary["callbacks_executed"], "private_mib": mib}
                facts["growth_percent"] = round(grown["private_kib"], 3)
                print(executor, facts, grown)
                if o.publish and not failed:
                    publish(RESULT, facts, executor)
        finally:
            for process in runs.values():
                process.terminate()
                process.wait()
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
