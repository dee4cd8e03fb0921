# SPDX-License-Identifier: Apache-2.0
"""Checks of the paper's claims: Section VII-A (timers-only sets), VII-B (bounds), VII-C (hot path). claims.toml has
the claim and the rule of each. A check takes the evidence, a source (simulated, live, or real: the real ROS 2 stack)
and the options of its claim. It returns a finding, or raises Missing without data."""

import itertools
import math
from collections.abc import Iterable, Sized
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import pandas as pd

from hotpath_report.errors import Missing
from hotpath_report.figures.bounds import PAPER
from hotpath_report.paper.cells import EXECUTORS, UTILISATIONS, read_spec
from hotpath_report.paper.evidence import REAL, Evidence
from hotpath_report.statistics import Estimate, Samples, percent_of, rank_test, ratio

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
    return " / ".join("–" if math.isnan(v) else f"{v:.3g}" for v in values) + " %"


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


def paper_rows(evidence: Evidence) -> pd.DataFrame:
    """Rows of Table I with the paper's release cost; bounds in ms, infinite if there is none."""
    rows = evidence.table("wcrt_table.csv").query("delta_of == 'paper'")
    need(rows)
    return rows.assign(bound_ms=(rows["bound_ns"] / 1e6).fillna(math.inf))


def rows_of(evidence: Evidence, source: str, executor: str, group: str | None = None) -> list[pd.DataFrame]:
    """Counts on each of the three sets. Raises Missing unless the executor ran on all."""
    rows = [evidence.timer_runs().rows(percent, source, executor, group) for percent in UTILISATIONS]
    need(*rows)
    return rows


def losses(evidence: Evidence, source: str, rows: pd.DataFrame, word: str, largest_of: str = "") -> Finding:
    """Jobs that must not be lost: reproduced if none was lost. Live, the machine can withhold the processor: a small
    share of each executor's jobs on each set counts as partly reproduced, and the text counts lost jobs in repetitions
    marked as disturbed, and ends with the largest share in percent in `largest_of`. `rows`: setting, executor,
    repetition, lost, jobs."""
    short = f"{rows['lost'].sum()} of {rows['jobs'].sum()}"
    of_set = rows.groupby(["utilisation_percent", "executor"])[["lost", "jobs"]].sum()
    largest = max(map(percent_of, of_set["lost"], of_set["jobs"]))
    text = f"{short} jobs {word}"
    if source == "live" and largest > 0:
        keys = zip(rows["utilisation_percent"], rows["executor"], rows["repetition"])
        disturbed = rows["lost"][[key in evidence.marked for key in keys]].sum()
        text += f", {disturbed} of them in repetitions marked as disturbed{largest_of.format(largest)}"
    tolerated = source == "live" and largest <= LIMITS.tolerated_percent
    return Finding(graded(largest == 0, True, tolerated), text, short)


def none_lost(evidence: Evidence, source: str, what: str, of: str, word: str) -> Finding:
    """The paper's executors lose nothing; for the real stack, only its measured executors count."""
    known = set(evidence.timer_runs().counts.query("source == @source")["executor"])
    executors = [e for e in EXECUTORS["papers_own"] if source != REAL or e in known]
    need(executors)
    rows = pd.concat(of_set for e in executors for of_set in rows_of(evidence, source, e))
    rows = rows.assign(lost=rows[what].astype(int), jobs=rows[of].astype(int))
    return losses(evidence, source, rows, word, "; at most {:.2g} % of one executor's on one set")


def bounds(evidence: Evidence, source: str) -> Finding:
    """Responses against Table I and against the exact, tighter non-preemptive bound."""
    runs = evidence.timer_runs(WITH_COST if source == "simulated" else "timers")
    with_cost, printed = evidence.timer_runs(WITH_COST), paper_rows(evidence)
    printed = printed.assign(group=printed["task"].str.lower())
    table = printed.set_index(["utilisation_percent", "group"])["bound_ms"]
    frames = []
    for executor, percent in itertools.product(EXECUTORS["with_bounds"], UTILISATIONS):
        jobs, exact = runs.jobs(percent, source, executor), with_cost.rows(percent, "simulated", "rm-ro")
        need(jobs, exact)
        exact_ms = jobs["task"].map(exact.set_index("task")["bound_ms"])
        frames.append(jobs.assign(jobs=1, table_ms=jobs["group"].map(table[percent]), exact_ms=exact_ms))
    rows = pd.concat(frames)
    rows["lost"] = (rows["response_ms"] > rows["table_ms"]).astype(int)
    found = losses(evidence, source, rows, "above Table I")
    over_exact = int((rows["response_ms"] > rows["exact_ms"]).sum())
    highest = 100 * (rows["response_ms"] / rows["table_ms"]).max()
    more = f", {over_exact} above the exact bound; the largest response is {highest:.1f} % of the table's"
    return replace(found, text=found.text + more)


