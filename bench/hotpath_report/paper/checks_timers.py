# SPDX-License-Identifier: Apache-2.0
"""Checks of Section VII-A: dropped jobs, deadline overruns, bounds and response times of the timers-only sets.

A check takes the evidence, a source (simulated, live, or real: the real ROS 2 stack) and its claim's executor, and
answers with a finding, or with None where there are no data.
"""

from collections.abc import Sequence

from hotpath_report.paper import findings as f
from hotpath_report.paper.cells import EXECUTORS, UTILISATIONS
from hotpath_report.paper.evidence import Evidence
from hotpath_report.paper.findings import Finding
from hotpath_report.paper.reference import REAL
from hotpath_report.samples import group_of
from hotpath_report.statistics import rank_test

WITH_COST = "timers_with_release_cost"


def none_verdict(source: str, largest_percent: float) -> str:
    """Reproduced where nothing was lost; partly where little was, live."""
    tolerated = source == "live" and largest_percent <= f.LIVE_LOSS_TOLERANCE_PERCENT
    return f.REPRODUCED if largest_percent == 0 else f.PARTLY if tolerated else f.NOT


def none_lost(evidence: Evidence, source: str, what: str, of: str, word: str) -> Finding | None:
    """That the paper's executors lose nothing. Live, the machine can take the processor away: up to a share of each
    executor's jobs on each set, and the text says how many of them belong to repetitions that were marked for it.
    """
    executors = [e for e in f.PAPERS_OWN if f.on_all_sets(evidence, source, e)]
    if len(executors) < len(f.PAPERS_OWN) and (source != REAL or not executors):
        return None
    runs, lost, jobs, marked, largest = evidence.timer_runs(), 0, 0, 0, 0.0
    for executor in executors:
        for percent in UTILISATIONS:
            rows = runs.rows(percent, source, executor)
            assert rows is not None
            noisy = rows[rows["repetition"].isin(evidence.marked("timers", percent, executor))]
            here, reached = int(rows[what].sum()), int(rows[of].sum())
            lost, jobs, marked = lost + here, jobs + reached, marked + int(noisy[what].sum())
            largest = max(largest, 100 * here / reached)
    text = f"{lost} of {jobs} jobs {word}"
    if source == "live" and lost:
        text += f", {marked} of them in repetitions marked as noisy; "
        text += f"at most {largest:.2g} % of one executor's on one set"
    return Finding(none_verdict(source, largest), text, f"{lost} of {jobs}")


def no_drops(evidence: Evidence, source: str, _executor: str) -> Finding | None:
    """No job of the paper's executors is dropped."""
    return none_lost(evidence, source, "skipped", "reached", "dropped")


def no_overruns(evidence: Evidence, source: str, _executor: str) -> Finding | None:
    """No job of the paper's executors is late."""
    return none_lost(evidence, source, "deadline_overruns", "ran", "late")


def drops(evidence: Evidence, source: str, executor: str) -> Finding | None:
    """The executor drops jobs on all sets."""
    if not f.on_all_sets(evidence, source, executor):
        return None
    runs = evidence.timer_runs()
    rates = [runs.drop_percent(p, source, executor) or 0 for p in UTILISATIONS]
    imu = [runs.drop_percent(p, source, executor, "imu") for p in UTILISATIONS]
    losing = sum(rate > f.REPEATEDLY_PERCENT for rate in rates)
    text = f"{f.percents(rates)} of all jobs, {f.percents(imu)} of the IMU's"
    return Finding(f.graded(losing, len(rates)), text, f.percents(rates))


Rate = tuple[float, str, int]  # percent, executor, utilisation


def rate_text(largest: Rate) -> str:
    """Of whom and where it is."""
    rate, executor, percent = largest
    return f"{executor} at most {rate:.3g} % ({percent} % set)"


def largest_rate(
    evidence: Evidence, source: str, executors: Sequence[str], group: str | None = None
) -> Rate | None:
    """The largest drop rate; None unless all executors ran on all sets."""
    if not f.on_all_sets(evidence, source, *executors):
        return None
    runs = evidence.timer_runs()
    return max((runs.drop_percent(p, source, e, group) or 0, e, p) for e in executors for p in UTILISATIONS)


