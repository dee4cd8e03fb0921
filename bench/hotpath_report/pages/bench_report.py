# SPDX-License-Identifier: Apache-2.0
"""Report of one `hotpath bench` folder: reads bench.json, writes report.md and its pictures, as bench.toml says.

Every number is the median over the repetitions.
"""

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hotpath_report.figures import bench as figures
from hotpath_report.pages.bench_data import Bench, three_digits
from hotpath_report.pages.writer import Table, environment
from hotpath_report.tables import write_file

Spec = dict[str, Any]  # a table of bench.toml
SPEC: Spec = tomllib.loads(Path(__file__).with_name("bench.toml").read_text(encoding="utf-8"))


def natural(name: str) -> list[Any]:
    """Sorts numbers in names by their values."""
    return [(0, int(part), "") if part.isdigit() else (1, 0, part) for part in re.split(r"(\d+)", name)]


def value_of(bench: Bench, spec: Spec, fields: Spec) -> float | None:
    """The value of a column or bar; None where it was not measured."""
    if "ros2_callback_us" in spec:
        us: float | None = SPEC["ros2_callback_us"].get(spec["ros2_callback_us"].format(**fields))
        return us
    metric = spec.get("metric", "time_ns").format(**fields)
    found = bench.matching(spec["of"].format(**fields), metric).values()
    if not found:
        return None
    value = 1 / max(found) if spec.get("inverse") else max(found)
    if "over" in spec:
        yardstick = bench.median(spec["over"].format(**fields), metric) or bench.median(
            spec["over"].format(**fields)
        )
        return value / yardstick if yardstick else None
    return value * float(spec.get("factor", 1))


def bars(bench: Bench) -> Table | None:
    """What was measured against its bar."""
    rows = []

    def add(what: str, value: float | None, bar: float | None) -> None:
        if value is not None:
            verdict = "" if bar is None else "met" if value <= bar else "**not met**"
            rows.append([what, three_digits(value), "" if bar is None else bar, verdict])

    for spec in SPEC["bar"]:
        plain = {key: value for key, value in spec.items() if "and" not in spec or key != "over"}
        for each in spec.get("each", [""]):
            fields = {"each": each}
            bar = spec.get("bar")
            if "ros2_share" in spec:
                bar = spec["ros2_share"] * SPEC["ros2_callback_us"][each]
            add(spec["what"].format(**fields), value_of(bench, plain, fields), bar)
            if "and" in spec:
                add(spec["and"].format(**fields), value_of(bench, spec, fields), spec.get("over_bar"))
    return Table("Against the bar", ["what", "measured", "bar", ""], rows, numbers=True) if rows else None


def columns_of(spec: Spec) -> list[Spec]:
    """Those that a table states, or percentiles in µs."""
    if not spec.get("percentiles"):
        columns: list[Spec] = spec["columns"]
        return columns
    return [
        {"header": name, "of": "{benchmark}", "metric": f"{{prefix}}_{q}_ns", "factor": 1e-3}
        for q, name in SPEC["quantiles"].items()
    ]


def rows_of(bench: Bench, spec: Spec) -> Iterator[list[str]]:
    """Rows of which something was measured."""
    for row in spec["rows"]:
        for name in sorted(bench.names, key=natural):
            match = re.fullmatch(row["pattern"], name)
            if match is None:
                continue
            fields = {**row, **match.groupdict(), "benchmark": name}
            values = [value_of(bench, column, fields) for column in columns_of(spec)]
            if any(value is not None for value in values):
                yield [label.format(**fields) for label in row["labels"]] + list(map(three_digits, values))


def table(bench: Bench, spec: Spec) -> Table | None:
    """A table of bench.toml, unless nothing of it was measured."""
    if "growth" in spec:
        header = ["benchmark", "fit", "of the unit, ns", "error of the fit"]
        rows = [
            [name, c["order"], three_digits(c["coefficient_ns"]), f"{c['rms_percent']:.0f} %"]
            for name, c in bench.complexities.items()
            if re.fullmatch(spec["growth"], name)
        ]
    else:
        header = spec["header"] + [column["header"] for column in columns_of(spec)]
        rows = list(rows_of(bench, spec))
    return Table(spec.get("title", ""), header, rows, numbers=True) if rows else None


def write(folder: str) -> None:
    """Writes report.md. Raises InputError."""
    bench = Bench(folder)
    drawn = figures.draw(bench)
    sections = []
    for spec in SPEC["section"]:
        tables = [found for found in (table(bench, entry) for entry in spec["table"]) if found]
        if tables:
            figure = spec.get("figure")
            sections.append(
                {"title": spec["title"], "figure": figure if figure in drawn else "", "tables": tables}
            )
    template = environment().get_template("bench.md.j2")
    path = Path(folder) / "report.md"
    write_file(path, template.render(bench=bench, bars=bars(bench), sections=sections))
    print(path)
