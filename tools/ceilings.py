#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Counts the lines of code of each room and the words of documentation, and compares them with the
ceilings in pyproject.toml, which only fall. Ends with exit code 1 above a ceiling."""

import re
import subprocess
import sys
import tomllib
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CODE = re.compile(r"\.(cpp|hpp|h|inc|def|py|ts|css|sh|cmake|idl|j2|toml)$|(^|/)CMakeLists\.txt$")

ceilings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hotpath"]["ceilings"]
counts: Counter[str] = Counter()
listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True)
for file in map(Path, listed.stdout.splitlines()):
    if not (ROOT / file).is_file():
        continue
    if CODE.search(str(file)):
        in_bench = file.parts[0] == "bench" and len(file.parts) > 2
        room = "/".join(file.parts[:2]) if in_bench else file.parts[0]
        whole = ["tests"] if "test" in file.parts else [room, "code"] + ["all of bench"] * in_bench
        counts.update(dict.fromkeys(whole, (ROOT / file).read_bytes().count(b"\n")))
    elif file.suffix == ".md" and file.parts[0] != "results" and file.name != "CHANGELOG.md":
        pages = ["words"] + ["words of docs"] * (file.parts[0] == "docs" or str(file) == "README.md")
        counts.update(dict.fromkeys(pages, len((ROOT / file).read_text().split())))
above = [room for room, lines in counts.items() if lines > ceilings.get(room, 0)]
for room, lines in counts.most_common():
    print(f"{lines:6} of {ceilings.get(room, 0):6}  {room}" + (room in above) * "  <- above its ceiling")
sys.exit(bool(above))
