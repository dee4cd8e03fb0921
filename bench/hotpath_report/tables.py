# SPDX-License-Identifier: Apache-2.0
"""CSV and JSON files in and out, with errors that name the file, and the line where there is one; tables for a
terminal."""

import errno
import json
import os
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from hotpath_report.errors import InputError

NS_PER_MS = 1e6
NAMES = ("executor", "chain", "task")  # columns that are text even where all names are numbers


def read_json(path: Path, made_by: str = "hotpath") -> Any:
    """Content of a JSON file that a command wrote. Raises InputError."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; give a folder written by `{made_by}`") from None
    except ValueError as error:
        raise InputError(f"{path}: not valid JSON: {error}") from None


def read_table(path: Path, columns: Sequence[str] = (), optional: Sequence[str] = ()) -> pd.DataFrame:
    """A CSV file, compressed where its name says so. It must have all `columns`, with a value in each row, and the
    `optional` ones; of both, those whose names end in _ns are numbers. Raises InputError."""
    named = [*columns, *optional]
    kinds: Any = dict.fromkeys(NAMES, str) | {name: float for name in named if name.endswith("_ns")}
    try:
        frame = pd.read_csv(path, dtype=kinds, keep_default_na=False, na_values="")
    except (EOFError, zlib.error, ValueError) as error:
        raise InputError(f"{path}: ends too early, or is damaged: {error}") from None
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from None
    for name in named:
        if name not in frame:
            raise InputError(f"{path}:1: column `{name}` is missing from the header")
    for name in columns:
        if frame[name].isna().any():
            raise InputError(f"{path}:{frame[name].isna().argmax() + 2}: no `{name}`")
    return frame


def write_file(path: Path, content: str | bytes) -> None:
    """Replaces a file by a whole new one, which is on disk afterwards."""
    part = path.with_name(f".{path.name}.part")
    part.write_bytes(content.encode() if isinstance(content, str) else content)
    name_durably(part, path)


def await_disk(path: Path) -> None:
    """Waits until a file's content, or the names in a folder, would survive a loss of power."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno != errno.EINVAL:  # of a file system that keeps nothing for later
            raise
    finally:
        os.close(descriptor)


def name_durably(part: Path, path: Path) -> None:
    """Gives `part` the name `path` once its content is on disk, and waits until the name is."""
    await_disk(part)
    os.replace(part, path)
    await_disk(path.parent)


def make_folder(folder: Path) -> None:
    """Creates a folder and those above it, and waits until their names are on disk."""
    if not folder.is_dir():
        make_folder(folder.parent)
        folder.mkdir(exist_ok=True)
        await_disk(folder.parent)


def write_json(path: Path, value: Any) -> None:
    """Replaces a JSON file."""
    write_file(path, json.dumps(value, indent=1, ensure_ascii=False) + "\n")


def text_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Columns, of which the first and those with words align left, and numbers right; a line break in a header makes
    two lines."""
    upper, lower = zip(*(text.rpartition("\n")[::2] for text in header))
    left = [k == 0 or any(row[k][:1].isalpha() for row in rows) for k in range(len(header))]
    widths = [max(map(len, column)) for column in zip(upper, lower, *rows)]

    def line(row: Sequence[str]) -> str:
        cells = (c.ljust(w) if is_left else c.rjust(w) for c, w, is_left in zip(row, widths, left))
        return "  ".join(cells).rstrip()

    rule = "-" * (sum(widths) + 2 * len(widths) - 2)
    return "\n".join([*([line(upper)] if any(upper) else []), line(lower), rule, *map(line, rows)])
