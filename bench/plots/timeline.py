# SPDX-License-Identifier: Apache-2.0
"""Gantt chart of a part of a trace, live or simulated: one row per task.

Reads run.json and jobs.csv of a run folder (and summary.json, if there, for the order of tasks) and writes
the chart as .svg and, beside it, .png.
"""

import argparse
import json
import sys
from pathlib import Path

from run_data import BLUE, FAINT, GREEN, INK, ORANGE, PURPLE, SKY_BLUE, VERMILION, InputError, Run
from run_data import milliseconds, plt, run_script, save, write_title

WORKER_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY_BLUE)
TIMER_MANAGEMENT = 1  # worker of the events executors
BAR, ARROW = 0.56, 0.42  # height of a bar and of a release above the middle of its row
MOST_MARKS = 20000
COLUMNS = [
    *("executor", "repetition", "task", "kind", "outcome", "timestamp_ns", "release_ns", "start_ns"),
    *("finish_ns", "deadline_ns", "worker", "process"),
]


class Job:
    def __init__(self, row, run):
        _, _, self.task, self.kind, self.outcome, *rest = row
        instants = [milliseconds(text, run, "jobs.csv") if text else None for text in rest[:5]]
        self.timestamp, self.release, self.start, self.finish, self.deadline = instants
        self.worker = int(rest[5] or 0)
        self.process = int(rest[6] or 0)
        self.displaced = []  # intervals during which another thread had its core

    @property
    def late(self):
        return self.finish is not None and self.deadline is not None and self.finish > self.deadline + 1e-9


class Window:
    """The jobs of one executor's repetition that touch [begin, end), in ms."""

    def __init__(self, run, executor, repetition, begin, end):
        self.run, self.executor, self.begin, self.end = run, executor, begin, end
        self.jobs = []
        known = False
        for row in run.rows("jobs.csv", COLUMNS):
            if row[0] != executor or row[1] != str(repetition):
                continue
            known = True
            job = Job(row, run)
            last = job.finish if job.finish is not None else end if job.start is not None else job.timestamp
            if job.timestamp < end and max(last, job.timestamp) >= begin:
                self.jobs.append(job)
        if not known:
            raise InputError(
                f"{run.folder / 'jobs.csv'}: no job of executor {executor}, repetition {repetition}; "
                f"the run has {', '.join(run.executors)}"
            )
        if not self.jobs:
            raise InputError(
                f"{run.folder / 'jobs.csv'}: nothing happens from {begin:g} to {end:g} ms; choose other times"
            )
        if len(self.jobs) > MOST_MARKS:
            raise InputError(
                f"{len(self.jobs)} jobs from {begin:g} to {end:g} ms are too many for a chart; "
                "choose a shorter part, or the trace for Perfetto"
            )
        self.events = executor.split(":")[0].endswith(("-ro", "-re"))
        self.release_slots = self.paid_releases()
        if self.one_core():
            self.find_displacements()

    def one_core(self):
        if self.run.simulated:
            return self.run["platform.cores"] == 1
        return len(self.run.get("cpus", [])) == 1

    def paid_releases(self):
        """Intervals in which the releaser of a simulated events executor pays for its releases."""
        if not self.run.simulated or not self.events:
            return []
        delta, k = (self.run[f"platform.{name}_cost_us"] / 1e3 for name in ("release", "pass"))
        if self.executor.split(":")[0] == "events-re" or delta + k == 0:
            return []
        releases = {}
        for job in self.jobs:
            if job.kind == "timer" and job.release is not None:
                releases[job.release] = releases.get(job.release, 0) + 1
        return [(at, at + k + n * delta) for at, n in sorted(releases.items())]

    def find_displacements(self):
        """On one core: whoever starts while a job of another thread runs has taken the core from it."""
        running = sorted((j for j in self.jobs if j.finish is not None), key=lambda j: j.start)
        intruders = [(j.start, j.finish) for j in running if self.events and j.worker == TIMER_MANAGEMENT]
        intruders += self.release_slots
        for job in running:
            if self.events and job.worker != TIMER_MANAGEMENT:
                job.displaced = [
                    (max(a, job.start), min(b, job.finish))
                    for a, b in intruders
                    if a < job.finish and b > job.start and b > a
                ]

    def tasks(self):
        """Those that do something here, in the order of the graph if it is known."""
        found = list(dict.fromkeys(job.task for job in self.jobs))
        try:
            summary = json.loads((self.run.folder / "summary.json").read_text(encoding="utf-8"))
            order = [task["task"] for task in summary["executors"][0]["tasks"]]
        except (OSError, ValueError, KeyError, IndexError):
            return found
        return sorted(found, key=lambda task: order.index(task) if task in order else len(order))

    def worker_name(self, worker):
        if not self.events:
            return f"worker {worker}"
        return "timer management thread" if worker == TIMER_MANAGEMENT else "executor thread"


def draw_job(axes, window, job, y):
    colour = WORKER_COLOURS[job.worker % len(WORKER_COLOURS)]
    if job.start is None:
        return
    finish = job.finish if job.finish is not None else window.end
    ready = job.release if job.release is not None else job.timestamp
    axes.hlines(y, ready, job.start, color=FAINT, linewidth=1, linestyle=(0, (1, 1.5)), zorder=2)
    if finish - job.start < (window.end - window.begin) / 2000:
        axes.vlines(job.start, y - BAR / 2, y + BAR / 2, color=colour, linewidth=1.4, zorder=3)
    else:
        axes.broken_barh(
            [(job.start, finish - job.start)],
            (y - BAR / 2, BAR),
            facecolor=colour,
            alpha=0.85,
            linewidth=0,
            zorder=3,
        )
    for begin, end in job.displaced:
        axes.broken_barh(
            [(begin, end - begin)],
            (y - BAR / 2, BAR),
            facecolor="white",
            edgecolor=colour,
            hatch="/////",
            linewidth=0.5,
            zorder=3.5,
        )
    if job.late:
        axes.plot(finish, y, "D", color=VERMILION, markersize=5.5, markeredgecolor="white", zorder=5)


