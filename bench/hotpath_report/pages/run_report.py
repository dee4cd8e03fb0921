# SPDX-License-Identifier: Apache-2.0
"""The pages about runs: of `hotpath report`, which also takes a published reproduction, and of `hotpath diff`."""

import contextlib
import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from hotpath_report import hotpath_command
from hotpath_report.errors import InputError
from hotpath_report.figures import hot_path
from hotpath_report.files import read_document
from hotpath_report.pages import interactive
from hotpath_report.pages.writer import HEADER, Section, Table, compared, make_figure, write_page
from hotpath_report.run import Run, samples_of
from hotpath_report.shown_text import printable_content
from hotpath_report.statistics import Samples, grouped

COMPARED = (
    "Ratio, Cliff's delta and rank test: against the run's first executor; above 1 and above 0 are better"
)
CHAIN = (
    hot_path.AGE,
    "Finish of the sink's callback minus the timestamp of the oldest source in its data.",
)
HOT_PATH = ("hot-path latency (ms)",)
TIMER = (
    "response time (ms)",
    "Finish of a job minus its own timestamp; skipped timestamps have no response time.",
)
SIDES = ("old", "new")
LONG = 12  # rows from which a table is folded
Key = tuple[str, str]  # Chain, Timer or another Task, and its name


class ReportedRun(Run):
    """A run with its samples (ms) by chain and task: {key: {executor: samples}}."""

    def __init__(self, folder: str | Path) -> None:
        super().__init__(folder)
        self.name = Path(folder).resolve().name
        found = samples_of(self.samples("chains"), "age_ms", self.simulated)
        self.measured: dict[Key, dict[str, Samples]] = {("Chain", name): of for name, of in found.items()}
        if (self.folder / "jobs.csv").exists():
            found = samples_of(self.samples("responses"), "response_ms", self.simulated)
            timers = grouped(self.timer_counts(), "task")
            self.measured |= {("Timer" if name in timers else "Task", name): of for name, of in found.items()}

    def description(self) -> str:
        """What ran, with its warnings."""
        partial_run = "partial: the run did not finish; " if self.partial else ""
        warnings = " ".join([*self.work()[1:], *self.facts.get("warnings", [])])
        if (self.folder / "summary.json").exists() and not self.summarized("tables"):
            warnings += (
                " Its summary, of another version, has no tables: `hotpath report --summary` adds them."
            )
        return f"{self.name}: {partial_run}{self.what_ran()}. {warnings}".replace("\n", " · ").strip()


def figure_name(key: Key) -> str:
    """Name of the figure of a chain or timer."""
    return "".join(c.lower() if c.isalnum() else "_" for c in " ".join(key))


def document(runs: Sequence[ReportedRun], names: Sequence[str]) -> dict[str, Any]:
    """What the interactive part shows: the chains, then all tasks."""
    keys = dict.fromkeys(key for run in runs for key in run.measured)
    measured: list[interactive.Measured] = []
    for key in sorted(keys, key=lambda key: key[0] != "Chain"):
        kind, measure = ("Chain", CHAIN[0]) if key[0] == "Chain" else ("Task", TIMER[0])
        what = {"kind": kind.lower(), "name": key[1], "title": f"{kind} {key[1]}", "measure": measure}
        what["figure"] = "" if key[0] == "Task" else figure_name(key)
        measured.append((what, [run.measured.get(key, {}) for run in runs]))
    return interactive.document(runs, names, measured)


def tables(runs: Sequence[ReportedRun]) -> list[Table]:
    """The tables of the runs' summaries, those of several runs in one."""
    found: dict[tuple[str, ...], Table] = {}  # versions may have other columns
    for run in runs:
        for of in run.summarized("tables"):
            # The printed table breaks names.
            columns = [re.sub("-\n|(?<=/)\n", "", name).replace("\n", " ") for name in of["columns"]]
            title = of["title"][:1].upper() + of["title"][1:].replace("\n", " ")
            table = found.setdefault((title, *columns), Table(title, ["run", *columns], []))
            table.rows.extend([run.name, *row] for row in of["rows"])
    return [replace(table, folded=len(table.rows) > LONG) for table in found.values()]


def causes(runs: Sequence[ReportedRun], key: Key) -> list[str]:
    """What `hotpath explain` says of a chain: the causes of each run's first executor, and why the
    others are faster or slower. Without runs that it cannot explain, or that take it long."""
    made = []
    for run in filter(Run.is_quickly_read, runs if key[0] == "Chain" else ()):
        executors = list(run.measured.get(key, {}))
        for executor in executors:
            pair = executor if executor == executors[0] else f"{executors[0]},{executor}"
            words = ("--executors", pair, "--chain", key[1], "--json")
            with contextlib.suppress(InputError):
                answer = json.loads(hotpath_command.output_of("explain", run.folder, *words))
                text = " ".join(printable_content(answer["sentences"]))
                made.append(f"{run.name}: {text}" if len(runs) > 1 else text)
    return made


