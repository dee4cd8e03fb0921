# SPDX-License-Identifier: Apache-2.0
"""Whether latencies and losses became worse beyond noise. The unit is the repetition: its mean, median and p99 latency
and its losses are compared by the tests of hotpath/analysis/growth_test.hpp. Simulated repetitions with equal draws
(seed, phases, model of execution times, length) are pairs without noise. Live repetitions are pairs if both builds took
turns; all others are independent. Holm's correction keeps the probability of any false alarm below ALARM_RATE. A chain
or task that has fewer than half of its outputs or jobs in a repetition is worse without a test."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hotpath_report.errors import InputError
from hotpath_report.comparison.sides import EXECUTOR, NOTHING_MS, SOURCE, Key, Side, text_of
from hotpath_report.statistics import PERCENTILES, Growth, Pairing, Samples, Scale, growth, holm

ALARM_RATE = 0.01
POWER = 0.9  # probability of finding a detectable growth
LEAST_EFFECT = 0.02  # smaller growth of a latency raises no alarm, unless it is exact
LEAST_REPETITIONS = 3
MEAN, QUANTILES = "mean", (0.5, 0.99)
LOSSES = "lost jobs and samples"
OUTPUTS, JOBS, REPETITIONS = "outputs", "jobs", "repetitions"
COUNTED = (LOSSES, OUTPUTS, JOBS, REPETITIONS)

Series = Mapping[int, float]  # by number of the repetition


def percent_text(value: float) -> str:
    """A detectable growth; few noisy repetitions can make it very large."""
    return "over 1000 %" if value > 1000 else f"{value:.0f} %" if value >= 10 else f"{value:.1f} %"


@dataclass
class Judgement:
    """One comparison. Latencies (ms) grow by a ratio, counts per repetition by a difference."""

    what: str
    measure: str
    growth: Growth
    pairing: Pairing
    simulated: bool
    adjusted: float = 1.0
    dried_up: bool = False  # dries_up(), or a repetition is missing
    sprang: bool = False  # the opposite

    @property
    def worse(self) -> bool:
        """Whether the measure became worse beyond noise."""
        if self.dried_up or self.adjusted >= ALARM_RATE:
            return self.dried_up
        if self.measure == OUTPUTS:  # one can end after the run
            return self.growth.growth < -max(1, LEAST_EFFECT * self.growth.before)
        return self.exact or self.percent > 100 * LEAST_EFFECT or self.lost

    @property
    def exact(self) -> bool:
        """Whether simulated pairs agree, which rules out noise."""
        return self.pairing == Pairing.EXACT and bool(self.growth.exact)

    @property
    def same(self) -> bool:
        """Whether nothing changed."""
        return self.exact and abs(self.growth.growth - (0 if self.counted else 1)) < NOTHING_MS

    @property
    def lost(self) -> bool:
        """Whether the measure counts losses."""
        return self.measure == LOSSES

    @property
    def counted(self) -> bool:
        """Whether the measure is a count."""
        return self.measure in COUNTED

    @property
    def percent(self) -> float:
        """Growth of a latency in percent."""
        return 100 * (self.growth.growth - 1)

    @property
    def detectable_percent(self) -> float:
        """The smallest detectable growth of a latency in percent; 0: any growth."""
        return 0 if self.exact else 100 * max(self.growth.detectable - 1, LEAST_EFFECT)

    def facts(self) -> dict[str, Any]:
        """The comparison as data: latencies in ms and their growth as a ratio, losses as counts and a difference."""
        names = {
            "before": "before",
            "after": "after",
            "growth": "growth",
            "interval_low": "low",
            "interval_high": "high",
        }
        numbers = {key: getattr(self.growth, name) for key, name in names.items()}
        what = {"what": self.what, "measure": self.measure}
        return what | numbers | {"p_adjusted": self.adjusted, "worse": self.worse}

    def effect_text(self) -> str:
        """The effect with its sign, in percent for a latency."""
        return f"{self.growth.growth:+.3g}" if self.counted else f"{self.percent:+.1f} %"

    def interval_text(self) -> str:
        """The interval in the unit of the effect."""
        low, high = self.growth.low, self.growth.high
        if math.isnan(low):
            return "exact" if self.exact else ""
        if self.counted:
            return f"[{low:+.3g}, {high:+.3g}]"
        return f"[{100 * (low - 1):+.1f}, {100 * (high - 1):+.1f}] %"

    def cells(self) -> list[str]:
        """The row of the table."""
        before, after = (
            f"{v:.4g}" if self.counted else f"{v:.3f}" for v in (self.growth.before, self.growth.after)
        )
        p_value = "0" if self.dried_up else f"{self.adjusted:.2g}"
        detectable = (
            f"{self.growth.detectable:.3g}" if self.counted else percent_text(self.detectable_percent)
        )
        if self.growth.exact and (self.exact or self.counted):
            detectable = "any"
        verdict = "WORSE" if self.worse else "the same" if self.same else "not worse"
        change = self.effect_text(), self.interval_text()
        return [self.what, self.measure, before, after, *change, p_value, detectable, verdict]


def dries_up(before: Series, after: Series, pairing: Pairing) -> bool:
    """Whether less than half of the outputs is left in a repetition, or in one of those that are not pairs compared
    with the least before. A single one can end after the run."""
    least = [(min(before.values()), min(after.values()))]
    pairs = least if pairing == Pairing.INDEPENDENT else [(count, after[n]) for n, count in before.items()]
    return any(old > 0 and (new == 0 or new < min(old / 2, old - 1)) for old, new in pairs)


def measures_of(samples: Samples) -> dict[str, dict[int, float]]:
    """{measure: {repetition: ms}}, all above 0."""
    measures: dict[str, dict[int, float]] = {}
    for number, repetition in zip(samples.numbers, samples.repetitions):
        alone = Samples([repetition], exact=True)  # needs no interval
        values = {MEAN: alone.mean} | {PERCENTILES[p]: alone.quantile(p) for p in QUANTILES}
        for measure, value in values.items():
            measures.setdefault(measure, {})[number] = max(value, NOTHING_MS)
    return measures


class Judge:
    """Compares two sides. `interleaved`: live repetitions were measured in turn."""

    def __init__(self, before: Side, after: Side, interleaved: bool) -> None:
        self.sides, self.interleaved = (before, after), interleaved
        # Planned repetitions on each side of an executor, given by its source, setting and name.
        executors = {key[SOURCE:][:3] for side in self.sides for key in side.outputs}
        self.planned = {
            executor: [
                {n for key, of in side.outputs.items() if key[SOURCE:][:3] == executor for n in of}
                for side in self.sides
            ]
            for executor in sorted(executors)
        }

    def draws_agree(self, executor: str) -> bool:
        """Whether repetitions of an executor with one number on both sides have the same model of execution times, the
        same length, and the same phases of timers that both have."""
        old, new = (side.draws for side in self.sides)
        for key in old.keys() & new.keys():
            (times, first), (new_times, new_first) = old[key], new[key]
            same = times == new_times and all(
                first[t] == new_first[t] for t in first.keys() & new_first.keys()
            )
            if key[0] == executor and not same:
                return False
        return True

    def pairing_of(self, key: Key, old: Series, new: Series) -> Pairing:
        """Pairing of these repetitions. Raises InputError if there are too few to judge."""
        simulated, fewest = key[SOURCE] == "simulated", min(len(old), len(new))
        pairing = Pairing.INDEPENDENT
        if len(old.keys() & new.keys()) == fewest:
            if simulated and (self.interleaved or self.draws_agree(key[EXECUTOR])):
                pairing = Pairing.EXACT
            elif self.interleaved:
                pairing = Pairing.PAIRED
        if pairing != Pairing.EXACT and fewest < LEAST_REPETITIONS:
            remedy = "give both the same --seed, phases and --duration, or" if simulated else "measure with"
            seeds = " of other seeds" if simulated else ""
            needs = f"the gate needs {LEAST_REPETITIONS} repetitions{seeds} on each side"
            raise InputError(f"{text_of(key)}: {needs}, one side has {fewest}; {remedy} --repetitions 20")
        return pairing

    def compare(self, key: Key, measure: str, old: Series, new: Series, tests: int) -> Judgement:
        """One comparison of `tests`, of the common repetitions if these are pairs. Raises InputError."""
        pairing = self.pairing_of(key, old, new)
        if pairing != Pairing.INDEPENDENT:
            common = sorted(old.keys() & new.keys())
            old, new = ({n: side[n] for n in common} for side in (old, new))
        fewer_is_worse = measure in (OUTPUTS, JOBS)
        sign = -1.0 if fewer_is_worse else 1.0
        before, after = (sign * np.array(list(side.values())) for side in (old, new))
        scale = Scale.DIFFERENCE if measure in COUNTED else Scale.RATIO
        found = growth(before, after, pairing, scale, ALARM_RATE / tests, POWER)
        made = Judgement(text_of(key), measure, found, pairing, key[SOURCE] == "simulated")
        if fewer_is_worse:  # back to the sign of the counts
            changed = {name: -getattr(found, name) + 0.0 for name in ("before", "after", "growth")}  # no -0
            made.growth = replace(found, **changed, low=-found.high, high=-found.low)
            made.dried_up, made.sprang = dries_up(old, new, pairing), dries_up(new, old, pairing)
        return made

    def series(self) -> Iterator[tuple[Key, str, Series, Series]]:
        """Everything to compare, by repetition."""
        before, after = self.sides
        for key in sorted(before.samples.keys() & after.samples.keys()):
            grown = measures_of(after.samples[key])
            for measure, values in measures_of(before.samples[key]).items():
                yield key, measure, values, grown[measure]
        for key in sorted(before.losses.keys() & after.losses.keys()):
            yield key, LOSSES, before.losses[key], after.losses[key]
        for key in sorted(before.outputs.keys() | after.outputs.keys()):
            planned = zip(self.sides, self.planned[key[SOURCE:][:3]])
            old, new = (side.outputs.get(key, dict.fromkeys(numbers, 0.0)) for side, numbers in planned)
            if old and new and (any(old.values()) or any(new.values())):  # else an executor did not run
                yield key, JOBS if key[0] == "response" else OUTPUTS, old, new

    def repetitions(self) -> Iterator[Judgement]:
        """Executors with a repetition that the other side does not have."""
        for executor, (old, new) in self.planned.items():
            simulated, fewest = executor[0] == "simulated", min(len(old), len(new))
            paired = (simulated or self.interleaved) and len(old & new) == fewest
            if old != new and (paired or not fewest):
                before, after = map(float, (len(old), len(new)))
                change = Growth(before, after, after - before, math.nan, math.nan, 1.0, True, 0.0)
                pairing = Pairing.EXACT if simulated else Pairing.PAIRED
                gone = bool(old - new)
                yield Judgement(" ".join(executor), REPETITIONS, change, pairing, simulated, dried_up=gone)


def judge(before: Side, after: Side, interleaved: bool = False) -> list[Judgement]:
    """All comparisons of two sides; a task's jobs only where one side has hardly any."""
    both = Judge(before, after, interleaved)
    series = list(both.series())
    tests = max(1, sum(measure != JOBS for _, measure, _, _ in series))
    made = [both.compare(*one, tests) for one in series]
    tested = [j for j in made if j.measure != JOBS]
    for judgement, adjusted in zip(tested, holm([j.growth.p_value for j in tested])):
        judgement.adjusted = adjusted
    shown = tested + [j for j in made if j.measure == JOBS and (j.dried_up or j.sprang)]
    return shown + list(both.repetitions())
