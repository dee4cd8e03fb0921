# SPDX-License-Identifier: Apache-2.0
"""`hotpath bench`: runs the benchmark programs, a fresh process for each repetition, in seeded random order, into one
folder: bench.json, the programs' own output below raw/, report.md with its pictures.

Google Benchmark's --benchmark_repetitions would repeat in one process: all repetitions would share
its memory layout, no other program would run between them, and a hang or a signal would lose them
all."""

import contextlib
import itertools
import json
import os
import random
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from hotpath_report import hotpath_command
from hotpath_report.bench_values import BenchValues, compare
from hotpath_report.errors import InputError, Interrupted, RunError, interruptible
from hotpath_report.run import Run
from hotpath_report.tables import make_folder, read_json, write_json

HOT_PATH = "hot_path"  # no program, but `hotpath compare`
PROGRAMS = ("scheduler", "simulator", "executor", "transport", HOT_PATH)


def find_program(name: str) -> Path:
    """Next to the command in a build tree, in lib/hotpath_bench when installed. Raises InputError."""
    if name == HOT_PATH:
        return hotpath_command.program()
    if name not in PROGRAMS:
        raise InputError(f"--only: there is no program `{name}`; there are {', '.join(PROGRAMS)}")
    here = hotpath_command.program().parent
    for path in (here / f"bench_{name}", here.parent / "lib/hotpath_bench" / f"bench_{name}"):
        if path.exists():
            return path
    raise InputError(
        f"the benchmark program bench_{name} was not built: install libbenchmark-dev (Google Benchmark) and build again"
    )


def shared_memory_of(process: Path) -> set[str]:
    """Files of /dev/shm that a process, given by its folder in /proc, maps or has open."""
    with contextlib.suppress(OSError):
        opened = [os.readlink(descriptor) for descriptor in (process / "fd").iterdir()]
        return set(re.findall(r"/dev/shm/\S+", "\n".join([(process / "maps").read_text(), *opened])))
    return set()


def end_group(leader: subprocess.Popen[bytes]) -> None:
    """Kills a program and all that it started, and removes what they can no longer remove themselves: Fast DDS's files
    that nobody else uses."""
    processes, files = list(Path("/proc").glob("[0-9]*")), set()
    for process in processes:
        with contextlib.suppress(ProcessLookupError):
            files |= shared_memory_of(process) if os.getpgid(int(process.name)) == leader.pid else set()
    os.killpg(leader.pid, 9)
    leader.wait()
    for file in files.difference(*map(shared_memory_of, Path("/proc").glob("[0-9]*"))):
        for path in (Path(file), Path(file).with_name(f"sem.{Path(file).name}_mutex")):
            path.unlink(missing_ok=True)


def execute(words: list[str], log: Path, time_out_s: float) -> str:
    """Runs a program; returns what went wrong, or nothing."""
    environment = {**os.environ, "HOTPATH_FIGURES": "none"}
    with log.open("wb") as file:
        command = [*hotpath_command.ENDS_WITH_US, *words]
        process = subprocess.Popen(command, stdout=file, stderr=file, env=environment, start_new_session=True)
        try:
            status = process.wait(time_out_s)
        except subprocess.TimeoutExpired:
            end_group(process)
            return "did not end in time; see --time-out"
        except Interrupted:
            end_group(process)
            raise
    how = f"ended with exit code {status}" if status > 0 else f"was ended by signal {-status}"
    return "" if status == 0 else f"failed: it {how}; see its .txt in raw/"


def run_program(program: Path, output: Path, options: dict[str, Any], values: BenchValues) -> list[str]:
    """One repetition of a benchmark program; returns what failed."""
    words = [str(program), f"--benchmark_out={output}", "--benchmark_out_format=json"]
    words += ["--benchmark_enable_random_interleaving=true", *(["--quick"] if options["quick"] else [])]
    failure = execute(words, output.with_suffix(".txt"), options["time_out_s"])
    return [f"bench_{output.stem} {failure}"] if failure else values.add(output)


