# SPDX-License-Identifier: Apache-2.0
"""The page about runs."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from hotpath_report.errors import InputError
from hotpath_report.figures import hot_path
from hotpath_report.pages.writer import HEADER, Section, Table, compared, make_figure, write_page
from hotpath_report.run import Run
from hotpath_report.samples import samples_of_run

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
    """Samples (ms) of one folder by chain or timer: {(kind, name): {executor: samples}}."""

    def __init__(self, folder: str | Path) -> None:
        self.run = Run(folder)
        self.name = Path(folder).resolve().name
        found = samples_of_run(self.run.latencies(), "chain", "hot_path_ms", self.run)
        self.samples = {("Chain", name): samples for name, samples in found.items()}
        if (self.run.folder / "jobs.csv").exists():
            found = samples_of_run(self.run.responses(), "task", "response_ms", self.run)
            self.samples |= {("Timer", name): samples for name, samples in found.items()}

    def facts(self) -> str:
        """Description of the run, with its warnings."""
        partial_run = "partial: the run did not finish; " if self.run.partial else ""
        warnings = " ".join(self.run.facts.get("warnings", []))
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


def disturbances(runs: Sequence[ReportedRun]) -> list[Table]:
    """Periods of a slow processor."""
    keys = ["cpu", "from_s", "until_s", "factor"]
    rows = [
        [run.name, executor, repetition, *(f"{period[key]:.3g}" for key in keys)]
        for run in runs
        for executor, repetition, periods in run.run.slow_repetitions()
        for period in periods
    ]
    header = ["run", "executor", "repetition", "processor", "from s", "until s", "slowdown ×"]
    return [Table("Slow processor", header, rows)] if rows else []


def sections(runs: Sequence[ReportedRun]) -> list[Section]:
    """A section per chain and timer."""
    commands, made = [c for c in (run.run.command() for run in runs) if c], []
    for key in dict.fromkeys(key for run in runs for key in run.samples):
        label, text = CHAIN if key[0] == "Chain" else TIMER
        title = " ".join(key)
        name = "".join(c.lower() if c.isalnum() else "_" for c in title)
        rows = hot_path.rows_of_runs([run.samples.get(key, {}) for run in runs], [run.run for run in runs])
        draw = partial(hot_path.draw_rows, hot_path.with_ratios(rows), label=label)
        figure = make_figure(name, f"{title}: {label}", draw, commands)
        made.append(Section(name, title, label, text, [figure], [comparison(runs, key)]))
    return made


def write(folders: Sequence[str], folder: Path) -> None:
    """Writes report.html and report.md into `folder`. Raises InputError."""
    runs = [ReportedRun(name) for name in folders]
    made = sections(runs)
    if not made:
        raise InputError(f"{folders[0]}: nothing to report: no samples of chains or timers after the warm-up")
    graphs = ", ".join(dict.fromkeys(run.run["graph.name"] for run in runs))
    facts = [run.facts() for run in runs]
    tables = losses(runs) + disturbances(runs)
    write_page(folder, "report", made, title=f"Executors on {graphs}", facts=facts, losses=tables)
