# SPDX-License-Identifier: Apache-2.0
"""Faults during a command: what the machine refuses or takes away, processes that die or hang, a full
disk, a stepped clock. The command succeeds anyway, or ends with one clear sentence and no
half result that looks whole.

HOTPATH_KILLS (default 4) processes are killed or stopped at random instants; with HOTPATH_PUBLISH=1,
the counts are published as results/reliability/process_faults.json."""

import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

import adverse_tables as tables
from adverse_effects import LIVE_EFFECTS
from adverse_files_test import NOBODY, limit
from adverse_tables import rows, words
from adverse_use_test import WRONG_USE, Results, assert_says, check_effect, effects
from evidence import publish_on_request
from hotpath_command import BENCH, HOTPATH, CommandTest, RunFolder, processes_of

WHOLE, FAILED = 0, 1
KILLS = int(os.environ.get("HOTPATH_KILLS", "4"))
needs_root = pytest.mark.skipif(not NOBODY, reason="needs root to become somebody else")


def assert_nothing_looks_whole(shell: Any, output: str = "run") -> None:
    path = shell.folder / output
    assert not {"jobs.csv", "chains.csv", "summary.json"} & {f.name for f in path.glob("*")}
    assert not (path / "run.json").exists() or not RunFolder(path).run["complete"]


def assert_failed(shell: Any, done: Any, *parts: str, output: str = "run") -> None:
    """Checks that a command ended with one sentence, and without a result that looks whole."""
    code, out, err = done
    assert (code, out) == (FAILED, ""), err
    assert_says(err, *parts)
    assert_nothing_looks_whole(shell, output)


def children(process: Any) -> list[int]:
    try:
        return [
            int(pid) for pid in Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
        ]
    except OSError:
        return []


def lines_of(err: str) -> list[str]:
    return [line for line in err.splitlines() if line.startswith("hotpath: ")]


@pytest.mark.parametrize("use, effect", effects(LIVE_EFFECTS))
def test_each_option_of_a_live_run_has_its_effect(live_results: Results, use: str, effect: str) -> None:
    check_effect(live_results, use, effect)


@pytest.fixture(scope="session")
def live_results(commands: Any, stock: Path, tmp_path_factory: Any) -> Results:
    return Results(commands, stock, tmp_path_factory.mktemp("live"), live=True)


# What this machine or this user does not permit.

LIMITS = {
    "no locked memory": limit(resource.RLIMIT_MEMLOCK, 0) | NOBODY,
    "12 files": limit(resource.RLIMIT_NOFILE, 12),
    "20 kB": limit(resource.RLIMIT_FSIZE, 20000),  # more than run.json
    "no priority": NOBODY,
}


@needs_root
@pytest.mark.parametrize("which, line, parts", [(*r[:2], r[2:]) for r in rows(tables.FAILS)])
def test_what_the_machine_refuses(
    shell: CommandTest, stock: Path, which: str, line: str, parts: list[str]
) -> None:
    assert_failed(shell, shell.command(*words(line, stock), **LIMITS[which]), *parts)


@needs_root
def test_a_default_policy_that_is_refused_is_noted(shell: CommandTest) -> None:
    code, _, err = shell.command("run", *tables.BRIEF.split(), "--output", "run", **NOBODY)
    assert code == WHOLE, err
    assert "note: SCHED_FIFO was not permitted" in err
    run = shell.checked("run").run
    assert run["complete"] and "SCHED_FIFO" in " ".join(run["warnings"])
    assert run["runs"][0]["thread_policies"] == ["executor other, timer_mgmt other"]


def test_no_network_interface(shell: CommandTest) -> None:
    if subprocess.run(["unshare", "-n", "true"], capture_output=True, check=False).returncode != 0:
        pytest.skip("needs a separate network namespace")
    asked = ["unshare", "-n", HOTPATH, *tables.WITHOUT_NETWORK.split()]
    pipes: Any = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "cwd": shell.folder}
    assert_failed(shell, shell.finish(subprocess.Popen(asked, **pipes)), "DDS domain 0", "partners")


def test_a_full_disk(shell: CommandTest, stock: Path) -> None:
    disk = shell.folder / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=12k", "tmpfs", str(disk)]
    if subprocess.run(mount, capture_output=True, check=False).returncode != 0:
        pytest.skip("cannot mount a tiny disk")
    shell.addCleanup(subprocess.check_call, ["umount", disk])
    shell.accepted(*tables.TWENTY_SECONDS.split())
    for line, *parts in rows(tables.FULL_DISK):
        assert_failed(shell, shell.command(*words(line, stock)), *parts, output="disk/run")
        shutil.rmtree(disk / "run", ignore_errors=True)
        assert list(disk.iterdir()) == []


