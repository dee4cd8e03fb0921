# SPDX-License-Identifier: Apache-2.0
"""One page, HTML and Markdown, about any runs and comparisons: report.html and report.md."""

import argparse
import json
import shlex
import sys
from pathlib import Path

from drawing import axis_limit, colour_of, new_figure, violin_rows
from evidence import BadResults
from figure_parts import PERCENTILE_HEADER, SOURCES, percentile_rows, source_key
from inference import Samples, rank_test, ratio
from page import Section, make_figure, write_page
from plots import InputError, Run, milliseconds, run_script
from tables import Table, p_text

FOOTER = "Made by `hotpath report`. Data behind each figure: one click below it; every job: jobs.csv of the run."


class ReportedRun:
    """Latencies of chains and response times of timers of one folder."""

    def __init__(self, folder):
        self.run = Run(folder)
        self.name = Path(folder).resolve().name
        self.source = "simulated" if self.run.simulated else "live"
        self.exact = self.run.simulated and self.run["repetitions"] == 1
        self.chains = self.read_chains()
        self.timers = self.read_timers()

    def read_chains(self):
        """{chain: {executor: Samples}}"""
        found = {}
        columns = ["executor", "repetition", "chain", "hot_path_latency_ns"]
        for executor, repetition, chain, latency in self.run.rows("chains.csv", columns):
            of_executor = found.setdefault(chain, {}).setdefault(executor, {})
            of_executor.setdefault(repetition, []).append(milliseconds(latency, self.run, "chains.csv"))
        return {
            chain: {e: Samples(r.values(), exact=self.exact) for e, r in executors.items()}
            for chain, executors in found.items()
        }

    def read_timers(self):
        """{timer: {executor: Samples}}; nothing where the jobs were not kept."""
        if not (self.run.folder / "jobs.csv").exists():
            return {}
        warm_up_ms, found = self.run["warm_up_s"] * 1e3, {}
        columns = ["executor", "repetition", "task", "kind", "outcome", "timestamp_ns", "finish_ns"]
        for executor, repetition, task, kind, outcome, timestamp, finish in self.run.rows("jobs.csv", columns):
            if kind != "timer" or outcome != "ran":
                continue
            released = milliseconds(timestamp, self.run, "jobs.csv")
            if released >= warm_up_ms:
                of_executor = found.setdefault(task, {}).setdefault(executor, {})
                of_executor.setdefault(repetition, []).append(milliseconds(finish, self.run, "jobs.csv") - released)
        return {
            task: {e: Samples(r.values(), exact=self.exact) for e, r in executors.items()}
            for task, executors in found.items()
        }

    def command(self):
        """A command line that repeats the run."""
        run = self.run
        words = [
            "hotpath",
            "simulate" if run.simulated else "compare",
            "--graph",
            run["graph.file"],
            "--executors",
            ",".join(run.executors),
        ]
        words += [
            "--load",
            f"{run['load_percent']:g}",
            "--phases",
            run["phases"],
            "--duration",
            f"{run['duration_s']:g}",
        ]
        words += [
            "--warm-up",
            f"{run['warm_up_s']:g}",
            "--repetitions",
            str(run["repetitions"]),
            "--seed",
            str(run["seed"]),
        ]
        if not run.simulated:
            words += ["--transport", run["transport"], "--cpus", ",".join(map(str, run["cpus"]))]
        return shlex.join(words)

    def facts(self):
        partial = "partial: it did not end; " if self.run.partial else ""
        warnings = " ".join(self.run.get("warnings", []))
        return f"{self.name}: {partial}{self.run.what_ran()}. {warnings}".replace("\n", " · ").strip()


def rows_of(runs, pick, name):
    """Rows of a violin figure for one chain or timer: (executor, colour, simulated, live), run below run."""
    rows = []
    for executor in dict.fromkeys(e for run in runs for e in pick(run).get(name, {})):
        of_source = {
            source: [r for r in runs if r.source == source and executor in pick(r).get(name, {})]
            for source in SOURCES
        }
        for k in range(max(len(of_source[s]) for s in SOURCES)):
            samples = [pick(of_source[s][k])[name][executor] if k < len(of_source[s]) else None for s in SOURCES]
            rows.append((executor if k == 0 else f"{executor} ({k + 1})", colour_of(executor), *samples))
    return rows


