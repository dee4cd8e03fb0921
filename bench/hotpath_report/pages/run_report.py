# SPDX-License-Identifier: Apache-2.0
"""The page about runs."""

import contextlib
import json
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from hotpath_report import hotpath_command
from hotpath_report.errors import InputError
from hotpath_report.figures import hot_path
from hotpath_report.pages import interactive
from hotpath_report.pages.interactive import Measured
from hotpath_report.pages.writer import HEADER, Section, Table, compared, make_figure, write_report
from hotpath_report.run import Run
from hotpath_report.samples import samples_of_run
from hotpath_report.shown_text import printable_content
from hotpath_report.statistics import Samples


COMPARED = (
    "Ratio, Cliff's delta and rank test: against the run's first executor; above 1 and above 0 are better"
)
CHAIN = (
    "hot-path latency (ms)",
    "Start of the sink's callback minus start of the latest source callback in its data.",
)
TIMER = (
    "response time (ms)",
    "Finish of a job minus its own timestamp; skipped timestamps have no response time.",
)


class ReportedRun:
    """Samples (ms) of one folder by chain or timer: {(kind, name): {executor: samples}}; `tasks` has
    those of all tasks by name."""

    def __init__(self, folder: str | Path) -> None:
        self.run = Run(folder)
        self.name = Path(folder).resolve().name
        found = samples_of_run(self.run.latencies(), "chain", "hot_path_ms", self.run)
        self.samples = {("Chain", name): samples for name, samples in found.items()}
        self.tasks: dict[str, dict[str, Samples]] = {}
        if (self.run.folder / "jobs.csv").exists():
            self.tasks = samples_of_run(self.run.all_responses(), "task", "response_ms", self.run)
            timers = set(self.run.timer_counts()["task"])
            self.samples |= {("Timer", name): of for name, of in self.tasks.items() if name in timers}

    def facts(self) -> str:
        """Description of the run, with its warnings."""
        partial_run = "partial: the run did not finish; " if self.run.partial else ""
        warnings = " ".join([*(self.run.work() or ())[1:], *self.run.facts.get("warnings", [])])
        return f"{self.name}: {partial_run}{self.run.what_ran()}. {warnings}".replace("\n", " · ").strip()


def figure_name(key: tuple[str, str]) -> str:
    """Name of the figure of a chain or timer."""
    return "".join(c.lower() if c.isalnum() else "_" for c in " ".join(key))


def measured(runs: Sequence[ReportedRun]) -> list[Measured]:
    """The chains, then all tasks."""
    keys = dict.fromkeys(key for run in runs for key in run.samples)
    made = [
        Measured(
            "chain", key[1], " ".join(key), CHAIN[0], figure_name(key), [r.samples.get(key, {}) for r in runs]
        )
        for key in keys
        if key[0] == "Chain"
    ]
    for name in dict.fromkeys(name for run in runs for name in run.tasks):
        figure = figure_name(("Timer", name)) if ("Timer", name) in keys else ""
        of_runs = [run.tasks.get(name, {}) for run in runs]
        made.append(Measured("task", name, f"Task {name}", TIMER[0], figure, of_runs))
    return made


# Key in summary.json and column of the losses of an executor, and of its tasks.
LOSSES = {
    "callbacks_executed": "callbacks",
    "skipped": "skipped timestamps",
    "overwritten": "overwritten samples",
    "deadline_overruns": "deadline overruns",
}
LOSSES_OF_TASK = {
    "ran": "jobs",
    "skipped": "skipped timestamps",
    "overwritten": "overwritten samples",
    "queued": "queued at the end",
}
PERIODS = ["least ms", "greatest ms", "p99 off its period by ms"]


def period_cells(task: dict[str, Any]) -> list[str]:
    """Distances between the starts of a timer's jobs."""
    period, off = task["period_ms"], task["period_deviation_ms"]["p99"]
    return [f"{period['min']:.2f}", f"{period['max']:.2f}", "" if off is None else f"{off:.2f}"]


