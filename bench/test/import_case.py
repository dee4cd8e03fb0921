# SPDX-License-Identifier: Apache-2.0
"""The base of tests of `hotpath import ctf`. HOTPATH_TRACES names another folder of traces
(NAME.tar.xz and truth.json)."""

import json
import os
import tarfile
from pathlib import Path
from typing import Any

from hotpath_command import CommandTest

SHIPPED = Path(__file__).resolve().parents[2] / "reference_system" / "ros2_reference" / "ctf"
TRACES = Path(os.environ.get("HOTPATH_TRACES", SHIPPED))


class ImportTest(CommandTest):
    def imported(self, trace: Any, *arguments: object) -> tuple[Any, Any]:
        """(content of import.json, output folder) of an import; the folder is beside the trace."""
        output = trace.parent / f"{trace.name}_imported"
        code, out, err = self.command("import", "ctf", trace, "--output", output, *arguments)
        self.assertEqual(code, 0, err)
        self.assertIn("Reproduction:", out)
        return json.loads((output / "import.json").read_text()), output

    def unpacked(self, name: str) -> Any:
        with tarfile.open(TRACES / f"{name}.tar.xz") as archive:
            archive.extractall(self.folder / "traces")
        return self.folder / "traces" / name

    def refused(self, code: int, words: Any, *arguments: object) -> None:
        found, out, err = self.command("import", "ctf", *arguments, "--output", self.folder / "refused")
        self.assertEqual((found, out), (code, ""))
        self.assertEqual(len(err.strip().splitlines()), 1, err)
        self.assertIn(words, err)
