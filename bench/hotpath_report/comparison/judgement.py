# SPDX-License-Identifier: Apache-2.0
"""Whether latencies and losses became worse beyond noise. The unit is the repetition: its mean,
median and p99 latency and its losses are compared by the tests of hotpath/analysis/growth_test.hpp.
Simulated repetitions with equal draws (seed, phases, model of execution times, length) are pairs without
noise. Live repetitions are pairs if both builds took turns; all others are independent. Holm's
correction keeps the probability of any false alarm below ALARM_RATE. A chain or task that has fewer
than half of its outputs or jobs in a repetition is worse without a test."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hotpath_report.errors import InputError
from hotpath_report.comparison.sides import EXECUTOR, NOTHING_MS, SOURCE, Draws, Key, Side
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
        if self.measure == OUTPUTS:
            return self.growth.growth < -max(
                1, LEAST_EFFECT * self.growth.before
            )  # one can end after the run
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
        """The comparison as data: latencies in ms and their growth as a ratio, losses as counts and
        a difference."""
        growth = self.growth
        numbers = {"before": growth.before, "after": growth.after, "growth": growth.growth}
        numbers |= {"interval_low": growth.low, "interval_high": growth.high, "p_adjusted": self.adjusted}
        return {"what": self.what, "measure": self.measure} | numbers | {"worse": self.worse}

    def effect_text(self) -> str:
        """The effect with its sign."""
        return f"{self.growth.growth:+.3g}" if self.counted else f"{self.percent:+.1f} %"

    def interval_text(self) -> str:
        """The interval in the unit of the effect."""
        ends = self.growth.low, self.growth.high
        if np.isnan(ends[0]):
            return "exact" if self.exact else ""
        if self.counted:
            return f"[{ends[0]:+.3g}, {ends[1]:+.3g}]"
        return f"[{100 * (ends[0] - 1):+.1f}, {100 * (ends[1] - 1):+.1f}] %"

    def detectable_text(self) -> str:
        """The detectable effect in its unit."""
        if self.growth.exact and (self.exact or self.counted):
            return "any"
        return f"{self.growth.detectable:.3g}" if self.counted else percent_text(self.detectable_percent)

    def cells(self) -> list[str]:
        """The row of the table."""
        values = [f"{v:.4g}" if self.counted else f"{v:.3f}" for v in (self.growth.before, self.growth.after)]
        return [
            self.what,
            self.measure,
            *values,
            self.effect_text(),
            self.interval_text(),
            "0" if self.dried_up else f"{self.adjusted:.2g}",
            self.detectable_text(),
            "WORSE" if self.worse else "the same" if self.same else "not worse",
        ]


def pairing_of(
    name: str, simulated: bool, interleaved: bool, old: Sequence[int], new: Sequence[int], same_draws: bool
) -> Pairing:
    """Pairing of these repetitions. Raises InputError if there are too few to judge."""
    common, fewest = len(set(old) & set(new)), min(len(old), len(new))
    pairing = Pairing.INDEPENDENT
    if common == fewest and (simulated and same_draws or interleaved):
        pairing = Pairing.EXACT if simulated else Pairing.PAIRED
    if pairing != Pairing.EXACT and fewest < LEAST_REPETITIONS:
        remedy = "give both the same --seed, phases and --duration, or" if simulated else "measure with"
        seeds = " of other seeds" if simulated else ""
        needs = f"the gate needs {LEAST_REPETITIONS} repetitions{seeds} on each side"
        raise InputError(f"{name}: {needs}, one side has {fewest}; {remedy} --repetitions 20")
    return pairing


def draws_agree(old: Draws, new: Draws, executor: str) -> bool:
    """Whether repetitions of an executor with one number on both sides have the same model of
    execution times, the same length, and the same phases of timers that both have."""
    for key in old.keys() & new.keys():
        if key[0] == executor:
            (times, first), (new_times, new_first) = old[key], new[key]
            if times != new_times or any(first[t] != new_first[t] for t in first.keys() & new_first.keys()):
                return False
    return True


def dries_up(before: Mapping[int, float], after: Mapping[int, float], pairing: Pairing) -> bool:
    """Whether less than half of the outputs is left in a repetition, or in one of those that are not
    pairs compared with the least before. A single one can end after the run."""

    def gone(old: float, new: float) -> bool:
        return old > 0 and (new == 0 or new < min(old / 2, old - 1))

    if pairing == Pairing.INDEPENDENT:
        return gone(min(before.values()), min(after.values()))
    return any(gone(count, after[n]) for n, count in before.items())


def measures_of(samples: Samples) -> dict[str, dict[int, float]]:
    """{measure: {repetition: ms}}, all above 0."""
    measures: dict[str, dict[int, float]] = {}
    for number, repetition in zip(samples.numbers, samples.repetitions):
        alone = Samples([repetition], exact=True)  # needs no interval
        values = {MEAN: alone.mean} | {PERCENTILES[p]: alone.quantile(p) for p in QUANTILES}
        for measure, value in values.items():
            measures.setdefault(measure, {})[number] = max(value, NOTHING_MS)
    return measures


def numbers_of(side: Side, executor: Key) -> set[int]:
    """Planned repetitions of an executor, given by its source, setting and name."""
    return {n for key, of in side.outputs.items() if key[SOURCE:][:3] == executor for n in of}


def negated(found: Growth) -> Growth:
    """The growth of counts that were tested with the opposite sign, because fewer are worse."""
    changed = {name: -getattr(found, name) + 0.0 for name in ("before", "after", "growth")}  # no -0
    return replace(found, **changed, low=-found.high, high=-found.low)


class Judge:
    """Compares two sides. `interleaved`: live repetitions were measured in turn."""

    def __init__(self, before: Side, after: Side, interleaved: bool) -> None:
        self.sides, self.interleaved = (before, after), interleaved
        self.tests = 1

    def compare(self, key: Key, measure: str, old: Series, new: Series) -> Judgement:
        """One comparison, of the common repetitions if these are pairs. Raises InputError."""
        name, simulated = " ".join(filter(None, key)), key[SOURCE] == "simulated"
        agree = draws_agree(self.sides[0].draws, self.sides[1].draws, key[EXECUTOR])
        pairing = pairing_of(name, simulated, self.interleaved, list(old), list(new), agree)
        if pairing != Pairing.INDEPENDENT:
            common = sorted(old.keys() & new.keys())
            old, new = ({n: side[n] for n in common} for side in (old, new))
        fewer_is_worse = measure in (OUTPUTS, JOBS)
        sign = -1.0 if fewer_is_worse else 1.0
        values = [sign * np.array(list(side.values())) for side in (old, new)]
        scale = Scale.DIFFERENCE if measure in COUNTED else Scale.RATIO
        found = growth(values[0], values[1], pairing, scale, ALARM_RATE / self.tests, POWER)
        if not fewer_is_worse:
            return Judgement(name, measure, found, pairing, simulated)
        dried_up, sprang = (dries_up(*both, pairing) for both in ((old, new), (new, old)))
        return Judgement(name, measure, negated(found), pairing, simulated, 1.0, dried_up, sprang)

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
            old, new = (
                side.outputs.get(key, dict.fromkeys(numbers_of(side, key[SOURCE:][:3]), 0.0))
                for side in self.sides
            )
            if old and new and (any(old.values()) or any(new.values())):  # else an executor did not run
                yield key, JOBS if key[0] == "response" else OUTPUTS, old, new

    def repetitions(self) -> Iterator[Judgement]:
        """Executors with a repetition that the other side does not have."""
        for executor in sorted({key[SOURCE:][:3] for side in self.sides for key in side.outputs}):
            old, new = (numbers_of(side, executor) for side in self.sides)
            simulated = executor[0] == "simulated"
            paired = (simulated or self.interleaved) and len(old & new) == min(len(old), len(new))
            if old != new and (paired or not old or not new):
                before, after = map(float, (len(old), len(new)))
                change = Growth(before, after, after - before, math.nan, math.nan, 1.0, True, 0.0)
                pairing = Pairing.EXACT if simulated else Pairing.PAIRED
                gone = bool(old - new)
                yield Judgement(" ".join(executor), REPETITIONS, change, pairing, simulated, dried_up=gone)

    def all(self) -> list[Judgement]:
        """All comparisons; a task's jobs only where one side has hardly any."""
        series = list(self.series())
        self.tests = max(1, sum(measure != JOBS for _, measure, _, _ in series))
        made = [self.compare(*one) for one in series]
        tested = [j for j in made if j.measure != JOBS]
        for judgement, adjusted in zip(tested, holm([j.growth.p_value for j in tested])):
            judgement.adjusted = adjusted
        shown = tested + [j for j in made if j.measure == JOBS and (j.dried_up or j.sprang)]
        return shown + list(self.repetitions())


def judge(before: Side, after: Side, interleaved: bool = False) -> list[Judgement]:
    """All comparisons of two sides."""
    return Judge(before, after, interleaved).all()
