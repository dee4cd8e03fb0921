# SPDX-License-Identifier: Apache-2.0
"""The two sides of a comparison: samples and losses of runs or of a reproduction."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

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
Counts = dict[Key, dict[int, float]]  # by number of the repetition
Draws = dict[tuple[str, int], tuple[str, dict[str, float]]]  # of an executor's repetition
T = TypeVar("T")


@dataclass
class Side:
    """What the gate judges. `outputs` has the outputs of each chain and the jobs of each task in every planned
    repetition, 0 without; `losses` skipped timestamps and overwritten samples. `draws` has the model of execution times
    with the length, and the first timestamps (ms) of the timers."""

    samples: Mapping[Key, Samples]
    losses: Counts
    outputs: Counts
    draws: Draws = field(default_factory=dict)
    # Seconds of a repetition, with its warm-up (losses) and without (outputs); none for reproductions.
    seconds: tuple[float, float] | None = None
    mode: str = ""  # of a reproduction

    def scaled_to(self, other: "Side") -> "Side":
        """The side with counts as in repetitions of the other side, if these are shorter."""
        if not self.seconds or not other.seconds:
            return self
        losses, outputs = (
            {key: {n: min(1, there / here) * v for n, v in of.items()} for key, of in counts.items()}
            for counts, here, there in zip((self.losses, self.outputs), self.seconds, other.seconds)
        )
        return replace(self, losses=losses, outputs=outputs)


def text_of(key: Key) -> str:
    """The key in words."""
    return " ".join(filter(None, key))


def with_keys(frame: pd.DataFrame, quantity: str) -> pd.DataFrame:
    """The frame with a column for each of KEYS."""
    tasks = frame["task"].map(lambda task: group_of(task) or task) if "task" in frame else ""
    return frame.assign(quantity=quantity, tasks=tasks, setting=frame["setting"].map(lambda s: f"{s:g} %"))


def is_published(folder: Path) -> bool:
    """Whether the folder is a reproduction, and no run."""
    return (folder / "data" / HOT_PATH_FILE).exists()


def timers_of(folder: Path) -> pd.DataFrame:
    """Counts of the timers of a reproduction, with KEYS."""
    return with_keys(read_table(folder / "data" / TIMERS_FILE).rename(columns=IN_FRAMES), "lost")


def parts_of(folder: Path) -> list[Path]:
    """Folders of one build's repetitions, measured by turns with `hotpath run --against`."""
    return [] if (folder / "run.json").exists() else sorted(p.parent for p in folder.glob("*/run.json"))


def joined(parts: list[dict[Key, Samples]]) -> dict[Key, Samples]:
    """The repetitions of all parts, pooled."""
    made = {}
    for key in dict.fromkeys(key for part in parts for key in part):
        having = [part[key] for part in parts if key in part]
        numbers = [n for samples in having for n in samples.numbers]
        made[key] = Samples((r for samples in having for r in samples.repetitions), numbers=numbers)
    return made


def first_seed(run: Run) -> int:
    """Number of the first repetition: the seed, or 0 if nothing is drawn. Repetitions with equal phases, execution
    times and releases then have equal numbers."""
    if run.recorded:
        return 0
    # Runs of older versions do not say whether times or releases were drawn.
    drawn = not run.simulated or run.facts.get("drawn", run["execution_times"] != "worst")
    return int(run["seed"]) if drawn or run["phases"] == "random" else 0


class NumberedRun(ReportedRun):
    """A run whose repetitions have numbers by first_seed()."""

    def __init__(self, folder: Path) -> None:
        if not (folder / "run.json").exists():
            neither = f"neither a reproduction (data/{HOT_PATH_FILE}) nor a run (run.json)"
            raise InputError(f"{folder}: {neither}; give a folder of `reproduce_paper.sh` or of `hotpath`")
        super().__init__(folder)
        self.first = first_seed(self.run)
        found = [s for of in (*self.samples.values(), *self.tasks.values()) for s in of.values()]
        for samples in {id(s): s for s in found}.values():  # timers are among the tasks, too
            samples.numbers = [self.first + n for n in samples.numbers]

    def key(self, quantity: str, name: str, executor: str) -> Key:
        """The key of what has a name in this run."""
        return (quantity, name, self.run.source, f"{self.run['load_percent']:g} %", executor, "")

    def by_key(self) -> dict[Key, Samples]:
        """Samples by key."""
        return {
            self.key("hot path" if kind == "Chain" else "response", name, executor): samples
            for (kind, name), executors in self.samples.items()
            for executor, samples in executors.items()
        }

    def losses(self) -> Counts:
        """Skipped timestamps and overwritten samples per repetition."""
        found = {}
        for e in self.run.summary():
            if "losses" not in e:
                again = f"run `hotpath report {self.run.folder} --summary`"
                raise InputError(f"{self.run.folder / 'summary.json'}: an older version wrote it; {again}")
            of = {self.first + r["repetition"]: r["skipped"] + r["overwritten"] for r in e["losses"]}
            found[self.key("lost", self.run["graph.name"], e["executor"])] = of
        return found

    def outputs(self) -> Counts:
        """Outputs of each chain and jobs of each task after the warm-up, per planned repetition."""
        planned = range(self.first, self.first + self.run["repetitions"])
        of_names = [("hot path", c, self.samples.get(("Chain", c), {})) for c in self.run["chains"]]
        if self.tasks:
            of_names += [("response", t["task"], self.tasks.get(t["task"], {})) for t in self.run["tasks"]]
        found: Counts = {}
        for quantity, name, of in of_names:
            for e in self.run.executors:
                counts = dict.fromkeys(planned, 0.0)
                found[self.key(quantity, name, e)] = counts | (lengths(of[e]) if e in of else {})
        for summary in (
            () if self.tasks else self.run.summary()
        ):  # without a trace: the mean of the repetitions
            for task in summary["tasks"]:
                mean = task["response_ms"]["n"] / len(planned)
                found[self.key("response", task["task"], summary["executor"])] = dict.fromkeys(planned, mean)
        return found


