# SPDX-License-Identifier: Apache-2.0
"""Reduction of end-to-end bounds on WATERS task sets, as in the paper's Section VII-B."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hotpath_report import style
from hotpath_report.style import INK, SERIES

PAPER = "brueggen_davare"
METHODS = {
    PAPER: "Theorem 1 + Davare (the paper)",
    "davis_duerr": "exact NP-FP + Dürr",
    "davis_kloda": "exact NP-FP + Kloda",
    "davis_guenzel": "exact NP-FP + Günzel",
}
BINS_PER_STEP = 4  # outlines on the paper's narrow bins would hide the shape


def draw_panel(axes: Axes, bins: pd.DataFrame) -> None:
    """Draws the paper's method filled and tighter methods as outlines."""
    for (method, name), colour in zip(METHODS.items(), SERIES):
        rows = bins[bins["method"] == method]
        if rows.empty:
            continue
        edges, chains = [*rows["low_percent"], rows["high_percent"].iloc[-1]], rows["chains"].to_numpy()
        if method == PAPER:
            axes.stairs(chains, edges, fill=True, color=colour, alpha=0.75, label=name, zorder=2)
        else:
            coarse = np.array(
                [chains[i : i + BINS_PER_STEP].mean() for i in range(0, len(chains), BINS_PER_STEP)]
            )
            steps = np.linspace(edges[0], edges[-1], len(coarse) + 1)
            axes.stairs(coarse, steps, color=colour, linewidth=1.2, label=name, zorder=3)
    axes.axvline(0, color=INK, linewidth=0.9)
    axes.set(xlim=(-15, 105), ylabel="chains")


def reductions(histogram: pd.DataFrame, summary: pd.DataFrame) -> Figure:
    """A panel per utilisation."""
    utilisations = sorted(histogram["utilisation"].unique())
    figure, panels = style.new_figure(2.3, len(utilisations))
    for axes, utilisation in zip(panels, utilisations):
        draw_panel(axes, histogram[histogram["utilisation"] == utilisation])
        axes.set_title(f"utilisation {100 * utilisation:.0f} %")
        facts = summary[(summary["utilisation"] == utilisation) & (summary["method"] == PAPER)].iloc[0]
        text = f"{facts['chains']} chains of {facts['schedulable']} of {facts['sets']} sets\n"
        text += f"median {facts['median']:.1f} %, maximum {facts['max']:.1f} %"
        axes.text(0.995, 0.95, text, transform=axes.transAxes, ha="right", va="top", fontsize=9)
    panels[-1].set_xlabel("reduction of the end-to-end bound (%)")
    style.add_key(figure, panels[0].get_legend_handles_labels()[0], 4)
    return figure
