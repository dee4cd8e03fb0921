# SPDX-License-Identifier: Apache-2.0
"""Disturbances of live repetitions. Marked repetitions are shown and counted like all others."""

import os
from collections.abc import Collection
from pathlib import Path
from typing import Any

# Limit above which a repetition is marked, and the text of the mark.
NOISY = {
    "stolen_percent": (0.5, "{:.1f} % stolen by the hypervisor"),  # of its duration
    "others_percent": (5.0, "{:.0f} % of the processor used by others"),  # of its processors' time
    # Longest interruption of a thread that only read the clock.
    "held_up_ms": (5.0, "held up for {:.1f} ms before the start"),
    "slow_percent": (0.0, "processor slow for {:.1f} % of the time"),  # by a factor of 1.1 or more
}


def busy_seconds(cpus: Collection[int]) -> float:
    """Busy time of the processors, from /proc/stat."""
    tick, total = os.sysconf("SC_CLK_TCK"), 0.0
    for line in Path("/proc/stat").read_text(encoding="ascii").splitlines():
        fields = line.split()
        if fields[0].startswith("cpu") and fields[0][3:].isdigit() and int(fields[0][3:]) in cpus:
            user, nice, system, _idle, _iowait, irq, softirq = map(int, fields[1:8])
            total += (user + nice + system + irq + softirq) / tick
    return total


def slow_percent(run: dict[str, Any], summary: dict[str, Any]) -> float | None:
    """Share of the repetition after its warm-up with a slow processor; None if not observable."""
    speeds = [e["processor_speed"] for e in summary.get("executors", []) if "processor_speed" in e]
    if not any(speed["observed"] for speed in speeds):
        return None
    slow_s = max((r["slow_s"] for speed in speeds for r in speed["slow"]), default=0)
    return min(100.0, 100 * slow_s / run["duration_s"])


def noise_of(run: dict[str, Any], summary: dict[str, Any], others_percent: float) -> dict[str, Any]:
    """Disturbances of a live repetition, and the marks that they cause."""
    counted = [r for r in run.get("runs", []) if "replaced_by" not in r]
    stolen_ms = sum(r["usage"]["stolen_ms"] for r in counted)
    hiccups = [h for h in run["machine"]["noise"]["hiccups"] if h["cpu"] in run["cpus"]]
    found = {
        "stolen_percent": stolen_ms / (run["duration_s"] + run["warm_up_s"]) / 10,
        "others_percent": others_percent,
        "held_up_ms": max((h["max_ns"] / 1e6 for h in hiccups), default=0),
        "slow_percent": slow_percent(run, summary),
    }
    marks = [
        words.format(found[what]) for what, (limit, words) in NOISY.items() if (found[what] or 0) > limit
    ]
    if run["calibration"]["disturbed"]:
        marks.append("calibration disturbed")
    return {**found, "marks": marks}
