# SPDX-License-Identifier: Apache-2.0
"""Reproduces the tables and figures of the paper's evaluation; --live also measures."""

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
from functools import partial
from pathlib import Path
from typing import Any, TextIO

from hotpath_report import hotpath_command
from hotpath_report.errors import InputError, Interrupted, RunError, interruptible
from hotpath_report.paper.cells import ITEMS, MODES, NAMES, Cell, all_cells, duration_text
from hotpath_report.paper.runner import Runner, facts_of
from hotpath_report.tables import make_folder, write_json

SEED = 1
SIMULATIONS_AT_ONCE = 2
EXIT_FAILED = 1
BAR = "{percentage:3.0f} %, {remaining} left{postfix}"

tell = partial(print, file=sys.stderr)


def parser() -> argparse.ArgumentParser:
    """Parser of the options."""
    made = argparse.ArgumentParser(prog="reproduce_paper.sh", description=__doc__)
    measure = "also measure: takes hours, resumable (with --quick: minutes)"
    made.add_argument("--live", action="store_true", help=measure)
    length = made.add_mutually_exclusive_group()
    quick, full = "all items with short runs", "live runs as long as the paper's: 300 s and 600 s"
    length.add_argument("--quick", dest="mode", action="store_const", const="quick", help=quick)
    length.add_argument("--full", dest="mode", action="store_const", const="full", help=full)
    only = "only this item, or several separated by commas; see `hotpath list figures`"
    made.add_argument("--only", metavar="ITEM", action="append", default=[], help=only)
    listed = "list the items with their durations and exit"
    made.add_argument("--list", action="store_true", help=listed)
    output = "folder for results and for resuming (%(default)s)"
    made.add_argument("--output", metavar="FOLDER", type=Path, default="runs/paper", help=output)
    return made


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Parses and checks the options. Raises InputError."""
    options = parser().parse_args(arguments)
    options.hotpath = str(hotpath_command.program())
    options.mode = MODES[options.mode or "standard"]
    options.items = [name for part in options.only for name in part.split(",") if name] or list(NAMES)
    for name in options.items:
        if name not in NAMES:
            raise InputError(f"--only: unknown item `{name}`; choose from {', '.join(NAMES)}")
    # On most machines the last processors get the fewest interrupts.
    options.cpus = sorted(os.sched_getaffinity(0), reverse=True)
    return options


def list_items(mode: str, cells: list[Cell]) -> None:
    """Prints the items with their cells and durations."""
    print(f"{'item':<16} {'simulated':>10} {'live':>16}  what")
    for item in ITEMS:
        mine = [c for c in cells if c.study in item.studies]
        live = [c.seconds for c in mine if c.source == "live"]
        length = duration_text(sum(live)) if live else ""
        what = item.title + ("" if item.paper else " (beyond the paper)")
        print(f"{item.name:<16} {len(mine) - len(live):>10} {length:>16}  {what}")
    live_s = sum(c.seconds for c in cells if c.source == "live")
    print(f"All live repetitions in mode {mode}: {duration_text(live_s)}; items share repetitions.")


def build_of(hotpath: str) -> str:
    """Version and content hash of the program; results of equal builds are comparable."""
    try:
        with open(hotpath, "rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()[:12]
        return f"{hotpath_command.output_of('--version').strip()} ({digest})"
    except (OSError, RunError) as error:
        hint = "build it with launch_scripts/build.sh"
        raise InputError(f"{hotpath}: cannot run ({error}); {hint}") from None


def open_folder(options: argparse.Namespace, cells: list[Cell]) -> TextIO:
    """Writes the plan at the first start and rejects a different plan later. The open file locks the folder: another
    process would remove running measurements. Raises InputError."""
    folder, path = options.output, options.output / "plan.json"
    where = f"--output {folder}"
    plan = {"mode": options.mode.name, "seed": SEED, "order": [c.name for c in cells]}
    try:
        make_folder(folder / "cells")
        file = open(folder / ".lock", "w", encoding="ascii")
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        before = facts_of(path)
        if not before:
            write_json(path, plan)
    except BlockingIOError:
        raise InputError(f"{where}: another reproduction runs there; wait, or name another folder") from None
    except OSError as error:
        raise InputError(f"{where}: cannot be written ({error.strerror})") from None
    mode = before.get("mode")
    if before and mode != plan["mode"]:
        raise InputError(f"{where} holds a reproduction in mode `{mode}`; use this mode or another folder")
    if before and before.get("order") != plan["order"]:
        raise InputError(f"{where} holds results of another version of this script; name another folder")
    return file


def run_cells(runner: Runner, todo: list[Cell]) -> None:
    """Runs simulations first, then what measures, one at a time."""
    measuring = [c for c in todo if c.alone or c.source == "live"]
    runner.run_all([c for c in todo if c not in measuring], SIMULATIONS_AT_ONCE)
    runner.run_all(measuring, 1)


def measure(options: argparse.Namespace, runner: Runner, wanted: list[Cell]) -> None:
    """Runs the missing cells. Raises Interrupted."""
    import tqdm

    todo = [c for c in wanted if not runner.complete(c)]
    if len(todo) < len(wanted):
        tell(f"{len(wanted) - len(todo)} of {len(wanted)} cells are complete; continuing with the rest")
    live = (runner.facts(c) for c in todo if c.source == "live")
    builds = Counter(facts["build"] == runner.build for facts in live if facts.get("complete"))
    processors = ",".join(map(str, runner.cpus))
    for same, how in (
        (False, f"by another build than {runner.build}"),
        (True, f"on other processors than {processors}"),
    ):
        if builds[same]:
            again = f"measuring them again; the old results move to {options.output}/superseded"
            tell(f"{builds[same]} live cells were measured {how}: {again}")
    total, on_terminal = sum(c.seconds for c in todo), sys.stderr.isatty()
    bar: Any = tqdm.tqdm(total=total, bar_format=BAR, leave=False, disable=not on_terminal)

    def show(seconds: float) -> None:
        bar.set_postfix_str(", ".join(list(runner.running))[:80], refresh=False)
        bar.update(seconds)

    runner.on_change = show
    with contextlib.closing(bar), interruptible():
        run_cells(runner, todo)
    for cell, sentence in runner.failed:
        tell(f"{cell.name} failed: {sentence}")


def present(options: argparse.Namespace, runner: Runner, cells: list[Cell]) -> None:
    """Writes the results, and prints a line per claim."""
    from hotpath_report.paper import evidence, results  # takes a second; not needed for errors

    complete = [c for c in cells if runner.complete(c)]
    # With --only, keep showing other complete items.
    found = {c.study for c in complete}
    shown = [item.name for item in ITEMS if item.name in options.items or set(item.studies) <= found]
    collected = evidence.collect(options.output, complete)
    collected.mode = options.mode.name
    planned = sum(c.source == "live" for c in cells)
    verdicts = results.write_results(collected, shown, options.output, planned)
    for v in verdicts:
        text = next((f.text for f in reversed(v.known.values())), "")
        print(f"{v.verdict:<10}  {v.claim.name:<22} {text}")
    print(", ".join(f"{count} {word}" for word, count in Counter(v.verdict for v in verdicts).items()))
    if collected.machine is not None:
        print(results.prose("noise", collected))
    print(f"The page: {options.output}/report.html (and report.md); data: {options.output}/data")


def reproduce(*arguments: str) -> int:
    """Runs the selected cells and writes the page. Raises InputError, RunError."""
    began, options = time.monotonic(), parse(arguments)
    cells = all_cells(options.mode, SEED)
    if options.list:
        list_items(options.mode.name, cells)
        return 0
    studies = {study for item in ITEMS if item.name in options.items for study in item.studies}
    wanted = [c for c in cells if c.study in studies and (options.live or c.source != "live")]
    build = build_of(options.hotpath)
    with open_folder(options, cells):
        runner = Runner(options.hotpath, build, options.output, options.cpus)
        try:
            measure(options, runner, wanted)
            present(options, runner, cells)
        except Interrupted as signalled:
            done = f"{sum(map(runner.complete, cells))} cells are complete"
            tell(
                f"Interrupted; {done}. The same command resumes; without --live it shows the results so far."
            )
            return signalled.exit_code
        except KeyboardInterrupt:
            tell("Interrupted while writing the page; the same command writes it again.")
            return Interrupted(signal.SIGINT).exit_code
    tell(duration_text(time.monotonic() - began))
    return EXIT_FAILED if runner.failed else 0
