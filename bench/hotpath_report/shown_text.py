# SPDX-License-Identifier: Apache-2.0
"""Untrusted names (graphs, traces, files) in output for people: one function for each medium
removes control characters and markup. Jinja escapes HTML; CSV and JSON are data."""

import re
from typing import Any, TextIO

import markupsafe

# As printable() in C++: control characters, direction overrides, line ends.
CONTROL = re.compile("[\0-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
CONTROL_WITHIN_LINES = re.compile(CONTROL.pattern.replace("\0-\x1f", "\0-\x08\x0b-\x1f"))
# HTML, entities, links and the inline marks of Markdown.
MARKUP = re.compile(r"<(?=[A-Za-z/!?])|&(?=#?\w+;)|[\\`*~]|\](?=[(\[:])")
ENTITIES = {"<": "&lt;", "&": "&amp;"}


def _escaped(match: re.Match[str]) -> str:
    return "".join(f"\\x{byte:02x}" for byte in match[0].encode(errors="surrogateescape"))


def printable(text: str) -> str:
    """Text for one line of a terminal or log."""
    return CONTROL.sub(_escaped, text)


def printable_lines(text: str) -> str:
    """As printable(), but keeps line breaks and tabs."""
    return CONTROL_WITHIN_LINES.sub(_escaped, text)


def printable_content(value: Any) -> Any:
    """Applies printable_lines() to all strings of a JSON document."""
    if isinstance(value, str):
        return printable_lines(value)
    if isinstance(value, list):
        return [printable_content(item) for item in value]
    if isinstance(value, dict):
        return {printable_lines(key): printable_content(item) for key, item in value.items()}
    return value


def markdown(value: Any) -> Any:
    """Literal text within a line of Markdown; text marked as safe stays."""
    if not isinstance(value, str) or isinstance(value, markupsafe.Markup):
        return value
    line = printable(value.replace("\n", " "))
    return markupsafe.Markup(MARKUP.sub(lambda match: ENTITIES.get(match[0], "\\" + match[0]), line))


def markdown_cell(value: Any) -> markupsafe.Markup:
    """Literal text in a table cell."""
    return markupsafe.Markup(str(markdown(value)).replace("\n", " ").replace("|", "\\|"))


def markdown_code(value: Any) -> markupsafe.Markup:
    """A line of a fenced code block."""
    return markupsafe.Markup(printable(str(value)))


class PrintableStream:
    """A text stream that passes its text through printable_lines()."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Writes the filtered text."""
        self._stream.write(printable_lines(text))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)
