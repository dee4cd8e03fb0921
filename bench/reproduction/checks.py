# SPDX-License-Identifier: Apache-2.0
"""The checks behind the claims: what each looks at, and from which value on it says reproduced, partly or not.

A check takes the evidence and one source (simulated, live, or analysis) and answers with a finding, or with None where
there are no data. A function `real_...` gives the real ROS 2 stack's value as text.
"""

import math
from dataclasses import dataclass

from cells import UTILISATIONS
from evidence import group_of
from inference import rank_test, ratio

REPRODUCED, PARTLY, NOT, NO_DATA = "reproduced", "partly", "not", "no data"

STOCK = ("default", "static", "events-ro", "events-re")
WAIT_SETS = ("default", "static")
PAPERS_OWN = ("rm-ro", "rm-re", "edf-ro", "edf-re")
LIVE_LOSS_TOLERANCE_PERCENT = 0.1
REPEATEDLY_PERCENT = LIVE_LOSS_TOLERANCE_PERCENT  # what counts as lost there must be more than what is excused here
TEN_PERCENT_RANGE = (5, 20)
TABLE_TOLERANCE_MS = 0.005
PAPER_DELTA_MS, PAPER_TOTAL_DELTA_MS, TOTAL_DELTA_TOLERANCE_MS = 0.12, 0.84, 0.01
ALMOST_90_RANGE = (85, 90)
PAPER_SLOWDOWN, SLOWDOWN_FACTOR = 2.6, 1.25
LARGE_EFFECT = 0.474
PAPER_RATE_HZ, RATE_TOLERANCE = 10, 0.02
TASKS = 7
DEADLINES_MS = {"IMU": 30, "Camera": 84, "LiDAR": 200}  # the periods


@dataclass(frozen=True)
class Finding:
    verdict: str
    text: str


def percents(values):
    return " / ".join("–" if v is None or math.isnan(v) else f"{v:.3g}" for v in values) + " %"


def counts(values):
    return " / ".join("–" if v is None else str(v) for v in values)


def above(estimate, neutral):
    """Whether it lies above `neutral` beyond noise; what is exact has no noise."""
    return estimate.value > neutral and (not estimate.has_interval or estimate.excludes(neutral))


def too_few(*groups):
    """Samples of a measurement that was too brief for an interval: they decide nothing."""
    return any(not s.exact and s.resampled() is None for s in groups)


TOO_FEW = "too few samples for an interval"


def of_all_sets(evidence, source, executor, study="timers"):
    """The runs at 60, 80 and 90 %; None unless all three are there."""
    runs = [evidence.runs(source, percent, executor, study) for percent in UTILISATIONS]
    return None if None in runs else runs


def none_lost(evidence, source, what, of, word):
    """That the paper's executors lose nothing. Live, the machine can take the processor away: up to a share of each
    executor's jobs on each set, and the text says how many of them belong to repetitions that were marked for it."""
    lost = jobs = marked = 0
    largest = 0.0
    for executor in PAPERS_OWN:
        runs = of_all_sets(evidence, source, executor)
        if runs is None:
            return None
        for percent, run in zip(UTILISATIONS, runs):
            here, noisy = run.total(what), evidence.marked("timers", percent, executor)
            lost += here
            jobs += run.total(of)
            largest = max(largest, 100 * here / run.total(of))
            marked += sum(n for t in run.tasks.values() for r, n in getattr(t, f"{what}_in").items() if r in noisy)
    text = f"{lost} of {jobs} jobs {word}"
    if source == "live" and lost:
        text += (
            f", {marked} of them in repetitions marked as noisy; at most {largest:.2g} % of one executor's on one set"
        )
    return Finding(none_verdict(source, largest), text)


def none_verdict(source, largest_percent):
    tolerated = source == "live" and largest_percent <= LIVE_LOSS_TOLERANCE_PERCENT
    return REPRODUCED if largest_percent == 0 else PARTLY if tolerated else NOT


# Dropped jobs


def check_no_drops(evidence, source):
    return none_lost(evidence, source, "skipped", "reached", "dropped")


def real_no_drops(reference):
    lost = [reference.total("dropped", p, e) for p in UTILISATIONS for e in ("rm-ro", "edf-ro")]
    released = [reference.total("released", p, e) for p in UTILISATIONS for e in ("rm-ro", "edf-ro")]
    return "" if None in lost else f"{sum(lost)} of {sum(released)} (RO)"


