# SPDX-License-Identifier: Apache-2.0
"""Kills or stops processes of a run at random instants, HOTPATH_KILLS (default 4) times, and limits
open files.

With HOTPATH_PUBLISH=1, the counts are published as results/reliability/process_faults.json.
"""

import json
import os
import random
import resource
import signal
import time
from pathlib import Path
from typing import Any

from evidence import publish_on_request
from hotpath_command import CommandTest, processes_of

KILLS = int(os.environ.get("HOTPATH_KILLS", "4"))
RUN = ("compare", "--executors", "default,rm-ro", "--repetitions", 2, "--processes", 2, "--network", "shared_memory",
       "--load", 1, "--duration", 0.2, "--warm-up", 0, "--time-out", 1)  # fmt: skip
WHOLE, FAILED, WRONG_USE = 0, 1, 2


def children(process: Any) -> list[Any]:
    """Child processes of the command."""
    try:
        text = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text()
    except OSError:
        return []
    return [int(pid) for pid in text.split()]


class ProcessFaults(CommandTest):
    def hit(self, process: Any, number: int, seconds: float, choice: Any) -> bool:
        """After `seconds`, sends a signal to one of the run's processes. Returns whether there was
        one."""
        time.sleep(seconds)
        while process.poll() is None:
            found = children(process)
            if found:
                try:
                    os.kill(choice(found), number)
                    return True
                except ProcessLookupError:
                    continue
            time.sleep(0.001)
        return False

    def check_end(self, code: int, err: str, output: Path) -> None:
        """Checks for a whole result, or for one error sentence and no result that looks whole;
        stored rows are right."""
        sentences = [line for line in err.splitlines() if line.startswith("hotpath: ")]
        self.assertIn(code, (WHOLE, FAILED, WRONG_USE), err)
        self.assertEqual(len(sentences), code != WHOLE, err)
        for sign in ("terminate called", "what():", "internal error", "Traceback"):
            self.assertNotIn(sign, err)
        file = output / "run.json"
        self.assertEqual(file.exists() and json.loads(file.read_text())["complete"], code == WHOLE, err)
        if not (output / "summary.json").exists():
            return
        run = self.checked(output)
        measured = {(r["executor"], r["repetition"]) for r in run.run["runs"] if not r["failure"]}
        self.assertEqual(set(run.jobs()), measured)
        self.assertTrue(all(e["loss_equations"]["hold"] for e in run.summary()["executors"]), err)

    def test_processes_killed_or_stopped_at_random_instants(self) -> None:
        draw = random.Random(KILLS)
        hits = failed = 0
        for k in range(KILLS):
            number = (signal.SIGKILL, signal.SIGSTOP)[k % 2]
            with self.subTest(k=k, signal=number.name):
                process = self.start(*RUN, "--output", f"run{k}")
                hits += self.hit(process, number, draw.uniform(0, 2), draw.choice)
                code, _, err = self.finish(process)
                self.check_end(code, err, self.folder / f"run{k}")
                self.wait_for(lambda: not processes_of(process.pid), "a process lives on")
                failed += code != WHOLE
        print(f"{hits} processes killed or stopped, {failed} runs failed")
        self.assertGreater(failed, 0)
        publish_on_request("reliability/process_faults.json", {"hits": hits, "failed": failed})

    def test_few_open_files(self) -> None:
        codes = set()
        for files in range(4, 40, 9):
            cases: Any = (["simulate"], ["run", "--time-out", 5])
            for name, *options in cases:
                with self.subTest(command=name, files=files):
                    output = self.folder / f"{name}{files}"
                    code, _, err = self.command(
                        name, "--load", 1, "--duration", 0.2, "--warm-up", 0, *options, "--output", output,
                        preexec_fn=lambda n=files: resource.setrlimit(resource.RLIMIT_NOFILE, (n, n)),
                    )  # fmt: skip
                    self.check_end(code, err, output)
                    codes.add(code)
        self.assertEqual(codes & {WHOLE, FAILED}, {WHOLE, FAILED})
