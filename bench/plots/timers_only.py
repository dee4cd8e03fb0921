# SPDX-License-Identifier: Apache-2.0
"""Dropped jobs and response times on timers-only graphs, as the figures of the paper's Section VII-A.

Reads run.json and jobs.csv of run folders, live and simulated ones of several graphs together, and writes
timers_only_dropped and timers_only_response, each as .svg and .png. A graph has a colour; simulated runs are hatched.
"""

import argparse
import sys

import numpy as np

from run_data import BLUE, FAINT, GREEN, INK, ORANGE, PURPLE, SKY_BLUE, VERMILION, InputError, Run
from run_data import draw_violin, hatches, milliseconds, plt, run_script, save, write_title

GROUPS = {"Camera": "cameras", "Lidar": "LiDARs", "IMU": "IMU"}
GRAPH_COLOURS = (SKY_BLUE, ORANGE, VERMILION, GREEN, PURPLE)
GROUP_WIDTH = 0.84  # of the distance between two executors
KEY_ENTRY_INCHES = 3.9


def group_of(task):
    return next((group for group in GROUPS if group.lower() in task.lower()), None)


class TimerJobs:
    """What jobs.csv of one run says of its timers."""

    COLUMNS = ["executor", "task", "kind", "outcome", "timestamp_ns", "finish_ns", "deadline_ns"]

    def __init__(self, run):
        self.run = run
        self.timestamps = {}  # by executor
        self.skipped = {}  # by executor
        self.responses = {}  # by (group, executor), in ms, without the warm-up
        self.deadlines = {}  # by group: set of relative deadlines in ms
        warm_up_ms = run["warm_up_s"] * 1e3
        for executor, task, kind, outcome, timestamp, finish, deadline in run.rows("jobs.csv", self.COLUMNS):
            if kind != "timer":
                continue
            self.timestamps[executor] = self.timestamps.get(executor, 0) + 1
            if outcome == "skipped":
                self.skipped[executor] = self.skipped.get(executor, 0) + 1
            group = group_of(task)
            if outcome != "ran" or group is None:
                continue
            timestamp_ms = milliseconds(timestamp, run, "jobs.csv")
            if timestamp_ms < warm_up_ms:
                continue
            response = milliseconds(finish, run, "jobs.csv") - timestamp_ms
            self.responses.setdefault((group, executor), []).append(response)
            if deadline:
                relative = milliseconds(deadline, run, "jobs.csv") - timestamp_ms
                self.deadlines.setdefault(group, set()).add(round(relative, 3))
        if not self.timestamps:
            raise InputError(f"{run.folder / 'jobs.csv'}: no row of a timer, there is nothing to draw")

    def graph(self):
        return f"{self.run['graph.name']} ({self.run['load_percent']:.3g} %)"

    def name(self, several_kinds):
        return f"{self.graph()}, {self.run.kind}" if several_kinds else self.graph()

    def dropped_percent(self, executor):
        """Skipped timestamps in percent of all that were reached; None when the executor did not run."""
        if executor not in self.timestamps:
            return None
        return 100 * self.skipped.get(executor, 0) / self.timestamps[executor]

    def bound_ms(self, group, executor):
        """The largest analytical bound of the group's tasks, None without one."""
        bounds = [
            bound["ms"]
            for bound in self.run.get("bounds", [])
            if bound["executor"] == executor and group_of(bound["task"]) == group
        ]
        return max(bounds, default=None)


def executors_of(graphs):
    """All executors in the order of the first run that has them."""
    return list(dict.fromkeys(executor for graph in graphs for executor in graph.run.executors))


def styles_of(graphs):
    """Colour and hatch of each run: its graph's, and its kind's."""
    names = list(dict.fromkeys(graph.graph() for graph in graphs))
    if len(names) > len(GRAPH_COLOURS):
        raise InputError(f"{len(names)} graphs given; at most {len(GRAPH_COLOURS)} fit into one figure")
    runs = [graph.run for graph in graphs]
    colours = [GRAPH_COLOURS[names.index(graph.graph())] for graph in graphs]
    return list(zip(colours, hatches(runs)))


