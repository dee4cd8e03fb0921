# SPDX-License-Identifier: Apache-2.0
"""Measurements of the cells, and data/ of a reproduction, which stores them; measurements of the real ROS 2
stack on the same workloads (reference_system/ros2_reference). The warm-up is left out as in summaries."""

import functools
import gzip
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from operator import itemgetter
from pathlib import Path
from typing import Any

from hotpath_report.errors import Missing, need
from hotpath_report.files import Rows, csv_text, make_folder, read_json, read_rows, write_file, write_json
from hotpath_report.hotpath_command import PACKAGE, ask
from hotpath_report.paper.cells import PAPER_LOAD_PERCENT, Cell
from hotpath_report.run import COUNTS, Run
from hotpath_report.statistics import Samples, grouped

REAL = "real"  # the source of its rows
WITH_COST = "timers_with_release_cost"  # a study
PACKAGES = ("reference_system", "hotpath_reference_system")  # in the source tree and installed
COUNTED_IN_TRACES = "events-re"  # the longer runs lack it
AUTOWARE_CRUNCH_LIMIT = 6000  # 80 % of one core on the reference machine
# Groups of timers, by part of the task name.
GROUPS = {"camera": "cameras", "lidar": "LiDARs", "imu": "IMU"}

COPIED_TABLES = ("waters_summary.csv", "waters_histogram.csv", "wcrt_table.csv", "release_cost.csv")
HOT_PATH_KEYS = ("study", "source", "load_percent", "executor", "repetition")
TIMER_KEYS = ("study", "source", "utilisation_percent", "executor", "task", "repetition")
TIMER_COLUMNS = (*TIMER_KEYS, *COUNTS, "deadline_ms", "response_max_ms", "bound_ms")
HOT_PATH_FILE, RESPONSES_FILE, TIMERS_FILE = "hot_path.csv.gz", "responses.csv.gz", "timers.csv"
CELLS_FILE = "cells.json"


def group_of(task: str) -> str:
    """The group of a timer; empty if it has none."""
    return next((group for group in GROUPS if group in task.lower()), "")


@functools.cache
def real_stack() -> tuple[Rows, dict[str, dict[str, Any]]]:
    """Of the real ROS 2 stack: timers as in timers.csv, and hot path (ms) by executor; empty if not measured."""
    folders = (PACKAGE.parents[1] / package / "ros2_reference" for package in PACKAGES)
    if not (folder := next(filter(Path.is_dir, folders), None)):
        return [], {}
    counted = read_rows(folder / "rclcpp_timers_only.csv")
    counted = [row | {"reached": row["released"], "skipped": row["dropped"]} for row in counted]
    # The authors' programs measure another response time, see the reference's README.
    key, worst_ms = itemgetter("utilisation_percent", "executor", "task"), {}
    for path in sorted((folder / "traces").glob("timers_only_*.csv")):
        percent, executor = path.stem.removeprefix("timers_only_").split(".")
        for timer in ask("golden", str(path))["tasks"]:
            row = timer | {"utilisation_percent": int(percent), "executor": executor}
            worst_ms[key(row)] = row["response_max_ms"]
            counted += [row] if executor == COUNTED_IN_TRACES else []
    for row in counted:
        row |= {"study": "timers", "source": REAL, "ran": row["reached"] - row["skipped"]}
        row["response_max_ms"] = worst_ms.get(key(row))
    autoware = read_rows(folder / "rclcpp_autoware.csv")
    return counted, {r["executor"]: r for r in autoware if r["crunch_limit"] == AUTOWARE_CRUNCH_LIMIT}


def base_name(executor: str) -> str:
    """Executor without its number of threads (`multi` for `multi:2`)."""
    return re.sub(r":\d+$", "", executor)


def merged(rows: Rows) -> list[float]:
    """Response times (ms) of several timers of one period in the order of time."""
    jobs = [(k / len(ms), ms[k]) for ms in (row["response_ms"] for row in rows) for k in range(len(ms))]
    return [ms for _, ms in sorted(jobs, key=itemgetter(0))]


