# SPDX-License-Identifier: Apache-2.0
"""Quantiles and intervals of repeated samples: a thin client of the C++ statistics.

The C++ library resamples whole repetitions, because the samples of one repetition are not independent. A single live
repetition is handed over in blocks of consecutive samples, a single exact one as it is.
"""

import bisect
import ctypes
import enum
import functools
import math
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hotpath_report import hotpath_command
from hotpath_report.errors import RunError

CONFIDENCE_PERCENT, RESAMPLES = 95, 2000  # of the C++ library
BLOCKS = 20
LEAST_FOR_BLOCKS = 4 * BLOCKS
PERCENTILES = {0.5: "p50", 0.9: "p90", 0.99: "p99", 0.999: "p99.9", 1.0: "max"}

Values = NDArray[np.float64]
_Result = ctypes.c_double * 3


@functools.cache
def library() -> ctypes.CDLL:
    """libhotpath_statistics.so: $HOTPATH_STATISTICS, beside the program, or in ../lib of an installed one."""
    folder = hotpath_command.program().resolve().parent
    name = "libhotpath_statistics.so"
    places = [Path(os.environ.get("HOTPATH_STATISTICS", folder / name)), folder.parent / "lib" / name]
    path = next((p for p in places if p.exists()), None)
    if path is None:
        raise RunError(f"{places[0]} is missing; build it with launch_scripts/build.sh")
    loaded = ctypes.CDLL(str(path))
    loaded.hotpath_samples_new.restype = ctypes.c_void_p
    loaded.hotpath_samples_new.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t]
    loaded.hotpath_samples_delete.argtypes = [ctypes.c_void_p]
    loaded.hotpath_mean.restype = ctypes.c_double
    loaded.hotpath_mean.argtypes = [ctypes.c_void_p]
    loaded.hotpath_quantile_estimate.argtypes = [ctypes.c_void_p, ctypes.c_double, _Result]
    two = [ctypes.c_void_p, ctypes.c_void_p]
    loaded.hotpath_quantile_ratio.argtypes = [*two, ctypes.c_double, ctypes.c_double, _Result]
    loaded.hotpath_quantile_difference.argtypes = [*two, ctypes.c_double, _Result]
    loaded.hotpath_cliffs_delta.argtypes = [*two, _Result]
    side = [ctypes.c_void_p, ctypes.c_size_t]
    kinds = [ctypes.c_int] * 2 + [ctypes.c_double] * 2
    loaded.hotpath_growth.argtypes = [*side, *side, *kinds, ctypes.c_double * len(fields(Growth))]
    loaded.hotpath_holm.argtypes = side
    return loaded


@dataclass(frozen=True)
class Estimate:
    """A value with its 95 % interval, in the unit of the samples; NaN where there is no interval."""

    value: float
    low: float = math.nan
    high: float = math.nan

    @property
    def has_interval(self) -> bool:
        """Whether there were repetitions to resample."""
        return not math.isnan(self.low)

    def text(self, digits: int) -> str:
        """`value [low, high]` with so many decimals."""
        value = f"{self.value:.{digits}f}"
        return value + (f" [{self.low:.{digits}f}, {self.high:.{digits}f}]" if self.has_interval else "")

    def excludes(self, value: float) -> bool:
        """Whether the value lies outside of the interval; never without one."""
        return self.has_interval and not self.low <= value <= self.high


