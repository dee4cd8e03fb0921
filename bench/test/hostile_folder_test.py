# SPDX-License-Identifier: Apache-2.0
"""Commands execute nothing from the current folder or from paths in Python's environment variables.

The test fills the folder with traps: every module that a report or a figure imports, the package
itself, the modules that Python imports at start-up, the program's own libraries, and a
matplotlibrc. Each trap would leave a mark."""

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

from hotpath_command import HOTPATH, CommandTest

BENCH = Path(__file__).resolve().parents[1]  # holds the package
IMPORTED = """
import runpy, sys
sys.argv = sys.argv[1:]
try:
    runpy.run_path(sys.argv[0], run_name="__main__")
finally:
    print(*{name.partition(".")[0] for name in sys.modules}, file=sys.stderr)
"""
AT_START = {"sitecustomize", "usercustomize", "start"}
SHORT = ("--graph", "sequences", "--duration", 2, "--executors", "default,rm-ro")


class HostileFolder(CommandTest):
    def setUp(self) -> None:
        super().setUp()
        self.home, self.mark = self.folder, self.folder / "executed"
        self.accepted("simulate", *SHORT, "--output", self.home / "run")
        del self.environment["HOTPATH_FIGURES"]
        self.folder = self.home / "hostile"  # commands start here from now on
        self.folder.mkdir()
        names = self.imported() | AT_START
        self.assertGreater(len(names), 100)
        code = f"import os\nopen({str(self.mark)!r}, 'a').write(__name__ + ' ' + __file__ + chr(10))\nos._exit(9)\n"
        for name in names:
            (self.folder / f"{name}.py").write_text(code)
        for package in ("hotpath_report", "matplotlib", "numpy", "pandas"):
            (self.folder / package).mkdir()
            for name in ("__init__", "__main__"):
                (self.folder / package / f"{name}.py").write_text(code)
        libraries = subprocess.run(["ldd", HOTPATH], capture_output=True, text=True, check=True).stdout
        for library in re.findall(r"^\s+(\S+\.so\S*) =>", libraries, re.MULTILINE):
            (self.folder / library).write_text("no library")  # the loader would abort the program
        (self.folder / "matplotlibrc").write_text("no_such_key: 1\n")  # matplotlib would complain
        variables = {name: str(self.folder) for name in ("PYTHONPATH", "PYTHONHOME", "MATPLOTLIBRC")}
        self.environment |= variables | {
            "PYTHONSTARTUP": str(self.folder / "start.py"),
            "PYTHONUSERBASE": str(self.home),
        }
        user = self.home / "lib" / "python{}.{}".format(*sys.version_info) / "site-packages"
        user.mkdir(parents=True)
        (user / "usercustomize.py").write_text(code)

    def imported(self) -> set[Any]:
        """The top-level modules that a report imports."""
        words = ["/usr/bin/python3", "-I", "-B", "-c", IMPORTED, str(BENCH), "report", str(self.home / "run")]
        environment = self.environment | {"HOTPATH": HOTPATH}
        done = subprocess.run(words, capture_output=True, text=True, check=True, env=environment)
        return set(done.stderr.split())

    def assert_nothing_executed(self, *arguments: object) -> None:
        code, _, err = self.command(*arguments)
        self.assertFalse(self.mark.exists(), self.mark.exists() and self.mark.read_text())
        self.assertEqual((code, err), (0, ""), arguments)

    def test_no_command_executes_what_lies_in_the_current_folder(self) -> None:
        run = self.home / "run"
        for arguments in (  # one function starts Python for all commands
            ("simulate", *SHORT, "--output", "made"),
            ("report", run),
            ("diff", run, run, "--gate"),
            ("timeline", run, "--svg", "chart.svg", "--perfetto", "chart.json"),
        ):
            with self.subTest(command=arguments[0]):
                self.assert_nothing_executed(*arguments)
