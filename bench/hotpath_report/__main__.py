# SPDX-License-Identifier: Apache-2.0
"""Command line of the package. `hotpath` calls it for its figures and pages."""

import contextlib
import os
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path

from hotpath_report.errors import READ, InputError, RunError
from hotpath_report.hotpath_command import load
from hotpath_report.shown_text import PrintableStream, printable

EXIT_FAILED, EXIT_WRONG_USE = 1, 2
LONGEST_MESSAGE = 4000

# The function that runs each command, with the command's arguments.
COMMANDS = {
    "hot-path": "figures.hot_path:draw_run",
    "report": "pages.run_report:write",
    "validate": "pages.text:tell_validation",
    "import-page": "pages.text:write_import",
    "capacity": "pages.sweep_page:write_capacity",
    "sweep": "pages.sweep_page:write",
    "advice": "pages.advice_page:write",
    "bench": "bench_suite:bench",
    "bench-report": "bench_suite:write",
    "comparison": "pages.run_report:write_comparison",
    "reproduce": "paper.reproduce:reproduce",
    "reproduction-items": "paper.reproduce:list_items",
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command. Returns exit code 2 for unusable input and 1 for any other failure; the
    last line on standard error names the problem."""
    command, *words = sys.argv[1:] if arguments is None else arguments
    try:
        module, name = COMMANDS[command].split(":")
        with contextlib.redirect_stdout(PrintableStream(sys.stdout)):  # type: ignore[type-var]
            code = int(getattr(load(module), name)(*words) or 0)
            sys.stdout.flush()
        return code
    except BrokenPipeError:  # the reader closed the pipe
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except (InputError, RunError) as error:
        code, sentence = EXIT_WRONG_USE if isinstance(error, InputError) else EXIT_FAILED, str(error)
    except ImportError as error:
        needs = "Debian's python3-matplotlib, python3-jinja2 and python3-tqdm"
        code, sentence = EXIT_FAILED, f"{error}; it needs {needs}"
    except OSError as error:
        code, sentence = EXIT_FAILED, f"cannot write: {error}"
    except Exception as error:  # pylint: disable=broad-except
        code, sentence = EXIT_FAILED, of_strange_content(error)
    print(f"hotpath: {printable(sentence)[:LONGEST_MESSAGE]}", file=sys.stderr)
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
