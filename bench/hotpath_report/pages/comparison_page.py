# SPDX-License-Identifier: Apache-2.0
"""The page of `hotpath diff`: both sides' distributions, and the table of differences or of
the gate."""

from pathlib import Path
from typing import Any

from hotpath_report.pages import interactive, run_report
from hotpath_report.pages.run_report import CHAIN, TIMER, ReportedRun
from hotpath_report.pages.writer import Section, Table, write_report
from hotpath_report.tables import read_json

FILE = "comparison.json"
SIDES = ("old", "new")
TEXT = "The distributions above show the same samples; their bands are 95 % intervals."


def distributions(targets: list[dict[str, Any]]) -> dict[str, Any]:
    """What the interactive part shows of two sides that are known by their distributions alone."""
    curves = [curve for target in targets for curve in target["curves"]]
    found = [list(dict.fromkeys(c["executor"] for c in curves if c["side"] == side)) for side in range(2)]
    places = [(side, executor) for side in range(2) for executor in found[side]]
    for target in targets:
        measure = (CHAIN if target["kind"] == "chain" else TIMER)[0]
        target |= {"title": target["name"], "measure": measure, "figure": "", "marks": []}
        for curve in target["curves"]:
            curve["series"] = places.index((curve.pop("side"), curve.pop("executor")))
    return interactive.without_jobs(
        series=interactive.curves_of([(side, e, f"{e}, {SIDES[side]}") for side, e in places]),
        targets=targets,
        runs=[interactive.run_of_samples(name, name, of) for name, of in zip(SIDES, found)],
    )


def document(content: dict[str, Any]) -> dict[str, Any]:
    """What the interactive part shows: of two run folders also their outputs and timelines."""
    if content["targets"] is not None:
        return distributions(content["targets"])
    folders = content["folders"]
    runs = [ReportedRun(folder) for folder in folders]
    return interactive.document([r.run for r in runs], folders, run_report.measured(runs))


def write(folder: str) -> None:
    """Writes report.html and report.md from comparison.json. Raises InputError."""
    place = Path(folder)
    content: dict[str, Any] = read_json(place / FILE, "hotpath diff --page")
    of = content["table"]
    table = Table(of["title"], of["columns"], of["cells"], numbers=True)
    write_report(
        place,
        [Section("comparison", "Comparison", "of the measures that both sides have", TEXT, [], [table])],
        title=content["title"],
        facts=content["facts"],
        made_by="`hotpath diff`.",
        data=document(content),
    )
    print(f"{place / 'report.html'} (and report.md)")
