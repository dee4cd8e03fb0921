#!/usr/bin/python3
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
from pathlib import Path

import publish
from cells import MODES, all_cells
from evidence import BadResults, collect
from items import ITEMS, NAMES
from reference import Reference
from results import noise, write_results
from runner import SIMULATIONS_AT_ONCE, Interrupted, Progress, Rebuilt, Runner, duration_text, read_json, write_json

SEED = 1
EXIT_FAILED, EXIT_WRONG_USE, EXIT_SIGNAL = 1, 2, 128


class WrongUse(Exception):
    pass


def parse(arguments):
    parser = argparse.ArgumentParser(prog="reproduce_paper.sh", description=__doc__)
    parser.add_argument("--live", action="store_true", help="also measure: hours, resumable (with --quick: minutes)")
    length = parser.add_mutually_exclusive_group()
    length.add_argument("--quick", dest="mode", action="store_const", const="quick", help="all items, reduced")
    length.add_argument(
        "--full", dest="mode", action="store_const", const="full", help="live with the paper's 300 s and 600 s"
    )
    parser.add_argument(
        "--only",
        metavar="ITEM",
        action="append",
        default=[],
        help="only this item, or several with commas between; see --list",
    )
    parser.add_argument("--list", action="store_true", help="say which items there are and what they take, and end")
    parser.add_argument(
        "--output",
        metavar="FOLDER",
        default="runs/paper",
        help="results, and what goes on after an interruption (%(default)s)",
    )
    parser.add_argument(
        "--jobs",
        metavar="N",
        type=int,
        default=1,
        help=(
            "live single-core repetitions at the same time, each on a processor of its own (%(default)s)"
        ),
    )
    parser.add_argument(
        "--publish",
        metavar="FOLDER",
        help="then copy what a repository should carry to this folder, as results/paper",
    )
    parser.add_argument(
        "--hotpath",
        metavar="PROGRAM",
        default=str(Path(__file__).resolve().parents[2] / "build/bench/hotpath"),
        help="the command to run",
    )
    options = parser.parse_args(arguments)
    options.mode = MODES[options.mode or "standard"]
    options.items = [name for part in options.only for name in part.split(",") if name] or list(NAMES)
    for name in options.items:
        if name not in NAMES:
            raise WrongUse(f"--only: there is no item `{name}`; there are {', '.join(NAMES)}")
    if options.publish and options.only:
        raise WrongUse("--publish takes a whole reproduction; leave out --only")
    if options.publish and (problem := publish.problem_with(options.output, options.publish)):
        raise WrongUse(f"--publish {options.publish} {problem}; name a new folder, or that of an earlier publication")
    cpus = sorted(os.sched_getaffinity(0), reverse=True)
    if not 1 <= options.jobs <= len(cpus):
        raise WrongUse(f"--jobs {options.jobs}: from 1 to {len(cpus)}, the processors that this program may use")
    options.cpus = cpus  # the last processors have the fewest interrupts on most machines
    return options


def list_items(options):
    cells = all_cells(options.mode, SEED)
    print(f"{'item':<16} {'simulated':>10} {'live':>16}  what")
    for item in ITEMS:
        mine = [c for c in cells if c.study in item.studies]
        live = [c for c in mine if c.source == "live"]
        length = duration_text(sum(c.seconds for c in live)) if live else ""
        print(
            f"{item.name:<16} {len(mine) - len(live):>10} {length:>16} "
            f" {item.title}{'' if item.paper else ' (beyond the paper)'}"
        )
    live_s = sum(c.seconds for c in cells if c.source == "live")
    print(f"All live repetitions of mode {options.mode.name}: {duration_text(live_s)}; items share them.")


