# SPDX-License-Identifier: Apache-2.0
"""Histograms of the reduction of end-to-end bounds on WATERS task sets, as the paper's Section VII-B.

Reads waters_histogram.csv and waters_summary.csv of a folder and writes waters.svg and waters.png: one panel for each
utilisation, the paper's method filled, tighter ones as outlines.
"""

import argparse
import csv
import sys
from pathlib import Path

import numpy as np

from run_data import BLUE, INK, InputError, ORANGE, plt, run_script, save, write_title

NAMES = {
    "brueggen_davare": "Theorem 1 + Davare (the paper's)",
    "davis_davare": "exact NP-FP + Davare",
    "davis_duerr": "exact NP-FP + Duerr",
    "davis_kloda": "exact NP-FP + Kloda (synchronous)",
    "davis_guenzel": "exact NP-FP + Guenzel (known phases)",
}
COLOURS = {"davis_davare": "#56B4E9", "davis_duerr": "#009E73", "davis_kloda": ORANGE, "davis_guenzel": "#CC79A7"}


def read(path):
    try:
        with open(path, newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; give a folder written by `hotpath experiment waters`") from None
    if not rows:
        raise InputError(f"{path}: no rows, there is nothing to draw")
    return rows


def read_histograms(folder):
    """{utilisation: {method: (edges in percent, counts)}}"""
    bins = {}
    for row in read(folder / "waters_histogram.csv"):
        of_method = bins.setdefault(float(row["utilisation"]), {}).setdefault(row["method"], [])
        of_method.append((float(row["low_percent"]), float(row["high_percent"]), int(row["chains"])))
    return {
        utilisation: {
            method: ([low for low, _, _ in rows] + [rows[-1][1]], [count for _, _, count in rows])
            for method, rows in methods.items()
        }
        for utilisation, methods in bins.items()
    }


def draw_panel(axes, utilisation, methods, summary):
    for method, (edges, counts) in methods.items():
        if method == "brueggen_davare":
            axes.stairs(counts, edges, fill=True, color=BLUE, alpha=0.6, label=NAMES[method], zorder=2)
        elif method != "davis_davare":  # nearly the paper's
            # Outlines on 25 bins of the paper's width each would hide the shape; 4 of ours make one step.
            coarse = [sum(counts[i : i + 4]) / 4 for i in range(0, len(counts), 4)]
            axes.stairs(coarse, np.linspace(edges[0], edges[-1], len(coarse) + 1), color=COLOURS[method], linewidth=1.6,
                        label=NAMES.get(method, method), zorder=3)
    facts = summary[(utilisation, "brueggen_davare")]
    axes.axvline(0, color=INK, linewidth=0.8)
    axes.text(
        0.995, 0.93,
        f"utilisation {utilisation:.0%}\n{int(facts['chains'])} chains of {facts['schedulable']} of {facts['sets']} sets\n"
        f"median {float(facts['median']):.1f} %, maximum {float(facts['max']):.1f} %",
        transform=axes.transAxes, ha="right", va="top", fontsize=11,
    )
    axes.set_xlim(-15, 105)
    axes.set_xticks(range(-10, 101, 10))
    axes.set_ylabel("chains")


def draw(arguments):
    folder = Path(arguments.folder)
    histograms = read_histograms(folder)
    summary = {(float(row["utilisation"]), row["method"]): row for row in read(folder / "waters_summary.csv")}
    figure, panels = plt.subplots(len(histograms), 1, figsize=(10, 2.6 * len(histograms) + 1.4), sharex=True, squeeze=False)
    for axes, (utilisation, methods) in zip(panels[:, 0], sorted(histograms.items())):
        draw_panel(axes, utilisation, methods, summary)
    panels[-1, 0].set_xlabel("normalised reduction (%): (default's bound - RM's bound) / default's bound")
    panels[0, 0].legend(loc="upper center", frameon=False, fontsize=10)
    top = write_title(figure, "End-to-end bounds: RM events executor against the default executor",
                      "WATERS 2015 task sets; to the right of 0 RM's guarantee is the smaller latency", False)
    figure.tight_layout(rect=(0, 0, 1, 1 - top))
    save(figure, folder, "waters")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", metavar="FOLDER", help="folder written by `hotpath experiment waters`")
    return run_script(draw, parser.parse_args())


if __name__ == "__main__":
    sys.exit(main())
