# SPDX-License-Identifier: Apache-2.0
"""Figures of Section VII-A: dropped jobs, response times, and how close they come to their bounds."""

import numpy as np

from cells import TIMER_EXECUTORS, UTILISATIONS
from drawing import (
    FAINT,
    INK,
    add_key,
    axis_limit,
    colour_of,
    is_narrow,
    mark_reference,
    new_figure,
    plt,
    violin_rows,
)
from figure_parts import DASHED, PERCENTILE_HEADER, SOURCES, percentile_rows, reference_key, source_key


def dropped_jobs(evidence, reference, width):
    found = {
        (source, percent, executor): runs
        for (study, source, percent, executor), runs in evidence.timers.items()
        if study == "timers"
    }
    if not found:
        return None
    figure, panels = new_figure(width, 4.9, 2, across=True, share_y=True)
    rows = []
    for axes, group, title in zip(panels, (None, "imu"), ("All seven timers", "IMU alone")):
        for y, executor in enumerate(TIMER_EXECUTORS):
            for k, percent in enumerate(UTILISATIONS):
                place = y + (k - 1) * 0.27
                draw_drop_rates(axes, found, reference, (executor, percent, group), place, (0.4, 0.65, 0.95)[k])
        axes.set_title(title)
        axes.set_yticks(range(len(TIMER_EXECUTORS)), TIMER_EXECUTORS)
        axes.tick_params(axis="y", length=0)
        axes.grid(False, axis="y")
        axes.set_ylim(len(TIMER_EXECUTORS) - 0.4, -0.6)
        axes.set_xlim(0, None)
        axes.margins(x=0.14)
        axes.set_xlabel("dropped jobs (%)")
    for (source, percent, executor), runs in sorted(found.items()):
        for task, t in runs.tasks.items():
            share = 100 * t.skipped / t.reached if t.reached else 0
            rows.append([source, percent, executor, task, t.reached, t.skipped, f"{share:.4f}"])
    handles = [
        plt.Rectangle((0, 0), 1, 1, facecolor=FAINT, alpha=a, label=f"{p} % set, simulated")
        for a, p in zip((0.4, 0.65, 0.95), UTILISATIONS)
    ]
    handles.append(plt.Line2D([], [], linestyle="", marker="o", markersize=5, color=INK, label="live"))
    handles.append(reference_key("real ROS 2 stack"))
    handles.append(plt.Line2D([], [], linestyle="", marker="$✓$", markersize=7, color=INK, label="none, in any run"))
    add_key(figure, handles, 6)
    return (
        figure,
        ["source", "utilisation_percent", "executor", "task", "reached", "dropped", "dropped_percent"],
        rows,
    )


def draw_drop_rates(axes, found, reference, key, y, alpha):
    executor, percent, group = key
    simulated, live = (found.get((source, percent, executor)) for source in SOURCES)
    real = reference.drop_percent(percent, executor, group)
    rates = [None if runs is None else runs.drop_percent(group) for runs in (simulated, live)] + [real]
    known = [r for r in rates if r is not None]
    if not known:
        return
    if not any(known):
        axes.annotate("✓", (0, y), (4, 0), textcoords="offset points", va="center", fontsize=8)
        return
    if rates[0] is not None:
        axes.barh(y, rates[0], height=0.24, color=colour_of(executor), alpha=alpha, zorder=2)
    if rates[1] is not None:
        axes.plot([rates[1]], [y], "o", color=INK, markersize=4.5, zorder=4)
    if real is not None:
        axes.plot([real], [y], "D", markerfacecolor="none", markeredgecolor=INK, markersize=5.5, zorder=3)
    right = max(known)
    axes.annotate(
        f"{rates[0] if rates[0] is not None else right:.1f}",
        (right, y),
        (7, 0),
        textcoords="offset points",
        va="center",
        fontsize=8,
        color=FAINT,
    )


