# SPDX-License-Identifier: Apache-2.0
"""The claims of the paper's evaluation, each with its check: Section VII-A (timers-only sets), VII-B (bounds), VII-C
(hot path). Docstrings are texts of the page, see claim()."""

import itertools
import math
from dataclasses import replace
from operator import itemgetter

import numpy as np

from hotpath_report.errors import Missing, need
from hotpath_report.figures.bounds import PAPER
from hotpath_report.figures.timers import group_of
from hotpath_report.files import NS_PER_MS, Rows
from hotpath_report.paper.cells import EXECUTORS, UTILISATIONS
from hotpath_report.paper.claims import BOUNDARY, COMPUTED, DISTURBED, LIMITS, LOST_LIVE, NO_DATA, NOT, PARTLY
from hotpath_report.paper.claims import TOO_FEW, Finding, claim, graded, percents
from hotpath_report.paper.evidence import REAL, WITH_COST, Evidence
from hotpath_report.statistics import grouped, percent_of, rank_test, ratio, total

OTHERS = EXECUTORS["others_on_hot_path"]

# Reasons of single verdicts.
RELEASE_ONLY = (
    "In release-only mode the timer management thread handles every timestamp when it is due, so rcl's rule for late "
    "timers never applies: lateness appears as backlog and response time, not as dropped jobs. The paper does not "
    "state the mode of its unmodified events executor; release-and-execute does drop jobs."
)
ALONE = (
    "The bound assumes an exclusive processor. A virtual machine sometimes withholds it, which the analysis does not "
    "model."
)
LIGHT_LOAD = (
    "On a lightly loaded set, a LiDAR job of the lowest priority waits little under either executor; low priority "
    "costs time only under load."
)
INTERRUPTIONS = "The largest values come from interruptions by the machine, not from the releaser's work."
MAXIMA = (
    "The default executor is slower, but by another factor than on the paper's machine: the ratio compares two "
    "maxima, which depend on phases and single interruptions."
)


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


def reductions(evidence: Evidence) -> Rows:
    """Results of the paper's method by utilisation."""
    rows = (row for row in evidence.table("waters_summary.csv") if row["method"] == PAPER)
    return sorted(rows, key=lambda row: row["utilisation"])


@claim("dropped-jobs", "0", LOST_LIVE)
def no_drops(evidence: Evidence, source: str) -> Finding:
    """The paper's executors drop no job

    “our proposed events executor do not have any job drops for any configuration of the RM and EDF events
    executors”

    reproduced: none; partly, live only: at most {tolerated_percent:g} % of the jobs of each executor on each set
    """
    return none_lost(evidence, source, "skipped", "reached", "dropped")


@claim(
    "dropped-jobs", "yes", {PARTLY: BOUNDARY}, EXECUTORS["stock"], why_of={"events-ro": {NOT: RELEASE_ONLY}}
)
def drops(evidence: Evidence, source: str, executor: str) -> Finding:
    """{words}: drops jobs

    “the default, static, and unmodified events executor repeatedly drop jobs” — {words}

    reproduced: more than {tolerated_percent:g} % of the jobs dropped on all three sets; partly: on some"""
    rates, imu = (drop_rates(evidence, source, executor, group) for group in (None, "imu"))
    losing = sum(rate > LIMITS.tolerated_percent for rate in rates)
    short, of_imu = percents(rates), percents(imu)
    return Finding(graded(losing, len(rates)), f"{short} of all jobs, {of_imu} of the IMU's", short)


@claim("dropped-jobs", "10 %")
def ten_percent(evidence: Evidence, source: str) -> Finding:
    """Largest drop rate of all jobs

    “In some cases, a drop rate of 10 % is observed” — of all jobs

    reproduced: the largest rate lies within {ten_percent[0]} to {ten_percent[1]} %; partly: it is larger"""
    largest, text = max(largest_rate(evidence, source, e, None) for e in EXECUTORS["stock"])
    within = LIMITS.ten_percent[0] <= largest <= LIMITS.ten_percent[1]
    return Finding(graded(within, True, largest > LIMITS.ten_percent[1]), text, f"{largest:.3g} %")


