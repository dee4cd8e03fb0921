# SPDX-License-Identifier: Apache-2.0
"""The errors that a user can cause."""


class InputError(Exception):
    """What the user gave cannot be used; the message says what is wrong and what would be right (exit code 2)."""


class RunError(Exception):
    """Something failed that is not the user's input (exit code 1)."""
