# SPDX-License-Identifier: Apache-2.0
"""Percentiles with bootstrap intervals, rank tests and effect sizes.

What is resampled are whole repetitions: samples of one repetition follow one another and are no independent draws. A
single repetition is cut into blocks of consecutive samples, which are resampled instead. Quantiles interpolate between
order statistics, as in summary.json.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats

CONFIDENCE = 0.95
RESAMPLES = 1000
SEED = 20250506
BLOCKS = 20
LEAST_FOR_BLOCKS = 4 * BLOCKS
PERCENTILES = (0.5, 0.9, 0.99, 0.999, 1.0)
PERCENTILE_NAMES = {0.5: "p50", 0.9: "p90", 0.99: "p99", 0.999: "p99.9", 1.0: "max"}


@dataclass(frozen=True)
class Estimate:
    value: float
    low: float = math.nan
    high: float = math.nan

    @property
    def has_interval(self):
        return not math.isnan(self.low)

    def text(self, digits):
        value = f"{self.value:.{digits}f}"
        return value + (f" [{self.low:.{digits}f}, {self.high:.{digits}f}]" if self.has_interval else "")

    def excludes(self, value):
        return self.has_interval and not self.low <= value <= self.high


class Samples:
    """Samples of one quantity, repetition by repetition, each in the order of time."""

    def __init__(self, repetitions, exact=False):
        """`exact`: a single repetition of a deterministic simulation, which has no sampling error."""
        self.repetitions = [np.asarray(r, dtype=float) for r in repetitions if len(r)]
        self.exact = exact and len(self.repetitions) == 1
        self._pooled = None
        self._resampled = None

    def __len__(self):
        return sum(len(r) for r in self.repetitions)

    def pooled(self):
        if self._pooled is None:
            self._pooled = np.sort(np.concatenate(self.repetitions))
        return self._pooled

    def quantile(self, p):
        return float(np.quantile(self.pooled(), p))

    def middle_worst(self):
        """Median of the repetitions' largest samples, which a single disturbed repetition does not move."""
        return float(np.median([r.max() for r in self.repetitions]))

    def units(self):
        """What is resampled: repetitions, or blocks of the only one; empty where there is too little."""
        if len(self.repetitions) > 1:
            return self.repetitions
        if self.exact or len(self) < LEAST_FOR_BLOCKS:
            return []
        return np.array_split(self.repetitions[0], BLOCKS)

    def resampled(self):
        """Quantiles PERCENTILES of each resample, one row each; None where nothing can be resampled."""
        if self._resampled is None:
            units = self.units()
            if not units:
                return None
            values = np.concatenate(units)
            owner = np.repeat(np.arange(len(units)), [len(u) for u in units])
            order = np.argsort(values, kind="stable")
            values, owner = values[order], owner[order]
            generator = np.random.default_rng(SEED)
            rows, seen = [], {}
            for _ in range(RESAMPLES):
                counts = np.bincount(generator.integers(len(units), size=len(units)), minlength=len(units))
                key = counts.tobytes()
                if key not in seen:
                    seen[key] = weighted_quantiles(values, counts[owner])
                rows.append(seen[key])
            self._resampled = np.array(rows)
        return self._resampled

    def estimate(self, p):
        return with_interval(self.quantile(p), column(self.resampled(), p))


def weighted_quantiles(values, weights):
    """PERCENTILES of values that occur `weights` times each; values ascend."""
    upto = np.cumsum(weights)
    places = (upto[-1] - 1) * np.array(PERCENTILES)
    low = np.floor(places).astype(int)
    share = places - low
    high = np.minimum(low + 1, upto[-1] - 1)
    below, above = (values[np.searchsorted(upto, rank, side="right")] for rank in (low, high))
    return below + share * (above - below)


def column(resampled, p):
    return None if resampled is None else resampled[:, PERCENTILES.index(p)]


def with_interval(value, resamples):
    if resamples is None:
        return Estimate(value)
    tail = (1 - CONFIDENCE) / 2
    low, high = np.quantile(resamples, [tail, 1 - tail])
    return Estimate(value, float(low), float(high))


def combined(a, b, p, operation):
    """An operation of the same quantile of two independent groups of samples."""
    value = operation(a.quantile(p), b.quantile(p))
    of_a, of_b = column(a.resampled(), p), column(b.resampled(), p)
    if of_a is None and of_b is None:
        return Estimate(value)
    # Both draw from the same seed; a permutation makes them independent.
    if of_b is not None:
        of_b = np.random.default_rng(SEED + 1).permutation(of_b)
    of_a = a.quantile(p) if of_a is None else of_a
    of_b = b.quantile(p) if of_b is None else of_b
    with np.errstate(divide="ignore", invalid="ignore"):
        return with_interval(value, operation(of_a, of_b))


def ratio(a, b, p):
    return combined(a, b, p, lambda x, y: x / y)


def difference(a, b, p):
    return combined(a, b, p, lambda x, y: x - y)


@dataclass(frozen=True)
class RankTest:
    """Mann and Whitney's test of `a` against `b`."""

    p_value: float
    superiority: float  # probability that a sample of `a` is smaller than one of `b`, ties counting half
    cliffs_delta: Estimate  # of `b` over `a`: 1 when every sample of `b` is the larger, 0 when neither is

    @property
    def magnitude(self):
        """Conventional words for the size of Cliff's delta (Romano et al. 2006)."""
        size = abs(self.cliffs_delta.value)
        return "negligible" if size < 0.147 else "small" if size < 0.33 else "medium" if size < 0.474 else "large"


def rank_test(a, b):
    """Whether samples of `a` are smaller than those of `b`, and by how much of the way."""
    pairs = stats.mannwhitneyu(a.pooled(), b.pooled(), alternative="two-sided")
    superiority = 1 - float(pairs.statistic) / (len(a) * len(b))
    units_a, units_b = a.units() or a.repetitions, b.units() or b.repetitions
    wins = np.array([[wins_of(x, y) for y in units_b] for x in units_a])
    sizes = np.outer([len(x) for x in units_a], [len(y) for y in units_b])
    delta = 2 * superiority - 1
    if len(units_a) < 2 and len(units_b) < 2:
        return RankTest(float(pairs.pvalue), superiority, Estimate(delta))
    generator = np.random.default_rng(SEED)
    deltas = []
    for _ in range(RESAMPLES):
        x = np.bincount(generator.integers(len(units_a), size=len(units_a)), minlength=len(units_a))
        y = np.bincount(generator.integers(len(units_b), size=len(units_b)), minlength=len(units_b))
        deltas.append(2 * (x @ wins @ y) / (x @ sizes @ y) - 1)
    return RankTest(float(pairs.pvalue), superiority, with_interval(delta, np.array(deltas)))


def wins_of(a, b):
    """Pairs in which a sample of `a` is smaller than one of `b`, ties counting half."""
    b = np.sort(b)
    return float(np.sum(len(b) - (np.searchsorted(b, a, side="left") + np.searchsorted(b, a, side="right")) / 2))
