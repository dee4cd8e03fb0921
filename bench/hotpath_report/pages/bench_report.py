# SPDX-License-Identifier: Apache-2.0
"""Report of one `hotpath bench` folder: report.md and its figures from bench.json, as specified in
bench.toml. Every number is the median over the repetitions."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from hotpath_report import style
from hotpath_report.bench_data import SPEC, Bench, Spec, three_digits
from hotpath_report.hotpath_command import executor_named
from hotpath_report.pages.text import render
from hotpath_report.pages.writer import Table
from hotpath_report.style import SERIES
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


def duration(ns: float, _position: int | None = None) -> str:
    """A tick in the largest unit of which it has at least one: `20 µs`."""
    units = [(size, unit) for size, unit in ((1e9, "s"), (1e6, "ms"), (1e3, "µs")) if ns >= size]
    size, unit = units[0] if units else (1, "ns")
    return f"{ns / size:g} {unit}"


def draw_lines(axes: Axes, bench: Bench, pattern: str, metric: str) -> bool:
    """Draws medians (ns) on logarithmic axes; returns whether there was data."""
    lines: dict[str, list[tuple[int, float]]] = {}
    for (name, x, *who), value in bench.matching(pattern, metric).items():
        label = name.removeprefix("fastdds_") + (" (raw)" if who == ["raw_fastdds"] else "")
        lines.setdefault(label, []).append((int(x), value))
    for series, (label, points) in zip(SERIES, sorted(lines.items())):
        colour = style.colour_of(label) if executor_named(label) else series
        axes.loglog(*zip(*sorted(points)), "o-", color=colour, label=label, markersize=4)
    axes.margins(y=0.25)
    low, high = axes.get_ylim()
    axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if high < 100 * low else (1,)))
    for axis, text in ((axes.xaxis, "{x:g}"), (axes.yaxis, FuncFormatter(duration))):
        axis.set_major_formatter(text)
        axis.set_minor_formatter(NullFormatter())
    if lines:
        axes.legend(fontsize=8, ncol=2, loc="upper left")
    return bool(lines)


def draw_hot_path(bench: Bench) -> bool:
    """Draws each repetition's median on the reference system; returns whether there was data."""
    found = bench.matching(r"hot_path/executor:([^/]+)/transport:(.+)", "hot_path_p50_ns")
    if not found:
        return False
    executors, transports = (sorted(set(names)) for names in zip(*found))
    figure, (axes,) = style.new_figure(8, 0.6 + 0.45 * len(executors))
    style.rows_of_labels(axes, executors)
    markers = dict(zip(transports, "os^D"))
    for executor, transport in found:
        name = f"hot_path/executor:{executor}/transport:{transport}"
        medians = [v / 1e6 for v in bench.values[name, "hot_path_p50_ns"]]
        place = executors.index(executor) + 0.3 * (transports.index(transport) - (len(transports) - 1) / 2)
        look = {"color": style.colour_of(executor), "linestyle": "", "alpha": 0.8}
        axes.plot(medians, [place] * len(medians), marker=markers[transport], **look)
    axes.set(xlim=(0, None), xlabel="median latency of each repetition (ms)")
    style.add_key(figure, [style.dot(t, marker) for t, marker in markers.items()], 6)
    style.add_title(figure, "Hot path of the reference system", bench.subtitle(), bench.partial)
    style.save(figure, bench.folder, "bench_hot_path")
    return True


def draw(bench: Bench) -> set[str]:
    """Writes all figures that have data and returns their names."""
    drawn = {"bench_hot_path"} if draw_hot_path(bench) else set()
    for spec in SPEC["figure"]:
        panels = spec["panel"]
        figure, axes = style.new_figure(6 * len(panels), 4.6, 1, len(panels))
        found = [draw_lines(a, bench, panel["of"], panel["metric"]) for a, panel in zip(axes, panels)]
        for a, panel in zip(axes, panels):
            a.set(title=panel["title"], xlabel=panel["x"])
        if any(found):
            style.add_title(figure, spec["title"], bench.subtitle(), bench.partial)
            style.save(figure, bench.folder, spec["name"])
            drawn.add(spec["name"])
    return drawn


def write(folder: str) -> None:
    """Writes report.md. Raises InputError."""
    bench = Bench(folder)
    drawn = draw(bench)
    sections = []
    for spec in SPEC["section"]:
        tables = [found for found in (table(bench, entry) for entry in spec["table"]) if found.rows]
        figure = spec["figure"] if spec.get("figure") in drawn else ""
        if tables:
            sections.append({"title": spec["title"], "figure": figure, "tables": tables})
    path = Path(folder) / "report.md"
    write_file(path, render("bench.md", "md", {"bench": bench, "bars": bars(bench), "sections": sections}))
    print(path)
