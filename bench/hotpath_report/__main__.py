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


def add_commands(commands: Any) -> None:
    """Adds a parser for each command; its default `call` names the function that runs it."""

    def add(name: str, call: str, about: str, **folders: Any) -> argparse.ArgumentParser:
        parser: argparse.ArgumentParser = commands.add_parser(name, help=about, description=about)
        for folder, options in folders.items():
            parser.add_argument(folder, **({"metavar": folder.upper()} | options))
        parser.set_defaults(call=call)
        return parser

    runs = {"metavar": "RUN", "nargs": "+", "help": "run folders, live or simulated"}
    output: Any = {"metavar": "DIR", "help": "output folder (default: the first RUN)"}
    for name, call, about in (
        (
            "hot-path",
            "figures.hot_path:draw_runs",
            "hot-path latency of each executor, for runs of one graph",
        ),
        ("timers-only", "figures.timers:draw_runs", "dropped jobs and response times of timers-only graphs"),
        ("report", "report:write", "page about runs, or about a published reproduction"),
    ):
        add(name, call, about, folders=runs).add_argument("--output", **output)
    add(
        "timeline",
        "trace_events:show",
        "chart or Perfetto trace; OPTIONS: JSON from `hotpath timeline`",
        options={},
    )
    add(
        "validate", "pages.text:tell_validation", "print and draw the result of `hotpath validate`", folder={}
    )
    add("import-page", "pages.text:write_import", "page of `hotpath import ctf`", folder={})
    add("guarantees", "pages.guarantees:write", "page of `hotpath analyze`", folder={})
    add("capacity", "figures.capacity:draw", "levels of `hotpath capacity`", folder={})
    add("sweep", "figures.sweep:draw", "lines and maps of `hotpath sweep`", folder={})
    add("advice", "figures.advice:draw", "predictions of `hotpath advise`", folder={})
    add("waters", "figures.waters:draw", "reduction of end-to-end bounds on WATERS task sets", folder={})
    add(
        "bench",
        "bench_suite:bench",
        "run the benchmark programs; OPTIONS: JSON from `hotpath bench`",
        options={},
    )
    add("bench-report", "pages.bench_report:write", "report of `hotpath bench`", folder={})
    compare = add(
        "compare-results", "comparison.compare:compare_results", "differences beyond noise", old={}, new={}
    )
    compare.add_argument("--csv", metavar="FILE", help="write the table to this file as well")
    compare.add_argument("--gate", action="store_true", help="exit with code 1 if anything became worse")
    compare.add_argument("--across-loads", action="store_true", help="allow runs of different loads")
    for form in ("junit", "markdown"):
        compare.add_argument(f"--{form}", metavar="FILE", help=f"with --gate: write a report as {form}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command. Returns exit code 2 for unusable input and 1 for any other failure; the
    last line on standard error names the problem."""
    with contextlib.redirect_stdout(PrintableStream(sys.stdout)):  # type: ignore[type-var]
        return run(sys.argv[1:] if arguments is None else arguments)


def run(arguments: Sequence[str]) -> int:
    """Runs one command without filtering its output."""
    parser = argparse.ArgumentParser(prog="hotpath_report", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    add_commands(commands)
    commands.add_parser(
        "reproduce", help="reproduce the paper's evaluation; see reproduce --help", add_help=False
    )
    try:
        if arguments[:1] == ["reproduce"]:  # own options and exit codes
            return int(load("paper.reproduce").reproduce(arguments[1:]))
        options = vars(parser.parse_args(arguments))
        options.pop("command")
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
