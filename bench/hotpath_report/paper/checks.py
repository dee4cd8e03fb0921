# SPDX-License-Identifier: Apache-2.0
"""Checks of the paper's claims: Section VII-A (timers-only sets), VII-B (bounds), VII-C (hot path). claims.toml has
the claim and the rule of each. A check takes the evidence, a source (simulated, live, or real: the real ROS 2 stack)
and the options of its claim. It returns a finding, or raises Missing without data."""

import itertools
import math
from collections.abc import Iterable, Sized
from dataclasses import dataclass, replace
from operator import itemgetter
from types import SimpleNamespace
from typing import Any

import numpy as np

from hotpath_report.errors import Missing
from hotpath_report.figures.bounds import PAPER
from hotpath_report.figures.timers import group_of
from hotpath_report.files import NS_PER_MS, Rows
from hotpath_report.paper.cells import EXECUTORS, UTILISATIONS, read_spec
from hotpath_report.paper.evidence import REAL, Evidence
from hotpath_report.statistics import Estimate, Samples, grouped, percent_of, rank_test, ratio, total

REPRODUCED, PARTLY, NOT, NO_DATA = "reproduced", "partly", "not", "no data"
CLAIMS = read_spec("claims.toml")
LIMITS: Any = SimpleNamespace(**CLAIMS["limits"])
WITH_COST = "timers_with_release_cost"
OTHERS = EXECUTORS["others_on_hot_path"]


@dataclass(frozen=True)
class Finding:
    """A verdict with its reason, as a sentence and in short."""

    verdict: str
    text: str
    short: str


TOO_FEW = Finding(NO_DATA, "too few samples for an interval", "too few")


def graded(good: int | bool, of: int | bool, some: int | bool | None = None) -> str:
    """Reproduced if all are good, partly if some are."""
    return REPRODUCED if good == of else PARTLY if (good if some is None else some) else NOT


def percents(values: Iterable[float]) -> str:
    """60 / 80 / 90 %."""
    return " / ".join(f"{v:.3g}" for v in values) + " %"


def above(estimate: Estimate, neutral: float) -> bool:
    """Whether the estimate lies above `neutral` beyond noise; exact values have no noise."""
    return estimate.value > neutral and not estimate.low <= neutral <= estimate.high


def too_few(*groups: Samples) -> bool:
    """Whether a measurement was too short for an interval, and so for a verdict."""
    return any(not s.exact and not s.estimate(1.0).has_interval for s in groups)


def need(*data: Sized) -> None:
    """Raises Missing if any of `data` is empty."""
    if not all(map(len, data)):
        raise Missing


def paper_rows(evidence: Evidence) -> Rows:
    """Rows of Table I with the paper's release cost; bounds in ms, infinite if there is none."""
    rows = [row for row in evidence.table("wcrt_table.csv") if row["delta_of"] == "paper"]
    need(rows)
    return [row | {"bound_ms": (row["bound_ns"] or math.inf) / NS_PER_MS} for row in rows]


def rows_of(evidence: Evidence, source: str, executor: str, group: str | None = None) -> list[Rows]:
    """Counts on each of the three sets. Raises Missing unless the executor ran on all."""
    rows = [evidence.timer_runs().rows(percent, source, executor, group) for percent in UTILISATIONS]
    need(*rows)
    return rows


def drop_rates(evidence: Evidence, source: str, executor: str, group: str | None = None) -> list[float]:
    """Drop rate on each set in percent."""
    sets = rows_of(evidence, source, executor, group)
    return [percent_of(*total(rows, "skipped", "reached")) for rows in sets]


def largest_rate(evidence: Evidence, source: str, executor: str, group: str | None) -> tuple[float, str]:
    """The largest drop rate of an executor, and a text with its set."""
    rates = zip(drop_rates(evidence, source, executor, group), UTILISATIONS)
    return max((r, f"{executor} at most {r:.3g} % ({percent} % set)") for r, percent in rates)


