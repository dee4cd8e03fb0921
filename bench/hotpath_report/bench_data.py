# SPDX-License-Identifier: Apache-2.0
"""Measurements of one `hotpath bench` folder."""

import math
import re
import tomllib
from pathlib import Path
from typing import Any

from hotpath_report.errors import InputError
from hotpath_report.statistics import median
from hotpath_report.tables import read_json

Key = tuple[str, str]  # benchmark and metric
Spec = dict[str, Any]  # a table of bench.toml
SPEC: Spec = tomllib.loads(Path(__file__).with_name("bench.toml").read_text(encoding="utf-8"))


def three_digits(value: float | None) -> str:
    """A number with three significant digits, trailing zeros kept, never with an exponent."""
    if value is None or value <= 0:
        return "" if value is None else "0"
    return f"{value:.{max(0, 2 - math.floor(math.log10(value)))}f}"


class Bench:
    """bench.json; times in ns."""

    def __init__(self, folder: str) -> None:
        self.folder = Path(folder)
        path = self.folder / "bench.json"
        self.facts: dict[str, Any] = read_json(path, "hotpath bench")
        try:
            figures = self.facts["figures"]
            self.values: dict[Key, list[float]] = {
                (f["benchmark"], f["metric"]): f["values"] for f in figures
            }
            self.complexities = {c["benchmark"]: c for c in self.facts["complexities"]}
            self.machine = self.facts["machine"]
        except (KeyError, TypeError) as error:
            raise InputError(f"{path}: not written by `hotpath bench`: {error!r}") from None
        if not self.values:
            raise InputError(f"{path}: no figures, there is nothing to report")
        self.medians = {key: median(values) for key, values in self.values.items() if values}
        self.partial = self.facts.get("complete") is not True  # some measurements are missing

    def matching(self, pattern: str, metric: str = "time_ns") -> dict[tuple[str, ...], float]:
        """{groups of the pattern: median} of every benchmark whose full name matches."""
        return {
            match.groups(): median
            for (benchmark, its_metric), median in self.medians.items()
            if its_metric == metric and (match := re.fullmatch(pattern, benchmark))
        }

    def where(self) -> str:
        """The machine."""
        m = self.machine
        return f"{m['cpu_model']}, {m['processors']} cores · Linux {m['kernel']} · {m['compiler']} {m['build_type']}"

    def subtitle(self) -> str:
        """Subtitle of the figures."""
        return f"{self.where()}\n{self.facts['date']} · {self.facts['repetitions']} repetitions"
