# SPDX-License-Identifier: Apache-2.0
"""The claims of claims.toml, and their verdicts."""

import importlib
import tomllib
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hotpath_report.paper import findings
from hotpath_report.paper.evidence import Evidence
from hotpath_report.paper.findings import NO_DATA, NOT, PARTLY, Finding
from hotpath_report.paper.items import ITEMS
from hotpath_report.paper.reference import REAL
from hotpath_report.run import SOURCES

Check = Callable[[Evidence, str, str], Finding | None]


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper with its check."""

    name: str
    item: str
    title: str  # a few words
    quote: str
    paper: str  # the paper's value
    rule: str
    check: Check
    real: bool = False  # whether the real ROS 2 stack was asked
    executor: str = ""
    why: dict[str, str] = field(default_factory=dict)  # reason of a verdict
    analytical: bool = False


def check_named(name: str) -> Check:
    """`timers.drops` is drops() of checks_timers."""
    room, _, function = name.partition(".")
    found: Check = getattr(importlib.import_module(f"hotpath_report.paper.checks_{room}"), function)
    return found


def claims() -> Iterator[Claim]:
    """All claims of claims.toml, with thresholds filled in."""
    content = tomllib.loads(Path(__file__).with_name("claims.toml").read_text(encoding="utf-8"))
    for entry in content["claim"]:
        for executor in entry.get("executors", [""]):
            words = {**vars(findings), "words": content["words"].get(executor, "")}
            texts = {
                key: entry[key].format(**words).strip() for key in ("item", "title", "quote", "paper", "rule")
            }
            why = {verdict: entry.get(f"why_{verdict}", "") for verdict in (PARTLY, NOT)}
            why = entry.get("why", {}).get(executor, why)
            yield Claim(
                name="-".join(filter(None, (entry["name"], executor))),
                check=check_named(entry["check"]),
                real=entry.get("real", False),
                executor=executor,
                why={
                    verdict: content["reasons"].get(text, text).strip()
                    for verdict, text in why.items()
                    if text
                },
                analytical=entry.get("analytical", False),
                **texts,
            )


CLAIMS = tuple(claims())


@dataclass(frozen=True)
class Verdict:
    """A claim with what was found, by source."""

    claim: Claim
    findings: dict[str, Finding | None]
    real: Finding | None  # of the real ROS 2 stack; its verdict is not asked
    cells: dict[str, str]  # by source: the cells behind the finding

    @property
    def decided(self) -> dict[str, str]:
        """Verdict of each source that had enough data for one."""
        return {s: f.verdict for s, f in self.findings.items() if f is not None and f.verdict != NO_DATA}

    @property
    def verdict(self) -> str:
        """That of the sources; where they differ, partly."""
        found = set(self.decided.values())
        if not found:
            return NO_DATA
        return found.pop() if len(found) == 1 else PARTLY

    @property
    def why(self) -> str:
        """The reasons of each source's verdict; where sources differ, that they do."""
        found = self.decided
        reasons = [self.claim.why[v] for v in dict.fromkeys(found.values()) if v in self.claim.why]
        if len(set(found.values())) > 1:
            reasons.insert(0, "; ".join(f"{source}: {v}" for source, v in found.items()).capitalize() + ".")
        return " ".join(reasons)

    def value(self, source: str, short: bool = True) -> str:
        """What was found, in a few characters or in a sentence."""
        finding = self.findings.get(source)
        if finding is None:
            return "not run" if source in self.findings else ""
        return finding.short if short else finding.text

    def as_json(self) -> dict[str, Any]:
        """Its entry in claims.json."""
        claim = self.claim
        return {
            "claim": claim.name,
            "item": claim.item,
            "title": claim.title,
            "quote": claim.quote,
            "rule": claim.rule,
            "paper": claim.paper,
            "real": {"text": self.real.text, "short": self.real.short} if self.real else None,
            "verdict": self.verdict,
            "why": self.why,
            "findings": {
                source: {**vars(f), "cells": self.cells[source]} for source, f in self.findings.items() if f
            },
        }


def judge(evidence: Evidence, items: Collection[str] | None = None) -> list[Verdict]:
    """A verdict for each claim of the items."""
    verdicts, studies = [], {item.name: item.studies for item in ITEMS}
    for claim in CLAIMS:
        if items is not None and claim.item not in items:
            continue
        sources = ("analysis",) if claim.analytical else SOURCES
        found = {source: claim.check(evidence, source, claim.executor) for source in sources}
        cells = {s: evidence.names_of_cells(studies[claim.item], s, claim.executor) for s in sources}
        real = claim.check(evidence, REAL, claim.executor) if claim.real else None
        verdicts.append(Verdict(claim, found, real, cells))
    return verdicts