def responses(group):
    def draw(evidence, reference, width):
        found = {
            (source, percent, executor): runs.responses(group)
            for (study, source, percent, executor), runs in evidence.timers.items()
            if study == "timers" and len(runs.responses(group))
        }
        if not found:
            return None
        figure, panels = new_figure(
            width, 4.6 if not is_narrow(width) else 4.4, len(UTILISATIONS), across=True, share_y=True
        )
        limits = (0, axis_limit(found.values()))
        for axes, percent in zip(panels, UTILISATIONS):
            rows = [
                (e, colour_of(e), *(found.get((source, percent, e)) for source in SOURCES)) for e in TIMER_EXECUTORS
            ]
            violin_rows(axes, rows, limits)
            draw_deadline_and_bound(axes, evidence, percent, group)
            for y, executor in enumerate(TIMER_EXECUTORS):
                worst = reference.worst_response(percent, executor, group)
                if worst is not None and worst <= limits[1]:
                    mark_reference(axes, worst, y)
            axes.set_title(f"{percent} % set")
            axes.set_xlabel("response time (ms)")
        marks = (
            plt.Line2D([], [], color=FAINT, linewidth=1.1, linestyle=DASHED, label="deadline"),
            plt.Line2D([], [], color=colour_of("rm-ro"), linewidth=2.2, label="bound under RM"),
        )
        source_key(panels[0], {source for source, _, _ in found}, reference=True, more=marks)
        rows = [
            row
            for (source, percent, executor), samples in sorted(found.items())
            for row in percentile_rows(samples, source, percent, executor, group)
        ]
        return figure, ["source", "utilisation_percent", "executor", "tasks", *PERCENTILE_HEADER], rows

    return draw


def draw_deadline_and_bound(axes, evidence, percent, group):
    runs = evidence.runs("simulated", percent, "rm-ro", "timers_with_release_cost")
    if runs is None:
        return
    shown = axes.get_xlim()[1]
    for deadline in {t.deadline_ms for t in runs.of_group(group)}:
        if deadline > shown:  # far beyond every response time
            continue
        axes.axvline(deadline, color=FAINT, linewidth=1.1, linestyle=DASHED, zorder=1)
    bounds = [ms for task, ms in runs.bounds_ms.items() if group in task.lower()]
    for executor in ("rm-ro", "rm-re"):
        if bounds:
            y = TIMER_EXECUTORS.index(executor)
            axes.plot([max(bounds)] * 2, [y - 0.45, y + 0.45], color=colour_of("rm-ro"), linewidth=2.2, zorder=5)


def tightness(evidence, _reference, width):
    bounds = {p: evidence.runs("simulated", p, "rm-ro", "timers_with_release_cost") for p in UTILISATIONS}
    if None in bounds.values():
        return None
    figure, panels = new_figure(width, 3.3, len(UTILISATIONS), across=True, share_y=True)
    rows, kinds = [], (("simulated", "timers_with_release_cost", "s"), ("live", "timers", "o"))
    for axes, percent in zip(panels, UTILISATIONS):
        tasks = list(bounds[percent].bounds_ms)
        for source, study, marker in kinds:
            for executor, shift in (("rm-ro", -0.14), ("rm-re", 0.14)):
                runs = evidence.runs(source, percent, executor, study)
                if runs is None:
                    continue
                shares = [100 * runs.tasks[t].worst_ms / bounds[percent].bounds_ms[t] for t in tasks]
                axes.plot(
                    shares,
                    np.arange(len(tasks)) + shift,
                    marker,
                    color=colour_of(executor),
                    markersize=6,
                    markerfacecolor="none" if source == "simulated" else None,
                    zorder=3,
                )
                rows += [
                    [
                        source,
                        percent,
                        executor,
                        t,
                        f"{runs.tasks[t].worst_ms:.6f}",
                        bounds[percent].bounds_ms[t],
                        f"{s:.2f}",
                    ]
                    for t, s in zip(tasks, shares)
                ]
        axes.axvline(100, color=INK, linewidth=1.3, linestyle=DASHED)
        axes.set_yticks(range(len(tasks)), tasks)
        axes.tick_params(axis="y", length=0)
        axes.set_ylim(len(tasks) - 0.4, -0.6)
        axes.set_xlim(0, max(108, axes.get_xlim()[1]))
        axes.set_title(f"{percent} % set")
        axes.set_xlabel("worst response (% of its bound)")
    handles = [
        plt.Line2D(
            [],
            [],
            linestyle="",
            marker=m,
            color=colour_of(e),
            markerfacecolor="none" if s == "simulated" else None,
            label=f"{e}, {s}",
        )
        for s, _, m in kinds
        for e in ("rm-ro", "rm-re")
        if any(r[0] == s for r in rows)
    ]
    add_key(figure, handles, 4)
    return (
        figure,
        ["source", "utilisation_percent", "executor", "task", "worst_response_ms", "bound_ms", "share_percent"],
        rows,
    )
