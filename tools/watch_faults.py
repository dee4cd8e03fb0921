#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Injects faults into a program of rclcpp under `hotpath watch`, and reports which it named.

    tools/watch_faults.py --runs 100 PROGRAM           # faulty_program of hotpath_rclcpp's tests
    tools/watch_faults.py --only overrun,burst PROGRAM
    tools/watch_faults.py --calm 600 PROGRAM           # no fault: false alarms, and jobs that were checked

Each run starts the system, injects one fault, and reads the watcher's lines of JSON. The fault is
named correctly if the first incident begins with the broken assumption that belongs to it. The delay
counts from the fault to the arrival of the line that names it. A run in which an incident was reported
before the fault shows nothing of the fault, and is repeated. Needs a sourced ROS 2, and a ROS_DOMAIN_ID
without other programs.
"""

import argparse
import json
import os
import random
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import IO, Any, NamedTuple

ROOT = Path(__file__).resolve().parent.parent
CONTRACT = ROOT / "ros2/hotpath_rclcpp/test/faulty.contract.yaml"
CLOCK = ROOT / "build/bench/test/libstepping_clock.so"
AT_SAMPLES = range(100, 150)  # two to three seconds after the first, at any time between two lines of JSON
PATIENCE_S = 5.0
READER_S = 0.2  # within which the program's output is read
WITHHELD_S = 0.2
CGROUPS = Path("/sys/fs/cgroup/cpu")  # version 1, which limits real-time threads as well
STEP_AFTER_S = 2  # before the first sample of AT_SAMPLES
RESTART_SAMPLES = 200  # for which the second watcher starts later than the first
DAY_S = 86400


class Fault(NamedTuple):
    """One kind of fault."""

    program: str  # its name in faulty_program
    incident: str  # regular expression of the beginning of the incident, without its instant


# 8.8 ms of work, and what the hypervisor withholds meanwhile
OVERRUN = r"perception\.filter/points ran (8\.[89]|9\.|\d\d\.)"
FAULTS = {
    "execution overrun by 10 %": Fault("overrun", OVERRUN),
    "timer created with another period": Fault("period", r"source \(timer\) has a period of 22"),
    "timer's period exchanged": Fault("exchange", r"source \(timer\) got nothing for"),
    "burst": Fault("burst", r"perception\.filter/points got samples at a dist|source \(timer\) published 2 "),
    "callback blocks": Fault("block", r"perception\.sink/perception/objects (ran 2|has run for)"),
    "samples lost": Fault(
        "lost", r"perception\.filter/points (got samples at|lost)|source \(timer\) published "
    ),
    "publisher stops": Fault("stop", r"source \(timer\) got nothing for"),
    "second publisher": Fault("publisher", r"points (is also published by|has a publisher of /added)"),
    "node added": Fault("node", r"executor ran /added"),
    "policy changed": Fault("policy", r"executor thread \S+ has the policy"),
    "affinity changed": Fault("affinity", r"executor thread \S+ may run on processors"),
    "processor withheld": Fault("none", r"executor thread \S+ waited"),
    "processor withheld by a cgroup": Fault("none", r"executor thread \S+ waited"),
    "process killed": Fault("killed", r".*ended by a signal \(Killed\)"),
    "watcher killed and restarted": Fault("overrun", OVERRUN),
    "clock stepped": Fault("overrun", OVERRUN),
}
WITHHELD = "processor withheld"
THROTTLED = "processor withheld by a cgroup"
RESTARTED = "watcher killed and restarted"
STEPPED = "clock stepped"


class Outcome(NamedTuple):
    """Of one run."""

    named: bool
    delay: float | None  # seconds; None: the fault was not reported
    said: str
    disturbed: bool  # an incident was reported before the fault


class Run:
    """A watched program, and what it and its watcher say."""

    def __init__(
        self, options: argparse.Namespace, fault: str, sample: int, variables: dict[str, str] | None = None
    ) -> None:
        command = [*options.prefix.split(), options.program, options.executor, fault, str(sample)]
        self.start(options, ["--", *command], variables or {})

    def start(self, options: argparse.Namespace, words: list[str], variables: dict[str, str]) -> None:
        """Starts the watcher."""
        self.process = subprocess.Popen(
            [options.hotpath, "watch", "--json", "--contract", str(options.contract), *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, **variables},
        )
        self.fault_at: float | None = None
        self.errors: list[str] = []
        assert self.process.stderr is not None
        self.reader = threading.Thread(target=self.read_output, args=[self.process.stderr])
        self.reader.start()

    def read_output(self, output: IO[str]) -> None:
        """Of the program; standard error of the watcher."""
        for line in output:
            if match := re.match(r"fault (\d+)", line):
                self.fault_at = int(match[1]) / 1e9
            else:
                self.errors.append(line.strip())

    def reports(self) -> Any:
        """The lines of JSON, each with its instant of arrival."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            yield time.monotonic(), json.loads(line)

    def end(self) -> None:
        """Ends watcher and program."""
        self.process.send_signal(signal.SIGINT)
        assert self.process.stdout is not None
        for _ in self.process.stdout:
            pass
        self.process.wait()
        self.reader.join()


