# SPDX-License-Identifier: Apache-2.0
"""How well the simulator predicts the real ROS 2 stack: four panels from validation.json.

Writes validate.svg and validate.png into the folder that `hotpath validate` wrote.
"""

import argparse
import json
import sys
from pathlib import Path

from run_data import BLUE, FAINT, GREEN, INK, ORANGE, InputError, plt, run_script, save, write_title

REAL, LIVE, SIMULATED = ORANGE, GREEN, BLUE
BAR_OF_AGREEMENT = 0.98
LATENCY_HEIGHT = 0.66  # of the distance between two rows


def read(folder):
    path = Path(folder) / "validation.json"
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; give a folder written by `hotpath validate`") from None
    except ValueError as error:
        raise InputError(f"{path}: not valid JSON: {error}") from None


def short(entry):
    return f"{entry['set'].removeprefix('timers_only_').removesuffix('_authors')} %  {entry['executor']}"


def rows(axes, labels):
    axes.set_yticks([-place for place in range(len(labels))], labels, fontsize=10)
    axes.set_ylim(-len(labels) + 0.4, 0.6)
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="x")


def draw_order(axes, golden):
    """Similarity of the order of jobs, without and with costs."""
    for place, entry in enumerate(golden):
        bare, costs = entry["without_costs"], entry["with_costs"]
        among_equals = bare["similarity_by_period"] == 1 and bare["similarity"] < 1
        key = "similarity_by_period" if among_equals else "similarity"
        axes.plot(bare[key], -place, "o", color="white", markeredgecolor=SIMULATED, markersize=9, zorder=3)
        axes.plot(costs[key], -place, "o", color=SIMULATED, markersize=5, zorder=4)
        if among_equals:
            axes.annotate(
                f"up to equal periods ({bare['similarity']:.2f} with them)",
                (0.9985, -place),
                (-10, 0),
                textcoords="offset points",
                ha="right",
                va="center",
                fontsize=9,
                color=FAINT,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 1},
            )
    axes.axvline(BAR_OF_AGREEMENT, color=INK, linewidth=1.2, linestyle=(0, (5, 3)), zorder=1)
    axes.set_xlim(0.94, 1.002)
    axes.set_xlabel("similarity of the two orders of jobs (1: the same)")
    axes.set_title("Golden traces, job by job", loc="left", fontsize=13)
    rows(axes, [short(entry) for entry in golden])


def draw_pairs(axes, pairs, label, title):
    """Real against simulated: a ring and a dot on each row."""
    for place, (_, real, simulated) in enumerate(pairs):
        axes.hlines(-place, *sorted((real, simulated)), color=FAINT, linewidth=1, zorder=2)
        ring = {"color": "white", "markeredgecolor": REAL, "markeredgewidth": 2, "markersize": 9}
        axes.plot(real, -place, "o", zorder=3, **ring)
        axes.plot(simulated, -place, "o", color=SIMULATED, markersize=5, zorder=4)
    axes.set_xlabel(label)
    axes.set_title(title, loc="left", fontsize=13)
    axes.set_xlim(left=-1)
    rows(axes, [name for name, _, _ in pairs])


def lost(golden):
    for entry in golden:
        imu = entry["with_costs"]["tasks"][-1]
        yield short(entry), imu["measured_lost_percent"], imu["simulated_lost_percent"]


def draw_range(axes, low, high, y, colour):
    axes.plot([low, high], [y, y], "-o", color=colour, linewidth=5, markersize=5, zorder=3)


def draw_ranges(axes, entries):
    """Ranges of lost IMU jobs: over repetitions, and over unknown phases."""
    for place, entry in enumerate(entries):
        for shift, side, colour in ((0.16, "measured", REAL), (-0.16, "simulated", SIMULATED)):
            low, high = entry[side]["imu_lost_percent"]
            draw_range(axes, low, high, -place + shift, colour)
    axes.set_xlabel("lost IMU jobs (%)")
    axes.set_title("The authors' programs, phases unknown", loc="left", fontsize=13)
    rows(axes, [short(entry) for entry in entries])


def run_name(entry):
    repetition = f" #{entry['repetition']}" if "repetition" in entry else ""
    return entry["executor"] + repetition


def draw_latencies(axes, entries, title, sides):
    """Tenth to ninetieth percentile with the median; `sides`: keys and colours, upper first."""
    labels = []
    for place, entry in enumerate(entries):
        for number, (side, colour) in enumerate(sides):
            if side not in entry or entry[side]["p50"] is None:
                continue
            q, y = entry[side], -place + LATENCY_HEIGHT * (0.5 - (number + 0.5) / len(sides))
            draw_range(axes, q["p10"], q["p90"], y, colour)
            axes.plot(q["p50"], y, "|", color=INK, markersize=11, markeredgewidth=2.4, zorder=4)
        measured, simulated = entry["measured_ms"]["p50"], entry["simulated_ms"]["p50"]
        differs = f"  {100 * (simulated / measured - 1):+.1f} %" if measured and simulated else ""
        labels.append(run_name(entry) + differs)
    axes.set_xlabel("hot-path latency (ms): 10th to 90th percentile, median")
    axes.set_title(title, loc="left", fontsize=13)
    axes.set_xlim(left=0)
    rows(axes, labels)


