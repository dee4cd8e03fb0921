# SPDX-License-Identifier: Apache-2.0
"""Bash completion: the commands and options of --help, and the words of options, as bash completes them."""

import re
import shlex
import subprocess
import unittest
from pathlib import Path
from typing import Any

from hotpath_command import CommandTest
from adverse_use_test import options_of


@unittest.skipUnless(Path("/bin/bash").exists(), "there is no bash")
class Completion(CommandTest):
    script: str

    def setUp(self) -> None:
        super().setUp()
        self.script = self.accepted("completion", "bash")

    def completed(self, *words: str) -> list[str]:
        """What bash offers for the last word; every other word was typed before."""
        typed = " ".join(shlex.quote(w) for w in ("hotpath", *words))
        asked = f'COMP_WORDS=({typed}); COMP_CWORD={len(words)}; _hotpath; printf "%s\\n" "${{COMPREPLY[@]}}"'
        done = subprocess.run(
            ["/bin/bash", "--norc", "-u", "-c", self.script + asked],
            capture_output=True,
            text=True,
            check=True,
            cwd=self.folder,
        )
        self.assertEqual(done.stderr, "")
        return done.stdout.split()

    def commands(self, *command: str) -> list[str]:
        text = self.accepted(*command, "--help").partition("Subcommands:")[2]
        return re.findall(r"^  ([a-z][a-z-]+) ", text, re.MULTILINE)

    def test_commands_are_those_of_the_help(self) -> None:
        self.assertEqual(self.completed(""), self.commands())
        self.assertEqual(self.completed("list", ""), self.commands("list"))
        self.assertEqual(self.completed("simu"), ["simulate"])

    def test_options_are_those_of_the_help(self) -> None:
        nested = [c for c in self.commands() if "SUBCOMMAND" in self.accepted(c, "--help")]
        commands: list[Any] = [(c,) for c in self.commands() if c not in nested]
        commands += [(c, sub) for c in nested for sub in self.commands(c)]
        self.assertGreater(len(commands), 20)
        for command in commands:
            with self.subTest(command=command):
                offered = set(self.completed(*command, "--"))
                listed = set(options_of(self.accepted(*command, "--help")))
                self.assertLessEqual(listed, offered)
                self.assertIn("--help", offered)

    def test_words_of_options(self) -> None:
        self.assertEqual(self.completed("simulate", "--phases", "r"), ["random"])
        self.assertEqual(self.completed("simulate", "--phases", "=", "s"), ["synchronous"])
        self.assertEqual(self.completed("run", "--transport", ""), ["fastdds", "intra_process"])
        self.assertEqual(self.completed("simulate", "--executors", "default,rm-"),
                         ["default,rm-ro", "default,rm-re"])  # fmt: skip
        self.assertEqual(self.completed("simulate", "--duration", ""), [], "a number")

    def test_files(self) -> None:
        (self.folder / "mine.csv").touch()
        self.assertEqual(self.completed("simulate", "--phases-file", "mi"), ["mine.csv"])
        self.assertEqual(self.completed("graph", "mi"), ["mine.csv"])

    def test_other_shells_are_refused(self) -> None:
        code, _, err = self.command("completion", "fish")
        self.assertEqual(code, 2)
        self.assertIn("bash", err)
