# SPDX-License-Identifier: Apache-2.0
"""Makes one system call fail: the command must succeed anyway or end with one clear sentence, and
leave nothing behind.

In a short simulation and a short live run, each kind of call in failing_calls.cpp fails with each
of its errors, at `HOTPATH_FAULTS` places (default 1; 0: all of them). A place is identified by its
innermost callers; its first call fails. A run without a fault collects the places. With
HOTPATH_PUBLISH=1, the counts are published as results/reliability/faults.json.
"""

import array
import errno
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path
from typing import Any

from evidence import publish_on_request
from hotpath_command import HOTPATH, processes_of
from shared_memory import expect_nothing_left_behind

LIBRARY = os.environ.get("FAILING_CALLS", "")
PLACES = int(os.environ.get("HOTPATH_FAULTS", "1"))
TIME_LIMIT_S = 60
NO_PLACES, HASH_BITS = bytes(8 << 16), 48  # of failing_calls.cpp
# Kinds in the order of failing_calls.cpp, with the errors that the system gives; 0: a short write.
KINDS = {
    "malloc": [errno.ENOMEM],
    "fork": [errno.EAGAIN, errno.ENOMEM],
    "mmap": [errno.ENOMEM],
    "open": [errno.EMFILE],
    "fopen": [errno.EMFILE],
    "write": [errno.ENOSPC, errno.EINTR, 0],
    "writev": [errno.ENOSPC],
    "rename": [errno.ENOSPC],
    "fsync": [errno.EIO, errno.ENOSPC],
    "mkdir": [errno.ENOSPC],
    "socketpair": [errno.EMFILE],
    "send": [errno.EINTR, errno.ENOBUFS],
    "recv": [errno.EINTR],
    "ppoll": [errno.EINTR, errno.ENOMEM],
    "waitpid": [errno.EINTR],
    "posix_spawnp": [errno.EAGAIN],
    "pthread_create": [errno.EAGAIN],
    "pthread_mutex_init": [errno.ENOMEM],
    "socket": [errno.EMFILE],
    "bind": [errno.EADDRINUSE],
    "setsockopt": [errno.ENOBUFS],
    "shm_open": [errno.EMFILE],
    "sched_setscheduler": [errno.EPERM],
    "sched_getaffinity": [errno.EINVAL],
    "ftruncate": [errno.ENOSPC],
    "flock": [errno.EWOULDBLOCK],
}
COMMANDS = {
    "simulate": ["simulate", "--executors", "default,rm-ro", "--duration", "0.2", "--warm-up", "0"],
    "run": ["run", "--load", "1", "--duration", "0.1", "--warm-up", "0", "--time-out", "2"],
}


def noted_places(calls: Any) -> tuple[bool, Any]:
    """Reads the file that began as NO_PLACES: whether the call failed, and the places by kind."""
    noted = array.array("Q", calls.read_bytes())
    places: dict[Any, list[Any]] = {kind: [] for kind in KINDS}
    for place in sorted(place for place in noted[1:] if place):
        places[list(KINDS)[(place >> HASH_BITS) - 1]].append(place)
    return noted[0] != 0, places


def kind_of(fault: Any) -> Any:
    """The kind of call that fails."""
    return list(KINDS)[(fault[0] >> HASH_BITS) - 1]


