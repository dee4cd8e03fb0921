# SPDX-License-Identifier: Apache-2.0
"""The claims of the paper's evaluation, each with its check, and the verdicts on them: Section VII-A (timers-only
sets), VII-B (bounds), VII-C (hot path). Docstrings are texts of the page, see claim()."""

import itertools
import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from operator import itemgetter

from hotpath_report.errors import Missing, need
from hotpath_report.figures.evaluation import PAPER
from hotpath_report.files import NS_PER_MS, Rows
from hotpath_report.paper.cells import EXECUTORS, ITEMS, UTILISATIONS
from hotpath_report.paper.claims import CLAIMS, COMPUTED, LIMITS, NO_DATA, TOO_FEW, Finding, Verdict, claim
from hotpath_report.paper.claims import graded, percents, ranged
from hotpath_report.paper.evidence import REAL, WITH_COST, Evidence, group_of
from hotpath_report.run import SOURCES
from hotpath_report.statistics import Estimate, grouped, percent_of, rank_test, ratio, total

PAIR, OTHERS = ("default", "rm-ro"), EXECUTORS["others_on_hot_path"]


def judge(evidence: Evidence) -> list[Verdict]:
    """The verdicts on all claims."""
    verdicts = [Verdict(made) for made in CLAIMS]
    for made, findings in ((verdict.claim, verdict.findings) for verdict in verdicts):
        for source in (*SOURCES, REAL) if made.sources == SOURCES else made.sources:
            with suppress(Missing):
                names = evidence.names_of_cells(ITEMS[made.item].studies, source, made.executor)
                findings[source] = replace(made.check(evidence, source), cells=names)
    return verdicts


def sums_of(
    evidence: Evidence, source: str, executor: str, group: str | None, *columns: str
) -> list[list[int]]:
    """Sums of columns on each of the three sets. Raises Missing unless the executor ran on all."""
    sets = [evidence.counts(percent, source, executor, group) for percent in UTILISATIONS]
    need(*sets)
    return [total(rows, *columns) for rows in sets]


def drop_rates(evidence: Evidence, source: str, executor: str, group: str | None = None) -> list[float]:
    """Drop rate on each set in percent."""
    return [percent_of(*sums) for sums in sums_of(evidence, source, executor, group, "skipped", "reached")]


def largest_rate(evidence: Evidence, source: str, executor: str, group: str | None) -> tuple[float, str]:
    """The largest drop rate of an executor, and a text with its set."""
    rates = zip(drop_rates(evidence, source, executor, group), UTILISATIONS)
    return max((r, f"{executor} at most {r:.3g} % ({percent} % set)") for r, percent in rates)


def losses(evidence: Evidence, source: str, rows: Rows, words: Sequence[str], more: str = "") -> Finding:
    """Jobs that must not be lost: reproduced if none was lost. Live, the machine can withhold the processor: a small
    share of each executor's jobs on each set counts as partly reproduced, and the text counts lost jobs in repetitions
    marked as disturbed, and ends with the largest share in percent in `more`. `words`: columns of lost and of all jobs,
    and what happened to lost ones."""
    lost, of, happened = words
    sets = grouped(rows, "utilisation_percent", "executor").values()
    short = " of ".join(map(str, total(rows, lost, of)))
    largest = max(percent_of(*total(of_set, lost, of)) for of_set in sets)
    text = f"{short} jobs {happened}"
    if source == "live" and largest > 0:
        cells = (c for c in evidence.marked_cells() if c["study"] == "timers")
        marked = {(*c["executors"], c["load_percent"], c["repetition"]) for c in cells}
        repetition = itemgetter("executor", "utilisation_percent", "repetition")
        disturbed = sum(row[lost] for row in rows if repetition(row) in marked)
        text += f", {disturbed} of them in repetitions marked as disturbed{more.format(largest)}"
    tolerated = source == "live" and largest <= LIMITS.tolerated_percent
    return Finding(graded(largest == 0, True, tolerated), text, short)


