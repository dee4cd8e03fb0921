# SPDX-License-Identifier: Apache-2.0
"""The two sides of a comparison: samples and losses of runs or of a reproduction."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

import pandas as pd

from hotpath_report.errors import InputError
from hotpath_report.pages.run_report import ReportedRun
from hotpath_report.paper.storage import HOT_PATH_FILE, IN_FRAMES, RESPONSES_FILE, TIMERS_FILE, read_samples
from hotpath_report.run import Run
from hotpath_report.samples import group_of, samples_by
from hotpath_report.statistics import Samples
from hotpath_report.tables import read_json, read_table

# Smaller differences count as none: simulated values are whole nanoseconds.
NOTHING_MS = 1e-6
KEYS = ["quantity", "study", "source", "setting", "executor", "tasks"]
SOURCE, SETTING, EXECUTOR = (KEYS.index(name) for name in ("source", "setting", "executor"))

Key = tuple[str, ...]  # one value for each of KEYS
T = TypeVar("T")


def with_keys(frame: pd.DataFrame, quantity: str) -> pd.DataFrame:
    """The frame with a column for each of KEYS."""
    tasks = frame["task"].map(lambda task: group_of(task) or task) if "task" in frame else ""
    return frame.assign(quantity=quantity, tasks=tasks, setting=frame["setting"].map(lambda s: f"{s:g} %"))


def parts_of(folder: Path) -> list[Path]:
    """Folders of one build's repetitions, measured by turns with `hotpath run --against`."""
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
    """Number of the first repetition: the seed, or 0 if nothing is drawn. Repetitions with equal
    phases, execution times and releases then have equal numbers."""
    if run.recorded:
        return 0
    # Runs of older versions do not say whether times or releases were drawn.
    drawn = not run.simulated or run.facts.get("drawn", run["execution_times"] != "worst")
    return int(run["seed"]) if drawn or run["phases"] == "random" else 0


Counts = Mapping[Key, Mapping[int, float]]  # by number of the repetition
Draws = Mapping[tuple[str, int], tuple[str, Mapping[str, float]]]  # of an executor's repetition


@dataclass
class Side:
    """What the gate judges. `outputs` has the outputs of each chain and the jobs of each task in every
    planned repetition, 0 without; `losses` skipped timestamps and overwritten samples. `draws` has
    the model of execution times with the length, and the first timestamps (ms) of the timers."""

    samples: Mapping[Key, Samples]
    losses: Counts
    outputs: Counts
    draws: Draws = field(default_factory=dict)
    # Seconds of a repetition, with its warm-up (losses) and without (outputs); none for reproductions.
    seconds: tuple[float, float] | None = None
    mode: str = ""  # of a reproduction

    @property
    def counts(self) -> tuple[Counts, Counts]:
        """Both kinds of counts."""
        return self.losses, self.outputs

    def scaled_to(self, other: "Side") -> "Side":
        """The side with counts as in repetitions of the other side, if these are shorter."""
        if not self.seconds or not other.seconds:
            return self
        factors = [min(1, there / here) for here, there in zip(self.seconds, other.seconds)]
        losses, outputs = (
            {key: {n: factor * v for n, v in of.items()} for key, of in counts.items()}
            for counts, factor in zip(self.counts, factors)
        )
        return replace(self, losses=losses, outputs=outputs)


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
                raise InputError(f"{part / 'summary.json'}: {older}; run `hotpath report {part} --summary`")
            for r in executor["losses"]:
                of[first_seed(run) + r["repetition"]] = r["skipped"] + r["overwritten"]
    return found


def numbered(folder: Path) -> ReportedRun:
    """A run whose repetitions have numbers by first_seed(). Raises InputError."""
    if not (folder / "run.json").exists():
        raise InputError(
            f"{folder}: neither a reproduction (data/{HOT_PATH_FILE}) nor a run (run.json); give a folder of"
            " `reproduce_paper.sh` or of `hotpath`"
        )
    reported = ReportedRun(folder)
    first = first_seed(reported.run)
    all_samples = [s for of in (*reported.samples.values(), *reported.tasks.values()) for s in of.values()]
    for samples in {id(s): s for s in all_samples}.values():  # timers are among the tasks, too
        samples.numbers = [first + n for n in samples.numbers]
    return reported


