# SPDX-License-Identifier: Apache-2.0
"""What the cells measured, as frames.

Every quantity leaves out the warm-up in the same way, by the rule of `hotpath summarize`.
"""

import gzip
import re
import zlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from hotpath_report.errors import InputError
from hotpath_report.paper.cells import PAPER_LOAD_PERCENT, Cell
from hotpath_report.paper.reference import Reference
from hotpath_report.run import Run
from hotpath_report.samples import COUNTS, TimerRuns, samples_by
from hotpath_report.statistics import Samples
from hotpath_report.tables import read_json

COPIED_TABLES = ("waters_summary.csv", "waters_histogram.csv", "wcrt_table.csv", "release_cost.csv")
HOT_PATH_KEYS = ["study", "source", "load_percent", "executor", "repetition"]
RESPONSE_KEYS = ["study", "source", "setting", "executor", "task", "repetition"]
TIMER_COLUMNS = [*RESPONSE_KEYS, *COUNTS, "deadline_ms", "response_max_ms", "bound_ms"]


def read_table(path: Path) -> pd.DataFrame:
    """A CSV file, compressed where its name says so. Raises InputError."""
    try:
        return pd.read_csv(path)
    except (EOFError, zlib.error, gzip.BadGzipFile, ValueError):
        raise InputError(f"{path}: ends too early, or is damaged; make it again") from None
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from None


def base_name(executor: str) -> str:
    """`multi:2` is `multi`: the number of threads is that of the cores, which every figure states."""
    return re.sub(r":\d+$", "", executor)


@dataclass
class Evidence:
    """Frames with the columns HOT_PATH_KEYS and hot_path_ms, TIMER_COLUMNS, and RESPONSE_KEYS and response_ms."""

    hot_path: pd.DataFrame
    timers: pd.DataFrame
    responses: pd.DataFrame
    tables: dict[str, pd.DataFrame] = field(default_factory=dict)
    cells: list[dict[str, Any]] = field(default_factory=list)  # facts of every cell
    machine: dict[str, Any] | None = None  # of the live cells
    mode: str = ""
    reference: Reference = field(default_factory=Reference)  # the real ROS 2 stack
    _latencies: dict[Any, Samples] | None = None
    _studies: dict[str, TimerRuns] = field(default_factory=dict)

    def all_latencies(self) -> dict[tuple[str, str, int, str], Samples]:
        """{(study, source, load in percent, executor): hot-path latencies in ms}"""
        if self._latencies is None:
            keys = HOT_PATH_KEYS[:-1]
            self._latencies = {
                key: samples
                for source, frame in self.hot_path.groupby("source")
                for key, samples in samples_by(frame, keys, "hot_path_ms", source == "simulated").items()
            }
        return self._latencies

    def latencies(
        self, study: str, source: str, executor: str, load: int = PAPER_LOAD_PERCENT
    ) -> Samples | None:
        """Hot-path latencies in ms; None where there are none."""
        return self.all_latencies().get((study, source, load, executor))

    def draws(self, source: str, executor: str) -> list[tuple[float, float]]:
        """Median and worst latency (ms) of each draw of random phases."""
        samples = self.latencies("phases", source, executor)
        one_by_one = [Samples([r], exact=True) for r in samples.repetitions] if samples else []
        return [(s.quantile(0.5), s.worst) for s in one_by_one]

    def timer_runs(self, study: str = "timers") -> TimerRuns:
        """The timers-only runs of a study; beside those of the paper the real stack's, as another source."""
        if study not in self._studies:
            frames = (frame[frame["study"] == study] for frame in (self.timers, self.responses))
            counts, responses = frames
            if study == "timers":
                counts = pd.concat([counts, self.reference.timers], ignore_index=True)
            self._studies[study] = TimerRuns(counts, responses)
        return self._studies[study]

    def live_cells(self) -> list[dict[str, Any]]:
        """Facts of the live cells."""
        return [c for c in self.cells if c["source"] == "live"]

    def marked(self, study: str, percent: int, executor: str) -> set[int]:
        """Live repetitions of a timers-only cell that are marked as noisy."""
        key = (study, percent, [executor])
        return {
            c["repetition"]
            for c in self.live_cells()
            if c["noise"]["marks"] and (c["study"], c["load_percent"], list(c["executors"])) == key
        }

    def table(self, name: str) -> pd.DataFrame:
        """A table of the analysis; empty where it was not made."""
        return self.tables.get(name, pd.DataFrame())

    def names_of_cells(
        self, studies: Iterable[str], source: str, executor: str = "", setting: Any = None
    ) -> str:
        """From which cells a number comes: their names, with several repetitions as `NAME.{1,2,3}`."""
        repetitions: dict[str, list[str]] = {}
        for c in self.cells:
            here = c["study"] in studies and c["source"] == source
            if executor and executor not in map(base_name, c["executors"]):
                here = False
            if here and (setting is None or c["load_percent"] == setting):
                name, _, number = c["name"].rpartition(".") if source == "live" else (c["name"], "", "")
                repetitions.setdefault(name, []).append(number)
        texts = []
        for name, numbers in repetitions.items():
            several = f"{{{','.join(sorted(numbers, key=int))}}}" if len(numbers) > 1 else numbers[0]
            texts.append(f"{name}.{several}" if several else name)
        return " ".join(sorted(texts))