def drop_rates(evidence: Evidence, source: str, executor: str, group: str | None = None) -> list[float]:
    """Drop rate on each set in percent."""
    rows_of(evidence, source, executor)
    return [evidence.timer_runs().drop_percent(p, source, executor, group) for p in UTILISATIONS]


def drops(evidence: Evidence, source: str, executor: str) -> Finding:
    rates, imu = (drop_rates(evidence, source, executor, group) for group in (None, "imu"))
    losing = sum(rate > LIMITS.tolerated_percent for rate in rates)
    text = f"{percents(rates)} of all jobs, {percents(imu)} of the IMU's"
    return Finding(graded(losing, len(rates)), text, percents(rates))


def largest_rate(evidence: Evidence, source: str, executor: str, group: str | None) -> tuple[float, str]:
    """The largest drop rate of an executor, and a text with its set."""
    rates = zip(drop_rates(evidence, source, executor, group), UTILISATIONS)
    return max((r, f"{executor} at most {r:.3g} % ({percent} % set)") for r, percent in rates)


def ten_percent(evidence: Evidence, source: str) -> Finding:
    largest, text = max(largest_rate(evidence, source, e, None) for e in EXECUTORS["stock"])
    low, high = LIMITS.ten_percent
    return Finding(graded(low <= largest <= high, True, largest > high), text, f"{largest:.3g} %")


def imu_loss(evidence: Evidence, source: str) -> Finding:
    rates, texts = zip(*(largest_rate(evidence, source, e, "imu") for e in EXECUTORS["wait_sets"]))
    beyond = sum(rate > LIMITS.ten_percent[1] for rate in rates)
    return Finding(graded(beyond, len(rates)), ", ".join(texts), f"{max(rates):.3g} %")


def imu_overruns(evidence: Evidence, source: str, executor: str) -> Finding:
    sums = [rows[["deadline_overruns", "ran"]].sum() for rows in rows_of(evidence, source, executor, "imu")]
    late = sum(percent_of(n, of) > LIMITS.tolerated_percent for n, of in sums)
    overruns, jobs = (" / ".join(f"{n:.0f}" for n in numbers) for numbers in zip(*sums))
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
    differences = (rows["bound_ms"] - rows["printed_ms"]).abs()
    equal = int((differences <= LIMITS.table_ms + 1e-9).sum())
    text = f"{equal} of {len(rows)} entries equal, largest difference {differences.max():.4f} ms"
    return Finding(graded(equal, len(rows)), text, f"{equal} of {len(rows)}")


def schedulable(evidence: Evidence, _source: str) -> Finding:
    rows = paper_rows(evidence)
    shares = rows["bound_ms"] / rows["task"].map(LIMITS.deadlines_ms)
    short = f"{int((shares <= 1).sum())} of {len(shares)}"
    text = f"{short} bounds within their deadline, the tightest at {100 * shares.max():.1f} % of it"
    return Finding(graded(bool((shares <= 1).all()), True), text, short)


def reductions(evidence: Evidence) -> pd.DataFrame:
    """Results of the paper's method by utilisation."""
    rows = evidence.table("waters_summary.csv")
    return rows[rows["method"] == PAPER].sort_values("utilisation")


def majority(evidence: Evidence, _source: str) -> Finding:
    lower = 100 * reductions(evidence)["positive_share"]
    shares = percents(lower)
    return Finding(graded(lower.min() > 50, True), f"{shares} of the chains are lower", shares)


def negative(evidence: Evidence, _source: str) -> Finding:
    higher = list(100 * (1 - reductions(evidence)["positive_share"]))
    rising = all(a < b for a, b in itertools.pairwise(higher))
    verdict = graded(rising, True, higher[-1] > higher[0])
    return Finding(verdict, f"{percents(higher)} of the chains are not lower", percents(higher))


def almost_90(evidence: Evidence, _source: str) -> Finding:
    largest = float(reductions(evidence)["max"].max())
    low, high = LIMITS.almost_90
    verdict = graded(low <= largest <= high, True, largest > 50)
    return Finding(verdict, f"at most {largest:.1f} %", f"{largest:.1f} %")


def delta(evidence: Evidence, _source: str) -> Finding:
    of_paper = 1e3 * LIMITS.paper_delta_ms
    us = evidence.table("wcrt_table.csv").groupby("delta_of")["delta_ns"].max() / 1e3
    most, nearly = us.reindex([f"this machine ({of})" for of in ("maximum", "p99.9")])
    need(us.filter(like="maximum"), us.filter(like="p99.9"))
    text = f"at most {most:.1f} µs, 99.9 % below {nearly:.2g} µs"
    return Finding(graded(most <= of_paper, True, nearly <= of_paper), text, f"99.9 % < {nearly:.2g} µs")


def total_delta(evidence: Evidence, _source: str) -> Finding:
    one = float(paper_rows(evidence)["delta_ns"].iloc[0]) / 1e6
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
