# SPDX-License-Identifier: Apache-2.0
"""How well the simulator predicts the real ROS 2 stack: panels from validation.json."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.gridspec import GridSpec

from hotpath_report import style
from hotpath_report.style import FAINT, INK, SERIES
from hotpath_report.tables import read_json

SIMULATED, REAL, LIVE = SERIES[:3]
BAR_OF_AGREEMENT = 0.98
LATENCY_HEIGHT = 0.66  # of the distance between two rows

Entry = dict[str, Any]


def short(entry: Entry) -> str:
    """Set and executor of an entry."""
    return f"{entry['set'].removeprefix('timers_only_').removesuffix('_authors')} %  {entry['executor']}"


def run_name(entry: Entry) -> str:
    """Executor and, where there are several, repetition of a given run."""
    return entry["executor"] + (f" #{entry['repetition']}" if "repetition" in entry else "")


def live_name(entry: Entry) -> str:
    """The golden trace that a given run is compared with."""
    return short({"set": entry["golden"]["set"], "executor": run_name(entry)})


def point(axes: Axes, x: float, y: float, colour: str, size: float = 5, hollow: bool = False) -> None:
    """A dot, or a ring."""
    look = (
        {"color": "white", "markeredgecolor": colour, "markeredgewidth": 2} if hollow else {"color": colour}
    )
    axes.plot(x, y, "o", markersize=size, zorder=3 if hollow else 4, **look)


def span(axes: Axes, low: float, high: float, y: float, colour: str) -> None:
    """A range of values."""
    axes.plot([low, high], [y, y], "-o", color=colour, linewidth=5, markersize=5, zorder=3)


def finish(axes: Axes, names: Sequence[str], title: str, label: str) -> None:
    """What every panel has."""
    style.rows_of_labels(axes, names)
    axes.set_title(title)
    axes.set_xlabel(label)


def draw_order(axes: Axes, golden: list[Entry]) -> None:
    """Similarity of the order of jobs, without and with costs."""
    for y, entry in enumerate(golden):
        bare, costs = entry["without_costs"], entry["with_costs"]
        among_equals = bare["similarity_by_period"] == 1 and bare["similarity"] < 1
        key = "similarity_by_period" if among_equals else "similarity"
        point(axes, bare[key], y, SIMULATED, 9, hollow=True)
        point(axes, costs[key], y, SIMULATED)
        if among_equals:
            text = f"up to equal periods ({bare['similarity']:.2f} with them)"
            place = {"xytext": (-10, 0), "textcoords": "offset points", "ha": "right", "va": "center"}
            axes.annotate(text, (0.9985, y), **place, fontsize=8, color=FAINT, bbox=style.OPAQUE)
    axes.axvline(BAR_OF_AGREEMENT, color=INK, linewidth=1.2, linestyle=style.DASHED, zorder=1)
    axes.set_xlim(0.94, 1.002)
    label = "similarity of the two orders of jobs (1: the same)"
    finish(axes, list(map(short, golden)), "Golden traces, job by job", label)


def draw_lost(axes: Axes, golden: list[Entry]) -> None:
    """Lost IMU jobs, real against simulated."""
    for y, entry in enumerate(golden):
        imu = entry["with_costs"]["tasks"][-1]
        real, simulated = imu["measured_lost_percent"], imu["simulated_lost_percent"]
        axes.hlines(y, *sorted((real, simulated)), color=FAINT, linewidth=1, zorder=2)
        point(axes, real, y, REAL, 9, hollow=True)
        point(axes, simulated, y, SIMULATED)
    axes.set_xlim(left=-1)
    finish(axes, list(map(short, golden)), "Golden traces: jobs lost, costs modelled", "lost IMU jobs (%)")


def draw_ranges(axes: Axes, entries: list[Entry]) -> None:
    """Ranges of lost IMU jobs: over repetitions, and over unknown phases."""
    for y, entry in enumerate(entries):
        for shift, side, colour in ((-0.16, "measured", REAL), (0.16, "simulated", SIMULATED)):
            low, high = entry[side]["imu_lost_percent"]
            span(axes, low, high, y + shift, colour)
    finish(axes, list(map(short, entries)), "The authors' programs, phases unknown", "lost IMU jobs (%)")


def draw_latencies(axes: Axes, entries: list[Entry], title: str, sides: Sequence[tuple[str, str]]) -> None:
    """Tenth to ninetieth percentile with the median; `sides`: keys and colours, upper first."""
    labels = []
    for y, entry in enumerate(entries):
        for number, (side, colour) in enumerate(sides):
            q = entry.get(side, {})
            if q.get("p50") is not None:
                place = y + LATENCY_HEIGHT * ((number + 0.5) / len(sides) - 0.5)
                span(axes, q["p10"], q["p90"], place, colour)
                axes.plot(q["p50"], place, "|", color=INK, markersize=10, markeredgewidth=2.2, zorder=4)
        measured, simulated = entry["measured_ms"]["p50"], entry["simulated_ms"]["p50"]
        differs = f"  {100 * (simulated / measured - 1):+.1f} %" if measured and simulated else ""
        labels.append(run_name(entry) + differs)
    axes.set_xlim(left=0)
    finish(axes, labels, title, "hot-path latency (ms): 10th to 90th percentile, median")


def draw_live_order(axes: Axes, entries: list[Entry]) -> None:
    """Similarity of a live run to the real stack, and to its own simulation."""
    for y, entry in enumerate(entries):
        point(axes, entry["golden"]["comparison"]["similarity"], y, REAL, 8)
        point(axes, entry["comparison"]["similarity"], y, SIMULATED, 8)
    axes.axvline(BAR_OF_AGREEMENT, color=INK, linewidth=1.2, linestyle=style.DASHED, zorder=1)
    label = "similarity of the live order of jobs to the other's"
    finish(axes, list(map(live_name, entries)), "Given runs against the golden traces", label)


def draw_live_lost(axes: Axes, entries: list[Entry]) -> None:
    """Lost IMU jobs of the real stack, live and in the simulation of the live run."""
    for y, entry in enumerate(entries):
        golden, own = entry["golden"]["comparison"]["tasks"][-1], entry["comparison"]["tasks"][-1]
        point(axes, golden["real_lost_percent"], y, REAL, 12)
        point(axes, golden["live_lost_percent"], y, LIVE, 9)
        point(axes, own["simulated_lost_percent"], y, SIMULATED)
    axes.set_xlim(left=-1)
    finish(axes, list(map(live_name, entries)), "Given runs: jobs lost", "lost IMU jobs (%)")


Panel = tuple[Callable[[Axes], None], int]  # draws itself; its number of rows


def pairs_of_panels(result: Entry) -> Iterator[tuple[Panel, Panel | None]]:
    """The panels, two beside each other."""
    golden, sets, autoware = result["golden"], result["timers_only"], result["autoware"]
    yield (lambda a: draw_order(a, golden), len(golden)), (lambda a: draw_lost(a, golden), len(golden))
    title, sides = "Autoware with the real stack's phases", (
        ("measured_ms", REAL),
        ("simulated_ms", SIMULATED),
    )
    yield (
        (lambda a: draw_ranges(a, sets), len(sets)),
        (lambda a: draw_latencies(a, autoware, title, sides), len(autoware)),
    )
    chains = [entry for entry in result["runs"] if "measured_ms" in entry]
    if chains:
        own = (("real_ms", REAL), ("measured_ms", LIVE), ("simulated_ms", SIMULATED))
        yield (
            lambda a: draw_latencies(a, chains, "Given runs and their own simulation", own),
            len(chains),
        ), None
    timers = [entry for entry in result["runs"] if "golden" in entry]
    if timers:
        yield (lambda a: draw_live_order(a, timers), len(timers)), (
            lambda a: draw_live_lost(a, timers),
            len(timers),
        )


def draw(folder: str) -> None:
    """Writes validate.svg and validate.png. Raises InputError."""
    pairs = list(pairs_of_panels(read_json(Path(folder) / "validation.json", "hotpath validate")))
    rows = [max(2, *(panel[1] for panel in pair if panel)) for pair in pairs]
    figure, _ = style.new_figure(14, sum(0.9 + 0.34 * n for n in rows))
    figure.clear()
    grid: GridSpec = figure.add_gridspec(len(pairs), 2, height_ratios=[0.9 + 0.34 * n for n in rows])
    for row, pair in enumerate(pairs):
        for column, panel in enumerate(pair):
            if panel:
                panel[0](figure.add_subplot(grid[row, column]))
    ring: Entry = {"markerfacecolor": "white", "markeredgecolor": SIMULATED, "markersize": 9}
    named = (("real", REAL), ("live", LIVE), ("simulated", SIMULATED))
    handles = [style.line(name, color=colour, linewidth=5) for name, colour in named]
    style.add_key(figure, [*handles, style.dot("simulated without costs", **ring)], 4)
    what = "rclcpp 26 and the paper authors' fork on Fast DDS (reference_system/ros2_reference)"
    style.add_title(figure, "The simulator against the real ROS 2 stack", what)
    style.save(figure, folder, "validate")
