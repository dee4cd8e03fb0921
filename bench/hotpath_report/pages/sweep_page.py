# SPDX-License-Identifier: Apache-2.0
"""The figures and pages of `hotpath sweep` and `hotpath capacity`, with lines and their intervals over a quantity."""

import itertools
import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from hotpath_report import style
from hotpath_report.errors import InputError
from hotpath_report.figures.violins import Drawing
from hotpath_report.files import Rows, read_document, value_of
from hotpath_report.pages.interactive import ENDS, Points, of_samples, plot
from hotpath_report.pages.writer import Section, Table, table_of, write_with_figure
from hotpath_report.statistics import Estimate, Samples, grouped
from hotpath_report.style import FAINT, INK, WARNING

Plots = list[dict[str, Any]]


MOST_VALUES = 9  # of the second axis of a sweep
ANALYSIS = "analysis"  # source of levels that an analysis accepts
# Column of the table and title of each measure.
LOST = {"lost": "lost: skipped and overwritten"}
OVERRUNS = {"deadline_overruns": "deadline overruns"}
SHARE = {"response_share_max": "worst response time / deadline"}
MEDIAN = "hot_path_p50_ms"
OF_CHAINS = {MEDIAN: "median hot-path latency (ms)", "hot_path_max_ms": "worst hot-path latency (ms)"} | LOST
OF_TIMERS = SHARE | OVERRUNS | LOST
# Those of levels.csv; latencies have the columns of an interval.
LATENCIES = {"age_p99": "p99 of the age of the data (ms)", "age_worst": "worst age of the data (ms)"}
LATENCIES |= {"p99": "p99 of the hot-path latency (ms)", "worst": "worst hot-path latency (ms)"}


def rows_of(document: dict[str, Any]) -> Rows:
    """Its rows; the values of a sweep's axes are texts, as in its file."""
    rows = (map(lambda v: value_of(v) if isinstance(v, str) else v, row) for row in document["rows"])
    return [dict(zip(document["columns"], row)) for row in rows]


def plots_of(
    rows: Rows,
    x: str,
    measures: dict[str, str],
    points: Callable[[Rows, str], Points],
    suffix: str = "",
    figure: str = "",
) -> Plots:
    """A plot per measure that any executor has."""
    made = []
    for column, title in measures.items():
        found = {e: points(of, column) for e, of in grouped(rows, "executor").items()}
        made.append(plot(title + suffix, x, found, figure))
    return [p for p in made if p["lines"]]


def over_repetitions(x: str, rows: Rows, column: str) -> Points:
    """{x: median or largest value over the repetitions with its interval}"""
    known = grouped((row for row in rows if row[column] is not None), x)
    p = 0.5 if column == MEDIAN else 1.0
    return {at: Samples([row[column]] for row in of).estimate(p) for at, of in known.items()}


def of_levels(x: str, rows: Rows, column: str) -> Points:
    """{x: value with its interval}"""
    parts = [f"{column}_{part}ms" for part in ("", "low_", "high_")] if column in LATENCIES else [column]
    known = (row for row in rows if row[parts[0]] is not None)
    return {row[x]: Estimate(*(math.nan if row[p] is None else row[p] for p in parts)) for row in known}


def draw_lines(axes: Axes, drawn: dict[str, Any]) -> None:
    """A line per executor, with a band for the intervals."""
    for line in drawn["lines"]:
        x, value, low, high = (np.array(line[key], dtype=float) for key in ("x", *ENDS))
        ends = [np.where(np.isnan(end), value, end) for end in (low, high)]
        axes.fill_between(x, *ends, color=line["colour"], alpha=0.18, linewidth=0)
        look: Any = {"dashes": style.in_widths(line["dash"]), "marker": "o" if len(x) < 30 else ""}
        axes.plot(x, value, color=line["colour"], markersize=2.8, **look)
    axes.set(xlabel=drawn["x"], title=drawn["title"])
    if drawn["log"]:
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.yaxis.set_minor_locator(NullLocator())
        axes.yaxis.set_major_formatter("{x:g}")


def lines(plots: Plots, executors: list[str]) -> Figure:
    """The first two measures."""
    figure, panels = style.new_figure(3.6, 1, 2)
    for axes, drawn in zip(panels, plots):
        draw_lines(axes, drawn)
    looks = zip(executors, map(style.in_widths, style.dashes_of(executors)))
    handles = [style.line(e, color=style.colour_of(e), dashes=dashes) for e, dashes in looks]
    style.add_key(figure, [*handles, style.patch("95 % interval over repetitions", alpha=0.3)], 6)
    return figure