def tables(runs: Sequence[ReportedRun]) -> Iterator[Table]:
    """Losses (of timers after the warm-up), then losses and periods of tasks over the whole run, and
    the repetitions that the kernel's counters call disturbed; without empty tables."""
    executors = [
        ([run.name, e["executor"]], e)
        for run in runs
        if (run.run.folder / "summary.json").exists()
        for e in run.run.summary()
    ]
    tasks = [([*names, task["task"]], task) for names, e in executors for task in e["tasks"]]
    losses = [[*names, *(e[key] for key in LOSSES)] for names, e in executors]
    lost = [
        [*names, *(task.get(key, "") for key in LOSSES_OF_TASK)]
        for names, task in tasks
        if task.get("skipped") or task.get("overwritten")
    ]
    # Runs of older versions have no periods.
    periods = [
        [*names, *period_cells(task)]
        for names, task in tasks
        if (task.get("period_deviation_ms") or {}).get("n")
    ]
    marks = [[run.name, e, n, "; ".join(marks)] for run in runs for e, n, marks in run.run.disturbances()]
    run, task = ["run", "executor"], ["run", "executor", "task"]
    timer = ["run", "executor", "timer"]
    title = "Periods of timers, from start to start"
    made = [
        Table("Losses", run + [*LOSSES.values()], losses),
        Table("Losses by task", task + [*LOSSES_OF_TASK.values()], lost, folded=len(lost) > 12),
        Table(title, timer + PERIODS, periods, folded=True),
        Table("Disturbed repetitions", [*run, "repetition", "marks"], marks),
    ]
    return (table for table in made if table.rows)


def causes(runs: Sequence[ReportedRun], chain: str) -> list[str]:
    """What `hotpath explain` says of a chain: the causes of each run's first executor, and why the
    others are faster or slower. Without runs that it cannot explain, or that take it long."""
    made = []
    for run in runs:
        jobs, executors = run.run.folder / "jobs.csv", list(run.samples.get(("Chain", chain), {}))
        if not jobs.exists() or jobs.stat().st_size > interactive.LARGEST_ANALYZED:
            continue
        for executor in executors:
            pair = executor if executor == executors[0] else f"{executors[0]},{executor}"
            words = ("--executor", pair, "--chain", chain, "--json")
            with contextlib.suppress(InputError):
                answer = json.loads(hotpath_command.output_of("explain", run.run.folder, *words))
                text = " ".join(printable_content(answer["sentences"]))
                made.append(f"{run.name}: {text}" if len(runs) > 1 else text)
    return made


def section(runs: Sequence[ReportedRun], key: tuple[str, str]) -> Section:
    """A chain or timer: the distributions of each executor of each run, compared with those of the
    run's first executor."""
    label, text = CHAIN if key[0] == "Chain" else TIMER
    title, name = " ".join(key), figure_name(key)
    found = [run.samples.get(key, {}) for run in runs]
    rows = hot_path.with_ratios(hot_path.rows_of_runs(found, [run.run for run in runs]))
    draw = partial(hot_path.draw_rows, rows, label=label)
    figure = make_figure(name, f"{title}: {label}", draw)
    cells = []
    for run, executors in zip(runs, found):
        baseline = next(iter(executors.values()), None)
        for executor, samples in executors.items():
            compared_cells = compared(samples, None if samples is baseline else baseline)
            cells.append([run.name, executor, run.run.source, *compared_cells])
    table = Table(COMPARED, ["run", "executor", "source", *HEADER], cells)
    notes = causes(runs, key[1]) if key[0] == "Chain" else []
    return Section(f"about_{name}", title, label, text, [figure], [table], notes)


def write(folders: Sequence[str], folder: Path) -> None:
    """Writes report.html and report.md into `folder`. Raises InputError."""
    runs = [ReportedRun(name) for name in folders]
    sections = [section(runs, key) for key in dict.fromkeys(key for run in runs for key in run.samples)]
    if not sections:
        raise InputError(f"{folders[0]}: nothing to report: no samples of chains or timers after the warm-up")
    graphs = ", ".join(dict.fromkeys(run.run["graph.name"] for run in runs))
    write_report(
        folder,
        sections,
        title=f"Executors on {graphs}",
        facts=[run.facts() for run in runs],
        losses=list(tables(runs)),
        commands=list(dict.fromkeys(command for run in runs if (command := run.run.command()))),
        data=interactive.document([run.run for run in runs], [run.name for run in runs], measured(runs)),
        made_by="`hotpath report`. Every job: jobs.csv of the run.",
    )
