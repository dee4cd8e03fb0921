# SPDX-License-Identifier: Apache-2.0
"""Bash completion: the commands and options of --help, and the words of options, as bash completes them."""

import re
import shlex
import subprocess
import unittest
from pathlib import Path

from hotpath_command import HOTPATH, CommandTest, commands_below
from adverse_use_test import options_of

SCRIPT = Path(__file__).resolve().parents[1] / "completion.bash"


@unittest.skipUnless(Path("/bin/bash").exists(), "there is no bash")
class Completion(CommandTest):
    def completed(self, *words: str) -> list[str]:
        """What bash offers for the last word; every other word was typed before."""
        typed = " ".join(shlex.quote(w) for w in ("hotpath", *words))
        asked = f"COMP_WORDS=({typed}); COMP_CWORD={len(words)}; COMP_WORDS[0]={shlex.quote(HOTPATH)}; "
        asked += f'_hotpath {shlex.quote(HOTPATH)}; printf "%s\\n" "${{COMPREPLY[@]}}"'
        line = ["/bin/bash", "--norc", "-u", "-c", f". {shlex.quote(str(SCRIPT))}; {asked}"]
        done = subprocess.run(line, capture_output=True, text=True, check=True, cwd=self.folder)
        self.assertEqual(done.stderr, "")
        return done.stdout.split()

    def commands(self, *command: str) -> list[str]:
        return re.findall(r"^  ([a-z][a-z0-9-]+) ", self.accepted(*command, "--help"), re.MULTILINE)

    def test_commands_are_those_of_the_help(self) -> None:
        self.assertEqual(self.completed(""), self.commands())
        self.assertEqual(self.completed("list", ""), self.commands("list"))
        self.assertEqual(self.completed("simu"), ["simulate"])

    def test_options_are_those_of_the_help(self) -> None:
        for command in (("run",), ("diff",), ("paper", "waters"), ("import", "ctf")):
            with self.subTest(command=command):
                offered = set(self.completed(*command, "--"))
                self.assertLessEqual(set(options_of(self.accepted(*command, "--help"))), offered)
                self.assertIn("--help", offered)

    def test_words_of_options(self) -> None:
        self.assertEqual(self.completed("simulate", "--phases", "r"), ["random"])
        self.assertEqual(self.completed("run", "--transport", ""), ["fastdds", "intra_process"])
        self.assertIn("rm-ro", self.completed("simulate", "--executors", "rm-"))

    def test_files(self) -> None:
        (self.folder / "mine.csv").touch()
        self.assertEqual(self.completed("simulate", "--phases", "mi"), ["mine.csv"])
        self.assertEqual(self.completed("graph", "mi"), ["mine.csv"])


class Size(CommandTest):
    def test_a_person_can_read_the_help(self) -> None:
        """At most eighteen commands, and eighty spellings of options in all of them."""
        pages = commands_below()
        self.assertLessEqual(len({command[0] for command in pages}), 18)
        spellings = {"--version"}
        for page in pages.values():
            spellings |= set(re.findall(r"^  (?:-h,)?(--[a-z0-9-]+)", page, re.MULTILINE))
        self.assertGreater(len(spellings), 60)
        self.assertLessEqual(len(spellings), 80)
