# SPDX-License-Identifier: Apache-2.0
"""`hotpath bench`: runs the benchmark programs, a fresh process for each repetition, in seeded random order, into one
folder: bench.json, the programs' own output below raw/, and report.md as specified in bench.toml. bench.json has the
format of Google Benchmark, whose compare.py therefore compares the times of two folders; `hotpath diff` compares the
other values.

Google Benchmark's --benchmark_repetitions would repeat in one process: all repetitions would share
its memory layout, no other program would run between them, and a hang or a signal would lose them
all."""

import contextlib
import json
import math
import os
import random
import re
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from markupsafe import Markup

from hotpath_report import hotpath_command
from hotpath_report.errors import InputError, Interrupted, RunError, interruptible
from hotpath_report.files import Rows, make_folder, read_json, write_file, write_json
from hotpath_report.run import Run
from hotpath_report.statistics import median

HOT_PATH = "hot_path"  # no program, but `hotpath run`
GRACE_S = 5
# They say how it was measured, not what.
MODIFIERS = re.compile(r"/(iterations:|manual_time|min_time:|real_time|repeats:)[^/]*")
Key = tuple[str, str]  # benchmark and metric
SPEC: dict[str, Any] = tomllib.loads(Path(__file__).with_name("bench.toml").read_text(encoding="utf-8"))
FILE = "bench.json"
TIME = "time_ns"
NS = {"ns": 1, "us": 1e3, "ms": 1e6, "s": 1e9}
# Numbers of Google Benchmark's own that are no result.
BOOKKEEPING = "family_index per_family_instance_index repetitions repetition_index threads iterations".split()
BOOKKEEPING += ["real_time", "cpu_time"]
PROGRAMS = ("scheduler", "simulator", "executor", "transport", HOT_PATH)


def three_digits(value: float) -> str:
    """A number with three significant digits, trailing zeros kept, never with an exponent."""
    return "0" if value <= 0 else f"{value:.{max(0, 2 - math.floor(math.log10(value)))}f}"


def values_of(row: dict[str, Any]) -> Iterator[tuple[Key, float]]:
    """Time (ns) and counters of one row of bench.json; units of counters are the endings of their names."""
    benchmark = row["name"]
    yield (benchmark, TIME), row["real_time"] * NS[row["time_unit"]]
    for metric, value in row.items():
        if isinstance(value, (int, float)) and metric not in BOOKKEEPING:
            yield (benchmark, metric), value


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


def execute(words: list[str], log: Path, time_out_s: float) -> str:
    """Runs a program; returns what went wrong, or nothing."""
    command = [*hotpath_command.ENDS_WITH_US, *words]
    environment = {**os.environ, "HOTPATH_FIGURES": "none"}
    with log.open("wb") as file, subprocess.Popen(
        command, stdout=file, stderr=file, env=environment, start_new_session=True
    ) as process:
        try:
            status = process.wait(time_out_s)
        except (subprocess.TimeoutExpired, Interrupted) as error:
            process.terminate()  # `hotpath run` ends its processes and removes Fast DDS's files
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(GRACE_S)
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            if isinstance(error, Interrupted):
                raise
            return "did not end in time; see --time-out"
    how = f"ended with exit code {status}" if status > 0 else f"was ended by signal {-status}"
    return "" if status == 0 else f"failed: it {how}; see its .txt in raw/"


def run_program(program: Path, output: Path, options: dict[str, Any], rows: Rows) -> list[str]:
    """Adds one repetition of a benchmark program; returns what failed."""
    words = [str(program), f"--benchmark_out={output}", "--benchmark_out_format=json"]
    words += ["--benchmark_enable_random_interleaving=true", *(["--quick"] if options["quick"] else [])]
    if failure := execute(words, output.with_suffix(".txt"), options["time_out_s"]):
        return [f"bench_{output.stem} {failure}"]
    try:
        found: Rows = read_json(output)["benchmarks"]
        failed = [row for row in found if row.get("error_occurred")]
        # compare.py compares rows of equal names, also of runs that measured for another time.
        measured = [row | {"name": MODIFIERS.sub("", row["run_name"])} for row in found if row not in failed]
        for row in measured:
            dict(values_of(row))
    except (InputError, KeyError, TypeError, AttributeError) as error:
        return [f"{output}: not written by Google Benchmark: {error!r}"]
    rows += measured
    return [f"{row['run_name']}: {row.get('error_message', '')}" for row in failed]


def run_hot_path(program: Path, output: Path, options: dict[str, Any], rows: Rows) -> list[str]:
    """Adds the CPU time of a callback of the reference system's graph without work; returns what failed."""
    folder = output.with_suffix("")
    words = [str(program), "run", "--repetitions", "1", "--load", "0", "--warm-up", "0.3"]
    words += ["--duration", "0.7" if options["quick"] else "2", "--output", str(folder)]
    if failure := execute(words, folder.with_suffix(".txt"), options["time_out_s"]):
        return [f"{folder.name} {failure}"]
    for executor in Run(folder).summary():
        name = f"callback/executor:{executor['executor']}/transport:fastdds"
        times = dict.fromkeys(("real_time", "cpu_time"), executor["cpu_per_callback_us"])
        row = {"name": name, "run_name": name, "run_type": "iteration", "iterations": 1}
        rows.append(row | times | {"time_unit": "us"})
    return []


