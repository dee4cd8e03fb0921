# SPDX-License-Identifier: Apache-2.0
"""`hotpath report`: the page about runs, or about a published reproduction."""

from pathlib import Path

from hotpath_report.errors import InputError
from hotpath_report.pages import run_report
from hotpath_report.paper import results


def write(*words: str) -> None:
    """Writes report.html and report.md about folders, into that of `--output FOLDER` at the end, if it is
    there. Raises InputError."""
    has_output = words[-2:-1] == ("--output",)
    folders, first = words[:-2] if has_output else words, Path(words[0])
    folder = Path(words[-1]) if has_output else first / "report"
    if not ((first / "claims.json").exists() and (first / "data").is_dir()):
        run_report.write(folders, folder)
    elif len(folders) == 1:
        results.write_published(first, folder)
    else:
        raise InputError(f"{first} is a reproduction; give it alone, or compare two with diff")
    print(f"{folder / 'report.html'} (and report.md)")
