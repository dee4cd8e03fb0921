# SPDX-License-Identifier: Apache-2.0
"""Calls of the `hotpath` program, which owns all definitions and measures, and of its library for this package
(bench/results/statistics_c.cpp and bench/program/files_c.cpp)."""

import ctypes
import functools
import importlib
import json
import os
import subprocess
from pathlib import Path
from types import ModuleType, SimpleNamespace

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


@functools.cache
def registry() -> dict[str, SimpleNamespace]:
    """Traits of all executors of the C++ registry by name, in its order: those of `hotpath list executors --json`."""
    rows = json.loads(output_of("list", "executors", "--json"))
    return {row["name"]: SimpleNamespace(**row) for row in rows}


def executor_named(name: str) -> SimpleNamespace | None:
    """Traits of an executor by its name in a result, with or without options (`multi:2`)."""
    return registry().get(name.split(":")[0].split("@")[0])


NAME = "libhotpath_python.so"
POINTER, TEXT, SIZE, COUNT = ctypes.c_void_p, ctypes.c_char_p, ctypes.c_size_t, ctypes.c_uint64
REAL, REALS = ctypes.c_double, ctypes.POINTER(ctypes.c_double)
# Result and arguments of each function, without the prefix `hotpath_`.
FUNCTIONS = {
    "samples_new": (POINTER, [POINTER, POINTER, SIZE]),
    "samples_delete": (None, [POINTER]),
    "percent_of": (REAL, [COUNT, COUNT]),
    "quantile_estimates": (None, [POINTER, POINTER, SIZE, POINTER]),
    "quantile_ratio": (None, [POINTER, POINTER, REAL, REALS]),
    "cliffs_delta": (None, [POINTER, POINTER, REALS]),
    "rank_test": (REAL, [POINTER, POINTER]),
    "fit_line": (None, [POINTER, POINTER, POINTER, SIZE, REALS]),
    "write_file": (TEXT, [TEXT, TEXT, SIZE]),
    "write_output": (TEXT, [TEXT, TEXT, TEXT, SIZE]),
    "make_folder": (TEXT, [TEXT]),
    "name_durably": (TEXT, [TEXT, TEXT]),
}


@functools.cache
def library() -> ctypes.CDLL:
    """The library at $HOTPATH_LIBRARY, beside the program, or in ../lib. Raises RunError."""
    folder = program().resolve().parent
    places = [Path(os.environ.get("HOTPATH_LIBRARY", folder / NAME)), folder.parent / "lib" / NAME]
    path = next((p for p in places if p.exists()), None)
    if path is None:
        raise RunError(f"{places[0]} is missing; build it with launch_scripts/build.sh")
    loaded = ctypes.CDLL(str(path))
    for name, (result, arguments) in FUNCTIONS.items():
        function = getattr(loaded, f"hotpath_{name}")
        function.restype, function.argtypes = result, arguments
    return loaded