@claim("dropped-jobs", "10 % of all")
def imu_loss(evidence: Evidence, source: str) -> Finding:
    """Largest drop rate of the IMU alone

    default and static lose far more than 10 % of the IMU's jobs on some sets (the total hides it)

    reproduced: each loses more than {ten_percent[1]} % of them on some set; partly: one of them"""
    rates, texts = zip(*(largest_rate(evidence, source, e, "imu") for e in EXECUTORS["wait_sets"]))
    beyond = sum(rate > LIMITS.ten_percent[1] for rate in rates)
    return Finding(graded(beyond, len(rates)), ", ".join(texts), f"{max(rates):.3g} %")


@claim("wcrt-table", "nine values", sources=COMPUTED)
def table(evidence: Evidence, _source: str) -> Finding:
    """Table I: nine response-time bounds

    Table I: analytical worst-case response times

    reproduced: all nine within {table_ms:g} ms (the table's rounding); partly: some"""
    rows = paper_rows(evidence)
    differences = [abs(row["bound_ms"] - row["printed_ms"]) for row in rows]
    equal = sum(difference <= LIMITS.table_ms + 1e-9 for difference in differences)
    text = f"{equal} of {len(rows)} entries equal, largest difference {max(differences):.4f} ms"
    return Finding(graded(equal, len(rows)), text, f"{equal} of {len(rows)}")


@claim("wcrt-table", "all within", sources=COMPUTED)
def schedulable(evidence: Evidence, _source: str) -> Finding:
    """All deadlines are guaranteed

    “indicating no deadline misses … all tasks are guaranteed to meet their deadlines”

    reproduced: every bound is at most its deadline"""
    shares = [row["bound_ms"] / LIMITS.deadlines_ms[row["task"]] for row in paper_rows(evidence)]
    short = f"{sum(share <= 1 for share in shares)} of {len(shares)}"
    text = f"{short} bounds within their deadline, the tightest at {100 * max(shares):.1f} % of it"
    return Finding(graded(max(shares) <= 1, True), text, short)


@claim("wcrt-table", "0", dict.fromkeys((PARTLY, NOT), ALONE))
def bounds(evidence: Evidence, source: str) -> Finding:
    """No response above its bound (RM)

    “the response time bounds are not violated by our RM events executor”

    jobs above the bound of Table I — reproduced: none; partly, live only: at most {tolerated_percent:g} % of the
    jobs of each executor on each set; the simulation has the paper's release cost"""
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


@claim("response-lidar", "0", LOST_LIVE)
def no_overruns(evidence: Evidence, source: str) -> Finding:
    """The paper's executors miss no deadline

    “no deadline overruns are observed” (RM and EDF, RO and RE)

    reproduced: none; partly, live only: at most {tolerated_percent:g} % of the jobs of each executor on each set
    """
    return none_lost(evidence, source, "deadline_overruns", "ran", "late")


@claim("response-imu", "yes", {PARTLY: BOUNDARY}, EXECUTORS["stock"], why_of={"events-ro": {}})
def imu_overruns(evidence: Evidence, source: str, executor: str) -> Finding:
    """{words}: IMU jobs are late

    “IMU tasks have deadline overruns on the Default, Static, and Events executors” — {words}

    reproduced: more than {tolerated_percent:g} % of the jobs late on all three sets; partly: on some"""
    sums = [total(rows, "deadline_overruns", "ran") for rows in rows_of(evidence, source, executor, "imu")]
    late = sum(percent_of(n, of) > LIMITS.tolerated_percent for n, of in sums)
    overruns, jobs = (" / ".join(map(str, numbers)) for numbers in zip(*sums))
    return Finding(graded(late, len(sums)), f"{overruns} of {jobs} jobs", overruns)


@claim("response-lidar", "yes", {PARTLY: LIGHT_LOAD})
def lidar_pays(evidence: Evidence, source: str) -> Finding:
    """LiDAR jobs take longer under RM

    “static-priority scheduling … leading to an increase of response time (see Figure: LiDAR)”

    reproduced: RM's LiDAR responses exceed the default executor's on all three sets, beyond noise; partly: on some
    """
    runs, deltas = evidence.timer_runs(), []
    for percent in UTILISATIONS:
        ours, stock = (runs.samples(percent, source, e, "lidar") for e in ("rm-ro", "default"))
        need(ours, stock)
        if ours.too_few() or stock.too_few():
            return TOO_FEW
        deltas.append(rank_test(stock, ours).cliffs_delta)
    values = " / ".join(f"{d.value:+.2f}" for d in deltas)
    text = f"Cliff's delta {values} at {' / '.join(map(str, UTILISATIONS))} %"
    return Finding(graded(sum(d.above(0) for d in deltas), len(deltas)), text, values)