def empty() -> Evidence:
    """Evidence of nothing."""
    columns = ([*HOT_PATH_KEYS, "hot_path_ms"], TIMER_COLUMNS, [*RESPONSE_KEYS, "response_ms"])
    return Evidence(*(pd.DataFrame(columns=names) for names in columns))


def joined(frames: list[pd.DataFrame], columns: Iterable[str]) -> pd.DataFrame:
    """All rows below each other."""
    return (
        pd.concat(frames, ignore_index=True)[list(columns)] if frames else pd.DataFrame(columns=list(columns))
    )


def timers_of(run: Run, keys: dict[str, Any], cell: Cell) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Counts and responses of a timers-only cell."""
    keys = {**keys, "setting": cell.load_percent}
    responses = run.responses().assign(**keys)  # makes the summary anew
    worst = (
        responses.groupby(["executor", "task"])["response_ms"].max().rename("response_max_ms").reset_index()
    )
    counts = run.timer_counts().merge(worst, how="left", on=["executor", "task"])
    return counts.assign(repetition=cell.repetition, **keys), responses


def collect(output: Path, cells: Iterable[Cell]) -> Evidence:
    """Evidence of those cells that are complete."""
    made = empty()
    hot_path, timers, responses = [], [], []
    for cell in cells:
        folder = output / "cells" / cell.name
        facts = read_json(folder / "cell.json")
        made.cells.append(facts)
        if cell.source == "analysis":
            made.tables |= {
                name: read_table(folder / name) for name in COPIED_TABLES if (folder / name).exists()
            }
            continue
        run = Run(folder)
        keys: dict[str, Any] = {"study": cell.study, "source": cell.source}
        if cell.source == "live":
            keys["repetition"] = cell.repetition
            made.machine = {**run["machine"], "date": run["date"], "transport": run["transport"]}
            facts["policies"] = sorted({p for r in run["runs"] for p in r.get("thread_policies", [])})
        facts["date"] = run.get("date", "")
        if cell.study.startswith("timers"):
            counts, jobs = timers_of(run, keys, cell)
            timers.append(counts)
            responses.append(jobs)
        else:
            frame = run.latencies().assign(load_percent=cell.load_percent, **keys)
            hot_path.append(frame.assign(executor=frame["executor"].map(base_name)))
    made.hot_path = joined(hot_path, made.hot_path.columns)
    made.timers = joined(timers, made.timers.columns)
    made.responses = joined(responses, made.responses.columns)
    return made
