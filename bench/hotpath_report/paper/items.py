# SPDX-License-Identifier: Apache-2.0
"""The figure and the table of each item of a reproduction; items.toml describes them. A function yields the parts that
have data; it raises Missing where the remaining parts have none."""

from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from itertools import product

from hotpath_report import style
from hotpath_report.errors import Missing, need
from hotpath_report.figures import evaluation, violins
from hotpath_report.figures import hot_path as violins_of_chains
from hotpath_report.figures.violins import Drawing, Row
from hotpath_report.pages.writer import HEADER, Table, compared, percentile_cells
from hotpath_report.paper.cells import EXECUTORS, UTILISATIONS
from hotpath_report.paper.evidence import GROUPS, WITH_COST, Evidence, real_stack
from hotpath_report.run import SOURCES
from hotpath_report.statistics import Samples, grouped, median, percent_of, total

Parts = Iterator[Drawing | Table]
SETS = {percent: f"{percent} % set" for percent in UTILISATIONS}


def hot_path_of(
    evidence: Evidence, executors: str, study: str = "autoware", baseline: str = violins_of_chains.BASELINE
) -> Parts:
    """Hot-path latencies compared with a baseline; for the study `autoware` with those of the real stack."""
    names, cells = EXECUTORS[executors], []
    found = {
        (s, e): of
        for s, e in product(SOURCES, names)
        if (of := evidence.latencies(study, s, e) or evidence.latencies("autoware", s, e))
    }
    for (source, executor), samples in found.items():
        base = None if executor == baseline else evidence.latencies("autoware", source, baseline)
        values = compared(samples, base)
        cells.append([executor, source, *values[:4], f"{samples.middle_worst():.1f}", *values[4:]])
    real = real_stack()[1] if study == "autoware" else {}
    worst_ms = {e: real[e]["hot_path_max_ms"] for e in names if e in real}
    for executor, worst in worst_ms.items():
        known = real[executor]
        texts = [f"{known[f'hot_path_{quantile}_ms']:.1f}" for quantile in ("p50", "p99", "max", "max")]
        slower = "" if executor == baseline else f"{worst_ms.get(baseline, 0) / worst:.2f}"
        cells.append([executor, "real ROS 2", f"{known['samples']} / 1", *texts, slower, "", ""])
    header = ["executor", "source", *HEADER[:4], "median of runs' worst", *HEADER[4:]]
    title = "Hot-path latency; ratio of worst cases, Cliff's delta and rank test: against "
    yield Table(f"{title}{baseline}; above 1 and above 0 are better", header, cells)
    need(found)
    rows = [Row(e, e, {s: found[s, e] for s in SOURCES if (s, e) in found}) for e in names]
    rows = violins_of_chains.with_ratios([row for row in rows if row.samples], baseline)
    yield violins_of_chains.draw_rows(rows, worst_ms)


hot_path = partial(hot_path_of, executors="paper_hot_path")
executors = partial(hot_path_of, executors="all_on_autoware")
rules = partial(hot_path_of, executors="rules", study="rules", baseline="rm-ro")


def dropped_jobs(evidence: Evidence) -> Parts:
    need(evidence.timers)
    keys, table, rows = ("source", "utilisation_percent", "executor", "task"), [], []
    for key, of in sorted(grouped(evidence.by_study["timers"], *keys).items()):
        reached, dropped = total(of, "reached", "skipped")
        sums = {"reached": reached, "dropped": dropped, "dropped_percent": percent_of(dropped, reached)}
        table.append(dict(zip(keys, key)) | sums)
    yield Drawing(evaluation.drops(evidence, SETS), table)
    for executor, source, percent in product(EXECUTORS["timers"], SOURCES, UTILISATIONS):
        key = (percent, source, executor)
        if counts := evidence.counts(*key):
            shares = [f"{evaluation.drop_percent(evidence, *key, group):.2f}" for group in (None, *GROUPS)]
            numbers = total(counts, "reached", "skipped")
            rows.append([executor, source, f"{percent} %", *numbers, *shares])
    header = ["executor", "source", "set", "timestamps", "dropped", "all %"]
    header += [f"{name} %" for name in GROUPS.values()]
    yield Table("Drop rates by group of timers", header, rows, folded=True)


def responses(evidence: Evidence, group: str) -> Parts:
    need(evidence.responses)
    keys = ("source", "utilisation_percent", "executor", "tasks")
    found = {
        (s, p, e, group): evidence.response_times(p, s, e, group)
        for s, p, e in product(SOURCES, UTILISATIONS, evidence.executors)
    }
    table = violins.percentile_table((dict(zip(keys, key)), samples) for key, samples in found.items())
    # Bounds: the exact analysis with the paper's release cost; under RM alone, as in the paper.
    yield Drawing(evaluation.responses(evidence, group, SETS), table)
    rows = []
    for executor, percent, source in product(EXECUTORS["timers"], UTILISATIONS, SOURCES):
        if samples := evidence.response_times(percent, source, executor, group):
            late = sum(row["deadline_overruns"] for row in evidence.counts(percent, source, executor, group))
            rows.append([executor, f"{percent} %", source, len(samples), *percentile_cells(samples), late])
    header = ["executor", "set", "source", "jobs", "median ms", "p99 ms", "worst ms", "late"]
    yield Table("Response times", header, rows, folded=True)


