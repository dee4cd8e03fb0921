# SPDX-License-Identifier: Apache-2.0
"""The base of tests of `hotpath import ctf`. HOTPATH_TRACES names another folder of traces
(NAME.tar.xz and truth.json)."""

import os
import shutil
import tarfile
from pathlib import Path
from typing import Any

from hotpath_command import CommandTest, document

SHIPPED = Path(__file__).resolve().parents[2] / "reference_system" / "ros2_reference" / "ctf"
TRACES = Path(os.environ.get("HOTPATH_TRACES", SHIPPED))


class ImportTest(CommandTest):
    def executors(self) -> list[str]:
        """All executors, those of several threads with two."""
        names = [line.split()[0] for line in self.accepted("list", "executors").splitlines() if line]
        return [f"{name}:2" if name.startswith(("multi", "cbg")) else name for name in names]

    def imported(self, trace: Any, *arguments: object) -> tuple[Any, Any]:
        """(content of import.json, output folder) of an import; the folder is beside the trace."""
        output = trace.parent / f"{trace.name}_imported"
        out = self.accepted("import", "ctf", trace, "--output", output, *arguments)
        self.assertIn("Reproduction:", out)
        return document(output / "import.json"), output

    def reimported(self, *plan: object, options: Any = (), name: str = "run") -> tuple[Any, Path, Path]:
        """(content of import.json, the run, folder of the import) of a simulated run that was exported."""
        run, trace, output = (self.folder / f"{name}-{part}" for part in ("run", "trace", "import"))
        for folder in (run, trace, output):
            shutil.rmtree(folder, ignore_errors=True)
        self.accepted("simulate", *plan, "--output", run)
        self.accepted("export", "ctf", run, "--output", trace)
        self.accepted("import", "ctf", trace, "--output", output, *options)
        return document(output / "import.json"), run, output

    def unpacked(self, name: str, shipped: str = "") -> Path:
        """The trace of this name in an archive of the same name, or in a shipped one."""
        with tarfile.open(SHIPPED / f"{shipped}.tar.xz" if shipped else TRACES / f"{name}.tar.xz") as archive:
            archive.extractall(self.folder / "traces")
        return Path(self.folder / "traces" / name)