@dataclass(eq=False)
class Evidence:
    """Measurements, and facts about cells and machine; samples without data are empty. Rows of `hot_path` and
    `responses` are of a repetition, and have all values (ms) in the order of time."""

    hot_path: Rows = field(default_factory=list)
    timers: Rows = field(default_factory=list)
    responses: Rows = field(default_factory=list)
    tables: dict[str, Rows] = field(default_factory=dict)
    cells: list[dict[str, Any]] = field(default_factory=list)  # facts of every cell
    machine: dict[str, Any] | None = None  # of the live cells
    mode: str = ""

    @functools.cached_property
    def samples(self) -> dict[tuple[str, str, int, str, str], Samples]:
        """{(study, source, load or utilisation in percent, executor, group of timers): latencies or response times in
        ms}; the group of the hot path is empty."""
        repetitions: dict[Any, list[list[float]]] = {
            (*key, ""): [row["hot_path_ms"] for row in rows]
            for key, rows in grouped(self.hot_path, *HOT_PATH_KEYS[:-1]).items()
        }
        responses = (row | {"group": of} for row in self.responses if (of := group_of(row["task"])))
        for key, rows in grouped(responses, *TIMER_KEYS[:-2], "group").items():
            repetitions[key] = [merged(of) for _, of in sorted(grouped(rows, "repetition").items())]
        return {key: Samples(of, exact=key[1] == "simulated") for key, of in repetitions.items()}

    def latencies(self, study: str, source: str, executor: str) -> Samples:
        """Hot-path latencies in ms at the paper's load."""
        return self.samples.get((study, source, PAPER_LOAD_PERCENT, executor, ""), Samples([]))

    def hot_paths(self, source: str, *executors: str) -> list[Samples]:
        """Latencies (ms) of the executors. Raises Missing if any has none."""
        found = [self.latencies("autoware", source, executor) for executor in executors]
        need(*found)
        return found

    def real_hot_paths_ms(self, quantile: str, *executors: str) -> list[float]:
        """Quantiles (p50, p90, p99 or max) of the real ROS 2 stack. Raises Missing if an executor has none."""
        rows = real_stack()[1]
        if not rows.keys() >= set(executors):
            raise Missing
        return [rows[executor][f"hot_path_{quantile}_ms"] for executor in executors]

    @functools.cached_property
    def by_study(self) -> dict[str, Rows]:
        """Timers by study, with their groups; the study `timers` includes the real stack as a source."""
        rows = (row | {"group": group_of(row["task"])} for row in (*self.timers, *real_stack()[0]))
        none: dict[str, Rows] = {"timers": [], WITH_COST: []}
        return none | grouped(rows, "study")

    def counts(
        self, percent: int, source: str, executor: str, group: str | None = None, study: str = "timers"
    ) -> Rows:
        """Timers of a group on the set of this utilisation: a row per repetition and task; empty if the executor did
        not run."""
        key, wanted = itemgetter("utilisation_percent", "source", "executor"), (percent, source, executor)
        rows = (row for row in self.by_study[study] if key(row) == wanted)
        return [row for row in rows if group in (None, row["group"])]

    def response_times(self, percent: int, source: str, executor: str, group: str) -> Samples:
        """Response times in ms of a group of timers on the set of this utilisation."""
        return self.samples.get(("timers", source, percent, executor, group), Samples([]))

    @property
    def executors(self) -> list[str]:
        """Executors that ran on the timers-only sets, with those of the real stack."""
        return list(grouped(self.by_study["timers"], "executor"))

    @property
    def live_cells(self) -> list[dict[str, Any]]:
        """Facts of the live cells."""
        return [c for c in self.cells if c["source"] == "live"]

    def marked_cells(self) -> list[dict[str, Any]]:
        """Facts of live cells marked as disturbed."""
        return [c for c in self.live_cells if c["noise"]["marks"]]

    def table(self, name: str) -> Rows:
        """A table of the analysis. Raises Missing if it does not exist."""
        rows = self.tables.get(name, [])
        need(rows)
        return rows

    def names_of_cells(self, studies: Iterable[str], source: str, executor: str, setting: Any = None) -> str:
        """Names of the cells behind a number; several repetitions as `NAME.{1,2,3}`."""
        names: dict[str, list[int]] = {}
        for c in self.cells:
            of_executor = not executor or executor in map(base_name, c["executors"])
            of_setting = setting in (None, c["load_percent"])
            if c["study"] in studies and c["source"] == source and of_executor and of_setting:
                name = c["name"].rpartition(".")[0] if source == "live" else c["name"]
                names.setdefault(name, []).append(c["repetition"] + 1)
        if source != "live":
            return " ".join(sorted(names))
        numbers = {name: ",".join(map(str, sorted(of))) for name, of in names.items()}
        return " ".join(sorted(f"{n}.{{{of}}}" if "," in of else f"{n}.{of}" for n, of in numbers.items()))

    def store(self, folder: Path) -> None:
        """Writes all data behind figures, tables and claims."""
        make_folder(folder)
        write_samples(self.hot_path, HOT_PATH_KEYS, "hot_path_ms", folder / HOT_PATH_FILE)
        write_samples(self.responses, TIMER_KEYS, "response_ms", folder / RESPONSES_FILE)
        for name, rows in {TIMERS_FILE: self.timers, **self.tables}.items():
            write_file(folder / name, csv_text(rows, TIMER_COLUMNS if name == TIMERS_FILE else ()))
        write_json(folder / CELLS_FILE, self.cells)


