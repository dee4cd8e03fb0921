# SPDX-License-Identifier: Apache-2.0
"""Pages from templates."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jinja2
import markupsafe

from hotpath_report.files import read_document, write_file
from hotpath_report.shown_text import markdown, markdown_cell, markdown_code

TEMPLATES = Path(__file__).resolve().parent / "templates"


def columns(text: str) -> str:
    """A table from lines of cells separated by `|`; the first line is the header, whose cells may have two lines.
    Words and the first column align left, numbers right."""
    header, *rows = (
        [cell.strip().replace("\\n", "\n") for cell in line.split("|")] for line in text.strip().splitlines()
    )
    upper, lower = zip(*(cell.rpartition("\n")[::2] for cell in header))
    left = [k == 0 or any(row[k][:1].isalpha() for row in rows) for k in range(len(header))]
    widths = [max(map(len, column)) for column in zip(upper, lower, *rows)]

    def line(row: Sequence[str]) -> str:
        cells = (c.ljust(w) if is_left else c.rjust(w) for c, w, is_left in zip(row, widths, left))
        return "  ".join(cells).rstrip()

    rule = "-" * (sum(widths) + 2 * len(widths) - 2)
    return "\n".join([*([line(upper)] if any(upper) else []), line(lower), rule, *map(line, rows), ""])


def code_spans(text: str) -> markupsafe.Markup:
    """Prose with `code` as HTML."""
    return markupsafe.Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", str(markupsafe.escape(text))))


def fixed(value: float | None, digits: int) -> str:
    """A number with fixed digits; `-` for none."""
    return "-" if value is None else f"{value:.{digits}f}"


def environment(form: str) -> jinja2.Environment:
    """The templates for html, md or txt. Values are escaped for that form unless marked as safe."""
    made = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        autoescape=form != "txt",  # also marks the output of macros as safe
        finalize=markdown if form == "md" else None,
    )
    made.globals |= {"form": form, "end": markupsafe.Markup("\n\n")}
    made.filters |= {"cell": markdown_cell, "code": markdown_code}
    made.filters |= {"prose": code_spans, "columns": columns, "fixed": fixed, "zip": zip}
    return made


def render(template: str, form: str, content: Mapping[str, Any]) -> str:
    """A page in html or md, without repeated empty lines."""
    page = environment(form).get_template(f"{template}.j2").render(content)
    return re.sub(r"\n{3,}", "\n\n", page).strip() + "\n"


def tell_validation(folder: str) -> None:
    """Prints the result of `hotpath diff --simulated` and `paper golden`. Raises InputError."""
    result = read_document(Path(folder) / "validation.json", "hotpath diff --simulated")
    print(environment("txt").get_template("validation.txt.j2").render(result))
    print(f"\nResults: {folder}")


def write_import(folder: str) -> None:
    """Writes import.md, the page of `hotpath import ctf`. Raises InputError."""
    result = read_document(Path(folder) / "import.json", "hotpath import ctf")
    write_file(Path(folder) / "import.md", render("import.md", "md", result))
