# SPDX-License-Identifier: Apache-2.0
"""Checks of Section VII-A: dropped jobs, deadline overruns, bounds and response times of the timers-only sets.

A check takes the evidence, a source (simulated, live, or real: the real ROS 2 stack) and the options of its claim, and
answers with a finding, or raises Missing where there are no data.
"""

from dataclasses import dataclass

import pandas as pd

from hotpath_report.paper import findings as f
from hotpath_report.paper.cells import EXECUTORS, UTILISATIONS
from hotpath_report.paper.evidence import Evidence
from hotpath_report.paper.findings import LIMITS, Finding
from hotpath_report.paper.reference import REAL
from hotpath_report.statistics import rank_test

WITH_COST = "timers_with_release_cost"


def on_all_sets(
    evidence: Evidence, source: str, executor: str, group: str | None = None
) -> list[pd.DataFrame]:
    """Counts of each of the three timers-only sets. Raises Missing unless the executor ran on all of them."""
    rows = [evidence.timer_runs().rows(percent, source, executor, group) for percent in UTILISATIONS]
    f.need(*rows)
    return rows


@dataclass
class Losses:
    """Jobs that should not be lost. Live, the machine can take the processor away: a share of each executor's jobs on
    each set is tolerated, and the text says how many of them belong to repetitions that were marked for it.
    """

    evidence: Evidence
    source: str
    lost: int = 0
    jobs: int = 0
    marked: int = 0
    largest_percent: float = 0

    def add(self, percent: int, executor: str, lost: pd.Series, jobs: int) -> None:
        """`lost`: of each repetition (the index), in any number of rows."""
        here = int(lost.sum())
        self.lost, self.jobs = self.lost + here, self.jobs + jobs
        self.marked += int(lost[lost.index.isin(self.evidence.marked(percent, executor))].sum())
        self.largest_percent = max(self.largest_percent, 100 * here / jobs)

    def finding(self, word: str, more: str = "", largest: bool = False) -> Finding:
        """Reproduced where nothing was lost; partly where little was, live."""
        short = f"{self.lost} of {self.jobs}"
        text = f"{short} jobs {word}"
        if self.source == "live" and self.lost:
            text += f", {self.marked} of them in repetitions marked as noisy"
            if largest:
                text += f"; at most {self.largest_percent:.2g} % of one executor's on one set"
        tolerated = self.source == "live" and self.largest_percent <= LIMITS.tolerated_percent
        verdict = f.REPRODUCED if self.largest_percent == 0 else f.PARTLY if tolerated else f.NOT
        return Finding(verdict, text + more, short)


def none_lost(evidence: Evidence, source: str, what: str, of: str, word: str) -> Finding:
    """That the paper's executors lose nothing; of the real stack, those that were measured."""
    known = set(evidence.timer_runs().counts.query("source == @source")["executor"])
    executors = [e for e in EXECUTORS["papers_own"] if source != REAL or e in known]
    f.need(executors)
    losses = Losses(evidence, source)
    for executor in executors:
        for percent, rows in zip(UTILISATIONS, on_all_sets(evidence, source, executor)):
            losses.add(percent, executor, rows.set_index("repetition")[what], int(rows[of].sum()))
    return losses.finding(word, largest=True)


def bounds(evidence: Evidence, source: str) -> Finding:
    """Against Table I, and beside it against the exact non-preemptive bound, which is at most that of the table."""
    runs = evidence.timer_runs(WITH_COST if source == "simulated" else "timers")
    exact_runs, losses = evidence.timer_runs(WITH_COST), Losses(evidence, source)
    rows = f.paper_rows(evidence)
    table = rows.assign(group=rows["task"].str.lower()).set_index(["utilisation_percent", "group"])[
        "bound_ms"
    ]
    over_exact, highest = 0, 0.0
    for executor in EXECUTORS["with_bounds"]:
        for percent in UTILISATIONS:
            jobs, exact = runs.jobs(percent, source, executor), exact_runs.rows(percent, "simulated", "rm-ro")
            f.need(jobs, exact)
            response = jobs.set_index("repetition")["response_ms"]
            bound = jobs["group"].map(table[percent]).to_numpy()
            over_exact += int(
                (jobs["response_ms"] > jobs["task"].map(exact.set_index("task")["bound_ms"])).sum()
            )
            highest = max(highest, float((response / bound).max()))
            losses.add(percent, executor, response > bound, len(jobs))
    more = (
        f", {over_exact} above the exact bound; the largest response is {100 * highest:.1f} % of the table's"
    )
    return losses.finding("above Table I", more)


def drop_rates(evidence: Evidence, source: str, executor: str, group: str | None = None) -> list[float]:
    """Percent on each set."""
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
    """Of whom and where it is."""
    rate, executor, percent = largest
    return f"{executor} at most {rate:.3g} % ({percent} % set)"


def ten_percent(evidence: Evidence, source: str) -> Finding:
    """The largest drop rate of all jobs."""
    largest = max(largest_rate(evidence, source, e) for e in EXECUTORS["stock"])
    low, high = LIMITS.ten_percent
    verdict = f.graded(low <= largest[0] <= high, True, largest[0] > high)
    return Finding(verdict, rate_text(largest), f"{largest[0]:.3g} %")


def imu_loss(evidence: Evidence, source: str) -> Finding:
    """What the wait-set executors lose of the IMU's jobs."""
    largest = [largest_rate(evidence, source, e, "imu") for e in EXECUTORS["wait_sets"]]
    beyond = sum(rate[0] > LIMITS.ten_percent[1] for rate in largest)
    text = ", ".join(map(rate_text, largest))
    return Finding(f.graded(beyond, len(largest)), text, f"{max(largest)[0]:.3g} %")


def imu_overruns(evidence: Evidence, source: str, executor: str) -> Finding:
    """The IMU's jobs are late on all sets."""
    sums = [
        rows[["deadline_overruns", "ran"]].sum() for rows in on_all_sets(evidence, source, executor, "imu")
    ]
    late = sum(100 * n > LIMITS.tolerated_percent * of for n, of in sums)
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
