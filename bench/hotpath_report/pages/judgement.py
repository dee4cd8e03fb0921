# SPDX-License-Identifier: Apache-2.0
"""Whether latencies and losses became worse, beyond noise.

Repetitions are the unit: Welch's test compares the logarithms of their quantiles, or their numbers of losses.
Holm's correction keeps the probability of any false alarm among all comparisons below ALARM_RATE.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hotpath_report.errors import InputError
from hotpath_report.pages.compare import Key
from hotpath_report.statistics import PERCENTILES, Estimate, Samples, ratio

ALARM_RATE = 0.01
LEAST_EFFECT = 0.02  # a latency that grew by less is not worth an alarm, however sure
LEAST_REPETITIONS = 3
JUDGED = (0.5, 0.99)
LOSSES = "lost jobs and samples"

Counts = Mapping[Key, Any]  # of each repetition


@dataclass
class Judgement:
    """One comparison. Values are milliseconds, or losses a repetition; the effect is a ratio, or a difference."""

    what: str
    measure: str
    old: float
    new: float
    effect: float
    interval: Estimate | None
    p: float  # that it did not become worse
    worth_telling: bool
    adjusted: float = 1.0

    @property
    def worse(self) -> bool:
        """Whether it became worse beyond noise."""
        return self.worth_telling and self.adjusted < ALARM_RATE

    @property
    def lost(self) -> bool:
        """Whether it counts losses."""
        return self.measure == LOSSES

    def effect_text(self) -> str:
        """With its sign."""
        return f"{self.effect:+.3g}" if self.lost else f"{100 * (self.effect - 1):+.1f} %"

    def interval_text(self) -> str:
        """In the unit of the effect."""
        if self.interval is None or not self.interval.has_interval:
            return ""
        return f"[{100 * (self.interval.low - 1):+.1f}, {100 * (self.interval.high - 1):+.1f}] %"

    def cells(self) -> list[str]:
        """A row of the table."""
        values = [f"{v:.3g}" if self.lost else f"{v:.3f}" for v in (self.old, self.new)]
        verdict = "WORSE" if self.worse else "not worse"
        return [
            self.what,
            self.measure,
            *values,
            self.effect_text(),
            self.interval_text(),
            f"{self.adjusted:.2g}",
            verdict,
        ]


def p_worse(old: Any, new: Any, exact: bool) -> float:
    """Probability of so much larger values in `new` were there no difference (Welch 1947, one-sided)."""
    from scipy import stats  # takes half a second, which the tables of others do not need

    if exact or np.ptp(old) == np.ptp(new) == 0:
        return 0.0 if np.mean(new) > np.mean(old) * (1 + 1e-9) else 1.0
    return float(stats.ttest_ind(new, old, equal_var=False, alternative="greater").pvalue)


def holm(judgements: Sequence[Judgement]) -> None:
    """Fills in the adjusted probabilities (Holm 1979)."""
    largest = 0.0
    for i, judgement in enumerate(sorted(judgements, key=lambda j: j.p)):
        largest = max(largest, min(1.0, (len(judgements) - i) * judgement.p))
        judgement.adjusted = largest


def check_repetitions(name: str, *sides: Samples) -> bool:
    """Whether both sides are exact. Raises InputError where there are too few repetitions to judge."""
    if all(side.exact for side in sides):
        return True
    fewest = min(len(side.repetitions) for side in sides)
    if fewest < LEAST_REPETITIONS:
        raise InputError(
            f"{name}: a gate needs {LEAST_REPETITIONS} repetitions on each side, and one has {fewest}; measure with"
            " --repetitions 20"
        )
    return False


def logarithms(values: Any) -> Any:
    """Of latencies, which may be 0."""
    return np.log(np.maximum(values, np.finfo(float).tiny))


def judge_latency(name: str, old: Samples, new: Samples, intervals: bool) -> list[Judgement]:
    """The quantiles of one latency."""
    exact = check_repetitions(name, old, new)
    # `exact`, because neither of them needs an interval of its own.
    of_repetitions = [[Samples([r], exact=True) for r in side.repetitions] for side in (old, new)]
    pooled = [Samples([side.pooled], exact=True) for side in (old, new)]
    made = []
    for p in JUDGED:
        before, after = (np.array([r.quantile(p) for r in side]) for side in of_repetitions)
        values = pooled[0].quantile(p), pooled[1].quantile(p)
        grown = values[1] / values[0] if values[0] > 0 else math.inf if values[1] > 0 else 1.0
        compared = (before, after) if exact else tuple(map(logarithms, (before, after)))
        chance = p_worse(compared[0], compared[1], exact)
        interval = ratio(new, old, p) if intervals else None
        worth = grown > 1 + (0 if exact else LEAST_EFFECT)
        made.append(Judgement(name, PERCENTILES[p], *values, grown, interval, chance, worth))
    return made


def judge(
    old: Mapping[Key, Samples],
    new: Mapping[Key, Samples],
    losses: tuple[Counts, Counts],
    intervals: bool = True,
) -> list[Judgement]:
    """All comparisons of what both sides have. Without `intervals` it is much faster."""
    made = []
    for key in sorted(old.keys() & new.keys()):
        made += judge_latency(" ".join(filter(None, key)), old[key], new[key], intervals)
    for key in sorted(losses[0].keys() & losses[1].keys()):
        before, after = list(losses[0][key]), list(losses[1][key])
        exact = len(before) == len(after) == 1
        means = float(np.mean(before)), float(np.mean(after))
        name, more = " ".join(filter(None, key)), means[1] - means[0]
        made.append(Judgement(name, LOSSES, *means, more, None, p_worse(before, after, exact), more > 0))
    holm(made)
    return made
