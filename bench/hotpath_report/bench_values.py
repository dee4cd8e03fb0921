# SPDX-License-Identifier: Apache-2.0
"""What the benchmark programs measured, and which of it differs between two folders of `hotpath bench`.

Google Benchmark's compare.py compares real_time and cpu_time, but no counters, and most values are
counters. It prints p-values instead of intervals and verdicts."""

import math
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np

from hotpath_report.bench_data import Bench, Key
from hotpath_report.errors import InputError
from hotpath_report.statistics import Estimate, Pairing, Samples, Scale, growth
from hotpath_report.tables import read_json, show_json, text_table

NS = {"ns": 1, "us": 1e3, "ms": 1e6, "s": 1e9}
# Numbers of Google Benchmark's own that are no result.
BOOKKEEPING = "family_index per_family_instance_index repetitions repetition_index threads iterations".split()
BOOKKEEPING += ["real_time", "cpu_time", "items_per_second"]
# They say how it was measured, not what.
MODIFIERS = re.compile(r"/(iterations:|manual_time|min_time:|real_time|repeats:)[^/]*")

# Repetitions that each side needs before a difference can be called one.
LEAST_REPETITIONS = 3
# Probability that an unchanged value counts as a difference.
ALARM_RATE = 0.01
ROUNDING = 1e-9
NOT_COMPARABLE = "not comparable"  # too few repetitions, or values that have no ratio


class BenchValues:
    """For each benchmark and metric one value per repetition. The metric `time_ns` is Google Benchmark's own time per
    iteration; units are the endings of names."""

    def __init__(self) -> None:
        self.figures: dict[Key, list[float]] = {}
        self.complexities: dict[
            str, dict[str, Any]
        ] = {}  # growth as Google Benchmark fits it, of the last repetition
        self.errors: list[str] = []

    def add(self, path: Path) -> list[str]:
        """Adds what one run of a program wrote with --benchmark_out_format=json; returns what failed in it."""
        before = len(self.errors)
        try:
            for row in read_json(path)["benchmarks"]:
                self.add_row(row)
        except (InputError, KeyError, TypeError) as error:
            return [f"{path}: not written by Google Benchmark: {error!r}"]
        return self.errors[before:]

    def add_row(self, row: dict[str, Any]) -> None:
        """Adds one benchmark, or one fit of its growth."""
        benchmark = MODIFIERS.sub("", row["run_name"])
        if row.get("run_type") == "aggregate":
            fit = self.complexities.setdefault(benchmark, {"benchmark": benchmark})
            if row["aggregate_name"] == "BigO":
                scale = NS[row["time_unit"]]
                fit |= {"order": row["big_o"], "coefficient_ns": row["real_coefficient"] * scale}
            elif row["aggregate_name"] == "RMS":
                fit["rms_percent"] = 100 * row["rms"]
        elif row.get("error_occurred"):
            self.errors.append(f"{benchmark}: {row.get('error_message', '')}")
        else:
            found = {"time_ns": row["real_time"] * NS[row["time_unit"]]}
            found |= {k: v for k, v in row.items() if isinstance(v, (int, float)) and k not in BOOKKEEPING}
            self.add_figures(benchmark, found)

    def add_figures(self, benchmark: str, found: dict[str, float]) -> None:
        """Adds values of one repetition, by metric; without a `time_ns` the first is that, too."""
        for metric, value in ({"time_ns": next(iter(found.values()))} | found).items():
            self.figures.setdefault((benchmark, metric), []).append(value)

    def as_json(self) -> dict[str, Any]:
        """As in bench.json."""
        figures = [{"benchmark": b, "metric": m, "values": v} for (b, m), v in sorted(self.figures.items())]
        return {"figures": figures, "complexities": list(self.complexities.values()), "errors": self.errors}


def change(before: list[float], after: list[float]) -> tuple[Estimate | None, str]:
    """The ratio of geometric means, after / before, with its 95 % interval, and the verdict of the quality gate's
    test (statistics.growth), two-sided."""
    for values in (before, after):
        if len(values) < LEAST_REPETITIONS or not all(math.isfinite(v) and v > 0 for v in values):
            return None, NOT_COMPARABLE
    sides = np.array(before, dtype=float), np.array(after, dtype=float)
    found = growth(*sides, Pairing.INDEPENDENT, Scale.RATIO, ALARM_RATE, power=0.9)
    ratio = Estimate(found.growth, found.low, found.high)
    if abs(found.growth - 1) < ROUNDING or ALARM_RATE / 2 < found.p_value < 1 - ALARM_RATE / 2:
        return ratio, "within noise"
    return ratio, "larger" if found.growth > 1 else "smaller"


def compare(before: str, after: str) -> int:
    """Prints a line for each value that both folders have, those beyond noise first and the largest effects first among
    them, and a count; the exit code. Raises InputError."""
    old, new = Bench(before).values, Bench(after).values
    rows: list[tuple[float, list[str]]] = []
    facts: list[dict[str, Any]] = []
    for key in sorted(old.keys() & new.keys()):
        found, verdict = change(old[key], new[key])
        effect = abs(math.log(found.value)) if found and verdict in ("smaller", "larger") else 0
        medians = [Samples([values]).quantile(0.5) for values in (old[key], new[key])]
        ratio = {"ratio": found.value, "ratio_low": found.low, "ratio_high": found.high} if found else {}
        facts.append(
            {"value": " ".join(key), "before": medians[0], "after": medians[1], "verdict": verdict} | ratio
        )
        texts = (f"{value:.1f}" for value in medians)
        rows.append((effect, [" ".join(key), *texts, found.text(3) if found else "", verdict]))
    if not rows:
        raise InputError(f"--compare: {before} and {after} have no value in common")
    rows.sort(key=lambda row: -row[0])
    print(text_table(["value", "before", "after", "ratio [95 % interval]", ""], [cells for _, cells in rows]))
    show_json(facts)
    print(f"{sum(effect > 0 for effect, _ in rows)} of {len(rows)} values differ beyond noise.")
    if unknown := sum(cells[-1] == NOT_COMPARABLE for _, cells in rows):
        needs = f"each side needs {LEAST_REPETITIONS} repetitions and values above zero"
        print(f"note: {unknown} values are not comparable: {needs}.", file=sys.stderr)
    return 0
