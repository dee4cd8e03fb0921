# SPDX-License-Identifier: Apache-2.0
"""Violin plot of the hot-path latency per executor, as the paper's last figure.

Reads run.json and chains.csv of a run folder (without warm-up, which its writer leaves out) and writes
hot_path.svg and hot_path.png.
"""

import argparse
import sys
import textwrap

import numpy as np

from run_data import BLUE, FAINT, INK, ORANGE, InputError, Run, draw_violin, milliseconds, plt, run_script
from run_data import save, three_digits, write_title

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


def annotate(axes, x, samples, executor, worst_of_default):
    worst = max(samples)
    text = f"{three_digits(worst)} ms"
    if executor != "default" and worst_of_default and worst > 0:
        text += "\n" + comparison(worst, worst_of_default)
    axes.annotate(
        text, (x, worst), (0, 5), textcoords="offset points", ha="center", va="bottom", fontsize=11
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


def draw_chain(axes, run, latencies):
    positions = np.arange(len(run.executors))
    worst_of_default = max(latencies["default"]) if "default" in latencies else None
    labels = []
    highest = max(max(samples) for samples in latencies.values())
    for x, executor in zip(positions, run.executors):
        samples = latencies.get(executor, [])
        labels.append(f"{executor}\nn = {len(samples)}")
        if not samples:
            axes.text(x, 0.02 * highest, "no data", ha="center", color=FAINT, fontsize=11)
            continue
        draw_violin(axes, x, samples, colour_of(executor))
        annotate(axes, x, samples, executor, worst_of_default)
    # Without work in the nodes there is no limit to draw.
    limits = [limit for limit in run.get("limits", []) if limit["ms"] > 0]
    limits.sort(key=lambda limit: limit["ms"])
    axes.set_xticks(positions, labels)
    axes.tick_params(axis="x", length=0)
    axes.set_xlim(-0.6, len(positions) - 0.4)
    axes.set_ylim(0, 1.16 * max([highest] + [limit["ms"] for limit in limits]) or 1)
    axes.set_ylabel("hot-path latency (ms)")
    draw_limits(axes, limits)


def add_key(figure, executors):
    """What colours and marks mean, along the lower edge."""
    handles = []
    for colour, name in ((ORANGE, "ROS 2's executors"), (BLUE, "the paper's executors")):
        if any(colour_of(executor) == colour for executor in executors):
            handles.append(plt.Rectangle((0, 0), 1, 1, facecolor=colour, alpha=0.55, label=name))
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


def draw(arguments):
    run = Run(arguments.run)
    chains = read_latencies(run)
    width = max(9.0, 1.02 * len(run.executors) + 2.7)
    height = 1.9 + max(4.6, 0.38 * width) * len(chains)
    figure, panels = plt.subplots(
        len(chains), 1, figsize=(width, height), squeeze=False, gridspec_kw={"hspace": 0.35}
    )
    for axes, (chain, latencies) in zip(panels[:, 0], chains.items()):
        draw_chain(axes, run, latencies)
        if len(chains) > 1:
            axes.set_title(chain, loc="left")
    title = write_title(figure, "Hot-path latency per executor", run.what_ran(), run.partial)
    figure.subplots_adjust(
        left=0.8 / width, right=1 - 1.75 / width, top=1 - title - 0.1 / height, bottom=1.25 / height
    )
    add_key(figure, run.executors)
    save(figure, arguments.output or arguments.run, "hot_path")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", metavar="RUN_DIR", help="folder written by `hotpath run` or `hotpath compare`")
    parser.add_argument("--output", metavar="DIR", help="where to write the figure (default: RUN_DIR)")
    return run_script(draw, parser.parse_args())


if __name__ == "__main__":
    sys.exit(main())
