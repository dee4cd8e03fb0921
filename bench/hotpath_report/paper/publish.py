# SPDX-License-Identifier: Apache-2.0
"""Copies what a repository should carry of a reproduction, and says how it was made."""

import os
import shutil
import sys
from pathlib import Path

from hotpath_report.errors import RunError
from hotpath_report.tables import new_part, read_json, write_file

# Not the cells, whose jobs.csv hold every job and take gigabytes; nor report.html, which `hotpath report` makes from
# what is here.
PUBLISHED = ("report.md", "claims.json", "facts.json", "plan.json", "data", "figures")
LEFT_BY_EARLIER_VERSIONS = ("report.html", "report")
LARGEST_MB = 20


def problem_with(output: Path, destination: Path) -> str | None:
    """Why `destination` must not be replaced, or None. What no earlier publication made is not ours to delete."""
    output, destination = output.resolve(), destination.resolve()
    if destination == output or destination in output.parents or output in destination.parents:
        return f"lies in {output}, or contains it"
    if not destination.exists():
        return None
    if not destination.is_dir():
        return "is no folder"
    names = {entry.name for entry in destination.iterdir()}
    if names and not ("claims.json" in names and names <= {*PUBLISHED, *LEFT_BY_EARLIER_VERSIONS}):
        return "holds something other than an earlier publication"
    return None


def publish(output: Path, destination: Path) -> None:
    """Replaces `destination` by the publishable part of `output`, and writes README.md beside it. Raises RunError."""
    destination = destination.resolve()
    destination.parent.mkdir(parents=True, exist_ok=True)
    part, _ = new_part(destination, Path.mkdir)
    try:
        for name in PUBLISHED:
            if (output / name).is_dir():
                shutil.copytree(output / name, part / name)
            else:
                shutil.copy2(output / name, part / name)
        size = sum(f.stat().st_size for f in part.rglob("*") if f.is_file()) / 1e6
        if size > LARGEST_MB:
            raise RunError(
                f"--publish: {size:.0f} MB are more than the {LARGEST_MB} MB that a repository should carry; nothing"
                " was copied"
            )
        old, _ = new_part(destination, Path.mkdir)
        if destination.exists():
            os.replace(destination, old)
        os.replace(part, destination)
        shutil.rmtree(old, ignore_errors=True)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    write_readme(destination, size)
    print(f"Published {size:.1f} MB to {destination}", file=sys.stderr)


def write_readme(destination: Path, size: float) -> None:
    """README.md beside the publication, unless somebody else's is there; `size` in MB."""
    from hotpath_report.pages.text import environment  # takes a second, which a refusal does not need

    readme, mark = destination.parent / "README.md", "## How `"
    if readme.exists() and mark not in readme.read_text(encoding="utf-8"):
        print(f"{readme} is not ours and stays as it is", file=sys.stderr)
        return
    facts = read_json(destination / "facts.json")
    template = environment("md").get_template("results_readme.md.j2")
    write_file(readme, template.render(facts=facts, folder=destination.name, size_mb=size))
