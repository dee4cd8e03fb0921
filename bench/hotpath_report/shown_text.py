# SPDX-License-Identifier: Apache-2.0
"""Names of others, of graphs, traces and files, in what people read: one function a medium takes from a name what
would command the medium. HTML is escaped by Jinja; CSV and JSON are data."""

import re
from typing import Any, TextIO

import markupsafe

# As printable() of the C++ library: control characters, and what turns the direction of text or ends its line.
CONTROL = re.compile("[\0-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
CONTROL_WITHIN_LINES = re.compile(CONTROL.pattern.replace("\0-\x1f", "\0-\x08\x0b-\x1f"))
# HTML, entities, links, and the marks that Markdown has within a line.
MARKUP = re.compile(r"<(?=[A-Za-z/!?])|&(?=#?\w+;)|[\\`*~]|\](?=[(\[:])")
ENTITIES = {"<": "&lt;", "&": "&amp;"}


def _escaped(match: re.Match[str]) -> str:
    return "".join(f"\\x{byte:02x}" for byte in match[0].encode(errors="surrogateescape"))


def printable(text: str) -> str:
    """For one line of a terminal or a log."""
    return CONTROL.sub(_escaped, text)


def printable_lines(text: str) -> str:
    """The same; lines and tabs stay."""
    return CONTROL_WITHIN_LINES.sub(_escaped, text)


def printable_content(value: Any) -> Any:
    """The same for all texts in the content of a JSON file."""
    if isinstance(value, str):
        return printable_lines(value)
    if isinstance(value, list):
        return [printable_content(item) for item in value]
    if isinstance(value, dict):
        return {printable_lines(key): printable_content(item) for key, item in value.items()}
    return value


def markdown(value: Any) -> Any:
    """A text within a line of Markdown, where it is read as it stands; what is marked as safe stays."""
    if not isinstance(value, str) or isinstance(value, markupsafe.Markup):
        return value
    line = printable(value.replace("\n", " "))
    return markupsafe.Markup(MARKUP.sub(lambda match: ENTITIES.get(match[0], "\\" + match[0]), line))


def markdown_cell(value: Any) -> markupsafe.Markup:
    """The same within a table."""
    return markupsafe.Markup(str(markdown(value)).replace("\n", " ").replace("|", "\\|"))


def markdown_code(value: Any) -> markupsafe.Markup:
    """A line of a fenced block, where nothing but the fence is markup."""
    return markupsafe.Markup(printable(str(value)))


class PrintableStream:
    """A text stream whose readers get printable_lines()."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Writes what is printable of it."""
        self._stream.write(printable_lines(text))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)
