# SPDX-License-Identifier: Apache-2.0
"""What the cells measured, reduced to what figures and claims need; written and read as CSV.

Every quantity leaves out the warm-up in the same way: jobs count from the first timestamp after it, chains likewise.
"""

import contextlib
import csv
import gzip
import io
import json
import os
import zlib
from collections import Counter
from pathlib import Path

import numpy as np

from inference import Samples

HOT_PATH_FILE, RESPONSES_FILE, TIMERS_FILE = "hot_path.csv.gz", "responses.csv.gz", "timers.csv"
COPIED_TABLES = ("waters_summary.csv", "waters_histogram.csv", "wcrt_table.csv", "release_cost.csv")
GROUPS = ("camera", "lidar", "imu")


class BadResults(Exception):
    """What the user gave is no usable result; the message says what is wrong and what would be right."""


def group_of(task):
    return next((group for group in GROUPS if group in task.lower()), None)


def base_name(executor):
    """`multi:2` is `multi`: the number of threads is that of the cores, which every figure states."""
    return "multi" if executor.startswith("multi") else executor


class Timer:
    """One timer under one executor, over all repetitions."""

    def __init__(self):
        self.reached, self.deadline_ms = 0, None
        self.skipped_in, self.overruns_in = Counter(), Counter()  # by repetition
        self.responses = {}  # by repetition, ms, in the order of time

    @property
    def skipped(self):
        return self.skipped_in.total()

    @property
    def overruns(self):
        return self.overruns_in.total()

    @property
    def ran(self):
        return sum(len(r) for r in self.responses.values())

    @property
    def worst_ms(self):
        return max((max(r) for r in self.responses.values() if len(r)), default=float("nan"))


def in_turns(series):
    """Several timers' values as one series in the order of time; timers of one group have the same period."""
    when = np.concatenate([np.arange(len(values)) / len(values) for values in series])
    return np.concatenate(series)[np.argsort(when, kind="stable")]


class TimerRuns:
    """All timers under one executor at one utilisation."""

    def __init__(self, exact):
        self.exact = exact
        self.tasks = {}
        self.bounds_ms = {}  # by task
        self._responses = {}

    def timer(self, task):
        return self.tasks.setdefault(task, Timer())

    def of_group(self, group):
        return [timer for task, timer in self.tasks.items() if group is None or group_of(task) == group]

    def drop_percent(self, group=None):
        reached = sum(t.reached for t in self.of_group(group))
        return 100 * sum(t.skipped for t in self.of_group(group)) / reached if reached else float("nan")

    def total(self, what, group=None):
        return sum(getattr(t, what) for t in self.of_group(group))

    def responses(self, group):
        if group not in self._responses:
            merged = {}
            for timer in self.of_group(group):
                for repetition, values in timer.responses.items():
                    merged.setdefault(repetition, []).append(values)
            self._responses[group] = Samples(map(in_turns, merged.values()), exact=self.exact)
        return self._responses[group]


class Evidence:
    def __init__(self):
        self.hot_path = {}  # (study, source, executor, load): {repetition: ms}
        self.timers = {}  # (study, source, utilisation, executor): TimerRuns
        self.tables = {}  # name of a file: rows
        self.cells = []  # facts of every cell
        self.machine = None
        self.mode = ""
        self._latencies = {}

    def latencies(self, study, source, executor, load=80):
        key = (study, source, executor, load)
        if not self.hot_path.get(key):
            return None
        if key not in self._latencies:
            self._latencies[key] = Samples(self.hot_path[key].values(), exact=source == "simulated")
        return self._latencies[key]

    def worst_of_draws(self, source, executor):
        """Worst and median latency of each draw of random phases."""
        repetitions = self.hot_path.get(("phases", source, executor, 80), {})
        return [(float(np.median(r)), max(r)) for r in repetitions.values() if len(r)]

    def runs(self, source, percent, executor, study="timers"):
        return self.timers.get((study, source, percent, executor))

    def marked(self, study, percent, executor):
        """Live repetitions of a timers-only cell that are marked as noisy."""
        return {
            c["repetition"]
            for c in self.cells
            if c["study"] == study
            and c["source"] == "live"
            and c["noise"]["marks"]
            and c["command"][c["command"].index("--executor") + 1] == executor
            and f"timers_only_{percent}" in c["command"]
        }

    def table(self, name):
        return self.tables.get(name, [])


def read_table(path):
    try:
        with open(path, newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))
    except OSError as error:
        raise BadResults(f"{path}: {error.strerror}") from None


def csv_columns(path, names):
    opened = gzip.open if path.suffix == ".gz" else open
    try:
        with opened(path, "rt", newline="", encoding="utf-8") as file:
            reader = csv.reader(file)
            header = next(reader, [])
            try:
                places = [header.index(name) for name in names]
            except ValueError as error:
                raise BadResults(f"{path}: a column is missing: {error}") from None
            for row in reader:
                yield [row[place] for place in places]
    except (EOFError, zlib.error, gzip.BadGzipFile, IndexError):
        raise BadResults(f"{path}: ends too early, or is damaged; make it again") from None
    except OSError as error:
        raise BadResults(f"{path}: {error.strerror}") from None


def add_chains(evidence, folder, study, source, load, repetition):
    for executor, index, latency in csv_columns(
        folder / "chains.csv", ("executor", "repetition", "hot_path_latency_ns")
    ):
        key = (study, source, base_name(executor), load)
        number = repetition if source == "live" else int(index)
        evidence.hot_path.setdefault(key, {}).setdefault(number, []).append(int(latency) / 1e6)


