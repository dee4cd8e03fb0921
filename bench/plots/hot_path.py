# SPDX-License-Identifier: Apache-2.0
"""Violin plot of the hot-path latency per executor, as the paper's last figure.

Reads run.json and chains.csv of run folders of one graph (without warm-up, which their writer leaves out) and
writes hot_path.svg and hot_path.png. Of several runs, live or simulated, the violins stand side by side.
"""

import argparse
import sys
import textwrap

import numpy as np

from run_data import BLUE, FAINT, INK, ORANGE, InputError, Run, draw_violin, hatches, milliseconds, plt
from run_data import run_script, save, three_digits, write_title

THE_PAPERS = ("rm", "dm", "edf", "fp")


def colour_of(executor):
    return BLUE if executor.split("-")[0] in THE_PAPERS else ORANGE


def read_latencies(run):
    """{chain: {executor: latencies in ms}}, chains in the order of the file."""
    chains = {}
    columns = ["executor", "chain", "hot_path_latency_ns"]
    for executor, chain, latency in run.rows("chains.csv", columns):
        of_executor = chains.setdefault(chain, {})
        of_executor.setdefault(executor, []).append(milliseconds(latency, run, "chains.csv"))
    if not chains:
        raise InputError(
            f"{run.folder / 'chains.csv'}: no rows; the run was shorter than its warm-up, "
            "or its graph declares no chain"
        )
    return chains


def comparison(worst, worst_of_default):
    """How a worst case compares with default's, in words short enough to stand over a violin."""
    factor = worst_of_default / worst
    if factor >= 1.05:
        return f"{factor:.2g}× lower"
    if factor <= 1 / 1.05:
        return f"{1 / factor:.2g}× higher"
    return "the same"


def annotate(axes, x, samples, executor, worst_of_default, size):
    worst = max(samples)
    text = f"{three_digits(worst)} ms"
    if executor != "default" and worst_of_default and worst > 0:
        text += "\n" + comparison(worst, worst_of_default)
    axes.annotate(
        text, (x, worst), (0, 5), textcoords="offset points", ha="center", va="bottom", fontsize=size
    )


def draw_limits(axes, limits):
    """Labels ascending limits in the right margin: the lowest of several below its line, the others above."""
    for place, limit in enumerate(limits):
        axes.axhline(limit["ms"], color=INK, linewidth=1.3, linestyle=(0, (5, 3)), zorder=1)
        lowest = place == 0 and len(limits) > 1
        name = limit["label"].replace(" (", "\n(").split("\n")
        label = "\n".join(textwrap.fill(part, 22) for part in name) + f"\n{three_digits(limit['ms'])} ms"
        axes.annotate(
            label,
            (1, limit["ms"]),
            (6, -2 if lowest else 2),
            xycoords=("axes fraction", "data"),
            textcoords="offset points",
            va="top" if lowest else "bottom",
            fontsize=10,
            linespacing=1.15,
            annotation_clip=False,
        )


def draw_chain(axes, runs, executors, latencies):
    """`latencies`: of each run {executor: latencies in ms}."""
    positions = np.arange(len(executors))
    width = 1 / len(runs)
    labels = []
    highest = max(max(samples) for of_run in latencies for samples in of_run.values())
    for position, executor in zip(positions, executors):
        counts = []
        for place, (of_run, hatch) in enumerate(zip(latencies, hatches(runs))):
            x = position + (place - (len(runs) - 1) / 2) * width
            samples = of_run.get(executor, [])
            counts.append(str(len(samples)))
            if not samples:
                axes.text(x, 0.02 * highest, "no data", ha="center", color=FAINT, fontsize=11, rotation=90)
                continue
            draw_violin(axes, x, samples, colour_of(executor), 0.85 * width, hatch)
            worst_of_default = max(of_run["default"]) if "default" in of_run else None
            annotate(axes, x, samples, executor, worst_of_default, 11 if len(runs) == 1 else 9)
        labels.append(f"{executor}\nn = {', '.join(counts)}")
    run = runs[0]
    # Without work in the nodes there is no limit to draw.
    limits = [limit for limit in run.get("limits", []) if limit["ms"] > 0]
    limits.sort(key=lambda limit: limit["ms"])
    axes.set_xticks(positions, labels)
    axes.tick_params(axis="x", length=0)
    axes.set_xlim(-0.6, len(positions) - 0.4)
    axes.set_ylim(0, 1.16 * max([highest] + [limit["ms"] for limit in limits]) or 1)
    axes.set_ylabel("hot-path latency (ms)")
    draw_limits(axes, limits)


