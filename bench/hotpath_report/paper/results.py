# SPDX-License-Identifier: Apache-2.0
"""Writes the results of a reproduction: data/, figures/, claims.json, report.html, report.md."""

from collections import Counter
from collections.abc import Collection
from contextlib import suppress
from itertools import product
from operator import itemgetter
from pathlib import Path
from typing import Any

from hotpath_report import statistics
from hotpath_report.errors import Missing
from hotpath_report.figures.violins import Drawing, percentile_table
from hotpath_report.files import Rows, csv_text, make_folder, write_file, write_json
from hotpath_report.pages import interactive
from hotpath_report.pages.interactive import Measured
from hotpath_report.pages.text import environment
from hotpath_report.pages.writer import Section, Table, make_figure, write_page
from hotpath_report.paper import evidence as evidence_of
from hotpath_report.paper import items as parts_of
from hotpath_report.paper.cells import CAUSES, ITEMS, MODES, SPEC, UTILISATIONS, duration_text
from hotpath_report.paper.checks import judge
from hotpath_report.paper.claims import LIMITS, Verdict
from hotpath_report.paper.evidence import GROUPS, Evidence
from hotpath_report.run import SOURCES
from hotpath_report.statistics import grouped

# Figures at the top of the page.
PICTURES = ("hot_path", "dropped_jobs", "response_imu")


def prose(part: str, *arguments: Any) -> str:
    """A part of the page's prose as plain text."""
    text: str = getattr(environment("txt").get_template("prose.j2").module, part)(*arguments)
    return text.strip()


def live_runs(evidence: Evidence) -> list[dict[str, Any]]:
    """Live measurements by study: least and most repetitions per setting, lengths in s."""
    found = []
    for study, name in SPEC["study_names"].items():
        if cells := [c for c in evidence.live_cells if c["study"] == study]:
            counts = Counter(c["name"].rpartition(".")[0] for c in cells).values()
            lengths = sorted({c["duration_s"] for c in cells})
            found.append({"name": name, "times": sorted({min(counts), max(counts)}), "lengths": lengths})
    return found


def noise_table(evidence: Evidence) -> Table:
    """Disturbances of the live repetitions."""
    rows = []
    for c in sorted(evidence.live_cells, key=lambda c: str(c["name"])):
        percent = (c["noise"].get(f"{cause}_percent") for cause in CAUSES)
        shares = ["" if share is None else f"{share:.2f}" for share in percent]
        rows.append([c["name"].removeprefix("live."), *shares, "; ".join(c["noise"]["marks"])])
    header = ["repetition", "stolen %", "throttled %", "used by others %", "marks"]
    return Table("All live repetitions", header, rows, folded=True)


def sections(evidence: Evidence, items: Collection[str]) -> list[Section]:
    """A section per item."""
    made = []
    for item in (item for name, item in ITEMS.items() if name in items):
        section = Section(item.name, item.title, item.paper or "Beyond the paper", item.text)
        with suppress(Missing):
            for part in getattr(parts_of, item.name.replace("-", "_"))(evidence):
                if isinstance(part, Drawing):
                    section.figures.append(make_figure(item.figure, item.caption, part))
                elif part.rows:
                    section.tables.append(part)
        made.append(section)
    return made


def document(evidence: Evidence) -> dict[str, Any]:
    """What the interactive part shows: the hot path, and the response times of each group of timers in each task set,
    by source."""
    executors = list(grouped(evidence.hot_path, "executor"))
    latencies = [{e: evidence.latencies("autoware", source, e) for e in executors} for source in SOURCES]
    what = {"kind": "chain", "name": "hot path", "title": "Hot path", "measure": "hot-path latency (ms)"}
    found: list[Measured] = [(what | {"figure": "hot_path"}, latencies)]
    for (group, label), percent in product(GROUPS.items(), UTILISATIONS):
        name = f"{label}, {percent} % set"
        of = [{e: evidence.response_times(percent, s, e, group) for e in evidence.executors} for s in SOURCES]
        what = {"kind": "task", "name": name, "title": f"Timers: {name}", "measure": "response time (ms)"}
        found.append((what | {"figure": ""}, of))
    known = {s: [e for _, of in found for e, some in of[k].items() if some] for k, s in enumerate(SOURCES)}
    data = interactive.of_samples({source: list(dict.fromkeys(of)) for source, of in known.items()})
    targets = (interactive.target(what, sources, data["series"]) for what, sources in found)
    return data | {"targets": [target for target in targets if target["curves"]]}


