# SPDX-License-Identifier: Apache-2.0
"""Statistics, computed by `hotpath`. It resamples whole repetitions, because the samples of one
repetition are not independent. A single live repetition is split into blocks of consecutive samples;
a single exact repetition stays whole."""

import bisect
import functools
import math
from collections.abc import Iterable
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hotpath_report.hotpath_command import ask

CONFIDENCE_PERCENT, RESAMPLES, BLOCKS = 95, 2000, 20  # as `hotpath` has them, for texts
PERCENTILES = {0.5: "p50", 0.9: "p90", 0.99: "p99", 0.999: "p99.9", 1.0: "max"}

Values = NDArray[np.float64]


class Estimate(NamedTuple):
    """A value with its 95 % interval, in the unit of the samples; NaN: no interval."""

    value: float
    low: float = math.nan
    high: float = math.nan

    @property
    def has_interval(self) -> bool:
        """Whether there were several repetitions or blocks to resample."""
        return not math.isnan(self.low)

    def above(self, neutral: float) -> bool:
        """Whether the value lies above `neutral` beyond noise; exact values have no noise."""
        return self.value > neutral and not self.low <= neutral <= self.high

    def text(self, digits: int) -> str:
        """`value [low, high]` with `digits` decimals."""
        value = f"{self.value:.{digits}f}"
        return value + (f" [{self.low:.{digits}f}, {self.high:.{digits}f}]" if self.has_interval else "")


def estimate_of(answer: dict[str, Any]) -> Estimate:
    """From JSON, which may lack an interval, and has None in place of no value and of infinite ends."""
    ends = (math.inf if end is None else end for end in answer.get("interval") or ())
    return Estimate(math.nan if answer["value"] is None else answer["value"], *ends)


class Samples:
    """Samples of one quantity (by default in ms) by repetition, each repetition in time order."""

    def __init__(self, repetitions: Iterable[Iterable[float]], exact: bool = False) -> None:
        """`exact`: a single repetition comes from a deterministic simulation and has no sampling
        error."""
        arrays = (np.array(s, dtype=float) for s in repetitions)
        self.repetitions: list[Values] = [r for r in arrays if len(r)]
        self.exact = exact and len(self.repetitions) == 1
        self.pooled: Values = np.concatenate(self.repetitions) if self.repetitions else np.array([])
        self._estimates: dict[float, Estimate] = {}

    def __len__(self) -> int:
        return len(self.pooled)

    @functools.cached_property
    def number(self) -> int:
        """Names these samples in questions to `hotpath`."""
        return int(ask("samples", [r.tolist() for r in self.repetitions], self.exact))

    def estimate(self, p: float) -> Estimate:
        """Quantile at probability `p` (type 7) with its interval."""
        if p not in self._estimates:
            probabilities = list(dict.fromkeys([p, *PERCENTILES]))
            answers = ask("quantiles", self.number, probabilities)
            self._estimates |= zip(probabilities, map(estimate_of, answers))
        return self._estimates[p]

    def curve(self) -> dict[str, Any]:
        """The distribution with its intervals."""
        return ask("curve", self.number) | {"repetitions": len(self.repetitions)}

    def quantile(self, p: float) -> float:
        """Quantile at probability `p` without its interval."""
        return self.estimate(p).value

    def too_few(self) -> bool:
        """Whether a measurement was too short for an interval, and so for a verdict."""
        return not self.exact and not self.estimate(1.0).has_interval

    @property
    def worst(self) -> float:
        """The largest sample."""
        return self.quantile(1.0)

    def middle_worst(self) -> float:
        """Median of the repetitions' largest samples: robust against one disturbed repetition."""
        return median([r.max() for r in self.repetitions])


def grouped(rows: Iterable[dict[str, Any]], *keys: str) -> dict[Any, list[dict[str, Any]]]:
    """The rows by their values of the keys, in order of first appearance."""
    found: dict[Any, list[dict[str, Any]]] = {}
    for row in rows:
        found.setdefault(itemgetter(*keys)(row), []).append(row)
    return found


def total(rows: Iterable[dict[str, Any]], *columns: str) -> list[int]:
    """The sum of each column."""
    return list(map(sum, zip(*map(itemgetter(*columns), rows))))


def median(values: Iterable[float]) -> float:
    """Median without an interval."""
    return Samples([values], exact=True).quantile(0.5)


def percent_of(part: int, whole: int) -> float:
    """Share of a count in percent; 0 of nothing."""
    return 100 * part / whole if whole else 0.0


def ratio(a: Samples, b: Samples, p: float) -> Estimate:
    """Quantile of `a` divided by that of `b`."""
    if b.quantile(p) == 0 < a.quantile(p):
        return Estimate(math.inf)
    return estimate_of(ask("ratio", a.number, b.number, p))


class RankTest(NamedTuple):
    """Rank test of Mann and Whitney of `a` against `b`, with its effect size."""

    p_value: float
    cliffs_delta: Estimate  # 1: every sample of `b` is larger; 0: neither side is larger

    @property
    def magnitude(self) -> str:
        """Conventional name for the size of Cliff's delta (Romano et al. 2006)."""
        place = bisect.bisect((0.147, 0.33, 0.474), abs(self.cliffs_delta.value))
        return ("negligible", "small", "medium", "large")[place]


def rank_test(a: Samples, b: Samples) -> RankTest:
    """Whether the samples of `a` are smaller than those of `b`, and how often."""
    p_value, delta = ask("ranks", a.number, b.number)
    return RankTest(math.nan if p_value is None else p_value, estimate_of(delta))
