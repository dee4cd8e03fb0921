# SPDX-License-Identifier: Apache-2.0
"""Common style of all figures: colours, fonts, panels, legends."""

import io
import textwrap
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hotpath_report.files import make_folder, write_file
from hotpath_report.hotpath_command import executor_named, registry

WIDTH = 9.2  # inches
PNG_DPI = 150
INK, FAINT, GRID, GROUND = "#1f2328", "#68707a", "#dfe3e8", "#fefefe"
WARNING = "#D1242F"
# Colours of methods, threads and transports; executors have their own.
SERIES = "#2777C4 #E08A00 #0A9A6C #C2569B #8A8F98 #8A56B8 #C8502B #5FB89B #A8882A".split() + [INK]
DASHED = (0, (5, 3))
# Background that keeps numbers legible above lines.
OPAQUE = {"facecolor": GROUND, "edgecolor": "none", "alpha": 0.85, "pad": 0.6}

ABOVE = ("data", "axes fraction")  # coordinates relative to a panel's upper edge

STYLE = Path(__file__).with_name("hotpath.mplstyle")


def colour_of(executor: str) -> str:
    """The executor's colour in the registry; grey for an unknown executor."""
    known = executor_named(executor)
    return str(known.colour) if known else FAINT


# Dashes of curves, in points: with the label, they tell executors apart without colour.
DASHES: list[list[int]] = [[], [8, 3], [2, 3], [8, 3, 2, 3], [14, 4], [4, 2, 1, 2], [10, 2, 2, 2, 2, 2]]


def dashes_of(executors: Sequence[str]) -> list[list[int]]:
    """The dashes of the curves of a figure: neighbours in the registry, whose colours are similar,
    differ, and so do curves of one colour."""
    seen: Counter[str] = Counter()
    made = []
    for executor in executors:
        known, colour = executor_named(executor), colour_of(executor)
        place = list(registry()).index(known.name) if known else 0
        made.append(DASHES[(place + 2 * seen[colour]) % len(DASHES)])
        seen[colour] += 1
    return made


def in_widths(dashes: Sequence[int]) -> list[float]:
    """As multiples of a line's width: the page's lines are two points wide."""
    return [length / 2 for length in dashes]


def new_figure(
    height: float, rows: int = 1, columns: int = 1, share_y: bool = False
) -> tuple[Figure, list[Axes]]:
    """A figure of rows × columns panels of `height` inches."""
    plt.style.use(STYLE)
    look: Any = {"figsize": (WIDTH, height * rows), "layout": "constrained"}
    figure, axes = plt.subplots(rows, columns, squeeze=False, sharey="row" if share_y else False, **look)
    return figure, list(axes.flat)


def reserve(figure: Figure, below: float = 0, above: float = 0) -> None:
    """Enlarges the figure by margins (inches) outside its panels."""
    engine: Any = figure.get_layout_engine()
    engine.set(w_pad=0.06, h_pad=0.06)
    height = figure.get_figheight() + below + above
    old = getattr(figure, "reserved", (0.0, 0.0))
    below, above = below + old[0], above + old[1]
    setattr(figure, "reserved", (below, above))
    figure.set_figheight(height)
    engine.set(rect=(0, below / height, 1, 1 - (below + above) / height))


def add_key(figure: Figure, handles: Sequence[Any], columns: int) -> None:
    """Adds a legend below all panels, in at most `columns` columns."""
    columns = min(columns, len(handles))
    reserve(figure, below=0.1 + 0.2 * -(-len(handles) // columns))
    look: Any = {"columnspacing": 1.3, "handlelength": 1.6, "borderaxespad": 0.2}
    look |= {"loc": "lower left", "bbox_to_anchor": (0, 0), "fontsize": 9}
    figure.legend(handles=list(handles), ncol=columns, **look)


def rows_of_labels(axes: Axes, labels: Sequence[str], **look: Any) -> None:
    """Adds a labelled row for each text, downwards from 0; `look`: options of Axes.set()."""
    axes.set_yticks(range(len(labels)), labels)
    axes.tick_params(axis="y", length=0)
    axes.grid(False, axis="y")
    axes.set(ylim=(len(labels) - 0.45, -0.55), **look)


def note(axes: Axes, text: str, at: tuple[float, float], offset: tuple[float, float], **look: Any) -> None:
    """Adds small text beside a point of a panel; `offset` in points, vertically centred."""
    look = {"fontsize": 8, "va": "center"} | look
    axes.annotate(text, at, offset, textcoords="offset points", **look)


def patch(label: str, **look: Any) -> Any:
    """Patch for a legend."""
    return plt.Rectangle((0, 0), 1, 1, label=label, **({"facecolor": FAINT} | look))


def line(label: str, **look: Any) -> Any:
    """Line for a legend."""
    return plt.Line2D([], [], label=label, **({"color": INK} | look))


def dot(label: str, marker: Any = "o", **look: Any) -> Any:
    """Marker for a legend."""
    return line(label, **({"linestyle": "", "marker": marker} | look))


def reference_mark(**look: Any) -> dict[str, Any]:
    """Mark of the real ROS 2 stack: an open diamond."""
    mark = dict(marker="D", markersize=5, markerfacecolor="none", markeredgecolor=INK, linestyle="")
    return mark | look


def settle(figure: Figure) -> None:
    """Fixes the layout with rounded positions: the solver's last digits vary between calls, but
    equal data must give equal bytes."""
    engine: Any = figure.get_layout_engine()
    engine.execute(figure)
    figure.set_layout_engine("none")
    for axes in figure.axes:
        axes.set_position([round(share, 4) for share in axes.get_position().bounds])


def save(
    figure: Figure, folder: str | Path, name: str, title: str, subtitle: str, partial: bool = False
) -> None:
    """Writes name.svg and name.png with title and subtitle above the panels, each renamed only when
    complete, and prints their names."""
    if partial:
        title += " (partial: the run did not finish)"
    title = textwrap.fill(title, 72)
    more = 0.25 * title.count("\n")
    reserve(figure, above=0.55 + more + 0.2 * (subtitle.count("\n") + 1))
    height, left = figure.get_figheight(), 0.1 / figure.get_figwidth()
    figure.text(left, 1 - 0.1 / height, title, fontsize=15, fontweight="bold", va="top")
    place = 1 - (0.44 + more) / height
    figure.text(left, place, subtitle, fontsize=10, color=FAINT, va="top", linespacing=1.35)
    make_folder(Path(folder))
    settle(figure)
    for suffix, metadata in (("svg", {"Date": None, "Creator": "hotpath"}), ("png", {"Software": None})):
        stream, path = io.BytesIO(), Path(folder) / f"{name}.{suffix}"
        figure.savefig(stream, format=suffix, dpi=PNG_DPI, metadata=metadata, facecolor="white")
        write_file(path, stream.getvalue())
        print(path)
    plt.close(figure)
