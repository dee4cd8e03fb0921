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
        found = set(self.decided.values())
        if not found:
            return NO_DATA
        return found.pop() if len(found) == 1 else PARTLY

    @property
    def decided(self):
        """Verdict of each source that had enough data for one."""
        return {s: f.verdict for s, f in self.findings.items() if f is not None and f.verdict != NO_DATA}

    @property
    def why(self):
        """The reasons of each source's verdict; where sources differ, that they do."""
        found = self.decided
        reasons = [self.claim.why[v] for v in dict.fromkeys(found.values()) if v in self.claim.why]
        if len(set(found.values())) > 1:
            reasons.insert(0, "; ".join(f"{source}: {v}" for source, v in found.items()).capitalize() + ".")
        return " ".join(reasons)


REPEATEDLY = f"more than {checks.REPEATEDLY_PERCENT:g} % of the jobs"
DROP_RULE = f"reproduced: {REPEATEDLY} dropped on all three sets; partly: on some"
OVERRUN_RULE = f"reproduced: {REPEATEDLY} late on all three sets; partly: on some"
TEN_RULE = (
    f"reproduced: the largest rate lies within {checks.TEN_PERCENT_RANGE[0]} to {checks.TEN_PERCENT_RANGE[1]} %;"
    " partly: it is larger"
)
NONE_RULE = (
    f"reproduced: none; partly, live only: at most {checks.LIVE_LOSS_TOLERANCE_PERCENT:g} % of the jobs of each executor"
    " on each set"
)
BOUND_RULE = f"jobs above the bound of Table I — {NONE_RULE}; simulated with the paper's release cost"
DROPS = "“the default, static, and unmodified events executor repeatedly drop jobs”"
IMU_LATE = "“IMU tasks have deadline overruns on the Default, Static, and Events executors”"
EVENTS_RO_WHY = (
    "Release-only means that the timer management thread takes every timestamp when it is due. rcl's rule for late"
    " timers then never applies, and lateness shows as backlog in the queue and as response times, not as dropped"
    " jobs. The paper does not say with which option its unmodified events executor ran; release-and-execute does"
    " drop jobs."
)
NOISE_WHY = (
    "A virtual machine takes the processor away at times, for longer than a short period leaves room for; the column"
    " says how many of the jobs concerned belong to repetitions that were marked for it."
)
BOUND_WHY = (
    "The bound assumes a processor of its own. A virtual machine takes it away at times, which the analysis does not"
    " know."
)
DISTURBED_WHY = (
    "A machine that is shared with others delays all executors alike, and a worst case is a single delay; the section"
    " on noise says how much there was."
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
        checks.check_ten_percent,
        checks.real_ten_percent,
    ),
    Claim(
        "imu-loss",
        "dropped-jobs",
        "default and static lose far more than 10 % of the IMU's jobs on some sets (the total hides it)",
        "10 % of all",
        f"reproduced: each loses more than {checks.TEN_PERCENT_RANGE[1]} % of them on some set; partly: one of them",
        checks.check_imu_loss,
        checks.real_imu_loss,
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
            PARTLY: BOUND_WHY,
            NOT: BOUND_WHY,
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
        (
            "reproduced: the largest cost of a release here is at most the paper's, which is of a Raspberry Pi; partly:"
            " 99.9 % of them are; without the wake-up of the executor"
        ),
        checks.check_delta,
        analytical=True,
        why={PARTLY: "The largest values are interruptions of the machine, not work of the releaser."},
    ),
    Claim(
        "total-delta",
        "overhead",
        "“every timer task has an overhead of Δ = 0.84 ms”",
        "0.84 ms",
        (
            f"the paper's own figures agree: seven times the δ that yields Table I, within"
            f" {checks.TOTAL_DELTA_TOLERANCE_MS:g} ms"
        ),
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
            "reproduced: every other worst case is larger, the interval of the ratio above 1; partly: larger for some, or"
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
