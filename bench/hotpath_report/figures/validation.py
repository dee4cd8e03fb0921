# SPDX-License-Identifier: Apache-2.0
"""Simulator against the real ROS 2 stack: panels from validation.json."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.gridspec import GridSpec

from hotpath_report import style
from hotpath_report.style import FAINT, INK, SERIES
from hotpath_report.tables import read_json

SIMULATED, REAL, LIVE = SERIES[:3]
BAR_OF_AGREEMENT = 0.98
LOST = "lost IMU jobs (%)"
LATENCY_HEIGHT = 0.66  # share of the distance between rows

Entry = dict[str, Any]


def run_name(entry: Entry) -> str:
    """Executor and, if known, repetition of a given run."""
    return entry["executor"] + (f" #{entry['repetition']}" if "repetition" in entry else "")


def golden_name(entry: Entry) -> str:
    """Set and executor of an entry, or of its golden trace."""
    name: str = (entry.get("golden") or entry)["set"]
    return f"{name.removeprefix('timers_only_').removesuffix('_authors')} %  {run_name(entry)}"


def point(axes: Axes, x: float, y: float, colour: str, size: float = 5, hollow: bool = False) -> None:
    """Draws a dot or a ring."""
    look = (
        {"color": "white", "markeredgecolor": colour, "markeredgewidth": 2} if hollow else {"color": colour}
    )
    axes.plot(x, y, "o", markersize=size, zorder=3 if hollow else 4, **look)


def span(axes: Axes, low: float, high: float, y: float, colour: str) -> None:
    """Draws a range of values."""
    axes.plot([low, high], [y, y], "-o", color=colour, linewidth=5, markersize=5, zorder=3)


def draw_order(axes: Axes, golden: list[Entry]) -> None:
    """Similarity of job orders, without and with costs."""
    for y, entry in enumerate(golden):
        bare, costs = entry["without_costs"], entry["with_costs"]
        among_equals = bare["similarity_by_period"] == 1 and bare["similarity"] < 1
        key = "similarity_by_period" if among_equals else "similarity"
        point(axes, bare[key], y, SIMULATED, 9, hollow=True)
        point(axes, costs[key], y, SIMULATED)
        if among_equals:
            text = f"up to equal periods ({bare['similarity']:.2f} with them)"
            style.note(axes, text, (0.9985, y), (-10, 0), ha="right", color=FAINT, bbox=style.OPAQUE)
    axes.axvline(BAR_OF_AGREEMENT, color=INK, linewidth=1.2, linestyle=style.DASHED, zorder=1)
    label = "similarity of the two orders of jobs (1: the same)"
    look = {"title": "Golden traces, job by job", "xlabel": label, "xlim": (0.94, 1.002)}
    style.rows_of_labels(axes, list(map(golden_name, golden)), **look)


def draw_lost(axes: Axes, golden: list[Entry]) -> None:
    """Lost IMU jobs, real against simulated."""
    for y, entry in enumerate(golden):
        sides = (entry["with_costs"][side] for side in ("measured", "other"))
        real, simulated = (side["lost_percent"]["IMU"] for side in sides)
        axes.hlines(y, *sorted((real, simulated)), color=FAINT, linewidth=1, zorder=2)
        point(axes, real, y, REAL, 9, hollow=True)
        point(axes, simulated, y, SIMULATED)
    look = {"title": "Golden traces: jobs lost, costs modelled", "xlabel": LOST, "xlim": (-1, None)}
    style.rows_of_labels(axes, list(map(golden_name, golden)), **look)


def draw_ranges(axes: Axes, entries: list[Entry]) -> None:
    """Ranges of lost IMU jobs over repetitions and over unknown phases."""
    for y, entry in enumerate(entries):
        for shift, side, colour in ((-0.16, "measured", REAL), (0.16, "simulated", SIMULATED)):
            low, high = entry[side]["imu_lost_percent"]
            span(axes, low, high, y + shift, colour)
    look = {"title": "The authors' programs, phases unknown", "xlabel": LOST}
    style.rows_of_labels(axes, list(map(golden_name, entries)), **look)


def draw_latencies(axes: Axes, entries: list[Entry], title: str, sides: Sequence[tuple[str, str]]) -> None:
    """10th to 90th percentile with the median; `sides`: keys and colours, upper first."""
    labels = []
    for y, entry in enumerate(entries):
        for number, (side, colour) in enumerate(sides):
            q = entry[side]
            if q and q["p50"] is not None:
                place = y + LATENCY_HEIGHT * ((number + 0.5) / len(sides) - 0.5)
                span(axes, q["p10"], q["p90"], place, colour)
                axes.plot(q["p50"], place, "|", color=INK, markersize=10, markeredgewidth=2.2, zorder=4)
        percent = entry["median"]["differs_percent"]
        labels.append(run_name(entry) + ("" if percent is None else f"  {percent:+.1f} %"))
    label = "hot-path latency (ms): 10th to 90th percentile, median"
    style.rows_of_labels(axes, labels, title=title, xlabel=label, xlim=(0, None))


def draw_live_order(axes: Axes, entries: list[Entry]) -> None:
    """Similarity of a live run to the real stack and to its own simulation."""
    for y, entry in enumerate(entries):
        point(axes, entry["golden"]["comparison"]["similarity"], y, REAL, 8)
        point(axes, entry["comparison"]["similarity"], y, SIMULATED, 8)
    axes.axvline(BAR_OF_AGREEMENT, color=INK, linewidth=1.2, linestyle=style.DASHED, zorder=1)
    label = "similarity to the live order of jobs"
    look = {"title": "Given runs against the golden traces", "xlabel": label}
    style.rows_of_labels(axes, list(map(golden_name, entries)), **look)


def draw_live_lost(axes: Axes, entries: list[Entry]) -> None:
    """Lost IMU jobs: real stack, live run and its simulation."""
    for y, entry in enumerate(entries):
        golden, own = entry["golden"]["comparison"], entry["comparison"]
        point(axes, golden["measured"]["lost_percent"]["IMU"], y, REAL, 12)
        point(axes, golden["other"]["lost_percent"]["IMU"], y, LIVE, 9)
        point(axes, own["other"]["lost_percent"]["IMU"], y, SIMULATED)
    look = {"title": "Given runs: jobs lost", "xlabel": LOST, "xlim": (-1, None)}
    style.rows_of_labels(axes, list(map(golden_name, entries)), **look)


Panel = tuple[Callable[..., None], list[Entry]]  # drawing function and its entries


def rows_of_panels(result: Entry) -> list[list[Panel]]:
    """The panels in rows of two; rows without entries are left out."""
    real_sides = (("measured_ms", REAL), ("simulated_ms", SIMULATED))
    autoware = partial(draw_latencies, title="Autoware with the real stack's phases", sides=real_sides)
    own_sides = (("real_ms", REAL), ("measured_ms", LIVE), ("simulated_ms", SIMULATED))
    own = partial(draw_latencies, title="Given runs and their own simulation", sides=own_sides)
    timers = [entry for entry in result["runs"] if entry["golden"]]
    hot_path = [entry | entry["latencies"] for entry in result["runs"] if entry["latencies"]]
    rows: list[list[Panel]] = [
        [(draw_order, result["golden"]), (draw_lost, result["golden"])],
        [(draw_ranges, result["timers_only"]), (autoware, result["autoware"])],
        [(own, hot_path)],
        [(draw_live_order, timers), (draw_live_lost, timers)],
    ]
    return [row for row in rows if row[0][1]]


def draw(folder: str) -> None:
    """Writes validate.svg and validate.png if there is data. Raises InputError."""
    rows = rows_of_panels(read_json(Path(folder) / "validation.json", "hotpath diff --simulated"))
    if not rows:
        return
    heights = [0.9 + 0.34 * max(2, *(len(entries) for _, entries in row)) for row in rows]
    figure, _ = style.new_figure(14, sum(heights))
    figure.clear()
    grid: GridSpec = figure.add_gridspec(len(rows), 2, height_ratios=heights)
    for k, row in enumerate(rows):
        for column, (draw_panel, entries) in enumerate(row):
            draw_panel(figure.add_subplot(grid[k, column]), entries)
    ring: Entry = {"markerfacecolor": "white", "markeredgecolor": SIMULATED, "markersize": 9}
    named = (("real", REAL), ("live", LIVE), ("simulated", SIMULATED))
    handles = [style.line(name, color=colour, linewidth=5) for name, colour in named]
    style.add_key(figure, [*handles, style.dot("simulated without costs", **ring)], 4)
    stacks = "rclcpp 26 and the paper authors' fork on Fast DDS (reference_system/ros2_reference)"
    style.add_title(figure, "The simulator against the real ROS 2 stack", stacks)
    style.save(figure, folder, "validate")
