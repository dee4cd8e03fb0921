# SPDX-License-Identifier: Apache-2.0
"""Figures of what is computed: reduction of end-to-end bounds (Section VII-B), and the cost of a release."""

import numpy as np

from drawing import FAINT, INK, METHOD_COLOURS, add_key, colour_of, new_figure

METHODS = {
    "brueggen_davare": "Theorem 1 + Davare (the paper)",
    "davis_duerr": "exact NP-FP + Dürr",
    "davis_kloda": "exact NP-FP + Kloda",
    "davis_guenzel": "exact NP-FP + Günzel",
}


def reductions(evidence, _reference, width):
    rows = evidence.table("waters_histogram.csv")
    if not rows:
        return None
    utilisations = sorted({float(r["utilisation"]) for r in rows})
    figure, panels = new_figure(width, 2.3, len(utilisations))
    for axes, utilisation in zip(panels, utilisations):
        for (method, name), colour in zip(METHODS.items(), METHOD_COLOURS):
            bins = [r for r in rows if float(r["utilisation"]) == utilisation and r["method"] == method]
            if not bins:
                continue
            edges = [float(r["low_percent"]) for r in bins] + [float(bins[-1]["high_percent"])]
            chains = [int(r["chains"]) for r in bins]
            if method == "brueggen_davare":
                axes.stairs(chains, edges, fill=True, color=colour, alpha=0.75, label=name, zorder=2)
            else:  # four bins make one step, of the same height scale
                coarse = [sum(chains[i : i + 4]) / 4 for i in range(0, len(chains), 4)]
                axes.stairs(
                    coarse,
                    np.linspace(edges[0], edges[-1], len(coarse) + 1),
                    color=colour,
                    linewidth=1.2,
                    label=name,
                    zorder=3,
                )
        axes.axvline(0, color=INK, linewidth=0.9)
        axes.set_xlim(-15, 105)
        axes.set_title(f"utilisation {100 * utilisation:.0f} %")
        axes.set_ylabel("chains")
    panels[-1].set_xlabel("reduction of the end-to-end bound (%)")
    handles, labels = panels[0].get_legend_handles_labels()
    add_key(figure, handles, 4, labels)
    return figure, list(rows[0]), [list(r.values()) for r in rows]


def release_cost(evidence, _reference, width):
    rows = evidence.table("release_cost.csv")
    if not rows:
        return None
    timers = np.array([int(r["timers"]) for r in rows])
    medians = np.array([int(r["p50_ns"]) for r in rows])
    figure, (axes,) = new_figure(width, 3.2)
    delta, constant = fit_release_cost(rows)
    axes.plot(
        timers, [int(r["p99_ns"]) for r in rows], "s", color=FAINT, markerfacecolor="none", label="99th percentile"
    )
    axes.plot(timers, medians, "o", color=colour_of("rm-ro"), label="median")
    line = np.array([0, timers.max()])
    axes.plot(
        line,
        constant + delta * line,
        color=colour_of("rm-ro"),
        linewidth=1,
        label=f"k + n δ: k = {constant:.0f} ns, δ = {delta:.0f} ns",
    )
    axes.set_xlabel("timers released in one pass")
    axes.set_ylabel("length of the pass (ns)")
    axes.set_ylim(0, None)
    axes.set_xlim(0, timers.max() + 0.5)
    axes.legend(loc="upper left")
    return figure, list(rows[0]), [list(r.values()) for r in rows]


def fit_release_cost(rows):
    """(delta, k) in ns: least squares of the median pass over the number of timers, weighted by passes."""
    timers, medians, weights = (np.array([float(r[c]) for r in rows]) for c in ("timers", "p50_ns", "passes"))
    if len(rows) < 2:
        return medians[0] / timers[0], 0.0
    return tuple(np.polyfit(timers, medians, 1, w=np.sqrt(weights)))