def add_key(figure, runs, executors):
    """What colours and marks mean, along the lower edge."""
    handles = []
    for colour, name in ((ORANGE, "ROS 2's executors"), (BLUE, "the paper's executors")):
        if any(colour_of(executor) == colour for executor in executors):
            handles.append(plt.Rectangle((0, 0), 1, 1, facecolor=colour, alpha=0.55, label=name))
    if any(hatches(runs)):
        handles.append(plt.Rectangle((0, 0), 1, 1, facecolor="white", edgecolor=INK, label="live"))
        simulated = {"facecolor": "white", "edgecolor": INK, "hatch": "///"}
        handles.append(plt.Rectangle((0, 0), 1, 1, label="simulated", **simulated))
    handles.append(plt.Line2D([], [], color=INK, linewidth=2.4, label="median"))
    note = "ends: smallest and largest sample"
    if "default" in executors:
        note += "; text: worst case, compared with default's"
    figure.legend(
        handles=handles,
        title=note,
        title_fontsize=10,
        loc="lower left",
        bbox_to_anchor=(0.0, 0.0),
        ncol=len(handles),
        frameon=False,
        fontsize=11,
        alignment="left",
    )


def subtitle(runs):
    """What ran; where several runs differ, a line for each."""
    return "\n".join(dict.fromkeys(run.what_ran() for run in runs))


def draw(arguments):
    runs = [Run(folder) for folder in arguments.runs]
    graphs = list(dict.fromkeys(run["graph.name"] for run in runs))
    if len(graphs) > 1:
        raise InputError(f"these are runs of {' and '.join(graphs)}; give runs of one graph")
    chains_of_runs = [read_latencies(run) for run in runs]
    chains = list(dict.fromkeys(chain for chains in chains_of_runs for chain in chains))
    executors = list(dict.fromkeys(executor for run in runs for executor in run.executors))
    width = max(9.0, (1.02 if len(runs) == 1 else 0.85 * len(runs)) * len(executors) + 2.7)
    height = 1.9 + max(4.6, 0.38 * width) * len(chains)
    figure, panels = plt.subplots(
        len(chains), 1, figsize=(width, height), squeeze=False, gridspec_kw={"hspace": 0.35}
    )
    for axes, chain in zip(panels[:, 0], chains):
        draw_chain(axes, runs, executors, [chains_of_run.get(chain, {}) for chains_of_run in chains_of_runs])
        if len(chains) > 1:
            axes.set_title(chain, loc="left")
    partial = any(run.partial for run in runs)
    title = write_title(figure, "Hot-path latency per executor", subtitle(runs), partial)
    figure.subplots_adjust(
        left=0.8 / width, right=1 - 1.75 / width, top=1 - title - 0.1 / height, bottom=1.25 / height
    )
    add_key(figure, runs, executors)
    save(figure, arguments.output or arguments.runs[0], "hot_path")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", metavar="RUN_DIR", nargs="+", help="folders written by `hotpath`, of one graph")
    parser.add_argument("--output", metavar="DIR", help="where to write the figure (default: the first RUN_DIR)")
    return run_script(draw, parser.parse_args())


if __name__ == "__main__":
    sys.exit(main())