def write(folder: str) -> None:
    """Draws the figure of a sweep, and writes report.html and report.md. Raises InputError."""
    facts = read_document(Path(folder) / "sweep.json", "hotpath sweep")
    rows = rows_of(facts)
    failed = sum(row["failure"] is not None for row in rows)
    chain = next((row["chain"] for row in rows if row["chain"]), None)
    rows = [row for row in rows if row["executor"] and (row["chain"] == chain or row["failure"])]
    axes = [axis for axis in facts["axes"] if axis in facts["columns"] and len(grouped(rows, axis)) > 1]
    x = next((axis for axis in axes if not any(isinstance(row[axis], str) for row in rows)), "")
    if not x:
        raise InputError(f"{folder}: no numeric axis to draw over")
    subtitle = f"{f'chain {chain} · ' if chain else ''}over {', '.join(axes)} · "
    subtitle += f"{facts['cells']} cells, {facts['repetitions']} repetitions"
    subtitle += f" · {failed} cells not finished (overload)" if failed else ""
    # Each measure with the other axes pooled, then for each value of the second axis.
    measures, points = OF_CHAINS if chain else OF_TIMERS, partial(over_repetitions, x)
    drawn = plots_of(rows, x, measures, points, figure="sweep_lines")
    pooled = list(drawn)
    for axis in [a for a in axes if a != x][:1]:
        for value, of in itertools.islice(grouped(rows, axis).items(), MOST_VALUES):
            drawn += plots_of(of, x, measures, points, f", {axis} {value}")
    values = [
        {"measure": p["title"], x: at, "executor": a["label"], "value": value, "low": low, "high": high}
        for p in drawn
        for a in p["lines"]
        for at, value, low, high in zip(a["x"], a["value"], a["low"], a["high"])
    ]
    text = "The value of a point is over the repetitions; bands are its 95 % interval."
    write_with_figure(
        folder,
        Section("values", "Values", subtitle, text, tables=list(map(table_of, drawn))),
        lambda: Drawing(lines(pooled, list(grouped(rows, "executor"))), values),
        "sweep_lines",
        f"{'Latency' if chain else 'Response times'} over {x}",
        subtitle,
        of_samples({}, plots=drawn) if drawn else None,
        title=f"Sweep over {', '.join(axes)}",
        facts=[subtitle],
        made_by="`hotpath sweep`. Every row of every cell: table.csv.",
    )


def draw_row(axes: Axes, y: float, executor: str, rows: Rows, over: str) -> None:
    """Bar: capacity; dots: passing levels; crosses: failing levels; triangle: analysis."""
    colour = style.colour_of(executor)
    looks = {ANALYSIS: (0.36, "^", INK, 6), 1: (0, "o", colour, 4), 0: (0, "x", WARNING, 4)}
    for row in rows:
        is_bound = row["source"] == ANALYSIS
        if row["capacity"] and not is_bound:
            axes.barh(y, row[over], height=0.5, color=colour, alpha=0.3, linewidth=0)
            style.note(axes, f"{row[over]:g}", (row[over], y - 0.33), (0, 0), ha="right")
        if row["capacity"] or not is_bound:
            shift, marker, look, size = looks[ANALYSIS if is_bound else row["holds"]]
            axes.plot([row[over]], [y + shift], marker, color=look, markersize=size)


def levels(rows: Rows, over: str) -> Figure:
    """A row of marks per executor."""
    by_executor = grouped(rows, "executor")
    figure, (axes,) = style.new_figure(0.9 + 0.5 * len(by_executor))
    style.rows_of_labels(axes, list(by_executor), xlabel=over)
    for y, (executor, found) in enumerate(by_executor.items()):
        draw_row(axes, y, executor, found, over)
    axes.set_xlim(left=0)
    marks = [style.patch("capacity", alpha=0.3), style.dot("passes", color=FAINT)]
    marks += [style.dot("fails", "x", color=WARNING)]
    style.add_key(figure, [*marks, style.dot("largest level that an analysis accepts", "^")], 4)
    return figure


def write_capacity(folder: str) -> None:
    """Draws the figure of a search for capacities, and writes report.html and report.md. Raises InputError."""
    found = read_document(Path(folder) / "capacity.json", "hotpath capacity")
    rows = rows_of(found)
    over, executors = found["over"], ", ".join(grouped(rows, "executor"))
    measured = [row for row in rows if row["source"] != ANALYSIS]
    drawn = plots_of(measured, over, LATENCIES | LOST | OVERRUNS | SHARE, partial(of_levels, over))
    cells = [
        [r["executor"], r["source"], f"{r[over]:g}", "holds" if r["holds"] else "fails", r["why"] or ""]
        for r in rows
    ]
    tried = Table("Tried levels", ["executor", "source", over, "", "why"], cells, folded=True)
    title = f"Highest {over} that each executor sustains"
    text = "Each point is a tried level, over all repetitions; bands are 95 % intervals."
    write_with_figure(
        folder,
        Section("levels", "Levels", executors, text, tables=[tried, *map(table_of, drawn)]),
        lambda: Drawing(levels(rows, over), rows),
        "capacity",
        title,
        "simulated; each mark is a tried level",
        of_samples({}, plots=drawn) if drawn else None,
        title=title,
        facts=[f"{executors}; the table with confidence: capacity.md"],
        made_by="`hotpath capacity`. Every tried level: levels.csv.",
    )
