# SPDX-License-Identifier: Apache-2.0
"""The claims of claims.toml, and their verdicts."""

import importlib
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from typing import Any

from hotpath_report.errors import Missing
from hotpath_report.paper import findings
from hotpath_report.paper.evidence import Evidence
from hotpath_report.paper.findings import NO_DATA, NOT, PARTLY, Finding
from hotpath_report.paper.items import ITEMS
from hotpath_report.paper.reference import REAL
from hotpath_report.run import SOURCES

TEXTS = ("item", "title", "quote", "rule", "paper")
Check = Callable[..., Finding]  # of evidence, a source and options; raises Missing


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper with its check; `paper` is the paper's value."""

    name: str
    item: str
    title: str
    quote: str
    paper: str
    rule: str
    check: Check
    options: dict[str, str]  # of the check
    why: dict[str, str]  # reason by verdict
    real: bool  # also check the real ROS 2 stack
    analytical: bool

    def found(self, evidence: Evidence, source: str) -> Finding | None:
        """The finding of the check; None without data."""
        try:
            return self.check(evidence, source, **self.options)
        except Missing:
            return None


def claims() -> Iterator[Claim]:
    """All claims of claims.toml with their limits filled in."""
    reasons = findings.CLAIMS["reasons"]
    for entry in findings.CLAIMS["claim"]:
        room, _, function = entry["check"].partition(".")  # `timers.drops` is drops() of checks_timers
        check = getattr(importlib.import_module(f"hotpath_report.paper.checks_{room}"), function)
        for executor in entry.get("executors", [""]):
            words = {**vars(findings.LIMITS), "words": findings.CLAIMS["words"].get(executor, "")}
            texts = {key: entry[key].format(**words).strip() for key in TEXTS}
            why = {verdict: entry.get(f"why_{verdict}", "") for verdict in (PARTLY, NOT)}
            why = entry.get("why", {}).get(executor, why)
            why = {v: reasons.get(text, text).strip() for v, text in why.items() if text}
            name = f"{entry['name']}-{executor}" if executor else entry["name"]
            options = entry.get("options", {}) | ({"executor": executor} if executor else {})
            flags = {key: entry.get(key, False) for key in ("real", "analytical")}
            yield Claim(name=name, check=check, options=options, why=why, **texts, **flags)


CLAIMS = tuple(claims())


@dataclass(frozen=True)
class Verdict:
    """A claim with its findings by source."""

    claim: Claim
    findings: dict[str, Finding | None]
    real: Finding | None  # of the real ROS 2 stack, without a verdict
    cells: dict[str, str]  # by source: the cells behind the finding

    @property
    def decided(self) -> dict[str, str]:
        """Verdicts of sources with enough data."""
        return {s: f.verdict for s, f in self.findings.items() if f is not None and f.verdict != NO_DATA}

    @property
    def verdict(self) -> str:
        """The common verdict of the sources; partly if they differ."""
        found = set(self.decided.values())
        if not found:
            return NO_DATA
        return found.pop() if len(found) == 1 else PARTLY

    @property
    def why(self) -> str:
        """The reasons of the verdicts, after the differing verdicts if sources differ."""
        found = self.decided
        reasons = [self.claim.why[v] for v in dict.fromkeys(found.values()) if v in self.claim.why]
        if len(set(found.values())) > 1:
            reasons.insert(0, "; ".join(f"{source}: {v}" for source, v in found.items()).capitalize() + ".")
        return " ".join(reasons)

    def value(self, source: str) -> str:
        """The finding in short."""
        finding = self.findings.get(source)
        return finding.short if finding else "not run" if source in self.findings else ""

    @property
    def values(self) -> list[str]:
        """Values of the paper, simulated or computed, live, and of the real ROS 2 stack."""
        computed = self.value("analysis") or self.value("simulated")
        return [self.claim.paper, computed, self.value("live"), self.real.short if self.real else ""]

    @property
    def details(self) -> list[tuple[str, str]]:
        """Each source with its verdict, and its finding in words."""
        names = {"analysis": "computed"}
        found = [(f"{names.get(s, s)}, {f.verdict}", f.text) for s, f in self.findings.items() if f]
        return [*found, *([("real ROS 2 stack", self.real.text)] if self.real else [])]

    def as_json(self) -> dict[str, Any]:
        """The entry in claims.json."""
        return {
            "claim": self.claim.name,
            **{key: getattr(self.claim, key) for key in TEXTS},
            "real": {"text": self.real.text, "short": self.real.short} if self.real else None,
            "verdict": self.verdict,
            "why": self.why,
            "findings": {
                source: {**vars(f), "cells": self.cells[source]} for source, f in self.findings.items() if f
            },
        }


def judge(evidence: Evidence, items: Collection[str] | None = None) -> list[Verdict]:
    """The verdicts on all claims of the items."""
    verdicts, studies = [], {item.name: item.studies for item in ITEMS}
    for claim in (claim for claim in CLAIMS if items is None or claim.item in items):
        sources = ("analysis",) if claim.analytical else SOURCES
        found = {source: claim.found(evidence, source) for source in sources}
        cells = {
            s: evidence.names_of_cells(studies[claim.item], s, claim.options.get("executor", ""))
            for s in sources
        }
        real = claim.found(evidence, REAL) if claim.real else None
        verdicts.append(Verdict(claim, found, real, cells))
    return verdicts
