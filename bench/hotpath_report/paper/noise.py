# SPDX-License-Identifier: Apache-2.0
"""Disturbances of live repetitions. Marked repetitions are shown and counted like all others."""

from typing import Any

CAUSES = ("stolen", "throttled", "others")  # keys of the kernel's counters in run.json


def noise_of(run: dict[str, Any], summary: dict[str, Any]) -> dict[str, Any]:
    """Disturbances of a live repetition in percent of its time, and the marks that `hotpath` gave it."""
    usage = [r["usage"] for r in run["runs"]]
    wall_ms = sum(u["wall_ms"] for u in usage)
    shares = {f"{cause}_percent": 100 * sum(u[f"{cause}_ms"] for u in usage) / wall_ms for cause in CAUSES}
    marks = [m for e in summary["executors"] for r in e["disturbed"] for m in r["marks"]]
    return {**shares, "marks": marks}
