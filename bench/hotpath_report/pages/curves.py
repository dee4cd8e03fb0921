# SPDX-License-Identifier: Apache-2.0
"""Curves over a quantity in the interactive part of a page."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from hotpath_report import style
from hotpath_report.pages.writer import Table
from hotpath_report.statistics import Estimate

Points = Mapping[float, Estimate]  # by x
LOGARITHMIC = 8  # ratio of the largest to the least value from which an axis is logarithmic


def lines(found: Sequence[tuple[str, str, Points]]) -> list[dict[str, Any]]:
    """The lines of a plot with their intervals, given as executor, label and points."""
    made = []
    for (executor, label, points), dash in zip(found, style.dashes_of([e for e, *_ in found])):
        xs = sorted(points)
        rows = [[None if math.isnan(v) else round(v, 6) for v in points[x]] for x in xs]
        columns: dict[str, Any] = {
            key: [row[k] for row in rows] for k, key in enumerate(("value", "low", "high"))
        }
        look: dict[str, Any] = {"label": label, "colour": style.colour_of(executor), "dash": dash}
        made.append({**look, "x": list(map(float, xs)), **columns})
    return made


def plot(title: str, x: str, lines: Sequence[dict[str, Any]], figure: str = "") -> dict[str, Any]:
    """Lines over `x`, in place of the page's static `figure`. Latencies that differ much have a
    logarithmic axis."""
    values = [value for of in lines for value in of["value"] if value is not None]
    far_apart = bool(values) and min(values) > 0 and max(values) > LOGARITHMIC * min(values)
    return {
        "title": title,
        "x": x,
        "log": "(ms)" in title and far_apart,
        "lines": [of for of in lines if of["x"]],
        "figure": figure,
    }


def table(of: Mapping[str, Any]) -> Table:
    """The values of a plot with their intervals, with a row for each x."""
    cells: dict[float, list[str]] = {x: [] for x in sorted({x for line in of["lines"] for x in line["x"]})}
    for line in of["lines"]:
        points = {x: values for x, *values in zip(line["x"], line["value"], line["low"], line["high"])}
        for x, row in cells.items():
            values = [math.nan if v is None else v for v in points.get(x, [])]
            row.append(Estimate(*values).text(3) if values else "")
    rows = [[f"{x:g}", *row] for x, row in cells.items()]
    header = [of["x"], *(line["label"] for line in of["lines"])]
    return Table(of["title"], header, rows, folded=True, numbers=True)