def percentiles(evidence: Evidence) -> Rows:
    """A row per percentile of each distribution, with the cells behind it."""
    names, groups = ("quantity", "study", "source", "setting", "executor", "tasks"), ["", *GROUPS]
    rows = []
    for (study, source, setting, executor, group), samples in evidence.samples.items():
        place = (study, setting, source) if group else (study, source, setting)
        key = ("response" if group else "hot path", study, source, setting, executor, group)
        rows.append(((key[0], *place, executor, groups.index(group)), (dict(zip(names, key)), samples)))
    table = percentile_table(row for _, row in sorted(rows, key=itemgetter(0)))
    for row in table:
        of = [row["study"]], row["source"], row["executor"], row["setting"]
        row |= {"setting": f"{row['setting']} %", "cells": evidence.names_of_cells(*of)}
    return table


def write_page_of(evidence: Evidence, items: Collection[str], folder: Path, planned: int) -> list[Verdict]:
    """Writes page, figures, claims.json and percentiles into `folder`; returns the verdicts."""
    make_folder(folder / "data")
    write_file(folder / "data" / "percentiles.csv", csv_text(percentiles(evidence), fraction="%.6f"))
    judged = judge(evidence)
    verdicts = [v for v in judged if v.claim.item in items]
    (slowdowns,) = (v.findings for v in judged if v.claim.name == "slowdown")
    write_json(folder / "claims.json", [v.as_json() for v in verdicts])
    made = sections(evidence, items)
    figures = {figure.name: figure for section in made for figure in section.figures}
    write_page(
        folder,
        made,
        document(evidence),
        "reproduction",
        evidence=evidence,
        planned=planned,
        slowdowns=slowdowns,
        limits=LIMITS,
        pictures=[figures[name] for name in PICTURES if name in figures],
        verdicts=verdicts,
        found=Counter(v.verdict for v in verdicts),
        mode=MODES[evidence.mode],
        live_runs=live_runs(evidence),
        statistics=statistics,
        noise_table=noise_table(evidence),
    )
    return verdicts


def write_results(evidence: Evidence, items: Collection[str], folder: Path, planned: int) -> list[Verdict]:
    """Writes all results; `planned`: number of live repetitions in the plan."""
    evidence.store(folder / "data")
    seconds = sum(c["duration_s"] for c in evidence.live_cells)
    verdicts = write_page_of(evidence, items, folder, planned)
    facts = {
        "mode": evidence.mode,
        "machine": evidence.machine,
        "where": prose("where", evidence, planned),
        "cells": len(evidence.cells),
        "live_cells": len(evidence.live_cells),
        "live_planned": planned,
        "live_runs": prose("runs", live_runs(evidence)),
        "live_measured_s": seconds,
        "live_measured": duration_text(seconds),
        "marked_cells": len(evidence.marked_cells()),
    }
    write_json(folder / "facts.json", facts)
    return verdicts


def write_published(publication: Path, folder: Path) -> None:
    """Judges and draws a published reproduction again from its data/."""
    evidence = evidence_of.stored(publication)
    studies = {c["study"] for c in evidence.cells}
    items = [name for name, item in ITEMS.items() if set(item.studies) <= studies]
    write_page_of(evidence, items, folder, len(evidence.live_cells))
