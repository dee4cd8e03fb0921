#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Runs `hotpath watch` on a program of rclcpp, under its own executors and PriorityExecutor, on each
installed middleware: names, counts, a contract, the flight recorder, and LTTng on the same run."""

import contextlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import lttng_session

HOTPATH = os.environ.get("HOTPATH_COMMAND") or shutil.which("hotpath") or ""
PROGRAM = sys.argv.pop(1)  # watched_program
FAULTY = sys.argv.pop(1)  # faulty_program
GRAPH = Path(__file__).parent / "watched.yaml"
SAMPLES = 100  # the depth of watched.yaml
MOST_REPORTS = 60  # of `hotpath watch`, one a second, until a fault is named
TIMER = ("/source", "timer")
CALLBACKS = {
    TIMER: SAMPLES,
    ("/perception/filter", "/points"): SAMPLES,
    ("/perception/sink", "/perception/objects"): SAMPLES,
}
EXECUTORS = ("single", "events", "rm-ro")
# Recorded at run time; other events belong to creations.
RUNNING = ("callback_start", "callback_end", "rcl_publish", "rmw_publish", "rmw_take")
CONTEXT = ("vpid", "vtid", "procname", "cpu_id")


def middlewares() -> list[str]:
    """The installed ones that this project supports."""
    found = set()
    for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(":"):
        folder = Path(prefix) / "share/ament_index/resource_index/rmw_typesupport"
        found |= {path.name for path in folder.glob("*")} if folder.is_dir() else set()
    return sorted(found & {"rmw_fastrtps_cpp", "rmw_cyclonedds_cpp"})


def reason_to_skip() -> str:
    """Why `hotpath watch` cannot run here; empty if it can."""
    if not HOTPATH:
        return "left out: the command hotpath is not on PATH; build the package hotpath_bench"
    tried = subprocess.run([HOTPATH, "watch", "--once", "--", "true"], capture_output=True, text=True)
    no_sensor = tried.returncode != 0 and "install the package hotpath_sensor" in tried.stderr
    return f"left out: {tried.stderr.strip()}" if no_sensor else ""


@contextlib.contextmanager
def running(command: list[str], **options: Any) -> Iterator["subprocess.Popen[str]"]:
    """Ends it on leaving."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, **options)
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate()


# What the first sentence of an incident tells of a fault. No test sets the clock here.
FAULTS = {
    "killed": r" nodes .*source.* are gone: their process \d+ has ended",
    "remap": " perception.sink/perception/objects has never run: its node has no such callback, but "
    "subscribes to /perception/elsewhere",
    "mute": " perception.sink/perception/objects got nothing for ",
    "qos": " perception.sink/perception/objects has never run, although .* QoS settings did not match",
    "period": r" source \(timer\) has a period of 22.000 ms, period 20.000 ms",
    "slow": " perception.filter/points (has run for|ran) .*, budget 250.000 ms",
    "busy": " executor thread .* (waited|has run nothing for) .*",
    "policy": " executor thread .* has the policy fifo:1",
    "throttled": r" executor thread .* (waited|has run nothing for) .* \(its control group (was throttled|"
    r"may run 1.000 ms in 1000.000 ms)\)",
    "stopped": " executor thread .* has run nothing for .*, because it is stopped",
    "destroy": " perception.sink/perception/objects has not run for .*, although samples were",
    "unserve": r" perception.sink/perception/list \(service\) got nothing for ",
}
FAULTY_CONTRACT = """
callbacks:
- node: source
  period_ms: {value: 20, from: given}
  maximum_distance_ms: {value: 700, from: given}
  publishes: [{topic: points}]
- node: perception.filter
  topic: points
  budget_ms: {value: 250, from: given}
  publishes: [{topic: perception/objects}]
- {node: perception.sink, topic: perception/objects, maximum_distance_ms: {value: 1000, from: given}}
- {node: perception.sink, service: perception/list, maximum_distance_ms: {value: 1000, from: given}}
threads:
- name: executor
  callbacks: [source (timer), perception.filter/points, perception.sink/perception/objects]
  policy: {value: other, from: given}
  wait_ms: {value: 900, from: given}
"""