class Run:
    """The command with a fault, in its own session."""

    def __init__(self, folder: Path, arguments: Any, fault: Any = None) -> None:
        calls = folder / "calls"
        calls.write_bytes(NO_PLACES)
        self.output = folder / "run"
        environment = dict(os.environ, LD_PRELOAD=LIBRARY, HOTPATH_CALLS=str(calls))
        # Figures are slow: Python starts only if starting it is the fault, and then cannot draw.
        environment["MPLBACKEND"] = "none"
        if fault and kind_of(fault) != "posix_spawnp":
            environment["HOTPATH_FIGURES"] = "none"
        if fault:
            environment["HOTPATH_FAIL"] = " ".join(map(str, fault))
        process = subprocess.Popen(
            [HOTPATH, *arguments, "--output", self.output],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors="replace", env=environment, cwd=folder,
            start_new_session=True,
        )  # fmt: skip
        try:
            self.errors = process.communicate(timeout=TIME_LIMIT_S)[1]
            self.hung = False
        except subprocess.TimeoutExpired:
            self.hung = True
            os.killpg(process.pid, signal.SIGKILL)
            self.errors = process.communicate()[1]
        self.code = process.returncode
        self.left = self.processes_left(process.pid)
        self.failed, self.places = noted_places(calls)

    @staticmethod
    def processes_left(session: int) -> Any:
        """Processes of the session that still live 10 s after the command has ended; there must be
        none."""
        limit = time.monotonic() + 10
        while (left := processes_of(session)) and time.monotonic() < limit:
            time.sleep(0.05)
        return left

    def facts(self) -> Any:
        file = self.output / "run.json"
        return json.loads(file.read_text()) if file.exists() else {}

    def defect(self) -> str:
        """A description of what is wrong with the command's end; empty: nothing."""
        # Out of memory, Fast DDS and glibc may end a process of the run with an assertion.
        foreign = re.compile(r".*\./src/cpp/rtps/|hotpath: \w+\.c:\d+: .*Assertion")
        lines = [line for line in self.errors.splitlines() if not foreign.match(line)]
        sentences = [line for line in lines if line.startswith("hotpath: ")]
        if self.hung:
            return "it did not end"
        if self.left:
            return f"processes {self.left} live on"
        if self.code not in (0, 1, 2):
            return f"it ended with {self.code}: {self.errors[-300:]}"
        for sign in ("terminate called", "what():", "core dumped", "Traceback", "runtime error"):
            if sign in self.errors:
                return f"it says {sign}: {self.errors[-300:]}"
        if self.code == 0:
            whole = self.facts().get("complete") and (self.output / "summary.json").exists()
            return "" if whole else f"it succeeds without a result: {self.errors[-300:]}"
        if len(sentences) != 1:
            return f"{len(sentences)} sentences: {self.errors[-300:]}"
        if not self.facts().get("complete"):
            return ""
        # With a whole result, printing may still fail; JSON needs memory even for its destruction.
        reported = any(sign in sentences[0] for sign in ("standard output", "is whole"))
        whole = (self.output / "summary.json").exists() and not (self.output / "jobs.csv.part").exists()
        return "" if reported and whole else f"it fails with a result that looks whole: {sentences[0]}"


def some(places: Any) -> Any:
    """A sample of the wanted size."""
    return places if PLACES == 0 else places[:: max(1, len(places) // PLACES)][:PLACES]


class FailingCalls(unittest.TestCase):
    def setUp(self) -> None:
        expect_nothing_left_behind(self)

    def run_with(self, arguments: Any, fault: Any = None) -> tuple[Any, Any]:
        with tempfile.TemporaryDirectory(prefix="hotpath_faults_") as folder:
            run = Run(Path(folder), arguments, fault)
            return run, run.defect()

    def inject(self, name: str) -> None:
        whole, defect = self.run_with(COMMANDS[name])
        self.assertEqual((whole.code, defect), (0, ""), whole.errors)
        faults = [(p, e) for kind, errors in KINDS.items() for p in some(whole.places[kind]) for e in errors]
        injected, defects, begin = 0, 0, time.monotonic()
        for i, fault in enumerate(faults):
            with self.subTest(command=name, kind=kind_of(fault), fault=fault):
                run, defect = self.run_with(COMMANDS[name], fault)
                injected += run.failed
                if defect != "":
                    defects += 1
                    print(f"{name}, {fault}: {defect}", file=sys.stderr)  # at once: the test takes long
                self.assertEqual(defect, "")
            if sys.stderr.isatty():
                left = (time.monotonic() - begin) / (i + 1) * (len(faults) - i - 1)
                print(f"\r{name}: {i + 1} of {len(faults)}, {left:.0f} s left ", end="", file=sys.stderr)
        found = sum(map(len, whole.places.values()))
        print(f"{name}: {injected} faults injected; {found} places", file=sys.stderr)
        if defects == 0:
            publish_on_request("reliability/faults.json", {"places": found, "injected": injected}, name)
        self.assertGreater(injected, 8)

    def test_simulate(self) -> None:
        self.inject("simulate")

    def test_run(self) -> None:
        self.inject("run")
