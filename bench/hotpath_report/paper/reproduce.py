# SPDX-License-Identifier: Apache-2.0
"""Every table and figure of the paper's evaluation, simulated and, with --live, measured."""

import argparse
import fcntl
import hashlib
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TextIO

from hotpath_report import hotpath_command
from hotpath_report.errors import InputError, RunError
from hotpath_report.paper import publish
from hotpath_report.paper.cells import MODES, Cell, all_cells
from hotpath_report.paper.claims import Verdict
from hotpath_report.paper.evidence import Evidence, collect
from hotpath_report.paper.items import ITEMS, NAMES
from hotpath_report.paper.progress import SIMULATIONS_AT_ONCE, Progress, duration_text
from hotpath_report.paper.results import noise, write_results
from hotpath_report.paper.runner import Interrupted, Rebuilt, Runner, facts_of
from hotpath_report.tables import write_json

PROGRAM = "reproduce_paper.sh"
SEED = 1
EXIT_FAILED, EXIT_WRONG_USE, EXIT_SIGNAL = 1, 2, 128


class WrongUse(Exception):
    """Options that cannot be followed; the message says why."""


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = argparse.ArgumentParser(prog=PROGRAM, description=__doc__)
    made.add_argument(
        "--live", action="store_true", help="also measure: hours, resumable (with --quick: minutes)"
    )
    length = made.add_mutually_exclusive_group()
    length.add_argument(
        "--quick", dest="mode", action="store_const", const="quick", help="all items, reduced"
    )
    full = "live with the paper's 300 s and 600 s"
    length.add_argument("--full", dest="mode", action="store_const", const="full", help=full)
    only = "only this item, or several with commas between; see --list"
    made.add_argument("--only", metavar="ITEM", action="append", default=[], help=only)
    made.add_argument(
        "--list", action="store_true", help="say which items there are and what they take, and end"
    )
    output = "results, and what goes on after an interruption (%(default)s)"
    made.add_argument("--output", metavar="FOLDER", type=Path, default="runs/paper", help=output)
    jobs = "live single-core repetitions at the same time, each on another processor (%(default)s)"
    made.add_argument("--jobs", metavar="N", type=int, default=1, help=jobs)
    copy = "then copy what a repository should carry to this folder, as results/paper"
    made.add_argument("--publish", metavar="FOLDER", type=Path, help=copy)
    made.add_argument("--hotpath", metavar="PROGRAM", help="the command to run (default: that of the build)")
    return made


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """The options, checked. Raises WrongUse."""
    options = parser().parse_args(arguments)
    if options.hotpath:
        os.environ["HOTPATH"] = options.hotpath  # also of what reads the results
    options.hotpath = str(hotpath_command.program())
    options.mode = MODES[options.mode or "standard"]
    options.items = [name for part in options.only for name in part.split(",") if name] or list(NAMES)
    for name in options.items:
        if name not in NAMES:
            raise WrongUse(f"--only: there is no item `{name}`; there are {', '.join(NAMES)}")
    if options.publish and options.only:
        raise WrongUse("--publish takes a whole reproduction; leave out --only")
    if options.publish and (problem := publish.problem_with(options.output, options.publish)):
        raise WrongUse(
            f"--publish {options.publish} {problem}; name a new folder, or that of an earlier publication"
        )
    cpus = sorted(os.sched_getaffinity(0), reverse=True)
    if not 1 <= options.jobs <= len(cpus):
        raise WrongUse(
            f"--jobs {options.jobs}: from 1 to {len(cpus)}, the processors that this program may use"
        )
    options.cpus = cpus  # the last processors have the fewest interrupts on most machines
    return options


def list_items(options: argparse.Namespace) -> None:
    """Prints the items and what they take."""
    cells = all_cells(options.mode, SEED)
    print(f"{'item':<16} {'simulated':>10} {'live':>16}  what")
    for item in ITEMS:
        mine = [c for c in cells if c.study in item.studies]
        live = [c for c in mine if c.source == "live"]
        length = duration_text(sum(c.seconds for c in live)) if live else ""
        what = item.title + ("" if item.paper else " (beyond the paper)")
        print(f"{item.name:<16} {len(mine) - len(live):>10} {length:>16}  {what}")
    live_s = sum(c.seconds for c in cells if c.source == "live")
    print(f"All live repetitions of mode {options.mode.name}: {duration_text(live_s)}; items share them.")