def key_columns(executors, graphs):
    return min(len(graphs), int(figure_width(executors, graphs) // KEY_ENTRY_INCHES))


def key_inches(executors, graphs):
    return 0.28 * -(-len(graphs) // key_columns(executors, graphs))


def places(executor_index, graphs):
    """x of each run's mark at one executor, and its width."""
    width = GROUP_WIDTH / len(graphs)
    offsets = (np.arange(len(graphs)) - (len(graphs) - 1) / 2) * width
    return executor_index + offsets, width


def prepare(axes, executors):
    axes.set_xticks(np.arange(len(executors)), executors)
    axes.tick_params(axis="x", length=0)
    axes.set_xlim(-0.6, len(executors) - 0.4)


def add_key(figure, executors, graphs, marks):
    """The runs' colours along the lower edge, and the meaning of the marks below them."""
    several = several_kinds(graphs)
    colours = [
        plt.Rectangle((0, 0), 1, 1, facecolor=colour, alpha=0.75, hatch=hatch, label=graph.name(several))
        for graph, (colour, hatch) in zip(graphs, styles_of(graphs))
    ]
    upper, lower = (colours, key_columns(executors, graphs), 0.28), (marks, len(marks), 0)
    for handles, columns, inches in (upper, lower):
        figure.legend(
            handles=handles,
            loc="lower left",
            bbox_to_anchor=(0, inches / figure.get_figheight()),
            ncol=columns,
            frameon=False,
            fontsize=11,
        )


def several_kinds(graphs):
    return any(hatches([graph.run for graph in graphs]))


def subtitle(graphs):
    """What ran, graph and load apart, which stand in the key; a line for each kind of run."""
    first_of_kind = {graph.run.kind: graph.run for graph in reversed(graphs)}
    lines = []
    for kind in sorted(first_of_kind):
        what, where = first_of_kind[kind].what_ran().split("\n")
        parts = [part for part in what.split(" · ")[1:] if not part.endswith("load") and part != kind]
        lines.append((f"{kind}: " if several_kinds(graphs) or kind == "simulated" else "") + " · ".join(parts) + "\n" + where)
    return "\n".join(lines)


def figure_width(executors, graphs):
    return max(9.0, max(1.05, 0.3 * len(graphs)) * len(executors) + 1.4)


def draw_dropped(graphs, executors, folder):
    width, height = figure_width(executors, graphs), 6.0
    figure, axes = plt.subplots(figsize=(width, height))
    rates = [graph.dropped_percent(executor) for graph in graphs for executor in executors]
    positive = [rate for rate in rates if rate]
    floor = 10 ** np.floor(np.log10(min(positive)) - 0.3) if positive else 0.1
    axes.set_yscale("log")
    axes.set_ylim(floor, 2.5 * max(positive, default=40))
    prepare(axes, executors)
    for index, executor in enumerate(executors):
        xs, bar = places(index, graphs)
        for x, graph, (colour, hatch) in zip(xs, graphs, styles_of(graphs)):
            rate = graph.dropped_percent(executor)
            if rate is None:
                axes.text(x, floor * 1.15, "no data", rotation=90, ha="center", color=FAINT, fontsize=10)
            elif rate == 0:
                axes.text(x, floor * 1.1, "✓", ha="center", va="bottom", color=INK, fontsize=15)
            else:
                axes.bar(x, rate, bar * 0.92, bottom=0, color=colour, alpha=0.75, hatch=hatch)
                axes.text(x, rate * 1.08, f"{rate:.2g}", ha="center", va="bottom", fontsize=10)
    ticks = [10.0**power for power in range(-3, 3) if floor <= 10.0**power <= axes.get_ylim()[1]]
    axes.set_yticks(ticks, [f"{tick:g} %" for tick in ticks])
    axes.set_ylabel("dropped jobs (of all timestamps)")
    partial = any(graph.run.partial for graph in graphs)
    title = write_title(figure, "Dropped jobs per executor", subtitle(graphs), partial)
    figure.subplots_adjust(
        left=0.95 / width,
        right=1 - 0.15 / width,
        top=1 - title,
        bottom=(0.72 + key_inches(executors, graphs)) / height,
    )
    check = plt.Line2D([], [], linestyle="", marker="$✓$", markersize=9, color=INK, label="no job dropped")
    add_key(figure, executors, graphs, [check])
    save(figure, folder, "timers_only_dropped")


def draw_group(axes, group, graphs, executors):
    """Violins of one group of tasks; returns whether a bound was drawn."""
    bounded = False
    for index, executor in enumerate(executors):
        xs, width = places(index, graphs)
        for x, graph, (colour, hatch) in zip(xs, graphs, styles_of(graphs)):
            responses = graph.responses.get((group, executor), [])
            draw_violin(axes, x, responses, colour, width * 0.92, hatch)
            bound = graph.bound_ms(group, executor)
            if bound is not None:
                axes.hlines(bound, x - width / 2, x + width / 2, color=BLUE, linewidth=2, zorder=5)
                bounded = True
    for deadline in sorted(set().union(*(graph.deadlines.get(group, set()) for graph in graphs))):
        axes.axhline(deadline, color=INK, linewidth=1.3, linestyle=(0, (5, 3)), zorder=1)
        axes.annotate(
            f"deadline {deadline:g} ms",
            (1, deadline),
            (0, 3),
            xycoords=("axes fraction", "data"),
            textcoords="offset points",
            ha="right",
            fontsize=10,
        )
    prepare(axes, executors)
    axes.set_ylim(bottom=0)
    axes.margins(y=0.12)
    axes.set_ylabel(f"{GROUPS[group]}: response time (ms)")
    return bounded


def draw_responses(graphs, executors, groups, folder):
    width, height = figure_width(executors, graphs), 2.1 + 3.6 * len(groups)
    figure, panels = plt.subplots(len(groups), 1, figsize=(width, height), squeeze=False)
    bounded = [draw_group(axes, group, graphs, executors) for axes, group in zip(panels[:, 0], groups)]
    partial = any(graph.run.partial for graph in graphs)
    title = write_title(figure, "Response times of executed jobs", subtitle(graphs), partial)
    figure.subplots_adjust(
        left=0.8 / width,
        right=1 - 0.15 / width,
        top=1 - title - 0.1 / height,
        bottom=(0.82 + key_inches(executors, graphs)) / height,
        hspace=0.18,
    )
    marks = [plt.Line2D([], [], color=INK, linewidth=2.4, label="median")]
    if any(bounded):
        marks.append(plt.Line2D([], [], color=BLUE, linewidth=2, label="analytical bound"))
    add_key(figure, executors, graphs, marks)
    save(figure, folder, "timers_only_response")


def groups_of(graphs):
    found = {group for graph in graphs for group, _ in graph.responses}
    groups = [group for group in GROUPS if group in found]
    if not groups:
        raise InputError(
            f"{graphs[0].run.folder / 'jobs.csv'}: after the warm-up no timer ran whose name contains "
            + ", ".join(GROUPS)
        )
    return groups


def draw(arguments):
    graphs = [TimerJobs(Run(folder)) for folder in arguments.runs]
    graphs.sort(key=lambda graph: (graph.run["load_percent"], graph.run.kind))
    executors, groups = executors_of(graphs), groups_of(graphs)
    folder = arguments.output or arguments.runs[0]
    draw_dropped(graphs, executors, folder)
    draw_responses(graphs, executors, groups, folder)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", metavar="RUN_DIR", nargs="+", help="folders of `hotpath`, live or simulated")
    parser.add_argument("--output", metavar="DIR", help="where to write (default: the first RUN_DIR)")
    return run_script(draw, parser.parse_args())


if __name__ == "__main__":
    sys.exit(main())
