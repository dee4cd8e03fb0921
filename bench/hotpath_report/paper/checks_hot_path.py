# SPDX-License-Identifier: Apache-2.0
"""Checks of Section VII-C: the hot path of the Autoware reference system."""

from hotpath_report.paper import findings as f
from hotpath_report.paper.evidence import Evidence
from hotpath_report.paper.findings import Finding
from hotpath_report.paper.reference import REAL
from hotpath_report.statistics import Samples, rank_test, ratio


def hot_paths(evidence: Evidence, source: str, *executors: str) -> list[Samples] | None:
    """Latencies (ms) of the executors; None unless all have some."""
    found = [s for e in executors if (s := evidence.latencies("autoware", source, e)) is not None]
    return found if len(found) == len(executors) else None


def real_ms(evidence: Evidence, quantile: str, *executors: str) -> list[float]:
    """Quantiles of the real ROS 2 stack; empty unless all executors have one."""
    found = [v for e in executors if (v := evidence.reference.hot_path_ms(e, quantile)) is not None]
    return found if len(found) == len(executors) else []


def real_slowdown(evidence: Evidence) -> Finding | None:
    """The same of the real ROS 2 stack."""
    names = {"max": "worst cases", "p99": "p99", "p50": "medians"}
    pairs = {name: real_ms(evidence, quantile, "default", "rm-ro") for quantile, name in names.items()}
    if not all(pairs.values()):
        return None
    ratios = {name: f"{default / ours:.2f}" for name, (default, ours) in pairs.items()}
    text = ", ".join(f"{name} {value}" for name, value in ratios.items())
    return Finding(f.NO_DATA, text, ratios[names["max"]])


def slowdown(evidence: Evidence, source: str, _executor: str) -> Finding | None:
    """How much slower the default executor is."""
    if source == REAL:
        return real_slowdown(evidence)
    found = hot_paths(evidence, source, "default", "rm-ro")
    if found is None:
        return None
    default, ours = found
    worst, p99, median = (ratio(default, ours, p) for p in (1.0, 0.99, 0.5))
    within = f.PAPER_SLOWDOWN / f.SLOWDOWN_FACTOR <= worst.value <= f.PAPER_SLOWDOWN * f.SLOWDOWN_FACTOR
    text = f"worst cases {worst.text(2)}"
    if len(default.repetitions) > 1:
        text += f" (of the middle repetitions {default.middle_worst() / ours.middle_worst():.2f})"
    verdict = f.graded(within, True, worst.value > 1)
    return Finding(verdict, f"{text}, p99 {p99.text(2)}, medians {median.text(2)}", f"{worst.value:.2f}")


def best_worst_case(evidence: Evidence, source: str, _executor: str) -> Finding | None:
    """That every other worst case is larger."""
    executors = ("rm-ro", *f.OTHERS_ON_HOT_PATH)
    if source == REAL:
        values = real_ms(evidence, "max", *executors)
        text = ", ".join(f"{e} {v:.1f}" for e, v in zip(executors, values)) + " ms"
        return (
            Finding(f.NO_DATA, text, f"{values[0]:.1f}, others ≥ {min(values[1:]):.1f} ms")
            if values
            else None
        )
    found = hot_paths(evidence, source, *executors)
    if found is None:
        return None
    if f.too_few(*found):
        return f.TOO_FEW
    ours, *others = found
    ratios = [ratio(other, ours, 1.0) for other in others]
    beyond_noise = sum(f.above(r, 1) for r in ratios)
    told = [
        f"{name} {other.worst:.1f} ms ({r.text(2)} ×)"
        for name, other, r in zip(f.OTHERS_ON_HOT_PATH, others, ratios)
    ]
    verdict = f.graded(beyond_noise, len(others), any(r.value > 1 for r in ratios))
    short = f"{ours.worst:.1f}, others ≥ {min(other.worst for other in others):.1f} ms"
    return Finding(verdict, f"rm-ro {ours.worst:.1f} ms, {', '.join(told)}", short)


def outperforms(evidence: Evidence, source: str, _executor: str) -> Finding | None:
    """That the effect against every other executor is large."""
    found = hot_paths(evidence, source, "rm-ro", *f.OTHERS_ON_HOT_PATH)
    if found is None:
        return None
    tests = [rank_test(found[0], other) for other in found[1:]]
    large = sum(t.cliffs_delta.value >= f.LARGE_EFFECT and not t.p_value > f.LARGEST_P for t in tests)
    text = ", ".join(f"{e} {t.cliffs_delta.text(2)}" for e, t in zip(f.OTHERS_ON_HOT_PATH, tests))
    verdict = f.graded(large, len(tests), any(t.cliffs_delta.value > 0 for t in tests))
    least = min(t.cliffs_delta.value for t in tests)
    return Finding(verdict, f"Cliff's delta against {text}", f"δ ≥ {least:.2f}")


def rate(evidence: Evidence, source: str, _executor: str) -> Finding | None:
    """How many outputs arrive."""
    samples = evidence.latencies("autoware", source, "rm-ro")
    cells = [c for c in evidence.cells if (c["study"], c["source"]) == ("autoware", source)]
    seconds = sum(c["duration_s"] for c in cells if "rm-ro" in c["executors"])
    if samples is None or not seconds:
        return None
    value = len(samples) / seconds
    near = abs(value / f.PAPER_RATE_HZ - 1) <= f.RATE_TOLERANCE_PERCENT / 100
    return Finding(f.graded(near, True), f"{value:.2f} per second arrive", f"{value:.2f} / s")
