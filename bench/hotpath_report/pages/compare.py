# SPDX-License-Identifier: Apache-2.0
"""Which percentiles of NEW differ from those of OLD, with an interval of the difference, and whether beyond noise; of
reproductions also which drop rates and which verdicts differ."""

from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

import pandas as pd

from hotpath_report.errors import InputError
from hotpath_report.pages.run_report import ReportedRun
from hotpath_report.paper.storage import (
    HOT_PATH_FILE,
    IN_FRAMES,
    RESPONSES_FILE,
    TIMERS_FILE,
    read_samples,
)
from hotpath_report.run import Run
from hotpath_report.samples import group_of, samples_by
from hotpath_report.statistics import PERCENTILES, Estimate, Samples, difference
from hotpath_report.tables import read_json, read_table, text_table, write_output

COMPARED = (0.5, 0.99, 1.0)
# Below it a difference is none: simulated values are whole nanoseconds.
NOTHING_MS = 1e-6
TOLD_DROP_POINTS = 0.1
KEYS = ["quantity", "study", "source", "setting", "executor", "tasks"]
SOURCE, SETTING = KEYS.index("source"), KEYS.index("setting")
COLUMNS = [*KEYS, "percentile", "old_ms", "new_ms", "difference_ms", "interval_95_ms", "verdict"]

Key = tuple[str, ...]  # below KEYS
T = TypeVar("T")


def with_keys(frame: pd.DataFrame, quantity: str) -> pd.DataFrame:
    """The frame with columns for all KEYS."""
    tasks = frame["task"].map(lambda task: group_of(task) or task) if "task" in frame else ""
    return frame.assign(quantity=quantity, tasks=tasks, setting=frame["setting"].map(lambda s: f"{s:g} %"))


def parts_of(folder: Path) -> list[Path]:
    """The folders of a build's repetitions that `hotpath compare --against` measured one by one."""
    return [] if (folder / "run.json").exists() else sorted(p.parent for p in folder.glob("*/run.json"))


def joined(parts: list[dict[Key, Samples]]) -> dict[Key, Samples]:
    """The repetitions of all parts together."""
    keys = dict.fromkeys(key for part in parts for key in part)
    made = {}
    for key in keys:
        having = [part[key] for part in parts if key in part]
        numbers = [n for samples in having for n in samples.numbers]
        made[key] = Samples((r for samples in having for r in samples.repetitions), numbers=numbers)
    return made


def first_seed(run: Run) -> int:
    """What a repetition's number counts from, so that repetitions of equal phases and execution times have equal
    numbers: the seed, unless nothing is random."""
    if run.recorded:
        return 0
    random = run["phases"] == "random" or not run.simulated or run["execution_times"] != "worst"
    return int(run["seed"]) if random else 0


def losses(folder: Path) -> dict[Key, dict[int, float]]:
    """Skipped timestamps and overwritten samples of each repetition, by the keys and numbers of read()."""
    found: dict[Key, dict[int, float]] = {}
    if (folder / "data" / TIMERS_FILE).exists():
        rows = read_table(folder / "data" / TIMERS_FILE).rename(columns=IN_FRAMES)
        rows = with_keys(rows, "lost").assign(tasks="")
        for (*key, number), count in rows.groupby([*KEYS, "repetition"])["skipped"].sum().items():
            found.setdefault(tuple(key), {})[int(number)] = float(count)
        return found
    for part in parts_of(folder) or [folder]:
        run = Run(part)
        jobs = run.counted(read_table(run.jobs_file(), ["executor", "repetition", "outcome"]))
        lost = jobs["outcome"].isin(["skipped", "overwritten"])
        for (executor, r), count in lost.groupby([jobs["executor"], jobs["repetition"]]).sum().items():
            key = ("lost", run["graph.name"], run.source, f"{run['load_percent']:g} %", str(executor), "")
            found.setdefault(key, {})[first_seed(run) + int(r)] = float(count)
    return found


def read(folder: Path) -> dict[Key, Samples]:
    """Samples of a reproduction's data/, or of a run. Raises InputError."""
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
    """The same with both settings in each key. Raises InputError where a side has more than one."""
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
    """Says so, and whether it is because of the loads."""
    loads = [", ".join(sorted({key[SETTING] for key in side})) for side in (before, after)]
    without = [{key[:SETTING] + key[SETTING + 1 :] for key in side} for side in (before, after)]
    if without[0] & without[1]:
        return InputError(f"{old} has load {loads[0]}, {new} {loads[1]}; compare them with --across-loads")
    return InputError(f"{old} and {new} have no executor and setting in common, there is nothing to compare")