def build_of(hotpath):
    """What makes results comparable: version and content of the command."""
    try:
        version = subprocess.run([hotpath, "--version"], capture_output=True, text=True, check=True).stdout.strip()
        with open(hotpath, "rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()[:12]
    except (OSError, subprocess.CalledProcessError) as error:
        raise WrongUse(
            f"--hotpath {hotpath}: cannot be run ({error}); build it with launch_scripts/build.sh"
        ) from None
    return f"{version} ({digest})"


def settle_plan(options, cells):
    """Writes the plan at the first start, and refuses to go on with another one."""
    folder = Path(options.output)
    plan = {"mode": options.mode.name, "seed": SEED, "order": [c.name for c in cells]}
    path = folder / "plan.json"
    before = read_json(path)
    if before is None:
        try:
            (folder / "cells").mkdir(parents=True, exist_ok=True)
            write_json(path, plan)
        except OSError as error:
            raise WrongUse(f"--output {folder}: cannot be written ({error.strerror})") from None
        return
    if before.get("mode") != plan["mode"]:
        raise WrongUse(
            f"--output {folder} holds a reproduction in mode `{before.get('mode')}`; give that mode, or another"
            " folder"
        )
    if before.get("order") != plan["order"]:
        raise WrongUse(f"--output {folder} holds a reproduction by another version of this script; give another folder")


def lock(options):
    """Keeps others out of the folder for as long as this program lives: they would remove what is being measured."""
    path = Path(options.output) / ".lock"
    try:
        file = open(path, "w", encoding="ascii")  # closed by the end of the program
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise WrongUse(
            f"--output {options.output}: another reproduction runs there; wait for it, or give another folder"
        ) from None
    except OSError as error:
        raise WrongUse(f"--output {options.output}: cannot be written ({error.strerror})") from None
    return file


def run_cells(options, runner, todo):
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


def measure(options, wanted, build):
    """Runs what is missing, as far as it gets, and returns the runner."""
    runner = Runner(options.hotpath, build, options.output, options.cpus, lambda: None)
    todo = [c for c in wanted if not runner.complete(c)]
    progress = Progress(todo)
    progress.runner, progress.jobs = runner, options.jobs
    runner.on_change = progress.show
    if len(todo) < len(wanted):
        print(
            f"{len(wanted) - len(todo)} of {len(wanted)} cells are complete; going on with the rest", file=sys.stderr
        )
    outdated = sum(c.source == "live" and runner.of_another_build(c) for c in todo)
    if outdated:
        print(
            (
                f"{outdated} live cells were measured by another build than {build}; they are measured again and kept"
                f" in {options.output}/superseded"
            ),
            file=sys.stderr,
        )

    def stop(number, _frame):
        runner.interrupt(number)

    handlers = {s: signal.signal(s, stop) for s in (signal.SIGINT, signal.SIGTERM)}
    try:
        run_cells(options, runner, todo)
    except Interrupted:
        pass
    finally:
        progress.end()
        for number, handler in handlers.items():
            signal.signal(number, handler)
    for cell, sentence in runner.failed:
        print(f"reproduce_paper.sh: {cell.name} failed: {sentence}", file=sys.stderr)
    return runner


def summary(verdicts, evidence, options):
    words = {}
    for v in verdicts:
        words[v.verdict] = words.get(v.verdict, 0) + 1
        text = next((f.text for f in reversed(list(v.findings.values())) if f is not None), "")
        print(f"{v.verdict:<10}  {v.claim.name:<22} {text}")
    print(", ".join(f"{count} {word}" for word, count in words.items()))
    if evidence.machine is not None:
        print(noise(evidence)["text"])
    print(f"The page: {options.output}/report.html (and report.md); data: {options.output}/data")


def main(arguments):
    try:
        options = parse(arguments)
        if options.list:
            list_items(options)
            return 0
        cells = all_cells(options.mode, SEED)
        build = build_of(options.hotpath)
        settle_plan(options, cells)
        options.lock = lock(options)
    except WrongUse as error:
        print(f"reproduce_paper.sh: {error}", file=sys.stderr)
        return EXIT_WRONG_USE
    began = time.monotonic()
    studies = {study for item in ITEMS if item.name in options.items for study in item.studies}
    wanted = [c for c in cells if c.study in studies and (options.live or c.source != "live")]
    try:
        runner = measure(options, wanted, build)
        complete = [c for c in cells if runner.complete(c)]
        if runner.interrupted_by:
            print(
                (
                    f"Interrupted; {len(complete)} cells are complete, and the same command goes on from here (without"
                    " --live it shows what there is)."
                ),
                file=sys.stderr,
            )
            return EXIT_SIGNAL + runner.interrupted_by
        evidence = collect(options.output, complete)
        evidence.mode = options.mode.name
        verdicts = write_results(
            evidence, Reference(), cells, shown_items(options, complete), options.mode, options.output
        )
        if options.publish:
            publish_whole(options, wanted, runner)
    except Rebuilt:
        print(
            f"reproduce_paper.sh: {options.hotpath} was replaced while it was being measured; what is complete is kept,"
            " and the same command measures all anew with the new one",
            file=sys.stderr,
        )
        return EXIT_FAILED
    except (BadResults, OSError) as error:
        print(f"reproduce_paper.sh: {error}", file=sys.stderr)
        return EXIT_FAILED
    except KeyboardInterrupt:
        print("Interrupted while the page was written; the same command writes it anew.", file=sys.stderr)
        return EXIT_SIGNAL + signal.SIGINT
    summary(verdicts, evidence, options)
    print(f"{duration_text(time.monotonic() - began)}", file=sys.stderr)
    return EXIT_FAILED if runner.failed else 0


def shown_items(options, complete):
    """What was asked for, and whatever else has results: a part that is made anew does not hide the rest."""
    found = {c.study for c in complete}
    return [item.name for item in ITEMS if item.name in options.items or set(item.studies) <= found]


def publish_whole(options, wanted, runner):
    missing = sum(not runner.complete(c) for c in wanted)
    if missing:
        raise BadResults(f"--publish: {missing} of {len(wanted)} cells are missing, nothing was copied; run it again")
    publish.publish(options.output, options.publish)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
