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


def finite(values: Sequence[float]) -> list[float | None]:
    """Numbers for JSON; None for NaN."""
    return [None if math.isnan(value) else round(value, 6) for value in values]


def lines(found: Sequence[tuple[str, str, Points]]) -> list[dict[str, Any]]:
    """The lines of a plot, given as executor, label and points."""
    dashes = style.dashes_of([executor for executor, *_ in found])
    return [line(*of, dash) for of, dash in zip(found, dashes)]


def line(executor: str, label: str, points: Points, dash: list[int]) -> dict[str, Any]:
    """A line with its intervals."""
    estimates = [points[x] for x in sorted(points)]
    return {
        "label": label,
        "colour": style.colour_of(executor),
        "dash": dash,
        "x": list(map(float, sorted(points))),
        "value": finite([e.value for e in estimates]),
        "low": finite([e.low for e in estimates]),
        "high": finite([e.high for e in estimates]),
    }


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


def document(plots: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """What the interactive part of a page with curves alone shows."""
    nothing: dict[str, Any] = {"causes": [], "rules": [], "series": [], "targets": [], "runs": []}
    return nothing | {"plots": [of for of in plots if of["lines"]]}


def table(of: Mapping[str, Any]) -> Table:
    """The values of a plot, with a row for each x."""
    xs = sorted({x for a in of["lines"] for x in a["x"]})
    rows = [[f"{x:g}", *(cell(a, x) for a in of["lines"])] for x in xs]
    return Table(of["title"], [of["x"], *(a["label"] for a in of["lines"])], rows, folded=True, numbers=True)


def cell(of: Mapping[str, Any], x: float) -> str:
    """Value and interval of a line at x; empty if it has none."""
    if x not in of["x"]:
        return ""
    value, low, high = (of[key][of["x"].index(x)] for key in ("value", "low", "high"))
    return Estimate(value, *(math.nan if v is None else v for v in (low, high))).text(3)
