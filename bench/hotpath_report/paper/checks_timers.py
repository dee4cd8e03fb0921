# SPDX-License-Identifier: Apache-2.0
"""Checks of Section VII-A: dropped jobs, deadline overruns, bounds and response times of the
timers-only sets. A check takes the evidence, a source (simulated, live, or real: the real ROS 2
stack) and the options of its claim. It returns a finding, or raises Missing without data."""

import itertools

import pandas as pd

from hotpath_report.paper import findings as f
from hotpath_report.paper.cells import EXECUTORS, UTILISATIONS
from hotpath_report.paper.evidence import Evidence
from hotpath_report.paper.findings import LIMITS, Finding
from hotpath_report.paper.reference import REAL
from hotpath_report.statistics import percent_of, rank_test

WITH_COST = "timers_with_release_cost"


def on_all_sets(
    evidence: Evidence, source: str, executor: str, group: str | None = None
) -> list[pd.DataFrame]:
    """Counts on each of the three sets. Raises Missing unless the executor ran on all."""
    rows = [evidence.timer_runs().rows(percent, source, executor, group) for percent in UTILISATIONS]
    f.need(*rows)
    return rows


def losses(
    evidence: Evidence, source: str, rows: pd.DataFrame, word: str, more: str = "", largest: bool = False
) -> Finding:
    """Jobs that must not be lost: reproduced if none was lost. Live, the machine can withhold the
    processor: a small share of each executor's jobs on each set counts as partly reproduced, and
    the text counts lost jobs in repetitions marked as disturbed. `rows`: setting, executor, repetition,
    lost, jobs."""
    short = f"{rows['lost'].sum()} of {rows['jobs'].sum()}"
    text = f"{short} jobs {word}"
    of_set = rows.groupby(["setting", "executor"])[["lost", "jobs"]].sum()
    largest_percent = max(map(percent_of, of_set["lost"], of_set["jobs"]))
    if source == "live" and largest_percent > 0:
        disturbed = [
            key in evidence.marked for key in zip(rows["setting"], rows["executor"], rows["repetition"])
        ]
        text += f", {rows['lost'][disturbed].sum()} of them in repetitions marked as disturbed"
        if largest:
            text += f"; at most {largest_percent:.2g} % of one executor's on one set"
    tolerated = source == "live" and largest_percent <= LIMITS.tolerated_percent
    verdict = f.REPRODUCED if largest_percent == 0 else f.PARTLY if tolerated else f.NOT
    return Finding(verdict, text + more, short)


def none_lost(evidence: Evidence, source: str, what: str, of: str, word: str) -> Finding:
    """The paper's executors lose nothing; for the real stack, only its measured executors count."""
    known = set(evidence.timer_runs().counts.query("source == @source")["executor"])
    executors = [e for e in EXECUTORS["papers_own"] if source != REAL or e in known]
    f.need(executors)
    rows = pd.concat(of_set for e in executors for of_set in on_all_sets(evidence, source, e))
    rows = rows.assign(lost=rows[what].astype(int), jobs=rows[of].astype(int))
    return losses(evidence, source, rows, word, largest=True)


def bounds(evidence: Evidence, source: str) -> Finding:
    """Responses against Table I and against the exact, tighter non-preemptive bound."""
    runs = evidence.timer_runs(WITH_COST if source == "simulated" else "timers")
    with_cost, printed = evidence.timer_runs(WITH_COST), f.paper_rows(evidence)
    printed = printed.assign(group=printed["task"].str.lower())
    table = printed.set_index(["utilisation_percent", "group"])["bound_ms"]
    frames = []
    for executor, percent in itertools.product(EXECUTORS["with_bounds"], UTILISATIONS):
        jobs, exact = runs.jobs(percent, source, executor), with_cost.rows(percent, "simulated", "rm-ro")
        f.need(jobs, exact)
        exact_ms = jobs["task"].map(exact.set_index("task")["bound_ms"])
        frames.append(jobs.assign(jobs=1, table_ms=jobs["group"].map(table[percent]), exact_ms=exact_ms))
    rows = pd.concat(frames)
    over_exact = int((rows["response_ms"] > rows["exact_ms"]).sum())
    highest = 100 * (rows["response_ms"] / rows["table_ms"]).max()
    more = f", {over_exact} above the exact bound; the largest response is {highest:.1f} % of the table's"
    rows["lost"] = (rows["response_ms"] > rows["table_ms"]).astype(int)
    return losses(evidence, source, rows, "above Table I", more)


