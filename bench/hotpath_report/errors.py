# SPDX-License-Identifier: Apache-2.0
"""What can go wrong without a bug, and what was read until then."""

import contextlib
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any


READ: list[Path] = []  # files that were read so far, the last one last


class InputError(Exception):
    """What the user gave cannot be used; the message says what is wrong and what would be right (exit code 2)."""


class RunError(Exception):
    """Something failed that is not the user's input (exit code 1)."""


class Missing(Exception):
    """There are no data for a figure, a table or a check, which a page then leaves out; never seen by a user."""


class Interrupted(Exception):
    """A signal asked for the end."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.exit_code = 128 + number


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """Meanwhile SIGINT and SIGTERM raise Interrupted."""

    def interrupt(number: int, _frame: Any) -> None:
        raise Interrupted(number)

    handlers = {s: signal.signal(s, interrupt) for s in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
