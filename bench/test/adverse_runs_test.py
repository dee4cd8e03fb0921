# SPDX-License-Identifier: Apache-2.0
"""Faults during a command: what the machine refuses or takes away, processes that die or hang, a full
disk, a stepped clock. The command succeeds anyway, or ends with one clear sentence and no
half result that looks whole.

HOTPATH_KILLS (default 4) processes are killed or stopped at random instants; with HOTPATH_PUBLISH=1,
the counts are published as results/reliability/process_faults.json."""

import contextlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

import adverse_tables as tables
from adverse_tables import rows
from evidence import publish_on_request
from hotpath_command import BENCH, CRASH, CommandTest, RunFolder, children, processes_of, sentences

KILLS = int(os.environ.get("HOTPATH_KILLS", "4"))
STEPPED = f"HOTPATH_CLOCK_STEP_AFTER=1 LD_PRELOAD={os.environ['STEPPING_CLOCK']} HOTPATH_CLOCK_STEP"
PRINT_CLOCKS = "import time; print(time.time(), time.monotonic())"


def assert_nothing_looks_whole(path: Path) -> None:
    assert not {"jobs.csv", "chains.csv", "summary.json"} & {f.name for f in path.glob("*")}
    assert not (path / "run.json").exists() or not RunFolder(path).run["complete"]


def assert_right(run: RunFolder) -> None:
    """Checks that the rows of a run are those of the repetitions that did not fail, and complete."""
    whole = {(r["executor"], r["repetition"]) for r in run.run["runs"] if not r["failure"]}
    assert run.jobs().keys() == whole and run.accounts_for_all()
    assert not {f for f in run.files() if f.endswith(".part")}


# What this machine or this user does not permit.


def skip_unless_permitted(given: str) -> None:
    if "nobody" in given and os.geteuid() != 0:
        pytest.skip("needs root to become somebody else")
    if "unshare" in given and subprocess.call(["unshare", "-n", "true"]) != 0:
        pytest.skip("needs a separate network namespace")


@pytest.mark.parametrize("given, line, parts", [(*row[:2], row[2:]) for row in rows(tables.FAILS)])
def test_what_the_machine_refuses(shell: CommandTest, given: str, line: str, parts: list[str]) -> None:
    skip_unless_permitted(given)
    shell.rejected(line, says=parts, code=1, given=given)
    assert_nothing_looks_whole(shell.folder / "run")


@pytest.mark.parametrize(
    "given, options, code, says, recorded", [(*row[:4], row[4:]) for row in rows(tables.WHOLE_ANYWAY, 4)]
)
def test_a_run_that_is_whole_anyway(
    shell: CommandTest, given: str, options: str, code: str, says: str, recorded: list[str]
) -> None:
    skip_unless_permitted(given)
    done, _, err = shell.command(f"run {options} --output run", given=given.format(stepped=STEPPED))
    assert (done, len(sentences(err))) == (int(code), int(code)) and says in err, err
    assert not CRASH.search(err), err
    run = shell.checked("run")
    assert run.run["complete"] and (run.path / "jobs.csv").read_text().startswith("executor,")
    assert_right(run)
    for part in recorded:
        assert part in str(run.run["warnings"] + run.run["runs"][0]["thread_policies"])


def test_a_full_disk(shell: CommandTest) -> None:
    disk = shell.folder / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=12k", "tmpfs", str(disk)]
    if subprocess.run(mount, capture_output=True, check=False).returncode != 0:
        pytest.skip("cannot mount a tiny disk")
    shell.addCleanup(subprocess.check_call, ["umount", disk])
    shell.accepted("simulate --executors default --duration 20 --output long")
    for line, *parts in rows(tables.FULL_DISK):
        shell.rejected(line, says=parts, code=1)
        assert_nothing_looks_whole(disk / "run")
        shutil.rmtree(disk / "run", ignore_errors=True)
        assert list(disk.iterdir()) == []


# Processes that die, hang, or are asked to end.


