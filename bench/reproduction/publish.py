# SPDX-License-Identifier: Apache-2.0
"""Copies what a repository should carry of a reproduction, and says how it was made."""

import os
import shutil
import sys
from pathlib import Path

from evidence import BadResults
from page import environment, write_file
from runner import read_json

# Not the cells: their jobs.csv hold every job and take gigabytes.
PUBLISHED = ("report.html", "report.md", "claims.json", "facts.json", "plan.json", "data", "figures")
LARGEST_MB = 20


def size_mb(folder):
    return sum(f.stat().st_size for f in folder.rglob("*") if f.is_file()) / 1e6


def publish(output, destination):
    """Replaces `destination` by the publishable part of `output`, and writes README.md beside it."""
    output, destination = Path(output), Path(destination)
    part = destination.with_name(f".{destination.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    for name in PUBLISHED:
        source = output / name
        if source.is_dir():
            shutil.copytree(source, part / name)
        else:
            shutil.copy2(source, part / name)
    size = size_mb(part)
    if size > LARGEST_MB:
        shutil.rmtree(part)
        raise BadResults(
            f"--publish: {size:.0f} MB are more than the {LARGEST_MB} MB that a repository should carry; nothing was"
            " copied"
        )
    shutil.rmtree(destination, ignore_errors=True)
    os.replace(part, destination)
    facts = read_json(destination / "facts.json")
    template = environment().get_template("results_readme.md.j2")
    write_file(destination.parent / "README.md", template.render(facts=facts, folder=destination.name, size_mb=size))
    print(f"Published {size:.1f} MB to {destination}", file=sys.stderr)
