# SPDX-License-Identifier: Apache-2.0
"""What disturbed a live repetition. Marked ones are shown and counted like all others."""

import os
from collections.abc import Collection
from pathlib import Path
from typing import Any

NOISY_STOLEN_PERCENT = 0.5  # of its duration, taken by the hypervisor
NOISY_OTHERS_PERCENT = 5.0  # of its processors' time, used by other processes
NOISY_HELD_UP_MS = 5.0  # longest time for which a thread that only read the clock did not run
NOISE_RULE = (
    f"a repetition is marked when the hypervisor took more than {NOISY_STOLEN_PERCENT:g} % of its time, other"
    f" processes used more than {NOISY_OTHERS_PERCENT:g} % of its processors, a thread that only read the clock was"
    f" held up for more than {NOISY_HELD_UP_MS:g} ms just before, or its calibration was disturbed"
)


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
    stolen_percent = stolen_ms / (run["duration_s"] + run["warm_up_s"]) / 10
    hiccups = [h for h in run["machine"]["noise"]["hiccups"] if h["cpu"] in run["cpus"]]
    held_up_ms = max((h["max_ns"] / 1e6 for h in hiccups), default=0)
    marks = []
    if stolen_percent > NOISY_STOLEN_PERCENT:
        marks.append(f"{stolen_percent:.1f} % stolen by the hypervisor")
    if others_percent > NOISY_OTHERS_PERCENT:
        marks.append(f"{others_percent:.0f} % of the processor used by others")
    if held_up_ms > NOISY_HELD_UP_MS:
        marks.append(f"held up for {held_up_ms:.1f} ms before the start")
    if run["calibration"]["disturbed"]:
        marks.append("calibration disturbed")
    return {
        "stolen_percent": stolen_percent,
        "others_percent": others_percent,
        "held_up_ms": held_up_ms,
        "marks": marks,
    }
