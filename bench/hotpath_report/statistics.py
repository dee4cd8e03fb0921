# SPDX-License-Identifier: Apache-2.0
"""Statistics, computed by the C++ library. It resamples whole repetitions, because the
samples of one repetition are not independent. A single live repetition is split into blocks of
consecutive samples; a single exact repetition stays whole."""

import bisect
import ctypes
import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hotpath_report.hotpath_command import library

CONFIDENCE_PERCENT, RESAMPLES = 95, 2000  # of the C++ library
BLOCKS = 20
LEAST_FOR_BLOCKS = 4 * BLOCKS
PERCENTILES = {0.5: "p50", 0.9: "p90", 0.99: "p99", 0.999: "p99.9", 1.0: "max"}

Values = NDArray[np.float64]


def results(number: int, function: str, *arguments: object) -> list[float]:
    """The numbers that the library's `function` writes behind its last argument."""
    found = (ctypes.c_double * number)()
    getattr(library(), f"hotpath_{function}")(*arguments, found)
    return list(found)


class Estimate(NamedTuple):
    """A value with its 95 % interval, in the unit of the samples; NaN: no interval."""

    value: float
    low: float = math.nan
    high: float = math.nan

    @property
    def has_interval(self) -> bool:
        """Whether there were several repetitions or blocks to resample."""
        return not math.isnan(self.low)

    def text(self, digits: int) -> str:
        """`value [low, high]` with `digits` decimals."""
        value = f"{self.value:.{digits}f}"
        return value + (f" [{self.low:.{digits}f}, {self.high:.{digits}f}]" if self.has_interval else "")

    def excludes(self, value: float) -> bool:
        """Whether the value lies outside the interval; false without an interval."""
        return self.has_interval and not self.low <= value <= self.high


class Samples:
    """Samples of one quantity (by default in ms) by repetition, each repetition in time order."""

    def __init__(self, repetitions: Iterable[Iterable[float]], exact: bool = False) -> None:
        """`exact`: a single repetition comes from a deterministic simulation and has no sampling
        error."""
        arrays = (np.array(s, dtype=float) for s in repetitions)
        self.repetitions: list[Values] = [r for r in arrays if len(r)]
        self.exact = exact and len(self.repetitions) == 1
        units = self.repetitions
        if len(units) == 1 and not self.exact and len(units[0]) >= LEAST_FOR_BLOCKS:
            units = np.array_split(units[0], BLOCKS)
        self.resampled = len(units) > 1  # whether estimates have intervals
        self.pooled: Values = np.concatenate(units) if units else np.array([])
        sizes = (ctypes.c_size_t * len(units))(*map(len, units))
        self._handle = library().hotpath_samples_new(self.pooled.ctypes.data, sizes, len(units))
        self._estimates: dict[float, Estimate] = {}

    def __del__(self) -> None:
        if getattr(self, "_handle", None):
            library().hotpath_samples_delete(self._handle)

    def __len__(self) -> int:
        return len(self.pooled)

    def estimate(self, p: float) -> Estimate:
        """Quantile at probability `p` (type 7) with its interval."""
        if p not in self._estimates:
            self._estimates[p] = Estimate(*map(float, self.estimates([p])[0]))
        return self._estimates[p]

    def estimates(self, probabilities: Values | list[float]) -> Values:
        """A row of value, low and high for each probability, from one set of resamples."""
        rows = np.empty((len(probabilities), 3))
        p = np.ascontiguousarray(probabilities, dtype=float)
        library().hotpath_quantile_estimates(self._handle, p.ctypes.data, len(p), rows.ctypes.data)
        return rows

    def quantile(self, p: float) -> float:
        """Quantile at probability `p` without its interval."""
        return self.estimate(p).value

    @property
    def worst(self) -> float:
        """The largest sample."""
        return self.quantile(1.0)

    def middle_worst(self) -> float:
        """Median of the repetitions' largest samples: robust against one disturbed repetition."""
        return median([r.max() for r in self.repetitions])

    def of_two(self, function: str, other: "Samples", *arguments: float) -> Estimate:
        """Estimate of the library's `function` for these samples and others."""
        return Estimate(*results(3, function, self._handle, other._handle, *arguments))


def median(values: Iterable[float]) -> float:
    """Median without an interval."""
    return Samples([values], exact=True).quantile(0.5)


def percent_of(part: int, whole: int) -> float:
    """Share of a count in percent; 0 of nothing."""
    return float(library().hotpath_percent_of(int(part), int(whole)))


def ratio(a: Samples, b: Samples, p: float) -> Estimate:
    """Quantile of `a` divided by that of `b`."""
    return a.of_two("quantile_ratio", b, p)


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
    p_value = float(library().hotpath_rank_test(a._handle, b._handle))
    return RankTest(p_value, a.of_two("cliffs_delta", b))


def fit_line(x: Sequence[float], y: Sequence[float], weights: Sequence[float]) -> tuple[float, float]:
    """Slope and intercept of the weighted least-squares line; one single x: through the origin."""
    columns = [np.ascontiguousarray(column, dtype=float) for column in (x, y, weights)]
    data = [column.ctypes.data for column in columns]
    slope, intercept = results(2, "fit_line", *data, len(columns[0]))
    return slope, intercept