@claim("end-to-end", "> 50 %", sources=COMPUTED)
def majority(evidence: Evidence, _source: str) -> Finding:
    """Most chains get a smaller bound

    “the majority of chains have lower end-to-end latency when using the RM events executor”

    reproduced: more than half of the chains at every utilisation"""
    lower = [100 * row["positive_share"] for row in reductions(evidence)]
    shares = percents(lower)
    return Finding(graded(min(lower) > 50, True), f"{shares} of the chains are lower", shares)


@claim("end-to-end", "rising", sources=COMPUTED)
def negative(evidence: Evidence, _source: str) -> Finding:
    """Fewer chains gain at higher utilisation

    “As the utilization level increases, the number of chains with a higher end-to-end latency increases”

    reproduced: the share of chains that are not lower rises with utilisation; partly: only from the first to the
    last"""
    higher = [100 * (1 - row["positive_share"]) for row in reductions(evidence)]
    verdict = graded(higher == sorted(set(higher)), True, higher[-1] > higher[0])
    return Finding(verdict, f"{percents(higher)} of the chains are not lower", percents(higher))


@claim("end-to-end", "almost 90 %", sources=COMPUTED)
def almost_90(evidence: Evidence, _source: str) -> Finding:
    """Largest reduction of a bound

    “In some cases, we observe a normalized reduction … of almost 90 %”

    reproduced: the largest reduction lies within {almost_90[0]} to {almost_90[1]} %; partly: above 50 %"""
    largest = max(row["max"] for row in reductions(evidence))
    within = LIMITS.almost_90[0] <= largest <= LIMITS.almost_90[1]
    return Finding(graded(within, True, largest > 50), f"at most {largest:.1f} %", f"{largest:.1f} %")


@claim("overhead", "0.12 ms", {PARTLY: INTERRUPTIONS}, sources=COMPUTED)
def delta(evidence: Evidence, _source: str) -> Finding:
    """Cost of a release, δ

    “a job release takes up to δ = 0.12 ms”

    reproduced: the largest cost of a release here is at most the paper's (on a Raspberry Pi); partly: 99.9 % of the
    costs are; without waking the executor"""
    us = {row["delta_of"]: row["delta_ns"] / 1e3 for row in evidence.table("wcrt_table.csv")}
    most, nearly = (us.get(f"this machine ({of})") for of in ("maximum", "p99.9"))
    if most is None or nearly is None:
        raise Missing
    text, limit = f"at most {most:.1f} µs, 99.9 % below {nearly:.2g} µs", LIMITS.paper_delta_us
    return Finding(graded(most <= limit, True, nearly <= limit), text, f"99.9 % < {nearly:.2g} µs")


@claim("overhead", "0.84 ms", sources=COMPUTED)
def total_delta(evidence: Evidence, _source: str) -> Finding:
    """Overhead of a timer, Δ

    “every timer task has an overhead of Δ = 0.84 ms”

    reproduced: seven times the δ behind Table I equals Δ within {total_delta_ms:g} ms"""
    one = paper_rows(evidence)[0]["delta_ns"] / NS_PER_MS
    near = abs(LIMITS.tasks * one - LIMITS.paper_total_delta_ms) <= LIMITS.total_delta_ms
    short = f"{LIMITS.tasks * one:.3f} ms"
    return Finding(graded(near, True), f"{short} from δ = {one:.3f} ms, the value behind Table I", short)


@claim("hot-path", "10 / s")
def rate(evidence: Evidence, source: str) -> Finding:
    """Rate of the hot path

    “The data at the start of the hot path is generated at a frequency of 10 Hz”

    reproduced: within {rate_percent:g} %"""
    (samples,) = evidence.hot_paths(source, "rm-ro")
    cells = [c for c in evidence.cells if (c["study"], c["source"]) == ("autoware", source)]
    durations = [c["duration_s"] for c in cells if "rm-ro" in c["executors"]]
    need(durations)
    value = len(samples) / sum(durations)
    near = abs(value / LIMITS.paper_rate_hz - 1) <= LIMITS.rate_percent / 100
    return Finding(graded(near, True), f"{value:.2f} per second arrive", f"{value:.2f} / s")


