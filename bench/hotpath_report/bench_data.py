# SPDX-License-Identifier: Apache-2.0
"""Measurements of one `hotpath bench` folder: bench.json, in the format of Google Benchmark, whose compare.py
therefore compares the times of two folders. `hotpath diff` compares the other values."""

import math
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hotpath_report.errors import InputError
from hotpath_report.statistics import median
from hotpath_report.tables import read_json

Key = tuple[str, str]  # benchmark and metric
Spec = dict[str, Any]  # a table of bench.toml
SPEC: Spec = tomllib.loads(Path(__file__).with_name("bench.toml").read_text(encoding="utf-8"))
FILE = "bench.json"
TIME = "time_ns"
NS = {"ns": 1, "us": 1e3, "ms": 1e6, "s": 1e9}
# Numbers of Google Benchmark's own that are no result.
BOOKKEEPING = "family_index per_family_instance_index repetitions repetition_index threads iterations".split()
BOOKKEEPING += ["real_time", "cpu_time"]
# They say how it was measured, not what.
MODIFIERS = re.compile(r"/(iterations:|manual_time|min_time:|real_time|repeats:)[^/]*")


def three_digits(value: float | None) -> str:
    """A number with three significant digits, trailing zeros kept, never with an exponent."""
    if value is None or value <= 0:
        return "" if value is None else "0"
    return f"{value:.{max(0, 2 - math.floor(math.log10(value)))}f}"


def name_of(row: dict[str, Any]) -> str:
    """The benchmark of one row of Google Benchmark."""
    return MODIFIERS.sub("", row["run_name"])


def values_of(row: dict[str, Any]) -> Iterator[tuple[Key, float]]:
    """Time (ns) and counters of one row; units of counters are the endings of their names."""
    benchmark = name_of(row)
    yield (benchmark, TIME), row["real_time"] * NS[row["time_unit"]]
    for metric, value in row.items():
        if isinstance(value, (int, float)) and metric not in BOOKKEEPING:
            yield (benchmark, metric), value


class Bench:
    """bench.json: for each benchmark and metric one value per repetition."""

    def __init__(self, folder: str | Path) -> None:
        path = Path(folder) / FILE
        content: Any = read_json(path, "hotpath bench")
        self.values: dict[Key, list[float]] = {}
        try:
            self.facts: dict[str, Any] = content["context"]
            self.machine: dict[str, Any] = self.facts["machine"]
            for row in content["benchmarks"]:
                for key, value in values_of(row):
                    self.values.setdefault(key, []).append(value)
        except (KeyError, TypeError, AttributeError) as error:
            raise InputError(f"{path}: not written by `hotpath bench`: {error!r}") from None
        if not self.values:
            raise InputError(f"{path}: no measurements, there is nothing to report")
        self.medians = {key: median(values) for key, values in self.values.items()}
        self.partial = self.facts.get("complete") is not True  # some measurements are missing

    def matching(self, pattern: str, metric: str = TIME) -> list[float]:
        """The medians of every benchmark whose full name matches."""
        return [
            value
            for (name, its), value in self.medians.items()
            if its == metric and re.fullmatch(pattern, name)
        ]

    def where(self) -> str:
        """The machine."""
        m = self.machine
        return f"{m['cpu_model']}, {m['processors']} cores · Linux {m['kernel']} · {m['compiler']} {m['build_type']}"