response_camera, response_lidar, response_imu = (partial(responses, group=group) for group in GROUPS)


def tightness(evidence: Evidence) -> Drawing:
    """Worst responses in percent of their bounds."""
    with_cost, executors = evidence.by_study[WITH_COST], EXECUTORS["with_bounds"]
    bound = grouped((r for r in with_cost if r["executor"] == executors[0]), "utilisation_percent", "task")
    if {percent for percent, _ in bound} != set(UTILISATIONS):
        raise Missing
    counts = [*with_cost, *(row for row in evidence.by_study["timers"] if row["source"] == "live")]
    known = (row for row in counts if row["executor"] in executors and row["response_max_ms"])
    keys, table = ("source", "utilisation_percent", "executor", "task"), []
    for key, of in grouped(known, *keys).items():
        worst, bound_ms = max(row["response_max_ms"] for row in of), bound[key[1], key[3]][0]["bound_ms"]
        found = {"response_max_ms": worst, "bound_ms": bound_ms, "share_percent": 100 * worst / bound_ms}
        table.append(dict(zip(keys, key)) | found)
    return Drawing(evaluation.tightness(table), table)


def wcrt_table(evidence: Evidence) -> Parts:
    """The bounds of Table I, and worst responses relative to the exact bounds."""
    with suppress(Missing):
        yield tightness(evidence)
    rows = []
    table = sorted(evidence.table("wcrt_table.csv"), key=lambda row: row["utilisation_percent"])
    for (of, task), cells in grouped(table, "delta_of", "task").items():
        texts = [f"{row['bound_ns'] / 1e6:.2f}" if row["bound_ns"] else "none" for row in cells]
        if of == "paper":
            texts = [f"{text} ({row['printed_ms']:.2f})" for text, row in zip(texts, cells)]
        delta_us = cells[0]["delta_ns"] / 1e3
        rows.append([f"{of} ({delta_us:.{4 if delta_us < 1000 else 6}g} µs)", task, *texts])
    title = "Bounds in ms; in parentheses the paper's printed value"
    yield Table(title, ["δ of", "task", *SETS.values()], rows)


def end_to_end(evidence: Evidence) -> Parts:
    histogram, summary = (evidence.table(f"waters_{name}.csv") for name in ("histogram", "summary"))
    yield Drawing(evaluation.reductions(histogram, summary), histogram)
    rows = []
    for r in (r for r in summary if r["method"] in evaluation.METHODS):
        least, largest, lower = (f"{value:.1f}" for value in (r["min"], r["max"], 100 * r["positive_share"]))
        middle = f"{r['median']:.1f} [{r['median_low']:.1f}, {r['median_high']:.1f}]"
        percent, sets = f"{100 * r['utilisation']:.0f} %", f"{r['schedulable']} / {r['sets']}"
        method = evaluation.METHODS[r["method"]]
        rows.append([percent, method, sets, r["chains"], middle, least, largest, lower])
    header = ["utilisation", "analysis of RM", "schedulable sets", "chains", "median %", "min %", "max %"]
    yield Table("Reduction of end-to-end bounds", [*header, "lower, % of chains"], rows)


def overhead(evidence: Evidence) -> Parts:
    table = evidence.table("release_cost.csv")
    yield Drawing(evaluation.release_cost(table, style.colour_of(EXECUTORS["with_bounds"][0])), table)
    delta, constant = evaluation.fit_release_cost(table)
    rows = [[row[column] for column in ("timers", "passes", "p50_ns", "p99_ns", "max_ns")] for row in table]
    title = f"Length of a pass: k = {constant:.0f} ns, δ = {delta:.0f} ns fit the medians"
    yield Table(title, ["timers", "passes", "median ns", "p99 ns", "max ns"], rows)


def phases(evidence: Evidence) -> Parts:
    rows, draws = [], {}
    for source, executor in product(SOURCES, EXECUTORS["with_phases"]):
        of_draws = (Samples([r], True) for r in evidence.latencies("phases", source, executor).repetitions)
        if found := [(samples.quantile(0.5), samples.worst) for samples in of_draws]:
            medians, worst = (sorted(values) for values in zip(*found))
            row = [executor, source, len(found), f"{medians[0]:.1f} to {medians[-1]:.1f}"]
            rows.append(row + [f"{w:.1f}" for w in (worst[0], median(worst), worst[-1])])
            draws[source, executor] = found
    header = ["executor", "source", "draws", "medians ms"]
    header += ["best draw's worst ms", "median draw's", "worst draw's"]
    yield Table("Draws of random phases", header, rows)
    need(draws)
    names = EXECUTORS["with_phases"]
    creation = {e: s.worst for e in names if (s := evidence.latencies("autoware", "simulated", e))}
    columns = ("source", "executor", "draw", "median_ms", "worst_ms")
    table = [dict(zip(columns, (*key, k, *of))) for key, found in draws.items() for k, of in enumerate(found)]
    yield Drawing(violins_of_chains.over_phases(draws, creation, names), table)
