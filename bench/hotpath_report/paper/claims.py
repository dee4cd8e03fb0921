# SPDX-License-Identifier: Apache-2.0
"""What a claim of the paper's evaluation is, and the verdicts on all of them; checks.py has the claims."""

from collections.abc import Callable, Collection, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

from hotpath_report.errors import Missing
from hotpath_report.hotpath_command import load
from hotpath_report.paper.cells import ITEMS
from hotpath_report.paper.evidence import REAL, Evidence
from hotpath_report.run import SOURCES

REPRODUCED, PARTLY, NOT, NO_DATA = "reproduced", "partly", "not", "no data"
COMPUTED = ("analysis",)  # the source of claims that need no run
TEXTS = ("item", "title", "quote", "rule", "paper")
STUDIES = {item.name: item.studies for item in ITEMS}

# Limits of the rules, and the paper's values.
LIMITS: Any = SimpleNamespace(
    tolerated_percent=0.1,  # of jobs lost live; losses of stock executors must exceed it
    ten_percent=(5, 20),
    table_ms=0.005,
    paper_delta_us=120,
    paper_total_delta_ms=0.84,
    total_delta_ms=0.01,
    almost_90=(85, 90),
    paper_slowdown=2.6,
    slowdown_factor=1.25,
    large_effect=0.474,
    largest_p=0.01,
    paper_rate_hz=10,
    rate_percent=2,
    tasks=7,
    deadlines_ms={"IMU": 30, "Camera": 84, "LiDAR": 200},  # the periods
)


# Reasons of several verdicts.
BOUNDARY = (
    "The phases of a set decide whether its timers catch up: on the set without losses every timer is served before "
    "its next timestamp, in simulation exactly and live up to jitter."
)
DISTURBED = (
    "A shared machine delays all executors alike, and a worst case is a single delay; the section on noise states its "
    "amount."
)
WITHHELD = (
    "A virtual machine sometimes withholds the processor for longer than the slack of a short period; the details "
    "count the affected jobs in repetitions marked as disturbed."
)
LOST_LIVE = {PARTLY: WITHHELD, NOT: DISTURBED}


@dataclass(frozen=True)
class Finding:
    """A verdict with its reason, as a sentence and in short."""

    verdict: str
    text: str
    short: str


TOO_FEW = Finding(NO_DATA, "too few samples for an interval", "too few")
Check = Callable[..., Finding]
CLAIMS: list[SimpleNamespace] = []


def claim(
    item: str,
    paper: str,
    why: dict[str, str] | None = None,
    executors: Sequence[str] = ("",),
    sources: Sequence[str] = SOURCES,
    why_of: dict[str, dict[str, str]] | None = None,
) -> Callable[[Check], Check]:
    """Makes a check a claim on an item, or one about each executor. A check takes the evidence, a source (simulated,
    live, or real: the real ROS 2 stack) and the executor; it returns a finding, or raises Missing without data. The
    paragraphs of its docstring are the claim's title, its quotation and its rule, in which names in braces are limits.
    `paper`: the paper's value; `why`: reasons by verdict, without numbers, `why_of` those of one executor."""

    def add(check: Check) -> Check:
        name = check.__name__.replace("_", "-")
        for executor in executors:
            words = {**vars(LIMITS), "words": executor.replace("-ro", ", RO").replace("-re", ", RE")}
            parts = [" ".join(part.split()).format(**words) for part in str(check.__doc__).split("\n\n")]
            CLAIMS.append(
                SimpleNamespace(
                    **dict(zip(TEXTS, (item, *parts, paper))),
                    name=f"{name}-{executor}" if executor else name,
                    executor=executor,
                    check=check,
                    sources=sources,
                    why=(why_of or {}).get(executor, why or {}),
                )
            )
        return check

    return add


@dataclass(frozen=True)
class Verdict:
    """A claim with its findings by source, of sources with data; that of the real ROS 2 stack is last and decides
    nothing."""

    claim: SimpleNamespace
    findings: dict[str, Finding]
    cells: dict[str, str]  # by source: the cells behind the finding

    @property
    def decided(self) -> dict[str, str]:
        """Verdicts of sources with enough data."""
        found = {source: f.verdict for source, f in self.findings.items() if source != REAL}
        return {source: verdict for source, verdict in found.items() if verdict != NO_DATA}

    @property
    def verdict(self) -> str:
        """The common verdict of the sources; partly if they differ."""
        found = set(self.decided.values())
        return NO_DATA if not found else found.pop() if len(found) == 1 else PARTLY

    @property
    def why(self) -> str:
        """The reasons of the verdicts, after the differing verdicts if sources differ."""
        verdicts = dict.fromkeys(self.decided.values())
        reasons = [self.claim.why[v] for v in verdicts if v in self.claim.why]
        if len(verdicts) > 1:
            reasons.insert(0, "; ".join(f"{s}: {v}" for s, v in self.decided.items()).capitalize() + ".")
        return " ".join(reasons)

    @property
    def values(self) -> list[str]:
        """Values of the paper, simulated or computed, live, and of the real ROS 2 stack."""
        short = dict.fromkeys(self.claim.sources, "not run") | {s: f.short for s, f in self.findings.items()}
        return [self.claim.paper, *(short.get(s, "") for s in (self.claim.sources[0], "live", REAL))]

    @property
    def details(self) -> list[tuple[str, str]]:
        """Each source with its verdict, and its finding in words."""
        names = {"analysis": "computed, {}", REAL: "real ROS 2 stack"}
        found = self.findings.items()
        return [(names.get(source, source + ", {}").format(f.verdict), f.text) for source, f in found]

    def as_json(self) -> dict[str, Any]:
        """The entry in claims.json."""
        texts = {key: getattr(self.claim, key) for key in TEXTS}
        found = {source: {**vars(f), "cells": self.cells[source]} for source, f in self.findings.items()}
        real = found.pop(REAL, None)
        more = {"real": real and {key: real[key] for key in ("text", "short")}, "verdict": self.verdict}
        return {"claim": self.claim.name, **texts, **more, "why": self.why, "findings": found}


def judge(evidence: Evidence, items: Collection[str] = tuple(STUDIES)) -> list[Verdict]:
    """The verdicts on all claims of the items."""
    load("paper.checks")  # adds its claims
    verdicts = []
    for made in (made for made in CLAIMS if made.item in items):
        verdicts.append(verdict := Verdict(made, {}, {}))
        for source in (*SOURCES, REAL) if made.sources == SOURCES else made.sources:
            with suppress(Missing):
                words = [made.executor] if made.executor else []
                verdict.findings[source] = made.check(evidence, source, *words)
            verdict.cells[source] = evidence.names_of_cells(STUDIES[made.item], source, made.executor)
    return verdicts


def graded(good: int | bool, of: int | bool, some: int | bool | None = None) -> str:
    """Reproduced if all are good, partly if some are."""
    return REPRODUCED if good == of else PARTLY if (good if some is None else some) else NOT


def percents(values: Iterable[float]) -> str:
    """60 / 80 / 90 %."""
    return " / ".join(f"{v:.3g}" for v in values) + " %"
