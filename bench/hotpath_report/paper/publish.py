# SPDX-License-Identifier: Apache-2.0
"""Publishes a reproduction in a repository, with a README on how it was made."""

import os
import shutil
import sys
from pathlib import Path

from hotpath_report.errors import RunError
from hotpath_report.tables import read_json, write_file

# Without the cells (gigabytes of jobs.csv) and report.html (written by `hotpath report` from these files).
PUBLISHED = ("report.md", "claims.json", "facts.json", "plan.json", "data", "figures")
LEFT_BY_EARLIER_VERSIONS = ("report.html", "report")
LARGEST_MB = 20


def problem_with(output: Path, destination: Path) -> str | None:
    """Why `destination` must stay, or None. Only an earlier publication may be deleted."""
    output, destination = output.resolve(), destination.resolve()
    if destination == output or destination in output.parents or output in destination.parents:
        return f"lies in {output}, or contains it"
    if destination.exists() and not destination.is_dir():
        return "is no folder"
    names = {entry.name for entry in destination.glob("*")}
    if names and not ("claims.json" in names and names <= {*PUBLISHED, *LEFT_BY_EARLIER_VERSIONS}):
        return "holds something other than an earlier publication"
    return None


def publish(output: Path, destination: Path) -> None:
    """Publishes `output` as `destination`, with README.md beside it. Raises RunError."""
    files = (file for name in PUBLISHED for file in (output / name, *(output / name).rglob("*")))
    size = sum(file.stat().st_size for file in files if file.is_file()) / 1e6
    if size > LARGEST_MB:
        raise RunError(f"--publish: {size:.0f} MB exceed the limit of {LARGEST_MB} MB; nothing was copied")

    def others(folder: str, names: list[str]) -> set[str]:
        return set(names).difference(PUBLISHED) if Path(folder) == output else set()

    destination = destination.resolve()
    part, old = (destination.with_name(f".{destination.name}.{os.getpid()}.{end}") for end in ("part", "old"))
    try:
        shutil.copytree(output, part, ignore=others)
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

    readme = destination.parent / "README.md"
    if readme.exists() and "## How `" not in readme.read_text(encoding="utf-8"):
        print(f"{readme} has other content and stays unchanged", file=sys.stderr)
        return
    facts = read_json(destination / "facts.json")
    content = {"facts": facts, "folder": destination.name, "size_mb": size}
    write_file(readme, render("results_readme.md", "md", content))
