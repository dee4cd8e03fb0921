#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Records a test program with LTTng and checks the executor's events against ros2_tracing's."""

import subprocess
import sys
import tempfile
from pathlib import Path

from lttng_session import Event, missing_programs, read, recording

SKIPPED = 77  # for CTest's SKIP_RETURN_CODE
NEVER = 2**63 - 1
EVENTS = ("hotpath:*", "ros2:rcl_timer_init", "ros2:callback_start")


def check(events: list[Event]) -> None:
    """The events of one executor rm-ro with a timer of 5 ms."""

    def named(name: str) -> list[dict[str, str]]:
        return [event.fields for event in events if event.name == name]

    (init,) = named("hotpath:executor_init")
    assert (init["name"], init["policy"], init["timers"]) == ("rm-ro", "rm", "release_only"), init
    assert (init["rule"], init["ties"], init["threads"], init["learn"]) == ("inherit", "lifo", "1", "1"), init
    assert {thread["role"] for thread in named("hotpath:executor_thread")} == {"executor"}
    (timer,) = [c for c in named("hotpath:executor_callback") if c["id"] == "/node@Timer(5000000)"]
    assert (timer["kind"], timer["node"], timer["period"]) == ("timer", "/node", "5000000"), timer
    assert timer["handle"] in {created["timer_handle"] for created in named("ros2:rcl_timer_init")}
    levels = {p["task"]: int(p["level"]) for p in named("hotpath:executor_priority")}
    assert levels[timer["task"]] == 5_000_000, levels
    services = [c["task"] for c in named("hotpath:executor_callback") if c["kind"] == "service"]
    assert services and all(levels[task] == NEVER for task in services), levels
    jobs = [j for j in named("hotpath:executor_job") if j["task"] == timer["task"]]
    assert len(jobs) >= 5, jobs
    first = jobs[0]
    for job in jobs:
        since = int(job["timestamp"]) - int(first["timestamp"])
        assert since == 5_000_000 * (int(job["sequence"]) - int(first["sequence"])), job
        assert int(job["timestamp"]) <= int(job["release"]), job
        assert int(job["deadline"]) == int(job["timestamp"]) + 5_000_000, job
    for index, event in enumerate(events):
        if event.name == "hotpath:executor_job" and event.fields["task"] == timer["task"]:
            following = next(e for e in events[index + 1 :] if e.thread == event.thread)
            assert following.name == "ros2:callback_start", following


def check_ends(events: list[Event]) -> None:
    """Exactly the jobs of clients and of waitables without own events end with executor_end, on the
    thread of their executor_job."""
    kinds: dict[str, str] = {}
    clients = 0
    job: Event | None = None
    for event in events:
        if event.name == "hotpath:executor_callback":
            kinds[event.fields["task"]] = event.fields["kind"]
        elif event.name == "hotpath:executor_job":
            job = event
        elif event.name == "hotpath:executor_end":
            kind = kinds[event.fields["task"]]
            assert kind in ("client", "waitable"), (kind, event)
            assert job and (job.thread, job.fields["task"]) == (event.thread, event.fields["task"]), event
            assert job.at_ns <= event.at_ns, (job, event)
            clients += kind == "client"
    assert clients > 0


def record(program: str, test: str, trace: Path) -> list[Event]:
    """The events of a test of the program under rm-ro."""
    with recording(trace, *EVENTS):
        command = [program, f"--gtest_filter=Executors/EveryExecutor.{test}/rm_ro"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return read(trace)


def main() -> int:
    """Usage: tracepoints_test.py ENTITIES_TEST."""
    if missing_programs():
        print(f"left out: {missing_programs()} not found; install lttng-tools and babeltrace2")
        return SKIPPED
    with tempfile.TemporaryDirectory() as folder:
        check(record(sys.argv[1], "RunsATimer", Path(folder) / "timer"))
        check_ends(record(sys.argv[1], "ServesRequestsAndAnswers", Path(folder) / "client"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
