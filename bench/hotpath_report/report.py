# SPDX-License-Identifier: Apache-2.0
"""`hotpath report`: the page about runs, or about a published reproduction."""

from collections.abc import Sequence
from pathlib import Path

from hotpath_report.errors import InputError
from hotpath_report.pages import run_report
from hotpath_report.paper import results


def write(folders: Sequence[str], output: str | None) -> None:
    """Writes report.html and report.md. Raises InputError."""
    first = Path(folders[0])
    folder = Path(output or first / "report")
    if not ((first / "claims.json").exists() and (first / "data").is_dir()):
        run_report.write(folders, folder)
    elif len(folders) == 1:
        results.write_published(first, folder)
    else:
        raise InputError(f"{first} is a reproduction; give it alone, or compare two with diff")
    print(f"{folder / 'report.html'} (and report.md)")
