#!/usr/bin/env -S PYTHONPATH=bench /usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Writes the generated blocks of README.md, docs/*.md and the README.md of results/ from results/.

The template numbers.md.j2 has the blocks, each between `<!-- generated: NAME -->` and `<!-- end -->`.
With --check the pages stay as they are; the tool reports blocks that disagree with results/, and
sentences of results/paper/claims.json that the published page lacks.
"""

import csv
import json
import re
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import jinja2

from evidence import ROOT, parser
from hotpath_report.files import write_file

BLOCK = re.compile(r"(<!-- generated: (\w+) -->\n)(.*?)(<!-- end -->)", re.S)


def render(root: Path) -> dict[str, str]:
    """The generated blocks over results/, by name."""

    def text(name: str) -> str:
        return (root / "results" / name).read_text(encoding="utf-8")

    def rows(name: str) -> list[dict[str, str]]:
        return list(csv.DictReader(text(name).splitlines()))

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=lambda value: f"{value:,}" if isinstance(value, int) else value,
    )
    template = environment.get_template("numbers.md.j2")
    page = template.render(text=text, rows=rows, json=lambda name: json.loads(text(name)))
    return {match[2]: match[3] for match in BLOCK.finditer(page)}


def check_blocks(texts: dict[Path, str], blocks: dict[str, str]) -> None:
    """Raises ValueError unless each block is there once, and whole."""
    begun = Counter(name for text in texts.values() for name in re.findall(r"<!-- generated: (\w+)", text))
    whole = Counter(match[2] for text in texts.values() for match in BLOCK.finditer(text))
    for name in sorted(blocks.keys() | begun.keys()):
        if (begun[name], whole[name]) != (1, 1) or name not in blocks:
            wanted = f"{whole[name]} whole blocks `{name}` instead of {int(name in blocks)}"
            raise ValueError(f"README.md, docs/ and results/ hold {wanted}")


def disagreements(root: Path) -> Iterator[str]:
    """Sentences of the claims of results/paper that its page lacks."""
    paper = root / "results/paper"
    claims = json.loads((paper / "claims.json").read_text(encoding="utf-8"))
    page = (paper / "report.md").read_text(encoding="utf-8").replace("\\|", "|")
    parts = page.split("<details>")
    for claim in claims:
        part = next((p for p in parts if p.startswith(f"<summary>{claim['title']}: {claim['verdict']}<")), "")
        row = f"| **{claim['verdict']}** | {claim['title']} | {claim['paper']} |"
        findings = [finding["text"] for finding in claim["findings"].values()]
        for text in (row, claim["quote"], claim["rule"], *findings):
            if text not in (page if text == row else part):
                yield f"results/paper/report.md lacks `{text}` of the claim {claim['claim']}"


def main() -> int:
    """The exit code: 1 when a number does not agree."""
    arguments = parser(__doc__)
    arguments.add_argument("--check", action="store_true", help="change nothing; exit code 1 if they differ")
    arguments.add_argument("--root", type=Path, default=ROOT, help="has README.md, docs/ and results/")
    options = arguments.parse_args()
    wrong = []
    try:
        pages = ("README.md", "docs/*.md", "results/README.md", "results/*/README.md")
        files = [file for page in pages for file in sorted(options.root.glob(page))]
        texts = {file: file.read_text(encoding="utf-8") for file in files}
        blocks = render(options.root)
        check_blocks(texts, blocks)
        for file, text in texts.items():
            changed = [match[2] for match in BLOCK.finditer(text) if match[3] != blocks[match[2]]]
            if changed and options.check:
                where = f"{', '.join(changed)} in {file.relative_to(options.root)}"
                wrong.append(f"{where} disagree with results/; run tools/check_numbers.py")
            elif changed:
                write_file(file, BLOCK.sub(lambda match: match[1] + blocks[match[2]] + match[4], text))
        wrong += [f"{sentence}; publish it again" for sentence in disagreements(options.root)]
    except (OSError, ValueError, KeyError, IndexError, TypeError, jinja2.TemplateError) as error:
        wrong.append(repr(error))
    for sentence in wrong:
        print(f"check_numbers.py: {sentence}", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