class RestartedRun(Run):
    """A program that runs on its own, whose first watcher was killed."""

    def __init__(self, options: argparse.Namespace, fault: str, sample: int) -> None:
        lines = subprocess.check_output([options.hotpath, "watch", "--print-environment"], text=True)
        variables = dict(line.split("=", 1) for line in lines.splitlines())
        self.program = subprocess.Popen(
            [*options.prefix.split(), options.program, options.executor, fault, str(sample)],
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, **variables},
        )
        self.start(options, [], {})
        for _, report in self.reports():
            if "event" not in report and any(callback["jobs"] for callback in report["callbacks"]):
                break
        self.process.kill()
        self.process.wait()
        self.reader.join()
        self.start(options, [], {})
        assert self.program.stdout is not None
        self.program_reader = threading.Thread(target=self.read_output, args=[self.program.stdout])
        self.program_reader.start()

    def end(self) -> None:
        """Ends watcher and program."""
        super().end()
        if self.program.poll() is not None:
            sys.exit("watch_faults.py: the program did not outlive its watcher")
        self.program.send_signal(signal.SIGINT)
        self.program.wait()
        self.program_reader.join()


def incident_of(report: Any) -> tuple[str, str]:
    """The instant and the sentence of the first one of the run; empty: none so far."""
    if "event" in report:
        sentence = report["incident"] if report["number"] == 1 else ""
    else:
        sentence = report["contract"]["incident"]
    match = re.match(r"([\d:.]+) (.*)", sentence)
    return (match[1], match[2]) if match else ("", "")


def wrong_times(run: Run, instant: str, step_s: int) -> str:
    """What is wrong after the clock was stepped: the time of day of the fault, or a response time."""
    assert run.fault_at is not None
    hours, minutes, seconds = instant.split(":")
    shown = int(hours) * 3600 + int(minutes) * 60 + float(seconds)
    now = time.time() + step_s
    local = time.localtime(now)
    expected = (local.tm_hour * 60 + local.tm_min) * 60 + local.tm_sec + now % 1
    expected -= time.monotonic() - run.fault_at
    off = abs((shown - expected + DAY_S / 2) % DAY_S - DAY_S / 2)
    report = next(report for _, report in run.reports() if "event" not in report)
    slowest = max(c["response_ms"]["max"] for c in report["callbacks"] if c["response_ms"])
    return f"off by {off:.3f} s, slowest response {slowest} ms" if off > 0.1 or slowest > 1000 else ""


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


def throttle(watcher: int) -> float:
    """Limits the watched program to 1 ms of processor time in a cgroup; returns when it began."""
    program = Path(f"/proc/{watcher}/task/{watcher}/children").read_text().split()[0]
    group = CGROUPS / f"watch_faults_{watcher}"
    if not (CGROUPS / "cpu.rt_runtime_us").exists():
        sys.exit(f"watch_faults.py: no cgroup in {CGROUPS} limits real-time threads; leave out `{THROTTLED}`")
    group.mkdir()
    try:
        (group / "cpu.rt_period_us").write_text("1000000")
        (group / "cpu.rt_runtime_us").write_text("1000")
        began = time.monotonic()
        (group / "cgroup.procs").write_text(program)
        time.sleep(WITHHELD_S)
        (CGROUPS / "cgroup.procs").write_text(program)
    finally:
        group.rmdir()
    return began


def stepped_clock(options: argparse.Namespace, step_s: int) -> dict[str, str]:
    """Variables with which the real-time clock of the watcher and its program is stepped."""
    if not options.clock.exists():
        sys.exit(f"watch_faults.py: {options.clock} does not exist; build its target stepping_clock")
    return {
        "LD_PRELOAD": str(options.clock),
        "HOTPATH_CLOCK_STEP": str(step_s),
        "HOTPATH_CLOCK_STEP_FROM": str(int(time.monotonic())),
        "HOTPATH_CLOCK_STEP_AFTER": str(STEP_AFTER_S),
    }


