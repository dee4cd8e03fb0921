# SPDX-License-Identifier: Apache-2.0
"""Predictions of `hotpath advise`: median, p99 and worst case of each candidate with intervals."""

from pathlib import Path
from typing import Any

from hotpath_report import style
from hotpath_report.errors import InputError
from hotpath_report.style import INK
from hotpath_report.tables import read_json

# Key, label and mark of each value.
MARKS = (("median_ms", "median", "o"), ("p99_ms", "p99", "D"), ("worst_ms", "worst of all draws", "|"))


def draw(folder: str) -> None:
    """Writes advice.svg and .png into a folder of `hotpath advise`. Raises InputError."""
    advice: dict[str, Any] = read_json(Path(folder) / "advice.json", "hotpath advise")
    rows = [row for row in advice["ranking"] if row.get("median_ms")]
    if not rows:
        raise InputError(f"{folder}: no prediction has a chain")
    figure, (axes,) = style.new_figure(style.WIDE, 0.6 + 0.36 * len(rows))
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
    cores = "one core" if advice["cores"] == 1 else f"{advice['cores']} cores"
    subtitle = (
        f"{advice['chain']} of {advice['graph']}, best first by {advice['objective']}; "
        f"{advice['draws']} draws of {advice['seconds']:g} s, {cores}"
    )
    style.add_title(figure, "Predicted latency of each executor", subtitle)
    style.save(figure, folder, "advice")
