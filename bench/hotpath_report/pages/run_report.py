# SPDX-License-Identifier: Apache-2.0
"""The page about runs."""

import contextlib
import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from hotpath_report import hotpath_command
from hotpath_report.errors import InputError
from hotpath_report.figures import hot_path
from hotpath_report.pages import interactive
from hotpath_report.pages.interactive import Measured
from hotpath_report.pages.writer import HEADER, Section, Table, compared, make_figure, write_page
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


def comparison(runs: Sequence[ReportedRun], key: tuple[str, str]) -> Table:
    """Percentiles of each executor of each run, compared with the run's first executor."""
    rows = []
    for run in runs:
        executors = run.samples.get(key, {})
        baseline = next(iter(executors.values()), None)
        for executor, samples in executors.items():
            cells = compared(samples, None if samples is baseline else baseline)
            rows.append([run.name, executor, run.run.source, *cells])
    return Table(COMPARED, ["run", "executor", "source", *HEADER], rows)


def figure_name(key: tuple[str, str]) -> str:
    """Name of the figure of a chain or timer."""
    return "".join(c.lower() if c.isalnum() else "_" for c in " ".join(key))


def measured(runs: Sequence[ReportedRun]) -> list[Measured]:
    """The chains, then all tasks."""
    made = []
    for key in dict.fromkeys(key for run in runs for key in run.samples if key[0] == "Chain"):
        of_runs = [run.samples.get(key, {}) for run in runs]
        made.append(Measured("chain", key[1], " ".join(key), CHAIN[0], figure_name(key), of_runs))
    for name in dict.fromkeys(name for run in runs for name in run.tasks):
        key = ("Timer", name)
        figure = figure_name(key) if any(key in run.samples for run in runs) else ""
        of_runs = [run.tasks.get(name, {}) for run in runs]
        made.append(Measured("task", name, f"Task {name}", TIMER[0], figure, of_runs))
    return made


def losses(runs: Sequence[ReportedRun]) -> list[Table]:
    """Losses of each executor; for timers after the warm-up."""
    keys = ["callbacks_executed", "skipped", "overwritten", "deadline_overruns"]
    rows = [
        [run.name, e["executor"], *(e[key] for key in keys)]
        for run in runs
        if (run.run.folder / "summary.json").exists()
        for e in run.run.summary()
    ]
    header = ["run", "executor", "callbacks", "skipped timestamps", "overwritten samples"]
    return [Table("Losses", [*header, "deadline overruns"], rows)] if rows else []


def losses_by_task(runs: Sequence[ReportedRun]) -> list[Table]:
    """The tasks that lost timestamps or samples, over the whole run."""
    keys = ["ran", "skipped", "overwritten", "queued"]
    rows = [
        [run.name, e["executor"], task["task"], *(task.get(key, "") for key in keys)]
        for run in runs
        if (run.run.folder / "summary.json").exists()
        for e in run.run.summary()
        for task in e["tasks"]
        if task.get("skipped") or task.get("overwritten")
    ]
    header = [
        "run",
        "executor",
        "task",
        "jobs",
        "skipped timestamps",
        "overwritten samples",
        "queued at the end",
    ]
    return [Table("Losses by task", header, rows, folded=len(rows) > 12)] if rows else []


def periods(runs: Sequence[ReportedRun]) -> list[Table]:
    """Distances between the starts of each timer's jobs. Runs of older versions have none."""
    keys = ["min", "max"]
    rows = [
        [run.name, e["executor"], task["task"], *(f"{task['period_ms'][key]:.2f}" for key in keys)]
        + [f"{off:.2f}" if (off := task["period_deviation_ms"]["p99"]) is not None else ""]
        for run in runs
        if (run.run.folder / "summary.json").exists()
        for e in run.run.summary()
        for task in e["tasks"]
        if (task.get("period_deviation_ms") or {}).get("n")
    ]
    header = ["run", "executor", "timer", "least ms", "greatest ms", "p99 off its period by ms"]
    return [Table("Periods of timers, from start to start", header, rows, folded=True)] if rows else []


def disturbances(runs: Sequence[ReportedRun]) -> list[Table]:
    """What disturbed repetitions, by the counters of the kernel."""
    rows = [
        [run.name, executor, repetition, "; ".join(marks)]
        for run in runs
        for executor, repetition, marks in run.run.disturbances()
    ]
    return [Table("Disturbed repetitions", ["run", "executor", "repetition", "marks"], rows)] if rows else []


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


def sections(runs: Sequence[ReportedRun]) -> list[Section]:
    """A section per chain and timer."""
    made: list[Section] = []
    for key in dict.fromkeys(key for run in runs for key in run.samples):
        label, text = CHAIN if key[0] == "Chain" else TIMER
        title, name = " ".join(key), figure_name(key)
        rows = hot_path.rows_of_runs([run.samples.get(key, {}) for run in runs], [run.run for run in runs])
        draw = partial(hot_path.draw_rows, hot_path.with_ratios(rows), label=label)
        figure = make_figure(name, f"{title}: {label}", draw, [])
        made.append(Section(f"about_{name}", title, label, text, [figure], [comparison(runs, key)]))
        made[-1].notes += causes(runs, key[1]) if key[0] == "Chain" else []
    return made


def write(folders: Sequence[str], folder: Path) -> None:
    """Writes report.html and report.md into `folder`. Raises InputError."""
    runs = [ReportedRun(name) for name in folders]
    made = sections(runs)
    if not made:
        raise InputError(f"{folders[0]}: nothing to report: no samples of chains or timers after the warm-up")
    graphs = ", ".join(dict.fromkeys(run.run["graph.name"] for run in runs))
    facts = [run.facts() for run in runs]
    tables = losses(runs) + losses_by_task(runs) + periods(runs) + disturbances(runs)
    commands = list(dict.fromkeys(command for run in runs if (command := run.run.command())))
    data = interactive.document([run.run for run in runs], [run.name for run in runs], measured(runs))
    content = {
        "facts": facts,
        "losses": tables,
        "commands": commands,
        "interactive": interactive.embedded(data),
        "made_by": "`hotpath report`. Every job: jobs.csv of the run.",
    }
    write_page(folder, "report", made, title=f"Executors on {graphs}", **content)