def ten_percent(evidence: Evidence, source: str, _executor: str) -> Finding | None:
    """The largest drop rate of all jobs."""
    largest = largest_rate(evidence, source, f.STOCK)
    if largest is None:
        return None
    low, high = f.TEN_PERCENT_RANGE
    verdict = f.graded(low <= largest[0] <= high, True, largest[0] > high)
    return Finding(verdict, rate_text(largest), f"{largest[0]:.3g} %")


def imu_loss(evidence: Evidence, source: str, _executor: str) -> Finding | None:
    """What the wait-set executors lose of the IMU's jobs."""
    largest = [rate for e in f.WAIT_SETS if (rate := largest_rate(evidence, source, (e,), "imu"))]
    if len(largest) < len(f.WAIT_SETS):
        return None
    beyond = sum(rate[0] > f.TEN_PERCENT_RANGE[1] for rate in largest)
    text = ", ".join(map(rate_text, largest))
    return Finding(f.graded(beyond, len(largest)), text, f"{max(largest)[0]:.3g} %")


def bounds(evidence: Evidence, source: str, _executor: str) -> Finding | None:
    """Against Table I, and beside it against the exact non-preemptive bound, which is at most that of the table."""
    runs = evidence.timer_runs(WITH_COST if source == "simulated" else "timers")
    exact_runs = evidence.timer_runs(WITH_COST)
    table = {
        (r["task"].lower(), r["utilisation_percent"]): r["bound_ms"]
        for _, r in f.paper_rows(evidence).iterrows()
    }
    over = over_exact = marked = jobs = 0
    highest = largest = 0.0
    for executor in EXECUTORS["with_bounds"]:
        for percent in UTILISATIONS:
            rows, exact = runs.jobs(percent, source, executor), exact_runs.rows(percent, "simulated", "rm-ro")
            if rows is None or exact is None or not table:
                return None
            bound = rows["task"].map(lambda task: table[group_of(task), percent])
            late = rows[rows["response_ms"] > bound]
            over_exact += int(
                (rows["response_ms"] > rows["task"].map(exact.set_index("task")["bound_ms"])).sum()
            )
            highest = max(highest, float((rows["response_ms"] / bound).max()))
            over, jobs = over + len(late), jobs + len(rows)
            marked += int(late["repetition"].isin(evidence.marked("timers", percent, executor)).sum())
            largest = max(largest, 100 * len(late) / len(rows))
    text = f"{over} of {jobs} jobs above Table I"
    if source == "live" and over:
        text += f", {marked} of them in repetitions marked as noisy"
    text += (
        f", {over_exact} above the exact bound; the largest response is {100 * highest:.1f} % of the table's"
    )
    return Finding(none_verdict(source, largest), text, f"{over} of {jobs}")


def imu_overruns(evidence: Evidence, source: str, executor: str) -> Finding | None:
    """The IMU's jobs are late on all sets."""
    if not f.on_all_sets(evidence, source, executor):
        return None
    runs = evidence.timer_runs()
    overruns, jobs = (
        [runs.total(what, p, source, executor, "imu") or 0 for p in UTILISATIONS]
        for what in ("deadline_overruns", "ran")
    )
    late = sum(100 * n > f.REPEATEDLY_PERCENT * of for n, of in zip(overruns, jobs))
    text = f"{f.counts(overruns)} of {f.counts(jobs)} jobs"
    return Finding(f.graded(late, len(jobs)), text, f.counts(overruns))


def lidar_pays(evidence: Evidence, source: str, _executor: str) -> Finding | None:
    """RM's LiDAR responses are longer than the default executor's."""
    runs, deltas = evidence.timer_runs(), []
    for percent in UTILISATIONS:
        ours, stock = (runs.samples(percent, source, e, "lidar") for e in ("rm-ro", "default"))
        if ours is None or stock is None:
            return None
        if f.too_few(ours, stock):
            return f.TOO_FEW
        deltas.append(rank_test(stock, ours).cliffs_delta)
    values = " / ".join(f"{d.value:+.2f}" for d in deltas)
    larger = sum(f.above(d, 0) for d in deltas)
    text = f"Cliff's delta {values} at {' / '.join(map(str, UTILISATIONS))} %"
    return Finding(f.graded(larger, len(deltas)), text, values)