def build_of(hotpath: str) -> str:
    """What makes results comparable: version and content of the command."""
    try:
        version = subprocess.run(
            [hotpath, "--version"], capture_output=True, text=True, check=True
        ).stdout.strip()
        with open(hotpath, "rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()[:12]
    except (OSError, subprocess.CalledProcessError) as error:
        raise WrongUse(
            f"--hotpath {hotpath}: cannot be run ({error}); build it with launch_scripts/build.sh"
        ) from None
    return f"{version} ({digest})"


def settle_plan(options: argparse.Namespace, cells: list[Cell]) -> None:
    """Writes the plan at the first start, and refuses to go on with another one."""
    folder = options.output
    plan = {"mode": options.mode.name, "seed": SEED, "order": [c.name for c in cells]}
    before = facts_of(folder, "plan.json")
    if before is None:
        try:
            (folder / "cells").mkdir(parents=True, exist_ok=True)
            write_json(folder / "plan.json", plan)
        except OSError as error:
            raise WrongUse(f"--output {folder}: cannot be written ({error.strerror})") from None
        return
    if before.get("mode") != plan["mode"]:
        mode = before.get("mode")
        raise WrongUse(
            f"--output {folder} holds a reproduction in mode `{mode}`; give that mode, or another folder"
        )
    if before.get("order") != plan["order"]:
        raise WrongUse(
            f"--output {folder} holds a reproduction by another version of this script; give another folder"
        )


def lock(folder: Path) -> TextIO:
    """Keeps others out of the folder while the file is open: they would remove what is being measured."""
    try:
        file = open(folder / ".lock", "w", encoding="ascii")
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise WrongUse(
            f"--output {folder}: another reproduction runs there; wait for it, or give another folder"
        ) from None
    except OSError as error:
        raise WrongUse(f"--output {folder}: cannot be written ({error.strerror})") from None
    return file


def run_cells(options: argparse.Namespace, runner: Runner, todo: list[Cell]) -> None:
    """Simulations first, then what measures."""
    offline = [c for c in todo if c.source != "live"]
    live = [c for c in todo if c.source == "live"]
    runner.run_all([c for c in offline if not c.alone], SIMULATIONS_AT_ONCE)
    runner.run_all([c for c in offline if c.alone], 1)
    if options.jobs == 1:
        runner.run_all(live, 1)
        return
    for repetition in sorted({c.repetition for c in live}):
        cells = [c for c in live if c.repetition == repetition]
        runner.run_all([c for c in cells if c.cores == 1], options.jobs)
        runner.run_all([c for c in cells if c.cores > 1], 1)


def tell(sentence: str) -> None:
    """On standard error."""
    print(sentence, file=sys.stderr)


def measure(options: argparse.Namespace, wanted: list[Cell], build: str) -> Runner:
    """Runs what is missing, as far as it gets."""
    runner = Runner(options.hotpath, build, options.output, options.cpus)
    todo = [c for c in wanted if not runner.complete(c)]
    progress = Progress(todo, runner, options.jobs)
    runner.on_change = progress.show
    if len(todo) < len(wanted):
        tell(f"{len(wanted) - len(todo)} of {len(wanted)} cells are complete; going on with the rest")
    outdated = sum(c.source == "live" and runner.of_another_build(c) for c in todo)
    if outdated:
        tell(
            f"{outdated} live cells were measured by another build than {build}; they are measured again and kept in"
            f" {options.output}/superseded"
        )
    signals = (signal.SIGINT, signal.SIGTERM)
    handlers = {s: signal.signal(s, lambda number, _: runner.interrupt(number)) for s in signals}
    try:
        run_cells(options, runner, todo)
    except Interrupted:
        pass
    finally:
        progress.end()
        for number, handler in handlers.items():
            signal.signal(number, handler)
    for cell, sentence in runner.failed:
        tell(f"{PROGRAM}: {cell.name} failed: {sentence}")
    return runner


def print_summary(verdicts: list[Verdict], evidence: Evidence, output: Path) -> None:
    """A line for each claim."""
    for v in verdicts:
        text = next((f.text for f in reversed(list(v.findings.values())) if f is not None), "")
        print(f"{v.verdict:<10}  {v.claim.name:<22} {text}")
    print(", ".join(f"{count} {word}" for word, count in Counter(v.verdict for v in verdicts).items()))
    if evidence.machine is not None:
        print(noise(evidence)["text"])
    print(f"The page: {output}/report.html (and report.md); data: {output}/data")


def shown_items(options: argparse.Namespace, complete: list[Cell]) -> list[str]:
    """What was asked for, and whatever else has results: a part that is made anew does not hide the rest."""
    found = {c.study for c in complete}
    return [item.name for item in ITEMS if item.name in options.items or set(item.studies) <= found]


def reproduce(options: argparse.Namespace, cells: list[Cell], build: str) -> int:
    """Runs what is wanted, writes the results, and publishes them where that was asked for; the exit code."""
    studies = {study for item in ITEMS if item.name in options.items for study in item.studies}
    wanted = [c for c in cells if c.study in studies and (options.live or c.source != "live")]
    runner = measure(options, wanted, build)
    complete = [c for c in cells if runner.complete(c)]
    if runner.interrupted_by:
        tell(
            f"Interrupted; {len(complete)} cells are complete, and the same command goes on from here (without --live"
            " it shows what there is)."
        )
        return EXIT_SIGNAL + runner.interrupted_by
    evidence = collect(options.output, complete)
    evidence.mode = options.mode.name
    planned = sum(c.source == "live" for c in cells)
    verdicts = write_results(evidence, shown_items(options, complete), options.output, planned)
    if options.publish:
        missing = sum(not runner.complete(c) for c in wanted)
        if missing:
            raise InputError(
                f"--publish: {missing} of {len(wanted)} cells are missing, nothing was copied; run it again"
            )
        publish.publish(options.output, options.publish)
    print_summary(verdicts, evidence, options.output)
    return EXIT_FAILED if runner.failed else 0


def main(arguments: Sequence[str]) -> int:
    """The exit code."""
    began = time.monotonic()
    try:
        options = parse(arguments)
        if options.list:
            list_items(options)
            return 0
        cells = all_cells(options.mode, SEED)
        build = build_of(options.hotpath)
        settle_plan(options, cells)
        with lock(options.output):
            code = reproduce(options, cells, build)
    except WrongUse as error:
        tell(f"{PROGRAM}: {error}")
        return EXIT_WRONG_USE
    except Rebuilt:
        tell(
            f"{PROGRAM}: {options.hotpath} was replaced while it was being measured; what is complete is kept, and the"
            " same command measures all anew with the new one"
        )
        return EXIT_FAILED
    except (InputError, RunError, OSError) as error:
        tell(f"{PROGRAM}: {error}")
        return EXIT_FAILED
    except KeyboardInterrupt:
        tell("Interrupted while the page was written; the same command writes it anew.")
        return EXIT_SIGNAL + signal.SIGINT
    tell(duration_text(time.monotonic() - began))
    return code