def outputs(reported: ReportedRun) -> dict[Key, dict[int, float]]:
    """Outputs of each chain and jobs of each task after the warm-up, per planned repetition."""
    run = reported.run
    first = first_seed(run)
    planned = range(first, first + run["repetitions"])
    source, load = run.source, f"{run['load_percent']:g} %"
    found: dict[Key, dict[int, float]] = {}

    def add(quantity: str, name: str, of: Mapping[str, Samples]) -> None:
        for e in run.executors:
            counts = dict.fromkeys(planned, 0.0)
            if e in of:
                counts |= zip(of[e].numbers, map(float, map(len, of[e].repetitions)))
            found[quantity, name, source, load, e, ""] = counts

    for chain in run["chains"]:
        add("hot path", chain, reported.samples.get(("Chain", chain), {}))
    if reported.tasks:
        for row in run["tasks"]:
            add("response", row["task"], reported.tasks.get(row["task"], {}))
        return found
    for e in run.summary():  # without a trace: the mean of the repetitions
        for task in e["tasks"]:
            mean = task["response_ms"]["n"] / len(planned)
            found["response", task["task"], source, load, e["executor"], ""] = dict.fromkeys(planned, mean)
    return found


def side(folder: Path) -> Side:
    """One side of the gate. Raises InputError."""
    made: dict[Key, Mapping[int, float]] = {}
    if (folder / "data" / HOT_PATH_FILE).exists():
        samples = read(folder)
        made = {k: dict(zip(s.numbers, map(float, map(len, s.repetitions)))) for k, s in samples.items()}
        return Side(samples, losses(folder), made, mode=read_json(folder / "facts.json")["mode"])
    draws = {}
    reported = [numbered(part) for part in parts_of(folder) or [folder]]
    for one in reported:
        run = one.run
        for key, counts in outputs(one).items():
            made[key] = {**made.get(key, {}), **counts}
        for r in run["runs"] if run.simulated else ():
            facts = (
                f"{run['execution_times']}, {run['warm_up_s']} + {run['duration_s']} s",
                r["first_timestamps_ms"],
            )
            draws[r["executor"], first_seed(run) + r["repetition"]] = facts
    length, warm_up = (float(reported[0].run[name]) for name in ("duration_s", "warm_up_s"))
    return Side(
        joined([samples_of(one) for one in reported]), losses(folder), made, draws, (warm_up + length, length)
    )


def samples_of(reported: ReportedRun) -> dict[Key, Samples]:
    """Samples of a run by key."""
    source, setting = reported.run.source, f"{reported.run['load_percent']:g} %"
    return {
        ("hot path" if kind == "Chain" else "response", name, source, setting, e, ""): samples
        for (kind, name), executors in reported.samples.items()
        for e, samples in executors.items()
    }


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
    return samples_of(numbered(folder))


def regardless_of_load(old: Side, new: Side) -> tuple[Side, Side]:
    """Both sides with a common setting. Raises InputError if a side has several settings."""
    settings = [sorted({key[SETTING] for key in (*side.samples, *side.outputs)}) for side in (old, new)]
    several = next((side for side in settings if len(side) > 1), None)
    if several:
        raise InputError(
            f"--across-loads compares runs of one load each, and one side has {', '.join(several)}"
        )
    both = " to ".join(dict.fromkeys(setting for side in settings for setting in side))

    def common(values: Mapping[Key, T]) -> dict[Key, T]:
        return {(*key[:SETTING], both, *key[SETTING + 1 :]): value for key, value in values.items()}

    before, after = (
        replace(s, samples=common(s.samples), losses=common(s.losses), outputs=common(s.outputs))
        for s in (old, new)
    )
    return before, after


def nothing_in_common(old: str, new: str, before: Mapping[Key, Any], after: Mapping[Key, Any]) -> InputError:
    """The error for sides without common keys, with a hint if only the loads differ."""
    loads = [", ".join(sorted({key[SETTING] for key in side})) for side in (before, after)]
    without = [{key[:SETTING] + key[SETTING + 1 :] for key in side} for side in (before, after)]
    if without[0] & without[1]:
        return InputError(f"{old} has load {loads[0]}, {new} {loads[1]}; compare them with --across-loads")
    return InputError(f"{old} and {new} have no executor and setting in common, there is nothing to compare")
