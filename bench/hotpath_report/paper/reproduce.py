# SPDX-License-Identifier: Apache-2.0
"""Every table and figure of the paper's evaluation, simulated and, with --live, measured."""

import argparse
import contextlib
import fcntl
import hashlib
import os
import signal
import sys
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TextIO

from hotpath_report import hotpath_command
from hotpath_report.errors import InputError, Interrupted, RunError, interruptible
from hotpath_report.paper import publish
from hotpath_report.paper.cells import MODES, Cell, all_cells, duration_text
from hotpath_report.paper.items import ITEMS, NAMES
from hotpath_report.paper.noise import NOISY
from hotpath_report.paper.runner import Runner, facts_of
from hotpath_report.tables import make_folder, write_json

SEED = 1
SIMULATIONS_AT_ONCE = 2
EXIT_FAILED = 1
BAR = "{percentage:3.0f} %, {remaining} left{postfix}"


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = argparse.ArgumentParser(prog="reproduce_paper.sh", description=__doc__)
    measure = "also measure: hours, resumable (with --quick: minutes)"
    made.add_argument("--live", action="store_true", help=measure)
    length = made.add_mutually_exclusive_group()
    quick, full = "all items, reduced", "live with the paper's 300 s and 600 s"
    length.add_argument("--quick", dest="mode", action="store_const", const="quick", help=quick)
    length.add_argument("--full", dest="mode", action="store_const", const="full", help=full)
    only = "only this item, or several with commas between; see --list"
    made.add_argument("--only", metavar="ITEM", action="append", default=[], help=only)
    listed = "say which items there are and what they take, and end"
    made.add_argument("--list", action="store_true", help=listed)
    output = "results, and what goes on after an interruption (%(default)s)"
    made.add_argument("--output", metavar="FOLDER", type=Path, default="runs/paper", help=output)
    jobs = "live single-core repetitions at the same time, each on another processor (%(default)s)"
    made.add_argument("--jobs", metavar="N", type=int, default=1, help=jobs)
    copy = "then copy what a repository should carry to this folder, as results/paper"
    made.add_argument("--publish", metavar="FOLDER", type=Path, help=copy)
    made.add_argument("--hotpath", metavar="PROGRAM", help="the command to run (default: that of the build)")
    return made


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """The options, checked. Raises InputError."""
    options = parser().parse_args(arguments)
    if options.hotpath:
        os.environ["HOTPATH"] = options.hotpath  # also of what reads the results
    options.hotpath = str(hotpath_command.program())
    options.mode = MODES[options.mode or "standard"]
    options.items = [name for part in options.only for name in part.split(",") if name] or list(NAMES)
    for name in options.items:
        if name not in NAMES:
            raise InputError(f"--only: there is no item `{name}`; there are {', '.join(NAMES)}")
    if options.publish and options.only:
        raise InputError("--publish takes a whole reproduction; leave out --only")
    if options.publish and (problem := publish.problem_with(options.output, options.publish)):
        raise InputError(
            f"--publish {options.publish} {problem}; name a new folder, or that of an earlier publication"
        )
    # The last processors have the fewest interrupts on most machines.
    options.cpus = sorted(os.sched_getaffinity(0), reverse=True)
    if not 1 <= options.jobs <= len(options.cpus):
        raise InputError(
            f"--jobs {options.jobs}: from 1 to {len(options.cpus)}, the processors that this program may use"
        )
    return options


