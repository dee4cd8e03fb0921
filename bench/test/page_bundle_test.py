# SPDX-License-Identifier: Apache-2.0
"""The script of the interactive page is made from its sources, small, and of pinned packages."""

import json
import shutil
import subprocess
import unittest

from browser import MISSING, WEB


class Bundle(unittest.TestCase):
    def test_it_is_made_from_its_sources(self) -> None:
        for tool, package in (("tsc", "node-typescript"), ("esbuild", "esbuild")):
            if shutil.which(tool) is None:
                self.skipTest(MISSING.format(package))
        if not (WEB / "node_modules" / "uplot").exists():
            self.skipTest(MISSING.format("uPlot (`npm ci` in bench/hotpath_report/web)"))
        bundle = WEB / "page.js"
        made = bundle.with_name(".page.test.js")
        self.addCleanup(made.unlink, missing_ok=True)
        subprocess.run([WEB / "build.sh", made.name], check=True, capture_output=True)
        self.assertEqual(made.read_bytes(), bundle.read_bytes(), "run bench/hotpath_report/web/build.sh")

    def test_it_is_small_and_pinned(self) -> None:
        self.assertLessEqual((WEB / "page.js").stat().st_size, 150_000)
        package = json.loads((WEB / "package.json").read_text())
        lock = (WEB / "package-lock.json").read_text()
        for name, version in (package["dependencies"] | package["devDependencies"]).items():
            self.assertRegex(version, r"^\d+\.\d+\.\d+$", name)
        self.assertNotIn("resolved", lock)
        self.assertNotIn("://", lock)
