# SPDX-License-Identifier: Apache-2.0
"""Checks of Section VII-C: the hot path of the Autoware reference system."""

from hotpath_report.paper import findings as f
from hotpath_report.paper.cells import EXECUTORS
from hotpath_report.paper.evidence import Evidence
from hotpath_report.paper.findings import LIMITS, Finding
from hotpath_report.paper.reference import REAL
from hotpath_report.statistics import Samples, rank_test, ratio


def hot_paths(evidence: Evidence, source: str, *executors: str) -> list[Samples]:
    """Latencies (ms) of the executors. Raises Missing if any has none."""
    found = [evidence.latencies("autoware", source, e) for e in executors]
    f.need(*found)
    return found


def real_ms(evidence: Evidence, quantile: str, *executors: str) -> list[float]:
    """Quantiles (ms) of the real ROS 2 stack. Raises Missing if an executor has none."""
    found = evidence.reference.hot_path_ms(quantile)
    f.need(*([found[e]] if e in found else [] for e in executors))
    return [found[e] for e in executors]


def slowdown(evidence: Evidence, source: str) -> Finding:
    """Slowdown of the default executor."""
    pair = ("default", "rm-ro")
    if source == REAL:
        (worst_default, worst_ours), *others = (real_ms(evidence, q, *pair) for q in ("max", "p99", "p50"))
        short = f"{worst_default / worst_ours:.2f}"
        p99, median = (f"{default / ours:.2f}" for default, ours in others)
        return Finding(f.NO_DATA, f"worst cases {short}, p99 {p99}, medians {median}", short)
    default, ours = hot_paths(evidence, source, *pair)
    worst = ratio(default, ours, 1.0)
    within = (
        LIMITS.paper_slowdown / LIMITS.slowdown_factor
        <= worst.value
        <= LIMITS.paper_slowdown * LIMITS.slowdown_factor
    )
    text = f"worst cases {worst.text(2)}"
    if len(default.repetitions) > 1:
        text += f" (median of repetitions {default.middle_worst() / ours.middle_worst():.2f})"
    text += f", p99 {ratio(default, ours, 0.99).text(2)}, medians {ratio(default, ours, 0.5).text(2)}"
    return Finding(f.graded(within, True, worst.value > 1), text, f"{worst.value:.2f}")


def best_worst_case(evidence: Evidence, source: str) -> Finding:
    """Every other worst case is larger."""
    executors = ("rm-ro", *EXECUTORS["others_on_hot_path"])
    if source == REAL:
        values = real_ms(evidence, "max", *executors)
        text = ", ".join(f"{e} {v:.1f}" for e, v in zip(executors, values)) + " ms"
        return Finding(f.NO_DATA, text, f"{values[0]:.1f}, others ≥ {min(values[1:]):.1f} ms")
    ours, *others = found = hot_paths(evidence, source, *executors)
    if f.too_few(*found):
        return f.TOO_FEW
    ratios = [ratio(other, ours, 1.0) for other in others]
    told = [
        f"{name} {other.worst:.1f} ms ({r.text(2)} ×)"
        for name, other, r in zip(EXECUTORS["others_on_hot_path"], others, ratios)
    ]
    beyond_noise = sum(f.above(r, 1) for r in ratios)
    verdict = f.graded(beyond_noise, len(others), any(r.value > 1 for r in ratios))
    short = f"{ours.worst:.1f}, others ≥ {min(other.worst for other in others):.1f} ms"
    return Finding(verdict, f"rm-ro {ours.worst:.1f} ms, {', '.join(told)}", short)


def outperforms(evidence: Evidence, source: str) -> Finding:
    """The effect against every other executor is large."""
    ours, *others = hot_paths(evidence, source, "rm-ro", *EXECUTORS["others_on_hot_path"])
    tests = [rank_test(ours, other) for other in others]
    large = sum(
        t.cliffs_delta.value >= LIMITS.large_effect and not t.p_value > LIMITS.largest_p for t in tests
    )
    text = ", ".join(f"{e} {t.cliffs_delta.text(2)}" for e, t in zip(EXECUTORS["others_on_hot_path"], tests))
    verdict = f.graded(large, len(tests), any(t.cliffs_delta.value > 0 for t in tests))
    least = min(t.cliffs_delta.value for t in tests)
    return Finding(verdict, f"Cliff's delta against {text}", f"δ ≥ {least:.2f}")


def rate(evidence: Evidence, source: str) -> Finding:
    """Rate of outputs."""
    (samples,) = hot_paths(evidence, source, "rm-ro")
    cells = [c for c in evidence.cells if (c["study"], c["source"]) == ("autoware", source)]
    durations = [c["duration_s"] for c in cells if "rm-ro" in c["executors"]]
    f.need(durations)
    value = len(samples) / sum(durations)
    near = abs(value / LIMITS.paper_rate_hz - 1) <= LIMITS.rate_percent / 100
    return Finding(f.graded(near, True), f"{value:.2f} per second arrive", f"{value:.2f} / s")
