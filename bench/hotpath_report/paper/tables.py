# SPDX-License-Identifier: Apache-2.0
"""The tables of the reproduction's items. Each function raises Missing without data."""

import itertools

from hotpath_report.figures.bounds import fit_release_cost
from hotpath_report.figures.hot_path import BASELINE
from hotpath_report.figures.waters import METHODS
from hotpath_report.pages.writer import HEADER, Table, compared, percentile_cells
from hotpath_report.paper.cells import EXECUTORS, UTILISATIONS
from hotpath_report.paper.drawings import SETS, latencies
from hotpath_report.paper.evidence import Evidence
from hotpath_report.run import SOURCES
from hotpath_report.samples import GROUPS
from hotpath_report.statistics import median


def dropped_jobs(evidence: Evidence) -> Table:
    """Drop rates by group of timers."""
    runs, rows = evidence.timer_runs(), []
    for executor, source, percent in itertools.product(EXECUTORS["timers"], SOURCES, UTILISATIONS):
        counts = runs.rows(percent, source, executor)
        if len(counts):
            totals = [int(counts[what].sum()) for what in ("reached", "skipped")]
            shares = [f"{runs.drop_percent(percent, source, executor, g):.2f}" for g in (None, *GROUPS)]
            rows.append([executor, source, f"{percent} %", *totals, *shares])
    header = ["executor", "source", "set", "timestamps", "dropped", "all %"]
    header += [f"{name} %" for name in GROUPS.values()]
    return Table("Drop rates by group of timers", header, rows, folded=True)


def wcrt(evidence: Evidence) -> Table:
    """Bounds of Table I in ms."""
    rows = []
    for (of, task), cells in evidence.table("wcrt_table.csv").groupby(["delta_of", "task"], sort=False):
        cells = cells.sort_values("utilisation_percent")
        texts = (cells["bound_ns"] / 1e6).map(lambda ms: "none" if ms != ms else f"{ms:.2f}")
        if of == "paper":
            texts = texts + cells["printed_ms"].map(lambda ms: f" ({ms:.2f})")
        delta_us = cells["delta_ns"].iloc[0] / 1e3
        rows.append([f"{of} ({delta_us:.{4 if delta_us < 1000 else 6}g} µs)", task, *texts])
    title = "Bounds in ms; in parentheses the paper's printed value"
    return Table(title, ["δ of", "task", *SETS.values()], rows)


def responses(evidence: Evidence, group: str) -> Table:
    """Response times of a group of timers."""
    runs, rows = evidence.timer_runs(), []
    for executor, percent, source in itertools.product(EXECUTORS["timers"], UTILISATIONS, SOURCES):
        if samples := runs.samples(percent, source, executor, group):
            late = int(runs.rows(percent, source, executor, group)["deadline_overruns"].sum())
            rows.append([executor, f"{percent} %", source, len(samples), *percentile_cells(samples), late])
    header = ["executor", "set", "source", "jobs", "median ms", "p99 ms", "worst ms", "late"]
    return Table("Response times", header, rows, folded=True)


def reductions(evidence: Evidence) -> Table:
    """Reduction of end-to-end bounds."""
    table = evidence.table("waters_summary.csv")
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


def hot_path_of(
    evidence: Evidence, executors: str, study: str = "autoware", baseline: str = BASELINE
) -> Table:
    """Hot-path latencies compared with a baseline."""
    rows, names = [], EXECUTORS[executors]
    for source, executor in itertools.product(SOURCES, names):
        if samples := latencies(evidence, study, source, executor):
            base = evidence.latencies("autoware", source, baseline)
            cells = compared(samples, None if executor == baseline else base)
            cells.insert(4, f"{samples.middle_worst():.1f}")
            rows.append([executor, source, *cells])
    if study == "autoware":
        median_ms, p99_ms, worst_ms = map(evidence.reference.hot_path_ms, ("p50", "p99", "max"))
        for executor in (name for name in names if name in worst_ms):
            count = f"{evidence.reference.hot_path.loc[executor, 'samples']} / 1"
            texts = [f"{of[executor]:.1f}" for of in (median_ms, p99_ms, worst_ms, worst_ms)]
            slower = "" if executor == baseline else f"{worst_ms.get(baseline, 0) / worst_ms[executor]:.2f}"
            rows.append([executor, "real ROS 2", count, *texts, slower, "", ""])
    header = ["executor", "source", *HEADER[:4], "median of runs' worst", *HEADER[4:]]
    title = "Hot-path latency; ratio of worst cases, Cliff's delta and rank test: against "
    return Table(f"{title}{baseline}; above 1 and above 0 are better", header, rows)


def release_cost(evidence: Evidence) -> Table:
    """Cost of a release."""
    table = evidence.table("release_cost.csv")
    delta, constant = fit_release_cost(table)
    rows = table[["timers", "passes", "p50_ns", "p99_ns", "max_ns"]].to_numpy().tolist()
    title = f"Length of a pass: k = {constant:.0f} ns, δ = {delta:.0f} ns fit the medians"
    return Table(title, ["timers", "passes", "median ns", "p99 ns", "max ns"], rows)


def over_load(evidence: Evidence) -> Table:
    """Hot path over load."""
    found = {
        (s, e, load): of for (study, s, load, e), of in evidence.all_latencies.items() if study == "load"
    }
    rows = [
        [executor, source, f"{load} %", len(samples), *percentile_cells(samples)]
        for (source, executor, load), samples in sorted(found.items())
    ]
    header = ["executor", "source", "load", "samples", "median ms", "p99 ms", "worst ms"]
    return Table("Hot-path latency over load", header, rows, folded=True)


def over_phases(evidence: Evidence) -> Table:
    """Hot path over random phases."""
    rows = []
    for source, executor in itertools.product(SOURCES, EXECUTORS["all_on_autoware"]):
        if draws := evidence.draws(source, executor):
            medians, worst = (sorted(values) for values in zip(*draws))
            row = [executor, source, len(draws), f"{medians[0]:.1f} to {medians[-1]:.1f}"]
            rows.append(row + [f"{w:.1f}" for w in (worst[0], median(worst), worst[-1])])
    header = ["executor", "source", "draws", "medians ms"]
    header += ["best draw's worst ms", "median draw's", "worst draw's"]
    return Table("Draws of random phases", header, rows)
