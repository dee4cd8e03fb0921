#!/usr/bin/env -S PYTHONPATH=bench /usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Runs executors live for hours, all at the same time, and checks their memory, files and threads.

Each run must end well, keep its loss equations and pass `hotpath doctor`; its processes' private
memory, open files and threads must not grow after start-up. Exit code 1 if a run fails or its
memory grows by more than --most-growth.
"""

import contextlib
import json
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from evidence import ROOT, parser, publish
from hotpath_report.statistics import Samples

SAMPLES = 720  # of memory, in each run


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


@dataclass
class Soak:
    """A run in progress."""

    hotpath: str
    executor: str
    folder: Path
    process: subprocess.Popen[str]
    samples: list[Counter[str]] = field(default_factory=list)

    def grown_percent(self, what: str) -> float:
        """Growth of the average from the second tenth of the run to its last tenth."""
        tenth = max(1, len(self.samples) // 10)
        early, late = (
            Samples([[usage[what] for usage in part]]).mean
            for part in (self.samples[tenth : 2 * tenth], self.samples[-tenth:])
        )
        return 100 * (late / early - 1)

    def result(self, hours: float) -> dict[str, Any]:
        """Waits for the end. Raises RuntimeError if the run failed."""
        out, err = self.process.communicate()
        if self.process.returncode != 0 or "Loss equations hold" not in out:
            raise RuntimeError(f"{self.executor}: exit code {self.process.returncode}\n{out}{err}")
        if subprocess.run([self.hotpath, "doctor", self.folder], check=False).returncode != 0:
            raise RuntimeError(f"{self.executor}: not a legal schedule")
        with open(self.folder / "jobs.csv", "rb") as jobs:
            count = sum(1 for _ in jobs) - 1
        return {
            "hours": hours,
            "jobs": count,
            "private_mib": round(self.samples[-1]["private_kib"] / 1024, 1),
            "growth_percent": round(self.grown_percent("private_kib"), 3),
            "files_grown": self.grown_percent("files") > 0.01,
            "threads_grown": self.grown_percent("threads") > 0.01,
        }


def watch(soaks: list[Soak], seconds: float) -> None:
    """Samples their usage until just before they end."""
    begin = time.monotonic()
    for k in range(1, SAMPLES):
        time.sleep(max(0.0, begin + seconds * k / SAMPLES - time.monotonic()))
        for soak in soaks:
            if soak.process.poll() is not None:
                raise RuntimeError(f"{soak.executor} ended early\n{''.join(soak.process.communicate())}")
            soak.samples.append(usage_of(soak.process.pid))
        if sys.stderr.isatty():
            left = (seconds - (time.monotonic() - begin)) / 60
            print(f"\r{left:.0f} min left ", end="", file=sys.stderr, flush=True)


def main() -> int:
    """Exit code."""
    arguments = parser(__doc__)
    arguments.add_argument("--hours", type=float, default=2)
    arguments.add_argument("--executors", default="default,rm-ro,cbg:2", help="one run for each of them")
    arguments.add_argument("--load", default="10", help="work of Autoware's nodes in percent of a core")
    arguments.add_argument("--cpus", help="processors to run on, as in 1 or 0,2-3; by default all")
    arguments.add_argument("--most-growth", type=float, default=1, metavar="PERCENT")
    arguments.add_argument("--hotpath", default=str(ROOT / "build/bench/hotpath"), metavar="PROGRAM")
    arguments.add_argument("--publish", type=Path, metavar="FOLDER", help="write the counts to its soak.json")
    o = arguments.parse_args()
    if o.hours <= 0:
        arguments.error("--hours: a positive number")
    seconds = o.hours * 3600
    with tempfile.TemporaryDirectory(prefix="hotpath_soak_") as scratch:
        soaks = []
        for domain, executor in enumerate(o.executors.split(","), 40):
            folder = Path(scratch) / executor.replace(":", "_")
            words = [
                o.hotpath,
                "run",
                "--repetitions",
                "1",
                "--executors",
                executor,
                "--load",
                o.load,
                "--domain",
                str(domain),
            ]
            words += ["--duration", f"{seconds:g}", "--output", str(folder)]
            words += ["--cpus", o.cpus] if o.cpus else []
            pipes: Any = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
            process = subprocess.Popen(words, text=True, start_new_session=True, **pipes)
            soaks.append(Soak(o.hotpath, executor, folder, process))
        try:
            watch(soaks, seconds)
            results = {soak.executor: soak.result(o.hours) for soak in soaks}
        except RuntimeError as error:
            print(error, file=sys.stderr)
            return 1
        finally:
            for soak in soaks:
                soak.process.terminate()
                soak.process.wait()
    print(json.dumps(results, indent=1))
    grown = any(
        r["growth_percent"] > o.most_growth or r["files_grown"] or r["threads_grown"]
        for r in results.values()
    )
    if not grown and o.publish:
        for executor, result in results.items():
            publish(o.publish.resolve() / "soak.json", result, executor)
    return int(grown)


if __name__ == "__main__":
    sys.exit(main())