def losses(evidence: Evidence, source: str, rows: Rows, word: str, largest_of: str = "") -> Finding:
    """Jobs that must not be lost: reproduced if none was lost. Live, the machine can withhold the processor: a small
    share of each executor's jobs on each set counts as partly reproduced, and the text counts lost jobs in repetitions
    marked as disturbed, and ends with the largest share in percent in `largest_of`. `rows`: setting, executor,
    repetition, lost, jobs."""
    sets = grouped(rows, "utilisation_percent", "executor").values()
    short = " of ".join(map(str, total(rows, "lost", "jobs")))
    largest = max(percent_of(*total(of_set, "lost", "jobs")) for of_set in sets)
    text = f"{short} jobs {word}"
    if source == "live" and largest > 0:
        repetition = itemgetter("utilisation_percent", "executor", "repetition")
        disturbed = sum(row["lost"] for row in rows if repetition(row) in evidence.marked)
        text += f", {disturbed} of them in repetitions marked as disturbed{largest_of.format(largest)}"
    tolerated = source == "live" and largest <= LIMITS.tolerated_percent
    return Finding(graded(largest == 0, True, tolerated), text, short)


def none_lost(evidence: Evidence, source: str, what: str, of: str, word: str) -> Finding:
    """The paper's executors lose nothing; for the real stack, only its measured executors count."""
    known = {row["executor"] for row in evidence.timer_runs().counts if row["source"] == source}
    executors = [e for e in EXECUTORS["papers_own"] if source != REAL or e in known]
    need(executors)
    sets = (of_set for e in executors for of_set in rows_of(evidence, source, e))
    rows = [row | {"lost": row[what], "jobs": row[of]} for of_set in sets for row in of_set]
    return losses(evidence, source, rows, word, "; at most {:.2g} % of one executor's on one set")


def bounds(evidence: Evidence, source: str) -> Finding:
    """Responses against Table I and against the exact, tighter non-preemptive bound."""
    runs = evidence.timer_runs(WITH_COST if source == "simulated" else "timers")
    with_cost, printed = evidence.timer_runs(WITH_COST), paper_rows(evidence)
    table = {(row["utilisation_percent"], row["task"].lower()): row["bound_ms"] for row in printed}
    rows: Rows = []
    over_exact, highest = 0, 0.0
    for executor, percent in itertools.product(EXECUTORS["with_bounds"], UTILISATIONS):
        jobs, exact = runs.jobs(percent, source, executor), with_cost.rows(percent, "simulated", "rm-ro")
        need(jobs, exact)
        exact_ms = {row["task"]: row["bound_ms"] for row in exact}
        for row in jobs:
            of, bound = np.array(row["response_ms"]), table[percent, group_of(row["task"])]
            rows.append(row | {"lost": int((of > bound).sum()), "jobs": len(of)})
            over_exact += int((of > (exact_ms[row["task"]] or math.inf)).sum())
            highest = max(highest, 100 * of.max() / bound)
    found = losses(evidence, source, rows, "above Table I")
    more = f", {over_exact} above the exact bound; the largest response is {highest:.1f} % of the table's"
    return replace(found, text=found.text + more)


def drops(evidence: Evidence, source: str, executor: str) -> Finding:
    rates, imu = (drop_rates(evidence, source, executor, group) for group in (None, "imu"))
    losing = sum(rate > LIMITS.tolerated_percent for rate in rates)
    text = f"{percents(rates)} of all jobs, {percents(imu)} of the IMU's"
    return Finding(graded(losing, len(rates)), text, percents(rates))


def ten_percent(evidence: Evidence, source: str) -> Finding:
    largest, text = max(largest_rate(evidence, source, e, None) for e in EXECUTORS["stock"])
    low, high = LIMITS.ten_percent
    return Finding(graded(low <= largest <= high, True, largest > high), text, f"{largest:.3g} %")


def imu_loss(evidence: Evidence, source: str) -> Finding:
    rates, texts = zip(*(largest_rate(evidence, source, e, "imu") for e in EXECUTORS["wait_sets"]))
    beyond = sum(rate > LIMITS.ten_percent[1] for rate in rates)
    return Finding(graded(beyond, len(rates)), ", ".join(texts), f"{max(rates):.3g} %")


def imu_overruns(evidence: Evidence, source: str, executor: str) -> Finding:
    sums = [total(rows, "deadline_overruns", "ran") for rows in rows_of(evidence, source, executor, "imu")]
    late = sum(percent_of(n, of) > LIMITS.tolerated_percent for n, of in sums)
    overruns, jobs = (" / ".join(map(str, numbers)) for numbers in zip(*sums))
    return Finding(graded(late, len(sums)), f"{overruns} of {jobs} jobs", overruns)


