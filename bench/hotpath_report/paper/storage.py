# SPDX-License-Identifier: Apache-2.0
"""Evidence as files: data/ of a reproduction."""

import gzip
from pathlib import Path

import pandas as pd

from hotpath_report.errors import InputError
from hotpath_report.paper.evidence import (
    COPIED_TABLES,
    HOT_PATH_KEYS,
    RESPONSE_KEYS,
    TIMER_COLUMNS,
    Evidence,
    read_table,
)
from hotpath_report.tables import read_json, write_file, write_json

HOT_PATH_FILE, RESPONSES_FILE, TIMERS_FILE = "hot_path.csv.gz", "responses.csv.gz", "timers.csv"
CELLS_FILE = "cells.json"
SETTING = "utilisation_percent"  # a timers-only set in files; frames call it `setting`


def read_samples(path: Path) -> pd.DataFrame:
    """A file of samples, a row for each."""
    frame = read_table(path).rename(columns={SETTING: "setting"})
    if "count" not in frame:
        raise InputError(f"{path}: column `count` is missing")
    return frame.loc[frame.index.repeat(frame["count"])].drop(columns="count").reset_index(drop=True)


def write_samples(frame: pd.DataFrame, keys: list[str], value: str, path: Path) -> None:
    """The same samples give the same bytes. A value of a deterministic simulation, whose samples repeat, is written
    once with its count."""
    frame = frame[[*keys, value]]
    texts = frame[value].map(lambda v: f"{v:.6f}".rstrip("0").rstrip("."))
    frame = frame.assign(**{value: texts}, count=1)
    simulated = frame["source"] == "simulated"
    counted = frame[simulated].groupby([*keys, value], sort=False, as_index=False)["count"].sum()
    both = pd.concat([counted, frame[~simulated]]).rename(columns={"setting": SETTING})
    write_file(path, gzip.compress(both.to_csv(index=False).encode(), 6, mtime=0))


def write(evidence: Evidence, folder: Path) -> None:
    """Everything that figures, tables and claims need, as data/."""
    folder.mkdir(parents=True, exist_ok=True)
    write_samples(evidence.hot_path, HOT_PATH_KEYS, "hot_path_ms", folder / HOT_PATH_FILE)
    write_samples(evidence.responses, RESPONSE_KEYS, "response_ms", folder / RESPONSES_FILE)
    timers = evidence.timers.rename(columns={"setting": SETTING})
    write_file(folder / TIMERS_FILE, timers.to_csv(index=False))
    for name, table in evidence.tables.items():
        write_file(folder / name, table.to_csv(index=False))
    write_json(folder / CELLS_FILE, evidence.cells)


def stored(publication: Path) -> Evidence:
    """Evidence of a published reproduction, from its data/ and facts.json. Raises InputError."""
    data, facts = publication / "data", read_json(publication / "facts.json", "reproduce_paper.sh --publish")
    timers = read_table(data / TIMERS_FILE).rename(columns={SETTING: "setting"})
    missing = [c for c in TIMER_COLUMNS if c not in timers]
    if missing:
        raise InputError(
            f"{data / TIMERS_FILE}: column `{missing[0]}` is missing; an earlier version wrote it"
        )
    return Evidence(
        read_samples(data / HOT_PATH_FILE),
        timers,
        read_samples(data / RESPONSES_FILE),
        {name: read_table(data / name) for name in COPIED_TABLES if (data / name).exists()},
        read_json(data / CELLS_FILE),
        facts["machine"],
        facts["mode"],
    )
