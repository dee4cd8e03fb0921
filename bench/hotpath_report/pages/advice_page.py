# SPDX-License-Identifier: Apache-2.0
"""The figure and the page of `hotpath advise`: latencies of all candidates, and outputs and timelines
of the current and the recommended one."""

from pathlib import Path
from typing import Any

from hotpath_report import style
from hotpath_report.errors import InputError
from hotpath_report.figures.violins import Drawing
from hotpath_report.files import read_document
from hotpath_report.pages import interactive
from hotpath_report.pages.writer import Section, Table, write_with_figure
from hotpath_report.run import Run, samples_of
from hotpath_report.statistics import estimate_of
from hotpath_report.style import INK

# Key, label and mark of each value.
MARKS = (("median_ms", "median", "o"), ("p99_ms", "p99", "D"), ("worst_ms", "worst of all draws", "|"))
HOT_PATH, AGE = "hot_path_ms", "age_ms"  # columns
TEXT = "Values are of all draws of phases and execution times."
STORED_TEXT = (
    " Outputs, causes and timelines are of the age of the data in the first draw, under the current and the "
    "recommended choice."
)

Advice = dict[str, Any]  # advice.json


def predictions(advice: Advice, rows: list[dict[str, Any]]) -> Drawing:
    """A row of marks per candidate."""
    figure, (axes,) = style.new_figure(0.6 + 0.36 * len(rows))
    values = []
    for y, row in enumerate(rows):
        colour = style.colour_of(row["name"])
        axes.plot([row["median_ms"]["value"], row["worst_ms"]["value"]], [y, y], color=colour, alpha=0.35)
        for key, label, mark in MARKS:
            value, interval = row[key]["value"], row[key].get("interval", [])
            look: Any = {"linewidth": 4, "alpha": 0.45, "solid_capstyle": "butt"}
            axes.plot(interval or [value] * 2, [y, y], color=colour, **look)
            axes.plot([value], [y], mark, color=colour, markersize=6, markeredgewidth=2)
            ends = dict(zip(("low_ms", "high_ms"), interval))
            values.append({"candidate": row["name"], "measure": label, "value_ms": value} | ends)
    names = [row["name"] + (" (now)" if row["name"] == advice["now"] else "") for row in rows]
    style.rows_of_labels(axes, names, xlabel=f"{advice['metric']} (ms)")
    axes.set_xlim(0, 1.05 * max(row["worst_ms"]["value"] for row in rows))
    marks = [style.dot(label, marker=mark, color=INK) for _, label, mark in MARKS]
    style.add_key(figure, [*marks, style.patch("95 % interval", facecolor=INK, alpha=0.45)], 4)
    return Drawing(figure, values)


def targets(found: Advice, labels: list[str]) -> list[dict[str, Any]]:
    """The distributions of the chain: first of the latency that has outputs, or that the objective is about."""
    chain = found["chain"]
    bounds = {r["name"]: r.get("bound_ms") for r in found["ranking"]}
    of_age = found["metric"] == "age of the data"
    series = [{"run": 0, "executor": label} for label in labels]
    made = []
    for column, name, title in (AGE, chain, "age of the data"), (HOT_PATH, f"{chain}, hot path", "hot path"):
        samples = samples_of(found["latencies"], column, exact=True).get(chain, {})
        marks: list[interactive.Mark] = []
        if (column == AGE) == of_age:
            bound = {k: bounds.get(label) for k, label in enumerate(labels)}
            marks += [(round(ms, 6), f"bound of {labels[k]}", k) for k, ms in bound.items() if ms]
        if column == AGE and (limit := found["requirements_ms"].get(chain)):
            marks.append((limit, "requirement", None))
        what = {"kind": "chain", "name": name, "title": f"Chain {name}", "measure": f"{title} (ms)"}
        made.append(interactive.target(what | {"figure": "advice"}, [samples], series, marks))
    # Outputs are explained by their age, so it comes first if there are any.
    return [t for t in (made if of_age or found["stored"] else made[::-1]) if t["curves"]]


def document(folder: Path, found: Advice) -> dict[str, Any]:
    """Everything that the interactive part shows. The curves of the stored runs come first."""
    runs = [Run(folder / name / "run") for name in ("now", "recommended")] if found["stored"] else []
    stored = dict(zip([found["now"], found["recommended"]], found["stored"]))
    labels = list(dict.fromkeys([*stored, *(row["executor"] for row in found["latencies"])]))
    shown = {name: name + (" (now)" if name == found["now"] else "") for name in labels}
    series = [(min(k, len(stored)), stored.get(e, e), text) for k, (e, text) in enumerate(shown.items())]
    parts = {"series": interactive.curves_of(series), "targets": targets(found, labels), "shown": 2}
    return interactive.page_data(runs, {"simulated": []}, **parts)


def tables(found: Advice) -> list[Table]:
    """The candidates, the best first, and the order of the best ones under changed assumptions."""

    def text_of(value: dict[str, Any]) -> str:
        return "-" if value["value"] is None else estimate_of(value).text(1)

    cells = []
    for row in found["ranking"]:
        values = [text_of(row[key]) if key in row else "" for key, *_ in MARKS]
        bound = f"{row['bound_ms']:.1f}" + " proven" * row.get("proven", False) if row.get("bound_ms") else ""
        lost = f"{row['lost_percent']:.1f}" if "lost_percent" in row else ""
        cells.append([row["name"], *values, lost, bound, row["overload"] or row["description"]])
    header = ["candidate", *(f"{label} ms" for _, label, _ in MARKS), "lost %", "bound ms", ""]
    made = [Table(f"Candidates, {found['metric']}, best first by {found['order']}", header, cells)]
    doubts = [
        [d["assumption"], ", ".join(d["order"]), "same" if d["same_first"] else "another"]
        for d in found["doubts"]
    ]
    if doubts:
        made.append(Table("Changed assumptions", ["with", "best first", "recommendation"], doubts))
    return made


def write(folder: str) -> None:
    """Draws advice.svg and .png, and writes report.html and report.md. Raises InputError."""
    found: Advice = read_document(Path(folder) / "advice.json", "hotpath advise")
    shown = [row for row in found["ranking"] if row.get("median_ms", {}).get("value") is not None]
    if not shown:
        raise InputError(f"{folder}: no prediction has a chain")
    cores = "one core" if found["cores"] == 1 else f"{found['cores']} cores"
    subtitle = (
        f"{found['chain']} of {found['graph']}, best first by {found['order']}; "
        f"{found['draws']} draws of {found['seconds']:g} s, {cores}"
    )
    title = f"Predicted {found['metric']} under each executor"
    text = TEXT + (STORED_TEXT if found["stored"] else "")
    section = Section("candidates", "Candidates", subtitle, text, tables=tables(found))
    section.notes = ["In the first draw: " + " ".join(found["causes"])] if found["causes"] else []
    write_with_figure(
        folder,
        section,
        lambda: predictions(found, shown),
        "advice",
        title,
        subtitle,
        document(Path(folder), found),
        title=f"Advice for {found['graph']}",
        lead=found["sentences"][:1],
        facts=[*found["sentences"][1:], *([f"Change: {found['change']}"] if found["change"] else [])],
        commands=found["installation"].replace("FOLDER", str(Path(folder).resolve())).splitlines(),
        commands_title="Install it",
        made_by="`hotpath advise`. Every latency: latencies.csv.",
    )
