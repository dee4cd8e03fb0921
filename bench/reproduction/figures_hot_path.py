# SPDX-License-Identifier: Apache-2.0
"""Figures of the hot path: Section VII-C, and beyond it executors, rules, load and phases."""

from cells import LIVE_MAP_EXECUTORS, MAP_EXECUTORS
from drawing import FAINT, INK, add_key, axis_limit, colour_of, mark_reference, new_figure, plt, violin_rows
from figure_parts import DASHED, PERCENTILE_HEADER, SOURCES, percentile_rows, source_key
from inference import Samples


def hot_path_of(executors, study="autoware", with_reference=True):
    def draw(evidence, reference, width):
        rows = []
        for executor in executors:
            samples = [evidence.latencies(study, source, executor) for source in SOURCES]
            for i, source in enumerate(SOURCES):  # variants of which the plain one ran with the other executors
                samples[i] = samples[i] or evidence.latencies("autoware", source, executor)
            if any(samples):
                rows.append((executor, colour_of(executor), *samples))
        if not rows:
            return None
        figure, (axes,) = new_figure(width, 0.9 + 0.62 * len(rows))
        real = {row[0]: reference.hot_path_ms(row[0], "max") for row in rows} if with_reference else {}
        violin_rows(axes, rows, (0, axis_limit([s for row in rows for s in row[2:] if s], real.values())))
        for y, row in enumerate(rows):
            if real.get(row[0]):
                mark_reference(axes, real[row[0]], y)
        axes.set_xlabel("hot-path latency (ms)")
        source_key(
            axes, {s for i, s in enumerate(SOURCES) if any(row[2 + i] for row in rows)}, reference=any(real.values())
        )
        table = [
            r for e, _, *both in rows for s, source in zip(both, SOURCES) if s for r in percentile_rows(s, source, e)
        ]
        return figure, ["source", "executor", *PERCENTILE_HEADER], table

    return draw


def load_map(evidence, _reference, width):
    loads = sorted({load for study, _, _, load in evidence.hot_path if study == "load"})
    if not loads:
        return None
    figure, panels = new_figure(width, 3.9, 2, across=True)
    rows = []
    for axes, p, title in zip(panels, (0.5, 1.0), ("Median", "Worst case")):
        for executor in MAP_EXECUTORS:
            points = {source: points_of(evidence, source, executor, p) for source in SOURCES}
            line = sorted(points["simulated"].items())
            if line:
                # EDF and RM often agree: dashes let the other line through.
                style = (0, (3, 2)) if executor.startswith("edf") else "-"
                axes.plot(
                    *zip(*line), color=colour_of(executor), linewidth=1.8, linestyle=style, label=executor, zorder=2
                )
            for load, estimate in points["live"].items():
                error = [[estimate_gap(estimate, "low")], [estimate_gap(estimate, "high")]]
                axes.errorbar(
                    [load],
                    [estimate.value],
                    yerr=error,
                    fmt="o",
                    color=colour_of(executor),
                    markersize=5,
                    markeredgecolor=INK,
                    markeredgewidth=0.7,
                    elinewidth=1,
                    zorder=4,
                )
        axes.set_yscale("log")
        ticks = [5, 10, 20, 50, 100, 200, 500, 1000]
        low, high = axes.get_ylim()
        axes.set_yticks([t for t in ticks if low <= t <= high], [f"{t}" for t in ticks if low <= t <= high])
        axes.minorticks_off()
        axes.axvline(100, color=FAINT, linewidth=1, linestyle=DASHED)
        axes.set_title(title)
        axes.set_xlabel("load (% of one core)")
        axes.set_ylabel("hot-path latency (ms)")
    for (study, source, executor, load), _ in sorted(evidence.hot_path.items()):
        if study == "load" or (study == "autoware" and source == "live" and executor in LIVE_MAP_EXECUTORS):
            samples = evidence.latencies(study, source, executor, load)
            rows += percentile_rows(samples, source, executor, load)
    handles, labels = panels[0].get_legend_handles_labels()
    if any(r[0] == "live" for r in rows):
        handles.append(plt.Line2D([], [], linestyle="", marker="o", color=FAINT, markeredgecolor=INK))
        labels.append("live")
    add_key(figure, handles, 8, labels)
    return figure, ["source", "executor", "load_percent", *PERCENTILE_HEADER], rows


def points_of(evidence, source, executor, p):
    """{load: value} simulated, {load: estimate} live; the live point at the paper's load is that of `autoware`."""
    points = {}
    for study, its_source, its_executor, load in evidence.hot_path:
        at_paper_load = study == "autoware" and source == "live" and executor in LIVE_MAP_EXECUTORS
        if its_source == source and its_executor == executor and (study == "load" or at_paper_load):
            estimate = evidence.latencies(study, source, executor, load).estimate(p)
            points[load] = estimate.value if source == "simulated" else estimate
    return points


def estimate_gap(estimate, side):
    if not estimate.has_interval:
        return 0
    return max(0, estimate.value - estimate.low if side == "low" else estimate.high - estimate.value)


def phase_map(evidence, _reference, width):
    rows, table = [], []
    for executor in MAP_EXECUTORS:
        draws = {source: evidence.worst_of_draws(source, executor) for source in SOURCES}
        if not draws["simulated"]:
            continue
        worst = Samples([[w] for _, w in draws["simulated"]])
        rows.append((executor, colour_of(executor), worst, None))
        table += [
            [source, executor, k, f"{m:.6f}", f"{w:.6f}"]
            for source in SOURCES
            for k, (m, w) in enumerate(draws[source])
        ]
    if not rows:
        return None
    figure, (axes,) = new_figure(width, 1 + 0.55 * len(rows))
    violin_rows(axes, rows, (0, axis_limit([row[2] for row in rows], [float(r[4]) for r in table])))
    for y, row in enumerate(rows):
        live = evidence.worst_of_draws("live", row[0])
        axes.plot(
            [w for _, w in live],
            [y + 0.2] * len(live),
            "o",
            color=row[1],
            markeredgecolor=INK,
            markeredgewidth=0.7,
            markersize=5,
        )
        creation = evidence.latencies("autoware", "simulated", row[0])
        if creation:
            axes.plot(
                [creation.quantile(1.0)] * 2,
                [y - 0.42, y + 0.1],
                color=INK,
                linewidth=1.2,
                linestyle=(0, (2, 1.5)),
                zorder=5,
            )
    axes.set_xlabel("worst hot-path latency of a draw of phases (ms)")
    handles = [
        plt.Rectangle((0, 0), 1, 1, facecolor=FAINT, alpha=0.42, label="draws, simulated"),
        plt.Line2D([], [], color=INK, linewidth=1.6, label="median draw"),
        plt.Line2D([], [], color=INK, linewidth=1.2, linestyle=(0, (2, 1.5)), label="creation order, simulated"),
    ]
    if any(r[0] == "live" for r in table):
        handles.append(
            plt.Line2D([], [], linestyle="", marker="o", color=FAINT, markeredgecolor=INK, label="draws, live")
        )
    add_key(figure, handles, 4)
    return figure, ["source", "executor", "draw", "median_ms", "worst_ms"], table
