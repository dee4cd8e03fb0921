# SPDX-License-Identifier: Apache-2.0
"""Which percentiles of NEW differ from those of OLD, with an interval of the difference, and whether beyond noise; of
reproductions also which drop rates and which verdicts differ."""

import os
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd

from hotpath_report.errors import InputError
from hotpath_report.pages.run_report import ReportedRun
from hotpath_report.paper.storage import (
    HOT_PATH_FILE,
    RESPONSES_FILE,
    SETTING,
    TIMERS_FILE,
    read_samples,
)
from hotpath_report.paper.evidence import read_table
from hotpath_report.paper.runner import facts_of
from hotpath_report.samples import group_of, samples_by
from hotpath_report.statistics import PERCENTILES, Estimate, Samples, difference

COMPARED = (0.5, 0.99, 1.0)
# Below it a difference is none: simulated values are whole nanoseconds.
NOTHING_MS = 1e-6
TOLD_DROP_POINTS = 0.1
KEYS = ["quantity", "study", "source", "setting", "executor", "tasks"]
COLUMNS = [*KEYS, "percentile", "old_ms", "new_ms", "difference_ms", "interval_95_ms", "verdict"]

Key = tuple[str, ...]  # below KEYS


def read_reproduction(folder: Path) -> dict[Key, Samples]:
    """Samples of a reproduction's data/."""
    hot_path = read_samples(folder / "data" / HOT_PATH_FILE).rename(columns={"load_percent": "setting"})
    responses = read_samples(folder / "data" / RESPONSES_FILE)
    responses["tasks"] = responses["task"].map(lambda task: group_of(task) or task)
    frames = (
        hot_path.assign(quantity="hot path", tasks="").rename(columns={"hot_path_ms": "ms"}),
        responses.assign(quantity="response").rename(columns={"response_ms": "ms"}),
    )
    found: dict[Key, Samples] = {}
    for frame in frames:
        frame = frame.assign(setting=frame["setting"].map(lambda s: f"{s:g} %"))
        for source, rows in frame.groupby("source"):
            found |= samples_by(rows, KEYS, "ms", source == "simulated")
    return found


def read_run(folder: Path) -> dict[Key, Samples]:
    """Samples of a run."""
    run = ReportedRun(folder)
    quantities = {"Chain": "hot path", "Timer": "response"}
    setting = f"{run.run['load_percent']:g} %"
    return {
        (quantities[kind], name, run.run.source, setting, executor, ""): samples
        for (kind, name), executors in run.samples.items()
        for executor, samples in executors.items()
    }


def read(folder: Path) -> dict[Key, Samples]:
    """Samples of either kind of folder. Raises InputError."""
    if (folder / "data" / HOT_PATH_FILE).exists():
        return read_reproduction(folder)
    if (folder / "run.json").exists():
        return read_run(folder)
    raise InputError(
        f"{folder}: neither a reproduction (data/{HOT_PATH_FILE}) nor a run (run.json); give a folder of"
        " `reproduce_paper.sh` or of `hotpath`"
    )


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
            rows.append(
                [*key, PERCENTILES[p], *values, f"{d.value:+.3f}", interval, verdict(old[key], new[key], d)]
            )
    return pd.DataFrame(rows, columns=COLUMNS)


def drop_rates(folder: Path) -> pd.Series:
    """Percent of the timestamps reached, by study, source, setting, executor and group of timers."""
    path = folder / "data" / TIMERS_FILE
    if not path.exists():
        return pd.Series(dtype=float)
    rows = read_table(path)
    rows["tasks"] = rows["task"].map(lambda task: group_of(task) or task)
    rows["setting"] = rows[SETTING].map(lambda percent: f"{percent} %")
    sums = rows.groupby(KEYS[1:])[["skipped", "reached"]].sum()
    return (100 * sums["skipped"] / sums["reached"]).dropna()


def verdicts(folder: Path) -> dict[str, str]:
    """Verdict of each claim of a reproduction."""
    claims: Any = facts_of(folder, "claims.json") or []
    return {c["claim"]: c["verdict"] for c in claims}


def other_differences(old: Path, new: Path) -> Iterator[str]:
    """Sentences about what has no percentiles."""
    before, after = drop_rates(old), drop_rates(new)
    for key in before.index.intersection(after.index):
        if abs(after[key] - before[key]) >= TOLD_DROP_POINTS:
            yield f"dropped jobs, {' '.join(key)}: {before[key]:.2f} % before, {after[key]:.2f} % now"
    claims, now = verdicts(old), verdicts(new)
    for claim in sorted(claims.keys() & now.keys()):
        if claims[claim] != now[claim]:
            yield f"verdict of {claim}: {claims[claim]} before, {now[claim]} now"
    modes = [(facts_of(folder, "facts.json") or {}).get("mode") for folder in (old, new)]
    if None not in modes and modes[0] != modes[1]:
        yield f"the modes differ ({modes[0]}, {modes[1]}): runs of other lengths have other maxima"


def only_in(folder: Path, here: dict[Key, Samples], there: dict[Key, Samples]) -> Iterator[str]:
    """A sentence about what the other one lacks."""
    alone = sorted({" ".join(filter(None, key[:3])) for key in here.keys() - there.keys()})
    if alone:
        yield f"only in {folder}: {', '.join(alone)}"


def print_table(rows: pd.DataFrame) -> None:
    """The table for a terminal, and how many rows have which verdict."""
    names = [" ".join(filter(None, key)) for key in rows[KEYS].to_numpy()]
    width = max(map(len, names))
    print(f"{'':<{width}}  {'':>5} {'old ms':>10} {'new ms':>10} {'difference':>11}  {'95 % interval':<20} ")
    print("-" * (width + 80))
    for name, (p, old, new, change, interval, word) in zip(names, rows[COLUMNS[6:]].to_numpy()):
        print(f"{name:<{width}}  {p:>5} {old:>10} {new:>10} {change:>11}  {interval:<20} {word}")
    counts = sorted(Counter(rows["verdict"]).items())
    print("\n" + ", ".join(f"{n} {word}" for word, n in counts) + f", of {len(rows)} percentiles")


def compare_results(old: str, new: str, csv: str | None) -> None:
    """Prints what differs, and writes the table as CSV where that was asked for. Raises InputError."""
    folders = Path(old), Path(new)
    before, after = map(read, folders)
    rows = compare(before, after)
    if rows.empty:
        raise InputError(
            f"{old} and {new} have no executor and setting in common, there is nothing to compare"
        )
    try:
        print_table(rows)
        for sentence in other_differences(*folders):
            print(sentence)
        for sentence in (*only_in(folders[0], before, after), *only_in(folders[1], after, before)):
            print(sentence)
        sys.stdout.flush()
    except BrokenPipeError:  # the reader has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    if csv:
        rows.to_csv(csv, index=False)
