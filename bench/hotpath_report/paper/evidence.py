# SPDX-License-Identifier: Apache-2.0
"""Measurements of the cells as frames, and data/ of a reproduction, which stores them; measurements of the real ROS 2
stack on the same workloads (reference_system/ros2_reference). The warm-up is left out as in summaries."""

import functools
import gzip
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from hotpath_report.errors import Missing
from hotpath_report.figures.timers import TimerRuns
from hotpath_report.hotpath_command import PACKAGE, ask
from hotpath_report.paper.cells import PAPER_LOAD_PERCENT, Cell
from hotpath_report.run import COUNTS, Run, samples_by
from hotpath_report.statistics import Samples
from hotpath_report.tables import make_folder, read_json, read_table, write_file, write_json

REAL = "real"  # the source of its rows
PACKAGES = ("reference_system", "hotpath_reference_system")  # in the source tree and installed
COUNTED_IN_TRACES = "events-re"  # the longer runs lack it
AUTOWARE_CRUNCH_LIMIT = 6000  # 80 % of one core on the reference machine

COPIED_TABLES = ("waters_summary.csv", "waters_histogram.csv", "wcrt_table.csv", "release_cost.csv")
HOT_PATH_KEYS = ["study", "source", "load_percent", "executor", "repetition"]
RESPONSE_KEYS = ["study", "source", "utilisation_percent", "executor", "task", "repetition"]
COLUMNS = {
    "hot_path": [*HOT_PATH_KEYS, "hot_path_ms"],
    "timers": [*RESPONSE_KEYS, *COUNTS, "deadline_ms", "response_max_ms", "bound_ms"],
    "responses": [*RESPONSE_KEYS, "response_ms"],
}
HOT_PATH_FILE, RESPONSES_FILE, TIMERS_FILE = "hot_path.csv.gz", "responses.csv.gz", "timers.csv"
CELLS_FILE = "cells.json"


def traced_timers(path: Path) -> pd.DataFrame:
    """The timers of a golden trace timers_only_PERCENT.EXECUTOR.csv."""
    graph, executor = path.stem.split(".")
    timers = pd.DataFrame(ask("golden", str(path))["tasks"])
    worst = [response["max"] for response in timers["response_ms"]]
    return timers.assign(
        utilisation_percent=int(graph.split("_")[-1]), executor=executor, response_max_ms=worst
    )


class Reference:
    """Timers (as TimerRuns.counts) and hot path (ms) by executor; empty if not measured."""

    def __init__(self) -> None:
        self.timers, self.hot_path = pd.DataFrame(), pd.DataFrame()
        folders = (PACKAGE.parents[1] / package / "ros2_reference" for package in PACKAGES)
        folder = next((folder for folder in folders if folder.is_dir()), None)
        if folder is None:
            return
        names = {"released": "reached", "dropped": "skipped"}
        timers = pd.read_csv(folder / "rclcpp_timers_only.csv").rename(columns=names)
        traced = pd.concat(map(traced_timers, sorted((folder / "traces").glob("timers_only_*.csv"))))
        counted = pd.concat([timers, traced[traced["executor"] == COUNTED_IN_TRACES]], ignore_index=True)
        # The authors' programs measure another response time, see the reference's README.
        counted = counted.drop(columns="response_max_ms")
        keys = ["utilisation_percent", "executor", "task"]
        timers = counted.merge(traced[[*keys, "response_max_ms"]], on=keys, how="left")
        timers["ran"] = timers["reached"] - timers["skipped"]
        self.timers = timers.assign(study="timers", source=REAL, repetition=0)
        autoware = pd.read_csv(folder / "rclcpp_autoware.csv")
        autoware = autoware[autoware["crunch_limit"] == AUTOWARE_CRUNCH_LIMIT]
        self.hot_path = autoware.set_index("executor")

    def hot_path_ms(self, quantile: str) -> dict[str, float]:
        """By executor; `quantile` is p50, p90, p99 or max."""
        values = self.hot_path.get(f"hot_path_{quantile}_ms", pd.Series(dtype=float))
        return {str(executor): float(value) for executor, value in values.items()}


def base_name(executor: str) -> str:
    """Executor without its number of threads (`multi` for `multi:2`)."""
    return re.sub(r":\d+$", "", executor)


