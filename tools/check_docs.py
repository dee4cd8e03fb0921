#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Reports links in *.md, and functions and files in docs/tour.md, that do not exist."""

import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
MOST_LINES_OF_README = 150
LINK = re.compile(r"\]\(([^)#\s]+)(?:#([^)\s]*))?\)")
HOP = re.compile(r"`([\w:.]+)` \(`([\w/.]+)`\)")


def pages(root: Path) -> list[Path]:
    """README, CONTRIBUTING, docs/ and the README of each folder."""
    return [
        *root.glob("*.md"),
        *root.glob("docs/*.md"),
        *root.glob("*/README.md"),
        *root.glob("*/*/README.md"),
    ]


def anchors(page: Path) -> set[str]:
    """Names of a page's headings in links, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.M)
    return {re.sub(r"[^\w\- ]", "", heading).strip().lower().replace(" ", "-") for heading in headings}


def broken_links(page: Path) -> Iterator[str]:
    """Links to files or headings that do not exist."""
    for target, anchor in LINK.findall(page.read_text(encoding="utf-8")):
        if "://" in target:
            continue
        path = page.parent / target
        if not path.exists():
            yield f"there is no {target}"
        elif anchor and anchor not in anchors(path):
            yield f"{target} has no heading #{anchor}"


def lost_hops(tour: Path, root: Path) -> Iterator[str]:
    """Hops `function` (`file`) whose file does not exist or does not have the function."""
    hops = HOP.findall(tour.read_text(encoding="utf-8"))
    if not hops:
        yield "there is no hop like `function` (`file`)"
    for function, file in hops:
        if not (root / file).exists():
            yield f"there is no {file}"
            continue
        text = (root / file).read_text(encoding="utf-8")
        if not all(re.search(rf"\b{word}\b", text) for word in re.findall(r"\w+", function)):
            yield f"{file} has no {function}"


def complaints(root: Path) -> Iterator[str]:
    """All complaints, a line each."""
    for page in pages(root):
        yield from (f"{page.relative_to(root)}: {what}" for what in broken_links(page))
    yield from (f"docs/tour.md: {what}" for what in lost_hops(root / "docs/tour.md", root))
    lines = len((root / "README.md").read_text(encoding="utf-8").splitlines())
    if lines > MOST_LINES_OF_README:
        yield f"README.md: {lines} lines, at most {MOST_LINES_OF_README}; move what is for later to docs/"


def main() -> int:
    """Exit code 1 when there is a complaint."""
    found = list(complaints(ROOT))
    for complaint in found:
        print(f"check_docs.py: {complaint}", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
