# SPDX-License-Identifier: Apache-2.0
"""Writes a page as report.html (a single file) and as report.md with figures beside it."""

import base64
import html
import io
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import matplotlib.figure
from matplotlib.backends.backend_svg import FigureCanvasSVG

from hotpath_report.figures.violins import Drawing
from hotpath_report.pages import interactive
from hotpath_report.pages.text import TEMPLATES, render
from hotpath_report.statistics import Samples, rank_test, ratio
from hotpath_report.style import FAINT, GRID, GROUND, INK, plt, settle
from hotpath_report.tables import make_folder, write_file


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


THEMED = {INK: "var(--ink)", FAINT: "var(--faint)", GRID: "var(--grid)", GROUND: "var(--ground)"}


def svg_of(figure: matplotlib.figure.Figure) -> str:
    """A figure as SVG with text elements and coordinates rounded to 0.1 points."""
    settle(figure)
    stream = io.StringIO()
    with plt.rc_context({"svg.fonttype": "none"}):
        # savefig() would draw everything again, although the layout is fixed.
        FigureCanvasSVG(figure).print_svg(stream, metadata={"Date": None, "Creator": "hotpath"})
    plt.close(figure)
    return re.sub(r'\b(d|x|y)="[^"]*"', _rounded, stream.getvalue())


def _rounded(attribute: re.Match[str]) -> str:
    """Shortens coordinates: a page of many figures shrinks by a third."""
    text = re.sub(r"(\.\d)\d+", r"\1", attribute[0])
    # Without curves, L is the default command after the first point.
    return text if re.search("[CQ]", text) else re.sub(r"\s+L ", " ", text)


def for_page(svg: str, prefix: str, label: str) -> str:
    """An <svg> element with the page's colours, scalable, and with unique ids."""
    svg = svg[svg.index("<svg") :]
    for colour, variable in THEMED.items():
        svg = svg.replace(colour, variable)
    for pattern, replacement in (
        (r'\bid="', f'id="{prefix}-'),
        (r"url\(#", f"url(#{prefix}-"),
        (r'href="#', f'href="#{prefix}-'),
        (r"(?s)<metadata>.*?</metadata>", ""),
    ):
        svg = re.sub(pattern, replacement, svg)
    svg = re.sub(r' (width|height)="[^"]*"', "", svg, count=2)  # of the <svg> element
    return svg.replace("<svg", f'<svg role="img" aria-label="{html.escape(label)}"', 1)


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
        """The figure as an HTML element."""
        return for_page(self.svg, self.name, self.title)


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


def make_figure(name: str, title: str, draw: Callable[[], Drawing]) -> Figure:
    """Draws a figure of a page."""
    drawing = draw()
    csv = drawing.table.to_csv(index=False, float_format="%.6f")
    return Figure(name, title, csv, svg_of(drawing.figure))


def write_figures(folder: Path, figures: list[Figure]) -> None:
    """Writes each figure on white, for dark Markdown viewers, with its data."""
    make_folder(folder)
    for figure in figures:
        white = '<rect width="100%" height="100%" fill="white"/>\n <defs>'
        write_file(folder / f"{figure.name}.svg", figure.svg.replace("<defs>", white, 1))
        write_file(folder / f"{figure.name}.csv", figure.csv)


def write_page(folder: Path, template: str, sections: list[Section], **content: Any) -> None:
    """Renders `template`.j2 as report.html and report.md; writes figures with their data."""
    write_figures(folder / "figures", [figure for section in sections for figure in section.figures])
    style = (TEMPLATES / "style.css").read_text(encoding="utf-8")
    for suffix in ("html", "md"):
        page = render(template, suffix, {"style": style, "sections": sections, **content})
        write_file(folder / f"report.{suffix}", page)


def write_report(
    folder: Path, sections: list[Section], data: dict[str, Any] | None = None, **content: Any
) -> None:
    """Writes a page with the interactive part that shows `data`; see report.j2 for the content."""
    if data:
        content["interactive"] = interactive.embedded(data)
    write_page(folder, "report", sections, **{"losses": [], **content})
