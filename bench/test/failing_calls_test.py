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
import shutil
import subprocess
import sys
from typing import Any

from evidence import publish_on_request
from hotpath_command import CommandTest, processes_of, sentences

LIBRARY = os.environ.get("FAILING_CALLS", "")
PLACES = int(os.environ.get("HOTPATH_FAULTS", "1"))
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
MEASURED = "default,rm-ro" if PLACES else "paper"  # the paper's others add 34 places, all of malloc
COMMANDS = {
    "simulate": "simulate --executors default,rm-ro --duration 0.2 --warm-up 0".split(),
    "run": f"run --executors {MEASURED} --repetitions 1 --load 1 --duration 0.1 --warm-up 0 --time-out 2".split(),
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


def some(places: Any) -> Any:
    """A sample of the wanted size."""
    return places if PLACES == 0 else places[:: max(1, len(places) // PLACES)][:PLACES]


class FailingCalls(CommandTest):
    def run_with(self, arguments: Any, fault: Any = None) -> tuple[bool, Any]:
        """(whether the call failed, places by kind) of the command with a fault, which must end well."""
        calls = self.folder / "calls"
        calls.write_bytes(NO_PLACES)
        shutil.rmtree(self.folder / "run", ignore_errors=True)
        # Figures are slow: Python starts only if starting it is the fault, and then cannot draw.
        self.environment = dict(os.environ, LD_PRELOAD=LIBRARY, HOTPATH_CALLS=str(calls), MPLBACKEND="none")
        if fault:
            self.environment["HOTPATH_FAIL"] = " ".join(map(str, fault))
            if kind_of(fault) != "posix_spawnp":
                self.environment["HOTPATH_FIGURES"] = "none"
        process = self.start(*arguments, "--output", "run", stdout=subprocess.DEVNULL, errors="replace")
        code, _, errors = self.finish(process)
        self.wait_for(lambda: not processes_of(process.pid), "a process lives on")
        self.assertEqual(self.defect(code, errors), "")
        self.assertTrue(fault or code == 0, errors)
        return noted_places(calls)

    def defect(self, code: int, errors: str) -> str:
        """A description of what is wrong with the command's end; empty: nothing."""
        # Out of memory, Fast DDS and glibc may end a process of the run with an assertion.
        foreign = re.compile(r".*\./src/cpp/rtps/|hotpath: \w+\.c:\d+: .*Assertion")
        said = sentences("\n".join(line for line in errors.splitlines() if not foreign.match(line)))
        output = self.folder / "run"
        file, summary = output / "run.json", output / "summary.json"
        complete = file.exists() and json.loads(file.read_text()).get("complete")
        if code not in (0, 1, 2):
            return f"it ended with {code}: {errors[-300:]}"
        for sign in ("terminate called", "what():", "core dumped", "Traceback", "runtime error"):
            if sign in errors:
                return f"it says {sign}: {errors[-300:]}"
        if code == 0:
            return "" if complete and summary.exists() else f"it succeeds without a result: {errors[-300:]}"
        if len(said) != 1:
            return f"{len(said)} sentences: {errors[-300:]}"
        if not complete:
            return ""
        # With a whole result, printing may still fail; JSON needs memory even for its destruction.
        reported = any(sign in said[0] for sign in ("standard output", "is whole"))
        whole = summary.exists() and not (output / "jobs.csv.part").exists()
        return "" if reported and whole else f"it fails with a result that looks whole: {said[0]}"

    def inject(self, name: str) -> None:
        _, places = self.run_with(COMMANDS[name])
        faults = [(p, e) for kind, errors in KINDS.items() for p in some(places[kind]) for e in errors]
        injected, ended_well = 0, 0
        for fault in faults:
            with self.subTest(command=name, kind=kind_of(fault), fault=fault):
                injected += self.run_with(COMMANDS[name], fault)[0]
                ended_well += 1
        found = sum(map(len, places.values()))
        print(f"{name}: {injected} faults injected; {found} places", file=sys.stderr)
        if ended_well == len(faults):
            publish_on_request("reliability/faults.json", {"places": found, "injected": injected}, name)
        self.assertGreater(injected, 8)

    def test_simulate(self) -> None:
        self.inject("simulate")

    def test_run(self) -> None:
        self.inject("run")
