# SPDX-License-Identifier: Apache-2.0
"""The tables beside the figures of a reproduction."""

from dataclasses import dataclass

from cells import PAPER_HOT_PATH, RULE_VARIANTS, TIMER_EXECUTORS, UTILISATIONS
from evidence import GROUPS
from figure_parts import SOURCES
from figures import ALL_ON_AUTOWARE
from figures_analysis import METHODS, fit_release_cost
from inference import rank_test, ratio


@dataclass(frozen=True)
class Table:
    title: str
    header: list
    rows: list
    folded: bool = False  # long tables open on demand


def p_text(p):
    return "< 0.001" if p < 0.001 else f"{p:.3f}"


def drop_rates(evidence, _reference):
    rows = []
    for executor in TIMER_EXECUTORS:
        for source in SOURCES:
            for percent in UTILISATIONS:
                runs = evidence.runs(source, percent, executor)
                if runs is None:
                    continue
                shares = [f"{runs.drop_percent(g):.2f}" for g in (None, *GROUPS)]
                rows.append(
                    [
                        executor,
                        source,
                        f"{percent} %",
                        str(runs.total("reached")),
                        str(runs.total("skipped")),
                        *shares,
                    ]
                )
    header = ["executor", "source", "set", "timestamps", "dropped", "all %", "cameras %", "LiDARs %", "IMU %"]
    return [Table("Drop rates by group of timers", header, rows, folded=True)] if rows else []


def wcrt(evidence, _reference):
    rows = evidence.table("wcrt_table.csv")
    lines = []
    for delta_of in dict.fromkeys(r["delta_of"] for r in rows):
        for task in ("IMU", "Camera", "LiDAR"):
            cells = [r for r in rows if r["delta_of"] == delta_of and r["task"] == task]
            cells.sort(key=lambda r: int(r["utilisation_percent"]))
            values = [f"{int(r['bound_ns']) / 1e6:.2f}" if r["bound_ns"] else "none" for r in cells]
            printed = [f"{float(r['printed_ms']):.2f}" for r in cells]
            delta_us = int(cells[0]["delta_ns"]) / 1e3
            release = f"{delta_of} ({delta_us:.4g} µs)" if delta_us < 1000 else f"{delta_of} ({delta_us:.0f} µs)"
            lines.append(
                [release, task, *[f"{v} ({p})" if delta_of == "paper" else v for v, p in zip(values, printed)]]
            )
    header = ["δ of", "task", *[f"{p} % set" for p in UTILISATIONS]]
    return [Table("Bounds in ms; in parentheses the paper's printed value", header, lines)] if lines else []


def response_times(group):
    def build(evidence, _reference):
        rows = []
        for executor in TIMER_EXECUTORS:
            for percent in UTILISATIONS:
                for source in SOURCES:
                    runs = evidence.runs(source, percent, executor)
                    samples = runs.responses(group) if runs else None
                    if samples is None or not len(samples):
                        continue
                    values = [samples.estimate(p).text(1) for p in (0.5, 0.99, 1.0)]
                    rows.append(
                        [
                            executor,
                            f"{percent} %",
                            source,
                            str(len(samples)),
                            *values,
                            str(runs.total("overruns", group)),
                        ]
                    )
        header = ["executor", "set", "source", "jobs", "median ms", "p99 ms", "worst ms", "late"]
        return [Table("Response times", header, rows, folded=True)] if rows else []

    return build


def bounds_reduction(evidence, _reference):
    rows = []
    for r in evidence.table("waters_summary.csv"):
        if r["method"] not in METHODS:
            continue
        median = f"{float(r['median']):.1f} [{float(r['median_low']):.1f}, {float(r['median_high']):.1f}]"
        rows.append(
            [
                f"{100 * float(r['utilisation']):.0f} %",
                METHODS[r["method"]],
                f"{r['schedulable']} / {r['sets']}",
                r["chains"],
                median,
                f"{float(r['min']):.1f}",
                f"{float(r['max']):.1f}",
                f"{100 * float(r['positive_share']):.1f}",
            ]
        )
    header = [
        "utilisation",
        "analysis of RM",
        "schedulable sets",
        "chains",
        "median %",
        "min %",
        "max %",
        "lower, % of chains",
    ]
    return [Table("Reduction of the bound", header, rows)] if rows else []


