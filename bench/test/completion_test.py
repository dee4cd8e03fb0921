# SPDX-License-Identifier: Apache-2.0
"""Bash completion: the commands and options of --help-all, and the words of options; --help, and the man pages."""

import re
import shlex
import shutil
import subprocess
import unittest
from pathlib import Path

from hotpath_command import COMMAND, HOTPATH, CommandTest, commands_below
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
        return COMMAND.findall(self.accepted(*command, "--help"))

    def test_commands_are_those_of_the_help(self) -> None:
        self.assertEqual(self.completed(""), self.commands())
        self.assertEqual(self.completed("list", ""), self.commands("list"))
        self.assertEqual(self.completed("simu"), ["simulate"])

    def test_options_are_those_of_the_help(self) -> None:
        for command in (("run",), ("diff",), ("paper", "waters"), ("import", "ctf")):
            with self.subTest(command=command):
                offered = set(self.completed(*command, "--"))
                self.assertLessEqual(set(options_of(self.accepted(*command, "--help-all"))), offered)
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
        """At most eighteen commands, and 80 spellings of options in all of them."""
        pages = commands_below()
        self.assertLessEqual(len({command[0] for command in pages}), 18)
        spellings = {"--version"}
        for page in pages.values():
            spellings |= set(re.findall(r"^  (?:-h,)?(--[a-z0-9-]+)", page, re.MULTILINE))
        self.assertGreater(len(spellings), 60)
        self.assertLessEqual(len(spellings), 80)

    def test_help_fits_a_screen(self) -> None:
        """A sentence, one example, and the options that people use; --help-all has them all."""
        for command, whole in commands_below().items():
            page = self.accepted(*command, "--help").splitlines()
            self.assertLessEqual(len(page), 24, page)
            self.assertLessEqual(max(map(len, page)), 100, page)
            self.assertEqual(page[0], whole.splitlines()[0])
            (example,) = [line.split(":")[1].split() for line in page if line.startswith("Example:")]
            self.assertEqual(tuple(example[: len(command) + 1]), ("hotpath", *command))
            self.assertLessEqual(options_of("\n".join(page)), options_of(whole))
            if command in (("graph",), ("simulate",), ("analyze",), ("list", "graphs")):
                self.accepted(*example[1:])
        page = self.accepted("--help").splitlines()
        self.assertLessEqual(len(page), 24)
        self.assertLessEqual(max(map(len, page)), 100)

    def test_man_pages_have_each_option(self) -> None:
        self.accepted("man", self.folder / "man1")
        self.assertIn("hotpath-simulate", (self.folder / "man1" / "hotpath.1").read_text())
        for command, whole in commands_below().items():
            page = self.folder / "man1" / f"hotpath-{'-'.join(command)}.1"
            named = re.findall(r"^\\fB(\S+)\\fR", page.read_text().replace("\\-", "-"), re.MULTILINE)
            self.assertLessEqual(options_of(whole), set(named))
            if shutil.which("groff"):
                done = subprocess.run(["groff", "-man", "-ww", "-z", page], capture_output=True, text=True)
                self.assertEqual((done.returncode, done.stderr), (0, ""))
