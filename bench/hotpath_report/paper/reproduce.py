# SPDX-License-Identifier: Apache-2.0
"""`hotpath paper figures`: reproduces the tables and figures of the paper's evaluation. Only a complete cell's folder
gets its name, so that runs can resume."""

import contextlib
import fcntl
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any, TextIO

from hotpath_report import hotpath_command
from hotpath_report.errors import InputError, Interrupted, RunError, interruptible
from hotpath_report.files import make_folder, name_durably, read_json, write_json
from hotpath_report.paper.cells import CAUSES, ITEMS, MODES, Cell, all_cells, duration_text, seconds_of

SEED = 1
EXIT_FAILED = 1
BAR = "{percentage:3.0f} %, {remaining} left{postfix}"

tell = partial(print, file=sys.stderr)


def list_items() -> None:
    """Prints the items with their cells and durations."""
    cells = all_cells(MODES["standard"], SEED)
    print(f"{'item':<16} {'simulations':>11} {'with --live':>16}  what")
    for item in ITEMS.values():
        mine = [c for c in cells if c["study"] in item.studies]
        live = [seconds_of(c) for c in mine if c["source"] == "live"]
        length = duration_text(sum(live)) if live else ""
        where = item.paper or "beyond the paper"
        print(f"{item.name:<16} {len(mine) - len(live):>11} {length:>16}  {item.title}: {where}")
    live_s = sum(seconds_of(c) for c in cells if c["source"] == "live")
    print(f"All live repetitions in mode standard: {duration_text(live_s)}; items share repetitions.")
    print("One of them, simulated in seconds: hotpath paper figures --quick --only ITEM")


def build_of(hotpath: Path) -> str:
    """Version and content hash of the program; results of equal builds are comparable."""
    try:
        digest = hashlib.sha256(hotpath.read_bytes()).hexdigest()[:12]
        return f"{hotpath_command.output_of('--version').strip()} ({digest})"
    except (OSError, RunError) as error:
        raise InputError(f"{hotpath}: cannot run ({error}); build it with launch_scripts/build.sh") from None


def facts_of(path: Path) -> dict[str, Any]:
    """Content of a JSON file; empty if it cannot be read."""
    with contextlib.suppress(InputError):
        return dict(read_json(path))
    return {}


def noise_of(run: dict[str, Any], summary: dict[str, Any]) -> dict[str, Any]:
    """Disturbances of a live cell's one repetition in percent of its time, and the marks that `hotpath` gave it. Marked
    repetitions are shown and counted like all others."""
    (usage,) = (r["usage"] for r in run["runs"])
    shares = {f"{cause}_percent": 100 * usage[f"{cause}_ms"] / usage["wall_ms"] for cause in CAUSES}
    return {**shares, "marks": [m for e in summary["executors"] for r in e["disturbed"] for m in r["marks"]]}


def complete(output: Path, cell: Cell) -> bool:
    """Whether the cell's folder holds the planned result of its build."""
    return cell.items() <= facts_of(output / "cells" / cell["name"] / "cell.json").items()


def run(program: Path, output: Path, cell: Cell) -> str:
    """Runs one cell to completion; returns what went wrong, or nothing. Raises Interrupted after the end of the
    program."""
    name, folder = cell["name"], output / "cells" / cell["name"]
    part = folder.with_name(f".{name}.{os.getpid()}.part")
    process = subprocess.Popen(
        [*hotpath_command.ENDS_WITH_US, program, *cell["command"][1:-1], part],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        env={**os.environ, "HOTPATH_FIGURES": "none"},
        start_new_session=True,  # this process forwards Ctrl-C once
    )
    try:
        _, errors = process.communicate()
    except Interrupted:
        process.send_signal(signal.SIGINT)
        process.communicate()
        raise
    found, facts = facts_of(part / "run.json"), dict(cell)
    if process.returncode != 0 or found.get("complete", True) is not True:
        shutil.rmtree(part, ignore_errors=True)
        return (errors.strip().splitlines() or [f"exit code {process.returncode}"])[-1]
    if cell["source"] == "live":
        facts["noise"] = noise_of(found, facts_of(part / "summary.json"))
        if folder.exists():  # of another build: keep what took long to measure
            aside = output / "superseded"
            aside.mkdir(exist_ok=True)
            os.replace(folder, aside / f"{name}.{time.time_ns()}")
    write_json(part / "cell.json", facts)
    shutil.rmtree(folder, ignore_errors=True)
    name_durably(part, folder)
    return ""


