# SPDX-License-Identifier: Apache-2.0
"""Stores evidence as data/ of a reproduction."""

import gzip
from pathlib import Path

import pandas as pd

from hotpath_report.paper.evidence import COLUMNS, COPIED_TABLES, Evidence
from hotpath_report.tables import make_folder, read_json, read_table, write_file, write_json

HOT_PATH_FILE, RESPONSES_FILE, TIMERS_FILE = "hot_path.csv.gz", "responses.csv.gz", "timers.csv"
CELLS_FILE = "cells.json"
# Files call the setting of a timers-only set its utilisation.
IN_FILES = {"setting": "utilisation_percent"}
IN_FRAMES = {"utilisation_percent": "setting"}


def read_samples(path: Path) -> pd.DataFrame:
    """A file of samples, with a row per sample."""
    frame = read_table(path, ["count"]).rename(columns=IN_FRAMES)
    return frame.loc[frame.index.repeat(frame["count"])].drop(columns="count").reset_index(drop=True)


def write_samples(frame: pd.DataFrame, path: Path) -> None:
    """Writes samples reproducibly; the last column is the value. Repeated values of a deterministic
    simulation become one row with a count."""
    value = frame.columns[-1]
    texts = frame[value].map(lambda v: f"{v:.6f}".rstrip("0").rstrip("."))
    frame = frame.assign(**{value: texts}, count=1)
    simulated = frame["source"] == "simulated"
    counted = frame[simulated].groupby(list(frame.columns[:-1]), sort=False, as_index=False)["count"].sum()
    both = pd.concat([counted, frame[~simulated]]).rename(columns=IN_FILES)
    write_file(path, gzip.compress(both.to_csv(index=False).encode(), 6, mtime=0))


def write(evidence: Evidence, folder: Path) -> None:
    """Writes all data behind figures, tables and claims."""
    make_folder(folder)
    write_samples(evidence.hot_path[COLUMNS["hot_path"]], folder / HOT_PATH_FILE)
    write_samples(evidence.responses[COLUMNS["responses"]], folder / RESPONSES_FILE)
    write_file(folder / TIMERS_FILE, evidence.timers.rename(columns=IN_FILES).to_csv(index=False))
    for name, table in evidence.tables.items():
        write_file(folder / name, table.to_csv(index=False))
    write_json(folder / CELLS_FILE, evidence.cells)


def stored(publication: Path) -> Evidence:
    """Reads the evidence of a published reproduction. Raises InputError."""
    data, facts = publication / "data", read_json(publication / "facts.json", "reproduce_paper.sh")
    columns = [IN_FILES.get(name, name) for name in COLUMNS["timers"]]
    return Evidence(
        read_samples(data / HOT_PATH_FILE),
        read_table(data / TIMERS_FILE, columns[:-2], optional=columns[-2:]).rename(columns=IN_FRAMES),
        read_samples(data / RESPONSES_FILE),
        {name: read_table(data / name) for name in COPIED_TABLES if (data / name).exists()},
        read_json(data / CELLS_FILE),
        facts["machine"],
        facts["mode"],
    )
