# SPDX-License-Identifier: Apache-2.0
"""From evidence to what a reproduction leaves: data/, figures/, claims.json, report.html, report.md."""

import itertools
import re
import shlex
from collections import Counter
from collections.abc import Collection
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from hotpath_report import statistics
from hotpath_report.errors import Missing
from hotpath_report.figures.violins import percentile_table
from hotpath_report.pages.writer import Section, Table, make_figure, write_page
from hotpath_report.paper import drawings, storage, tables
from hotpath_report.paper.cells import MODES, SPEC, duration_text
from hotpath_report.paper.claims import Verdict, judge
from hotpath_report.paper.evidence import Evidence
from hotpath_report.paper.findings import LIMITS, NO_DATA, NOT, PARTLY, REPRODUCED
from hotpath_report.paper.items import ITEMS
from hotpath_report.paper.noise import NOISE_RULE
from hotpath_report.run import SOURCES
from hotpath_report.samples import GROUPS
from hotpath_report.tables import write_file, write_json

# At the top of the page.
PICTURES = ("hot_path", "dropped_jobs", "response_imu")


def command_lines(evidence: Evidence, studies: Collection[str]) -> list[str]:
    """One line for each distinct command; repetitions differ only in their seed and folder."""
    lines: dict[str, tuple[str, list[int]]] = {}
    for cell in evidence.cells:
        if cell["study"] in studies:
            line = shlex.join(cell["command"])
            key = re.sub(r"--seed \d+|--output \S+", "", line)
            lines.setdefault(key, (line, []))[1].append(cell["seed"])
    texts = []
    for line, seeds in sorted(lines.values(), key=lambda found: (" run " in found[0], found[0])):
        others = ", ".join(map(str, sorted(set(seeds[1:]))))
        texts.append(line + (f"   # and --seed {others}" if others else ""))
    return texts


def where_it_ran(evidence: Evidence, planned: int) -> str:
    """Machine, date and mode; `planned`: live repetitions that the plan has."""
    m = evidence.machine
    if m is None:
        return (
            f"Simulated and computed, mode {evidence.mode}; measured was only what a release costs on the machine that"
            " did it."
        )
    complete = len(evidence.live_cells)
    missing = f" Unfinished: {complete} of {planned} live repetitions." if complete < planned else ""
    virtual = "virtual machine" if m.get("hypervisor") else "machine"
    return (
        f"Live: {m['cpu_model']}, {virtual} with {m['processors']} processors, Linux"
        f" {m['kernel'].split('-')[0]}{', PREEMPT_RT' if m['preempt_rt'] else ''}, {m['distribution']},"
        f" {m['compiler']}, transport {m['transport']}, {m['date'][:10]}, mode {evidence.mode}.{missing}"
    )


def tiles(evidence: Evidence, verdicts: list[Verdict]) -> list[dict[str, Any]]:
    """The numbers at the top of the page."""
    found = Counter(v.verdict for v in verdicts)
    shown: list[tuple[str, str, str]] = []
    for source in SOURCES:
        default, ours = (evidence.latencies("autoware", source, e) for e in ("default", "rm-ro"))
        if default and ours:
            value, _, interval = statistics.ratio(default, ours, 1.0).text(2).partition(" ")
            shown.append((f"{value}×", f"worst hot path of default over rm-ro, {source}", interval))
    real = evidence.reference.hot_path_ms("max")
    if {"default", "rm-ro"} <= real.keys():
        text = f"the same on the real ROS 2 stack (the paper: {LIMITS.paper_slowdown:g})"
        shown.append((f"{real['default'] / real['rm-ro']:.2f}×", text, ""))
    text = f"claims reproduced, {found[PARTLY]} partly, {found[NOT]} not"
    shown.append((f"{found[REPRODUCED]} of {len(verdicts) - found[NO_DATA]}", text, ""))
    if evidence.live_cells:
        marked = f"{len(evidence.marked_cells())} of {len(evidence.live_cells)}"
        shown.append((marked, "live repetitions marked as noisy", ""))
    return [dict(zip(("value", "text", "more"), tile)) for tile in shown]


def live_runs(evidence: Evidence) -> str:
    """What was measured, study by study: as many repetitions of each executor and setting as there really are."""
    texts = []
    for study, name in SPEC["study_names"].items():
        mine = [c for c in evidence.live_cells if c["study"] == study]
        counts = Counter(c["name"].rsplit(".", 1)[0] for c in mine).values()
        if mine:
            times = " to ".join(map(str, sorted({min(counts), max(counts)})))
            lengths = " or ".join(f"{s:g}" for s in sorted({c["duration_s"] for c in mine}))
            texts.append(f"{name} {times} × {lengths} s")
    return ", ".join(texts)


def methods(evidence: Evidence) -> dict[str, Any]:
    """The facts in the section on methods."""
    live = evidence.live_cells
    return {
        "mode": MODES[evidence.mode],
        "live": len(live),
        "beside": sum(c.get("at_once", 1) > 1 for c in live),
        "pinned": " or ".join(sorted({",".join(map(str, c["cpus"])) for c in live})),
        "live_runs": live_runs(evidence),
        "policies": "; ".join(sorted({p for c in live for p in c.get("policies", [])})),
        "confidence": statistics.CONFIDENCE_PERCENT,
        "resamples": statistics.RESAMPLES,
        "blocks": statistics.BLOCKS,
        # The most that an interval between the extremes of so many repetitions covers of a true median, in percent.
        "coverage": {n: 100 * (1 - 2 ** (1 - n)) for n in (3, 5)},
    }