def started(shell: CommandTest, line: str, work: bool) -> Any:
    """Starts a run and waits until all of its processes have executor threads or, with `work`, have used
    enough CPU time that jobs must have run."""
    process = shell.start(line)
    shell.addCleanup(lambda: process.poll() is None and process.kill())
    count = 2 if "--processes" in process.args else 1

    def ready(pid: int) -> bool:
        try:
            names = [t.joinpath("comm").read_text() for t in Path(f"/proc/{pid}/task").iterdir()]
            ticks = sum(map(int, Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11:13]))
        except OSError:
            return False
        return "executor\n" in names and ticks > 25 * work

    def running() -> bool:
        assert process.poll() is None, "the command ended early"
        return len(children(process)) == count and all(map(ready, children(process)))

    shell.wait_for(running, "the run did not begin")
    return process


@pytest.mark.parametrize(
    "line, number, receiver, code, processes, says", [(*row[:5], row[5:]) for row in rows(tables.HIT)]
)
def test_a_run_that_a_signal_hits(
    shell: CommandTest, line: str, number: str, receiver: str, code: str, processes: str, says: list[str]
) -> None:
    """It keeps other repetitions and, if it was asked to end, what was measured. No process lives on."""
    process = started(shell, line, work=int(code) > 128)
    others = {"all": -process.pid, "command": process.pid}
    os.kill(others.get(receiver) or children(process)[int(receiver)], getattr(signal, f"SIG{number}"))
    done, _, err = shell.finish(process)
    shell.wait_for(lambda: not processes_of(process.pid), "a process lives on")
    assert done == int(code) and all(part in err for part in says), err
    assert len(sentences(err)) == (code == "1") and not CRASH.search(err), err
    if processes == "":
        assert_nothing_looks_whole(shell.folder / "run")
        assert code != "1" or says[1] in RunFolder(shell.folder / "run").run["failures"][0]
        return
    run = shell.checked("run")
    assert_right(run)
    assert not run.run["complete"] and (run.run["partial"] or code == "1")
    assert len(run.run["failures"]) == (code == "1")
    (jobs,) = run.jobs().values()
    assert {j.process for j in jobs} == set(map(int, processes.split()))
    assert "ran" in {j.outcome for j in jobs}


def test_a_killed_report_leaves_no_program(shell: CommandTest, stock: Path) -> None:
    hotpath, started_file = shell.folder / "hotpath", shell.folder / "started"
    hotpath.write_text(f"#!/bin/sh\necho $$ >{started_file}\nexec sleep 60\n")
    hotpath.chmod(0o755)
    report = subprocess.Popen(
        ["/usr/bin/python3", "-I", "-B", BENCH, "report", stock / "run"],
        env={**shell.environment, "HOTPATH": str(hotpath)},
        start_new_session=True,
    )
    shell.wait_for(started_file.exists, "it asks the program")
    report.kill()
    report.wait()
    shell.wait_for(lambda: not processes_of(report.pid), "its program lives on")


def test_processes_killed_or_stopped_at_random_instants(shell: CommandTest) -> None:
    draw = random.Random(KILLS)
    hits = failed = 0
    for k in range(KILLS):
        process = shell.start(f"{tables.SHORT_RUNS} run{k}")
        time.sleep(draw.uniform(0, 2))
        shell.wait_for(lambda: process.poll() is not None or children(process), "it neither works nor ends")
        with contextlib.suppress(IndexError, ProcessLookupError):
            os.kill(draw.choice(children(process)), (signal.SIGKILL, signal.SIGSTOP)[k % 2])
            hits += 1
        code, _, err = shell.finish(process)
        shell.wait_for(lambda: not processes_of(process.pid), "a process lives on")
        assert code in (0, 1, 2) and len(sentences(err)) == (code != 0) and not CRASH.search(err), err
        file = shell.folder / f"run{k}" / "run.json"
        assert (file.exists() and json.loads(file.read_text())["complete"]) == (code == 0), err
        if file.with_name("summary.json").exists():
            assert_right(shell.checked(file.parent))
        failed += code != 0
    assert failed > 0
    publish_on_request("reliability/process_faults.json", {"hits": hits, "failed": failed})


def test_the_library_steps_the_clock() -> None:
    """Of the clock's steps in the tables, a run must notice nothing."""
    asked = f"{STEPPED}=3600 HOTPATH_CLOCK_STEP_AFTER=0 {sys.executable} -c '{PRINT_CLOCKS}'"
    printed = subprocess.check_output(["sh", "-c", asked]).split()
    assert float(printed[0]) > time.time() + 3000
    assert float(printed[1]) < time.monotonic() + 1