def drop_rates(evidence: Evidence, source: str, executor: str, group: str | None = None) -> list[float]:
    """Drop rate on each set in percent."""
    on_all_sets(evidence, source, executor)
    return [evidence.timer_runs().drop_percent(p, source, executor, group) for p in UTILISATIONS]


def drops(evidence: Evidence, source: str, executor: str) -> Finding:
    """The executor drops jobs on all sets."""
    rates, imu = (drop_rates(evidence, source, executor, group) for group in (None, "imu"))
    losing = sum(rate > LIMITS.tolerated_percent for rate in rates)
    text = f"{f.percents(rates)} of all jobs, {f.percents(imu)} of the IMU's"
    return Finding(f.graded(losing, len(rates)), text, f.percents(rates))


Rate = tuple[float, str, int]  # percent, executor, utilisation


def largest_rate(evidence: Evidence, source: str, executor: str, group: str | None = None) -> Rate:
    """The executor's largest drop rate."""
    rates = drop_rates(evidence, source, executor, group)
    return max((rate, executor, percent) for rate, percent in zip(rates, UTILISATIONS))


def rate_text(largest: Rate) -> str:
    """The rate with its executor and set."""
    rate, executor, percent = largest
    return f"{executor} at most {rate:.3g} % ({percent} % set)"


def ten_percent(evidence: Evidence, source: str) -> Finding:
    """The largest drop rate of all jobs."""
    largest = max(largest_rate(evidence, source, e) for e in EXECUTORS["stock"])
    low, high = LIMITS.ten_percent
    verdict = f.graded(low <= largest[0] <= high, True, largest[0] > high)
    return Finding(verdict, rate_text(largest), f"{largest[0]:.3g} %")


def imu_loss(evidence: Evidence, source: str) -> Finding:
    """IMU jobs lost by the wait-set executors."""
    largest = [largest_rate(evidence, source, e, "imu") for e in EXECUTORS["wait_sets"]]
    beyond = sum(rate[0] > LIMITS.ten_percent[1] for rate in largest)
    text = ", ".join(map(rate_text, largest))
    return Finding(f.graded(beyond, len(largest)), text, f"{max(largest)[0]:.3g} %")


def imu_overruns(evidence: Evidence, source: str, executor: str) -> Finding:
    """The IMU's jobs are late on all sets."""
    sums = [
        rows[["deadline_overruns", "ran"]].sum() for rows in on_all_sets(evidence, source, executor, "imu")
    ]
    late = sum(percent_of(n, of) > LIMITS.tolerated_percent for n, of in sums)
    overruns, jobs = (" / ".join(f"{n:.0f}" for n in numbers) for numbers in zip(*sums))
    return Finding(f.graded(late, len(sums)), f"{overruns} of {jobs} jobs", overruns)


def lidar_pays(evidence: Evidence, source: str) -> Finding:
    """RM's LiDAR responses are longer than the default executor's."""
    runs, deltas = evidence.timer_runs(), []
    for percent in UTILISATIONS:
        ours, stock = (runs.samples(percent, source, e, "lidar") for e in ("rm-ro", "default"))
        f.need(ours, stock)
        if f.too_few(ours, stock):
            return f.TOO_FEW
        deltas.append(rank_test(stock, ours).cliffs_delta)
    values = " / ".join(f"{d.value:+.2f}" for d in deltas)
    larger = sum(f.above(d, 0) for d in deltas)
    text = f"Cliff's delta {values} at {' / '.join(map(str, UTILISATIONS))} %"
    return Finding(f.graded(larger, len(deltas)), text, values)
