# SPDX-License-Identifier: Apache-2.0
"""`hotpath export perfetto`: part of a run in Chrome's Trace Event Format."""

import json
import math
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hotpath_report.hotpath_command import executor_named
from hotpath_report.run import Run
from hotpath_report.tables import write_output

US_PER_MS = 1e3
TIMER_MANAGEMENT = 1  # worker number in events executors
INSTANTS = ("overwritten", "skipped")  # outcomes marked at their timestamp

Event = dict[str, Any]


def event(job: Any, phase: str, name: str, **more: Any) -> Event:
    """An event of the job's process. Ids are positive, unique and shared with its first thread."""
    return {"ph": phase, "name": name, "pid": 100 * (job.process + 1), **more}


def slices(job: Any, ends: dict[str, list[int]]) -> Iterator[Event]:
    """A job that ran, with its flow ends by phase; a flow end binds to the preceding slice."""
    place = {"tid": int(100 * (job.process + 1) + job.worker), "ts": job.start * US_PER_MS}
    args = {f"{name}_ms": getattr(job, name) for name in ("timestamp", "release", "deadline")}
    args = {"sequence": job.sequence} | {name: ms for name, ms in args.items() if not math.isnan(ms)}
    length = (job.finish - job.start) * US_PER_MS
    yield event(job, "X", job.task, cat=job.kind, dur=length, args=args, **place)
    for phase in ("f", "s"):
        for number in ends[phase]:
            yield event(job, phase, "message", cat="flow", id=number, bp="e", **place)
    if job.late:
        yield marker(job, "deadline missed", job.finish)


def marker(job: Any, what: str, ms: float) -> Event:
    """An instant of a task."""
    place = {"tid": 100 * (job.process + 1), "ts": ms * US_PER_MS}
    return event(job, "i", f"{what}: {job.task}", s="p", cat=what, **place)


def worker_name(executor: str, worker: int) -> str:
    """Display name of a worker. Events executors release timers in a thread of their own."""
    traits = executor_named(executor)  # None: a deployment
    if traits is None or traits.family == "wait_set":
        return f"worker {worker}"
    return "timer management thread" if worker == TIMER_MANAGEMENT else "executor thread"


def events(run: Run, executor: str, repetition: int, begin: float, end: float) -> Iterator[Event]:
    """All events; a flow connects a publishing job with each job that took its message."""
    jobs = run.jobs(executor, repetition, begin, end)
    shown = (jobs["outcome"] == "ran") & (jobs["finish"] >= begin) & (jobs["start"] < end)
    ran = jobs[shown]
    for job in ran.drop_duplicates(["process"]).itertuples():
        name = f"{executor}, repetition {repetition}, process {job.process}"
        yield event(job, "M", "process_name", args={"name": name})
    for job in ran.drop_duplicates(["process", "worker"]).itertuples():
        thread, name = int(100 * (job.process + 1) + job.worker), worker_name(executor, job.worker)
        yield event(job, "M", "thread_name", tid=thread, args={"name": name})
    keys = set(zip(ran["task"], ran["sequence"]))
    flows: dict[Any, dict[str, list[int]]] = defaultdict(lambda: {"f": [], "s": []})
    for number, job in enumerate(ran.itertuples(), 1):
        parent = (job.parent_task, job.parent_sequence)
        if parent in keys:
            flows[job.task, job.sequence]["f"].append(number)
            flows[parent]["s"].append(number)
    marked = jobs["outcome"].isin(INSTANTS) & (jobs["timestamp"] >= begin) & (jobs["timestamp"] < end)
    for job in jobs[shown | marked].itertuples():
        if job.outcome == "ran":
            yield from slices(job, flows[job.task, job.sequence])
        else:
            yield marker(job, job.outcome, job.timestamp)


def write(options: str) -> None:
    """Writes the window that the JSON `options` of `hotpath export perfetto` name. Raises InputError."""
    o: dict[str, Any] = json.loads(options)
    run, end = Run(o["run"]), o["to_ms"]
    executor = o["executor"] or run.executors[0]
    found = events(run, executor, o["repetition"], o["from_ms"], math.inf if end is None else end)
    text = ",\n".join(map(json.dumps, found))
    text = f'{{"displayTimeUnit": "ms", "traceEvents": [\n{text}\n]}}\n'
    write_output(Path(o["output"]), "--output", text)
    print(o["output"])
