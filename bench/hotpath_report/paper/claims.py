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
            why = {verdict: entry.get(f"why_{verdict}", entry.get("why", "")) for verdict in (PARTLY, NOT)}
            why = entry.get("why_of", {}).get(executor, why)
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
        real = {key: found[REAL][key] for key in ("text", "short")} if REAL in found else None
        more = {"real": real, "verdict": self.verdict, "why": self.why}
        found.pop(REAL, None)
        return {"claim": self.claim.name, **texts, **more, "findings": found}


def judge(evidence: Evidence, items: Collection[str] | None = None) -> list[Verdict]:
    """The verdicts on all claims of the items."""
    verdicts = []
    for claim in (claim for claim in claims() if items is None or claim.item in items):
        verdicts.append(Verdict(claim, {}, {}))
        for source in (*claim.sources, REAL) if claim.sources == SOURCES else claim.sources:
            with suppress(Missing):
                verdicts[-1].findings[source] = claim.check(evidence, source, **claim.options)
            cells = evidence.names_of_cells(STUDIES[claim.item], source, claim.executor)
            verdicts[-1].cells[source] = cells
    return verdicts
