# SPDX-License-Identifier: Apache-2.0
"""What the figures share: colours, widths, violins in rows, and SVG that a page can theme."""

import html
import io
import re

import numpy as np
from scipy.ndimage import gaussian_filter1d

from plots import plt

WIDE, NARROW = 9.2, 4.3  # inches

# One colour for each executor, everywhere; families share a hue. They stand out from white and from black.
COLOURS = {
    "default": "#E08A00",
    "static": "#C8502B",
    "multi": "#A8882A",
    "events-ro": "#0A9A6C",
    "events-re": "#5FB89B",
    "rm-ro": "#2777C4",
    "rm-re": "#62A8DE",
    "edf-ro": "#8A56B8",
    "edf-re": "#B48BD2",
    "dm-ro": "#5B6FC8",
    "dm-re": "#8C9BDD",
    "fp-ro": "#C2569B",
    "fp-re": "#DA8FC0",
}
METHOD_COLOURS = ("#2777C4", "#8A8F98", "#0A9A6C", "#E08A00", "#C2569B")
INK, FAINT, GRID = "#1f2328", "#68707a", "#dfe3e8"
GROUND = "#fefefe"
THEMED = {INK: "var(--ink)", FAINT: "var(--faint)", GRID: "var(--grid)", GROUND: "var(--ground)"}
# Numbers stay legible where a line passes behind them.
OPAQUE = {"facecolor": GROUND, "edgecolor": "none", "alpha": 0.85, "pad": 0.6}

STYLE = {
    "font.size": 10,
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.spines.left": False,
    "axes.edgecolor": FAINT,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.grid.axis": "both",
    "grid.color": GRID,
    "grid.linewidth": 0.8,
    "text.color": INK,
    "xtick.color": FAINT,
    "xtick.labelcolor": INK,
    "ytick.color": FAINT,
    "ytick.labelcolor": INK,
    "axes.facecolor": "none",
    "figure.facecolor": "none",
    "legend.frameon": False,
    "legend.fontsize": 9,
    "svg.fonttype": "none",
    # The same data give the same bytes.
    "svg.hashsalt": "hotpath",
}


def colour_of(executor):
    return COLOURS.get(executor.split(":")[0], FAINT)


def is_narrow(width):
    return width < 6


def new_figure(width, height, panels=1, across=False, share_y=False):
    """A figure and its panels: side by side where there is room, otherwise one below the other."""
    plt.rcParams.update(STYLE)
    side_by_side = across and not is_narrow(width)
    rows, columns = (1, panels) if side_by_side else (panels, 1)
    figure, axes = plt.subplots(
        rows,
        columns,
        figsize=(width, height * rows),
        squeeze=False,
        layout="constrained",
        sharey=share_y and side_by_side,
    )
    return figure, list(axes.flat)


def svg_of(figure, background="none"):
    stream = io.StringIO()
    figure.savefig(stream, format="svg", facecolor=background, metadata={"Date": None, "Creator": "hotpath"})
    plt.close(figure)
    return re.sub(r'\b(d|x|y)="[^"]*"', rounded, stream.getvalue())


def rounded(attribute):
    """Coordinates to a tenth of a point, and no word too many: a page of many figures shrinks by a third."""
    text = re.sub(r"(\.\d)\d+", r"\1", attribute[0])
    # Without curves, all that follows the first point are lines anyway.
    return text if re.search("[CQ]", text) else re.sub(r"\s+L ", " ", text)


def for_page(svg, prefix, label):
    """An <svg> element that follows the page's colours, scales with it, and shares no id with another."""
    svg = svg[svg.index("<svg") :]
    for colour, variable in THEMED.items():
        svg = svg.replace(colour, variable)
    svg = re.sub(r'\bid="', f'id="{prefix}-', svg)
    svg = re.sub(r"url\(#", f"url(#{prefix}-", svg)
    svg = re.sub(r'href="#', f'href="#{prefix}-', svg)
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.S)
    svg = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", svg, count=1)
    svg = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", svg, count=1)
    return svg.replace("<svg", f'<svg role="img" aria-label="{html.escape(label)}"', 1)


