# SPDX-License-Identifier: Apache-2.0
"""Commands of the Python package hotpath_report in the process of a test. A process of their own
takes a second of processor time for imports."""

import contextlib
import io
import os
import subprocess
from pathlib import Path
from typing import Any
from unittest import mock

from hotpath_command import HOTPATH
from hotpath_report.__main__ import main
from hotpath_report.hotpath_command import load

BLANK = '<svg width="1pt" height="1pt" viewBox="0 0 1 1"><defs></defs></svg>'


def call(folder: Path, environment: dict[str, str], *words: object) -> Any:
    """A command of the package in a folder and an environment, like `python3 bench WORDS...`."""
    line, output, errors = [str(word) for word in words], io.StringIO(), io.StringIO()
    with (
        mock.patch.dict(os.environ, {"HOTPATH": HOTPATH} | environment, clear=True),
        contextlib.chdir(folder),
        contextlib.redirect_stdout(output),
        contextlib.redirect_stderr(errors),
    ):
        try:
            code = main(line)
        except SystemExit as end:  # of argparse
            code = int(end.code or 0)
    return subprocess.CompletedProcess(line, code, output.getvalue(), errors.getvalue())


def blank_figure(name: str, title: str, _: Any) -> Any:
    """Instead of make_figure(), which takes most of a page's time."""
    figure = load("pages.writer").Figure
    return figure(name, title, "", BLANK)


def write_report(folder: Path, environment: dict[str, str], *words: object) -> None:
    """`hotpath report WORDS...` with blank figures. Raises AssertionError with its message if it fails."""
    with mock.patch.object(load("pages.run_report"), "make_figure", blank_figure):
        done = call(folder, environment, "report", *words)
    assert done.returncode == 0, done.stderr


def write_advice(folder: Path, environment: dict[str, str], advice: Path) -> None:
    """The page of `hotpath advise`, likewise."""
    with mock.patch.object(load("pages.writer"), "make_figure", blank_figure):
        done = call(folder, environment, "advice", advice)
    assert done.returncode == 0, done.stderr