def violins(runs, pick, name, label):
    def draw(width):
        rows = rows_of(runs, pick, name)
        figure, (axes,) = new_figure(width, 0.9 + 0.62 * len(rows))
        violin_rows(axes, rows, (0, axis_limit([s for row in rows for s in row[2:] if s])))
        axes.set_xlabel(label)
        source_key(axes, {s for i, s in enumerate(SOURCES) if any(row[2 + i] for row in rows)})
        table = [
            r for e, _, *both in rows for s, source in zip(both, SOURCES) if s for r in percentile_rows(s, source, e)
        ]
        return figure, ["source", "executor", *PERCENTILE_HEADER], table

    return draw


def comparison(runs, pick, name, title):
    """Percentiles of each executor of each run, and how it compares with the run's first executor."""
    rows = []
    for run in runs:
        executors = pick(run).get(name, {})
        baseline = next(iter(executors), None)
        for executor, samples in executors.items():
            row = [run.name, executor, run.source, f"{len(samples)} / {len(samples.repetitions)}"]
            row += [samples.estimate(p).text(1) for p in (0.5, 0.99, 1.0)]
            if executor == baseline:
                row += ["", "", ""]
            else:
                test = rank_test(samples, executors[baseline])
                row += [
                    ratio(executors[baseline], samples, 1.0).text(2),
                    f"{test.cliffs_delta.text(2)} ({test.magnitude})",
                    p_text(test.p_value),
                ]
            rows.append(row)
    header = [
        "run",
        "executor",
        "source",
        "samples / runs",
        "median ms",
        "p99 ms",
        "worst ms",
        "worst-case ratio",
        "Cliff's delta",
        "rank test p",
    ]
    return Table(title, header, rows)


def losses(runs):
    rows = []
    for run in runs:
        path = run.run.folder / "summary.json"
        if not path.exists():
            continue
        for e in json_of(path).get("executors", []):
            rows.append(
                [
                    run.name,
                    e["executor"],
                    str(e["callbacks_executed"]),
                    str(e["skipped"]),
                    str(e["overwritten"]),
                    str(e["deadline_overruns"]),
                ]
            )
    header = ["run", "executor", "callbacks", "skipped timestamps", "overwritten samples", "deadline overruns"]
    return [Table("Losses", header, rows)] if rows else []


def json_of(path):
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BadResults(f"{path}: not a summary that `hotpath` wrote: {error}") from None


def slug(text):
    return "".join(c.lower() if c.isalnum() else "_" for c in text)


def sections(runs):
    commands, made = [run.command() for run in runs], []
    kinds = (
        (
            lambda r: r.chains,
            "Chain",
            "hot-path latency (ms)",
            "Start of the sink's callback minus start of the latest source callback that its data contains.",
        ),
        (
            lambda r: r.timers,
            "Timer",
            "response time (ms)",
            "Finish of a job minus its own timestamp; timestamps that were skipped have no response time.",
        ),
    )
    for pick, kind, label, text in kinds:
        for name in dict.fromkeys(n for run in runs for n in pick(run)):
            section = Section(slug(f"{kind} {name}"), f"{kind} {name}", label, text)
            section.figures.append(
                make_figure(
                    slug(f"{kind}_{name}"), f"{kind} {name}: {label}", violins(runs, pick, name, label), commands
                )
            )
            section.tables.append(
                comparison(
                    runs,
                    pick,
                    name,
                    (
                        "Ratio of worst cases, Cliff's delta and rank test compare with a run's first executor; above"
                        " 1 and 0 is better"
                    ),
                )
            )
            made.append(section)
    return made


def report(arguments):
    runs = [ReportedRun(folder) for folder in arguments.runs]
    made = sections(runs)
    if not made:
        raise InputError(
            f"{arguments.runs[0]}: no chain and no timer has samples after the warm-up, there is nothing to report"
        )
    folder = Path(arguments.output or Path(arguments.runs[0]) / "report")
    graphs = ", ".join(dict.fromkeys(run.run["graph.name"] for run in runs))
    write_page(
        folder,
        "report",
        title=f"Executors on {graphs}",
        facts=[run.facts() for run in runs],
        sections=made,
        losses=losses(runs),
        footer=FOOTER,
    )
    print(f"{folder / 'report.html'} (and report.md)")


def draw(arguments):
    try:
        report(arguments)
    except BadResults as error:
        raise InputError(str(error)) from None


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", metavar="RUN", nargs="+", help="folders of `hotpath run`, `compare` or `simulate`")
    parser.add_argument("--output", metavar="FOLDER", help="where to write (default: report/ in the first RUN)")
    return run_script(draw, parser.parse_args())


if __name__ == "__main__":
    sys.exit(main())
