# SPDX-License-Identifier: Apache-2.0
"""The claims of claims.toml, and their verdicts."""

from collections.abc import Collection, Iterator
from contextlib import suppress
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

from hotpath_report.errors import Missing
from hotpath_report.paper import checks
from hotpath_report.paper.cells import ITEMS
from hotpath_report.paper.checks import LIMITS, NO_DATA, NOT, PARTLY, Finding
from hotpath_report.paper.evidence import REAL, Evidence
from hotpath_report.run import SOURCES

TEXTS = ("item", "title", "quote", "rule", "paper")
STUDIES = {item.name: item.studies for item in ITEMS}


def claims() -> Iterator[SimpleNamespace]:
    """All claims of claims.toml: name and texts, with the limits filled in; the executor, if it is about one; the
    check with its options and the sources that decide; reasons by verdict."""
    reasons = checks.CLAIMS["reasons"]
    for entry in checks.CLAIMS["claim"]:
        check = getattr(checks, entry.get("check", entry["name"].replace("-", "_")))
        for executor in entry.get("executors", [""]):
            words = {**vars(LIMITS), "words": executor.replace("-ro", ", RO").replace("-re", ", RE")}
            why = {verdict: entry.get(f"why_{verdict}", "") for verdict in (PARTLY, NOT)}
            why = entry.get("why", {}).get(executor, why)
            yield SimpleNamespace(
                name=f"{entry['name']}-{executor}" if executor else entry["name"],
                executor=executor,
                check=check,
                options=entry.get("options", {}) | ({"executor": executor} if executor else {}),
                sources=("analysis",) if check in checks.COMPUTED else SOURCES,
                why={verdict: reasons.get(text, text).strip() for verdict, text in why.items() if text},
                **{key: entry[key].format(**words).strip() for key in TEXTS},
            )


@dataclass(frozen=True)
class Verdict:
    """A claim with its findings by source."""

    claim: SimpleNamespace
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
    for claim in (claim for claim in claims() if items is None or claim.item in items):
        cells: dict[str, str] = {}
        found: dict[str, Finding | None] = {}
        for source in (*claim.sources, REAL):
            cells[source] = evidence.names_of_cells(STUDIES[claim.item], source, claim.executor)
            found[source] = None
            if source != REAL or claim.sources == SOURCES:
                with suppress(Missing):
                    found[source] = claim.check(evidence, source, **claim.options)
        verdicts.append(Verdict(claim, found, found.pop(REAL), cells))
    return verdicts
