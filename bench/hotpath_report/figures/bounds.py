# SPDX-License-Identifier: Apache-2.0
"""Responses relative to their bounds, reductions of end-to-end bounds on WATERS task sets (the paper's Section VII-B),
and the cost of a release."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hotpath_report import style
from hotpath_report.files import Rows
from hotpath_report.hotpath_command import ask
from hotpath_report.statistics import grouped
from hotpath_report.style import FAINT, INK, SERIES

PAPER = "brueggen_davare"
METHODS = {
    PAPER: "Theorem 1 + Davare (the paper)",
    "davis_duerr": "exact NP-FP + Dürr",
    "davis_kloda": "exact NP-FP + Kloda",
    "davis_guenzel": "exact NP-FP + Günzel",
}
BINS_PER_STEP = 4  # outlines on the paper's narrow bins would hide the shape


def column(rows: Rows, name: str) -> list[Any]:
    """The values of a column."""
    return [row[name] for row in rows]


def mark(source: str, executor: str) -> dict[str, str]:
    """An open square for simulated values, a dot for live values."""
    colour = style.colour_of(executor)
    marker, fill = ("s", "none") if source == "simulated" else ("o", colour)
    return {"marker": marker, "color": colour, "markerfacecolor": fill, "linestyle": ""}


def tightness(table: Rows) -> Figure:
    """Worst responses in % of their bounds: source, setting, executor, task, share_percent."""
    of_setting, executors = grouped(table, "utilisation_percent"), list(grouped(table, "executor"))
    figure, panels = style.new_figure(3.3, 1, len(of_setting), share_y=True)
    for axes, (setting, here) in zip(panels, sorted(of_setting.items())):
        tasks = list(grouped(here, "task"))
        for (source, executor), rows in grouped(here, "source", "executor").items():
            shift = 0.28 * (executors.index(executor) - (len(executors) - 1) / 2)
            places = [tasks.index(task) + shift for task in column(rows, "task")]
            axes.plot(column(rows, "share_percent"), places, markersize=6, zorder=3, **mark(source, executor))
        axes.axvline(100, color=INK, linewidth=1.3, linestyle=style.DASHED)
        look = {"title": f"{setting} % set", "xlabel": "worst response (% of its bound)"}
        style.rows_of_labels(axes, tasks, xlim=(0, max(108, axes.get_xlim()[1])), **look)
    handles = [style.dot(f"{e}, {s}", **mark(s, e)) for s, e in grouped(table, "source", "executor")]
    style.add_key(figure, handles, 4)
    return figure


def draw_methods(axes: Axes, bins: Rows) -> None:
    """Draws the paper's method filled and tighter methods as outlines."""
    of_method = grouped(bins, "method")
    for (method, name), colour in zip(METHODS.items(), SERIES):
        if not (rows := of_method.get(method)):
            continue
        edges, chains = [*column(rows, "low_percent"), rows[-1]["high_percent"]], column(rows, "chains")
        if method == PAPER:
            axes.stairs(chains, edges, fill=True, color=colour, alpha=0.75, label=name, zorder=2)
        else:
            starts = range(0, len(chains), BINS_PER_STEP)
            coarse = [np.mean(chains[start : start + BINS_PER_STEP]) for start in starts]
            steps = np.linspace(edges[0], edges[-1], len(coarse) + 1)
            axes.stairs(coarse, steps, color=colour, linewidth=1.2, label=name, zorder=3)
    axes.axvline(0, color=INK, linewidth=0.9)
    axes.set(xlim=(-15, 105), ylabel="chains")


def reductions(histogram: Rows, summary: Rows) -> Figure:
    """Histograms of reductions: a panel per utilisation."""
    bins = grouped(histogram, "utilisation")
    figure, panels = style.new_figure(2.3, len(bins))
    for axes, (utilisation, here) in zip(panels, sorted(bins.items())):
        draw_methods(axes, here)
        axes.set_title(f"utilisation {100 * utilisation:.0f} %")
        (facts,) = grouped(summary, "utilisation", "method")[utilisation, PAPER]
        text = f"{facts['chains']} chains of {facts['schedulable']} of {facts['sets']} sets\n"
        text += f"median {facts['median']:.1f} %, maximum {facts['max']:.1f} %"
        axes.text(0.995, 0.95, text, transform=axes.transAxes, ha="right", va="top", fontsize=9)
    panels[-1].set_xlabel("reduction of the end-to-end bound (%)")
    style.add_key(figure, panels[0].get_legend_handles_labels()[0], 4)
    return figure


def fit_release_cost(table: Rows) -> tuple[float, float]:
    """(delta, k) in ns: weighted least-squares fit of the median pass over released timers."""
    delta, constant = ask("line", *(column(table, name) for name in ("timers", "p50_ns", "passes")))
    return delta, constant


def release_cost(table: Rows, colour: str) -> Figure:
    """Length of a releaser pass over the number of timers released."""
    figure, (axes,) = style.new_figure(3.2)
    delta, constant = fit_release_cost(table)
    hollow = {"color": FAINT, "markerfacecolor": "none"}
    timers = column(table, "timers")
    axes.plot(timers, column(table, "p99_ns"), "s", label="99th percentile", **hollow)
    axes.plot(timers, column(table, "p50_ns"), "o", color=colour, label="median")
    ends = [0.0, float(max(timers))]
    label = f"k + n δ: k = {constant:.0f} ns, δ = {delta:.0f} ns"
    axes.plot(ends, [constant + delta * x for x in ends], color=colour, linewidth=1, label=label)
    axes.set(xlabel="timers released in one pass", ylabel="length of the pass (ns)")
    axes.set(xlim=(0, ends[1] + 0.5), ylim=(0, None))
    axes.legend(loc="upper left")
    return figure