def check_drops(executor):
    def check(evidence, source):
        runs = of_all_sets(evidence, source, executor)
        if runs is None:
            return None
        losing = sum(r.drop_percent() > REPEATEDLY_PERCENT for r in runs)
        verdict = REPRODUCED if losing == len(runs) else PARTLY if losing else NOT
        totals, imu = (percents([r.drop_percent(group) for r in runs]) for group in (None, "imu"))
        return Finding(verdict, f"{totals} of all jobs, {imu} of the IMU's")

    return check


def real_drops(executor):
    def real(reference):
        rates = [[reference.drop_percent(p, executor, group) for p in UTILISATIONS] for group in (None, "imu")]
        return "" if None in rates[0] else f"{percents(rates[0])} of all, {percents(rates[1])} of the IMU's"

    return real


def largest_rate(evidence, source, executors, group=None):
    """(rate, executor, utilisation) of the largest drop rate."""
    rates = []
    for executor in executors:
        runs = of_all_sets(evidence, source, executor)
        if runs is None:
            return None
        rates += [(r.drop_percent(group), executor, percent) for r, percent in zip(runs, UTILISATIONS)]
    return max(rates)


def real_largest_rate(reference, executors, group=None):
    rates = [(reference.drop_percent(p, e, group), e, p) for p in UTILISATIONS for e in executors]
    return max((r for r in rates if r[0] is not None), default=None)


def rate_text(largest):
    rate, executor, percent = largest
    return f"{executor} at most {rate:.3g} % ({percent} % set)"


def check_ten_percent(evidence, source):
    largest = largest_rate(evidence, source, STOCK)
    if largest is None:
        return None
    low, high = TEN_PERCENT_RANGE
    verdict = REPRODUCED if low <= largest[0] <= high else PARTLY if largest[0] > high else NOT
    return Finding(verdict, rate_text(largest))


def real_ten_percent(reference):
    largest = real_largest_rate(reference, STOCK)
    return rate_text(largest) if largest else ""


def check_imu_loss(evidence, source):
    largest = [largest_rate(evidence, source, (executor,), "imu") for executor in WAIT_SETS]
    if None in largest:
        return None
    above_ten = sum(rate > TEN_PERCENT_RANGE[1] for rate, _, _ in largest)
    verdict = REPRODUCED if above_ten == len(largest) else PARTLY if above_ten else NOT
    return Finding(verdict, ", ".join(map(rate_text, largest)))


def real_imu_loss(reference):
    largest = [real_largest_rate(reference, (executor,), "imu") for executor in WAIT_SETS]
    return ", ".join(map(rate_text, filter(None, largest)))


# Response times


def check_table(evidence, _source):
    rows = [r for r in evidence.table("wcrt_table.csv") if r["delta_of"] == "paper"]
    if not rows:
        return None
    differences = [
        abs(int(r["bound_ns"]) / 1e6 - float(r["printed_ms"])) if r["bound_ns"] else math.inf for r in rows
    ]
    equal = sum(d <= TABLE_TOLERANCE_MS + 1e-9 for d in differences)
    verdict = REPRODUCED if equal == len(rows) else PARTLY if equal else NOT
    return Finding(verdict, f"{equal} of {len(rows)} entries equal, largest difference {max(differences):.4f} ms")


def check_schedulable(evidence, _source):
    rows = [r for r in evidence.table("wcrt_table.csv") if r["delta_of"] == "paper"]
    if not rows:
        return None
    shares = [int(r["bound_ns"]) / 1e6 / DEADLINES_MS[r["task"]] if r["bound_ns"] else math.inf for r in rows]
    met = sum(s <= 1 for s in shares)
    verdict = REPRODUCED if met == len(shares) else NOT
    return Finding(
        verdict,
        f"{met} of {len(shares)} bounds within their deadline, the tightest at {100 * max(shares):.1f} % of it",
    )


