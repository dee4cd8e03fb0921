# SPDX-License-Identifier: Apache-2.0
"""Publishes a reproduction in a repository, with a README on how it was made."""

import os
import shutil
import sys
from pathlib import Path

from hotpath_report.errors import RunError
from hotpath_report.tables import read_json, write_file

# Without the cells (gigabytes of jobs.csv) and report.html (written by `hotpath report` from these
# files).
PUBLISHED = ("report.md", "claims.json", "facts.json", "plan.json", "data", "figures")
LEFT_BY_EARLIER_VERSIONS = ("report.html", "report")
LARGEST_MB = 20


def problem_with(output: Path, destination: Path) -> str | None:
    """Why `destination` must stay, or None. Only an earlier publication may be deleted."""
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
    """Publishes `output` as `destination`, with README.md beside it. Raises RunError."""
    destination = destination.resolve()
    destination.parent.mkdir(parents=True, exist_ok=True)
    part, old = (destination.with_name(f".{destination.name}.{os.getpid()}.{end}") for end in ("part", "old"))
    part.mkdir()
    try:
        for name in PUBLISHED:
            if (output / name).is_dir():
                shutil.copytree(output / name, part / name)
            else:
                shutil.copy2(output / name, part / name)
        size = sum(f.stat().st_size for f in part.rglob("*") if f.is_file()) / 1e6
        if size > LARGEST_MB:
            raise RunError(
                f"--publish: {size:.0f} MB exceed the limit of {LARGEST_MB} MB; nothing was copied"
            )
        if destination.exists():
            os.replace(destination, old)
        os.replace(part, destination)
        shutil.rmtree(old, ignore_errors=True)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    write_readme(destination, size)
    print(f"Published {size:.1f} MB to {destination}", file=sys.stderr)


def write_readme(destination: Path, size: float) -> None:
    """Writes README.md beside the publication unless another one exists; `size` in MB."""
    from hotpath_report.pages.text import render  # takes a second to import; not needed for errors

    readme, mark = destination.parent / "README.md", "## How `"
    if readme.exists() and mark not in readme.read_text(encoding="utf-8"):
        print(f"{readme} has other content and stays unchanged", file=sys.stderr)
        return
    facts = read_json(destination / "facts.json")
    content = {"facts": facts, "folder": destination.name, "size_mb": size}
    write_file(readme, render("results_readme.md", "md", content))
