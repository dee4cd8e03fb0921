# SPDX-License-Identifier: Apache-2.0
"""Writes a page as report.html (a single file) and as report.md with figures beside it."""

import base64
import html
import io
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from matplotlib.backends.backend_svg import FigureCanvasSVG

from hotpath_report import style
from hotpath_report.figures.violins import Drawing
from hotpath_report.files import csv_text, make_folder, write_file
from hotpath_report.pages import interactive
from hotpath_report.pages.text import TEMPLATES, render
from hotpath_report.statistics import Estimate, Samples, rank_test, ratio
from hotpath_report.style import FAINT, GRID, GROUND, INK, plt, settle


@dataclass(frozen=True)
class Table:
    """Rows of text."""

    title: str
    header: list[str]
    rows: list[list[Any]]
    folded: bool = False  # collapsed until opened
    numbers: bool = False  # align all columns but the first right


# Header of tables that compare samples with a baseline.
HEADER = ["samples / runs", "median ms", "p99 ms", "worst ms"]
HEADER += ["worst-case ratio", "Cliff's delta", "rank test p"]


def percentile_cells(samples: Samples) -> list[str]:
    """Median, p99 and worst value with intervals."""
    return [samples.estimate(p).text(1) for p in (0.5, 0.99, 1.0)]


def compared(samples: Samples, baseline: Samples | None) -> list[Any]:
    """Cells below HEADER; without a baseline its comparison cells are empty."""
    cells = [f"{len(samples)} / {len(samples.repetitions)}", *percentile_cells(samples)]
    if not baseline:
        return [*cells, "", "", ""]
    test = rank_test(samples, baseline)
    delta = f"{test.cliffs_delta.text(2)} ({test.magnitude})"
    p_value = "< 0.001" if test.p_value < 0.001 else f"{test.p_value:.3f}"
    return [*cells, ratio(baseline, samples, 1.0).text(2), delta, p_value]


def table_of(plot: Mapping[str, Any]) -> Table:
    """The values of a plot of the interactive part with their intervals, with a row for each x."""
    cells: dict[float, list[str]] = {x: [] for x in sorted({x for line in plot["lines"] for x in line["x"]})}
    for line in plot["lines"]:
        points = {x: values for x, *values in zip(line["x"], line["value"], line["low"], line["high"])}
        for x, row in cells.items():
            values = [math.nan if v is None else v for v in points.get(x, [])]
            row.append(Estimate(*values).text(3) if values else "")
    rows = [[f"{x:g}", *row] for x, row in cells.items()]
    header = [plot["x"], *(line["label"] for line in plot["lines"])]
    return Table(plot["title"], header, rows, folded=True, numbers=True)


THEMED = {INK: "var(--ink)", FAINT: "var(--faint)", GRID: "var(--grid)", GROUND: "var(--ground)"}


def _rounded(attribute: re.Match[str]) -> str:
    """Shortens coordinates: a page of many figures shrinks by a third."""
    text = re.sub(r"(\.\d)\d+", r"\1", attribute[0])
    # Without curves, L is the default command after the first point.
    return text if re.search("[CQ]", text) else re.sub(r"\s+L ", " ", text)


@dataclass(frozen=True)
class Figure:
    """A figure with its data."""

    name: str
    title: str
    csv: str
    svg: str

    def data_uri(self) -> str:
        """The data as a link."""
        return "data:text/csv;base64," + base64.b64encode(self.csv.encode()).decode()

    def inline(self) -> str:
        """An <svg> element with the page's colours, scalable, and with unique ids."""
        svg = self.svg[self.svg.index("<svg") :]
        for colour, variable in THEMED.items():
            svg = svg.replace(colour, variable)
        for start in ('id="', "url(#", 'href="#'):
            svg = re.sub(rf"(?<!\w){re.escape(start)}", f"{start}{self.name}-", svg)
        svg = re.sub(r"(?s)<metadata>.*?</metadata>", "", svg)
        svg = re.sub(r' (width|height)="[^"]*"', "", svg, count=2)  # of the <svg> element
        return svg.replace("<svg", f'<svg role="img" aria-label="{html.escape(self.title)}"', 1)


@dataclass
class Section:
    """A part of a page."""

    name: str
    title: str
    subtitle: str
    text: str
    figures: list[Figure] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)  # sentences about the first figure


def make_figure(name: str, title: str, drawing: Drawing) -> Figure:
    """A figure of a page, as SVG with text elements and coordinates rounded to 0.1 points."""
    settle(drawing.figure)
    stream = io.StringIO()
    with plt.rc_context({"svg.fonttype": "none"}):
        # savefig() would draw everything again, although the layout is fixed.
        FigureCanvasSVG(drawing.figure).print_svg(stream, metadata={"Date": None, "Creator": "hotpath"})
    plt.close(drawing.figure)
    svg = re.sub(r'\b(d|x|y)="[^"]*"', _rounded, stream.getvalue())
    return Figure(name, title, csv_text(drawing.table, fraction="%.6f"), svg)


def write_page(
    folder: Path,
    sections: list[Section],
    data: dict[str, Any] | None,
    template: str = "report",
    **content: Any,
) -> None:
    """Renders `template`.j2, which describes the content, as report.html and report.md, with an interactive part that
    shows `data`. Writes each figure on white, for dark Markdown viewers, with its data."""
    make_folder(folder / "figures")
    for figure in (figure for section in sections for figure in section.figures):
        white = '<rect width="100%" height="100%" fill="white"/>\n <defs>'
        write_file(folder / "figures" / f"{figure.name}.svg", figure.svg.replace("<defs>", white, 1))
        write_file(folder / "figures" / f"{figure.name}.csv", figure.csv)
    content["style"] = (TEMPLATES / "style.css").read_text(encoding="utf-8")
    if data:
        content["interactive"] = interactive.embedded(data)
    for suffix in ("html", "md"):
        page = render(template, suffix, {"sections": sections, "losses": [], **content})
        write_file(folder / f"report.{suffix}", page)


def write_with_figure(
    folder: str,
    section: Section,
    draw: Callable[[], Drawing],
    name: str,
    caption: str,
    subtitle: str,
    data: dict[str, Any] | None,
    **content: Any,
) -> None:
    """Draws the figure of a result into its folder, and writes its page, which has that figure and one section."""
    style.save(draw().figure, folder, name, caption, subtitle)
    section.figures.append(make_figure(name, caption, draw()))
    write_page(Path(folder), [section], data, **content)
    print(Path(folder) / "report.html")
