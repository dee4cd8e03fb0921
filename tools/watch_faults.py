#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Injects faults into a program of rclcpp under `hotpath watch`, and reports which it named.

    tools/watch_faults.py --runs 100 PROGRAM           # faulty_program of hotpath_rclcpp's tests
    tools/watch_faults.py --only overrun,burst PROGRAM
    tools/watch_faults.py --calm 600 PROGRAM           # no fault: false alarms, and jobs that were checked

The fault is named correctly if the first incident begins with the broken assumption that belongs to
it. The delay counts from the fault to the arrival of the line that names it. A run with an incident
before the fault is repeated. Needs a sourced ROS 2, and a ROS_DOMAIN_ID without other programs.
"""

import argparse
import json
import math
import os
import random
import re
import signal
import statistics
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

CONTRACT = Path(__file__).resolve().parents[1] / "ros2/hotpath_rclcpp/test/faulty.contract.yaml"
AT_SAMPLES = range(100, 150)  # two to three seconds after the first, at any time between two lines of JSON
PATIENCE_S = 5.0
READER_S = 0.2  # within which the program's output is read
WITHHELD_S = 0.2
EXECUTOR, WITHHELD = "rm-ro", "processor withheld"
# By fault: its name in faulty_program, and how the incident begins, without its instant.
FAULTS = {
    # 8.8 ms of work, and what the hypervisor withholds meanwhile
    "execution overrun by 10 %": ("overrun", r"perception\.filter/points ran (8\.[89]|9\.|\d\d\.)"),
    "timer created with another period": ("period", r"source \(timer\) has a period of 22"),
    "timer's period exchanged": ("exchange", r"source \(timer\) got nothing for"),
    "burst": ("burst", r"perception\.filter/points got samples at a dist|source \(timer\) published 2 "),
    "callback blocks": ("block", r"perception\.sink/perception/objects (ran 2|has run for)"),
    "samples lost": ("lost", r"perception\.filter/points (got samples at|lost)|source \(timer\) published "),
    "publisher stops": ("stop", r"source \(timer\) got nothing for"),
    "second publisher": ("publisher", r"points (is also published by|has a publisher of /added)"),
    "node added": ("node", r"executor ran /added"),
    "policy changed": ("policy", r"executor thread \S+ has the policy"),
    "affinity changed": ("affinity", r"executor thread \S+ may run on processors"),
    WITHHELD: ("none", r"executor thread \S+ waited"),
    "process killed": ("killed", r".*ended by a signal \(Killed\)"),
}


class Run:
    """A watched program, and what it and its watcher say."""

    def __init__(self, options: argparse.Namespace, fault: str, sample: int) -> None:
        words = [options.hotpath, "watch", "--json", "--contract", str(CONTRACT), "--"]
        words += [*options.prefix.split(), options.program, EXECUTOR, fault, str(sample)]
        pipe: Any = subprocess.PIPE
        self.process = subprocess.Popen(words, stdout=pipe, stderr=pipe, text=True)
        self.fault_at: float | None = None
        self.errors: list[str] = []
        self.reader = threading.Thread(target=self.read_output)
        self.reader.start()

    def read_output(self) -> None:
        """Of the program; the watcher passes it on to standard error."""
        for line in self.process.stderr or ():
            if match := re.match(r"fault (\d+)", line):
                self.fault_at = int(match[1]) / 1e9
            else:
                self.errors.append(line.strip())

    def reports(self) -> Any:
        """The lines of JSON, each with its instant of arrival."""
        for line in self.process.stdout or ():
            yield time.monotonic(), json.loads(line)

    def end(self) -> None:
        """Ends watcher and program."""
        self.process.send_signal(signal.SIGINT)
        for _ in self.process.stdout or ():
            pass
        self.process.wait()
        self.reader.join()


def incident_of(report: Any) -> str:
    """The sentence of the run's first incident without its instant; empty: none so far."""
    if "event" not in report:
        sentence = report["contract"]["incident"]
    else:
        sentence = report["incident"] if report["number"] == 1 else ""
    return re.sub(r"^[\d:.]+ ", "", sentence)