def lidar_pays(evidence: Evidence, source: str) -> Finding:
    runs, deltas = evidence.timer_runs(), []
    for percent in UTILISATIONS:
        ours, stock = (runs.samples(percent, source, e, "lidar") for e in ("rm-ro", "default"))
        need(ours, stock)
        if too_few(ours, stock):
            return TOO_FEW
        deltas.append(rank_test(stock, ours).cliffs_delta)
    values = " / ".join(f"{d.value:+.2f}" for d in deltas)
    text = f"Cliff's delta {values} at {' / '.join(map(str, UTILISATIONS))} %"
    return Finding(graded(sum(above(d, 0) for d in deltas), len(deltas)), text, values)


def table(evidence: Evidence, _source: str) -> Finding:
    rows = paper_rows(evidence)
    differences = [abs(row["bound_ms"] - row["printed_ms"]) for row in rows]
    equal = sum(difference <= LIMITS.table_ms + 1e-9 for difference in differences)
    text = f"{equal} of {len(rows)} entries equal, largest difference {max(differences):.4f} ms"
    return Finding(graded(equal, len(rows)), text, f"{equal} of {len(rows)}")


def schedulable(evidence: Evidence, _source: str) -> Finding:
    shares = [row["bound_ms"] / LIMITS.deadlines_ms[row["task"]] for row in paper_rows(evidence)]
    short = f"{sum(share <= 1 for share in shares)} of {len(shares)}"
    text = f"{short} bounds within their deadline, the tightest at {100 * max(shares):.1f} % of it"
    return Finding(graded(max(shares) <= 1, True), text, short)


def reductions(evidence: Evidence) -> Rows:
    """Results of the paper's method by utilisation."""
    rows = (row for row in evidence.table("waters_summary.csv") if row["method"] == PAPER)
    return sorted(rows, key=lambda row: row["utilisation"])


def majority(evidence: Evidence, _source: str) -> Finding:
    lower = [100 * row["positive_share"] for row in reductions(evidence)]
    shares = percents(lower)
    return Finding(graded(min(lower) > 50, True), f"{shares} of the chains are lower", shares)


def negative(evidence: Evidence, _source: str) -> Finding:
    higher = [100 * (1 - row["positive_share"]) for row in reductions(evidence)]
    rising = all(a < b for a, b in itertools.pairwise(higher))
    verdict = graded(rising, True, higher[-1] > higher[0])
    return Finding(verdict, f"{percents(higher)} of the chains are not lower", percents(higher))


def almost_90(evidence: Evidence, _source: str) -> Finding:
    largest = max(row["max"] for row in reductions(evidence))
    low, high = LIMITS.almost_90
    verdict = graded(low <= largest <= high, True, largest > 50)
    return Finding(verdict, f"at most {largest:.1f} %", f"{largest:.1f} %")


def delta(evidence: Evidence, _source: str) -> Finding:
    of_paper = 1e3 * LIMITS.paper_delta_ms
    us = {row["delta_of"]: row["delta_ns"] / 1e3 for row in evidence.table("wcrt_table.csv")}
    most, nearly = (us.get(f"this machine ({of})") for of in ("maximum", "p99.9"))
    if most is None or nearly is None:
        raise Missing
    text = f"at most {most:.1f} µs, 99.9 % below {nearly:.2g} µs"
    return Finding(graded(most <= of_paper, True, nearly <= of_paper), text, f"99.9 % < {nearly:.2g} µs")


def total_delta(evidence: Evidence, _source: str) -> Finding:
    one = paper_rows(evidence)[0]["delta_ns"] / NS_PER_MS
    near = abs(LIMITS.tasks * one - LIMITS.paper_total_delta_ms) <= LIMITS.total_delta_ms
    text = f"{LIMITS.tasks * one:.3f} ms from δ = {one:.3f} ms, the value behind Table I"
    return Finding(graded(near, True), text, f"{LIMITS.tasks * one:.3f} ms")


COMPUTED = (table, schedulable, majority, negative, almost_90, delta, total_delta)  # need no run


