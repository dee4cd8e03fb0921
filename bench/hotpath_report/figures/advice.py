# SPDX-License-Identifier: Apache-2.0
"""Predictions of `hotpath advise`: median, p99 and worst case of each candidate with intervals."""

from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from hotpath_report import style
from hotpath_report.errors import InputError
from hotpath_report.style import INK
from hotpath_report.tables import read_json

# Key, label and mark of each value.
MARKS = (("median_ms", "median", "o"), ("p99_ms", "p99", "D"), ("worst_ms", "worst of all draws", "|"))


def read(folder: str) -> dict[str, Any]:
    """advice.json. Raises InputError."""
    advice: dict[str, Any] = read_json(Path(folder) / "advice.json", "hotpath advise")
    if not drawn(advice):
        raise InputError(f"{folder}: no prediction has a chain")
    return advice


def drawn(advice: dict[str, Any]) -> list[dict[str, Any]]:
    """The candidates with latencies, the best first."""
    return [row for row in advice["ranking"] if row.get("median_ms", {}).get("value") is not None]


def text_of(value: dict[str, Any]) -> str:
    """A value with its interval; `-` if nothing was measured."""
    if value["value"] is None:
        return "-"
    interval = value.get("interval")
    return f"{value['value']:.1f}" + (f" [{interval[0]:.1f}, {interval[1]:.1f}]" if interval else "")


def subtitle(advice: dict[str, Any]) -> str:
    """What was predicted."""
    cores = "one core" if advice["cores"] == 1 else f"{advice['cores']} cores"
    return (
        f"{advice['chain']} of {advice['graph']}, best first by {advice['objective']}; "
        f"{advice['draws']} draws of {advice['seconds']:g} s, {cores}"
    )


def predictions(advice: dict[str, Any], width: float) -> Figure:
    """A row of marks per candidate."""
    rows = drawn(advice)
    figure, (axes,) = style.new_figure(width, 0.6 + 0.36 * len(rows))
    for y, row in enumerate(rows):
        colour = style.colour_of(row["name"])
        axes.plot([row[MARKS[0][0]]["value"], row["worst_ms"]["value"]], [y, y], color=colour, alpha=0.35)
        for key, _, mark in MARKS:
            low, high = row[key].get("interval", [row[key]["value"]] * 2)
            axes.plot([low, high], [y, y], color=colour, linewidth=4, alpha=0.45, solid_capstyle="butt")
            axes.plot([row[key]["value"]], [y], mark, color=colour, markersize=6, markeredgewidth=2)
    names = [row["name"] + (" (now)" if row["name"] == advice["now"] else "") for row in rows]
    style.rows_of_labels(axes, names, xlabel="latency (ms)")
    worst = max(row["worst_ms"]["value"] for row in rows)
    axes.set_xlim(0, 1.05 * worst)
    marks = [style.dot(label, marker=mark, color=INK) for _, label, mark in MARKS]
    style.add_key(figure, [*marks, style.patch("95 % interval", facecolor=INK, alpha=0.45)], 4)
    return figure


def draw(advice: dict[str, Any], folder: str) -> None:
    """Writes advice.svg and .png."""
    figure = predictions(advice, style.WIDE)
    style.add_title(figure, "Predicted latency of each executor", subtitle(advice))
    style.save(figure, folder, "advice")
