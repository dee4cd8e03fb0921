# SPDX-License-Identifier: Apache-2.0
"""The two sides of a comparison: samples and losses of runs or of a reproduction."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

import pandas as pd

from hotpath_report.errors import InputError
from hotpath_report.pages.run_report import ReportedRun
from hotpath_report.paper.storage import HOT_PATH_FILE, IN_FRAMES, RESPONSES_FILE, TIMERS_FILE, read_samples
from hotpath_report.run import Run
from hotpath_report.samples import group_of, samples_by
from hotpath_report.statistics import Samples
from hotpath_report.tables import read_table

# Smaller differences count as none: simulated values are whole nanoseconds.
NOTHING_MS = 1e-6
KEYS = ["quantity", "study", "source", "setting", "executor", "tasks"]
SOURCE, SETTING = KEYS.index("source"), KEYS.index("setting")

Key = tuple[str, ...]  # one value for each of KEYS
T = TypeVar("T")


def with_keys(frame: pd.DataFrame, quantity: str) -> pd.DataFrame:
    """The frame with a column for each of KEYS."""
    tasks = frame["task"].map(lambda task: group_of(task) or task) if "task" in frame else ""
    return frame.assign(quantity=quantity, tasks=tasks, setting=frame["setting"].map(lambda s: f"{s:g} %"))


def parts_of(folder: Path) -> list[Path]:
    """Folders of one build's repetitions, measured by turns with `hotpath compare --against`."""
    return [] if (folder / "run.json").exists() else sorted(p.parent for p in folder.glob("*/run.json"))


def joined(parts: list[dict[Key, Samples]]) -> dict[Key, Samples]:
    """The repetitions of all parts, pooled."""
    keys = dict.fromkeys(key for part in parts for key in part)
    made = {}
    for key in keys:
        having = [part[key] for part in parts if key in part]
        numbers = [n for samples in having for n in samples.numbers]
        made[key] = Samples((r for samples in having for r in samples.repetitions), numbers=numbers)
    return made


def first_seed(run: Run) -> int:
    """Number of the first repetition: the seed, or 0 if nothing is random. Repetitions with equal
    phases and execution times then have equal numbers."""
    if run.recorded:
        return 0
    random = run["phases"] == "random" or not run.simulated or run["execution_times"] != "worst"
    return int(run["seed"]) if random else 0


def losses(folder: Path) -> dict[Key, dict[int, float]]:
    """Skipped timestamps and overwritten samples per repetition; keys and numbers as read()."""
    found: dict[Key, dict[int, float]] = {}
    if (folder / "data" / TIMERS_FILE).exists():
        rows = read_table(folder / "data" / TIMERS_FILE).rename(columns=IN_FRAMES)
        rows = with_keys(rows, "lost").assign(tasks="")
        for (*key, number), count in rows.groupby([*KEYS, "repetition"])["skipped"].sum().items():
            found.setdefault(tuple(key), {})[int(number)] = float(count)
        return found
    for part in parts_of(folder) or [folder]:
        run = Run(part)
        for executor in run.summary():
            name, load = executor["executor"], f"{run['load_percent']:g} %"
            of = found.setdefault(("lost", run["graph.name"], run.source, load, name, ""), {})
            if "losses" not in executor:
                older = "an older version wrote it"
                raise InputError(f"{part / 'summary.json'}: {older}; run `hotpath summarize {part}`")
            for r in executor["losses"]:
                of[first_seed(run) + r["repetition"]] = r["skipped"] + r["overwritten"]
    return found


def read(folder: Path) -> dict[Key, Samples]:
    """Samples of a reproduction, a run, or repetitions in separate folders. Raises InputError."""
    if (folder / "data" / HOT_PATH_FILE).exists():
        hot_path = read_samples(folder / "data" / HOT_PATH_FILE).rename(columns={"load_percent": "setting"})
        responses = read_samples(folder / "data" / RESPONSES_FILE)
        found = samples_by(with_keys(hot_path, "hot path"), KEYS, "hot_path_ms")
        return found | samples_by(with_keys(responses, "response"), KEYS, "response_ms")
    parts = parts_of(folder)
    if parts:
        return joined([read(part) for part in parts])
    if not (folder / "run.json").exists():
        raise InputError(
            f"{folder}: neither a reproduction (data/{HOT_PATH_FILE}) nor a run (run.json); give a folder of"
            " `reproduce_paper.sh` or of `hotpath`"
        )
    reported = ReportedRun(folder)
    source, setting = reported.run.source, f"{reported.run['load_percent']:g} %"
    found = {}
    for (kind, name), executors in reported.samples.items():
        quantity = "hot path" if kind == "Chain" else "response"
        for e, samples in executors.items():
            samples.numbers = [first_seed(reported.run) + n for n in samples.numbers]
            found[quantity, name, source, setting, e, ""] = samples
    return found


def regardless_of_load(old: Mapping[Key, T], new: Mapping[Key, T]) -> tuple[dict[Key, T], dict[Key, T]]:
    """Both sides with a common setting. Raises InputError if a side has several settings."""
    settings = [sorted({key[SETTING] for key in side}) for side in (old, new)]
    several = next((side for side in settings if len(side) > 1), None)
    if several:
        raise InputError(
            f"--across-loads compares runs of one load each, and one side has {', '.join(several)}"
        )
    both = " to ".join(dict.fromkeys(setting for side in settings for setting in side))
    before, after = (
        {(*key[:SETTING], both, *key[SETTING + 1 :]): value for key, value in side.items()}
        for side in (old, new)
    )
    return before, after


def nothing_in_common(old: str, new: str, before: Mapping[Key, Any], after: Mapping[Key, Any]) -> InputError:
    """The error for sides without common keys, with a hint if only the loads differ."""
    loads = [", ".join(sorted({key[SETTING] for key in side})) for side in (before, after)]
    without = [{key[:SETTING] + key[SETTING + 1 :] for key in side} for side in (before, after)]
    if without[0] & without[1]:
        return InputError(f"{old} has load {loads[0]}, {new} {loads[1]}; compare them with --across-loads")
    return InputError(f"{old} and {new} have no executor and setting in common, there is nothing to compare")