def hot_paths(evidence: Evidence, source: str, *executors: str) -> list[Samples]:
    """Latencies (ms) of the executors. Raises Missing if any has none."""
    found = [evidence.latencies("autoware", source, e) for e in executors]
    need(*found)
    return found


def real_ms(evidence: Evidence, quantile: str, *executors: str) -> list[float]:
    """Quantiles (ms) of the real ROS 2 stack. Raises Missing if an executor has none."""
    found = evidence.reference.hot_path_ms(quantile)
    if not found.keys() >= set(executors):
        raise Missing
    return [found[e] for e in executors]


def slowdown(evidence: Evidence, source: str) -> Finding:
    pair = ("default", "rm-ro")
    if source == REAL:
        of_real = (real_ms(evidence, quantile, *pair) for quantile in ("max", "p99", "p50"))
        worst, p99, median = (f"{default / ours:.2f}" for default, ours in of_real)
        return Finding(NO_DATA, f"worst cases {worst}, p99 {p99}, medians {median}", worst)
    default, ours = hot_paths(evidence, source, *pair)
    ratios = {p: ratio(default, ours, p) for p in (1.0, 0.99, 0.5)}
    value, most = ratios[1.0].value, LIMITS.slowdown_factor
    within = LIMITS.paper_slowdown / most <= value <= LIMITS.paper_slowdown * most
    text = f"worst cases {ratios[1.0].text(2)}"
    if len(default.repetitions) > 1:
        text += f" (median of repetitions {default.middle_worst() / ours.middle_worst():.2f})"
    text += f", p99 {ratios[0.99].text(2)}, medians {ratios[0.5].text(2)}"
    return Finding(graded(within, True, value > 1), text, f"{value:.2f}")


def best_worst_case(evidence: Evidence, source: str) -> Finding:
    executors = ("rm-ro", *OTHERS)
    if source == REAL:
        values = real_ms(evidence, "max", *executors)
        text = ", ".join(f"{e} {v:.1f}" for e, v in zip(executors, values)) + " ms"
        return Finding(NO_DATA, text, f"{values[0]:.1f}, others ≥ {min(values[1:]):.1f} ms")
    ours, *others = found = hot_paths(evidence, source, *executors)
    if too_few(*found):
        return TOO_FEW
    ratios = [ratio(other, ours, 1.0) for other in others]
    told = [f"{e} {s.worst:.1f} ms ({r.text(2)} ×)" for e, s, r in zip(OTHERS, others, ratios)]
    verdict = graded(sum(above(r, 1) for r in ratios), len(others), any(r.value > 1 for r in ratios))
    short = f"{ours.worst:.1f}, others ≥ {min(other.worst for other in others):.1f} ms"
    return Finding(verdict, f"rm-ro {ours.worst:.1f} ms, {', '.join(told)}", short)


def outperforms(evidence: Evidence, source: str) -> Finding:
    ours, *others = hot_paths(evidence, source, "rm-ro", *OTHERS)
    tests = [rank_test(ours, other) for other in others]
    deltas = [test.cliffs_delta for test in tests]
    significant = (not test.p_value > LIMITS.largest_p for test in tests)
    large = sum(d.value >= LIMITS.large_effect and sure for d, sure in zip(deltas, significant))
    least, greatest = min(d.value for d in deltas), max(d.value for d in deltas)
    text = ", ".join(f"{e} {d.text(2)}" for e, d in zip(OTHERS, deltas))
    verdict = graded(large, len(tests), greatest > 0)
    return Finding(verdict, f"Cliff's delta against {text}", f"δ ≥ {least:.2f}")


def rate(evidence: Evidence, source: str) -> Finding:
    (samples,) = hot_paths(evidence, source, "rm-ro")
    cells = [c for c in evidence.cells if (c["study"], c["source"]) == ("autoware", source)]
    durations = [c["duration_s"] for c in cells if "rm-ro" in c["executors"]]
    need(durations)
    value = len(samples) / sum(durations)
    near = abs(value / LIMITS.paper_rate_hz - 1) <= LIMITS.rate_percent / 100
    return Finding(graded(near, True), f"{value:.2f} per second arrive", f"{value:.2f} / s")
