# SPDX-License-Identifier: Apache-2.0
"""The paper's evaluation: dropped jobs and response times of timers-only sets (Section VII-A), responses relative to
their bounds, the cost of a release, and reductions of end-to-end bounds on WATERS task sets (Section VII-B)."""

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hotpath_report import style
from hotpath_report.figures import violins
from hotpath_report.figures.violins import Row
from hotpath_report.files import Rows
from hotpath_report.hotpath_command import ask
from hotpath_report.paper.evidence import GROUPS, REAL, WITH_COST, Evidence
from hotpath_report.run import SOURCES
from hotpath_report.statistics import grouped, percent_of, total
from hotpath_report.style import FAINT, INK, SERIES

PAPER = "brueggen_davare"
METHODS = {
    PAPER: "Theorem 1 + Davare (the paper)",
    "davis_duerr": "exact NP-FP + Dürr",
    "davis_kloda": "exact NP-FP + Kloda",
    "davis_guenzel": "exact NP-FP + Günzel",
}
BINS_PER_STEP = 4  # outlines on the paper's narrow bins would hide the shape
BAND = 0.82  # share of a row's height for all settings


def drop_percent(evidence: Evidence, *key: Any) -> float:
    """Skipped in percent of reached timestamps of counts(); NaN if none was reached."""
    skipped, reached = total(evidence.counts(*key), "skipped", "reached") or (0, 0)
    return percent_of(skipped, reached) if reached else math.nan


def draw_rates(axes: Axes, y: float, height: float, rates: Sequence[float], look: dict[str, Any]) -> None:
    """Simulated bar, live and real marks of one executor and setting; ✓ if nothing was dropped."""
    known = [rate for rate in rates if not math.isnan(rate)]
    if not any(known):
        style.note(axes, "✓" if known else "no data", (0, y), (4, 0))
        return
    simulated, live, real = rates
    bar = live if math.isnan(simulated) else simulated
    if not math.isnan(bar):
        axes.barh(y, bar, height=0.9 * height, zorder=2, **look)
    if not math.isnan(simulated + live):
        axes.plot([live], [y], "o", color=INK, markersize=4.5, zorder=4)
    if not math.isnan(real):
        axes.plot([real], [y], **style.reference_mark(markersize=5.5, zorder=3))
    number = bar if bar > 0 else max(known)
    text = f"{number:.1f}" if number >= 0.1 else f"{number:.2g}"
    style.note(axes, text, (max(known), y), (7, 0), color=FAINT)


def drops(evidence: Evidence, labels: Mapping[Any, str]) -> Figure:
    """Dropped jobs of all timers and of the IMU alone; `labels`: names of the settings."""
    step, executors = BAND / len(labels), evidence.executors
    shades = list(np.linspace(0.4, 0.95, len(labels)))  # earlier settings are paler
    height = 0.8 + 0.17 * len(labels) * len(executors)
    figure, panels = style.new_figure(height, 1, 2, share_y=True)
    for axes, group, title in zip(panels, (None, "imu"), ("All timers", "IMU alone")):
        style.rows_of_labels(axes, executors)
        for y, executor in enumerate(executors):
            for k, (setting, alpha) in enumerate(zip(labels, shades)):
                rates = [
                    drop_percent(evidence, setting, source, executor, group) for source in (*SOURCES, REAL)
                ]
                look = {"color": style.colour_of(executor), "alpha": alpha}
                draw_rates(axes, y + (k - (len(labels) - 1) / 2) * step, step, rates, look)
        axes.set(title=title, xlabel="dropped jobs (% of the timestamps)", xmargin=0.14)
        axes.set_xlim(0, max(1e-3, axes.get_xlim()[1]))
    handles: list[Any] = [style.patch(label, alpha=a) for label, a in zip(labels.values(), shades)]
    sources = {row["source"] for row in evidence.by_study["timers"]}
    if {*SOURCES} <= sources:
        handles += [style.patch("bar: simulated", alpha=0.6), style.dot("live", markersize=5)]
    if REAL in sources:
        handles.append(style.dot("real ROS 2 stack", **style.reference_mark()))
    handles.append(style.patch("✓ no job dropped", alpha=0))
    style.add_key(figure, handles, 7)
    return figure


def largest(rows: Rows, column: str) -> float:
    """The largest known value of a column; infinite if none is known."""
    return max((row[column] for row in rows if row[column]), default=math.inf)


def draw_panel(axes: Axes, evidence: Evidence, setting: int, group: str) -> None:
    """Draws deadlines (an arrow marks a deadline beyond the axis), analytical bounds and the real
    stack's worst values."""
    limit = axes.get_xlim()[1]
    timers = evidence.by_study["timers"]
    here = (r for r in timers if (r["utilisation_percent"], r["group"]) == (setting, group))
    for deadline in dict.fromkeys(row["deadline_ms"] for row in here if row.get("deadline_ms")):
        beyond = deadline > limit
        if not beyond:
            axes.axvline(deadline, color=FAINT, linewidth=1.1, linestyle=style.DASHED, zorder=1)
        text = f"deadline {deadline:g} ms" + (" →" if beyond else "")
        look = {"va": "baseline", "ha": "right" if beyond else "center", "color": FAINT}
        style.note(axes, text, (min(deadline, limit), 1), (0, 2), xycoords=style.ABOVE, **look)
    for y, executor in enumerate(evidence.executors):
        bound = largest(evidence.counts(setting, "simulated", executor, group, WITH_COST), "bound_ms")
        if bound <= limit:
            colour, ends = style.colour_of(executor), [y - 0.45, y + 0.45]
            axes.plot([bound] * 2, ends, color=colour, linewidth=2.2, zorder=5)
        worst = largest(evidence.counts(setting, REAL, executor, group), "response_max_ms")
        if worst <= limit:
            axes.plot([worst], [y + 0.26], **style.reference_mark(zorder=6))


def responses(evidence: Evidence, group: str, labels: Mapping[Any, str]) -> Figure:
    """Response times of a group of timers: a panel per setting."""
    executors = evidence.executors
    figure, panels = style.new_figure(0.55 + 0.42 * len(executors), 1, len(labels), share_y=True)
    rows = {
        setting: [
            Row(e, e, {s: of for s in SOURCES if (of := evidence.response_times(setting, s, e, group))})
            for e in executors
        ]
        for setting in labels
    }
    everything = list(itertools.chain.from_iterable(rows.values()))
    sources, limit = violins.sources_of(everything), violins.axis_limit(everything)
    for axes, (setting, label) in zip(panels, labels.items()):
        violins.draw_rows(axes, rows[setting], limit, sources)
        draw_panel(axes, evidence, setting, group)
        axes.set_title(label, pad=14)
        axes.set_xlabel(f"{GROUPS[group]}: response time (ms)")
    marks: list[Any] = [style.line("deadline", color=FAINT, linewidth=1.1, linestyle=style.DASHED)]
    if evidence.by_study[WITH_COST]:
        marks.append(style.line("analytical bound", color=style.SERIES[0], linewidth=2.2))
    if any(row["source"] == REAL for row in evidence.by_study["timers"]):
        marks.append(style.dot("worst of the real ROS 2 stack", **style.reference_mark()))
    violins.add_key(figure, sources, marks)
    return figure


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
