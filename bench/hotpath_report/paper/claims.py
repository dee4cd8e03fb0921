# SPDX-License-Identifier: Apache-2.0
"""What a claim of the paper's evaluation is, and a verdict on it; checks.py has the claims."""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
from types import SimpleNamespace
from typing import Any

from hotpath_report.paper.cells import read_spec
from hotpath_report.paper.evidence import REAL
from hotpath_report.run import SOURCES
from hotpath_report.statistics import Estimate

REPRODUCED, PARTLY, NOT, NO_DATA = "reproduced", "partly", "not", "no data"
COMPUTED = ("analysis",)  # the source of claims that need no run
TEXTS = ("item", "title", "quote", "rule", "paper")
SPEC = read_spec("claims.toml")
LIMITS: Any = SimpleNamespace(**SPEC["limits"])


@dataclass(frozen=True)
class Finding:
    """A verdict with its reason, as a sentence and in short."""

    verdict: str
    text: str
    short: str
    cells: str = ""  # behind it
    slowdown: Estimate | None = None


TOO_FEW = Finding(NO_DATA, "too few samples for an interval", "too few")
Check = Callable[..., Finding]
CLAIMS: list[SimpleNamespace] = []


def claim(
    item: str, paper: str, executors: Sequence[str] = ("",), sources: Sequence[str] = SOURCES
) -> Callable[[Check], Check]:
    """Makes a check a claim on an item, or one about each executor. A check takes the evidence, a source (simulated,
    live, or real: the real ROS 2 stack) and the executor; it returns a finding, or raises Missing without data. Its
    docstring has the claim's title in the first line, its quotation, and its rule, with limits in braces. `paper`: the
    paper's value."""

    def add(check: Check) -> Check:
        title, _, rest = str(check.__doc__).partition("\n")
        for executor in executors:
            words = {**vars(LIMITS), "words": executor.replace("-ro", ", RO").replace("-re", ", RE")}
            parts = [" ".join(part.split()).format(**words) for part in (title, *rest.split("Rule: "))]
            CLAIMS.append(
                SimpleNamespace(
                    **dict(zip(TEXTS, (item, *parts, paper))),
                    name="-".join(filter(None, (check.__name__.replace("_", "-"), executor))),
                    executor=executor,
                    check=partial(check, executor=executor) if executor else check,
                    sources=sources,
                )
            )
        return check

    return add


@dataclass(frozen=True)
class Verdict:
    """A claim with its findings by source, of sources with data; that of the real ROS 2 stack is last and decides
    nothing."""

    claim: SimpleNamespace
    findings: dict[str, Finding] = field(default_factory=dict)

    @property
    def verdict(self) -> str:
        """The common verdict of the sources with enough data; partly if they differ."""
        found = {f.verdict for source, f in self.findings.items() if source != REAL} - {NO_DATA}
        return NO_DATA if not found else found.pop() if len(found) == 1 else PARTLY

    @property
    def why(self) -> str:
        """The reasons of the sources' verdicts, after these verdicts if they differ."""
        found = {source: f.verdict for source, f in self.findings.items() if source != REAL}
        decided = {source: verdict for source, verdict in found.items() if verdict != NO_DATA}
        names = [f"{self.claim.name} {verdict}" for verdict in dict.fromkeys(decided.values())]
        reasons = [why for n in names for of, why in SPEC["reasons"].items() if re.fullmatch(of, n)]
        if len(names) > 1:
            reasons.insert(0, "; ".join(f"{s}: {v}" for s, v in decided.items()).capitalize() + ".")
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
        texts, found = {key: getattr(self.claim, key) for key in TEXTS}, dict(self.findings)
        real = found.pop(REAL, None)
        more = {"real": real and {"text": real.text, "short": real.short}, "verdict": self.verdict}
        keys = ("verdict", "text", "short", "cells")
        findings = {source: {key: getattr(f, key) for key in keys} for source, f in found.items()}
        return {"claim": self.claim.name, **texts, **more, "why": self.why, "findings": findings}


def graded(good: int | bool, of: int | bool, some: int | bool | None = None) -> str:
    """Reproduced if all are good, partly if some are."""
    return REPRODUCED if good == of else PARTLY if (good if some is None else some) else NOT


def ranged(value: float, limits: Sequence[float], some: bool) -> str:
    """Reproduced within limits, else partly if `some`."""
    return graded(limits[0] <= value <= limits[1], True, some)


def percents(values: Iterable[float]) -> str:
    """60 / 80 / 90 %."""
    return " / ".join(f"{v:.3g}" for v in values) + " %"
