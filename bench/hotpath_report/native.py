# SPDX-License-Identifier: Apache-2.0
"""The C++ library of this package: bench/results/statistics_c.cpp and bench/program/files_c.cpp."""

import ctypes
import functools
import os
from pathlib import Path

from hotpath_report import hotpath_command
from hotpath_report.errors import RunError

NAME = "libhotpath_python.so"
POINTER, REAL, SIZE, COUNT = (
    ctypes.c_void_p, ctypes.c_double, ctypes.c_size_t, ctypes.c_uint64
)  # fmt: skip
REALS, TEXT = ctypes.POINTER(ctypes.c_double), ctypes.c_char_p
# Result and arguments of each function, without the prefix `hotpath_`.
FUNCTIONS = {
    "samples_new": (POINTER, [POINTER, POINTER, SIZE]),
    "samples_delete": (None, [POINTER]),
    "percent_of": (REAL, [COUNT, COUNT]),
    "quantile_estimate": (None, [POINTER, REAL, REALS]),
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
    folder = hotpath_command.program().resolve().parent
    places = [Path(os.environ.get("HOTPATH_LIBRARY", folder / NAME)), folder.parent / "lib" / NAME]
    path = next((p for p in places if p.exists()), None)
    if path is None:
        raise RunError(f"{places[0]} is missing; build it with launch_scripts/build.sh")
    loaded = ctypes.CDLL(str(path))
    for name, (result, arguments) in FUNCTIONS.items():
        function = getattr(loaded, f"hotpath_{name}")
        function.restype, function.argtypes = result, arguments
    return loaded
