# SPDX-License-Identifier: Apache-2.0
"""bench.json of one `hotpath bench` folder, and report.md from it, as specified in bench.toml. bench.json has the
format of Google Benchmark, whose compare.py therefore compares the times of two folders; `hotpath diff` compares the
other values."""

import math
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from markupsafe import Markup

from hotpath_report.errors import InputError
from hotpath_report.files import read_json, write_file
from hotpath_report.statistics import median

Key = tuple[str, str]  # benchmark and metric
SPEC: dict[str, Any] = tomllib.loads(Path(__file__).with_name("bench.toml").read_text(encoding="utf-8"))
FILE = "bench.json"
TIME = "time_ns"
NS = {"ns": 1, "us": 1e3, "ms": 1e6, "s": 1e9}
# Numbers of Google Benchmark's own that are no result.
BOOKKEEPING = "family_index per_family_instance_index repetitions repetition_index threads iterations".split()
BOOKKEEPING += ["real_time", "cpu_time"]


def three_digits(value: float) -> str:
    """A number with three significant digits, trailing zeros kept, never with an exponent."""
    return "0" if value <= 0 else f"{value:.{max(0, 2 - math.floor(math.log10(value)))}f}"


def values_of(row: dict[str, Any]) -> Iterator[tuple[Key, float]]:
    """Time (ns) and counters of one row of bench.json; units of counters are the endings of their names."""
    benchmark = row["name"]
    yield (benchmark, TIME), row["real_time"] * NS[row["time_unit"]]
    for metric, value in row.items():
        if isinstance(value, (int, float)) and metric not in BOOKKEEPING:
            yield (benchmark, metric), value


class Bench:
    """bench.json: for each benchmark and metric one value per repetition, and their median."""

    def __init__(self, folder: str | Path) -> None:
        path = Path(folder) / FILE
        content: Any = read_json(path, "hotpath bench")
        self.values: dict[Key, list[float]] = {}
        try:
            self.facts: dict[str, Any] = content["context"]
            self.machine: dict[str, Any] = self.facts["machine"]
            for key, value in (found for row in content["benchmarks"] for found in values_of(row)):
                self.values.setdefault(key, []).append(value)
        except (KeyError, TypeError, AttributeError) as error:
            raise InputError(f"{path}: not written by `hotpath bench`: {error!r}") from None
        if not self.values:
            raise InputError(f"{path}: no measurements, there is nothing to report")
        self.medians = {key: median(values) for key, values in self.values.items()}
        self.partial = self.facts.get("complete") is not True  # some measurements are missing

    def bars(self) -> Iterator[list[Any]]:
        """The rows of bench.toml that were measured: what, value, bar (an upper limit) and verdict."""
        for what, benchmark, metric, over, *bar in SPEC["bars"]:
            name = metric.removeprefix("1 / ")
            found = [
                v for (key, of), v in self.medians.items() if of == name and re.fullmatch(benchmark, key)
            ]
            if isinstance(over, str):
                yardstick = self.medians.get((over, name)) or self.medians.get((over, TIME))
                over = 1 / yardstick if yardstick else 0
            if found and over:
                value = over / max(found) if metric != name else max(found) * over
                verdicts = ["met" if value <= limit else Markup("**not met**") for limit in bar]
                yield [what, three_digits(value), *(bar + verdicts or ["", ""])]


def write(folder: str) -> None:
    """Writes report.md. Raises InputError."""
    from hotpath_report.pages.text import render  # not needed to measure

    bench, path = Bench(folder), Path(folder) / "report.md"
    write_file(path, render("bench.md", "md", {"bench": bench, "bars": list(bench.bars())}))
    print(path)
