# SPDX-License-Identifier: Apache-2.0
"""Reads run folders (run.json, chains.csv, jobs.csv) and draws what the figures share."""

import csv
import json
import math
import os
import sys
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (needs the backend)
import numpy as np  # noqa: E402

# Okabe and Ito's palette: told apart by the colour-blind and in grey.
SKY_BLUE, ORANGE, VERMILION = "#56B4E9", "#E69F00", "#D55E00"
BLUE, GREEN, PURPLE = "#0072B2", "#009E73", "#CC79A7"
INK, FAINT = "#222222", "#666666"

PNG_DPI = 150


class InputError(Exception):
    """What the user gave cannot be drawn; the message says what is wrong and what would be right."""


class Run:
    """One run folder. Instants in its files are relative to the epoch of the run."""

    def __init__(self, folder):
        self.folder = Path(folder)
        path = self.folder / "run.json"
        try:
            self.facts = json.loads(path.read_text(encoding="utf-8"))
        except OSError as error:
            raise InputError(f"{path}: {error.strerror}; give a folder written by `hotpath`") from None
        except ValueError as error:
            raise InputError(f"{path}: not valid JSON: {error}") from None
        self.executors = self["executors"]
        if not self.executors:
            raise InputError(f"{path}: `executors` is empty, there is nothing to draw")

    def __getitem__(self, key):
        """The value of a dotted key of run.json."""
        value = self.facts
        for part in key.split("."):
            if not isinstance(value, dict) or part not in value:
                raise InputError(f"{self.folder / 'run.json'}: key `{key}` is missing")
            value = value[part]
        return value

    def get(self, key, default):
        return self.facts.get(key, default)

    @property
    def partial(self):
        return self.facts.get("complete") is not True

    @property
    def simulated(self):
        return self.facts.get("kind") == "simulated"

    @property
    def kind(self):
        return "simulated" if self.simulated else "live"

    def what_ran(self):
        """Two lines: the experiment, and where it ran."""
        if self.simulated:
            cores = self["platform.cores"]
            where = "one core" if cores == 1 else f"{cores} cores"
        else:
            where = f"CPU {cpu_list(self['cpus'])}"
        parts = [
            self["graph.name"],
            "simulated" if self.simulated else self["transport"],
            f"{self['load_percent']:.3g} % load",
            f"phases: {self['phases']}",
            f"on {where}",
            f"{self['repetitions']} × {self['duration_s']:.3g} s",
        ]
        machine = "" if self.simulated else f"{self['machine.cpu_model']} · Linux {self['machine.kernel']}"
        return " · ".join(parts) + "\n" + (machine or self.costs())

    def costs(self):
        """What the simulated platform charges, in words."""
        platform = self["platform"]
        charged = [
            f"{key[: -len('_us')].replace('_', ' ')} {value:g} µs"
            for key, value in platform.items()
            if key.endswith("_us") and value
        ]
        times = f"execution times: {self['execution_times']}"
        return " · ".join(charged + [times]) if charged else f"no costs · {times}"

    def rows(self, name, columns):
        """The named columns of each row of a CSV file."""
        path = self.folder / name
        try:
            with open(path, newline="", encoding="utf-8") as file:
                reader = csv.reader(file)
                header = next(reader, [])
                missing = [column for column in columns if column not in header]
                if missing:
                    raise InputError(f"{path}:1: column `{missing[0]}` is missing from the header")
                places = [header.index(column) for column in columns]
                for row in reader:
                    if len(row) != len(header):
                        raise InputError(
                            f"{path}:{reader.line_num}: {len(row)} columns instead of {len(header)}"
                        )
                    yield [row[place] for place in places]
        except OSError as error:
            raise InputError(f"{path}: {error.strerror}") from None
        except (UnicodeDecodeError, csv.Error) as error:
            raise InputError(f"{path}: not a CSV file in UTF-8: {error}") from None


def hatches(runs):
    """Of each run's marks: where live and simulated runs meet in one figure, the simulated are hatched."""
    if len({run.kind for run in runs}) == 1:
        return [None] * len(runs)
    return ["///" if run.simulated else None for run in runs]


def milliseconds(text, run, file):
    try:
        return int(text) / 1e6
    except ValueError:
        raise InputError(f"{run.folder / file}: `{text}` is not a whole number of nanoseconds") from None


