# SPDX-License-Identifier: Apache-2.0
"""The figures and the page of `hotpath sweep`."""

from pathlib import Path
from typing import Any

import pandas as pd

from hotpath_report import style
from hotpath_report.figures import sweep
from hotpath_report.figures.sweep import Table
from hotpath_report.figures.violins import Drawing
from hotpath_report.pages import curves
from hotpath_report.pages.interactive import without_jobs
from hotpath_report.pages.writer import Section, make_figure, write_report


def plots(of: Table) -> list[dict[str, Any]]:
    """Each measure with the other axes pooled, then for each value of the second axis."""
    shown = [(of.rows, "", "lines")]
    for axis in of.others[:1]:
        for value in of.rows[axis].unique()[: sweep.MOST_PANELS]:
            shown.append((of.rows[of.rows[axis] == value], f", {axis} {value}", "multiples"))
    made = []
    for rows, suffix, figure in shown:
        for m in of.measures:
            found = [(e, e, of.points(rows[rows["executor"] == e], m)) for e in of.executors]
            made.append(curves.plot(m.title + suffix, of.x, curves.lines(found), figure))
    return [p for p in made if p["lines"]]


def figures(of: Table) -> list[tuple[str, str, Any]]:
    """Name, title and drawing of the figures that the table allows."""
    made: list[tuple[str, str, Any]] = [("lines", f"{of.what} over {of.x}", sweep.lines)]
    if of.others:
        made.append(("multiples", f"{of.multiplied.title.capitalize()}, by {of.others[0]}", sweep.multiples))
    return made


def write(folder: str) -> None:
    """Draws the figures of a sweep, and writes report.html and report.md. Raises InputError."""
    of = Table(Path(folder))
    for name, title, draw in figures(of):
        style.save(draw(of), folder, f"sweep_{name}", title, of.subtitle())
    drawn = plots(of)
    values = [
        {"measure": p["title"], of.x: x, "executor": a["label"], "value": value, "low": low, "high": high}
        for p in drawn
        for a in p["lines"]
        for x, value, low, high in zip(a["x"], a["value"], a["low"], a["high"])
    ]
    data = pd.DataFrame(values)
    made = [
        make_figure(name, title, lambda draw=draw: Drawing(draw(of), data))  # type: ignore
        for name, title, draw in figures(of)
    ]
    text = "The value of a point is over the repetitions; bands are its 95 % interval."
    tables = list(map(curves.table, drawn))
    write_report(
        Path(folder),
        [Section("values", "Values", of.subtitle(), text, made, tables)],
        title=f"Sweep over {', '.join(of.axes)}",
        facts=[of.subtitle()],
        made_by="`hotpath sweep`. Every row of every cell: table.csv.",
        data=without_jobs(plots=drawn) if drawn else None,
    )
    print(Path(folder) / "report.html")