def list_items(options: argparse.Namespace, cells: list[Cell]) -> None:
    """Prints the items and what they take."""
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
        with open(hotpath, "rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()[:12]
        return f"{hotpath_command.output_of('--version').strip()} ({digest})"
    except (OSError, RunError) as error:
        raise InputError(
            f"--hotpath {hotpath}: cannot be run ({error}); build it with launch_scripts/build.sh"
        ) from None


def open_folder(options: argparse.Namespace, cells: list[Cell]) -> TextIO:
    """Writes the plan at the first start, and refuses to go on with another one. Keeps others out of the folder while
    the file is open: they would remove what is being measured."""
    folder, path = options.output, options.output / "plan.json"
    plan = {"mode": options.mode.name, "seed": SEED, "order": [c.name for c in cells]}
    try:
        make_folder(folder / "cells")
        file = open(folder / ".lock", "w", encoding="ascii")
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        before = facts_of(path)
        if not before:
            write_json(path, plan)
    except BlockingIOError:
        raise InputError(
            f"--output {folder}: another reproduction runs there; wait for it, or give another folder"
        ) from None
    except OSError as error:
        raise InputError(f"--output {folder}: cannot be written ({error.strerror})") from None
    mode = before.get("mode")
    if before and mode != plan["mode"]:
        raise InputError(
            f"--output {folder} holds a reproduction in mode `{mode}`; give that mode, or another folder"
        )
    if before and before.get("order") != plan["order"]:
        raise InputError(
            f"--output {folder} holds a reproduction by another version of this script; give another folder"
        )
    return file


def run_cells(runner: Runner, todo: list[Cell], jobs: int) -> None:
    """Simulations first, then what measures."""
    live = [c for c in todo if c.source == "live"]
    runner.run_all([c for c in todo if c.source != "live" and not c.alone], SIMULATIONS_AT_ONCE)
    runner.run_all([c for c in todo if c.alone], 1)
    if jobs == 1:
        runner.run_all(live, 1)
        return
    for repetition in sorted({c.repetition for c in live}):
        cells = [c for c in live if c.repetition == repetition]
        runner.run_all([c for c in cells if c.cores == 1], jobs)
        runner.run_all([c for c in cells if c.cores > 1], 1)


def tell(sentence: str) -> None:
    """On standard error."""
    print(sentence, file=sys.stderr)


def measure(options: argparse.Namespace, runner: Runner, wanted: list[Cell]) -> None:
    """Runs what is missing, as far as it gets. Raises Interrupted."""
    import tqdm

    todo = [c for c in wanted if not runner.complete(c)]
    if len(todo) < len(wanted):
        tell(f"{len(wanted) - len(todo)} of {len(wanted)} cells are complete; going on with the rest")
    before = [
        facts["build"] for c in todo if c.source == "live" and (facts := runner.facts(c)).get("complete")
    ]
    elsewhere = before.count(runner.build)
    for count, how in (
        (len(before) - elsewhere, f"by another build than {runner.build}"),
        (elsewhere, f"on other processors than {','.join(map(str, runner.cpus))}"),
    ):
        if count:
            tell(
                f"{count} live cells were measured {how}; they are measured again and kept in"
                f" {options.output}/superseded"
            )
    total, on_terminal = sum(c.seconds for c in todo), sys.stderr.isatty()
    bar: Any = tqdm.tqdm(total=total, bar_format=BAR, leave=False, disable=not on_terminal)

    def show(seconds: float) -> None:
        bar.set_postfix_str(", ".join(list(runner.running))[:80], refresh=False)
        bar.update(seconds)

    runner.on_change = show
    with contextlib.closing(bar), interruptible():
        run_cells(runner, todo, options.jobs)
    for cell, sentence in runner.failed:
        tell(f"{cell.name} failed: {sentence}")


def present(options: argparse.Namespace, runner: Runner, cells: list[Cell], wanted: list[Cell]) -> None:
    """Writes the results, publishes them where that was asked for, and prints a line for each claim."""
    from hotpath_report.paper import evidence, results  # take a second, which a refusal does not need

    complete = [c for c in cells if runner.complete(c)]
    # A part that is made anew does not hide the rest.
    found = {c.study for c in complete}
    shown = [item.name for item in ITEMS if item.name in options.items or set(item.studies) <= found]
    collected = evidence.collect(options.output, complete)
    collected.mode = options.mode.name
    planned = sum(c.source == "live" for c in cells)
    verdicts = results.write_results(collected, shown, options.output, planned)
    if options.publish:
        missing = len(set(wanted) - set(complete))
        if missing:
            raise RunError(
                f"--publish: {missing} of {len(wanted)} cells are missing, nothing was copied; run it again"
            )
        publish.publish(options.output, options.publish)
    for v in verdicts:
        text = next((f.text for f in reversed(list(v.findings.values())) if f is not None), "")
        print(f"{v.verdict:<10}  {v.claim.name:<22} {text}")
    print(", ".join(f"{count} {word}" for word, count in Counter(v.verdict for v in verdicts).items()))
    if collected.machine is not None:
        print(results.prose("noise", collected, NOISY))
    print(f"The page: {options.output}/report.html (and report.md); data: {options.output}/data")


def reproduce(arguments: Sequence[str]) -> int:
    """Runs what is wanted and presents it; the exit code. Raises InputError, RunError."""
    began, options = time.monotonic(), parse(arguments)
    cells = all_cells(options.mode, SEED)
    if options.list:
        list_items(options, cells)
        return 0
    studies = {study for item in ITEMS if item.name in options.items for study in item.studies}
    wanted = [c for c in cells if c.study in studies and (options.live or c.source != "live")]
    build = build_of(options.hotpath)
    with open_folder(options, cells):
        runner = Runner(options.hotpath, build, options.output, options.cpus)
        try:
            measure(options, runner, wanted)
            present(options, runner, cells, wanted)
        except Interrupted as signalled:
            complete = sum(map(runner.complete, cells))
            tell(
                f"Interrupted; {complete} cells are complete, and the same command goes on from here (without --live"
                " it shows what there is)."
            )
            return signalled.exit_code
        except KeyboardInterrupt:
            tell("Interrupted while the page was written; the same command writes it anew.")
            return Interrupted(signal.SIGINT).exit_code
    tell(duration_text(time.monotonic() - began))
    return EXIT_FAILED if runner.failed else 0
