# SPDX-License-Identifier: Apache-2.0
"""Command line of the package. `hotpath` calls it for its figures and pages."""

import argparse
import contextlib
import os
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hotpath_report.errors import READ, InputError, RunError
from hotpath_report.hotpath_command import load
from hotpath_report.shown_text import PrintableStream, printable

EXIT_FAILED, EXIT_WRONG_USE = 1, 2
LONGEST_MESSAGE = 4000

Arguments = dict[str, dict[str, Any]]  # of a command: name and options of add_argument()
RUNS: Arguments = {
    "folders": {"metavar": "RUN", "nargs": "+", "help": "run folders, live or simulated"},
    "--output": {"metavar": "DIR", "help": "output folder (default: the first RUN)"},
}
FOLDER: Arguments = {"folder": {"metavar": "FOLDER"}}
OPTIONS: Arguments = {"options": {"metavar": "OPTIONS", "help": "JSON from `hotpath`"}}
# The function that runs each command, what it does, and its arguments.
COMMANDS: dict[str, tuple[str, str, Arguments]] = {
    "hot-path": ("figures.hot_path:draw_run", "hot-path latency of each executor", FOLDER),
    "timers-only": ("figures.timers:draw_run", "dropped jobs and response times of timers", FOLDER),
    "report": ("report:write", "page about runs, or about a published reproduction", RUNS),
    "perfetto": ("perfetto:write", "trace of `hotpath export perfetto`", OPTIONS),
    "validate": ("pages.text:tell_validation", "print `hotpath paper golden`", FOLDER),
    "import-page": ("pages.text:write_import", "page of `hotpath import ctf`", FOLDER),
    "guarantees": ("pages.guarantees:write", "page of `hotpath analyze`", FOLDER),
    "capacity": ("pages.capacity_page:write", "levels and page of `hotpath capacity`", FOLDER),
    "sweep": ("pages.sweep_page:write", "figures and page of `hotpath sweep`", FOLDER),
    "advice": ("pages.advice_page:write", "predictions and page of `hotpath advise`", FOLDER),
    "bench": ("bench_suite:bench", "run the programs of `hotpath bench`", OPTIONS),
    "bench-report": ("pages.bench_report:write", "report of `hotpath bench`", FOLDER),
    "comparison": ("pages.comparison_page:write", "page of `hotpath diff`", FOLDER),
}


def command_parser() -> argparse.ArgumentParser:
    """Parser of all commands; `call` in its result names the function."""
    parser = argparse.ArgumentParser(prog="hotpath_report", description=__doc__)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for name, (call, about, arguments) in COMMANDS.items():
        command = commands.add_parser(name, help=about, description=about)
        command.set_defaults(call=call)
        for argument, options in arguments.items():
            command.add_argument(argument, **options)
    reproduce = "reproduce the paper's evaluation; see reproduce --help"
    commands.add_parser("reproduce", help=reproduce, add_help=False)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command. Returns exit code 2 for unusable input and 1 for any other failure; the
    last line on standard error names the problem."""
    with contextlib.redirect_stdout(PrintableStream(sys.stdout)):  # type: ignore[type-var]
        return run(sys.argv[1:] if arguments is None else arguments)


def run(arguments: Sequence[str]) -> int:
    """Runs one command without filtering its output."""
    try:
        if arguments[:1] == ["reproduce"]:  # own options and exit codes
            return int(load("paper.reproduce").reproduce(arguments[1:]))
        options = vars(command_parser().parse_args(arguments))
        module, name = options.pop("call").split(":")
        code = getattr(load(module), name)(**options) or 0
        sys.stdout.flush()
        return code
    except BrokenPipeError:  # the reader closed the pipe
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except InputError as error:
        code, sentence = EXIT_WRONG_USE, str(error)
    except ImportError as error:
        needs = "Debian's python3-matplotlib, python3-pandas, python3-jinja2 and python3-tqdm"
        code, sentence = EXIT_FAILED, f"{error}; it needs {needs}"
    except RunError as error:
        code, sentence = EXIT_FAILED, str(error)
    except OSError as error:
        code, sentence = EXIT_FAILED, f"cannot write: {error}"
    except Exception as error:  # pylint: disable=broad-except
        code, sentence = EXIT_FAILED, of_strange_content(error)
    print(f"{arguments[0]}: {printable(sentence)[:LONGEST_MESSAGE]}", file=sys.stderr)
    return code


def of_strange_content(error: Exception) -> str:
    """Message for an error that a damaged input file caused, most likely the file read last. Raises
    `error` if no file was read."""
    files = list(dict.fromkeys(map(str, reversed(READ))))
    if not files:
        raise error
    place = traceback.extract_tb(error.__traceback__)[-1]
    why = f"{type(error).__name__} {error} at {Path(place.filename).name}:{place.lineno}"
    more = f" (or {', '.join(files[1:4])})" if len(files) > 1 else ""
    return f"{files[0]}{more} is not as `hotpath` writes it: {why}"


if __name__ == "__main__":
    sys.exit(main())
