# SPDX-License-Identifier: Apache-2.0
"""The figure and the page of `hotpath sweep`."""

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


MOST_VALUES = 9  # of the second axis


def plots(of: Table) -> list[dict[str, Any]]:
    """Each measure with the other axes pooled, then for each value of the second axis."""
    shown = [(of.rows, "", "lines")]
    for axis in of.others[:1]:
        for value in of.rows[axis].unique()[:MOST_VALUES]:
            shown.append((of.rows[of.rows[axis] == value], f", {axis} {value}", ""))
    made = []
    for rows, suffix, figure in shown:
        for m in of.measures:
            found = [(e, e, of.points(rows[rows["executor"] == e], m)) for e in of.executors]
            made.append(curves.plot(m.title + suffix, of.x, curves.lines(found), figure))
    return [p for p in made if p["lines"]]


def write(folder: str) -> None:
    """Draws the figure of a sweep, and writes report.html and report.md. Raises InputError."""
    of = Table(Path(folder))
    title = f"{of.what} over {of.x}"
    style.save(sweep.lines(of), folder, "sweep_lines", title, of.subtitle())
    drawn = plots(of)
    values = [
        {"measure": p["title"], of.x: x, "executor": a["label"], "value": value, "low": low, "high": high}
        for p in drawn
        for a in p["lines"]
        for x, value, low, high in zip(a["x"], a["value"], a["low"], a["high"])
    ]
    made = make_figure("lines", title, lambda: Drawing(sweep.lines(of), pd.DataFrame(values)))
    text = "The value of a point is over the repetitions; bands are its 95 % interval."
    tables = list(map(curves.table, drawn))
    write_report(
        Path(folder),
        [Section("values", "Values", of.subtitle(), text, [made], tables)],
        title=f"Sweep over {', '.join(of.axes)}",
        facts=[of.subtitle()],
        made_by="`hotpath sweep`. Every row of every cell: table.csv.",
        data=without_jobs(plots=drawn) if drawn else None,
    )
    print(Path(folder) / "report.html")
