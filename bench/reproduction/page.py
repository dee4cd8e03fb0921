# SPDX-License-Identifier: Apache-2.0
"""Writes one page twice: report.html, a single file, and report.md with its figures beside it."""

import base64
import csv
import io
import os
import re
from dataclasses import dataclass, field
from pathlib import Path

import jinja2
import markupsafe

from drawing import NARROW, WIDE, for_page, svg_of

TEMPLATES = Path(__file__).resolve().parent / "templates"


@dataclass
class Figure:
    name: str
    title: str
    csv_text: str
    svg: dict  # by "wide" and "narrow"
    commands: list

    def data_uri(self):
        return "data:text/csv;base64," + base64.b64encode(self.csv_text.encode()).decode()

    def inline(self, width):
        return for_page(self.svg[width], f"{self.name}-{width}", self.title)


@dataclass
class Section:
    name: str
    title: str
    subtitle: str
    text: str
    figures: list = field(default_factory=list)
    tables: list = field(default_factory=list)


def csv_text(header, rows):
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return stream.getvalue()


def make_figure(name, title, draw, commands):
    """`draw(width)` gives figure, header and rows, or None; then there is no figure."""
    drawn = draw(WIDE)
    if drawn is None:
        return None
    wide, header, rows = drawn
    narrow = draw(NARROW)[0]
    svg = {"wide": svg_of(wide), "narrow": svg_of(narrow)}
    return Figure(name, title, csv_text(header, rows), svg, commands)


def write_file(path, text):
    part = path.with_name(f".{path.name}.part")
    part.write_text(text, encoding="utf-8")
    os.replace(part, path)


def markdown_cell(text):
    return str(text).replace("|", "\\|").replace("\n", " ")


def code_spans(text):
    """`words` of prose as HTML."""
    return markupsafe.Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", str(markupsafe.escape(text))))


def environment():
    made = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES),
        autoescape=jinja2.select_autoescape(["html"]),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters["cell"] = markdown_cell
    made.filters["prose"] = code_spans
    return made


def write_page(folder, template, **content):
    """Renders `template`.html.j2 and .md.j2, and writes the figures with their data."""
    folder = Path(folder)
    figures = folder / "figures"
    figures.mkdir(parents=True, exist_ok=True)
    for section in content["sections"]:
        for figure in section.figures:
            # On white, because a Markdown viewer may be dark.
            standalone = figure.svg["wide"].replace(
                "<defs>", '<rect width="100%" height="100%" fill="white"/>\n <defs>', 1
            )
            write_file(figures / f"{figure.name}.svg", standalone)
            write_file(figures / f"{figure.name}.csv", figure.csv_text)
    made = environment()
    style = (TEMPLATES / "style.css").read_text(encoding="utf-8")
    for suffix in ("html", "md"):
        text = made.get_template(f"{template}.{suffix}.j2").render(style=style, **content)
        write_file(folder / f"report.{suffix}", text)
