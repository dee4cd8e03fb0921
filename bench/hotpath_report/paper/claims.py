# SPDX-License-Identifier: Apache-2.0
"""The claims of claims.toml, and their verdicts."""

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from typing import Any

from hotpath_report.errors import Missing
from hotpath_report.paper import checks
from hotpath_report.paper.cells import ITEMS
from hotpath_report.paper.checks import LIMITS, NO_DATA, NOT, PARTLY, Finding
from hotpath_report.paper.evidence import Evidence
from hotpath_report.paper.reference import REAL
from hotpath_report.run import SOURCES

TEXTS = ("item", "title", "quote", "rule", "paper")
STUDIES = {item.name: item.studies for item in ITEMS}


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper with its check; `paper` is the paper's value."""

    name: str
    item: str
    title: str
    quote: str
    paper: str
    rule: str
    check: Callable[..., Finding]  # of evidence, a source and `options`; raises Missing
    options: dict[str, str]
    why: dict[str, str]  # reason by verdict

    @property
    def sources(self) -> tuple[str, ...]:
        """Where the findings come from that decide."""
        return ("analysis",) if self.check in checks.COMPUTED else SOURCES

    def found(self, evidence: Evidence, source: str) -> Finding | None:
        """The finding of the check; None without data."""
        try:
            return self.check(evidence, source, **self.options)
        except Missing:
            return None


def claims() -> Iterator[Claim]:
    """All claims of claims.toml with their limits filled in."""
    reasons = checks.CLAIMS["reasons"]
    for entry in checks.CLAIMS["claim"]:
        for executor in entry.get("executors", [""]):
            words = {**vars(LIMITS), "words": executor.replace("-ro", ", RO").replace("-re", ", RE")}
            texts = {key: entry[key].format(**words).strip() for key in TEXTS}
            why = {verdict: entry.get(f"why_{verdict}", "") for verdict in (PARTLY, NOT)}
            why = entry.get("why", {}).get(executor, why)
            yield Claim(
                name=f"{entry['name']}-{executor}" if executor else entry["name"],
                check=getattr(checks, entry.get("check", entry["name"].replace("-", "_"))),
                options=entry.get("options", {}) | ({"executor": executor} if executor else {}),
                why={verdict: reasons.get(text, text).strip() for verdict, text in why.items() if text},
                **texts,
            )


CLAIMS = tuple(claims())


@dataclass(frozen=True)
class Verdict:
    """A claim with its findings by source."""

    claim: Claim
    findings: dict[str, Finding | None]
    real: Finding | None  # of the real ROS 2 stack, without a verdict
    cells: dict[str, str]  # by source: the cells behind the finding

    @property
    def known(self) -> dict[str, Finding]:
        """The findings of sources with data."""
        return {source: finding for source, finding in self.findings.items() if finding}

    @property
    def decided(self) -> dict[str, str]:
        """Verdicts of sources with enough data."""
        return {source: f.verdict for source, f in self.known.items() if f.verdict != NO_DATA}

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
        short: dict[str, str] = {source: f.short if f else "not run" for source, f in self.findings.items()}
        computed = short.get("analysis", short.get("simulated", ""))
        return [self.claim.paper, computed, short.get("live", ""), self.real.short if self.real else ""]

    @property
    def details(self) -> list[tuple[str, str]]:
        """Each source with its verdict, and its finding in words."""
        names = {"analysis": "computed"}
        found = [(f"{names.get(source, source)}, {f.verdict}", f.text) for source, f in self.known.items()]
        return [*found, *([("real ROS 2 stack", self.real.text)] if self.real else [])]

    def as_json(self) -> dict[str, Any]:
        """The entry in claims.json."""
        texts = {key: getattr(self.claim, key) for key in TEXTS}
        real = {"text": self.real.text, "short": self.real.short} if self.real else None
        found = {source: {**vars(f), "cells": self.cells[source]} for source, f in self.known.items()}
        more = {"verdict": self.verdict, "why": self.why, "findings": found}
        return {"claim": self.claim.name, **texts, "real": real, **more}


def judge(evidence: Evidence, items: Collection[str] | None = None) -> list[Verdict]:
    """The verdicts on all claims of the items."""
    verdicts = []
    for claim in (claim for claim in CLAIMS if items is None or claim.item in items):
        executor = claim.options.get("executor", "")
        cells = {s: evidence.names_of_cells(STUDIES[claim.item], s, executor) for s in claim.sources}
        found = {source: claim.found(evidence, source) for source in claim.sources}
        real = claim.found(evidence, REAL) if claim.sources == SOURCES else None
        verdicts.append(Verdict(claim, found, real, cells))
    return verdicts
