# SPDX-License-Identifier: Apache-2.0
"""What disturbed a live repetition. Marked ones are shown and counted like all others."""

import os
from collections.abc import Collection
from pathlib import Path
from typing import Any

# From which value on a repetition is marked, and with which words.
NOISY = {
    "stolen_percent": (0.5, "{:.1f} % stolen by the hypervisor"),  # of its duration
    "others_percent": (5.0, "{:.0f} % of the processor used by others"),  # of its processors' time
    "held_up_ms": (
        5.0,
        "held up for {:.1f} ms before the start",
    ),  # longest, of a thread that only read the clock
}


def busy_seconds(cpus: Collection[int]) -> float:
    """Time that the processors spent on anything, from /proc/stat."""
    tick, total = os.sysconf("SC_CLK_TCK"), 0.0
    for line in Path("/proc/stat").read_text(encoding="ascii").splitlines():
        fields = line.split()
        if fields[0].startswith("cpu") and fields[0][3:].isdigit() and int(fields[0][3:]) in cpus:
            user, nice, system, _idle, _iowait, irq, softirq = map(int, fields[1:8])
            total += (user + nice + system + irq + softirq) / tick
    return total


def noise_of(run: dict[str, Any], others_percent: float) -> dict[str, Any]:
    """What disturbed a live repetition with this run.json, and which of it marks the repetition."""
    stolen_ms = sum(r.get("stolen_ms", 0) for r in run.get("runs", []))
    hiccups = [h for h in run["machine"]["noise"]["hiccups"] if h["cpu"] in run["cpus"]]
    found = {
        "stolen_percent": stolen_ms / (run["duration_s"] + run["warm_up_s"]) / 10,
        "others_percent": others_percent,
        "held_up_ms": max((h["max_ns"] / 1e6 for h in hiccups), default=0),
    }
    marks = [words.format(found[what]) for what, (limit, words) in NOISY.items() if found[what] > limit]
    if run["calibration"]["disturbed"]:
        marks.append("calibration disturbed")
    return {**found, "marks": marks}
