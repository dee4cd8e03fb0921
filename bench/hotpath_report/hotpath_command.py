# SPDX-License-Identifier: Apache-2.0
"""Calls of the `hotpath` program, which owns all definitions and measures."""

import functools
import importlib
import json
import os
import subprocess
from dataclasses import dataclass, fields
from pathlib import Path
from types import ModuleType

from hotpath_report.errors import InputError, RunError

PACKAGE = Path(__file__).resolve().parent
# Prefix of a command line: ends the program when this process ends.
ENDS_WITH_US = ("setpriv", "--pdeathsig", "TERM", "--")
WRONG_USE = 2  # exit code of `hotpath` for unusable input


def program() -> Path:
    """$HOTPATH, which `hotpath` sets, or the program in the build tree."""
    return Path(os.environ.get("HOTPATH", PACKAGE.parents[1] / "build/bench/hotpath")).resolve()


def output_of(*words: object) -> str:
    """Standard output of `hotpath WORDS...`. Raises InputError if it rejects its input."""
    if not os.access(program(), os.X_OK):
        raise RunError(f"{program()} cannot be started; build it with launch_scripts/build.sh")
    command = [*ENDS_WITH_US, str(program()), *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)
    if done.returncode == 0:
        return done.stdout
    sentence = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
    sentence = sentence.removeprefix("hotpath: ")
    raise (InputError if done.returncode == WRONG_USE else RunError)(sentence)


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


@dataclass(frozen=True)
class Executor:
    """Traits of an executor, from the C++ registry."""

    name: str
    family: str  # as `hotpath list executors --json` names it
    policy: str | None  # of the events queue, if it has one
    colour: str  # #RRGGBB


@functools.cache
def registry() -> dict[str, Executor]:
    """All executors by name, in registry order."""
    keys = [field.name for field in fields(Executor)]
    rows = json.loads(output_of("list", "executors", "--json"))
    return {row["name"]: Executor(*(row[key] for key in keys)) for row in rows}


def executor_named(name: str) -> Executor | None:
    """Traits of an executor by its name in a result, with or without options (`multi:2`)."""
    return registry().get(name.split(":")[0].split("@")[0])
