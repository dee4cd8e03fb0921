# SPDX-License-Identifier: Apache-2.0
"""Calls of the `hotpath` program, which owns all definitions, measures and statistics."""

import functools
import importlib
import json
import os
import subprocess
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

from hotpath_report.errors import InputError, RunError

PACKAGE = Path(__file__).resolve().parent
# Prefix of a command line: ends the program when this process ends.
ENDS_WITH_US = ("setpriv", "--pdeathsig", "TERM", "--")
WRONG_USE = 2  # exit code of `hotpath` for unusable input
# Of the `hotpath` whose documents this package reads.
VERSION = json.loads((PACKAGE / "schemas" / "common.json").read_text())["$defs"]["version"]["const"]


def program() -> Path:
    """$HOTPATH, which `hotpath` sets, or the program in the build tree."""
    return Path(os.environ.get("HOTPATH", PACKAGE.parents[1] / "build/bench/hotpath")).resolve()


def command(*words: object) -> list[str]:
    """Command line of `hotpath WORDS...`. Raises RunError without the program."""
    if not os.access(program(), os.X_OK):
        raise RunError(f"{program()} cannot be started; build it with launch_scripts/build.sh")
    return [*ENDS_WITH_US, str(program()), *map(str, words)]


def output_of(*words: object) -> str:
    """Standard output of `hotpath WORDS...`. Raises InputError if it rejects its input."""
    done = subprocess.run(command(*words), capture_output=True, text=True, errors="replace", check=False)
    if done.returncode == 0:
        return done.stdout
    sentence = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
    sentence = sentence.removeprefix("hotpath: ")
    raise (InputError if done.returncode == WRONG_USE else RunError)(sentence)


@functools.cache
def feed() -> Any:
    """`hotpath feed`, which answers questions until this process ends."""
    pipes: Any = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    return subprocess.Popen(command("feed"), text=True, start_new_session=True, **pipes)


def ask(*question: object) -> Any:
    """What `hotpath` answers to a question of bench/commands/feed.cpp. Raises InputError if it rejects its input."""
    try:
        print(json.dumps(question), file=feed().stdin, flush=True)
        found = json.loads(feed().stdout.readline())
    except (OSError, ValueError) as error:
        raise RunError(f"`hotpath feed` ended before its answer: {error}") from None
    if found.get("version") != VERSION:
        raise RunError(f"{program()} is not of version {VERSION}, as its Python package; install both again")
    if "error" in found:
        raise (InputError if found["wrong_use"] else RunError)(found["error"])
    return found["answer"]


def load(module: str) -> ModuleType:
    """Imports a module of this package with the package's folder as the current folder: matplotlib
    reads `matplotlibrc` from the current folder when it is imported, and the file in the user's
    folder may come from anywhere."""
    folder = os.open(".", os.O_PATH)
    try:
        os.chdir(PACKAGE)
        return importlib.import_module(f"hotpath_report.{module}")
    finally:
        os.fchdir(folder)
        os.close(folder)


@functools.cache
def registry() -> dict[str, SimpleNamespace]:
    """Traits of all executors of the C++ registry by name, in its order: those of `hotpath list executors --json`."""
    rows = json.loads(output_of("list", "executors", "--json"))
    return {row["name"]: SimpleNamespace(**row) for row in rows}


def executor_named(name: str) -> SimpleNamespace | None:
    """Traits of an executor by its name in a result, with or without options (`multi:2`)."""
    return registry().get(name.split(":")[0].split("@")[0])