def test_closed_standard_streams(shell: CommandTest) -> None:
    """The numbers of closed standard streams must not be reused for result files."""
    output = shell.folder / "run"
    process = subprocess.Popen(
        [HOTPATH, "run", *tables.BRIEF.split(), "--output", output],
        env=shell.environment, preexec_fn=lambda: os.closerange(0, 3),
    )  # fmt: skip
    assert shell.finish(process)[0] == WHOLE
    assert shell.checked("run").run["complete"]
    assert (output / "jobs.csv").read_text().startswith("executor,")


def test_a_full_standard_output(shell: CommandTest) -> None:
    with open("/dev/full", "w", encoding="ascii") as full:
        code, _, err = shell.command("run", *tables.BRIEF.split(), "--output", "run", stdout=full)
    assert code == FAILED
    assert_says(err, "standard output")
    assert shell.checked("run").run["complete"]


def test_a_figure_that_cannot_be_drawn(shell: CommandTest) -> None:
    del shell.environment["HOTPATH_FIGURES"]
    shell.environment["HOTPATH_LIBRARY"] = str(shell.folder / "missing.so")
    code, _, err = shell.command(*tables.WITHOUT_FIGURE.split())
    assert code == WHOLE and "Traceback" not in err
    assert "note: the figure was not drawn" in err
    assert shell.checked("run").run["complete"]


def assert_ended(shell: CommandTest, code: int, err: str, output: str) -> None:
    """Checks for a whole result, or for one error sentence and no result that looks whole; stored rows
    are right."""
    folder = shell.folder / output
    assert code in (WHOLE, FAILED, WRONG_USE) and len(lines_of(err)) == (code != WHOLE), err
    for sign in ("terminate called", "what():", "internal error", "Traceback"):
        assert sign not in err
    file = folder / "run.json"
    assert (file.exists() and json.loads(file.read_text())["complete"]) == (code == WHOLE), err
    if (folder / "summary.json").exists():
        run = shell.checked(output)
        assert set(run.jobs()) == {
            (r["executor"], r["repetition"]) for r in run.run["runs"] if not r["failure"]
        }
        assert all(e["loss_equations"]["hold"] for e in run.summary()["executors"]), err


def test_few_open_files(shell: CommandTest) -> None:
    codes = set()
    for files in range(4, 40, 9):
        for line in tables.FEW_FILES:
            output = f"{line.split()[0]}{files}"
            code, _, err = shell.command(
                *line.split(), "--output", output, **limit(resource.RLIMIT_NOFILE, files)
            )
            assert_ended(shell, code, err, output)
            codes.add(code)
    assert {WHOLE, FAILED} <= codes


# Processes that die, hang, or are asked to end.


def started(shell: Any, line: str, work: bool = False) -> Any:
    """Starts a run and waits until all of its processes have executor threads or, with `work`, have used
    enough CPU time that jobs must have run."""
    process = shell.start(*line.split(), "--output", "run")
    shell.addCleanup(lambda: process.poll() is None and process.kill())
    count = 2 if "--processes" in line else 1

    def ready(pid: int) -> bool:
        try:
            names = [t.joinpath("comm").read_text() for t in Path(f"/proc/{pid}/task").iterdir()]
            ticks = sum(map(int, Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11:13]))
        except OSError:
            return False
        return "executor\n" in names and (not work or ticks > 25)

    def running() -> bool:
        assert process.poll() is None, "the command ended early"
        return len(children(process)) == count and all(map(ready, children(process)))

    shell.wait_for(running, "the run did not begin")
    return process


@pytest.mark.parametrize("number, which, parts", [
    (signal.SIGKILL, 1, ("process 2 of 2", "Killed")),
    (signal.SIGSTOP, 0, ("process 1 of 2", "did not answer in time", "--time-out")),
])  # fmt: skip
def test_a_process_that_dies_or_hangs(shell: CommandTest, number: int, which: int, parts: Any) -> None:
    process = started(shell, f"{tables.TWO_PROCESSES} --duration 1.5 --time-out 1")
    os.kill(children(process)[which], number)
    assert_failed(shell, shell.finish(process), *parts)
    assert parts[1] in RunFolder(shell.folder / "run").run["failures"][0]


def test_a_failed_repetition_does_not_spoil_the_others(shell: CommandTest) -> None:
    process = started(shell, f"{tables.TWO_EXECUTORS} --duration 0.8")
    os.kill(children(process)[0], signal.SIGKILL)
    code, _, err = shell.finish(process)
    assert code == FAILED
    assert_says(err, "1 of 2 runs failed")
    folder = shell.checked("run")
    assert not folder.run["complete"] and len(folder.run["failures"]) == 1
    (whole,) = [r["executor"] for r in folder.run["runs"] if not r["failure"]]
    assert folder.jobs().keys() == {(whole, 0)}
    assert not {f for f in folder.files() if f.endswith(".part")}


