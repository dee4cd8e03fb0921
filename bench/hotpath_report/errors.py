# SPDX-License-Identifier: Apache-2.0
"""What can go wrong without a bug."""


class InputError(Exception):
    """What the user gave cannot be used; the message says what is wrong and what would be right (exit code 2)."""


class RunError(Exception):
    """Something failed that is not the user's input (exit code 1)."""


class Missing(Exception):
    """There are no data for a figure, a table or a check, which a page then leaves out; never seen by a user."""
