# SPDX-License-Identifier: Apache-2.0
"""Errors that are no bugs, and the files read so far."""

import contextlib
import signal
from collections.abc import Iterator, Sized
from pathlib import Path
from typing import Any


READ: list[Path] = []  # files read so far, the latest last


class InputError(Exception):
    """Unusable user input; the message names the problem and the remedy (exit code 2)."""


class RunError(Exception):
    """A failure that the user's input did not cause (exit code 1)."""


class Missing(Exception):
    """A figure, table or check has no data; the page leaves it out. Never reaches the user."""


def need(*data: Sized) -> None:
    """Raises Missing if any of `data` is empty."""
    if not all(map(len, data)):
        raise Missing


class Interrupted(Exception):
    """A signal interrupted the program."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.exit_code = 128 + number


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """Makes SIGINT and SIGTERM raise Interrupted within the block."""

    def interrupt(number: int, _frame: Any) -> None:
        raise Interrupted(number)

    handlers = {s: signal.signal(s, interrupt) for s in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