def none_lost(evidence: Evidence, source: str, *words: str) -> Finding:
    """The paper's executors lose nothing; for the real stack, only its measured executors count."""
    measured = (
        e for e in EXECUTORS["papers_own"] if source != REAL or evidence.counts(UTILISATIONS[0], source, e)
    )
    sets = [evidence.counts(percent, source, e) for e in measured for percent in UTILISATIONS]
    need(sets, *sets)
    rows = [row for of_set in sets for row in of_set]
    return losses(evidence, source, rows, words, "; at most {:.2g} % of one executor's on one set")


@claim("dropped-jobs", "0")
def no_drops(evidence: Evidence, source: str) -> Finding:
    """The paper's executors drop no job
    “our proposed events executor do not have any job drops for any configuration of the RM and EDF events executors”
    Rule: reproduced: none; partly, live only: at most {tolerated_percent:g} % of the jobs of each executor on each set
    """
    return none_lost(evidence, source, "skipped", "reached", "dropped")


@claim("dropped-jobs", "yes", EXECUTORS["stock"])
def drops(evidence: Evidence, source: str, executor: str) -> Finding:
    """{words}: drops jobs
    “the default, static, and unmodified events executor repeatedly drop jobs” — {words}
    Rule: reproduced: more than {tolerated_percent:g} % of the jobs dropped on all three sets; partly: on some
    """
    rates, imu = (drop_rates(evidence, source, executor, group) for group in (None, "imu"))
    losing = sum(rate > LIMITS.tolerated_percent for rate in rates)
    short = percents(rates)
    return Finding(graded(losing, len(rates)), f"{short} of all jobs, {percents(imu)} of the IMU's", short)


@claim("dropped-jobs", "10 %")
def ten_percent(evidence: Evidence, source: str) -> Finding:
    """Largest drop rate of all jobs
    “In some cases, a drop rate of 10 % is observed” — of all jobs
    Rule: reproduced: the largest rate lies within {ten_percent[0]} to {ten_percent[1]} %; partly: it is larger
    """
    largest, text = max(largest_rate(evidence, source, e, None) for e in EXECUTORS["stock"])
    limits = LIMITS.ten_percent
    return Finding(ranged(largest, limits, largest > limits[1]), text, f"{largest:.3g} %")


@claim("dropped-jobs", "10 % of all")
def imu_loss(evidence: Evidence, source: str) -> Finding:
    """Largest drop rate of the IMU alone
    default and static lose far more than 10 % of the IMU's jobs on some sets (the total hides it)
    Rule: reproduced: each loses more than {ten_percent[1]} % of them on some set; partly: one of them"""
    rates, texts = zip(*(largest_rate(evidence, source, e, "imu") for e in EXECUTORS["wait_sets"]))
    beyond = sum(rate > LIMITS.ten_percent[1] for rate in rates)
    return Finding(graded(beyond, len(rates)), ", ".join(texts), f"{max(rates):.3g} %")


def paper_rows(evidence: Evidence) -> Rows:
    """Rows of Table I with the paper's release cost; bounds in ms, infinite if there is none."""
    rows = [row for row in evidence.table("wcrt_table.csv") if row["delta_of"] == "paper"]
    need(rows)
    return [row | {"bound_ms": (row["bound_ns"] or math.inf) / NS_PER_MS} for row in rows]


@claim("wcrt-table", "nine values", sources=COMPUTED)
def table(evidence: Evidence, _source: str) -> Finding:
    """Table I: nine response-time bounds
    Table I: analytical worst-case response times
    Rule: reproduced: all nine within {table_ms:g} ms (the table's rounding); partly: some"""
    differences = [abs(row["bound_ms"] - row["printed_ms"]) for row in paper_rows(evidence)]
    equal = sum(difference <= LIMITS.table_ms + 1e-9 for difference in differences)
    short = f"{equal} of {len(differences)}"
    text = f"{short} entries equal, largest difference {max(differences):.4f} ms"
    return Finding(graded(equal, len(differences)), text, short)


