# SPDX-License-Identifier: Apache-2.0
"""Machine faults during a run: the real-time clock is stepped, or the cgroup's memory runs out."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from hotpath_command import CommandTest, processes_of

STEPPING_CLOCK = os.environ.get("STEPPING_CLOCK", "libstepping_clock.so")
MEMORY = Path("/sys/fs/cgroup/memory")  # cgroup version 1, in which a test may create groups
FAILURE, WRONG_USE = 1, 2
# Allocates memory in processes smaller than those of a run, until the kernel has killed a process
# of the cgroup.
HOG = """
import os, signal, sys, time
children = []
while "oom_kill 0" in open(sys.argv[1]).read():
    children.append(os.fork())
    if children[-1] == 0:
        kept = b"x" * (8 << 20)
        signal.pause()
    time.sleep(0.05)
for child in children:
    os.kill(child, signal.SIGKILL)
"""


class Clock(CommandTest):
    def stepped(self, seconds: float, after: float) -> None:
        self.environment.update(
            LD_PRELOAD=STEPPING_CLOCK, HOTPATH_CLOCK_STEP=str(seconds), HOTPATH_CLOCK_STEP_AFTER=str(after)
        )

    def test_a_step_during_a_live_run_changes_nothing(self) -> None:
        for seconds in (3600, -3600):
            with self.subTest(seconds=seconds):
                self.stepped(seconds, after=1)
                folder = self.folder / f"run{seconds}"
                self.accepted(
                    *("run", "--live", "--processes", 2, "--load", 5),
                    *("--duration", 2, "--warm-up", 0, "--output", folder),
                )
                run = self.checked(folder)
                self.assertTrue(run.run["complete"])
                self.assertTrue(all(e["loss_equations"]["hold"] for e in run.summary()["executors"]))

    def test_the_library_steps_the_clock(self) -> None:
        self.stepped(3600, after=0)
        command = [sys.executable, "-c", "import time; print(time.time(), time.monotonic())"]
        printed = subprocess.run(
            command, env=self.environment, capture_output=True, check=True
        ).stdout.split()
        self.assertGreater(float(printed[0]), time.time() + 3000)
        self.assertLess(float(printed[1]), time.monotonic() + 1)


class Memory(CommandTest):
    def limited(self, mebibytes: int) -> dict[Any, Any]:
        """Options that start a process with this memory limit."""
        group = MEMORY / f"hotpath_test_{os.getpid()}"
        try:
            group.mkdir()
            self.addCleanup(group.rmdir)
            (group / "memory.limit_in_bytes").write_text(str(mebibytes << 20))
        except OSError as error:
            self.skipTest(f"cannot limit memory: no cgroup can be made in {MEMORY} ({error.strerror})")
        self.group = group
        return {"preexec_fn": lambda: (group / "cgroup.procs").write_text(str(os.getpid()))}

    def test_traces_that_would_not_fit_are_refused(self) -> None:
        limit = self.limited(300)
        for command in (
            ("simulate", "--duration", 40000),
            ("run", "--transport", "intra_process", "--duration", 5000),
        ):
            with self.subTest(command=command):
                code, _, err = self.command(*command, "--output", "run", **limit)
                self.assertEqual(code, WRONG_USE, err)
                self.assertRegex(
                    err, r"--duration .* GB of memory, but 0.31 GB are available; take a shorter"
                )
                self.assertFalse((self.folder / "run").exists())

    def test_the_limit_is_reached_during_a_run(self) -> None:
        limit = self.limited(300)
        process = self.start(
            *("compare", "--executors", "default,rm-ro", "--repetitions", 2, "--load", 5, "--duration", 1.5),
            *("--warm-up", 0, "--output", "run"),
            **limit,
        )
        self.addCleanup(lambda: process.poll() is None and process.kill())
        facts = self.folder / "run" / "run.json"
        self.wait_for(lambda: facts.exists() and json.loads(facts.read_text())["runs"], "no repetition ends")
        hog = subprocess.run(
            ["/usr/bin/python3", "-c", HOG, self.group / "memory.oom_control"], check=False, **limit
        )  # fmt: skip
        self.assertEqual(hog.returncode, 0)
        code, _, err = self.finish(process)
        if code == -signal.SIGKILL:  # between two repetitions the command is the only process to kill
            self.accepted("recover", "run")
            self.assertGreater(len(self.checked("run").jobs()), 0)
            return
        self.assertEqual(code, FAILURE, err)
        sentences = [line for line in err.splitlines() if line.startswith("hotpath: ")]
        self.assertEqual(len(sentences), 1, err)
        run = self.checked("run")
        failures = run.run["failures"]  # perhaps several: the next run may start before the memory is free
        self.assertIn(f"{len(failures)} of 4 runs failed", sentences[0])
        self.assertIn("Killed", failures[0])
        self.assertEqual(len(run.jobs()), 4 - len(failures))
        self.wait_for(lambda: not processes_of(process.pid), "a process lives on")
