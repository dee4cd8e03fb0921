# SPDX-License-Identifier: Apache-2.0
"""The templates."""

import re
from pathlib import Path
from typing import Any

import jinja2
import markupsafe

from hotpath_report.hotpath_command import draw_if_possible
from hotpath_report.shown_text import markdown, markdown_cell, markdown_code
from hotpath_report.tables import read_json, text_table, write_file

TEMPLATES = Path(__file__).resolve().parent / "templates"


def columns(text: str) -> str:
    """Lines of cells with `|` between, the first the header, as a table."""
    cells = [[c.strip().replace("\\n", "\n") for c in line.split("|")] for line in text.strip().splitlines()]
    return text_table(cells[0], cells[1:]) + "\n"


def code_spans(text: str) -> markupsafe.Markup:
    """`words` of prose as HTML."""
    return markupsafe.Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", str(markupsafe.escape(text))))


def fixed(value: float | None, digits: int) -> str:
    """`-` for what is no number."""
    return "-" if value is None else f"{value:.{digits}f}"


def environment(form: str) -> jinja2.Environment:
    """The templates for a page in html, md or txt. What they are given is escaped for it, unless marked as safe."""
    of_markdown: Any = {"autoescape": True, "finalize": markdown}  # so that macros are marked as safe
    made = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        **(of_markdown if form == "md" else {"autoescape": jinja2.select_autoescape(["html", "html.j2"])}),
    )
    made.filters |= {"cell": markdown_cell, "code": markdown_code}
    made.filters |= {"prose": code_spans, "columns": columns, "fixed": fixed}
    return made


def tell_validation(folder: str) -> None:
    """Prints what `hotpath validate` found, and draws it. Raises InputError."""
    result: dict[str, Any] = read_json(Path(folder) / "validation.json", "hotpath validate")
    print(environment("txt").get_template("validation.txt.j2").render(result), flush=True)
    draw_if_possible("figures.validation:draw", folder)
    print(f"\nResults: {folder}")


def write_import(folder: str) -> None:
    """Writes import.md, the page of `hotpath import ctf`. Raises InputError."""
    result: dict[str, Any] = read_json(Path(folder) / "import.json", "hotpath import ctf")
    page = environment("md").get_template("import.md.j2").render(result)
    write_file(Path(folder) / "import.md", page)