@claim("wcrt-table", "all within", sources=COMPUTED)
def schedulable(evidence: Evidence, _source: str) -> Finding:
    """All deadlines are guaranteed
    “indicating no deadline misses … all tasks are guaranteed to meet their deadlines”
    Rule: reproduced: every bound is at most its deadline"""
    shares = [row["bound_ms"] / LIMITS.deadlines_ms[row["task"]] for row in paper_rows(evidence)]
    short = f"{sum(share <= 1 for share in shares)} of {len(shares)}"
    text = f"{short} bounds within their deadline, the tightest at {100 * max(shares):.1f} % of it"
    return Finding(graded(max(shares) <= 1, True), text, short)


@claim("wcrt-table", "0")
def bounds(evidence: Evidence, source: str) -> Finding:
    """No response above its bound (RM)
    “the response time bounds are not violated by our RM events executor”
    Rule: jobs above the bound of Table I — reproduced: none; partly, live only: at most {tolerated_percent:g} % of the
    jobs of each executor on each set; the simulation has the paper's release cost"""
    study = WITH_COST if source == "simulated" else "timers"
    jobs = grouped(evidence.responses, "study", "source", "executor", "utilisation_percent")
    table = {
        (row["utilisation_percent"], row["task"].lower()): row["bound_ms"] for row in paper_rows(evidence)
    }
    rows: Rows = []
    for executor, percent in itertools.product(EXECUTORS["with_bounds"], UTILISATIONS):
        found = jobs.get((study, source, executor, percent), [])
        exact = evidence.counts(percent, "simulated", "rm-ro", study=WITH_COST)
        need(found, exact)
        exact_ms = {row["task"]: row["bound_ms"] or math.inf for row in exact}
        for row in found:
            times, task, bound = row["response_ms"], row["task"], table[percent, group_of(row["task"])]
            counts = {
                "above": sum(ms > bound for ms in times),
                "exact": sum(ms > exact_ms[task] for ms in times),
            }
            rows.append(row | counts | {"jobs": len(times), "share": 100 * max(times) / bound})
    finding = losses(evidence, source, rows, ("above", "jobs", "above Table I"))
    highest, over_exact = max(row["share"] for row in rows), sum(row["exact"] for row in rows)
    more = f", {over_exact} above the exact bound; the largest response is {highest:.1f} % of the table's"
    return replace(finding, text=finding.text + more)


@claim("response-lidar", "0")
def no_overruns(evidence: Evidence, source: str) -> Finding:
    """The paper's executors miss no deadline
    “no deadline overruns are observed” (RM and EDF, RO and RE)
    Rule: reproduced: none; partly, live only: at most {tolerated_percent:g} % of the jobs of each executor on each set
    """
    return none_lost(evidence, source, "deadline_overruns", "ran", "late")


@claim("response-imu", "yes", EXECUTORS["stock"])
def imu_overruns(evidence: Evidence, source: str, executor: str) -> Finding:
    """{words}: IMU jobs are late
    “IMU tasks have deadline overruns on the Default, Static, and Events executors” — {words}
    Rule: reproduced: more than {tolerated_percent:g} % of the jobs late on all three sets; partly: on some"""
    sums = sums_of(evidence, source, executor, "imu", "deadline_overruns", "ran")
    late = sum(percent_of(*of) > LIMITS.tolerated_percent for of in sums)
    overruns, jobs = (" / ".join(map(str, numbers)) for numbers in zip(*sums))
    return Finding(graded(late, len(sums)), f"{overruns} of {jobs} jobs", overruns)