def check_bounds(evidence, source):
    """Against Table I, and beside it against the exact non-preemptive bound, which is at most that of the table."""
    study = "timers_with_release_cost" if source == "simulated" else "timers"
    table = {
        (r["task"].lower(), int(r["utilisation_percent"])): int(r["bound_ns"]) / 1e6
        for r in evidence.table("wcrt_table.csv")
        if r["delta_of"] == "paper" and r["bound_ns"]
    }
    over = over_exact = marked = jobs = 0
    highest = largest = 0.0
    for executor in ("rm-ro", "rm-re"):
        for percent in UTILISATIONS:
            runs = evidence.runs(source, percent, executor, study)
            exact = evidence.runs("simulated", percent, "rm-ro", "timers_with_release_cost")
            if runs is None or exact is None or not table:
                return None
            here, noisy = 0, evidence.marked("timers", percent, executor)
            for task, timer in runs.tasks.items():
                bound = table[group_of(task), percent]
                for repetition, values in timer.responses.items():
                    above_table = sum(v > bound for v in values)
                    here += above_table
                    marked += above_table if repetition in noisy else 0
                    over_exact += sum(v > exact.bounds_ms[task] for v in values)
                highest = max(highest, timer.worst_ms / bound)
            over += here
            jobs += runs.total("ran")
            largest = max(largest, 100 * here / runs.total("ran"))
    text = f"{over} of {jobs} jobs above Table I"
    if source == "live" and over:
        text += f", {marked} of them in repetitions marked as noisy"
    text += f", {over_exact} above the exact bound; the largest response is {100 * highest:.1f} % of the table's"
    return Finding(none_verdict(source, largest), text)


def check_no_overruns(evidence, source):
    return none_lost(evidence, source, "overruns", "ran", "late")


def real_no_overruns(reference):
    late = [reference.total("deadline_overruns", p, e) for p in UTILISATIONS for e in ("rm-ro", "edf-ro")]
    return "" if None in late else f"{sum(late)} (RO)"


def check_imu_overruns(executor):
    def check(evidence, source):
        runs = of_all_sets(evidence, source, executor)
        if runs is None:
            return None
        overruns, jobs = ([r.total(what, "imu") for r in runs] for what in ("overruns", "ran"))
        late = [100 * n > REPEATEDLY_PERCENT * of for n, of in zip(overruns, jobs)]
        verdict = REPRODUCED if all(late) else PARTLY if any(late) else NOT
        return Finding(verdict, f"{counts(overruns)} of {counts(jobs)} jobs")

    return check


def real_imu_overruns(executor):
    def real(reference):
        late = [reference.total("deadline_overruns", p, executor, "imu") for p in UTILISATIONS]
        return "" if None in late else counts(late)

    return real


def check_lidar_pays(evidence, source):
    larger, texts = 0, []
    for percent in UTILISATIONS:
        ours, stock = (evidence.runs(source, percent, e) for e in ("rm-ro", "default"))
        if ours is None or stock is None:
            return None
        a, b = stock.responses("lidar"), ours.responses("lidar")
        if not len(a) or not len(b):
            return None
        if too_few(a, b):
            return Finding(NO_DATA, TOO_FEW)
        delta = rank_test(a, b).cliffs_delta
        larger += above(delta, 0)
        texts.append(f"{delta.value:+.2f}")
    verdict = REPRODUCED if larger == len(texts) else PARTLY if larger else NOT
    return Finding(verdict, f"Cliff's delta {' / '.join(texts)} at {' / '.join(map(str, UTILISATIONS))} %")


# End-to-end bounds


def reductions(evidence):
    rows = [r for r in evidence.table("waters_summary.csv") if r["method"] == "brueggen_davare"]
    return sorted(rows, key=lambda r: float(r["utilisation"]))


def check_majority(evidence, _source):
    rows = reductions(evidence)
    if not rows:
        return None
    shares = [100 * float(r["positive_share"]) for r in rows]
    return Finding(REPRODUCED if min(shares) > 50 else NOT, f"{percents(shares)} of the chains are lower")


def check_negative_grow(evidence, _source):
    rows = reductions(evidence)
    if not rows:
        return None
    higher = [100 * (1 - float(r["positive_share"])) for r in rows]
    rising = all(a < b for a, b in zip(higher, higher[1:]))
    verdict = REPRODUCED if rising else PARTLY if higher[-1] > higher[0] else NOT
    return Finding(verdict, f"{percents(higher)} of the chains are not lower")


def check_almost_90(evidence, _source):
    rows = reductions(evidence)
    if not rows:
        return None
    largest = max(float(r["max"]) for r in rows)
    low, high = ALMOST_90_RANGE
    verdict = REPRODUCED if low <= largest <= high else PARTLY if largest > 50 else NOT
    return Finding(verdict, f"at most {largest:.1f} %")


# Overhead


def check_delta(evidence, _source):
    rows = {r["delta_of"]: int(r["delta_ns"]) / 1e6 for r in evidence.table("wcrt_table.csv")}
    most, nearly = rows.get("this machine (maximum)"), rows.get("this machine (p99.9)")
    if most is None or nearly is None:
        return None
    verdict = REPRODUCED if most <= PAPER_DELTA_MS else PARTLY if nearly <= PAPER_DELTA_MS else NOT
    return Finding(verdict, f"at most {1e3 * most:.1f} µs, 99.9 % below {1e3 * nearly:.2g} µs")