def noise(evidence: Evidence) -> dict[str, Any]:
    """What disturbed the live repetitions."""
    live = sorted(evidence.live_cells, key=lambda c: str(c["name"]))
    if not live:
        return {"text": "Nothing was measured live.", "table": None}
    marked = len(evidence.marked_cells())
    text = f"{marked} of {len(live)} live repetitions are marked as noisy; they count like all others."
    text += f" The rule: {NOISE_RULE}."
    if 4 * marked > len(live):
        text += " This machine is too noisy for conclusions about single worst cases."
    columns = (("stolen_percent", 2), ("others_percent", 1), ("held_up_ms", 2))
    rows = [
        [c["name"].removeprefix("live."), c.get("at_once", 1)]
        + [f"{c['noise'][key]:.{digits}f}" for key, digits in columns]
        + ["; ".join(c["noise"]["marks"])]
        for c in live
    ]
    header = ["repetition", "at once", "stolen %", "used by others %", "held up ms", "marked for"]
    return {"text": text, "table": Table("All live repetitions", header, rows, folded=True)}


def sections(evidence: Evidence, items: Collection[str]) -> list[Section]:
    """A section for each item."""
    made = []
    for item in (item for item in ITEMS if item.name in items):
        section = Section(item.name, item.title, item.paper or "Beyond the paper", item.text)
        draw = partial(getattr(drawings, item.draw), evidence, **item.options)
        with suppress(Missing):
            commands = command_lines(evidence, item.studies)
            section.figures.append(make_figure(item.figure, item.caption, draw, commands))
        with suppress(Missing):
            table = getattr(tables, item.table)(evidence, **item.options)
            section.tables += [table] if table.rows else []
        made.append(section)
    return made


def percentiles(evidence: Evidence) -> pd.DataFrame:
    """Every percentile of every distribution, one row each, with the cells that it comes from."""
    found = [(("hot path", *key, ""), samples) for key, samples in sorted(evidence.all_latencies.items())]
    for study in sorted(set(evidence.timers["study"])):
        runs = evidence.timer_runs(study)
        keys = sorted(runs.counts.groupby(runs.KEY).groups, key=str)
        for (setting, source, executor), group in itertools.product(keys, GROUPS):
            samples = runs.samples(setting, source, executor, group)
            found.append((("response", study, source, setting, executor, group), samples))
    names = ("quantity", "study", "source", "setting", "executor", "tasks")
    table = percentile_table((dict(zip(names, key)), samples) for key, samples in found)
    if len(table):
        cells = {key: evidence.names_of_cells((key[1],), key[2], key[4], key[3]) for key, _ in found}
        table["cells"] = [cells[key] for key in zip(*(table[name] for name in names))]
        table["setting"] = table["setting"].map("{} %".format)
    return table


def write_page_of(evidence: Evidence, items: Collection[str], folder: Path, planned: int) -> list[Verdict]:
    """Writes page, figures, claims.json and percentiles into `folder`, and returns the verdicts."""
    (folder / "data").mkdir(parents=True, exist_ok=True)
    write_file(
        folder / "data" / "percentiles.csv", percentiles(evidence).to_csv(index=False, float_format="%.6f")
    )
    verdicts = judge(evidence, items)
    write_json(folder / "claims.json", [v.as_json() for v in verdicts])
    made = sections(evidence, items)
    figures = {figure.name: (section, figure) for section in made for figure in section.figures}
    write_page(
        folder,
        "reproduction",
        made,
        where=where_it_ran(evidence, planned),
        tiles=tiles(evidence, verdicts),
        pictures=[figures[name] for name in PICTURES if name in figures],
        verdicts=verdicts,
        methods=methods(evidence),
        noise=noise(evidence),
    )
    return verdicts


def write_results(evidence: Evidence, items: Collection[str], folder: Path, planned: int) -> list[Verdict]:
    """Writes everything that a reproduction leaves; `planned`: live repetitions that the plan has."""
    storage.write(evidence, folder / "data")
    verdicts = write_page_of(evidence, items, folder, planned)
    live = evidence.live_cells
    seconds = sum(c["duration_s"] for c in live)
    facts = {
        "mode": evidence.mode,
        "machine": evidence.machine,
        "where": where_it_ran(evidence, planned),
        "cells": len(evidence.cells),
        "live_cells": len(live),
        "live_planned": planned,
        "live_runs": live_runs(evidence),
        "live_measured_s": seconds,
        "live_measured": duration_text(seconds),
        "marked_cells": len(evidence.marked_cells()),
    }
    write_json(folder / "facts.json", facts)
    return verdicts


def write_published(publication: Path, folder: Path) -> None:
    """Judges and draws a published reproduction again, from its data/."""
    evidence = storage.stored(publication)
    studies = {c["study"] for c in evidence.cells}
    items = [item.name for item in ITEMS if set(item.studies) <= studies]
    write_page_of(evidence, items, folder, len(evidence.live_cells))
    print(f"{folder / 'report.html'} (and report.md)")
