# SPDX-License-Identifier: Apache-2.0
"""Whether latencies and losses became worse beyond noise. The unit is the repetition: its mean,
median and p99 latency and its losses are compared by the tests of hotpath/analysis/growth_test.hpp.
Simulated repetitions with equal seeds are pairs without noise. Live repetitions are pairs if both
builds took turns; all others are independent. Holm's correction keeps the probability of any false
alarm below ALARM_RATE."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hotpath_report.errors import InputError
from hotpath_report.comparison.sides import NOTHING_MS, SOURCE, Key
from hotpath_report.statistics import PERCENTILES, Growth, Pairing, Samples, Scale, growth, holm

ALARM_RATE = 0.01
POWER = 0.9  # probability of finding a detectable growth
LEAST_EFFECT = 0.02  # smaller growth of a latency raises no alarm, unless it is exact
LEAST_REPETITIONS = 3
MEAN, QUANTILES = "mean", (0.5, 0.99)
LOSSES = "lost jobs and samples"

Counts = Mapping[Key, Mapping[int, float]]  # by number of the repetition


def percent_text(value: float) -> str:
    """A detectable growth; few noisy repetitions can make it very large."""
    return "over 1000 %" if value > 1000 else f"{value:.0f} %" if value >= 10 else f"{value:.1f} %"


@dataclass
class Judgement:
    """One comparison. Latencies (ms) grow by a ratio, losses per repetition by a difference."""

    what: str
    measure: str
    growth: Growth
    pairing: Pairing
    simulated: bool
    adjusted: float = 1.0

    @property
    def worse(self) -> bool:
        """Whether the measure became worse beyond noise."""
        return self.adjusted < ALARM_RATE and (self.exact or self.percent > 100 * LEAST_EFFECT or self.lost)

    @property
    def exact(self) -> bool:
        """Whether simulated pairs agree, which rules out noise."""
        return self.pairing == Pairing.EXACT and bool(self.growth.exact)

    @property
    def same(self) -> bool:
        """Whether nothing changed."""
        return self.exact and abs(self.growth.growth - (0 if self.lost else 1)) < NOTHING_MS

    @property
    def lost(self) -> bool:
        """Whether the measure counts losses."""
        return self.measure == LOSSES

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
        return f"{self.growth.growth:+.3g}" if self.lost else f"{self.percent:+.1f} %"

    def interval_text(self) -> str:
        """The interval in the unit of the effect."""
        ends = self.growth.low, self.growth.high
        if np.isnan(ends[0]):
            return "exact" if self.exact else ""
        if self.lost:
            return f"[{ends[0]:+.3g}, {ends[1]:+.3g}]"
        return f"[{100 * (ends[0] - 1):+.1f}, {100 * (ends[1] - 1):+.1f}] %"

    def detectable_text(self) -> str:
        """The detectable effect in its unit."""
        if self.growth.exact and (self.exact or self.lost):
            return "any"
        return f"{self.growth.detectable:.3g}" if self.lost else percent_text(self.detectable_percent)

    def cells(self) -> list[str]:
        """The row of the table."""
        values = [f"{v:.3g}" if self.lost else f"{v:.3f}" for v in (self.growth.before, self.growth.after)]
        return [
            self.what,
            self.measure,
            *values,
            self.effect_text(),
            self.interval_text(),
            f"{self.adjusted:.2g}",
            self.detectable_text(),
            "WORSE" if self.worse else "the same" if self.same else "not worse",
        ]


def pairing_of(
    name: str, simulated: bool, interleaved: bool, old: Sequence[int], new: Sequence[int]
) -> Pairing:
    """Pairing of these repetitions. Raises InputError if there are too few to judge."""
    common, fewest = len(set(old) & set(new)), min(len(old), len(new))
    pairing = Pairing.INDEPENDENT
    if common == fewest and (simulated or interleaved):
        pairing = Pairing.EXACT if simulated else Pairing.PAIRED
    if pairing != Pairing.EXACT and fewest < LEAST_REPETITIONS:
        remedy = "give both the same --seed, or" if simulated else "measure with"
        seeds = " of other seeds" if simulated else ""
        needs = f"the gate needs {LEAST_REPETITIONS} repetitions{seeds} on each side"
        raise InputError(f"{name}: {needs}, one side has {fewest}; {remedy} --repetitions 20")
    return pairing


def measures_of(samples: Samples) -> dict[str, dict[int, float]]:
    """{measure: {repetition: ms}}, all above 0."""
    measures: dict[str, dict[int, float]] = {}
    for number, repetition in zip(samples.numbers, samples.repetitions):
        alone = Samples([repetition], exact=True)  # needs no interval
        values = {MEAN: alone.mean} | {PERCENTILES[p]: alone.quantile(p) for p in QUANTILES}
        for measure, value in values.items():
            measures.setdefault(measure, {})[number] = max(value, NOTHING_MS)
    return measures


def judge(
    old: Mapping[Key, Samples],
    new: Mapping[Key, Samples],
    losses: tuple[Counts, Counts],
    interleaved: bool = False,
) -> list[Judgement]:
    """All comparisons of common keys. `interleaved`: live repetitions were measured in turn."""
    latencies = {
        key: (measures_of(old[key]), measures_of(new[key])) for key in sorted(old.keys() & new.keys())
    }
    sides: list[tuple[Key, str, Scale, Mapping[int, float], Mapping[int, float]]] = [
        (key, measure, Scale.RATIO, before[measure], after[measure])
        for key, (before, after) in latencies.items()
        for measure in before
        if measure in after
    ]
    sides += [
        (key, LOSSES, Scale.DIFFERENCE, losses[0][key], losses[1][key])
        for key in sorted(losses[0].keys() & losses[1].keys())
    ]
    made = []
    for key, measure, scale, before, after in sides:
        name, simulated = " ".join(filter(None, key)), key[SOURCE] == "simulated"
        pairing = pairing_of(name, simulated, interleaved, list(before), list(after))
        if pairing != Pairing.INDEPENDENT:
            common = sorted(before.keys() & after.keys())
            before, after = ({n: side[n] for n in common} for side in (before, after))
        values = [np.array(list(side.values())) for side in (before, after)]
        found = growth(values[0], values[1], pairing, scale, ALARM_RATE / len(sides), POWER)
        made.append(Judgement(name, measure, found, pairing, simulated))
    for judgement, adjusted in zip(made, holm([j.growth.p_value for j in made])):
        judgement.adjusted = adjusted
    return made