def run_hot_path(program: Path, output: Path, options: dict[str, Any], values: BenchValues) -> list[str]:
    """One repetition of the reference system: latency of the hot path, and CPU time of a callback of the graph without
    work; returns what failed."""
    for transport, idle in itertools.product(("intra_process", "fastdds"), (False, True)):
        folder = output.with_name(f"{output.stem}-{transport}{'-idle' if idle else ''}")
        words = [str(program), "run", "--repetitions", "1", "--transport", transport]
        words += ["--load", "0"] if idle else []
        words += [
            "--duration",
            "0.7" if options["quick"] else "2",
            "--warm-up",
            "0.3",
            "--output",
            str(folder),
        ]
        failure = execute(words, folder.with_suffix(".txt"), options["time_out_s"])
        if failure:
            return [f"{folder.name} {failure}"]
        for executor in Run(folder).summary():
            variant = f"executor:{executor['executor']}/transport:{transport}"
            if idle:
                each = {"cpu_per_callback_ns": 1e3 * executor["cpu_per_callback_us"]}
                values.add_figures(
                    f"callback/{variant}", each | {"callbacks": executor["callbacks_executed"]}
                )
            else:
                latency = executor["chains"][0]["hot_path_latency_ms"]
                found = {f"hot_path_{q}_ns": 1e6 * latency[q] for q in ("p50", "p99", "p999", "max")}
                values.add_figures(f"hot_path/{variant}", found)
    return []


def new_folder(name: str) -> Path:
    """The folder of the results, with raw/ in it. Raises InputError."""
    folder = Path(name or time.strftime("runs/%Y%m%d-%H%M%S-bench"))
    make_folder(folder / "raw")
    return folder


def read_machine(folder: Path) -> dict[str, Any]:
    """What `hotpath doctor` says, which notes on standard error what may disturb a measurement."""
    path = folder / "machine.json"
    program = [*hotpath_command.ENDS_WITH_US, str(hotpath_command.program())]
    command = [*program, "machine", "--duration", "0.2", "--output", str(path)]
    if subprocess.run(command, stdout=subprocess.DEVNULL, check=False).returncode:
        raise RunError("`hotpath doctor` failed")
    machine: dict[str, Any] = read_json(path)
    path.unlink()
    return machine


def measure(options: dict[str, Any]) -> int:
    """Runs the programs; the exit code. Raises InputError, RunError."""
    import tqdm

    programs = options["programs"] or list(PROGRAMS)
    paths = {name: find_program(name) for name in programs}
    folder, values, code = new_folder(options["output"]), BenchValues(), 0
    failures: list[str] = []
    facts: dict[str, Any] = {
        "machine": read_machine(folder),
        "version": hotpath_command.output_of("--version").strip(),
    }
    facts |= {"date": time.strftime("%Y-%m-%dT%H:%M:%S%z"), "programs": programs}
    facts |= {key: options[key] for key in ("quick", "seed")}
    facts["repetitions"] = 1 if options["quick"] else options["repetitions"]
    generator, order = random.Random(options["seed"]), []
    for repetition in range(facts["repetitions"]):
        order += [(name, repetition) for name in generator.sample(programs, len(programs))]
    try:
        with interruptible():
            for name, repetition in tqdm.tqdm(
                order, "benchmark programs", leave=False, disable=not sys.stderr.isatty()
            ):
                output = folder / "raw" / f"{name}-{repetition}.json"
                run = run_hot_path if name == HOT_PATH else run_program
                failures += run(paths[name], output, options, values)
    except Interrupted as signalled:
        code = signalled.exit_code
    if failures and not values.figures:
        raise RunError(failures[0])
    facts |= {"complete": not failures and code == 0, "failures": failures}
    write_json(folder / "bench.json", values.as_json() | facts)
    if not values.figures:
        print("note: Interrupted before anything was measured.", file=sys.stderr)
        return code
    hotpath_command.draw_if_possible("pages.bench_report:write", str(folder))
    print(f"Results: {folder}", flush=True)
    print(*(f"note: {failure}\n" for failure in failures), sep="", end="", file=sys.stderr)
    if failures and code == 0:
        raise RunError(f"{len(failures)} measurements failed; the rest is in {folder}")
    return code


def bench(options: str) -> int:
    """What `hotpath bench` was told, as JSON; the exit code. Raises InputError, RunError."""
    found: dict[str, Any] = json.loads(options)
    return compare(*found["compare"]) if found["compare"] else measure(found)