@claim("response-lidar", "yes")
def lidar_pays(evidence: Evidence, source: str) -> Finding:
    """LiDAR jobs take longer under RM
    “static-priority scheduling … leading to an increase of response time (see Figure: LiDAR)”
    Rule: reproduced: RM's LiDAR responses exceed the default executor's on all three sets, beyond noise; partly: on
    some"""
    deltas = []
    for percent in UTILISATIONS:
        default, ours = (evidence.response_times(percent, source, e, "lidar") for e in PAIR)
        need(default, ours)
        if default.too_few() or ours.too_few():
            return TOO_FEW
        deltas.append(rank_test(default, ours).cliffs_delta)
    values = " / ".join(f"{d.value:+.2f}" for d in deltas)
    text = f"Cliff's delta {values} at {' / '.join(map(str, UTILISATIONS))} %"
    return Finding(graded(sum(d.above(0) for d in deltas), len(deltas)), text, values)


def reductions(evidence: Evidence, column: str) -> list[float]:
    """Results of the paper's method by utilisation."""
    rows = [row for row in evidence.table("waters_summary.csv") if row["method"] == PAPER]
    return [row[column] for row in sorted(rows, key=itemgetter("utilisation"))]


@claim("end-to-end", "> 50 %", sources=COMPUTED)
def majority(evidence: Evidence, _source: str) -> Finding:
    """Most chains get a smaller bound
    “the majority of chains have lower end-to-end latency when using the RM events executor”
    Rule: reproduced: more than half of the chains at every utilisation"""
    lower = [100 * share for share in reductions(evidence, "positive_share")]
    return Finding(
        graded(min(lower) > 50, True), f"{percents(lower)} of the chains are lower", percents(lower)
    )


@claim("end-to-end", "rising", sources=COMPUTED)
def negative(evidence: Evidence, _source: str) -> Finding:
    """Fewer chains gain at higher utilisation
    “As the utilization level increases, the number of chains with a higher end-to-end latency increases”
    Rule: reproduced: the share of chains that are not lower rises with utilisation; partly: only from the first to the
    last"""
    higher = [100 * (1 - share) for share in reductions(evidence, "positive_share")]
    verdict = graded(higher == sorted(set(higher)), True, higher[-1] > higher[0])
    return Finding(verdict, f"{percents(higher)} of the chains are not lower", percents(higher))


@claim("end-to-end", "almost 90 %", sources=COMPUTED)
def almost_90(evidence: Evidence, _source: str) -> Finding:
    """Largest reduction of a bound
    “In some cases, we observe a normalized reduction … of almost 90 %”
    Rule: reproduced: the largest reduction lies within {almost_90[0]} to {almost_90[1]} %; partly: above 50 %
    """
    largest = max(reductions(evidence, "max"))
    short = f"{largest:.1f} %"
    return Finding(ranged(largest, LIMITS.almost_90, largest > 50), f"at most {short}", short)


@claim("overhead", "0.12 ms", sources=COMPUTED)
def delta(evidence: Evidence, _source: str) -> Finding:
    """Cost of a release, δ
    “a job release takes up to δ = 0.12 ms”
    Rule: reproduced: the largest cost of a release here is at most the paper's (on a Raspberry Pi); partly: 99.9 % of
    the costs are; without waking the executor"""
    us = {row["delta_of"]: row["delta_ns"] / 1e3 for row in evidence.table("wcrt_table.csv")}
    most, nearly = (us[f"this machine ({of})"] for of in ("maximum", "p99.9"))
    short, limit = f"{nearly:.2g} µs", LIMITS.paper_delta_us
    verdict = graded(most <= limit, True, nearly <= limit)
    return Finding(verdict, f"at most {most:.1f} µs, 99.9 % below {short}", f"99.9 % < {short}")


@claim("overhead", "0.84 ms", sources=COMPUTED)
def total_delta(evidence: Evidence, _source: str) -> Finding:
    """Overhead of a timer, Δ
    “every timer task has an overhead of Δ = 0.84 ms”
    Rule: reproduced: seven times the δ behind Table I equals Δ within {total_delta_ms:g} ms"""
    one = paper_rows(evidence)[0]["delta_ns"] / NS_PER_MS
    near = abs(LIMITS.tasks * one - LIMITS.paper_total_delta_ms) <= LIMITS.total_delta_ms
    short = f"{LIMITS.tasks * one:.3f} ms"
    return Finding(graded(near, True), f"{short} from δ = {one:.3f} ms, the value behind Table I", short)


