# SPDX-License-Identifier: Apache-2.0
"""Reads and writes CSV and JSON, with errors that name file and line."""

import errno
import gzip
import json
import os
import stat
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from hotpath_report.errors import READ, InputError, RunError
from hotpath_report.hotpath_command import VERSION
from hotpath_report.shown_text import printable, printable_content

NS_PER_MS = 1e6
LONGEST_HEADER = 10_000
NAMES = ("executor", "chain", "task")  # text columns, even if every name is a number


def check_regular(path: Path) -> None:
    """Raises OSError unless `path` is a regular file: devices and FIFOs may never end."""
    if not stat.S_ISREG(path.stat().st_mode):
        raise OSError(errno.EINVAL, "it is not a regular file")
    READ.append(path)


def check_lines(path: Path) -> None:
    """Raises InputError for a first line too long for a header, with which pandas would spend
    hours, and for an incomplete last line, whose missing columns pandas would read as empty."""
    compressed = path.suffix == ".gz"
    with gzip.open(path) if compressed else path.open("rb") as file:
        if len(file.readline(LONGEST_HEADER)) == LONGEST_HEADER:
            raise InputError(f"{path}:1: the header has more than {LONGEST_HEADER} bytes")
        if not compressed and file.seek(0, os.SEEK_END) > 0:
            file.seek(-1, os.SEEK_END)
            if file.read() != b"\n":
                raise InputError(f"{path}: ends too early, within a line")


def unreadable(path: Path, error: OSError, made_by: str = "hotpath") -> InputError:
    """The error for an input file that cannot be read, as bench's C++ words it."""
    remedy = f"give a folder written by `{made_by}`"
    if path.with_name(f"{path.name}.part").exists():
        remedy = "if the run was killed, `hotpath doctor RUN --recover` saves what it has finished"
    if (imported := path.parent / "run" / path.name).exists():
        remedy = f"give {imported.parent}"
    return InputError(f"{path}: cannot be read ({error.strerror or error}); {remedy}")


def read_json(path: Path, made_by: str = "hotpath") -> Any:
    """Content of a JSON file written by the command `made_by`. Raises InputError."""
    try:
        check_regular(path)
        return printable_content(json.loads(path.read_text(encoding="utf-8")))
    except OSError as error:
        raise unreadable(path, error, made_by) from None
    except ValueError as error:
        raise InputError(f"{path}: not valid JSON: {error}") from None
    except RecursionError:
        raise InputError(f"{path}: nested too deep; give a folder written by `{made_by}`") from None


def read_document(path: Path, made_by: str) -> dict[str, Any]:
    """The document for a page (schemas/) that this version's command `made_by` wrote. Raises InputError."""
    document: dict[str, Any] = read_json(path, made_by)
    if document.get("version") != VERSION:
        raise InputError(f"{path}: hotpath {VERSION} did not write it; run `{made_by}` again")
    return document


def read_table(path: Path, columns: Sequence[str] = (), optional: Sequence[str] = ()) -> pd.DataFrame:
    """A CSV file, compressed if named .gz. All `columns` must exist and have a
    value in each row; `optional` columns must exist. Named columns ending in _ns must be numbers.
    Raises InputError."""
    named = [*columns, *optional]
    kinds: Any = dict.fromkeys(NAMES, str) | {name: float for name in named if name.endswith("_ns")}
    try:
        check_regular(path)
        check_lines(path)
        frame = pd.read_csv(path, dtype=kinds, keep_default_na=False, na_values="")
    except (EOFError, zlib.error, ValueError) as error:
        raise InputError(f"{path}: ends too early, or is damaged: {error}") from None
    except OSError as error:
        raise unreadable(path, error) from None
    for name in named:
        if name not in frame:
            raise InputError(f"{path}:1: column `{name}` is missing from the header")
    for name in columns:
        if frame[name].isna().any():
            raise InputError(f"{path}:{frame[name].isna().argmax() + 2}: no `{name}`")
    for name in frame.columns[frame.dtypes == object]:
        shown = {text: printable(text) for text in frame[name].unique() if isinstance(text, str)}
        if any(text != it for text, it in shown.items()):
            frame[name] = frame[name].map(shown)
    return frame


def sync(path: Path) -> None:
    """Waits until the content of a file, or the entries of a folder, are on disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def name_durably(part: Path, path: Path) -> None:
    """Syncs `part`, renames it to `path` and syncs the folder."""
    sync(part)
    os.replace(part, path)
    sync(path.parent)


def write_file(path: Path, content: str | bytes) -> None:
    """Replaces a file, or a link, by a complete new file and syncs it. Raises RunError."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with part.open("xb") as file:
            file.write(content.encode() if isinstance(content, str) else content)
        name_durably(part, path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise RunError(f"{path} cannot be written ({error.strerror})") from None


def make_folder(folder: Path) -> None:
    """Creates a folder with its parents and syncs their entries. Raises InputError."""
    try:
        for missing in [f for f in (*reversed(folder.parents), folder) if not f.is_dir()]:
            missing.mkdir(exist_ok=True)
            sync(missing.parent)
    except OSError as error:
        why = f"cannot be created ({error.strerror}); name another"
        raise InputError(f"--output: the folder {folder} {why}") from None


def write_json(path: Path, value: Any) -> None:
    """Replaces a JSON file."""
    write_file(path, json.dumps(value, indent=1, ensure_ascii=False) + "\n")
