# SPDX-License-Identifier: Apache-2.0
"""Runs cells: each into a folder that gets its name when the cell is whole, so that a killed reproduction goes on."""

import contextlib
import json
import os
import queue
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

SIMULATIONS_AT_ONCE = 2
# A cell that outlived a killed reproduction would disturb the next one's measurements.
ENDS_WITH_US = ("setpriv", "--pdeathsig", "TERM", "--")

# What marks a live repetition as noisy. Marked ones are shown and counted like all others.
NOISY_STOLEN_PERCENT = 0.5  # of its duration, taken by the hypervisor
NOISY_OTHERS_PERCENT = 5.0  # of its processors' time, used by other processes
NOISY_HELD_UP_MS = 5.0  # longest time for which a thread that only read the clock did not run
NOISE_RULE = (
    f"a repetition is marked when the hypervisor took more than {NOISY_STOLEN_PERCENT:g} % of its time, other"
    f" processes used more than {NOISY_OTHERS_PERCENT:g} % of its processors, a thread that only read the clock was"
    f" held up for more than {NOISY_HELD_UP_MS:g} ms just before, or its calibration was disturbed"
)


class Interrupted(Exception):
    pass


class Rebuilt(Exception):
    """The measured command is no longer the one that the first cells ran."""


def write_json(path, value):
    part = path.with_name(f".{path.name}.part")
    part.write_text(json.dumps(value, indent=1) + "\n", encoding="utf-8")
    os.replace(part, path)


def read_json(path):
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def busy_seconds(cpus):
    """Time that the processors spent on anything, from /proc/stat."""
    tick, total = os.sysconf("SC_CLK_TCK"), 0.0
    for line in Path("/proc/stat").read_text(encoding="ascii").splitlines():
        fields = line.split()
        if fields[0].startswith("cpu") and fields[0][3:].isdigit() and int(fields[0][3:]) in cpus:
            user, nice, system, _idle, _iowait, irq, softirq = map(int, fields[1:8])
            total += (user + nice + system + irq + softirq) / tick
    return total


def noise_of(run, others_percent):
    """What disturbed a live repetition, and which of it marks the repetition."""
    stolen_ms = sum(r.get("stolen_ms", 0) for r in run.get("runs", []))
    stolen_percent = stolen_ms / (run["duration_s"] + run["warm_up_s"]) / 10
    pinned = set(run["cpus"])
    hiccups = [h for h in run["machine"]["noise"]["hiccups"] if h["cpu"] in pinned]
    held_up_ms = max((h["max_ns"] / 1e6 for h in hiccups), default=0)
    marks = []
    if stolen_percent > NOISY_STOLEN_PERCENT:
        marks.append(f"{stolen_percent:.1f} % stolen by the hypervisor")
    if others_percent > NOISY_OTHERS_PERCENT:
        marks.append(f"{others_percent:.0f} % of the processor used by others")
    if held_up_ms > NOISY_HELD_UP_MS:
        marks.append(f"held up for {held_up_ms:.1f} ms before the start")
    if run["calibration"]["disturbed"]:
        marks.append("calibration disturbed")
    return {
        "stolen_percent": stolen_percent,
        "others_percent": others_percent,
        "held_up_ms": held_up_ms,
        "marks": marks,
    }