def section(runs: Sequence[ReportedRun], key: Key) -> Section:
    """A chain or timer: the distributions of each executor of each run, compared with those of the
    run's first executor."""
    label, text = CHAIN if key[0] == "Chain" else TIMER
    title, name = " ".join(key), figure_name(key)
    found = [run.measured.get(key, {}) for run in runs]
    rows = hot_path.with_ratios(hot_path.rows_of_runs(found, runs))
    figure = make_figure(name, f"{title}: {label}", hot_path.draw_rows(rows, label=label))
    cells = []
    for run, executors in zip(runs, found):
        baseline = next(iter(executors.values()), None)
        for executor, samples in executors.items():
            compared_cells = compared(samples, None if samples is baseline else baseline)
            cells.append([run.name, executor, run["kind"], *compared_cells])
    table = Table(COMPARED, ["run", "executor", "source", *HEADER], cells)
    return Section(f"about_{name}", title, label, text, [figure], [table], causes(runs, key))


def write(*words: str) -> None:
    """Writes report.html and report.md about folders, into that of `--output FOLDER` at the end, if it is
    there. Raises InputError."""
    has_output = words[-2:-1] == ("--output",)
    folders, first = words[:-2] if has_output else words, Path(words[0])
    folder = Path(words[-1]) if has_output else first / "report"
    if not ((first / "claims.json").exists() and (first / "data").is_dir()):
        write_runs(folders, folder)
    elif len(folders) == 1:
        hotpath_command.load("paper.results").write_published(first, folder)
    else:
        raise InputError(f"{first} is a reproduction; give it alone, or compare two with diff")
    print(f"{folder / 'report.html'} (and report.md)")


def write_runs(folders: Sequence[str], folder: Path) -> None:
    """Writes the page about runs into `folder`. Raises InputError."""
    runs = [ReportedRun(name) for name in folders]
    keys = dict.fromkeys(key for run in runs for key in run.measured if key[0] != "Task")
    sections = [section(runs, key) for key in keys]
    if not sections:
        raise InputError(f"{folders[0]}: nothing to report: no samples of chains or timers after the warm-up")
    graphs = ", ".join(dict.fromkeys(run["graph.name"] for run in runs))
    write_page(
        folder,
        sections,
        document(runs, [run.name for run in runs]),
        title=f"Executors on {graphs}",
        lead=[
            f"{run.name}: {text}" if len(runs) > 1 else text
            for run in runs
            for text in run.summarized("verdict")
        ],
        facts=[run.description() for run in runs],
        losses=tables(runs),
        commands=list(dict.fromkeys(command for run in runs if (command := run.command()))),
        made_by="`hotpath report`. Every job: jobs.csv of the run.",
    )


def distributions(targets: list[dict[str, Any]]) -> dict[str, Any]:
    """What the interactive part shows of two sides that are known by their distributions alone."""
    sides = [(c["side"], c["executor"]) for target in targets for c in target["curves"]]
    found = {name: list(dict.fromkeys(e for of, e in sides if of == k)) for k, name in enumerate(SIDES)}
    places = [(k, executor) for k, name in enumerate(SIDES) for executor in found[name]]
    for target in targets:
        measure = (HOT_PATH if target.pop("hot_path") else CHAIN if target["kind"] == "chain" else TIMER)[0]
        target |= {"title": target["name"], "measure": measure, "figure": "", "marks": []}
        for curve in target["curves"]:
            curve["series"] = places.index((curve.pop("side"), curve.pop("executor")))
    return interactive.of_samples(found, targets=targets)


def write_comparison(folder: str) -> None:
    """Writes report.html and report.md of `hotpath diff` from comparison.json: both sides' distributions (of two runs
    also their outputs and timelines), and the table of differences or of the gate. Raises InputError."""
    place = Path(folder)
    content: dict[str, Any] = read_document(place / "comparison.json", "hotpath diff --output")
    of, folders, targets = content["table"], content["folders"], content["targets"]
    table = Table(of["title"], of["columns"], of["cells"], numbers=True)
    text = "The distributions above show the same samples; their bands are 95 % intervals."
    write_page(
        place,
        [Section("comparison", "Comparison", "of the measures that both sides have", text, [], [table])],
        distributions(targets) if targets is not None else document(list(map(ReportedRun, folders)), folders),
        title=content["title"],
        facts=content["facts"],
        made_by="`hotpath diff`.",
    )
    print(f"{place / 'report.html'} (and report.md)")
