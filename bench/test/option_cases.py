# SPDX-License-Identifier: Apache-2.0
"""Checks the effect of every option by comparing a command's results with and without it."""

import dataclasses
import json
import os
import re
import subprocess
import tempfile
import unittest
from pathlib import Path
from typing import Any

from hotpath_command import HOTPATH, TIME_LIMIT_S

TESTS = Path(__file__).parent
# Keys of run.json that describe the call, or the folder in which an import writes its graph.
NOT_ITS_RESULT = {"command", "inputs"}


@dataclasses.dataclass(frozen=True)
class Changes:
    """Words that change the result. `given`: words of both runs. `refused`: the run with the option
    is rejected with this message, since the option's effect is to reject it."""

    words: dict
    given: dict = dataclasses.field(default_factory=dict)
    refused: str = ""


@dataclasses.dataclass(frozen=True)
class Refused:
    """Words that are rejected because the option would be ignored; the message contains `says`."""

    words: dict
    says: str


@dataclasses.dataclass(frozen=True)
class Same:
    """Words that must change nothing, for this reason. `recorded`: run.json still records them."""

    words: dict
    reason: str
    recorded: bool = False


@dataclasses.dataclass(frozen=True)
class Elsewhere:
    """For this reason, another test program covers the option, or no test can show its effect."""

    reason: str
    program: str = ""


def options_of(help_text: str) -> Any:
    """The names of the options that a help text lists; for several names of one option, the first."""
    return re.findall(r"^  (--[a-z0-9-]+)", help_text, re.MULTILINE)


def words_of(arguments: Any) -> Any:
    """A command line. A key without dashes is a positional argument; value True: a flag; None: left
    out."""
    words = []
    for option, value in arguments.items():
        if value is None:
            continue
        words += [option] if option.startswith("-") else []
        words += [] if value is True else [str(value)]
    return words


class OptionTest(unittest.TestCase):
    """Runs commands, each in a new folder, and caches their results."""

    folder: Path
    known: dict[Any, Any]
    environment: dict[str, str]

    @classmethod
    def setUpClass(cls) -> None:
        folder = tempfile.TemporaryDirectory(prefix="hotpath_options_")
        cls.addClassCleanup(folder.cleanup)
        cls.folder, cls.known = Path(folder.name), {}
        cls.environment = dict(os.environ, HOTPATH_FIGURES="none")

    @classmethod
    def run_in(cls, folder: Path, words: Any) -> Any:
        return subprocess.run(
            [HOTPATH, *map(str, words)],
            cwd=folder,
            env=cls.environment,
            capture_output=True,
            text=True,
            timeout=TIME_LIMIT_S,
            check=False,
        )

    def facts_of(self, run: Any) -> dict[Any, Any]:
        """The part of run.json that follows from the options."""
        return {key: value for key, value in run.items() if key not in NOT_ITS_RESULT}

    def outcome(self, command: Any, arguments: Any) -> Any:
        """(exit code, output and files by path, each run.json by path, standard error)"""
        words = tuple(map(str, [*command.split(), *words_of(arguments)]))
        if words not in self.known:
            folder = Path(tempfile.mkdtemp(prefix="result_", dir=self.folder))
            done = self.run_in(folder, words)
            files = {str(f.relative_to(folder)): f for f in sorted(folder.rglob("*")) if f.is_file()}
            runs = {name for name in files if name.endswith("run.json")}
            facts = {name: self.facts_of(json.loads(files[name].read_text())) for name in runs}
            results = {name: files[name].read_bytes() for name in files.keys() - runs}
            self.known[words] = (done.returncode, results | {"": done.stdout}, facts, done.stderr)
        return self.known[words]

    def help_of(self, command: Any) -> Any:
        done = self.run_in(self.folder, [*command.split(), "--help"])
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def check_command(self, command: Any, base: Any, cases: Any) -> None:
        """Checks that every option of the command has an effect."""
        options = options_of(self.help_of(command))
        self.assertEqual(sorted(set(options) - cases.keys()), [], f"{command}: list their effect here")
        self.assertEqual(sorted(cases.keys() - set(options)), [], f"{command} has no such options")
        for option in options:
            with self.subTest(command=command, option=option):
                self.check_option(command, base, option, cases[option])

    def check_option(self, command: Any, base: Any, option: str, case: Any) -> None:
        if isinstance(case, Elsewhere):
            if case.program:
                self.assertIn(f'"{option}"', (TESTS / case.program).read_text())
            return
        self.assertIn(option, case.words)
        if isinstance(case, Refused):
            code, _, _, err = self.outcome(command, base | case.words)
            self.assertEqual(code, 2, err)
            self.assertIn(case.says, err)
            return
        given = base | (case.given if isinstance(case, Changes) else {})
        without, with_it = self.outcome(command, given), self.outcome(command, given | case.words)
        self.assertEqual(without[0], 0, without[3])
        if isinstance(case, Same):
            self.assertEqual(with_it[:2], without[:2], case.reason)
            self.assertEqual(with_it[2] != without[2], case.recorded, f"{option} in run.json")
            return
        if case.refused:
            self.assertEqual(with_it[0], 2, with_it[3])
            self.assertIn(case.refused, with_it[3])
            return
        self.assertEqual(with_it[0], 0, f"{option} ends with an error: {with_it[3]}")
        self.assertTrue(self.differs(without, with_it), f"{option} is ignored")
        if without[2] and command != "advise":  # its runs are those of `simulate`
            self.assertNotEqual(with_it[2], without[2], f"run.json does not record {option}")

    def differs(self, without: Any, with_it: Any) -> bool:
        """Whether the results differ, apart from run.json."""
        return with_it[:2] != without[:2]