def check_total_delta(evidence, _source):
    rows = [int(r["delta_ns"]) for r in evidence.table("wcrt_table.csv") if r["delta_of"] == "paper"]
    if not rows:
        return None
    total = TASKS * rows[0] / 1e6
    verdict = REPRODUCED if abs(total - PAPER_TOTAL_DELTA_MS) <= TOTAL_DELTA_TOLERANCE_MS else NOT
    return Finding(verdict, f"{total:.3f} ms from δ = {rows[0] / 1e6:.3f} ms, the value behind Table I")


# Hot path


def hot_paths(evidence, source, executors):
    found = [evidence.latencies("autoware", source, executor) for executor in executors]
    return None if None in found else found


def check_slowdown(evidence, source):
    found = hot_paths(evidence, source, ("default", "rm-ro"))
    if found is None:
        return None
    default, ours = found
    worst, p99, median = (ratio(default, ours, p) for p in (1.0, 0.99, 0.5))
    within = PAPER_SLOWDOWN / SLOWDOWN_FACTOR <= worst.value <= PAPER_SLOWDOWN * SLOWDOWN_FACTOR
    verdict = REPRODUCED if within else PARTLY if worst.value > 1 else NOT
    text = f"worst cases {worst.text(2)}"
    if len(default.repetitions) > 1:
        text += f" (of the middle repetitions {default.middle_worst() / ours.middle_worst():.2f})"
    return Finding(verdict, f"{text}, p99 {p99.text(2)}, medians {median.text(2)}")


def real_slowdown(reference):
    names = {"max": "worst cases", "p99": "p99", "p50": "medians"}
    values = {q: [reference.hot_path_ms(e, q) for e in ("default", "rm-ro")] for q in names}
    if None in values["max"]:
        return ""
    return ", ".join(f"{name} {values[q][0] / values[q][1]:.2f}" for q, name in names.items())


OTHERS_ON_HOT_PATH = ("default", "static", "events-ro")


def check_best_worst_case(evidence, source):
    found = hot_paths(evidence, source, ("rm-ro", *OTHERS_ON_HOT_PATH))
    if found is None:
        return None
    if too_few(*found):
        return Finding(NO_DATA, TOO_FEW)
    ours, others = found[0], found[1:]
    ratios = [ratio(other, ours, 1.0) for other in others]
    beyond_noise = [above(r, 1) for r in ratios]
    verdict = REPRODUCED if all(beyond_noise) else PARTLY if any(r.value > 1 for r in ratios) else NOT
    told = [
        f"{name} {other.quantile(1.0):.1f} ms ({r.text(2)} ×)"
        for name, other, r in zip(OTHERS_ON_HOT_PATH, others, ratios)
    ]
    return Finding(verdict, f"rm-ro {ours.quantile(1.0):.1f} ms, {', '.join(told)}")


def real_best_worst_case(reference):
    values = [(e, reference.hot_path_ms(e, "max")) for e in ("rm-ro", *OTHERS_ON_HOT_PATH)]
    return "" if any(v is None for _, v in values) else ", ".join(f"{e} {v:.1f}" for e, v in values) + " ms"


def check_outperforms(evidence, source):
    found = hot_paths(evidence, source, ("rm-ro", *OTHERS_ON_HOT_PATH))
    if found is None:
        return None
    tests = [rank_test(found[0], other) for other in found[1:]]
    large = [t.cliffs_delta.value >= LARGE_EFFECT and not t.p_value > 0.01 for t in tests]
    verdict = REPRODUCED if all(large) else PARTLY if any(t.cliffs_delta.value > 0 for t in tests) else NOT
    text = ", ".join(f"{e} {t.cliffs_delta.text(2)}" for e, t in zip(OTHERS_ON_HOT_PATH, tests))
    return Finding(verdict, f"Cliff's delta against {text}")


def check_rate(evidence, source):
    samples = evidence.latencies("autoware", source, "rm-ro")
    facts = [c for c in evidence.cells if c["study"] == "autoware" and c["source"] == source]
    facts = [c for c in facts if "rm-ro" in ",".join(c["command"]).split(",")]
    if samples is None or not facts:
        return None
    rate = len(samples) / sum(c["duration_s"] for c in facts)
    verdict = REPRODUCED if abs(rate / PAPER_RATE_HZ - 1) <= RATE_TOLERANCE else NOT
    return Finding(verdict, f"{rate:.2f} per second arrive")