def lengths(samples: Samples) -> dict[int, float]:
    """The number of samples by number of the repetition."""
    return dict(zip(samples.numbers, map(float, map(len, samples.repetitions))))


def side(folder: Path) -> Side:
    """One side of the gate. Raises InputError."""
    if is_published(folder):
        samples = read(folder)
        losses: Counts = {}
        if (folder / "data" / TIMERS_FILE).exists():
            skipped = timers_of(folder).assign(tasks="").groupby([*KEYS, "repetition"])["skipped"].sum()
            for (*key, number), count in skipped.items():
                losses.setdefault(tuple(key), {})[int(number)] = float(count)
        outputs = {key: lengths(s) for key, s in samples.items()}
        return Side(samples, losses, outputs, mode=read_json(folder / "facts.json")["mode"])
    parts = [NumberedRun(part) for part in parts_of(folder) or [folder]]
    length, warm_up = (float(parts[0].run[name]) for name in ("duration_s", "warm_up_s"))
    made = Side(joined([part.by_key() for part in parts]), {}, {}, seconds=(warm_up + length, length))
    for part in parts:
        for counts, more in ((made.losses, part.losses()), (made.outputs, part.outputs())):
            for key, of in more.items():
                counts.setdefault(key, {}).update(of)
        run = part.run
        for r in run["runs"] if run.simulated else ():
            times = f"{run['execution_times']}, {run['warm_up_s']} + {run['duration_s']} s"
            made.draws[r["executor"], part.first + r["repetition"]] = (times, r["first_timestamps_ms"])
    return made


def read(folder: Path) -> dict[Key, Samples]:
    """Samples of a reproduction, a run, or repetitions in separate folders. Raises InputError."""
    if is_published(folder):
        hot_path = read_samples(folder / "data" / HOT_PATH_FILE).rename(columns={"load_percent": "setting"})
        responses = read_samples(folder / "data" / RESPONSES_FILE)
        found = samples_by(with_keys(hot_path, "hot path"), KEYS, "hot_path_ms")
        return found | samples_by(with_keys(responses, "response"), KEYS, "response_ms")
    if parts := parts_of(folder):
        return joined([read(part) for part in parts])
    return NumberedRun(folder).by_key()


def regardless_of_load(old: Side, new: Side) -> tuple[Side, Side]:
    """Both sides with a common setting. Raises InputError if a side has several settings."""
    settings = [sorted({key[SETTING] for key in (*side.samples, *side.outputs)}) for side in (old, new)]
    for of_side in settings:
        if len(of_side) > 1:
            several = f"one side has {', '.join(of_side)}"
            raise InputError(f"--across-loads compares runs of one load each, and {several}")
    both = " to ".join(dict.fromkeys(setting for side in settings for setting in side))

    def common(values: Mapping[Key, T]) -> dict[Key, T]:
        return {(*key[:SETTING], both, *key[SETTING + 1 :]): value for key, value in values.items()}

    before, after = (
        replace(s, samples=common(s.samples), losses=common(s.losses), outputs=common(s.outputs))
        for s in (old, new)
    )
    return before, after


def nothing_in_common(old: str, new: str, before: Iterable[Key], after: Iterable[Key]) -> InputError:
    """The error for sides without common keys, with a hint if only the loads differ."""
    loads = [", ".join(sorted({key[SETTING] for key in keys})) for keys in (before, after)]
    without = [{key[:SETTING] + key[SETTING + 1 :] for key in keys} for keys in (before, after)]
    if without[0] & without[1]:
        return InputError(f"{old} has load {loads[0]}, {new} {loads[1]}; compare them with --across-loads")
    return InputError(f"{old} and {new} have no executor and setting in common, there is nothing to compare")
