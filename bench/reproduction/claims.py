# SPDX-License-Identifier: Apache-2.0
"""The sentences of the paper's evaluation, each with its check.

`rule` states the check's thresholds and stands on the page. `why` gives the reason of a verdict; it states no number.
"""

from dataclasses import dataclass, field

import checks
from checks import NO_DATA, NOT, PARTLY


@dataclass(frozen=True)
class Claim:
    name: str
    item: str
    quote: str
    paper: str
    rule: str
    check: object  # (evidence, source) -> Finding or None
    real: object = lambda reference: ""  # the real ROS 2 stack's value
    why: dict = field(default_factory=dict)
    analytical: bool = False


@dataclass(frozen=True)
class Verdict:
    """One row of the page's table."""

    claim: Claim
    findings: dict  # by source
    real: str

    @property
    def verdict(self):
        found = {finding.verdict for finding in self.findings.values() if finding is not None}
        if not found:
            return NO_DATA
        return found.pop() if len(found) == 1 else PARTLY

    @property
    def why(self):
        """The reasons of each source's verdict; where sources differ, that they do."""
        found = {source: f.verdict for source, f in self.findings.items() if f is not None}
        reasons = [self.claim.why[v] for v in dict.fromkeys(found.values()) if v in self.claim.why]
        if len(set(found.values())) > 1:
            reasons.insert(0, "; ".join(f"{source}: {v}" for source, v in found.items()).capitalize() + ".")
        return " ".join(reasons)


DROP_RULE = "reproduced: jobs dropped on all three sets; partly: on some"
OVERRUN_RULE = "reproduced: late jobs on all three sets; partly: on some"
TEN_RULE = (
    f"reproduced: the largest rate lies within {checks.TEN_PERCENT_RANGE[0]} to {checks.TEN_PERCENT_RANGE[1]} %;"
    " partly: it is larger"
)
NONE_RULE = f"reproduced: none; partly: at most {checks.LIVE_LOSS_TOLERANCE_PERCENT:g} % of the jobs"
BOUND_RULE = (
    NONE_RULE
    + ", above the exact non-preemptive bound with the paper's release cost, which is at most that of Table I"
)
DROPS = "“the default, static, and unmodified events executor repeatedly drop jobs”"
IMU_LATE = "“IMU tasks have deadline overruns on the Default, Static, and Events executors”"
EVENTS_RO_WHY = (
    "Release-only means that the timer management thread takes every timestamp when it is due. rcl's rule for late"
    " timers then never applies, and lateness shows as backlog in the queue and as response times, not as dropped"
    " jobs. The paper does not say with which option its unmodified events executor ran; release-and-execute does"
    " drop jobs."
)
NOISE_WHY = (
    "The few jobs concerned belong to live repetitions, which the machine can disturb; see the marked repetitions."
)
DISTURBED_WHY = (
    "A machine that is shared with others delays all executors alike, and by more than they differ; see the marked"
    " repetitions."
)


def per_executor(name, item, quote, paper, rule, check, real, why):
    stock = (("default", "default"), ("static", "static"), ("events-ro", "events, RO"), ("events-re", "events, RE"))
    return tuple(
        Claim(f"{name}-{e}", item, f"{quote} — {words}", paper, rule, check(e), real(e), why.get(e, {}))
        for e, words in stock
    )


BOUNDARY_WHY = {
    PARTLY: (
        "Where a set's timers do or do not catch up is decided by its phases: on the set without losses every timer "
        "is served before its next timestamp, in simulation exactly and live up to jitter."
    )
}

