# SPDX-License-Identifier: Apache-2.0
"""The tables beside the figures of a reproduction."""

import itertools

from hotpath_report.figures.hot_path import BASELINE
from hotpath_report.figures.bounds import fit_release_cost
from hotpath_report.figures.waters import METHODS
from hotpath_report.pages.comparison import HEADER, compared, percentile_cells
from hotpath_report.pages.writer import Table
from hotpath_report.paper.cells import EXECUTORS, UTILISATIONS
from hotpath_report.paper.drawings import latencies
from hotpath_report.paper.evidence import Evidence
from hotpath_report.paper.reference import Reference
from hotpath_report.run import SOURCES
from hotpath_report.samples import GROUPS
from hotpath_report.statistics import Samples


def drop_rates(evidence: Evidence) -> Table:
    """Drop rates by group of timers."""
    runs, rows = evidence.timer_runs(), []
    for executor, source, percent in itertools.product(EXECUTORS["timers"], SOURCES, UTILISATIONS):
        key = (percent, source, executor)
        if runs.rows(*key) is not None:
            totals = [runs.total(what, *key) for what in ("reached", "skipped")]
            shares = [f"{runs.drop_percent(*key, group):.2f}" for group in (None, *GROUPS)]
            rows.append([executor, source, f"{percent} %", *totals, *shares])
    header = [
        "executor",
        "source",
        "set",
        "timestamps",
        "dropped",
        "all %",
        *(f"{g} %" for g in GROUPS.values()),
    ]
    return Table("Drop rates by group of timers", header, rows, folded=True)


def wcrt(evidence: Evidence) -> Table | None:
    """Bounds in ms."""
    table, rows = evidence.table("wcrt_table.csv"), []
    if table.empty:
        return None
    for (delta_of, task), cells in table.groupby(["delta_of", "task"], sort=False):
        cells = cells.sort_values("utilisation_percent")
        texts = (cells["bound_ns"] / 1e6).map(lambda ms: "none" if ms != ms else f"{ms:.2f}")
        if delta_of == "paper":
            texts = texts + cells["printed_ms"].map(lambda ms: f" ({ms:.2f})")
        delta_us = cells["delta_ns"].iloc[0] / 1e3
        rows.append([f"{delta_of} ({delta_us:.{4 if delta_us < 1000 else 6}g} µs)", task, *texts])
    header = ["δ of", "task", *(f"{percent} % set" for percent in UTILISATIONS)]
    return Table("Bounds in ms; in parentheses the paper's printed value", header, rows)


def response_times(evidence: Evidence, group: str) -> Table:
    """Response times of a group of timers."""
    runs, rows = evidence.timer_runs(), []
    for executor, percent, source in itertools.product(EXECUTORS["timers"], UTILISATIONS, SOURCES):
        samples = runs.samples(percent, source, executor, group)
        if samples is not None:
            late = runs.total("deadline_overruns", percent, source, executor, group)
            rows.append([executor, f"{percent} %", source, len(samples), *percentile_cells(samples), late])
    header = ["executor", "set", "source", "jobs", "median ms", "p99 ms", "worst ms", "late"]
    return Table("Response times", header, rows, folded=True)


def bounds_reduction(evidence: Evidence) -> Table | None:
    """Reduction of end-to-end bounds."""
    table = evidence.table("waters_summary.csv")
    if table.empty:
        return None
    rows = [
        [
            f"{100 * r['utilisation']:.0f} %",
            METHODS[r["method"]],
            f"{r['schedulable']} / {r['sets']}",
            r["chains"],
            f"{r['median']:.1f} [{r['median_low']:.1f}, {r['median_high']:.1f}]",
            f"{r['min']:.1f}",
            f"{r['max']:.1f}",
            f"{100 * r['positive_share']:.1f}",
        ]
        for _, r in table[table["method"].isin(list(METHODS))].iterrows()
    ]
    header = ["utilisation", "analysis of RM", "schedulable sets", "chains", "median %", "min %", "max %"]
    return Table("Reduction of end-to-end bounds", [*header, "lower, % of chains"], rows)


def real_row(reference: Reference, executor: str, baseline: str) -> list[str]:
    """The real ROS 2 stack's row in a table of the hot path."""
    values = [reference.hot_path_ms(executor, q) or 0 for q in ("p50", "p99", "max")]
    worst = (reference.hot_path_ms(baseline, "max") or 0) / values[-1]
    texts = [f"{v:.1f}" for v in values]
    ratio = "" if executor == baseline else f"{worst:.2f}"
    return [
        executor,
        "real ROS 2",
        f"{reference.hot_path.loc[executor, 'samples']} / 1",
        *texts,
        texts[-1],
        ratio,
        "",
        "",
    ]


def hot_path(evidence: Evidence, executors: str, study: str = "autoware", baseline: str = BASELINE) -> Table:
    """Hot-path latencies, compared with a baseline."""
    rows, names = [], EXECUTORS[executors]
    for source, executor in itertools.product(SOURCES, names):
        base, samples = evidence.latencies("autoware", source, baseline), latencies(
            evidence, study, source, executor
        )
        if samples is not None:
            cells = compared(samples, None if executor == baseline else base)
            cells.insert(4, f"{samples.middle_worst():.1f}")
            rows.append([executor, source, *cells])
    if study == "autoware":
        known = [e for e in names if evidence.reference.hot_path_ms(e, "p50") is not None]
        rows += [real_row(evidence.reference, executor, baseline) for executor in known]
    header = ["executor", "source", *HEADER[:4], "of the middle run", *HEADER[4:]]
    title = "Hot-path latency; ratio of worst cases, Cliff's delta and rank test compare with "
    return Table(f"{title}{baseline}: above 1 and 0 is better", header, rows)


def release(evidence: Evidence) -> Table | None:
    """What a release costs."""
    table = evidence.table("release_cost.csv")
    if table.empty:
        return None
    delta, constant = fit_release_cost(table)
    rows = table[["timers", "passes", "p50_ns", "p99_ns", "max_ns"]].to_numpy().tolist()
    title = f"Length of a pass: k = {constant:.0f} ns, δ = {delta:.0f} ns fit the medians"
    return Table(title, ["timers", "passes", "median ns", "p99 ns", "max ns"], rows)


def against_load(evidence: Evidence) -> Table:
    """Hot path over load."""
    found: list[tuple[str, str, int, Samples]] = [
        (executor, source, load, samples)
        for (study, source, load, executor), samples in evidence.all_latencies().items()
        if study == "load"
    ]
    found.sort(key=lambda row: (row[1], row[0], row[2]))
    rows = [[e, source, f"{load} %", len(s), *percentile_cells(s)] for e, source, load, s in found]
    header = ["executor", "source", "load", "samples", "median ms", "p99 ms", "worst ms"]
    return Table("Hot-path latency over load", header, rows, folded=True)


def against_phases(evidence: Evidence) -> Table:
    """Hot path over random phases."""
    rows = []
    for source, executor in itertools.product(SOURCES, EXECUTORS["all_on_autoware"]):
        draws = evidence.draws(source, executor)
        if draws:
            medians, worst = (sorted(values) for values in zip(*draws))
            row = [executor, source, len(draws), f"{medians[0]:.1f} to {medians[-1]:.1f}"]
            rows.append(row + [f"{w:.1f}" for w in (worst[0], worst[len(worst) // 2], worst[-1])])
    header = [
        "executor",
        "source",
        "draws",
        "medians ms",
        "best draw's worst ms",
        "median draw's",
        "worst draw's",
    ]
    return Table("Draws of random phases", header, rows)