def density(samples, low, high, points=240):
    """Smoothed histogram with a maximum of one. Latencies lie in clusters; a kernel of 0.6 % of the axis keeps them."""
    counts, edges = np.histogram(samples, bins=points, range=(low, high))
    smooth = gaussian_filter1d(counts.astype(float), 1.4, mode="constant")
    # A thin foot shows where single samples lie.
    peak = smooth.max()
    return (edges[:-1] + edges[1:]) / 2, np.sqrt(smooth / peak) if peak > 0 else smooth


def half_violin(axes, y, samples, colour, limits, upper, height=0.42):
    """Upward or downward half of a violin on row y with its median; the density's root shows rare samples."""
    values = samples.pooled()
    x, share = density(values, *limits)
    low, high = values[0], values[-1]
    inside = (x >= low - (limits[1] - limits[0]) / 200) & (x <= high + (limits[1] - limits[0]) / 200)
    sign = -1 if upper else 1  # rows run downwards
    edge = y + sign * height * share
    # A small panel has no room for more points.
    small = axes.get_gridspec().ncols > 1 or is_narrow(axes.figure.get_figwidth())
    x, edge = (values[inside][:: 2 if small else 1] for values in (x, edge))
    # Closed along the row by one edge instead of a point below every other.
    axes.fill(
        [x[0], *x, x[-1]], [y, *edge, y], color=colour, alpha=0.42 if upper else 0.9, linewidth=0, zorder=2
    )
    axes.plot([low, high], [y, y], color=colour, linewidth=1, zorder=3)
    median = samples.quantile(0.5)
    axes.plot([median, median], [y, y + sign * height], color=INK, linewidth=1.6, zorder=4, solid_capstyle="butt")


def violin_rows(axes, rows, limits):
    """Rows of (label, colour, simulated samples or None, live samples or None), downwards, with the worst value."""
    for y, (_, colour, simulated, live) in enumerate(rows):
        for samples, upper in ((simulated, True), (live, False)):
            if samples is None or not len(samples):
                continue
            half_violin(axes, y, samples, colour, limits, upper)
            worst = samples.quantile(1.0)
            beyond = worst > limits[1]
            axes.annotate(
                f"{worst:.0f} →" if beyond else f"{worst:.1f}",
                (min(worst, limits[1]), y),
                (0 if beyond else 4, 5 if upper else -5),
                textcoords="offset points",
                va="center",
                ha="right" if beyond else "left",
                fontsize=8,
                color=FAINT if upper else INK,
                bbox=OPAQUE,
                zorder=7,
            )
    axes.set_yticks(range(len(rows)), [row[0] for row in rows])
    axes.tick_params(axis="y", length=0)
    axes.grid(False, axis="y")
    axes.set_ylim(len(rows) - 0.45, -0.55)
    axes.set_xlim(*limits)


def mark_reference(axes, x, y):
    axes.plot(
        [x], [y + 0.26], marker="D", markersize=5, markerfacecolor="none", markeredgecolor=INK, linestyle="", zorder=6
    )


def axis_limit(samples, marks=()):
    """Room for all worst values, but for far ones not so much that the rest shrinks: those get an arrow."""
    everything = max([s.quantile(1.0) for s in samples] + [m for m in marks if m])
    bulk = max([s.quantile(0.99) for s in samples] + [m for m in marks if m])
    return 1.12 * min(everything, 1.6 * bulk)


def add_key(figure, handles, columns, labels=None):
    """A legend below all panels, in as many columns as fit, with room of its own."""
    columns = 2 if is_narrow(figure.get_figwidth()) else min(columns, len(handles))
    lines = -(-len(handles) // columns)
    share = (0.1 + 0.2 * lines) / figure.get_figheight()
    figure.get_layout_engine().set(rect=(0, share, 1, 1 - share))
    labels = labels or [h.get_label() for h in handles]
    figure.legend(
        handles,
        labels,
        loc="lower left",
        bbox_to_anchor=(0, 0),
        ncol=columns,
        columnspacing=1.3,
        handlelength=1.6,
        borderaxespad=0.2,
        fontsize=8.5 if is_narrow(figure.get_figwidth()) else 9,
    )