def collect(output: Path, cells: Iterable[Cell], mode: str = "") -> Evidence:
    """Evidence from complete cells."""
    made = Evidence(mode=mode)
    for name in (cell["name"] for cell in cells):
        folder = output / "cells" / name
        facts = read_json(folder / "cell.json")
        made.cells.append(facts)
        if facts["source"] == "analysis":
            made.tables |= {f.name: read_rows(f) for f in folder.iterdir() if f.name in COPIED_TABLES}
            continue
        run, on_timers = Run(folder), facts["study"].startswith("timers")
        keys: dict[str, Any] = {key: facts[key] for key in ("study", "source")}
        keys["utilisation_percent" if on_timers else "load_percent"] = facts["load_percent"]
        if facts["source"] == "live":
            keys["repetition"] = facts["repetition"]
            made.machine = {**run["machine"], "date": run["date"], "transport": run["transport"]}
            facts["policies"] = sorted({p for r in run["runs"] for p in r.get("thread_policies", [])})
        facts["date"] = run.facts.get("date", "")
        if on_timers:
            made.timers += [{"repetition": 0} | row | keys for row in run.timer_counts()]
            made.responses += [row | keys | {"task": row["name"]} for row in run.samples("responses")]
        else:
            outputs = run.samples("chains")
            made.hot_path += [row | keys | {"executor": base_name(row["executor"])} for row in outputs]
    return made


def write_samples(found: Rows, keys: Sequence[str], value: str, path: Path) -> None:
    """Writes samples reproducibly. Repeated values of a deterministic simulation become one row with a count."""
    rows: Rows = []
    for row in found:
        texts = [f"{ms:.6f}".rstrip("0").rstrip(".") for ms in row[value]]
        counted = Counter(texts).items() if row["source"] == "simulated" else ((text, 1) for text in texts)
        rows += [row | {value: text, "count": count} for text, count in counted]
    write_file(path, gzip.compress(csv_text(rows, (*keys, value, "count")).encode(), 6, mtime=0))


def read_samples(path: Path, keys: Sequence[str], value: str) -> Rows:
    """A file of samples."""
    found = grouped(read_rows(path), *keys).values()
    return [rows[0] | {value: [row[value] for row in rows for _ in range(row["count"])]} for rows in found]


def stored(publication: Path) -> Evidence:
    """Reads the evidence of a published reproduction. Raises InputError."""
    data, facts = publication / "data", read_json(publication / "facts.json", "reproduce_paper.sh")
    return Evidence(
        read_samples(data / HOT_PATH_FILE, HOT_PATH_KEYS, "hot_path_ms"),
        read_rows(data / TIMERS_FILE),
        read_samples(data / RESPONSES_FILE, TIMER_KEYS, "response_ms"),
        {name: read_rows(data / name) for name in COPIED_TABLES if (data / name).exists()},
        read_json(data / CELLS_FILE),
        facts["machine"],
        facts["mode"],
    )
