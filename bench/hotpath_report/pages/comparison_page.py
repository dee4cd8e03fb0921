# SPDX-License-Identifier: Apache-2.0
"""The page of `hotpath diff`: both sides' distributions, and the table of differences or of
the gate."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hotpath_report.comparison.sides import KEYS, Key
from hotpath_report.pages import interactive, run_report
from hotpath_report.pages.interactive import Measured
from hotpath_report.pages.run_report import CHAIN, TIMER, ReportedRun
from hotpath_report.pages.writer import Section, Table, write_report
from hotpath_report.statistics import Samples

EXECUTOR = KEYS.index("executor")
TEXT = "The distributions above show the same samples; their bands are 95 % intervals."


def measured(old: Mapping[Key, Samples], new: Mapping[Key, Samples]) -> list[Measured]:
    """A distribution for each key without its executor that both sides have."""
    found: dict[Key, list[dict[str, Samples]]] = {}
    for number, side in enumerate((old, new)):
        for key in sorted(old.keys() & new.keys()):
            name = (*key[:EXECUTOR], *key[EXECUTOR + 1 :])
            found.setdefault(name, [{}, {}])[number][key[EXECUTOR]] = side[key]
    made = []
    for without, runs in found.items():
        kind, measure = ("chain", CHAIN[0]) if without[0] == "hot path" else ("task", TIMER[0])
        title = " ".join(filter(None, without))
        made.append(Measured(kind, title, title, measure, "", runs))
    return made


def document(
    folders: Sequence[Path], old: Mapping[Key, Samples], new: Mapping[Key, Samples]
) -> dict[str, Any]:
    """What the interactive part shows: of two run folders also their outputs and timelines."""
    if all((folder / "run.json").exists() for folder in folders):
        runs = [ReportedRun(folder) for folder in folders]
        return interactive.document([r.run for r in runs], list(map(str, folders)), run_report.measured(runs))
    return interactive.distributions(("old", "new"), measured(old, new))


def write(
    folder: Path,
    folders: Sequence[Path],
    sides: Sequence[Mapping[Key, Samples]],
    sentences: Sequence[str],
    table: Table,
) -> None:
    """Writes report.html and report.md. Raises InputError."""
    names = [f"{side}: {path}" for side, path in zip(("Old", "New"), folders)]
    write_report(
        folder,
        [Section("comparison", "Comparison", "of the measures that both sides have", TEXT, [], [table])],
        title=f"{folders[0].resolve().name} against {folders[1].resolve().name}",
        facts=[*names, *sentences],
        made_by="`hotpath diff`.",
        data=document(folders, *sides),
    )
    print(f"{folder / 'report.html'} (and report.md)")