def withhold(watcher: int) -> float:
    """Occupies the processor of the watched program above its priority; returns when it began."""
    program = int(Path(f"/proc/{watcher}/task/{watcher}/children").read_text().split()[0])
    cpus = os.sched_getaffinity(program)
    if len(cpus) != 1:
        sys.exit("watch_faults.py: withholding a processor needs a pinned program: --prefix 'taskset -c 1'")
    began = time.monotonic()
    loop = f"import time; e = time.monotonic() + {WITHHELD_S}\nwhile time.monotonic() < e: pass"
    subprocess.run(["taskset", "-c", str(*cpus), "chrt", "-f", "99", sys.executable, "-c", loop], check=True)
    return began


def inject(options: argparse.Namespace, name: str) -> tuple[str, float, bool]:
    """One run: the incident, its delay (s), and whether an incident was reported before the fault."""
    fault, pattern = FAULTS[name]
    run = Run(options, fault, random.choice(AT_SAMPLES))
    said, named_at, disturbed = "nothing", math.nan, False
    for at, report in run.reports():
        incident = incident_of(report)
        if name == WITHHELD and run.fault_at is None and report["time_s"] > 3 and not incident:
            run.fault_at = withhold(run.process.pid)
        if incident and run.fault_at is None:
            time.sleep(READER_S)
        disturbed = bool(incident) and (run.fault_at is None or at < run.fault_at)
        if incident and incident != said:  # a later line may name an earlier cause
            said, named_at = incident, at
        overdue = run.fault_at is not None and at > run.fault_at + PATIENCE_S
        if disturbed or overdue or re.match(pattern, said):
            break
    ended = time.monotonic()
    run.end()
    if said == "nothing" and fault == "killed":
        said, named_at = " ".join(run.errors), ended
    return said, named_at - (run.fault_at or math.nan), disturbed


def inject_all(options: argparse.Namespace) -> None:
    """Prints a line for each kind of fault."""
    for name, (fault, pattern) in FAULTS.items():
        if options.only and fault not in options.only:
            continue
        delays: list[float] = []
        others: list[str] = []
        disturbed = 0
        while len(delays) + len(others) < options.runs:
            said, delay, too_early = inject(options, name)
            if too_early and disturbed < options.runs:
                disturbed += 1
            elif not too_early and re.match(pattern, said):
                delays.append(delay)
            else:
                others.append(said)
        print(f"{name}: {len(delays)} of {options.runs} named, {disturbed} repeated", end="")
        if delays:
            print(f", after {statistics.median(delays):.2f} s (median), {max(delays):.2f} s (most)", end="")
        print("", *(f"    instead: {said[:200]}" for said in sorted(set(others))), sep="\n", flush=True)


def stay_calm(options: argparse.Namespace) -> None:
    """Runs without a fault, and prints what the watcher took for one."""
    run = Run(options, "none", 0)
    report: Any = None
    for _, line in run.reports():
        if "event" not in line:
            report = line
        if line["time_s"] >= options.calm:
            break
    run.end()
    jobs = sum(callback["jobs"] for callback in report["callbacks"])
    broken = [term for term in report["contract"]["terms"] if term["verdict"] == "broken"]
    print(f"{jobs} jobs in {report['time_s']:.0f} s, {report['dropped']} dropped, {len(broken)} terms broken")
    print(*(f"    {term['term']}: {term['reason']}\n" for term in broken), sep="", end="")


def main() -> None:
    """Injects faults, or waits for false alarms."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--hotpath", default="hotpath", help="the command (default: along PATH)")
    parser.add_argument("--runs", type=int, default=10, help="of each fault (default: 10)")
    parser.add_argument("--only", type=lambda text: text.split(","), help="faults of the program")
    parser.add_argument("--calm", type=float, help="seconds without a fault")
    parser.add_argument("--prefix", default="", help="before the program, such as `chrt -f 50`")
    parser.add_argument("program", help="path of faulty_program")
    options = parser.parse_args()
    (stay_calm if options.calm else inject_all)(options)


if __name__ == "__main__":
    main()
