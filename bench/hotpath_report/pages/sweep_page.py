# SPDX-License-Identifier: Apache-2.0
"""The page of `hotpath sweep`."""

from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from hotpath_report.figures import sweep
from hotpath_report.figures.sweep_table import Measure, Table
from hotpath_report.figures.violins import Drawing
from hotpath_report.pages import curves, interactive
from hotpath_report.pages.writer import Section, make_figure, write_page

LINES, MAP, MULTIPLES = "lines", "map", "multiples"  # figures


def plot(of: Table, measure: Measure, rows: pd.DataFrame, title: str, figure: str) -> dict[str, Any]:
    """The lines of all executors in some rows of the table."""
    found = [(e, e, of.points(rows[rows["executor"] == e], measure)) for e in of.executors]
    return curves.plot(title, of.x, curves.lines(found), figure)


def plots(of: Table) -> list[dict[str, Any]]:
    """Each measure with the other axes pooled, then for each value of the second axis."""
    made = [plot(of, m, of.rows, m.title, LINES) for m in of.measures]
    for axis in of.others[:1]:
        for value in of.rows[axis].unique()[: sweep.MOST_PANELS]:
            rows = of.rows[of.rows[axis] == value]
            made += [plot(of, m, rows, f"{m.title}, {axis} {value}", MULTIPLES) for m in of.measures]
    return [p for p in made if any(line["x"] for line in p["lines"])]


def figures(of: Table) -> list[tuple[str, str, Any]]:
    """Name, title and drawing of the figures that the table allows."""
    made: list[tuple[str, str, Any]] = [
        (LINES, f"{of.what} over {of.x}", sweep.lines),
        (MAP, f"{of.what} and losses over {of.x} and executor", sweep.heat_map),
    ]
    if of.others:
        made.append((MULTIPLES, f"{of.multiplied.title.capitalize()}, by {of.others[0]}", sweep.multiples))
    return made


def write(folder: str) -> None:
    """Draws the figures of a sweep, and writes report.html and report.md. Raises InputError."""
    of = Table(Path(folder))
    sweep.draw(of, figures(of), folder)
    drawn = plots(of)
    values = [
        {"measure": p["title"], of.x: x, "executor": a["label"], "value": value, "low": low, "high": high}
        for p in drawn
        for a in p["lines"]
        for x, value, low, high in zip(a["x"], a["value"], a["low"], a["high"])
    ]
    data = pd.DataFrame(values)
    made = [
        make_figure(name, title, partial(drawing, draw, of, data), []) for name, title, draw in figures(of)
    ]
    text = "The value of a point is over the repetitions; bands are its 95 % interval."
    section = Section("values", "Values", of.subtitle(), text, made, [curves.table(p) for p in drawn])
    write_page(
        Path(folder),
        "report",
        [section],
        title=f"Sweep over {', '.join(of.axes)}",
        facts=[of.subtitle()],
        losses=[],
        made_by="`hotpath sweep`. Every row of every cell: table.csv.",
        **({"interactive": interactive.embedded(curves.document(drawn))} if drawn else {}),
    )
    print(Path(folder) / "report.html")


def drawing(draw: Any, of: Table, data: pd.DataFrame, width: float) -> Drawing:
    """A figure with the values of all curves."""
    return Drawing(draw(of, width), data)
