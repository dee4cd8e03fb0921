# SPDX-License-Identifier: Apache-2.0
"""CSV and JSON files in and out, with errors that name the file, and the line where there is one."""

import csv
import json
import os
from pathlib import Path
from typing import Any

import pandas as pd

from hotpath_report.errors import InputError

NS_PER_MS = 1e6


def read_json(path: Path, made_by: str = "hotpath") -> Any:
    """Content of a JSON file that a command wrote. Raises InputError."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; give a folder written by `{made_by}`") from None
    except ValueError as error:
        raise InputError(f"{path}: not valid JSON: {error}") from None


def write_file(path: Path, content: str | bytes) -> None:
    """Replaces a file by a whole new one."""
    part = path.with_name(f".{path.name}.part")
    part.write_bytes(content.encode() if isinstance(content, str) else content)
    os.replace(part, path)


def write_json(path: Path, value: Any) -> None:
    """Replaces a JSON file."""
    write_file(path, json.dumps(value, indent=1, ensure_ascii=False) + "\n")


def read_columns(path: Path, columns: list[str]) -> pd.DataFrame:
    """The named columns of a CSV file as text, a field that is empty as an empty text. Raises InputError."""
    try:
        with open(path, newline="", encoding="utf-8") as file:
            header, *rows = csv.reader(file)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from None
    except (ValueError, csv.Error) as error:  # also a file without a header
        raise InputError(f"{path}: not a CSV file in UTF-8: {error}") from None
    missing = [column for column in columns if column not in header]
    if missing:
        raise InputError(f"{path}:1: column `{missing[0]}` is missing from the header")
    for number, row in enumerate(rows, 2):
        if len(row) != len(header):
            raise InputError(f"{path}:{number}: {len(row)} columns instead of {len(header)}")
    return pd.DataFrame(rows, columns=header)[columns]


def milliseconds(texts: pd.Series, path: Path) -> pd.Series:
    """A column of whole nanoseconds in ms; NaN where it is empty. Raises InputError."""
    numbers = pd.to_numeric(texts.where(texts != ""), errors="coerce")
    wrong = texts[numbers.isna() & (texts != "")]
    if len(wrong):
        raise InputError(f"{path}: `{wrong.iloc[0]}` is not a whole number of nanoseconds")
    return numbers / NS_PER_MS
