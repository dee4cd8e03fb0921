#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Counts the project's lines of code and words of documentation, room by room, and compares them
with ceilings.toml. Ends with exit code 1 above a ceiling. Ceilings only fall: what is added replaces
something."""

import re
import subprocess
import sys
import tomllib
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CODE = re.compile(r"\.(cpp|hpp|h|inc|def|py|ts|css|sh|cmake|idl|j2|toml)$|(^|/)CMakeLists\.txt$")
TEST = re.compile(r"(^|/)test/")


def tracked() -> list[str]:
    """The files of the project that exist."""
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True)
    return [file for file in listed.stdout.splitlines() if (ROOT / file).is_file()]


def room_of(file: str) -> str:
    """A room of bench, or a top-level folder."""
    parts = file.split("/")
    if len(parts) == 1:
        return "top level"
    return "/".join(parts[:2]) if parts[0] == "bench" and len(parts) > 2 else parts[0]


def count() -> Counter[str]:
    """Lines or words by room and for the whole."""
    counts: Counter[str] = Counter()
    for file in tracked():
        if CODE.search(file):
            lines = (ROOT / file).read_bytes().count(b"\n")
            counts["tests" if TEST.search(file) else room_of(file)] += lines
            counts["code outside tests"] += 0 if TEST.search(file) else lines
            counts["all of bench"] += 0 if TEST.search(file) or not file.startswith("bench/") else lines
        elif file.endswith(".md") and not file.startswith("results/") and file != "CHANGELOG.md":
            words = len((ROOT / file).read_text().split())
            counts["words of all pages"] += words
            counts["words of docs and README"] += (
                words if file.startswith("docs/") or file == "README.md" else 0
            )
    return counts


def main() -> int:
    """Prints each room with its ceiling; returns the exit code."""
    ceilings: dict[str, int] = tomllib.loads((ROOT / "tools/ceilings.toml").read_text())
    counts = count()
    above = 0
    for room in sorted(ceilings.keys() | counts.keys(), key=lambda room: (-counts[room], room)):
        ceiling = ceilings.get(room)
        too_many = ceiling is None or counts[room] > ceiling
        above += too_many
        print(f"{counts[room]:7} of {ceiling if ceiling is not None else 'no ceiling':>7}  {room}"
              + ("  ABOVE ITS CEILING" if too_many else ""))  # fmt: skip
    return 1 if above else 0


if __name__ == "__main__":
    sys.exit(main())
