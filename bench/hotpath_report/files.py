# SPDX-License-Identifier: Apache-2.0
"""Reads and writes documents and the data of a reproduction, with errors that name the file."""

import contextlib
import csv
import errno
import gzip
import io
import json
import os
import stat
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hotpath_report.errors import READ, InputError, RunError
from hotpath_report.hotpath_command import VERSION
from hotpath_report.shown_text import printable, printable_content

NS_PER_MS = 1e6
Rows = list[dict[str, Any]]  # of a table, by column


def check_regular(path: Path) -> None:
    """Raises OSError unless `path` is a regular file: devices and FIFOs may never end."""
    if not stat.S_ISREG(path.stat().st_mode):
        raise OSError(errno.EINVAL, "it is not a regular file")
    READ.append(path)


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


def value_of(field: str) -> Any:
    """A field of a CSV file: a number, a text, or None if it is empty."""
    for kind in (int, float):
        with contextlib.suppress(ValueError):
            return kind(field)
    return printable(field) if field else None


def read_rows(path: Path) -> Rows:
    """A CSV file, compressed if named .gz. Raises InputError."""
    try:
        check_regular(path)
        content = gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
        found = csv.DictReader(io.StringIO(content.decode(), newline=""), restval="", strict=True)
        return [{name: value_of(field) for name, field in row.items()} for row in found]
    except (EOFError, zlib.error, ValueError, csv.Error) as error:
        raise InputError(f"{path}: ends too early, or is damaged: {error}") from None
    except OSError as error:
        raise unreadable(path, error) from None


def csv_text(rows: Rows, columns: Sequence[str] = (), fraction: str = "") -> str:
    """Rows as CSV, by default with all columns. `fraction`: format of the numbers of a column with any fractions."""
    names, stream = columns or list(dict.fromkeys(name for row in rows for name in row)), io.StringIO()
    texts = []
    for name in names:
        values = [None if (v := row.get(name)) != v else v for row in rows]
        whole = all(isinstance(v, (int, str)) for v in values) or not fraction
        texts.append([v if whole or v is None or isinstance(v, str) else fraction % v for v in values])
    csv.writer(stream, lineterminator="\n").writerows([names, *zip(*texts)])
    return stream.getvalue()


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