OCCUPATIONS = {WITHHELD: withhold, THROTTLED: throttle}


def inject(options: argparse.Namespace, name: str) -> Outcome:
    """One run."""
    fault = FAULTS[name]
    sample = random.choice(AT_SAMPLES)
    step_s = random.choice((-3600, -5, 5, 3600))
    if name == RESTARTED:
        run: Run = RestartedRun(options, fault.program, sample + RESTART_SAMPLES)
    else:
        run = Run(options, fault.program, sample, stepped_clock(options, step_s) if name == STEPPED else {})
    said, delay, disturbed = "nothing", None, False
    limit = None
    for at, report in run.reports():
        instant, incident = incident_of(report)
        if name in OCCUPATIONS and run.fault_at is None and report["time_s"] > 3 and not incident:
            run.fault_at = OCCUPATIONS[name](run.process.pid)
        if incident and said == "nothing" and run.fault_at is None:
            time.sleep(READER_S)
        disturbed = disturbed or bool(incident) and (run.fault_at is None or at < run.fault_at)
        if incident and incident != said:  # a later line may name an earlier cause
            said = incident
            delay = at - run.fault_at if run.fault_at is not None else None
        if disturbed:
            break
        if re.match(fault.incident, said):
            if name == STEPPED:
                said = wrong_times(run, instant, step_s) or said
            break
        if run.fault_at is not None:
            limit = limit or run.fault_at + PATIENCE_S
        if limit is not None and at > limit:
            break
    ended = time.monotonic()
    run.end()
    if said == "nothing" and fault.program == "killed":
        said = " ".join(run.errors)
        delay = ended - run.fault_at if run.fault_at is not None else None
    return Outcome(not disturbed and re.match(fault.incident, said) is not None, delay, said, disturbed)


def inject_all(options: argparse.Namespace) -> None:
    """Prints a line for each kind of fault."""
    for name in options.only or FAULTS:
        results: list[Outcome] = []
        disturbed: list[Outcome] = []
        while len(results) < options.runs:
            outcome = inject(options, name)
            repeated = outcome.disturbed and len(disturbed) < options.runs
            (disturbed if repeated else results).append(outcome)
        delays = sorted(o.delay for o in results if o.named and o.delay is not None)
        line = f"{name}: {sum(o.named for o in results)} of {options.runs} named"
        if delays:
            line += f", after {delays[len(delays) // 2]:.2f} s (median), {delays[-1]:.2f} s (most)"
        print(line, flush=True)
        for said in sorted({o.said for o in results if not o.named}):
            print(f"    instead: {said[:200]}", flush=True)
        for said in sorted({o.said for o in disturbed}):
            print(f"    before the fault: {said[:200]}", flush=True)


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
    losses = {key: report[key] for key in ("dropped", "damaged", "late")}
    print(f"{jobs} jobs in {report['time_s']:.0f} s, {len(broken)} terms broken, {losses}")
    for term in broken:
        print(f"    {term['term']}: {term['reason']}")
    for incident in report["contract"]["incidents"]:
        print(f"    incident {incident['number']}: {incident['incident']}")


def main() -> None:
    """Injects faults, or waits for false alarms."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--hotpath", default="hotpath", help="the command (default: along PATH)")
    parser.add_argument("--runs", type=int, default=10, help="of each fault (default: 10)")
    parser.add_argument("--only", type=lambda text: text.split(","), help="program's or full names of faults")
    parser.add_argument("--calm", type=float, help="seconds without a fault")
    parser.add_argument("--executor", default="rm-ro", help="of the program (default: rm-ro)")
    parser.add_argument("--contract", type=Path, default=CONTRACT, help="default: that of faulty_program")
    parser.add_argument("--clock", type=Path, default=CLOCK, help="libstepping_clock.so (default: in build)")
    parser.add_argument("--prefix", default="", help="before the program, such as `chrt -f 50`")
    parser.add_argument("program", help="path of faulty_program")
    options = parser.parse_args()
    if options.only:
        options.only = [name for name, fault in FAULTS.items() if {name, fault.program} & set(options.only)]
    if options.calm:
        stay_calm(options)
    else:
        inject_all(options)


if __name__ == "__main__":
    main()
