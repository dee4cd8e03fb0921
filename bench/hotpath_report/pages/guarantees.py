# SPDX-License-Identifier: Apache-2.0
"""The page of `hotpath analyze`: bounds of tasks and chains beside observed values."""

from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from hotpath_report import style
from hotpath_report.errors import InputError
from hotpath_report.figures.violins import Drawing
from hotpath_report.pages.writer import Section, Table, make_figure, write_report
from hotpath_report.tables import read_json, read_table

TEXTS = ["executor", "method", "kind", "name"]
NUMBERS = ["bound_ns", "observed_ns", "deadline_ns", "response_ns", "waiting_ns"]
EXPLANATION = (
    "Bars: the smallest bounds; dark parts: waiting for other inputs. Dots: largest observed values; lines: deadlines. "
    "For the assumptions of each method see docs/analysis.md."
)


#: What follows a name, by kind: a chain has two latencies.
LATENCIES = {"task": "", "chain": ", end to end", "hot_path": ", hot path"}


def tightest(rows: pd.DataFrame) -> pd.DataFrame:
    """The row with the smallest bound of each task and latency, including rows without a bound."""
    ordered = rows.sort_values("bound_ns", na_position="last", kind="stable")
    best = ordered.drop_duplicates(["kind", "name"]).sort_index()
    return best.assign(name=best["name"] + best["kind"].map(LATENCIES))


def draw(rows: pd.DataFrame, executor: str) -> Drawing:
    """Bars for bounds, dots for observed values, lines for deadlines."""
    height = 1.1 + 0.21 * len(rows)
    figure, (axes,) = style.new_figure(height)
    ms = {name: rows[name].to_numpy() / 1e6 for name in NUMBERS}
    places = range(len(rows))
    axes.barh(places, ms["bound_ns"], height=0.62, color=style.colour_of(executor), alpha=0.45)
    axes.barh(places, ms["waiting_ns"], height=0.62, color=style.colour_of(executor), alpha=0.55)
    axes.plot(ms["observed_ns"], places, "o", color=style.INK, markersize=4)
    axes.plot(ms["deadline_ns"], places, "|", color=style.WARNING, markersize=9, markeredgewidth=1.6)
    style.rows_of_labels(axes, list(rows["name"]), xlabel="ms", xlim=(0, None))
    return Drawing(figure, rows)


def cell(value: float) -> str:
    """Milliseconds; empty if unknown."""
    return "" if pd.isna(value) else f"{value / 1e6:.3f}"


def table(rows: pd.DataFrame) -> Table:
    """The bounds as a table, with their methods."""
    cells = [
        [row.name, row.method, cell(row.bound_ns), cell(row.observed_ns), row.tightness, row.dominated_by]
        for row in rows.fillna({"tightness": "", "dominated_by": ""}).itertuples(index=False)
    ]
    return Table(
        "Bounds", ["", "method", "bound ms", "observed ms", "tightness", "consists of"], cells, folded=True
    )


def write(folder: str) -> None:
    """Writes report.html and report.md. Raises InputError."""
    found: dict[str, Any] = read_json(Path(folder) / "bounds.json", "hotpath analyze --page")
    rows = read_table(Path(folder) / "bounds.csv", TEXTS, [*NUMBERS, "tightness", "dominated_by"])
    if rows.empty:
        raise InputError(f"{folder}: nothing to draw: no method bounds this graph under these executors")
    sections = []
    for executor, of_executor in rows.groupby("executor", sort=False):
        name, best = str(executor), tightest(of_executor)
        figure_name = "".join(c if c.isalnum() else "_" for c in name)
        title = f"{name}: worst-case response times and latencies"
        made = make_figure(figure_name, title, partial(draw, best, name))
        refused = [[r["method"], r["why"]] for r in found["refused"] if r["executor"] == name]
        tables = [table(best), Table("Not applied", ["method", "why"], refused, folded=True)]
        sections.append(Section(figure_name, name, "bounds (ms)", EXPLANATION, [made], tables))
    facts = [f"{found['graph']}, {found['load_percent']:.1f} % load, {found['costs']}"]
    facts += [f"Observed in {found['trace']}"] if found["trace"] else []
    write_report(
        Path(folder),
        sections,
        title=f"Guaranteed bounds of {found['graph']}",
        facts=facts,
        made_by="`hotpath analyze`. Every bound: bounds.csv.",
    )
    print(f"\n{Path(folder) / 'report.html'} (and report.md)")
