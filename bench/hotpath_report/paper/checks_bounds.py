# SPDX-License-Identifier: Apache-2.0
"""Checks of what is computed: Table I, the reduction of end-to-end bounds (Section VII-B), the cost of a release."""

import pandas as pd

from hotpath_report.figures.waters import PAPER
from hotpath_report.paper import findings as f
from hotpath_report.paper.evidence import Evidence
from hotpath_report.paper.findings import Finding


def table(evidence: Evidence, _source: str, _executor: str) -> Finding | None:
    """Entries that equal the printed ones."""
    rows = f.paper_rows(evidence)
    if rows.empty:
        return None
    differences = (rows["bound_ms"] - rows["printed_ms"]).abs()
    equal = int((differences <= f.TABLE_TOLERANCE_MS + 1e-9).sum())
    text = f"{equal} of {len(rows)} entries equal, largest difference {differences.max():.4f} ms"
    return Finding(f.graded(equal, len(rows)), text, f"{equal} of {len(rows)}")


def schedulable(evidence: Evidence, _source: str, _executor: str) -> Finding | None:
    """Bounds within their deadlines."""
    rows = f.paper_rows(evidence)
    if rows.empty:
        return None
    shares = rows["bound_ms"] / rows["task"].map(f.DEADLINES_MS)
    met = int((shares <= 1).sum())
    text = f"{met} of {len(shares)} bounds within their deadline, the tightest at {100 * shares.max():.1f} % of it"
    return Finding(f.graded(met == len(shares), True), text, f"{met} of {len(shares)}")


def reductions(evidence: Evidence) -> pd.DataFrame:
    """Rows of the paper's method, by utilisation."""
    rows = evidence.table("waters_summary.csv")
    return rows if rows.empty else rows[rows["method"] == PAPER].sort_values("utilisation")


def majority(evidence: Evidence, _source: str, _executor: str) -> Finding | None:
    """Share of the chains with a lower bound."""
    rows = reductions(evidence)
    if rows.empty:
        return None
    shares = f.percents(100 * rows["positive_share"])
    return Finding(
        f.graded(rows["positive_share"].min() > 0.5, True), f"{shares} of the chains are lower", shares
    )


def negative_grow(evidence: Evidence, _source: str, _executor: str) -> Finding | None:
    """Share of the chains with a bound that is not lower, over utilisation."""
    rows = reductions(evidence)
    if rows.empty:
        return None
    higher = list(100 * (1 - rows["positive_share"]))
    rising = all(a < b for a, b in zip(higher, higher[1:]))
    verdict = f.graded(rising, True, higher[-1] > higher[0])
    return Finding(verdict, f"{f.percents(higher)} of the chains are not lower", f.percents(higher))


def almost_90(evidence: Evidence, _source: str, _executor: str) -> Finding | None:
    """The largest reduction."""
    rows = reductions(evidence)
    if rows.empty:
        return None
    largest = float(rows["max"].max())
    low, high = f.ALMOST_90_RANGE
    verdict = f.graded(low <= largest <= high, True, largest > 50)
    return Finding(verdict, f"at most {largest:.1f} %", f"{largest:.1f} %")


def delta(evidence: Evidence, _source: str, _executor: str) -> Finding | None:
    """What a release costs on this machine."""
    rows = evidence.table("wcrt_table.csv")
    if rows.empty:
        return None
    costs = dict(zip(rows["delta_of"], rows["delta_ns"] / 1e6))
    most, nearly = costs.get("this machine (maximum)"), costs.get("this machine (p99.9)")
    if most is None or nearly is None:
        return None
    verdict = f.graded(most <= f.PAPER_DELTA_MS, True, nearly <= f.PAPER_DELTA_MS)
    text = f"at most {1e3 * most:.1f} µs, 99.9 % below {1e3 * nearly:.2g} µs"
    return Finding(verdict, text, f"99.9 % < {1e3 * nearly:.2g} µs")


def total_delta(evidence: Evidence, _source: str, _executor: str) -> Finding | None:
    """The cost of seven releases that yields Table I."""
    rows = f.paper_rows(evidence)
    if rows.empty:
        return None
    one = float(rows["delta_ns"].iloc[0]) / 1e6
    near = abs(f.TASKS * one - f.PAPER_TOTAL_DELTA_MS) <= f.TOTAL_DELTA_TOLERANCE_MS
    text = f"{f.TASKS * one:.3f} ms from δ = {one:.3f} ms, the value behind Table I"
    return Finding(f.graded(near, True), text, f"{f.TASKS * one:.3f} ms")