@pytest.mark.parametrize("line, number, processes", [
    (tables.TWO_PROCESSES, signal.SIGINT, {0, 1}), (tables.TWO_EXECUTORS, signal.SIGTERM, {0})
])  # fmt: skip
def test_a_signal_keeps_what_was_measured(shell: CommandTest, line: str, number: int, processes: Any) -> None:
    process = started(shell, f"{line} --duration 30", work=True)
    (os.killpg if number == signal.SIGINT else os.kill)(process.pid, number)
    code, _, err = shell.finish(process)
    assert code == 128 + number, err
    assert "partial" in err and not lines_of(err)
    folder = shell.checked("run")
    assert folder.run["partial"] and not folder.run["complete"] and folder.run["failures"] == []
    assert not {f for f in folder.files() if f.endswith(".part")}
    (jobs,) = folder.jobs().values()
    assert "ran" in {j.outcome for j in jobs} and {j.process for j in jobs} == processes
    assert folder.summary()["executors"][0]["loss_equations"]["hold"]


def test_a_killed_command_leaves_no_process_and_no_shared_memory(shell: CommandTest) -> None:
    process = started(shell, f"{tables.TWO_PROCESSES} --duration 30")
    process.kill()
    shell.finish(process)
    shell.wait_for(lambda: not processes_of(process.pid), "a process lives on")
    assert_nothing_looks_whole(shell)


def test_a_killed_report_leaves_no_program(shell: CommandTest, stock: Path) -> None:
    program, started = shell.folder / "hotpath", shell.folder / "started"
    program.write_text(f"#!/bin/sh\necho $$ >{started}\nexec sleep 60\n")
    program.chmod(0o755)
    library = Path(HOTPATH).with_name("libhotpath_python.so")
    report = subprocess.Popen(
        ["/usr/bin/python3", "-I", "-B", BENCH, *words(tables.REPORT, stock)],
        env={**shell.environment, "HOTPATH": str(program), "HOTPATH_LIBRARY": str(library)},
        start_new_session=True,
    )
    shell.wait_for(started.exists, "it asks the program")
    report.kill()
    report.wait()
    shell.wait_for(lambda: not processes_of(report.pid), "its program lives on")


def hit(process: Any, number: int, seconds: float, choice: Any) -> bool:
    """After `seconds`, sends a signal to one of the run's processes. Returns whether there was one."""
    time.sleep(seconds)
    while process.poll() is None:
        try:
            os.kill(choice(children(process)), number)
            return True
        except (IndexError, ProcessLookupError):
            time.sleep(0.001)
    return False


def test_processes_killed_or_stopped_at_random_instants(shell: CommandTest) -> None:
    draw = random.Random(KILLS)
    hits = failed = 0
    for k in range(KILLS):
        process = shell.start(*tables.SHORT_RUNS.split(), "--output", f"run{k}")
        hits += hit(process, (signal.SIGKILL, signal.SIGSTOP)[k % 2], draw.uniform(0, 2), draw.choice)
        code, _, err = shell.finish(process)
        assert_ended(shell, code, err, f"run{k}")
        shell.wait_for(lambda: not processes_of(process.pid), "a process lives on")
        failed += code != WHOLE
    assert failed > 0
    publish_on_request("reliability/process_faults.json", {"hits": hits, "failed": failed})


# The machine's clock.


def stepped(shell: CommandTest, seconds: float, after: float) -> None:
    shell.environment["LD_PRELOAD"] = os.environ["STEPPING_CLOCK"]
    shell.environment |= {"HOTPATH_CLOCK_STEP": str(seconds), "HOTPATH_CLOCK_STEP_AFTER": str(after)}


@pytest.mark.parametrize("seconds", [3600, -3600])
def test_a_step_of_the_clock_during_a_live_run_changes_nothing(shell: CommandTest, seconds: int) -> None:
    stepped(shell, seconds, after=1)
    shell.accepted(*tables.LIVE_RUN.split(), "--output", "run")
    run = shell.checked("run")
    assert run.run["complete"] and all(e["loss_equations"]["hold"] for e in run.summary()["executors"])


def test_the_library_steps_the_clock(shell: CommandTest) -> None:
    stepped(shell, 3600, after=0)
    asked = [sys.executable, "-c", "import time; print(time.time(), time.monotonic())"]
    printed = subprocess.run(asked, env=shell.environment, capture_output=True, check=True).stdout.split()
    assert float(printed[0]) > time.time() + 3000
    assert float(printed[1]) < time.monotonic() + 1