def verdict(old: Samples, new: Samples, estimate: Estimate) -> str:
    """Whether a difference is one."""
    if old.exact and new.exact:
        return "the same" if abs(estimate.value) < NOTHING_MS else "differs (exact)"
    if not estimate.has_interval:
        return "no interval"
    return "beyond noise" if estimate.excludes(0) else "within noise"


def compare(old: dict[Key, Samples], new: dict[Key, Samples]) -> pd.DataFrame:
    """A row for each percentile of what both have."""
    rows = []
    for key in sorted(old.keys() & new.keys()):
        for p in COMPARED:
            d = difference(new[key], old[key], p)
            interval = f"[{d.low:+.3f}, {d.high:+.3f}]" if d.has_interval else ""
            values = [f"{samples[key].quantile(p):.3f}" for samples in (old, new)]
            what = verdict(old[key], new[key], d)
            rows.append([*key, PERCENTILES[p], *values, f"{d.value:+.3f}", interval, what])
    return pd.DataFrame(rows, columns=COLUMNS)


def drop_rates(folder: Path) -> pd.Series:
    """Percent of the timestamps reached, by study, source, setting, executor and group of timers."""
    path = folder / "data" / TIMERS_FILE
    if not path.exists():
        return pd.Series(dtype=float)
    rows = with_keys(read_table(path).rename(columns=IN_FRAMES), "")
    sums = rows.groupby(KEYS[1:])[["skipped", "reached"]].sum()
    return (100 * sums["skipped"] / sums["reached"]).dropna()


def other_differences(old: Path, new: Path) -> Iterator[str]:
    """Sentences about what has no percentiles."""
    before, after = drop_rates(old), drop_rates(new)
    for key in before.index.intersection(after.index):
        if abs(after[key] - before[key]) >= TOLD_DROP_POINTS:
            yield f"dropped jobs, {' '.join(key)}: {before[key]:.2f} % before, {after[key]:.2f} % now"
    if all((folder / "claims.json").exists() for folder in (old, new)):
        claims: Any = [{c["claim"]: c["verdict"] for c in read_json(f / "claims.json")} for f in (old, new)]
        for claim in sorted(claims[0].keys() & claims[1].keys()):
            if claims[0][claim] != claims[1][claim]:
                yield f"verdict of {claim}: {claims[0][claim]} before, {claims[1][claim]} now"
    if all((folder / "facts.json").exists() for folder in (old, new)):
        modes = [read_json(folder / "facts.json")["mode"] for folder in (old, new)]
        if modes[0] != modes[1]:
            yield f"the modes differ ({modes[0]}, {modes[1]}): runs of other lengths have other maxima"


def table_of(rows: pd.DataFrame) -> Iterator[str]:
    """The lines of a table for a terminal, and how many rows have which verdict."""
    names = (" ".join(filter(None, key)) for key in rows[KEYS].to_numpy())
    cells = [[name, *row] for name, row in zip(names, rows[COLUMNS[6:]].to_numpy())]
    yield text_table(["", "", "old ms", "new ms", "difference", "95 % interval", ""], cells)
    counts = sorted(Counter(rows["verdict"]).items())
    yield "\n" + ", ".join(f"{n} {word}" for word, n in counts) + f", of {len(rows)} percentiles"


def compare_results(
    old: str, new: str, csv: str | None, gate: bool, across_loads: bool, **outputs: str | None
) -> int:
    """Prints what differs, and writes the table as CSV where that was asked for; with `gate`, what became worse (see
    gate.py). Raises InputError."""
    if gate:
        from hotpath_report.pages.gate import gate as judge

        return judge(old, new, across_loads, outputs)
    folders = Path(old), Path(new)
    before, after = map(read, folders)
    if across_loads:
        before, after = regardless_of_load(before, after)
    rows = compare(before, after)
    if rows.empty:
        raise nothing_in_common(old, new, before, after)
    if csv:
        write_output(Path(csv), "--csv", rows.to_csv(index=False))
    print(*table_of(rows), *other_differences(*folders), sep="\n")
    for folder, keys in zip(folders, (before.keys() - after.keys(), after.keys() - before.keys())):
        alone = sorted({" ".join(filter(None, key[:3])) for key in keys})
        if alone:
            print(f"only in {folder}: {', '.join(alone)}")
    return 0
