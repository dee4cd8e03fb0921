# SPDX-License-Identifier: Apache-2.0
"""The check for files that a test leaves in /dev/shm."""

import os
import unittest

import shared_memory

NAME = f"hotpath_shared_memory_test_{os.getpid()}"


class SharedMemory(unittest.TestCase):
    def test_a_test_that_leaves_a_file_fails(self) -> None:
        def leave() -> None:
            shared_memory.expect_nothing_left_behind(case)
            (shared_memory.FOLDER / NAME).touch()

        self.addCleanup((shared_memory.FOLDER / NAME).unlink, missing_ok=True)
        case, result = unittest.FunctionTestCase(leave), unittest.TestResult()
        case.run(result)
        self.assertEqual(len(result.failures), 1)
        self.assertIn(NAME, result.failures[0][1])
