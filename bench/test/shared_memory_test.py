# SPDX-License-Identifier: Apache-2.0
"""The check for files in /dev/shm: it finds those of the test's own programs, and no others."""

import os
import subprocess
import sys
import unittest
from pathlib import Path

import shared_memory

NAME = f"hotpath_shared_memory_test_{os.getpid()}"
# Makes the file at the first line of its input, and ends at the second one.
MAKER = f"""
import sys
input()
file = open('/dev/shm/{NAME}', 'w')
print('made', flush=True)
input()
"""
# Reports before and after an unrelated program, started with the wider /dev/shm, has made the file and ended.
BESIDE = f"""
import shared_memory, subprocess, sys
other = subprocess.Popen([sys.executable, '-c', {MAKER!r}], stdin=-1, stdout=-1, text=True)
private, before = shared_memory.make_private(), shared_memory.files()
other.communicate('\\n\\n')
print(private, shared_memory.left_behind(before) & {{{NAME!r}}})
"""


class SharedMemory(unittest.TestCase):
    def test_a_file_of_the_tests_own_programs_is_found_once_nothing_uses_it(self) -> None:
        shared_memory.make_private()
        before = shared_memory.files()
        self.addCleanup((shared_memory.FOLDER / NAME).unlink, missing_ok=True)
        with subprocess.Popen([sys.executable, "-c", MAKER], stdin=-1, stdout=-1, text=True) as maker:
            assert maker.stdin is not None and maker.stdout is not None
            maker.stdin.write("\n")
            maker.stdin.flush()
            self.assertEqual(maker.stdout.readline(), "made\n")
            self.assertNotIn(NAME, shared_memory.left_behind(before))
            maker.communicate("\n")
        self.assertIn(NAME, shared_memory.left_behind(before))

    def test_a_test_that_leaves_a_file_fails(self) -> None:
        def leave() -> None:
            shared_memory.expect_nothing_left_behind(case)
            (shared_memory.FOLDER / NAME).touch()

        self.addCleanup((shared_memory.FOLDER / NAME).unlink, missing_ok=True)
        case, result = unittest.FunctionTestCase(leave), unittest.TestResult()
        case.run(result)
        self.assertEqual(len(result.failures), 1)
        self.assertIn(NAME, result.failures[0][1])

    def test_a_file_of_an_unrelated_program_is_not_found(self) -> None:
        words = [sys.executable, "-B", "-c", BESIDE]
        beside = subprocess.run(words, check=True, capture_output=True, text=True, cwd=Path(__file__).parent)
        self.addCleanup((shared_memory.FOLDER / NAME).unlink, missing_ok=True)
        private, _, found = beside.stdout.strip().partition(" ")
        if private != "True":
            self.skipTest("this process may not have a /dev/shm of its own")
        self.assertEqual(found, "set()")


if __name__ == "__main__":
    unittest.main()
