#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""ranks_test.py CREW_TEST: runs campaigns under mpirun, with ranks that die, stop, or run another build."""

import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from collections.abc import Callable
from pathlib import Path
from typing import Any

MPIRUN = shutil.which("mpirun")
PROGRAM = ""
ARGUMENTS = ["--gtest_also_run_disabled_tests", "--gtest_filter=*SquaresNumbers"]
TIME_LIMIT_S = 60


@unittest.skipUnless(MPIRUN, "no mpirun")
class Ranks(unittest.TestCase):
    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory(prefix="hotpath_ranks_test_")
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def start(self, ranks: int, cells: int, microseconds: int, others: str = "") -> Any:
        """Starts a campaign whose output is in the file `out`; rank 1 may run the program `others`.
        Each rank's process id is in the file pid.RANK."""
        environment = dict(os.environ, CELLS=str(cells), MICROSECONDS=str(microseconds), NAME="squares")
        script = (
            'echo $$ > pid.$OMPI_COMM_WORLD_RANK; p="$0"; '
            '[ $OMPI_COMM_WORLD_RANK = 1 ] && [ -n "$1" ] && p="$1"; shift; exec "$p" "$@"'
        )
        options = ["--allow-run-as-root", "--oversubscribe", "--bind-to", "none", "-n", str(ranks)]
        with open(self.folder / "out", "w") as out, open(self.folder / "err", "w") as err:
            job = subprocess.Popen(
                [str(MPIRUN), *options, "sh", "-c", script, PROGRAM, others, *ARGUMENTS],
                cwd=self.folder, env=environment, stdout=out, stderr=err,
            )  # fmt: skip
        self.addCleanup(job.wait)
        self.addCleanup(job.kill)
        return job

    def text(self, name: str) -> str:
        file = self.folder / name
        return file.read_text() if file.exists() else ""

    def rows(self) -> list[tuple[int, int]]:
        return [(int(c), int(r)) for c, r in re.findall(r"^(\d+) (\d+)$", self.text("out"), re.MULTILINE)]

    def wait_for(self, condition: Callable[[], Any], what: str) -> None:
        end = time.monotonic() + TIME_LIMIT_S
        while not condition():
            self.assertLess(time.monotonic(), end, what + "\n" + self.text("err"))
            time.sleep(0.02)

    def send(self, rank: int, number: int) -> None:
        os.kill(int(self.text(f"pid.{rank}")), number)

    def assert_each_once(self, cells: int) -> None:
        self.assertEqual(sorted(self.rows()), [(cell, cell * cell) for cell in range(cells)])

    def test_ranks_gather_each_cell_once(self) -> None:
        for ranks, cells in ((1, 100), (2, 0), (2, 1), (3, 20_000)):
            with self.subTest(ranks=ranks, cells=cells):
                job = self.start(ranks, cells, 50)
                self.assertEqual(job.wait(TIME_LIMIT_S), 0, self.text("err"))
                self.assert_each_once(cells)

    def test_a_dead_rank_ends_the_job(self) -> None:
        job = self.start(3, 100_000, 1000)
        self.wait_for(lambda: len(self.rows()) > 100, "no rows")
        self.send(1, signal.SIGKILL)
        self.assertNotEqual(job.wait(TIME_LIMIT_S), 0)

    def test_a_stopped_rank_blocks_nobody(self) -> None:
        cells = 4000
        job = self.start(3, cells, 1000)
        self.wait_for(lambda: len(self.rows()) > 100, "no rows")
        self.send(1, signal.SIGSTOP)
        # All cells but those that it has.
        self.wait_for(lambda: len(self.rows()) > cells * 0.75, "the other ranks do not go on")
        self.send(1, signal.SIGCONT)
        self.assertEqual(job.wait(TIME_LIMIT_S), 0, self.text("err"))
        self.assert_each_once(cells)

    def test_a_rank_of_another_build_is_refused(self) -> None:
        other = self.folder / "other"
        shutil.copy(PROGRAM, other)
        with open(other, "ab") as file:
            file.write(b"x")
        job = self.start(2, 1_000_000, 1000, others=str(other))
        self.assertNotEqual(job.wait(TIME_LIMIT_S), 0)
        self.assertIn("rank 1 runs another build of this program", self.text("err") + self.text("out"))


if __name__ == "__main__":
    PROGRAM = sys.argv.pop(1)
    unittest.main()