class Runner:
    def __init__(self, hotpath, build, output, cpus, on_change):
        self.hotpath, self.build = hotpath, build
        self.folder = Path(output) / "cells"
        self.cpus = cpus  # processors for live cells, in the order of their use
        self.on_change = on_change  # called when a cell has begun or ended, and now and then
        self.running, self.done, self.failed = {}, [], []
        self.at_once = 1
        self.command_file = self.signature()
        self.stop = threading.Event()
        self.interrupted_by = 0  # number of a signal
        self.lock = threading.RLock()  # a signal may find the main thread holding it

    def signature(self):
        found = os.stat(self.hotpath)
        return found.st_ino, found.st_size, found.st_mtime_ns

    def remove_unfinished(self):
        """What killed and interrupted reproductions left behind."""
        for part in self.folder.glob(".*.part"):
            shutil.rmtree(part, ignore_errors=True)

    def identity(self, cell, place):
        return {"command": ["hotpath", *cell.command(f"cells/{cell.name}", place)], "build": self.build}

    def cpus_of(self, cell, slot):
        """The live cell's own processor, or as many as it has cores."""
        if cell.source != "live":
            return []
        return sorted(self.cpus[slot : slot + 1] if cell.cores == 1 else self.cpus[: cell.cores])

    def place(self, cell, slot):
        """Options of a live cell. In DDS domains of their own, cells at the same time do not discover each other."""
        cpus = self.cpus_of(cell, slot)
        return ("--cpus", ",".join(map(str, cpus)), "--domain", str(slot)) if cpus else ()

    def complete(self, cell):
        """Whether the cell's folder holds what the plan asks for, made by this build."""
        facts = read_json(self.folder / cell.name / "cell.json")
        if facts is None or facts.get("complete") is not True:
            return False
        # Which of several equal processors a cell was pinned to is no difference.
        options = [self.identity(cell, self.place(cell, slot)) for slot in range(max(1, len(self.cpus)))]
        return any(all(facts.get(key) == value for key, value in wanted.items()) for wanted in options)

    def of_another_build(self, cell):
        facts = read_json(self.folder / cell.name / "cell.json")
        return facts is not None and facts.get("build") != self.build

    def set_aside(self, cell):
        """Keeps what another build measured; a simulation can be repeated."""
        folder = self.folder / cell.name
        if cell.source != "live":
            shutil.rmtree(folder, ignore_errors=True)
        if not folder.exists():
            return
        aside = self.folder.parent / "superseded"
        aside.mkdir(exist_ok=True)
        attempt = 1
        while (aside / f"{cell.name}.{attempt}").exists():
            attempt += 1
        os.replace(folder, aside / f"{cell.name}.{attempt}")

    def run(self, cell, slot=0):
        part = self.folder / f".{cell.name}.{os.getpid()}.part"
        place, used = self.place(cell, slot), set(self.cpus_of(cell, slot))
        started, busy = time.time(), busy_seconds(used)
        with self.lock:
            if self.stop.is_set():
                raise Interrupted
            if self.signature() != self.command_file:
                raise Rebuilt
            process = subprocess.Popen(
                [*ENDS_WITH_US, self.hotpath, *cell.command(part, place)],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
                errors="replace",
                env={**os.environ, "HOTPATH_FIGURES": "none"},
                start_new_session=True,  # Ctrl-C reaches it through us, once
            )
            self.running[cell.name] = (cell, process, started)
        self.on_change()
        with process.stderr:
            errors = process.stderr.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        elapsed = time.time() - started
        own = usage.ru_utime + usage.ru_stime
        others = 100 * max(0.0, busy_seconds(used) - busy - own) / (elapsed * len(used)) if used else 0.0
        with self.lock:
            del self.running[cell.name]
        if self.stop.is_set():
            raise Interrupted
        self.finish(cell, part, place, process.returncode, errors, elapsed, others)
        self.on_change()

    def finish(self, cell, part, place, code, errors, elapsed, others):
        run = read_json(part / "run.json")
        if code != 0 or (run is not None and run.get("complete") is not True):
            sentence = errors.strip().splitlines()[-1] if errors.strip() else f"exit code {code}"
            self.failed.append((cell, sentence))
            shutil.rmtree(part, ignore_errors=True)
            return
        part.mkdir(parents=True, exist_ok=True)
        facts = self.identity(cell, place)
        facts.update(
            {"study": cell.study, "source": cell.source, "repetition": cell.repetition, "elapsed_s": elapsed}
        )
        if cell.source == "live":
            facts["at_once"] = self.at_once
            facts["noise"] = noise_of(run, others)
        facts["complete"] = True
        write_json(part / "cell.json", facts)
        self.set_aside(cell)
        os.replace(part, self.folder / cell.name)
        self.done.append(cell)

    def interrupt(self, number=signal.SIGINT):
        with self.lock:
            self.interrupted_by = number
            self.stop.set()
            for _, process, _ in self.running.values():
                # Not Popen's own way, which might take the exit status that run() awaits.
                with contextlib.suppress(ProcessLookupError):
                    os.kill(process.pid, signal.SIGINT)

    def run_all(self, cells, workers):
        """Takes the cells in their order, several at once; the rest is left alone after the first exception."""
        self.remove_unfinished()
        self.at_once = workers
        waiting, problems = queue.SimpleQueue(), []
        for cell in cells:
            waiting.put(cell)

        def work(slot):
            while not problems and not self.stop.is_set():
                try:
                    cell = waiting.get_nowait()
                except queue.Empty:
                    return
                try:
                    self.run(cell, slot)
                except BaseException as error:  # reported by the main thread
                    problems.append(error)

        threads = [threading.Thread(target=work, args=(slot,)) for slot in range(workers)]
        for thread in threads:
            thread.start()
        for thread in threads:
            while thread.is_alive():
                thread.join(0.5)  # signals are handled in between
                self.on_change()
        for problem in problems:
            raise problem
        if self.stop.is_set():
            raise Interrupted


class Progress:
    """One line on a terminal: how much is done, time left, what runs. Nothing in a log."""

    def __init__(self, cells, stream=sys.stderr):
        self.cells, self.stream = cells, stream
        self.runner = None
        self.jobs = 1

    def show(self):
        if not self.stream.isatty() or self.runner is None:
            return
        with self.runner.lock:
            finished = {cell.name for cell in self.runner.done} | {cell.name for cell, _ in self.runner.failed}
            running = {name: time.time() - started for name, (_, _, started) in self.runner.running.items()}
        left = 0.0
        for cell in self.cells:
            if cell.name not in finished:
                at_once = SIMULATIONS_AT_ONCE if cell.source != "live" else self.jobs if cell.cores == 1 else 1
                left += max(0, cell.seconds - running.get(cell.name, 0)) / at_once
        line = f"[{len(finished)}/{len(self.cells)}] {duration_text(left)} left  {', '.join(running)}"
        self.stream.write("\r\x1b[K" + line[:110])
        self.stream.flush()

    def end(self):
        if self.stream.isatty():
            self.stream.write("\r\x1b[K")
            self.stream.flush()


def duration_text(seconds):
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes:02} min"
    return f"{minutes} min {rest:02} s" if minutes else f"{rest} s"