def measure(program: Path, output: Path, wanted: list[Cell]) -> bool:
    """Runs the missing cells; returns whether all succeeded. Raises RunError, Interrupted."""
    import tqdm

    for part in output.glob("cells/.*.part"):  # leftovers of killed or interrupted reproductions
        shutil.rmtree(part, ignore_errors=True)
    todo, built = [c for c in wanted if not complete(output, c)], program.stat().st_mtime_ns
    if len(todo) < len(wanted):
        tell(f"{len(wanted) - len(todo)} of {len(wanted)} cells are complete; continuing with the rest")
    total, hidden, failures = sum(map(seconds_of, todo)), not sys.stderr.isatty(), []
    with tqdm.tqdm(total=total, bar_format=BAR, leave=False, disable=hidden) as bar:
        for cell in todo:
            if program.stat().st_mtime_ns != built:
                kept = "was replaced during the measurement; complete cells are kept"
                again = "The same command measures everything again with the new program"
                raise RunError(f"{program} {kept}. {again}")
            bar.set_postfix_str(cell["name"])
            if failure := run(program, output, cell):
                failures.append(f"{cell['name']} failed: {failure}")
            bar.update(seconds_of(cell))
    for failure in failures:
        tell(failure)
    return not failures


def open_folder(folder: Path, mode: str, cells: list[Cell]) -> TextIO:
    """Writes the plan at the first start and rejects a different plan later. The open file locks the folder: another
    process would remove running measurements. Raises InputError."""
    path, where = folder / "plan.json", f"--output {folder}"
    plan = {"mode": mode, "seed": SEED, "order": [c["name"] for c in cells]}
    try:
        make_folder(folder / "cells")
        file = open(folder / ".lock", "w", encoding="ascii")
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        before = facts_of(path)
        if not before:
            write_json(path, before := plan)
    except BlockingIOError:
        raise InputError(f"{where}: another reproduction runs there; wait, or name another folder") from None
    except OSError as error:
        raise InputError(f"{where}: cannot be written ({error.strerror})") from None
    if before.get("mode") != mode:
        held = f"{where} holds a reproduction in mode `{before.get('mode')}`"
        raise InputError(f"{held}; use this mode or another folder")
    if before.get("order") != plan["order"]:
        raise InputError(f"{where} holds results of another version of this script; name another folder")
    return file


def present(output: Path, mode: str, items: list[str], planned: int, cells: list[Cell]) -> None:
    """Writes the results of the complete `cells`, and prints a line per claim. `planned`: live cells of the plan."""
    from hotpath_report.paper import evidence, results  # takes a second; not needed for errors

    # With --only, keep showing other complete items.
    found = {c["study"] for c in cells}
    shown = [name for name, item in ITEMS.items() if name in items or set(item.studies) <= found]
    collected = evidence.collect(output, cells, mode)
    verdicts = results.write_results(collected, shown, output, planned)
    for v in verdicts:
        texts = ["", *(f.text for source, f in v.findings.items() if source != evidence.REAL)]
        print(f"{v.verdict:<10}  {v.claim.name:<22} {texts[-1]}")
    print(", ".join(f"{count} {word}" for word, count in Counter(v.verdict for v in verdicts).items()))
    if collected.machine is not None:
        print(results.prose("noise", collected))
    print(f"The page: {output}/report.html (and report.md); data: {output}/data")


def reproduce(options: str) -> int:
    """Runs the cells that the JSON `options` of `hotpath paper figures` select, and writes the page. Raises
    InputError, RunError."""
    began, o = time.monotonic(), json.loads(options)
    items, output = o["only"] or list(ITEMS), Path(o["output"])
    for name in items:
        if name not in ITEMS:
            raise InputError(f"--only: unknown item `{name}`; choose from {', '.join(ITEMS)}")
    program = hotpath_command.program()
    # On most machines the last processors get the fewest interrupts.
    cpus = sorted(os.sched_getaffinity(0), reverse=True)
    cells = all_cells(MODES[o["mode"]], SEED, cpus, build_of(program))
    studies = {study for name in items for study in ITEMS[name].studies}
    wanted = [c for c in cells if c["study"] in studies and (o["live"] or c["source"] != "live")]
    planned = sum(c["source"] == "live" for c in cells)
    with open_folder(output, o["mode"], cells):
        try:
            with interruptible():
                succeeded = measure(program, output, wanted)
                present(output, o["mode"], items, planned, [c for c in cells if complete(output, c)])
        except Interrupted as signalled:
            done = f"Interrupted; {sum(complete(output, c) for c in cells)} cells are complete"
            tell(f"{done}. The same command resumes; without --live it shows the results so far.")
            return signalled.exit_code
    tell(duration_text(time.monotonic() - began))
    return 0 if succeeded else EXIT_FAILED