class Watched:
    """A running `hotpath watch --json` on PROGRAM, whose system has just come to rest."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self.process = process
        self.reports: list[Any] = []
        while not self.rests():
            self.report()

    def rests(self) -> bool:
        """Whether all samples have arrived and nothing has happened since."""
        if len(self.reports) < 2 or self.reports[-1]["events"] != self.reports[-2]["events"]:
            return False
        return any(c["node"] == "/perception/sink" and c["jobs"] >= SAMPLES for c in self.callbacks())

    def report(self) -> Any:
        """Waits for the next line of JSON that is no event."""
        assert self.process.stdout is not None
        while line := self.process.stdout.readline():
            report = json.loads(line)
            if "event" not in report:
                self.reports.append(report)
                return report
        raise AssertionError("hotpath watch has ended")

    def callbacks(self) -> list[Any]:
        """Of the last report."""
        return list(self.reports[-1]["callbacks"])

    def jobs(self) -> dict[tuple[str, str], int]:
        """Jobs by node and topic (timers: `timer`), without the topics of rclcpp itself."""
        named = {(c["node"], c.get("topic", c["kind"])): c["jobs"] for c in self.callbacks()}
        return {key: jobs for key, jobs in named.items() if key[1] not in ("/parameter_events", "/rosout")}


class WatchTest(unittest.TestCase):
    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    @contextlib.contextmanager
    def watch(self, middleware: str, *words: str, options: tuple[str, ...] = ()) -> Iterator[Watched]:
        """Ends the watcher and its program on leaving."""
        command = [HOTPATH, "watch", "--json", *options, "--", PROGRAM, *words]
        with running(command, env={**os.environ, "RMW_IMPLEMENTATION": middleware}) as process:
            yield Watched(process)

    def stated_contract(self) -> str:
        """The contract of watched.yaml."""
        path = self.folder / "contract.yaml"
        command = [HOTPATH, "analyze", str(GRAPH), "--executors", "rm-ro", "--contract", str(path)]
        subprocess.run(command, check=True, capture_output=True)
        return path.read_text()

    def record(self, watched: Watched, folder: Path) -> Path:
        """The snapshot of all that was recorded."""
        watched.process.send_signal(signal.SIGUSR1)
        before = set(folder.glob("*"))
        while set(folder.glob("snapshot_*")) == before:
            watched.report()
        return max(set(folder.glob("snapshot_*")) - before, key=lambda path: path.stat().st_mtime)

    def test_names_callbacks_and_counts_their_jobs(self) -> None:
        cases = [(middleware, executor, "") for middleware in middlewares() for executor in EXECUTORS]
        cases += [(middlewares()[0], executor, "intra_process") for executor in EXECUTORS]
        for middleware, executor, word in cases:
            with self.subTest(middleware=middleware, executor=executor, word=word):
                with self.watch(middleware, executor, str(SAMPLES), word) as watched:
                    jobs = watched.jobs()
                    if executor == "events":  # runs expiries that it queued before the cancellation
                        self.assertGreaterEqual(jobs[TIMER], SAMPLES)
                        jobs[TIMER] = SAMPLES
                    self.assertEqual(jobs, CALLBACKS)
                    report = watched.reports[-1]
                    self.assertEqual((report["processes"], report["dropped"]), (1, 0))
                    self.assertEqual((report["damaged"], report["ignored_entities"]), (0, 0))
                    self.assertEqual({c["lost"] for c in watched.callbacks()}, {0})
                    for callback in watched.callbacks():
                        self.assertIsNotNone(callback["response_ms"], callback)

    def check_terms(self, report: Any, verdict: str) -> None:
        """Verdicts on periods and depths; the others depend on the load of the machine."""
        stated = [term for term in report["contract"]["terms"] if "callback" in term]
        terms = {(term["callback"], term["term"]): term for term in stated}
        names = {"source (timer)", "perception.filter/points", "perception.sink/perception/objects"}
        self.assertEqual({callback for callback, _ in terms}, names)
        for (callback, name), term in terms.items():
            with self.subTest(callback=callback, term=name):
                if name in ("depth", "period_ms"):
                    self.assertEqual(term["verdict"], verdict)
                if name in ("budget_ms", "depth", "period_ms", "minimum_distance_ms", "response_ms"):
                    self.assertGreaterEqual(term["checked"], SAMPLES - 1)

    def test_checks_the_contract_that_analyze_states_and_records(self) -> None:
        contract = self.folder / "contract.yaml"
        contract.write_text(self.stated_contract())
        for middleware in middlewares():
            with self.subTest(middleware=middleware):
                folder = self.folder / middleware
                options = ("--contract", str(contract), "--output", str(folder), "--keep", "600")
                with self.watch(middleware, "rm-ro", str(SAMPLES), options=options) as watched:
                    report = watched.reports[-1]
                    self.check_terms(report, "held" if report["late"] == 0 else "not observable")
                    snapshot = self.record(watched, folder)
                output = self.folder / f"{middleware}.imported"
                command = [HOTPATH, "import", "ctf", str(snapshot), "--output", str(output)]
                done = subprocess.run(command, capture_output=True, text=True)
                self.assertEqual(done.returncode, 0, done.stderr)
                graph = next(output.rglob("graph.yaml")).read_text()
                for name in ("source", "perception.filter", "perception.sink"):
                    self.assertIn(name, graph)

    def test_a_broken_contract_is_noticed(self) -> None:
        text = self.stated_contract()
        wrong = re.sub(r"(period_ms: *\{value: *)10\b", r"\g<1>20", text)
        wrong = re.sub(r"(depth: *\{value: *)100\b", r"\g<1>99", wrong)
        self.assertNotEqual(wrong, text)
        contract = self.folder / "contract.yaml"
        contract.write_text(wrong)
        options = ("--contract", str(contract))
        with self.watch(middlewares()[0], "single", str(SAMPLES), options=options) as watched:
            self.check_terms(watched.reports[-1], "broken")

    def disturb(self, fault: str, process: int) -> None:
        """Takes the processor from the program, which has run."""
        if fault == "busy":
            os.sched_setaffinity(process, {0})
            os.sched_setscheduler(process, os.SCHED_IDLE, os.sched_param(0))
            taker = subprocess.Popen(["taskset", "-c", "0", "sh", "-c", "while :; do :; done"])
            self.addCleanup(taker.wait)
            self.addCleanup(taker.kill)
            return
        group = Path(f"/sys/fs/cgroup/cpu/hotpath_{process}")
        group.mkdir()
        self.addCleanup(group.rmdir)
        for file, value in (
            ("cpu.cfs_period_us", 1000000),
            ("cpu.cfs_quota_us", 1000),
            ("cgroup.procs", process),
        ):
            (group / file).write_text(str(value))

    def test_names_each_fault_first(self) -> None:
        contract = self.folder / "contract.yaml"
        contract.write_text(FAULTY_CONTRACT)
        for fault, sentence in FAULTS.items():
            if fault == "throttled" and not os.access("/sys/fs/cgroup/cpu/cpu.cfs_quota_us", os.F_OK):
                continue
            with self.subTest(fault=fault):
                program = [FAULTY, "rm-ro", fault, "100"]
                if fault == "killed":
                    program = ["sh", "-c", '"$@"; exec sleep 1000', "sh", *program]
                command = [HOTPATH, "watch", "--json", "--contract", str(contract), "--", *program]
                with running(command, stderr=subprocess.DEVNULL) as watcher:
                    lines = map(json.loads, watcher.stdout or [])
                    if fault in ("busy", "throttled"):
                        ran = (r for r in lines if any(c["jobs"] > 100 for c in r.get("callbacks", [])))
                        self.disturb(fault, next(ran)["executor_threads"][0]["process"])
                    said, reports = [], 0
                    for line in lines:
                        reports += "event" not in line
                        said += [line["incident"]] if "event" in line else []
                        if reports == MOST_REPORTS or re.search(sentence, "\n".join(said)):
                            break
                    self.assertRegex("\n".join(said), sentence, f"{fault}: the watcher said otherwise")

    def test_lttng_sees_the_same_events_in_the_same_order(self) -> None:
        if lttng_session.missing_programs():
            self.skipTest(f"left out: {lttng_session.missing_programs()} not found")
        for middleware in middlewares():
            for executor in ("single", "rm-ro"):
                with self.subTest(middleware=middleware, executor=executor):
                    folder = self.folder / f"{middleware}.{executor}"
                    options = ("--output", str(folder / "watch"), "--keep", "600")
                    folder.mkdir()
                    with lttng_session.recording(folder / "lttng", *(f"ros2:{name}" for name in RUNNING)):
                        with self.watch(middleware, executor, str(SAMPLES), options=options) as watched:
                            snapshot = self.record(watched, folder / "watch")
                    self.assert_same(lttng_session.read(folder / "lttng"), lttng_session.read(snapshot))

    def assert_same(self, of_lttng: list[Any], of_watch: list[Any]) -> None:
        """Per thread: LTTng reads its clock before the sensor, so threads may overtake each other.
        LTTng also saw the end of the program."""

        def by_thread(events: list[Any]) -> dict[str, list[Any]]:
            threads: dict[str, list[Any]] = {}
            for event in events:
                if event.name.removeprefix("ros2:") in RUNNING:
                    threads.setdefault(event.thread, []).append(event)
            return threads

        def content(event: Any) -> Any:
            return event.name, {key: value for key, value in event.fields.items() if key not in CONTEXT}

        expected = by_thread(of_lttng)
        seen = by_thread(of_watch)
        self.assertEqual(seen.keys() - expected.keys(), set())
        for thread, events in expected.items():
            recorded = seen.get(thread, [])
            same = events[: len(recorded)]
            self.assertEqual([content(event) for event in recorded], [content(event) for event in same])
            # Both clocks are CLOCK_MONOTONIC; only a load on the machine separates them by more.
            self.assertEqual([event for event, other in zip(recorded, same) if event.at_ns < other.at_ns], [])
        ended = [e for events in seen.values() for e in events if e.name == "ros2:callback_end"]
        self.assertGreaterEqual(len(ended), 3 * SAMPLES)


if __name__ == "__main__":
    if reason := reason_to_skip():
        print(reason)
        sys.exit(77)
    unittest.main()