@dataclass(eq=False)
class Evidence:
    """Frames with COLUMNS, and facts about cells and machine; samples without data are empty."""

    hot_path: pd.DataFrame
    timers: pd.DataFrame
    responses: pd.DataFrame
    tables: dict[str, pd.DataFrame] = field(default_factory=dict)
    cells: list[dict[str, Any]] = field(default_factory=list)  # facts of every cell
    machine: dict[str, Any] | None = None  # of the live cells
    mode: str = ""
    reference: Reference = field(default_factory=Reference)  # the real ROS 2 stack

    @functools.cached_property
    def all_latencies(self) -> dict[tuple[str, str, int, str], Samples]:
        """{(study, source, load in percent, executor): hot-path latencies in ms}"""
        return samples_by(self.hot_path, HOT_PATH_KEYS[:-1], "hot_path_ms")

    def latencies(self, study: str, source: str, executor: str) -> Samples:
        """Hot-path latencies in ms at the paper's load."""
        return self.all_latencies.get((study, source, PAPER_LOAD_PERCENT, executor), Samples([]))

    def draws(self, source: str, executor: str) -> list[tuple[float, float]]:
        """Median and worst latency (ms) of each draw of random phases."""
        repetitions = self.latencies("phases", source, executor).repetitions
        return [(s.quantile(0.5), s.worst) for s in (Samples([r], exact=True) for r in repetitions)]

    @functools.cache
    def timer_runs(self, study: str = "timers") -> TimerRuns:
        """The timers-only runs of a study; `timers` includes the real stack as a source."""
        counts, responses = (frame[frame["study"] == study] for frame in (self.timers, self.responses))
        if study == "timers":
            counts = pd.concat([counts, self.reference.timers], ignore_index=True)
        return TimerRuns(counts, responses)

    @property
    def live_cells(self) -> list[dict[str, Any]]:
        """Facts of the live cells."""
        return [c for c in self.cells if c["source"] == "live"]

    def marked_cells(self) -> list[dict[str, Any]]:
        """Facts of live cells marked as disturbed."""
        return [c for c in self.live_cells if c["noise"]["marks"]]

    @functools.cached_property
    def marked(self) -> set[tuple[int, str, int]]:
        """Noisy live timers-only cells: utilisation in percent, executor, repetition."""
        cells = (c for c in self.marked_cells() if c["study"] == "timers")
        return {(c["load_percent"], c["executors"][0], c["repetition"]) for c in cells}

    def table(self, name: str) -> pd.DataFrame:
        """A table of the analysis. Raises Missing if it does not exist."""
        if name not in self.tables:
            raise Missing
        return self.tables[name]

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
        for name, file in (("hot_path", HOT_PATH_FILE), ("responses", RESPONSES_FILE)):
            write_samples(getattr(self, name)[COLUMNS[name]], folder / file)
        write_file(folder / TIMERS_FILE, self.timers.to_csv(index=False))
        for name, table in self.tables.items():
            write_file(folder / name, table.to_csv(index=False))
        write_json(folder / CELLS_FILE, self.cells)


def collect(output: Path, cells: Iterable[Cell]) -> Evidence:
    """Evidence from complete cells."""
    frames: dict[str, list[pd.DataFrame]] = {name: [] for name in COLUMNS}
    made = Evidence(*(pd.DataFrame(columns=columns) for columns in COLUMNS.values()))
    for cell in cells:
        folder = output / "cells" / cell.name
        facts = read_json(folder / "cell.json")
        made.cells.append(facts)
        if cell.source == "analysis":
            made.tables |= {f.name: read_table(f) for f in folder.iterdir() if f.name in COPIED_TABLES}
            continue
        run = Run(folder)
        keys: dict[str, Any] = {"study": cell.study, "source": cell.source}
        if cell.source == "live":
            keys["repetition"] = cell.repetition
            made.machine = {**run["machine"], "date": run["date"], "transport": run["transport"]}
            facts["policies"] = sorted({p for r in run["runs"] for p in r.get("thread_policies", [])})
        facts["date"] = run.facts.get("date", "")
        if cell.study.startswith("timers"):
            keys["utilisation_percent"] = cell.load_percent
            timers = run.timer_counts()[["executor", "task"]]
            responses = run.responses().merge(timers)  # keeps the left frame's order
            frames["responses"].append(responses.assign(**keys))
            frames["timers"].append(run.timer_counts().assign(**keys | {"repetition": cell.repetition}))
        else:
            frame = run.latencies().assign(load_percent=cell.load_percent, **keys)
            frames["hot_path"].append(frame.assign(executor=frame["executor"].map(base_name)))
    for name, found in frames.items():
        if found:
            setattr(made, name, pd.concat(found, ignore_index=True)[COLUMNS[name]])
    return made


def write_samples(frame: pd.DataFrame, path: Path) -> None:
    """Writes samples reproducibly; the last column is the value. Repeated values of a deterministic
    simulation become one row with a count."""
    value = frame.columns[-1]
    texts = frame[value].map(lambda v: f"{v:.6f}".rstrip("0").rstrip("."))
    frame = frame.assign(**{value: texts}, count=1)
    simulated = frame["source"] == "simulated"
    counted = frame[simulated].groupby(list(frame.columns[:-1]), sort=False, as_index=False)["count"].sum()
    both = pd.concat([counted, frame[~simulated]])
    write_file(path, gzip.compress(both.to_csv(index=False).encode(), 6, mtime=0))


def read_samples(path: Path) -> pd.DataFrame:
    """A file of samples, with a row per sample."""
    frame = read_table(path, ["count"])
    return frame.loc[frame.index.repeat(frame["count"])].drop(columns="count").reset_index(drop=True)


def stored(publication: Path) -> Evidence:
    """Reads the evidence of a published reproduction. Raises InputError."""
    data, facts = publication / "data", read_json(publication / "facts.json", "reproduce_paper.sh")
    columns = COLUMNS["timers"]
    return Evidence(
        read_samples(data / HOT_PATH_FILE),
        read_table(data / TIMERS_FILE, columns[:-2], optional=columns[-2:]),
        read_samples(data / RESPONSES_FILE),
        {name: read_table(data / name) for name in COPIED_TABLES if (data / name).exists()},
        read_json(data / CELLS_FILE),
        facts["machine"],
        facts["mode"],
    )