@claim("hot-path", "2.6", {PARTLY: MAXIMA, NOT: DISTURBED})
def slowdown(evidence: Evidence, source: str) -> Finding:
    """Slowdown of default on the hot path

    “the default ROS 2 executor has a 2.6x slowdown along the hot path”

    reproduced: the ratio of worst cases lies within a factor of {slowdown_factor:g}; partly: the default executor
    is slower"""
    pair = ("default", "rm-ro")
    if source == REAL:
        of_real = (evidence.real_hot_paths_ms(quantile, *pair) for quantile in ("max", "p99", "p50"))
        worst, p99, median = (f"{default / ours:.2f}" for default, ours in of_real)
        return Finding(NO_DATA, f"worst cases {worst}, p99 {p99}, medians {median}", worst)
    default, ours = evidence.hot_paths(source, *pair)
    ratios = {p: ratio(default, ours, p) for p in (1.0, 0.99, 0.5)}
    value, most = ratios[1.0].value, LIMITS.slowdown_factor
    within = LIMITS.paper_slowdown / most <= value <= LIMITS.paper_slowdown * most
    text = f"worst cases {ratios[1.0].text(2)}"
    if len(default.repetitions) > 1:
        text += f" (median of repetitions {default.middle_worst() / ours.middle_worst():.2f})"
    text += f", p99 {ratios[0.99].text(2)}, medians {ratios[0.5].text(2)}"
    return Finding(graded(within, True, value > 1), text, f"{value:.2f}")


@claim("hot-path", "best", dict.fromkeys((PARTLY, NOT), DISTURBED))
def best_worst_case(evidence: Evidence, source: str) -> Finding:
    """RM has the best worst case

    “our RM events executor has a better worst-case latency” than default, static and events

    reproduced: every other worst case is larger, the interval of the ratio above 1; partly: larger for some, or
    within noise"""
    executors = ("rm-ro", *OTHERS)
    if source == REAL:
        values = evidence.real_hot_paths_ms("max", *executors)
        text = ", ".join(f"{e} {v:.1f}" for e, v in zip(executors, values)) + " ms"
        return Finding(NO_DATA, text, f"{values[0]:.1f}, others ≥ {min(values[1:]):.1f} ms")
    ours, *others = found = evidence.hot_paths(source, *executors)
    if any(samples.too_few() for samples in found):
        return TOO_FEW
    ratios = [ratio(other, ours, 1.0) for other in others]
    told = [f"{e} {s.worst:.1f} ms ({r.text(2)} ×)" for e, s, r in zip(OTHERS, others, ratios)]
    verdict = graded(sum(r.above(1) for r in ratios), len(others), any(r.value > 1 for r in ratios))
    short = f"{ours.worst:.1f}, others ≥ {min(other.worst for other in others):.1f} ms"
    return Finding(verdict, f"rm-ro {ours.worst:.1f} ms, {', '.join(told)}", short)


@claim("hot-path", "yes", dict.fromkeys((PARTLY, NOT), DISTURBED))
def outperforms(evidence: Evidence, source: str) -> Finding:
    """RM outperforms significantly

    “significantly outperforming the other executors”

    reproduced: Cliff's delta of at least {large_effect} (a large effect) against each, rank test p ≤ {largest_p};
    partly: positive against some"""
    ours, *others = evidence.hot_paths(source, "rm-ro", *OTHERS)
    tests = [rank_test(ours, other) for other in others]
    deltas = [test.cliffs_delta for test in tests]
    significant = (not test.p_value > LIMITS.largest_p for test in tests)
    large = sum(d.value >= LIMITS.large_effect and sure for d, sure in zip(deltas, significant))
    least, greatest = min(d.value for d in deltas), max(d.value for d in deltas)
    text = ", ".join(f"{e} {d.text(2)}" for e, d in zip(OTHERS, deltas))
    verdict = graded(large, len(tests), greatest > 0)
    return Finding(verdict, f"Cliff's delta against {text}", f"δ ≥ {least:.2f}")