def draw_release(axes, job, y):
    release = job.release if job.release is not None else job.timestamp
    arrow = {"arrowstyle": "-|>", "color": INK, "linewidth": 0.9, "mutation_scale": 7}
    axes.annotate(
        "",
        (release, y + ARROW),
        (release, y - BAR / 2),
        zorder=4,
        annotation_clip=True,
        arrowprops=arrow | {"shrinkA": 0, "shrinkB": 0},
    )


def draw_row(axes, window, jobs, y):
    for job in jobs:
        if job.outcome == "skipped":
            axes.plot(job.timestamp, y, "x", color=VERMILION, markersize=7, markeredgewidth=1.8, zorder=5)
        elif job.outcome == "overwritten":
            axes.plot(job.timestamp, y, "D", color="white", markeredgecolor=VERMILION, markersize=5, zorder=4)
        elif job.outcome != "empty":
            draw_release(axes, job, y)
            draw_job(axes, window, job, y)


def draw_releaser(axes, window, y):
    """When timers were released: of interest where a thread of its own does so."""
    slots = window.release_slots
    if slots:
        spans = [(begin, end - begin) for begin, end in slots]
        axes.broken_barh(spans, (y - BAR / 2, BAR), facecolor=ORANGE, edgecolor=ORANGE, linewidth=0.8, zorder=3)
        return
    instants = {job.release for job in window.jobs if job.kind == "timer" and job.release is not None}
    axes.vlines(sorted(instants), y - BAR / 2, y + BAR / 2, color=ORANGE, linewidth=1.4, zorder=3)


def add_key(figure, window):
    line, patch = plt.Line2D, plt.Rectangle
    workers = sorted({job.worker for job in window.jobs if job.start is not None})
    colours = [WORKER_COLOURS[w % len(WORKER_COLOURS)] for w in workers]
    handles = [
        patch((0, 0), 1, 1, facecolor=colour, alpha=0.85, label=window.worker_name(w))
        for w, colour in zip(workers, colours)
    ]
    handles.append(line([], [], linestyle="", marker="$↑$", markersize=9, color=INK, label="release"))
    if any(job.displaced for job in window.jobs):
        look = {"facecolor": "white", "edgecolor": BLUE, "hatch": "/////"}
        handles.append(patch((0, 0), 1, 1, label="displaced", **look))
    if any(job.late for job in window.jobs):
        handles.append(line([], [], linestyle="", marker="D", color=VERMILION, label="deadline missed"))
    for outcome, label, look in (
        ("skipped", "skipped timestamp", {"marker": "x", "color": VERMILION, "markeredgewidth": 1.8}),
        ("overwritten", "overwritten sample", {"marker": "D", "color": "white", "markeredgecolor": VERMILION}),
    ):
        if any(job.outcome == outcome for job in window.jobs):
            handles.append(line([], [], linestyle="", label=label, **look))
    figure.legend(
        handles=handles,
        loc="lower left",
        bbox_to_anchor=(0, 0),
        ncol=len(handles),
        frameon=False,
        fontsize=10.5,
    )


def draw(arguments):
    run = Run(arguments.run)
    window = Window(run, arguments.executor, arguments.repetition, arguments.begin, arguments.end)
    tasks = window.tasks()
    own_thread = window.events and any(job.kind == "timer" for job in window.jobs)
    rows = len(tasks) + own_thread
    label_width = 0.085 * max(len(task) for task in [*tasks, "timer management thread"])
    width, height = 13.0 + label_width, 2.0 + 0.36 * rows
    figure, axes = plt.subplots(figsize=(width, height))
    for place, task in enumerate(tasks):
        draw_row(axes, window, [job for job in window.jobs if job.task == task], -place)
    labels = list(tasks)
    if own_thread:
        draw_releaser(axes, window, -len(tasks))
        labels.append("releases of timers" if not window.release_slots else "timer management thread")
    axes.set_yticks([-place for place in range(rows)], labels, fontsize=10)
    axes.set_ylim(-rows + 0.4, 0.6)
    axes.set_xlim(window.begin, window.end)
    axes.grid(axis="x")
    axes.tick_params(axis="y", length=0)
    axes.set_xlabel("time since the epoch of the run (ms)", labelpad=4)
    title = f"Timeline of {window.executor}"
    top = write_title(figure, title, run.what_ran(), run.partial)
    figure.subplots_adjust(
        left=(label_width + 0.25) / width, right=1 - 0.2 / width, top=1 - top, bottom=0.92 / height
    )
    add_key(figure, window)
    output = Path(arguments.output or run.folder / "timeline.svg")
    save(figure, output.parent, output.stem)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", metavar="RUN_DIR", help="folder written by `hotpath`")
    parser.add_argument("--executor", required=True)
    parser.add_argument("--repetition", type=int, default=0)
    parser.add_argument("--from", dest="begin", type=float, default=0, help="in ms")
    parser.add_argument("--to", dest="end", type=float, default=500, help="in ms")
    parser.add_argument("--output", metavar="FILE.svg", help="by default RUN_DIR/timeline.svg")
    return run_script(draw, parser.parse_args())


if __name__ == "__main__":
    sys.exit(main())
