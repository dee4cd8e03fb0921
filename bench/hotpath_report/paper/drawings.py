# SPDX-License-Identifier: Apache-2.0
"""The figures of the reproduction's items. Each function raises Missing without data."""

import itertools

import pandas as pd

from hotpath_report import style
from hotpath_report.errors import Missing
from hotpath_report.figures import bounds, hot_path, maps, timers, violins, waters
from hotpath_report.figures.violins import Drawing, Row
from hotpath_report.paper.cells import EXECUTORS, PAPER_LOAD_PERCENT, UTILISATIONS
from hotpath_report.paper.checks import WITH_COST, need
from hotpath_report.paper.evidence import Evidence
from hotpath_report.run import SOURCES
from hotpath_report.statistics import Samples, percent_of

SETS = {percent: f"{percent} % set" for percent in UTILISATIONS}
IN_TABLES = {"setting": "utilisation_percent"}


def latencies(evidence: Evidence, study: str, source: str, executor: str) -> Samples:
    """Latencies of a study; without any, those of the study `autoware`."""
    return evidence.latencies(study, source, executor) or evidence.latencies("autoware", source, executor)


def hot_path_of(
    evidence: Evidence,
    executors: str,
    study: str = "autoware",
    baseline: str = hot_path.BASELINE,
) -> Drawing:
    """Hot-path latencies; for the study `autoware` with the real stack's worst cases."""
    names = EXECUTORS[executors]
    rows = [Row(e, e, [latencies(evidence, study, s, e) for s in SOURCES]) for e in names]
    rows = [row for row in rows if row.halves]
    need(rows)
    real = evidence.reference.hot_path_ms("max") if study == "autoware" else {}
    return hot_path.draw_rows(hot_path.with_ratios(rows, baseline), real)


def dropped_jobs(evidence: Evidence) -> Drawing:
    """Drop rates of all timers and of the IMU."""
    need(evidence.timers)
    runs = evidence.timer_runs()
    figure = timers.drops(runs, SETS)
    keys = ["source", "setting", "executor", "task"]
    table = runs.counts.groupby(keys, as_index=False)[["reached", "skipped"]].sum()
    table["dropped_percent"] = list(map(percent_of, table["skipped"], table["reached"]))
    return Drawing(figure, table.rename(columns=IN_TABLES | {"skipped": "dropped"}))


def responses(evidence: Evidence, group: str) -> Drawing:
    """Response times of a group of timers, with their bounds under RM."""
    runs = evidence.timer_runs()
    need(runs.responses)
    # The exact analysis with the paper's release cost; under RM alone, as in the paper.
    with_cost = timers.bounds_of(evidence.timer_runs(WITH_COST))
    figure = timers.responses(runs, group, SETS, with_cost)
    keys = itertools.product(SOURCES, UTILISATIONS, runs.executors)
    table = violins.percentile_table(
        ({"source": s, "utilisation_percent": p, "executor": e, "tasks": group}, runs.samples(p, s, e, group))
        for s, p, e in keys
    )
    return Drawing(figure, table)


def wcrt(evidence: Evidence) -> Drawing:
    """Worst responses in percent of their bounds."""
    with_cost = evidence.timer_runs(WITH_COST).counts
    bound = with_cost[with_cost["executor"] == EXECUTORS["with_bounds"][0]][["setting", "task", "bound_ms"]]
    if set(bound["setting"]) != set(UTILISATIONS):
        raise Missing
    live = evidence.timer_runs().counts.query("source == 'live'")
    counts = pd.concat([with_cost.query("source == 'simulated'"), live])
    counts = counts[counts["executor"].isin(EXECUTORS["with_bounds"])]
    keys = ["source", "setting", "executor", "task"]
    worst = counts.groupby(keys, sort=False, as_index=False)["response_max_ms"].max()
    table = worst.merge(bound, on=["setting", "task"])
    table["share_percent"] = 100 * table["response_max_ms"] / table["bound_ms"]
    return Drawing(bounds.tightness(table), table.rename(columns=IN_TABLES))


def reductions(evidence: Evidence) -> Drawing:
    """Histograms of the reduction of end-to-end bounds."""
    histogram, summary = (evidence.table(f"waters_{name}.csv") for name in ("histogram", "summary"))
    return Drawing(waters.reductions(histogram, summary), histogram)


def release_cost(evidence: Evidence) -> Drawing:
    """Release cost on this machine."""
    table = evidence.table("release_cost.csv")
    return Drawing(bounds.release_cost(table, style.colour_of(EXECUTORS["with_bounds"][0])), table)


def load_points(evidence: Evidence) -> dict[tuple[str, str], dict[int, Samples]]:
    """Hot path over load by source and executor; the live point at the paper's load comes from the study
    `autoware`."""
    points: dict[tuple[str, str], dict[int, Samples]] = {}
    for (study, source, load, executor), samples in evidence.all_latencies.items():
        papers = (study, source, load) == ("autoware", "live", PAPER_LOAD_PERCENT)
        if study == "load" or (papers and executor in EXECUTORS["live_map"]):
            points.setdefault((source, executor), {})[load] = samples
    if not any(len(found) > 1 for found in points.values()):
        raise Missing
    return points


def over_load(evidence: Evidence) -> Drawing:
    """Hot path over load."""
    points = load_points(evidence)
    table = violins.percentile_table(
        ({"source": source, "executor": executor, "load_percent": load}, samples)
        for (source, executor), found in sorted(points.items())
        for load, samples in sorted(found.items())
    )
    return Drawing(maps.over_load(points, EXECUTORS["map"]), table)


def over_phases(evidence: Evidence) -> Drawing:
    """Hot path over random phases."""
    draws = {(s, e): found for s in SOURCES for e in EXECUTORS["map"] if (found := evidence.draws(s, e))}
    need(draws)
    creation = {e: s.worst for e in EXECUTORS["map"] if (s := evidence.latencies("autoware", "simulated", e))}
    table = pd.DataFrame(
        [[*key, k, *draw] for key, found in draws.items() for k, draw in enumerate(found)],
        columns=["source", "executor", "draw", "median_ms", "worst_ms"],
    )
    return Drawing(maps.over_phases(draws, creation, EXECUTORS["map"]), table)
