# SPDX-License-Identifier: Apache-2.0
"""Report of one `hotpath bench` folder: report.md and its figures from bench.json, as specified in
bench.toml. Every number is the median over the repetitions."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from markupsafe import Markup

from hotpath_report.figures import bench as figures
from hotpath_report.bench_data import SPEC, Bench, Spec, three_digits
from hotpath_report.pages.text import render
from hotpath_report.pages.writer import Table
from hotpath_report.tables import write_file


def natural(name: str) -> list[Any]:
    """Sort key that orders numbers in names by value."""
    return [(0, int(part), "") if part.isdigit() else (1, 0, part) for part in re.split(r"(\d+)", name)]


def value_of(bench: Bench, spec: Spec, fields: Spec) -> float | None:
    """The value of a column or bar; None if not measured."""
    if "ros2_callback_us" in spec:
        us: float | None = SPEC["ros2_callback_us"].get(spec["ros2_callback_us"].format(**fields))
        return us
    metric = spec.get("metric", "time_ns").format(**fields)
    found = bench.matching(spec["of"].format(**fields), metric).values()
    if not found:
        return None
    value = 1 / max(found) if spec.get("inverse") else max(found)
    if "over" in spec:
        name = spec["over"].format(**fields)
        yardstick = bench.medians.get((name, metric)) or bench.medians.get((name, "time_ns"))
        return value / yardstick if yardstick else None
    return value * float(spec.get("factor", 1))


def bars(bench: Bench) -> Table | None:
    """Measurements against their bars (upper limits)."""
    rows = []
    for spec in SPEC["bar"]:
        plain = {key: value for key, value in spec.items() if "and" not in spec or key != "over"}
        for each in spec.get("each", [""]):
            share = spec.get("ros2_share")
            bar = share * SPEC["ros2_callback_us"][each] if share else spec.get("bar")
            told = [(spec["what"], plain, bar)]
            told += [(spec["and"], spec, spec.get("over_bar"))] if "and" in spec else []
            for what, of, limit in told:
                value = value_of(bench, of, {"each": each})
                if value is not None:
                    verdict = "" if limit is None else "met" if value <= limit else Markup("**not met**")
                    limit = "" if limit is None else limit
                    rows.append([what.format(each=each), three_digits(value), limit, verdict])
    return Table("Against the bar", ["what", "measured", "bar", ""], rows, numbers=True) if rows else None


def rows_of(bench: Bench, spec: Spec, columns: list[Spec]) -> Iterator[list[str]]:
    """Rows with at least one measured value."""
    for row in spec["rows"]:
        for name in sorted({benchmark for benchmark, _ in bench.values}, key=natural):
            match = re.fullmatch(row["pattern"], name)
            if match is None:
                continue
            fields = {**row, **match.groupdict(), "benchmark": name}
            values = [value_of(bench, column, fields) for column in columns]
            if any(value is not None for value in values):
                yield [label.format(**fields) for label in row["labels"]] + list(map(three_digits, values))


def table(bench: Bench, spec: Spec) -> Table:
    """A table of bench.toml; empty if nothing was measured."""
    if "growth" in spec:
        header = ["benchmark", "fit", "of the unit, ns", "error of the fit"]
        rows = [
            [name, c["order"], three_digits(c["coefficient_ns"]), f"{c['rms_percent']:.0f} %"]
            for name, c in bench.complexities.items()
            if re.fullmatch(spec["growth"], name)
        ]
    else:
        percentiles = [
            {"header": name, "of": "{benchmark}", "metric": f"{{prefix}}_{q}_ns", "factor": 1e-3}
            for q, name in SPEC["quantiles"].items()
        ]
        columns = percentiles if spec.get("percentiles") else spec["columns"]
        header = spec["header"] + [column["header"] for column in columns]
        rows = list(rows_of(bench, spec, columns))
    return Table(spec.get("title", ""), header, rows, numbers=True)


def write(folder: str) -> None:
    """Writes report.md. Raises InputError."""
    bench = Bench(folder)
    drawn = figures.draw(bench)
    sections = []
    for spec in SPEC["section"]:
        tables = [found for found in (table(bench, entry) for entry in spec["table"]) if found.rows]
        figure = spec["figure"] if spec.get("figure") in drawn else ""
        if tables:
            sections.append({"title": spec["title"], "figure": figure, "tables": tables})
    path = Path(folder) / "report.md"
    write_file(path, render("bench.md", "md", {"bench": bench, "bars": bars(bench), "sections": sections}))
    print(path)