def add_timer_jobs(evidence, folder, study, source, run, percent, repetition):
    warm_up_ns = int(run["warm_up_s"] * 1e9)
    columns = ("executor", "task", "outcome", "timestamp_ns", "finish_ns", "deadline_ns")
    for executor, task, outcome, timestamp, finish, deadline in csv_columns(folder / "jobs.csv", columns):
        released = int(timestamp)
        if released < warm_up_ns:
            continue
        key = (study, source, percent, executor)
        if key not in evidence.timers:
            evidence.timers[key] = TimerRuns(exact=source == "simulated")
        timer = evidence.timers[key].timer(task)
        timer.reached += 1
        if outcome == "skipped":
            timer.skipped_in[repetition] += 1
        elif outcome == "ran":
            timer.responses.setdefault(repetition, []).append((int(finish) - released) / 1e6)
            timer.overruns_in[repetition] += int(finish) > int(deadline)
            timer.deadline_ms = (int(deadline) - released) / 1e6
    for bound in run.get("bounds", []):
        runs = evidence.timers.get((study, source, percent, bound["executor"]))
        if runs is not None:
            runs.bounds_ms[bound["task"]] = bound["ms"]


def collect(output, cells):
    """Evidence of those cells that are complete."""
    evidence = Evidence()
    for cell in cells:
        folder = Path(output) / "cells" / cell.name
        facts = json.loads((folder / "cell.json").read_text(encoding="utf-8"))
        facts["name"] = cell.name
        evidence.cells.append(facts)
        if cell.source == "analysis":
            for name in COPIED_TABLES:
                if (folder / name).exists():
                    evidence.tables[name] = read_table(folder / name)
            continue
        run = json.loads((folder / "run.json").read_text(encoding="utf-8"))
        facts.update({key: run[key] for key in ("duration_s", "warm_up_s")})
        if cell.source == "live":
            evidence.machine = {**run["machine"], "date": run["date"], "transport": run["transport"]}
            facts["policies"] = sorted({p for r in run["runs"] for p in r.get("thread_policies", [])})
        if cell.study.startswith("timers"):
            percent = int(run["graph"]["name"].split("_")[2])
            add_timer_jobs(evidence, folder, cell.study, cell.source, run, percent, cell.repetition)
        else:
            load = int(round(run["load_percent"])) if cell.study == "load" else 80
            add_chains(evidence, folder, cell.study, cell.source, load, cell.repetition)
    return evidence


@contextlib.contextmanager
def written(path):
    """A text file that gets its name when it is whole; compressed where the name says so."""
    part = path.with_name(f".{path.name}.part")
    with open(part, "wb") as raw:
        # Neither name nor time stamp inside: the same samples give the same bytes.
        packed = gzip.GzipFile("", "wb", 6, raw, mtime=0) if path.suffix == ".gz" else raw
        with packed, io.TextIOWrapper(packed, encoding="utf-8", newline="") as file:
            yield file
    os.replace(part, path)


def counted(values, exact):
    """(text, count) of each sample; of an exact simulation, whose samples repeat, each value once."""
    texts = (f"{v:.6f}".rstrip("0").rstrip(".") for v in values)
    return Counter(texts).items() if exact else ((text, 1) for text in texts)


def write(evidence, folder):
    folder.mkdir(parents=True, exist_ok=True)
    with written(folder / HOT_PATH_FILE) as file:
        file.write("study,source,load_percent,executor,repetition,hot_path_ms,count\n")
        for (study, source, executor, load), repetitions in evidence.hot_path.items():
            for repetition, values in repetitions.items():
                for text, count in counted(values, source == "simulated"):
                    file.write(f"{study},{source},{load},{executor},{repetition},{text},{count}\n")
    with written(folder / RESPONSES_FILE) as file:
        file.write("study,source,utilisation_percent,executor,task,repetition,response_ms,count\n")
        for (study, source, percent, executor), runs in evidence.timers.items():
            for task, timer in runs.tasks.items():
                for repetition, values in timer.responses.items():
                    for text, count in counted(values, source == "simulated"):
                        file.write(f"{study},{source},{percent},{executor},{task},{repetition},{text},{count}\n")
    with written(folder / TIMERS_FILE) as file:
        file.write(
            "study,source,utilisation_percent,executor,task,reached,ran,skipped,deadline_overruns,deadline_ms,"
            "response_max_ms,bound_ms\n"
        )
        for (study, source, percent, executor), runs in evidence.timers.items():
            for task, t in runs.tasks.items():
                bound = runs.bounds_ms.get(task, "")
                file.write(
                    f"{study},{source},{percent},{executor},{task},{t.reached},{t.ran},{t.skipped},{t.overruns},"
                    f"{t.deadline_ms},{t.worst_ms:.6f},{bound}\n"
                )
    for name, rows in evidence.tables.items():
        with written(folder / name) as file:
            writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)


def read_samples(folder):
    """{(what, study, source, setting, executor, repetition): [ms]} of a folder that `write` made."""
    samples = {}
    columns = ("study", "source", "load_percent", "executor", "repetition", "hot_path_ms", "count")
    for study, source, load, executor, repetition, value, count in csv_columns(folder / HOT_PATH_FILE, columns):
        key = ("hot path", study, source, f"{load} %", executor, "", repetition)
        samples.setdefault(key, []).extend([float(value)] * int(count))
    columns = ("study", "source", "utilisation_percent", "executor", "task", "repetition", "response_ms", "count")
    for study, source, percent, executor, task, repetition, value, count in csv_columns(
        folder / RESPONSES_FILE, columns
    ):
        key = ("response", study, source, f"{percent} %", executor, group_of(task) or task, repetition)
        samples.setdefault(key, []).extend([float(value)] * int(count))
    return samples
