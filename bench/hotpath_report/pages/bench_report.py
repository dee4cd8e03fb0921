# SPDX-License-Identifier: Apache-2.0
"""Report of one `hotpath bench` folder: report.md from bench.json, as specified in bench.toml. Every
number is the median over the repetitions."""

from pathlib import Path

from markupsafe import Markup

from hotpath_report.bench_data import SPEC, TIME, Bench, Spec, three_digits
from hotpath_report.pages.text import render
from hotpath_report.pages.writer import Table
from hotpath_report.tables import write_file


def value_of(bench: Bench, spec: Spec, each: str) -> float | None:
    """The value of a bar; None if not measured."""
    metric = spec.get("metric", TIME)
    found = bench.matching(spec["of"].format(each=each), metric)
    if not found:
        return None
    value = 1 / max(found) if spec.get("inverse") else max(found)
    if "over" in spec:
        yardstick = bench.medians.get((spec["over"], metric)) or bench.medians.get((spec["over"], TIME))
        return value / yardstick if yardstick else None
    return value * float(spec.get("factor", 1))


def bars(bench: Bench) -> Table:
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
                value = value_of(bench, of, each)
                if value is not None:
                    verdict = "" if limit is None else "met" if value <= limit else Markup("**not met**")
                    rows.append(
                        [what.format(each=each), three_digits(value), "" if limit is None else limit, verdict]
                    )
    return Table("Against the bar", ["what", "measured", "bar", ""], rows, numbers=True)


def write(folder: str) -> None:
    """Writes report.md. Raises InputError."""
    bench = Bench(folder)
    path = Path(folder) / "report.md"
    write_file(path, render("bench.md", "md", {"bench": bench, "bars": bars(bench)}))
    print(path)
