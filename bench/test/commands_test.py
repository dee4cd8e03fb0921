# SPDX-License-Identifier: Apache-2.0
"""Runs each command once; fast enough for slow builds, such as a build without optimisation."""


from command_uses import ELSEWHERE, USES, commands_of, prepare
from hotpath_command import CommandTest


class Commands(CommandTest):
    def test_each_command_has_a_use(self) -> None:
        self.assertEqual(commands_of(self.accepted("--help")), set(USES) | ELSEWHERE)

    def test_each_command_does_its_work(self) -> None:
        for name, (arguments, result) in USES.items():
            with self.subTest(name):
                prepare(name, self.folder)
                out = self.accepted(name, *arguments)
                self.assertNotIn("Usage: hotpath", out)
                if result and result.startswith(">"):
                    self.assertIn(result[1:], out)
                elif result:
                    self.assertGreater((self.folder / result).stat().st_size, 0)