def hot_path(executors, study="autoware", baseline="default"):
    def build(evidence, reference):
        rows = []
        for source in SOURCES:
            base = evidence.latencies("autoware", source, baseline)
            for executor in executors:
                samples = evidence.latencies(study, source, executor) or evidence.latencies(
                    "autoware", source, executor
                )
                if samples is None:
                    continue
                row = [executor, source, f"{len(samples)} / {len(samples.repetitions)}"]
                row += [samples.estimate(p).text(1) for p in (0.5, 0.99, 1.0)]
                row.append(f"{samples.middle_worst():.1f}")
                if base is None or executor == baseline:
                    row += ["", "", ""]
                else:
                    test = rank_test(samples, base)
                    row += [
                        ratio(base, samples, 1.0).text(2),
                        f"{test.cliffs_delta.text(2)} ({test.magnitude})",
                        p_text(test.p_value),
                    ]
                rows.append(row)
        if study == "autoware":
            for executor in executors:
                if reference.hot_path_ms(executor, "p50") is None:
                    continue
                values = [f"{reference.hot_path_ms(executor, q):.1f}" for q in ("p50", "p99", "max")]
                worst = reference.hot_path_ms(baseline, "max") / reference.hot_path_ms(executor, "max")
                samples = reference.hot_path[executor]["samples"]
                rows.append(
                    [
                        executor,
                        "real ROS 2",
                        f"{samples} / 1",
                        *values,
                        values[-1],
                        "" if executor == baseline else f"{worst:.2f}",
                        "",
                        "",
                    ]
                )
        header = [
            "executor",
            "source",
            "samples / runs",
            "median ms",
            "p99 ms",
            "worst ms",
            "of the middle run",
            "worst-case ratio",
            "Cliff's delta",
            "rank test p",
        ]
        title = (
            f"Hot-path latency; ratio of worst cases, Cliff's delta and rank test compare with {baseline}, above 1"
            " and 0 is better"
        )
        return [Table(title, header, rows)] if rows else []

    return build


def release(evidence, _reference):
    rows = evidence.table("release_cost.csv")
    if not rows:
        return []
    delta, constant = fit_release_cost(rows)
    lines = [[r["timers"], r["passes"], r["p50_ns"], r["p99_ns"], r["max_ns"]] for r in rows]
    title = f"Length of a pass: k = {constant:.0f} ns, δ = {delta:.0f} ns fit the medians"
    return [Table(title, ["timers", "passes", "median ns", "p99 ns", "max ns"], lines)]


def against_load(evidence, _reference):
    rows = []
    for (study, source, executor, load), _ in sorted(
        evidence.hot_path.items(), key=lambda item: (item[0][1], item[0][2], item[0][3])
    ):
        if study == "load":
            samples = evidence.latencies(study, source, executor, load)
            rows.append(
                [
                    executor,
                    source,
                    f"{load} %",
                    str(len(samples)),
                    *[samples.estimate(p).text(1) for p in (0.5, 0.99, 1.0)],
                ]
            )
    header = ["executor", "source", "load", "samples", "median ms", "p99 ms", "worst ms"]
    return [Table("Hot-path latency over load", header, rows, folded=True)] if rows else []


def against_phases(evidence, _reference):
    rows = []
    for source in SOURCES:
        for executor in ALL_ON_AUTOWARE:
            draws = evidence.worst_of_draws(source, executor)
            if not draws:
                continue
            worst, medians = sorted(w for _, w in draws), sorted(m for m, _ in draws)
            rows.append(
                [
                    executor,
                    source,
                    str(len(draws)),
                    f"{medians[0]:.1f} to {medians[-1]:.1f}",
                    f"{worst[0]:.1f}",
                    f"{worst[len(worst) // 2]:.1f}",
                    f"{worst[-1]:.1f}",
                ]
            )
    header = ["executor", "source", "draws", "medians ms", "best draw's worst ms", "median draw's", "worst draw's"]
    return [Table("Draws of random phases", header, rows)] if rows else []


TABLES = {
    "dropped-jobs": drop_rates,
    "wcrt-table": wcrt,
    "response-camera": response_times("camera"),
    "response-lidar": response_times("lidar"),
    "response-imu": response_times("imu"),
    "end-to-end": bounds_reduction,
    "hot-path": hot_path(PAPER_HOT_PATH),
    "overhead": release,
    "executors": hot_path(ALL_ON_AUTOWARE),
    "rules": hot_path(RULE_VARIANTS, "rules", "rm-ro"),
    "load": against_load,
    "phases": against_phases,
}
