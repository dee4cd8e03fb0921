# SPDX-License-Identifier: Apache-2.0
"""The page of `hotpath advise`: latencies of all candidates, and outputs and timelines of the current
and the recommended one."""

from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from hotpath_report.figures import advice
from hotpath_report.figures.violins import Drawing
from hotpath_report.pages import interactive
from hotpath_report.pages.interactive import Measured
from hotpath_report.pages.writer import Section, Table, make_figure, write_page
from hotpath_report.run import Run
from hotpath_report.samples import samples_by
from hotpath_report.statistics import Samples
from hotpath_report.tables import NS_PER_MS, read_table

STORED = ("now", "recommended")  # folders of the first draw
HOT_PATH, AGE = "hot_path_latency_ns", "end_to_end_latency_ns"  # columns
TEXT = "Latencies are of all draws of phases and execution times."
STORED_TEXT = (
    " Outputs, causes and timelines are of the hot-path latency in the first draw, under the current and the "
    "recommended choice."
)


def samples(rows: pd.DataFrame, column: str) -> dict[str, Samples]:
    """Latencies (ms) of each candidate."""
    rows = rows[rows[column].notna()].assign(source="simulated", ms=rows[column] / NS_PER_MS)
    return {executor: of for (_, executor), of in samples_by(rows, ["source", "executor"], "ms").items()}


def series_of(found: dict[str, Any], names: list[str]) -> list[dict[str, Any]]:
    """A curve per candidate; those of the stored runs come first."""
    stored = dict(zip([found["now"], found["recommended"]], found["stored"]))
    ordered = [*stored, *(name for name in names if name not in stored)]
    made = []
    for name in ordered:
        run = list(stored).index(name) if name in stored else len(stored)
        made.append((run, stored.get(name, name), name + (" (now)" if name == found["now"] else "")))
    return interactive.curves_of(made)


def targets(found: dict[str, Any], rows: pd.DataFrame, series: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The distributions of the chain: first of the latency that has outputs, or that the objective is about."""
    chain, names = found["chain"], [of["label"].removesuffix(" (now)") for of in series]
    bounds = {r["name"]: r.get("bound_ms") for r in found["ranking"]}
    of_age = any(r.get("bound_of") == "end to end" for r in found["ranking"])
    made = []
    for column, name, title in ((HOT_PATH, chain, "hot path"), (AGE, f"{chain}, end to end", "end to end")):
        of = samples(rows, column)
        measured = Measured("chain", name, f"Chain {name}", f"latency, {title} (ms)", "predictions", [])
        marks: list[dict[str, Any]] = []
        if (column == AGE) == of_age:
            marks = [
                {"label": f"bound of {label}", "ms": round(bound, 6), "series": k}
                for k, label in enumerate(names)
                if (bound := bounds.get(label))
            ]
        if column == AGE and (limit := found["requirements_ms"].get(chain)):
            marks.append({"label": "requirement", "ms": limit, "series": None})
        curves = [interactive.curve(k, of[label]) for k, label in enumerate(names) if of.get(label)]
        marks.sort(key=lambda mark: float(mark["ms"]))
        made.append(interactive.target_of(measured, curves, marks))
    # Outputs are explained for the hot path alone, so it comes first if there are any.
    return [t for t in (made[::-1] if of_age and not found["stored"] else made) if t["curves"]]


def document(folder: Path, found: dict[str, Any], rows: pd.DataFrame) -> dict[str, Any]:
    """Everything that the interactive part shows."""
    runs = [Run(folder / name / "run") for name in STORED] if found["stored"] else []
    data = interactive.stored_part(runs, [str(run.folder) for run in runs])
    data["runs"].append(
        {"name": "", "source": "simulated", "executors": [], "tasks": [], "notes": [], "warm_up_ns": 0}
    )
    data["series"] = series_of(found, list(dict.fromkeys(rows["executor"])))
    return data | {"targets": targets(found, rows, data["series"]), "shown": 2}


def ranking(found: dict[str, Any]) -> Table:
    """The candidates, the best first."""
    keys = [key for key, *_ in advice.MARKS]
    cells = []
    for row in found["ranking"]:
        values = [advice.text_of(row[key]) if key in row else "" for key in keys]
        bound = f"{row['bound_ms']:.1f}" if row.get("bound_ms") else ""
        lost = f"{row['lost_percent']:.1f}" if "lost_percent" in row else ""
        cells.append([row["name"], *values, lost, bound, row["overload"] or row["description"]])
    header = ["candidate", *(f"{label} ms" for _, label, _ in advice.MARKS), "lost %", "bound ms", ""]
    return Table(f"Candidates, best first by {found['objective']}", header, cells)


def doubts(found: dict[str, Any]) -> list[Table]:
    """The order of the best candidates under changed assumptions."""
    rows = [
        [d["assumption"], ", ".join(d["order"]), "same" if d["same_first"] else "another"]
        for d in found["doubts"]
    ]
    return [Table("Changed assumptions", ["with", "best first", "recommendation"], rows)] if rows else []


def write(folder: str) -> None:
    """Draws the figure of `hotpath advise`, and writes report.html and report.md. Raises InputError."""
    found = advice.read(folder)
    advice.draw(found, folder)
    rows = read_table(Path(folder) / "latencies.csv", ["executor", "repetition", "chain", HOT_PATH], [AGE])
    figure = make_figure("predictions", "Predicted latency of each candidate", partial(drawing, found), [])
    text = TEXT + (STORED_TEXT if found["stored"] else "")
    section = Section("candidates", "Candidates", advice.subtitle(found), text, [figure])
    section.tables = [ranking(found), *doubts(found)]
    section.notes = [" ".join(found["causes"])] if found["causes"] else []
    write_page(
        Path(folder),
        "report",
        [section],
        title=f"Advice for {found['graph']}",
        facts=[*found["sentences"], *([f"Change: {found['change']}"] if found["change"] else [])],
        losses=[],
        made_by="`hotpath advise`. Every latency: latencies.csv.",
        interactive=interactive.embedded(document(Path(folder), found, rows)),
    )
    print(Path(folder) / "report.html")


def drawing(found: dict[str, Any], width: float) -> Drawing:
    """The predictions with their data."""
    values = [
        {"candidate": row["name"], "measure": label, "value_ms": row[key]["value"]}
        | dict(zip(("low_ms", "high_ms"), row[key].get("interval", [])))
        for row in advice.drawn(found)
        for key, label, _ in advice.MARKS
    ]
    return Drawing(advice.predictions(found, width), pd.DataFrame(values))