CLAIMS = (
    Claim(
        "no-drops",
        "dropped-jobs",
        (
            "“our proposed events executor do not have any job drops for any configuration of the RM and EDF events"
            " executors”"
        ),
        "0",
        NONE_RULE,
        checks.check_no_drops,
        checks.real_no_drops,
        {PARTLY: NOISE_WHY, NOT: DISTURBED_WHY},
    ),
    *per_executor(
        "drops",
        "dropped-jobs",
        DROPS,
        "yes",
        DROP_RULE,
        checks.check_drops,
        checks.real_drops,
        {
            "default": BOUNDARY_WHY,
            "static": BOUNDARY_WHY,
            "events-re": BOUNDARY_WHY,
            "events-ro": {NOT: EVENTS_RO_WHY},
        },
    ),
    Claim(
        "ten-percent",
        "dropped-jobs",
        "“In some cases, a drop rate of 10 % is observed” — of all jobs",
        "10 %",
        TEN_RULE,
        checks.check_ten_percent(None),
        checks.real_ten_percent(None),
    ),
    Claim(
        "ten-percent-imu",
        "dropped-jobs",
        "“In some cases, a drop rate of 10 % is observed” — of one task's jobs",
        "10 %",
        TEN_RULE,
        checks.check_ten_percent("imu"),
        checks.real_ten_percent("imu"),
        {
            PARTLY: (
                "The loss of a total hides the loss of a task. The IMU has the shortest period, so a wait set that is"
                " busy with the long jobs lets several of its timestamps pass before it looks again; the real stack"
                " does the same."
            )
        },
    ),
    Claim(
        "table",
        "wcrt-table",
        "Table I: analytical worst-case response times",
        "nine values",
        f"reproduced: all nine within {checks.TABLE_TOLERANCE_MS:g} ms (the table's rounding); partly: some",
        checks.check_table,
        analytical=True,
    ),
    Claim(
        "schedulable",
        "wcrt-table",
        "“indicating no deadline misses … all tasks are guaranteed to meet their deadlines”",
        "all within",
        "reproduced: every bound is at most its deadline",
        checks.check_schedulable,
        analytical=True,
    ),
    Claim(
        "bounds",
        "wcrt-table",
        "“the response time bounds are not violated by our RM events executor”",
        "0",
        BOUND_RULE,
        checks.check_bounds,
        why={
            PARTLY: (
                "The bound assumes a processor of its own. A virtual machine takes it away at times, which the"
                " analysis does not know."
            ),
            NOT: (
                "The bound assumes a processor of its own. A machine that is shared with others breaks this"
                " assumption; see the marked repetitions."
            ),
        },
    ),
    Claim(
        "no-overruns",
        "response-lidar",
        "“no deadline overruns are observed” (RM and EDF, RO and RE)",
        "0",
        NONE_RULE,
        checks.check_no_overruns,
        checks.real_no_overruns,
        {PARTLY: NOISE_WHY, NOT: DISTURBED_WHY},
    ),
    *per_executor(
        "imu-overruns",
        "response-imu",
        IMU_LATE,
        "yes",
        OVERRUN_RULE,
        checks.check_imu_overruns,
        checks.real_imu_overruns,
        {"static": BOUNDARY_WHY, "default": BOUNDARY_WHY, "events-re": BOUNDARY_WHY},
    ),
    Claim(
        "lidar-pays",
        "response-lidar",
        "“static-priority scheduling … leading to an increase of response time (see Figure: LiDAR)”",
        "yes",
        (
            "reproduced: RM's LiDAR responses exceed the default executor's on all three sets, beyond noise; partly:"
            " on some"
        ),
        checks.check_lidar_pays,
        why={
            PARTLY: (
                "On a lightly loaded set a LiDAR job of the lowest priority waits for little under either executor;"
                " the price of the low priority appears with load."
            )
        },
    ),
    Claim(
        "majority",
        "end-to-end",
        "“the majority of chains have lower end-to-end latency when using the RM events executor”",
        "> 50 %",
        "reproduced: more than half of the chains at every utilisation",
        checks.check_majority,
        analytical=True,
    ),
    Claim(
        "negative",
        "end-to-end",
        "“As the utilization level increases, the number of chains with a higher end-to-end latency increases”",
        "rising",
        (
            "reproduced: the share of chains that are not lower rises with utilisation; partly: only from the first"
            " to the last"
        ),
        checks.check_negative_grow,
        analytical=True,
    ),
    Claim(
        "almost-90",
        "end-to-end",
        "“In some cases, we observe a normalized reduction … of almost 90 %”",
        "almost 90 %",
        (
            f"reproduced: the largest reduction lies within {checks.ALMOST_90_RANGE[0]} to"
            f" {checks.ALMOST_90_RANGE[1]} %; partly: above 50 %"
        ),
        checks.check_almost_90,
        analytical=True,
    ),
    Claim(
        "delta",
        "overhead",
        "“a job release takes up to δ = 0.12 ms”",
        "0.12 ms",
        "reproduced: the largest cost of a release here is at most the paper's; partly: 99.9 % of them are",
        checks.check_delta,
        analytical=True,
        why={PARTLY: "The largest values are interruptions of the machine, not work of the releaser."},
    ),
    Claim(
        "total-delta",
        "overhead",
        "“every timer task has an overhead of Δ = 0.84 ms”",
        "0.84 ms",
        f"reproduced: within {checks.TOTAL_DELTA_TOLERANCE_MS:g} ms",
        checks.check_total_delta,
        analytical=True,
    ),
    Claim(
        "rate",
        "hot-path",
        "“The data at the start of the hot path is generated at a frequency of 10 Hz”",
        "10 / s",
        f"reproduced: within {100 * checks.RATE_TOLERANCE:g} %",
        checks.check_rate,
    ),
    Claim(
        "slowdown",
        "hot-path",
        "“the default ROS 2 executor has a 2.6x slowdown along the hot path”",
        "2.6",
        (
            f"reproduced: the ratio of worst cases lies within a factor of {checks.SLOWDOWN_FACTOR:g}; partly: the"
            " default executor is slower"
        ),
        checks.check_slowdown,
        checks.real_slowdown,
        {
            PARTLY: (
                "The default executor is the slower one, by another factor than on the paper's machine: the ratio"
                " compares two maxima, which phases and single interruptions decide."
            ),
            NOT: DISTURBED_WHY,
        },
    ),
    Claim(
        "best-worst-case",
        "hot-path",
        "“our RM events executor has a better worst-case latency” than default, static and events",
        "best",
        (
            "reproduced: every other worst case is larger, the ratio's interval above 1; partly: larger for some, or"
            " within noise"
        ),
        checks.check_best_worst_case,
        checks.real_best_worst_case,
        {PARTLY: DISTURBED_WHY, NOT: DISTURBED_WHY},
    ),
    Claim(
        "outperforms",
        "hot-path",
        "“significantly outperforming the other executors”",
        "yes",
        (
            f"reproduced: Cliff's delta of at least {checks.LARGE_EFFECT} (a large effect) against each, rank test p"
            " ≤ 0.01; partly: positive against some"
        ),
        checks.check_outperforms,
        why={PARTLY: DISTURBED_WHY, NOT: DISTURBED_WHY},
    ),
)


def judge(evidence, reference, items=None):
    """A verdict for each claim of the items."""
    verdicts = []
    for claim in CLAIMS:
        if items is not None and claim.item not in items:
            continue
        sources = ("analysis",) if claim.analytical else ("simulated", "live")
        findings = {source: claim.check(evidence, source) for source in sources}
        verdicts.append(Verdict(claim, findings, claim.real(reference)))
    return verdicts