def draw_live_order(axes, entries):
    """Similarity of a live run to the real stack, and to its own simulation."""
    for place, entry in enumerate(entries):
        for comparison, colour in ((entry["golden"]["comparison"], REAL), (entry["comparison"], SIMULATED)):
            axes.plot(comparison["similarity"], -place, "o", color=colour, markersize=8, zorder=3)
    axes.axvline(BAR_OF_AGREEMENT, color=INK, linewidth=1.2, linestyle=(0, (5, 3)), zorder=1)
    axes.set_xlabel("similarity of the live order of jobs to the other's")
    axes.set_title("Live runs against the golden traces", loc="left", fontsize=13)
    rows(axes, [f"{short({'set': e['golden']['set'], 'executor': run_name(e)})}" for e in entries])


def draw_live_lost(axes, entries):
    """Lost IMU jobs of the real stack, live and in the simulation of the live run."""
    for place, entry in enumerate(entries):
        golden, own = entry["golden"]["comparison"]["tasks"][-1], entry["comparison"]["tasks"][-1]
        for percent, colour, size in (
            (golden["real_lost_percent"], REAL, 12),
            (golden["live_lost_percent"], LIVE, 9),
            (own["simulated_lost_percent"], SIMULATED, 5),
        ):
            axes.plot(percent, -place, "o", color=colour, markersize=size, zorder=3)
    axes.set_xlabel("lost IMU jobs (%)")
    axes.set_title("Live runs: jobs lost", loc="left", fontsize=13)
    axes.set_xlim(left=-1)
    rows(axes, [f"{short({'set': e['golden']['set'], 'executor': run_name(e)})}" for e in entries])


def add_key(figure):
    ring = {"marker": "o", "color": "white", "markeredgecolor": SIMULATED, "markersize": 9}
    handles = [
        plt.Line2D([], [], color=REAL, linewidth=5, label="real"),
        plt.Line2D([], [], color=LIVE, linewidth=5, label="live"),
        plt.Line2D([], [], color=SIMULATED, linewidth=5, label="simulated"),
        plt.Line2D([], [], linestyle="", label="simulated without costs", **ring),
    ]
    figure.legend(
        handles=handles, loc="lower left", bbox_to_anchor=(0, 0), ncol=len(handles), frameon=False, fontsize=11
    )


def draw(arguments):
    result = read(arguments.folder)
    chains = [entry for entry in result["runs"] if "measured_ms" in entry]
    timers = [entry for entry in result["runs"] if "golden" in entry]
    ratios = [len(result["golden"]), len(result["timers_only"])]
    ratios += [max(2, len(entries)) for entries in (chains, timers) if entries]
    height = 13.5 + sum(1.2 + 0.4 * ratio for ratio in ratios[2:])
    figure, panels = plt.subplots(
        len(ratios), 2, figsize=(15, height), squeeze=False, gridspec_kw={"height_ratios": ratios}
    )
    draw_order(panels[0][0], result["golden"])
    draw_pairs(
        panels[0][1],
        list(lost(result["golden"])),
        "lost IMU jobs (%)",
        "Golden traces: jobs lost, costs modelled",
    )
    draw_ranges(panels[1][0], result["timers_only"])
    against_real = (("measured_ms", REAL), ("simulated_ms", SIMULATED))
    draw_latencies(panels[1][1], result["autoware"], "Autoware with the real stack's phases", against_real)
    if chains:
        sides = (("real_ms", REAL), ("measured_ms", LIVE), ("simulated_ms", SIMULATED))
        draw_latencies(panels[2][0], chains, "Given runs against their own simulation", sides)
        panels[2][1].set_axis_off()
    if timers:
        draw_live_order(panels[-1][0], timers)
        draw_live_lost(panels[-1][1], timers)
    what = "rclcpp 26 and the paper authors' fork on Fast DDS; see reference_system/ros2_reference"
    top = write_title(figure, "The simulator against the real ROS 2 stack", what, False)
    figure.subplots_adjust(
        left=0.12,
        right=0.99,
        top=1 - top - 0.35 / height,
        bottom=0.95 / height,
        hspace=0.28,
        wspace=0.32,
    )
    add_key(figure)
    save(figure, arguments.output or arguments.folder, "validate")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", metavar="FOLDER", help="folder written by `hotpath validate`")
    parser.add_argument("--output", metavar="DIR", help="where to write the figure (default: FOLDER)")
    return run_script(draw, parser.parse_args())


if __name__ == "__main__":
    sys.exit(main())