@claim("hot-path", "10 / s")
def rate(evidence: Evidence, source: str) -> Finding:
    """Rate of the hot path
    “The data at the start of the hot path is generated at a frequency of 10 Hz”
    Rule: reproduced: within {rate_percent:g} %"""
    (samples,) = evidence.hot_paths(source, "rm-ro")
    cells = [c for c in evidence.cells if (c["study"], c["source"]) == ("autoware", source)]
    durations = [c["duration_s"] for c in cells if "rm-ro" in c["executors"]]
    need(durations)
    value = len(samples) / sum(durations)
    near = abs(value / LIMITS.paper_rate_hz - 1) <= LIMITS.rate_percent / 100
    return Finding(graded(near, True), f"{value:.2f} per second arrive", f"{value:.2f} / s")


@claim("hot-path", "2.6")
def slowdown(evidence: Evidence, source: str) -> Finding:
    """Slowdown of default on the hot path
    “the default ROS 2 executor has a 2.6x slowdown along the hot path”
    Rule: reproduced: the ratio of worst cases lies within a factor of {slowdown_factor:g}; partly: the default executor
    is slower"""
    middle = ""
    if source == REAL:
        of_real = (evidence.real_hot_paths_ms(quantile, *PAIR) for quantile in ("max", "p99", "p50"))
        ratios = [Estimate(default / ours) for default, ours in of_real]
    else:
        default, ours = evidence.hot_paths(source, *PAIR)
        ratios = [ratio(default, ours, p) for p in (1.0, 0.99, 0.5)]
        if len(default.repetitions) > 1:
            middle = f" (median of repetitions {default.middle_worst() / ours.middle_worst():.2f})"
    worst, p99, median = (ratio.text(2) for ratio in ratios)
    value, most, papers = ratios[0].value, LIMITS.slowdown_factor, LIMITS.paper_slowdown
    verdict = NO_DATA if source == REAL else ranged(value, (papers / most, papers * most), value > 1)
    text = f"worst cases {worst}{middle}, p99 {p99}, medians {median}"
    return Finding(verdict, text, f"{value:.2f}", slowdown=ratios[0])


@claim("hot-path", "best")
def best_worst_case(evidence: Evidence, source: str) -> Finding:
    """RM has the best worst case
    “our RM events executor has a better worst-case latency” than default, static and events
    Rule: reproduced: every other worst case is larger, the interval of the ratio above 1; partly: larger for some, or
    within noise"""
    executors = ("rm-ro", *OTHERS)
    if source == REAL:
        worst = evidence.real_hot_paths_ms("max", *executors)
        verdict, text = NO_DATA, ", ".join(f"{e} {v:.1f}" for e, v in zip(executors, worst)) + " ms"
    else:
        ours, *others = found = evidence.hot_paths(source, *executors)
        if any(samples.too_few() for samples in found):
            return TOO_FEW
        ratios, worst = [ratio(other, ours, 1.0) for other in others], [samples.worst for samples in found]
        told = [f"{e} {v:.1f} ms ({r.text(2)} ×)" for e, v, r in zip(OTHERS, worst[1:], ratios)]
        verdict = graded(sum(r.above(1) for r in ratios), len(others), any(r.value > 1 for r in ratios))
        text = ", ".join([f"rm-ro {worst[0]:.1f} ms", *told])
    return Finding(verdict, text, f"{worst[0]:.1f}, others ≥ {min(worst[1:]):.1f} ms")


@claim("hot-path", "yes")
def outperforms(evidence: Evidence, source: str) -> Finding:
    """RM outperforms significantly
    “significantly outperforming the other executors”
    Rule: reproduced: Cliff's delta of at least {large_effect} (a large effect) against each, rank test p ≤ {largest_p};
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