def read_machine(folder: Path) -> dict[str, Any]:
    """What `hotpath doctor` says, which notes on standard error what may disturb a measurement."""
    path = folder / "machine.json"
    command = hotpath_command.command("doctor", "--duration", "0.2", "--output", path)
    if subprocess.run(command, stdout=subprocess.DEVNULL, check=False).returncode:
        raise RunError("`hotpath doctor` failed")
    machine: dict[str, Any] = read_json(path)
    path.unlink()
    return machine


class Bench:
    """bench.json: for each benchmark and metric one value per repetition, and their median."""

    def __init__(self, folder: str | Path) -> None:
        path = Path(folder) / FILE
        content: Any = read_json(path, "hotpath bench")
        self.values: dict[Key, list[float]] = {}
        try:
            self.facts: dict[str, Any] = content["context"]
            self.machine: dict[str, Any] = self.facts["machine"]
            for key, value in (found for row in content["benchmarks"] for found in values_of(row)):
                self.values.setdefault(key, []).append(value)
        except (KeyError, TypeError, AttributeError) as error:
            raise InputError(f"{path}: not written by `hotpath bench`: {error!r}") from None
        if not self.values:
            raise InputError(f"{path}: no measurements, there is nothing to report")
        self.medians = {key: median(values) for key, values in self.values.items()}
        self.partial = self.facts.get("complete") is not True  # some measurements are missing

    def bars(self) -> Iterator[list[Any]]:
        """The rows of bench.toml that were measured: what, value, bar (an upper limit) and verdict."""
        for what, benchmark, metric, over, *bar in SPEC["bars"]:
            name = metric.removeprefix("1 / ")
            found = [
                v for (key, of), v in self.medians.items() if of == name and re.fullmatch(benchmark, key)
            ]
            if isinstance(over, str):
                yardstick = self.medians.get((over, name)) or self.medians.get((over, TIME))
                over = 1 / yardstick if yardstick else 0
            if found and over:
                value = over / max(found) if metric != name else max(found) * over
                verdicts = ["met" if value <= limit else Markup("**not met**") for limit in bar]
                yield [what, three_digits(value), *(bar + verdicts or ["", ""])]


def write(folder: str) -> None:
    """Writes report.md. Raises InputError."""
    from hotpath_report.pages.text import render  # not needed to measure

    bench, path = Bench(folder), Path(folder) / "report.md"
    write_file(path, render("bench.md", "md", {"bench": bench, "bars": list(bench.bars())}))
    print(path)


def bench(options: str) -> int:
    """Runs what `hotpath bench` was told, as JSON; the exit code. Raises InputError, RunError."""
    import tqdm

    told: dict[str, Any] = json.loads(options)
    programs = told["programs"] or list(PROGRAMS)
    paths = {name: find_program(name) for name in programs}
    folder, code = Path(told["output"] or time.strftime("runs/%Y%m%d-%H%M%S-bench")), 0
    make_folder(folder / "raw")
    rows: Rows = []
    failures: list[str] = []
    version = hotpath_command.output_of("--version").strip()
    facts: dict[str, Any] = {"machine": read_machine(folder), "version": version}
    facts |= {"date": time.strftime("%Y-%m-%dT%H:%M:%S%z"), "programs": programs}
    facts |= {key: told[key] for key in ("quick", "seed")}
    facts["repetitions"] = 1 if told["quick"] else told["repetitions"]
    generator, order = random.Random(told["seed"]), []
    for repetition in range(facts["repetitions"]):
        order += [(name, repetition) for name in generator.sample(programs, len(programs))]
    try:
        with interruptible():
            hidden = not sys.stderr.isatty()
            for name, repetition in tqdm.tqdm(order, "benchmark programs", leave=False, disable=hidden):
                output = folder / "raw" / f"{name}-{repetition}.json"
                run = run_hot_path if name == HOT_PATH else run_program
                failures += run(paths[name], output, told, rows)
    except Interrupted as signalled:
        code = signalled.exit_code
    if failures and not rows:
        raise RunError(failures[0])
    facts |= {"complete": not failures and code == 0, "failures": failures}
    write_json(folder / FILE, {"context": facts, "benchmarks": rows})
    if not rows:
        print("note: Interrupted before anything was measured.", file=sys.stderr)
        return code
    if os.environ.get("HOTPATH_FIGURES") != "none":
        write(str(folder))
    print(f"Results: {folder}", flush=True)
    print(*(f"note: {failure}\n" for failure in failures), sep="", end="", file=sys.stderr)
    if failures and code == 0:
        raise RunError(f"{len(failures)} measurements failed; the rest is in {folder}")
    return code