def cpu_list(cpus):
    """CPU numbers as the kernel writes them: 0-3,8."""
    ranges = []
    for cpu in sorted(cpus):
        if ranges and cpu == ranges[-1][1] + 1:
            ranges[-1][1] = cpu
        else:
            ranges.append([cpu, cpu])
    return ",".join(f"{low}-{high}" if low < high else str(low) for low, high in ranges)


def three_digits(value):
    """A number with three significant digits, trailing zeros kept, never with an exponent."""
    if value <= 0:
        return "0"
    return f"{value:.{max(0, 2 - math.floor(math.log10(value)))}f}"


def set_style():
    plt.rcParams.update(
        {
            "font.size": 12,
            "axes.titlesize": 15,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.edgecolor": FAINT,
            "axes.labelcolor": INK,
            "axes.axisbelow": True,
            "axes.grid": True,
            "axes.grid.axis": "y",
            "grid.color": "#E4E4E4",
            "text.color": INK,
            "xtick.color": INK,
            "ytick.color": INK,
            "figure.facecolor": "white",
            "savefig.facecolor": "white",
            # The same data give the same bytes.
            "svg.hashsalt": "hotpath",
        }
    )


def draw_violin(axes, x, samples, colour, width=0.85, hatch=None):
    """A violin from the smallest to the largest sample with minimum, median and maximum marked.

    Fewer than three samples, or equal ones, have no density: they are drawn as dots.
    """
    samples = np.asarray(samples)
    if len(samples) == 0:
        return
    if len(samples) < 3 or np.ptp(samples) < 1e-6:
        axes.plot([x] * len(samples), samples, "o", color=colour, markersize=6, zorder=3)
        return

    def bandwidth(kde):
        # Half of Scott's: latencies lie in clusters a crunch apart, which his smears.
        return 0.5 * kde.scotts_factor()

    violin = axes.violinplot(
        samples, [x], widths=width, points=200, showextrema=False, bw_method=bandwidth
    )
    for body in violin["bodies"]:
        body.set(facecolor=colour, edgecolor=colour, alpha=0.55, linewidth=1, zorder=2, hatch=hatch)
    low, median, high = np.min(samples), np.median(samples), np.max(samples)
    axes.vlines(x, low, high, color=colour, linewidth=1.2, zorder=3)
    axes.hlines([low, high], x - 0.16 * width, x + 0.16 * width, color=colour, linewidth=1.6, zorder=3)
    axes.hlines(median, x - 0.28 * width, x + 0.28 * width, color=INK, linewidth=2.4, zorder=4)


def write_title(figure, title, subtitle, partial):
    """Title and subtitle in the figure's upper left corner; returns the height they take, as a share."""
    height = figure.get_figheight()
    if partial:
        title += " (partial: the run did not end)"
    left = 0.12 / figure.get_figwidth()
    lines = subtitle.count("\n") + 1
    figure.text(left, 1 - 0.12 / height, title, fontsize=17, fontweight="bold", va="top")
    figure.text(
        left, 1 - 0.52 / height, subtitle, fontsize=11, color=FAINT, va="top", linespacing=1.35
    )
    return (0.62 + 0.22 * lines) / height


def save(figure, folder, name):
    """Writes name.svg and name.png, each under its final name only when it is whole."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for suffix, metadata in ((".svg", {"Date": None, "Creator": "hotpath"}), (".png", {"Software": None})):
        handle, unfinished = tempfile.mkstemp(dir=folder, prefix=f".{name}", suffix=suffix)
        os.close(handle)
        try:
            figure.savefig(unfinished, dpi=PNG_DPI, metadata=metadata)
            os.chmod(unfinished, 0o644)
            os.replace(unfinished, folder / (name + suffix))
        except BaseException:
            os.unlink(unfinished)
            raise
        print(folder / (name + suffix))
    plt.close(figure)


def run_script(draw, arguments):
    """Exit code of a figure script: 2 for input that cannot be drawn, 1 for a figure that cannot be written."""
    program = Path(sys.argv[0]).name
    try:
        set_style()
        draw(arguments)
    except InputError as error:
        print(f"{program}: {error}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"{program}: cannot write the figure: {error}", file=sys.stderr)
        return 1
    return 0
