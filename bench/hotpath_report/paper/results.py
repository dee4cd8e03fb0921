# SPDX-License-Identifier: Apache-2.0
"""Writes the results of a reproduction: data/, figures/, claims.json, report.html, report.md."""

from collections import Counter
from collections.abc import Collection
from contextlib import suppress
from itertools import product
from pathlib import Path
from typing import Any

from hotpath_report import statistics
from hotpath_report.errors import Missing
from hotpath_report.figures.timers import GROUPS
from hotpath_report.figures.violins import Drawing, percentile_table
from hotpath_report.files import Rows, csv_text, make_folder, write_file, write_json
from hotpath_report.pages import interactive
from hotpath_report.pages.interactive import Measured
from hotpath_report.pages.text import environment
from hotpath_report.pages.writer import Section, Table, make_figure, write_page
from hotpath_report.paper import evidence as evidence_of
from hotpath_report.paper import items as parts_of
from hotpath_report.paper.cells import ITEMS, MODES, SPEC, UTILISATIONS
from hotpath_report.paper.cells import duration_text
from hotpath_report.paper.claims import LIMITS, Verdict, judge
from hotpath_report.paper.evidence import REAL, Evidence
from hotpath_report.paper.runner import CAUSES
from hotpath_report.run import SOURCES
from hotpath_report.statistics import Estimate, grouped

# Figures at the top of the page.
PICTURES = ("hot_path", "dropped_jobs", "response_imu")


def prose(part: str, *arguments: Any) -> str:
    """A part of the page's prose as plain text."""
    text: str = getattr(environment("txt").get_template("prose.j2").module, part)(*arguments)
    return text.strip()


def slowdowns(evidence: Evidence) -> dict[str, Estimate]:
    """By source: worst hot-path latency of the default executor divided by that of rm-ro."""
    found, pair = {}, ("default", "rm-ro")
    for source in SOURCES:
        with suppress(Missing):
            default, ours = evidence.hot_paths(source, *pair)
            found[source] = statistics.ratio(default, ours, 1.0)
    with suppress(Missing):
        worst = evidence.real_hot_paths_ms("max", *pair)
        found[REAL] = Estimate(worst[0] / worst[1])
    return found


def live_runs(evidence: Evidence) -> list[dict[str, Any]]:
    """Live measurements by study: least and most repetitions per setting, lengths in s."""
    found = []
    for study, name in SPEC["study_names"].items():
        mine = [c for c in evidence.live_cells if c["study"] == study]
        counts = Counter(c["name"].rpartition(".")[0] for c in mine).values()
        if mine:
            lengths = sorted({c["duration_s"] for c in mine})
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
    for item in (item for item in ITEMS if item.name in items):
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
    runs, executors = evidence.timer_runs(), list(grouped(evidence.hot_path, "executor"))
    latencies = [{e: evidence.latencies("autoware", source, e) for e in executors} for source in SOURCES]
    what = {"kind": "chain", "name": "hot path", "title": "Hot path", "measure": "hot-path latency (ms)"}
    found: list[Measured] = [(what | {"figure": "hot_path"}, latencies)]
    for (group, label), percent in product(GROUPS.items(), UTILISATIONS):
        name = f"{label}, {percent} % set"
        of = [{e: runs.samples(percent, s, e, group) for e in runs.executors} for s in SOURCES]
        what = {"kind": "task", "name": name, "title": f"Timers: {name}", "measure": "response time (ms)"}
        found.append((what | {"figure": ""}, of))
    known = {s: [e for _, of in found for e, some in of[k].items() if some] for k, s in enumerate(SOURCES)}
    data = interactive.of_samples({source: list(dict.fromkeys(of)) for source, of in known.items()})
    targets = (interactive.target(what, sources, data["series"]) for what, sources in found)
    return data | {"targets": [target for target in targets if target["curves"]]}


def percentiles(evidence: Evidence) -> Rows:
    """A row per percentile of each distribution, with the cells behind it."""
    found = {("hot path", *key, ""): samples for key, samples in sorted(evidence.all_latencies.items())}
    for study in sorted(grouped(evidence.timers, "study")):
        runs = evidence.timer_runs(study)
        keys = sorted(grouped(runs.counts, *runs.KEY), key=str)
        for (setting, source, executor), group in product(keys, GROUPS):
            samples = runs.samples(setting, source, executor, group)
            found["response", study, source, setting, executor, group] = samples
    names = ("quantity", "study", "source", "setting", "executor", "tasks")
    table = percentile_table((dict(zip(names, key)), samples) for key, samples in found.items())
    for row in table:
        key = (row["study"],), row["source"], row["executor"], row["setting"]
        row |= {"setting": f"{row['setting']} %", "cells": evidence.names_of_cells(*key)}
    return table


def write_page_of(evidence: Evidence, items: Collection[str], folder: Path, planned: int) -> list[Verdict]:
    """Writes page, figures, claims.json and percentiles into `folder`; returns the verdicts."""
    make_folder(folder / "data")
    write_file(folder / "data" / "percentiles.csv", csv_text(percentiles(evidence), fraction="%.6f"))
    verdicts = judge(evidence, items)
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
        slowdowns=slowdowns(evidence),
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
    items = [item.name for item in ITEMS if set(item.studies) <= studies]
    write_page_of(evidence, items, folder, len(evidence.live_cells))