class Samples:
    """Samples of one quantity (ms, unless said otherwise), repetition by repetition, each in the order of time."""

    def __init__(
        self,
        repetitions: Iterable[Iterable[float]],
        exact: bool = False,
        numbers: Iterable[int] | None = None,
    ) -> None:
        """`exact`: a single repetition comes from a deterministic simulation and has no sampling error. `numbers` of
        the repetitions; 0, 1, 2... if left out."""
        arrays = [np.array(s, dtype=float) for s in repetitions]
        kept = [(n, r) for n, r in zip(range(len(arrays)) if numbers is None else numbers, arrays) if len(r)]
        self.numbers: list[int] = [n for n, _ in kept]
        self.repetitions: list[Values] = [r for _, r in kept]
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
        """Quantile at the probability `p` (type 7) with its interval."""
        if p not in self._estimates:
            result = _Result()
            library().hotpath_quantile_estimate(self._handle, p, result)
            self._estimates[p] = Estimate(*result)
        return self._estimates[p]

    def quantile(self, p: float) -> float:
        """Quantile at the probability `p` without an interval."""
        return self.estimate(p).value

    @property
    def mean(self) -> float:
        """Of all samples."""
        return float(library().hotpath_mean(self._handle))

    @property
    def worst(self) -> float:
        """The largest sample."""
        return self.quantile(1.0)

    def middle_worst(self) -> float:
        """Median of the repetitions' largest samples, which a single disturbed repetition does not move."""
        return Samples([[r.max()] for r in self.repetitions]).quantile(0.5)

    def of_two(self, function: str, other: "Samples", *arguments: float) -> Estimate:
        """An estimate that the library's `function` makes of these samples and others."""
        result = _Result()
        getattr(library(), function)(self._handle, other._handle, *arguments, result)
        return Estimate(*result)


def ratio(a: Samples, b: Samples, p: float, confidence: float = CONFIDENCE_PERCENT / 100) -> Estimate:
    """Quantile of `a` divided by that of `b`."""
    return a.of_two("hotpath_quantile_ratio", b, p, confidence)


def difference(a: Samples, b: Samples, p: float) -> Estimate:
    """Quantile of `a` minus that of `b`, in the unit of the samples."""
    return a.of_two("hotpath_quantile_difference", b, p)


class Pairing(enum.IntEnum):
    """How the repetitions of two sides belong together; hotpath::Pairing explains them."""

    INDEPENDENT, PAIRED, EXACT = range(3)


class Scale(enum.IntEnum):
    """What a difference means; hotpath::Scale explains it."""

    DIFFERENCE, RATIO = range(2)


@dataclass(frozen=True)
class Growth:
    """Whether a measure grew; hotpath::GrowthTest explains the fields."""

    before: float
    after: float
    growth: float
    low: float
    high: float
    p_value: float
    exact: float
    detectable: float  # the smallest growth that such repetitions show


def growth(
    before: Values, after: Values, pairing: Pairing, scale: Scale, alarm_rate: float, power: float
) -> Growth:
    """Tests values of repetitions; `alarm_rate` and `power` are those of the detectable growth."""
    result = (ctypes.c_double * len(fields(Growth)))()
    sides = [np.ascontiguousarray(side, dtype=float) for side in (before, after)]
    pointers = [value for side in sides for value in (side.ctypes.data, len(side))]
    library().hotpath_growth(*pointers, pairing, scale, alarm_rate, power, result)
    return Growth(*result)


def holm(p_values: Sequence[float]) -> list[float]:
    """The adjusted p-values."""
    adjusted = np.array(p_values, dtype=float)
    library().hotpath_holm(adjusted.ctypes.data, len(adjusted))
    return [float(p) for p in adjusted]


@dataclass(frozen=True)
class RankTest:
    """Mann and Whitney's test of `a` against `b`, and the size of the effect."""

    p_value: float
    cliffs_delta: Estimate  # 1 when every sample of `b` is the larger, 0 when neither is

    @property
    def magnitude(self) -> str:
        """Conventional words for the size of Cliff's delta (Romano et al. 2006)."""
        place = bisect.bisect((0.147, 0.33, 0.474), abs(self.cliffs_delta.value))
        return ("negligible", "small", "medium", "large")[place]


def rank_test(a: Samples, b: Samples) -> RankTest:
    """Whether samples of `a` are smaller than those of `b`, and by how much of the way."""
    from scipy import stats  # takes half a second, which most figures do not need

    test = stats.mannwhitneyu(a.pooled, b.pooled, alternative="two-sided")
    return RankTest(float(test.pvalue), a.of_two("hotpath_cliffs_delta", b))
