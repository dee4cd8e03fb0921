# SPDX-License-Identifier: Apache-2.0
"""Measurements of the cells as frames; the warm-up is left out as in summaries."""

import functools
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from hotpath_report.errors import Missing
from hotpath_report.paper.cells import PAPER_LOAD_PERCENT, Cell
from hotpath_report.paper.reference import Reference
from hotpath_report.run import COUNTS, Run
from hotpath_report.samples import TimerRuns, samples_by
from hotpath_report.statistics import Samples
from hotpath_report.tables import read_json, read_table

COPIED_TABLES = ("waters_summary.csv", "waters_histogram.csv", "wcrt_table.csv", "release_cost.csv")
HOT_PATH_KEYS = ["study", "source", "load_percent", "executor", "repetition"]
RESPONSE_KEYS = ["study", "source", "setting", "executor", "task", "repetition"]
COLUMNS = {
    "hot_path": [*HOT_PATH_KEYS, "hot_path_ms"],
    "timers": [*RESPONSE_KEYS, *COUNTS, "deadline_ms", "response_max_ms", "bound_ms"],
    "responses": [*RESPONSE_KEYS, "response_ms"],
}


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

    def names_of_cells(
        self, studies: Iterable[str], source: str, executor: str = "", setting: Any = None
    ) -> str:
        """Names of the cells behind a number; several repetitions as `NAME.{1,2,3}`."""
        names: dict[str, list[int]] = {}
        for c in self.cells:
            of_executor = not executor or executor in map(base_name, c["executors"])
            of_setting = setting in (None, c["load_percent"])
            if c["study"] in studies and c["source"] == source and of_executor and of_setting:
                name = c["name"].rpartition(".")[0] if source == "live" else c["name"]
                names.setdefault(name, []).append(c["repetition"] + 1)
        texts = []
        for name, numbers in names.items():
            text = ",".join(map(str, sorted(numbers)))
            ending = f".{{{text}}}" if len(numbers) > 1 else f".{text}"
            texts.append(name + (ending if source == "live" else ""))
        return " ".join(sorted(texts))


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
            keys["setting"] = cell.load_percent
            frames["responses"].append(run.responses().assign(**keys))
            frames["timers"].append(run.timer_counts().assign(**keys | {"repetition": cell.repetition}))
        else:
            frame = run.latencies().assign(load_percent=cell.load_percent, **keys)
            frames["hot_path"].append(frame.assign(executor=frame["executor"].map(base_name)))
    for name, found in frames.items():
        if found:
            setattr(made, name, pd.concat(found, ignore_index=True)[COLUMNS[name]])
    return made
