# SPDX-License-Identifier: Apache-2.0
"""Checks of Table I, the end-to-end bounds (Section VII-B) and the release cost."""

import pandas as pd

from hotpath_report.figures.waters import PAPER
from hotpath_report.paper import findings as f
from hotpath_report.paper.evidence import Evidence
from hotpath_report.paper.findings import LIMITS, Finding


def table(evidence: Evidence, _source: str) -> Finding:
    """Entries equal to the printed table."""
    rows = f.paper_rows(evidence)
    differences = (rows["bound_ms"] - rows["printed_ms"]).abs()
    equal = int((differences <= LIMITS.table_ms + 1e-9).sum())
    text = f"{equal} of {len(rows)} entries equal, largest difference {differences.max():.4f} ms"
    return Finding(f.graded(equal, len(rows)), text, f"{equal} of {len(rows)}")


def schedulable(evidence: Evidence, _source: str) -> Finding:
    """Bounds within deadlines."""
    rows = f.paper_rows(evidence)
    shares = rows["bound_ms"] / rows["task"].map(LIMITS.deadlines_ms)
    met = int((shares <= 1).sum())
    text = f"{met} of {len(shares)} bounds within their deadline, the tightest at {100 * shares.max():.1f} % of it"
    return Finding(f.graded(met == len(shares), True), text, f"{met} of {len(shares)}")


def reductions(evidence: Evidence) -> pd.DataFrame:
    """Results of the paper's method by utilisation."""
    rows = evidence.table("waters_summary.csv")
    return rows[rows["method"] == PAPER].sort_values("utilisation")


def majority(evidence: Evidence, _source: str) -> Finding:
    """Share of chains with a lower bound."""
    lower = 100 * reductions(evidence)["positive_share"]
    shares = f.percents(lower)
    return Finding(f.graded(lower.min() > 50, True), f"{shares} of the chains are lower", shares)


def negative_grow(evidence: Evidence, _source: str) -> Finding:
    """Share of chains without a lower bound, over utilisation."""
    higher = list(100 * (1 - reductions(evidence)["positive_share"]))
    rising = all(a < b for a, b in zip(higher, higher[1:]))
    verdict = f.graded(rising, True, higher[-1] > higher[0])
    return Finding(verdict, f"{f.percents(higher)} of the chains are not lower", f.percents(higher))


def almost_90(evidence: Evidence, _source: str) -> Finding:
    """The largest reduction."""
    largest = float(reductions(evidence)["max"].max())
    low, high = LIMITS.almost_90
    verdict = f.graded(low <= largest <= high, True, largest > 50)
    return Finding(verdict, f"at most {largest:.1f} %", f"{largest:.1f} %")


def delta(evidence: Evidence, _source: str) -> Finding:
    """Release cost on this machine."""
    rows = evidence.table("wcrt_table.csv").set_index("delta_of")["delta_ns"] / 1e3
    most_us, nearly_us = (rows[rows.index == f"this machine ({of})"] for of in ("maximum", "p99.9"))
    f.need(most_us, nearly_us)
    most, nearly = most_us.max(), nearly_us.max()
    verdict = f.graded(most <= 1e3 * LIMITS.paper_delta_ms, True, nearly <= 1e3 * LIMITS.paper_delta_ms)
    text = f"at most {most:.1f} µs, 99.9 % below {nearly:.2g} µs"
    return Finding(verdict, text, f"99.9 % < {nearly:.2g} µs")


def total_delta(evidence: Evidence, _source: str) -> Finding:
    """The cost of seven releases behind Table I."""
    one = float(f.paper_rows(evidence)["delta_ns"].iloc[0]) / 1e6
    near = abs(LIMITS.tasks * one - LIMITS.paper_total_delta_ms) <= LIMITS.total_delta_ms
    text = f"{LIMITS.tasks * one:.3f} ms from δ = {one:.3f} ms, the value behind Table I"
    return Finding(f.graded(near, True), text, f"{LIMITS.tasks * one:.3f} ms")
