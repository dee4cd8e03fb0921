# SPDX-License-Identifier: Apache-2.0
"""Figures as SVG that follow the page's theme."""

import html
import io
import re

from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from hotpath_report.style import FAINT, GRID, GROUND, INK, plt, settle

THEMED = {INK: "var(--ink)", FAINT: "var(--faint)", GRID: "var(--grid)", GROUND: "var(--ground)"}


def svg_of(figure: Figure) -> str:
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
