# SPDX-License-Identifier: Apache-2.0
"""The generated numbers of README.md, docs/ and results/ against the data, and the publication of evidence there."""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[3]


class Evidence(unittest.TestCase):
    def test_published_records_keep_their_facts_and_get_their_provenance(self) -> None:
        with tempfile.TemporaryDirectory() as name:
            file = Path(name) / "new" / "facts.json"
            for record in ("one", "two"):
                call = f"evidence.publish({str(file)!r}, {{'count': 1, 'machine': 'of the run'}}, {record!r})"
                command = [sys.executable, "-B", "-c", f"import evidence; {call}"]
                environment = {**os.environ, "PYTHONPATH": str(ROOT / "bench")}
                subprocess.run(command, cwd=ROOT / "tools", env=environment, check=True)
            content = json.loads(file.read_text(encoding="utf-8"))
            self.assertEqual([path.name for path in file.parent.iterdir()], ["facts.json"])
        self.assertEqual(list(content), ["one", "two"])
        for facts in content.values():
            self.assertEqual(facts.keys(), {"machine", "date", "revision", "command", "count"})
            self.assertEqual((facts["machine"], facts["count"]), ("of the run", 1))


class Numbers(unittest.TestCase):
    def test_finds_and_mends_an_outdated_number(self) -> None:
        with tempfile.TemporaryDirectory() as name:
            root = Path(name)
            ignored = shutil.ignore_patterns("traces", "*.svg", "*.png", "*.gz")
            shutil.copytree(ROOT / "results", root / "results", ignore=ignored)
            shutil.copy2(ROOT / "README.md", root)
            (root / "docs").mkdir()
            for page in (ROOT / "docs").glob("*.md"):
                shutil.copy2(page, root / "docs")

            def call(*words: str) -> Any:
                line = ["tools/check_numbers.py", "--root", name, *words]
                return subprocess.run(line, cwd=ROOT, capture_output=True, text=True, check=False)

            readme = root / "README.md"
            before = readme.read_text(encoding="utf-8")
            changed = re.sub(r"(?<=\| `default` \| )[\d.]+", "1.0", before, count=1)
            readme.write_text(changed, encoding="utf-8")
            found = call("--check")
            self.assertEqual(found.returncode, 1)
            self.assertIn("hot_path_table", found.stderr)
            self.assertEqual(call().returncode, 0)
            self.assertEqual(readme.read_text(encoding="utf-8"), before)
            evidence = root / "results/reliability/README.md"
            whole = evidence.read_text(encoding="utf-8")
            evidence.write_text(whole.replace("<!-- generated: soak -->", ""), encoding="utf-8")
            self.assertIn("soak", call("--check").stderr)
            evidence.write_text(whole, encoding="utf-8")
            page = root / "results/paper/report.md"
            changed = re.sub(r"(?<=worst cases )[\d.]+", "1.0", page.read_text(encoding="utf-8"))
            page.write_text(changed, encoding="utf-8")
            found = call("--check")
            self.assertEqual(found.returncode, 1)
            self.assertIn("slowdown", found.stderr)
