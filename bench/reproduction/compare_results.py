# SPDX-License-Identifier: Apache-2.0
"""Which percentiles of NEW differ from those of OLD, with an interval of the difference, and whether beyond noise;
of reproductions also which drop rates and which verdicts differ.

Both are folders of reproductions (data/hot_path.csv.gz), or both of runs (chains.csv, and jobs.csv where it was kept).
"""

import argparse
import csv
import os
import sys
from pathlib import Path

import evidence
from inference import PERCENTILE_NAMES, Samples, difference
from plots import InputError, run_script
from report import ReportedRun
from runner import read_json

COMPARED = (0.5, 0.99, 1.0)
# Below it a difference is none: simulated values are whole nanoseconds.
NOTHING_MS = 1e-6
TOLD_DROP_POINTS = 0.1


def read_reproduction(folder):
    return evidence.read_samples(folder / "data")


def read_run(folder):
    run, samples = ReportedRun(folder), {}
    for what, found in (("hot path", run.chains), ("response", run.timers)):
        for name, executors in found.items():
            for executor, values in executors.items():
                for k, repetition in enumerate(values.repetitions):
                    samples[(what, name, run.source, f"{run.run['load_percent']:g} %", executor, "", str(k))] = list(
                        repetition
                    )
    return samples


def read(folder):
    """{key without repetition: Samples}"""
    folder = Path(folder)
    if (folder / "data" / evidence.HOT_PATH_FILE).exists():
        flat = read_reproduction(folder)
    elif (folder / "run.json").exists():
        flat = read_run(folder)
    else:
        raise InputError(
            f"{folder}: neither a reproduction (data/{evidence.HOT_PATH_FILE}) nor a run (run.json); give a folder of"
            " `reproduce_paper.sh` or of `hotpath`"
        )
    grouped = {}
    for key, values in flat.items():
        grouped.setdefault(key[:-1], []).append(values)
    return {key: Samples(repetitions, exact=key[2] == "simulated") for key, repetitions in grouped.items()}


def verdict(old, new, estimate):
    if old.exact and new.exact:
        return "the same" if abs(estimate.value) < NOTHING_MS else "differs (exact)"
    if not estimate.has_interval:
        return "no interval"
    return "beyond noise" if estimate.excludes(0) else "within noise"


def compare(old, new):
    rows = []
    for key in sorted(old.keys() & new.keys()):
        for p in COMPARED:
            before, after = old[key], new[key]
            d = difference(after, before, p)
            interval = f"[{d.low:+.3f}, {d.high:+.3f}]" if d.has_interval else ""
            rows.append(
                [
                    *key,
                    PERCENTILE_NAMES[p],
                    f"{before.quantile(p):.3f}",
                    f"{after.quantile(p):.3f}",
                    f"{d.value:+.3f}",
                    interval,
                    verdict(before, after, d),
                ]
            )
    return rows


def drop_rates(folder):
    """{(study, source, setting, executor, tasks): % of the timestamps reached} of a reproduction."""
    path = Path(folder) / "data" / evidence.TIMERS_FILE
    totals = {}
    for row in evidence.read_table(path) if path.exists() else []:
        key = (row["study"], row["source"], f"{row['utilisation_percent']} %", row["executor"])
        total = totals.setdefault((*key, evidence.group_of(row["task"]) or row["task"]), [0, 0])
        total[0] += int(row["skipped"])
        total[1] += int(row["reached"])
    return {key: 100 * skipped / reached for key, (skipped, reached) in totals.items() if reached}


def verdicts(folder):
    return {c["claim"]: c["verdict"] for c in read_json(Path(folder) / "claims.json") or []}


def other_differences(old, new):
    """Lines about what has no percentiles."""
    lines = []
    before, after = drop_rates(old), drop_rates(new)
    for key in sorted(before.keys() & after.keys()):
        if abs(after[key] - before[key]) >= TOLD_DROP_POINTS:
            lines.append(f"dropped jobs, {' '.join(key)}: {before[key]:.2f} % before, {after[key]:.2f} % now")
    before, after = verdicts(old), verdicts(new)
    for claim in before.keys() & after.keys():
        if before[claim] != after[claim]:
            lines.append(f"verdict of {claim}: {before[claim]} before, {after[claim]} now")
    modes = [(read_json(Path(folder) / "facts.json") or {}).get("mode") for folder in (old, new)]
    if None not in modes and modes[0] != modes[1]:
        lines.append(f"the modes differ ({modes[0]}, {modes[1]}): runs of other lengths have other maxima")
    return lines


def only_in_one(old, new, names):
    lines = []
    for name, here, there in zip(names, (old, new), (new, old)):
        alone = sorted({" ".join(part for part in key[:3] if part) for key in here.keys() - there.keys()})
        if alone:
            lines.append(f"only in {name}: {', '.join(alone)}")
    return lines


HEADER = [
    "quantity",
    "study",
    "source",
    "setting",
    "executor",
    "tasks",
    "percentile",
    "old_ms",
    "new_ms",
    "difference_ms",
    "interval_95_ms",
    "verdict",
]


def print_table(rows):
    names = [" ".join(part for part in row[:6] if part) for row in rows]
    width = max(map(len, names))
    print(f"{'':<{width}}  {'':>5} {'old ms':>10} {'new ms':>10} {'difference':>11}  {'95 % interval':<20} ")
    print("-" * (width + 80))
    for name, row in zip(names, rows):
        print(f"{name:<{width}}  {row[6]:>5} {row[7]:>10} {row[8]:>10} {row[9]:>11}  {row[10]:<20} {row[11]}")
    counts = {}
    for row in rows:
        counts[row[11]] = counts.get(row[11], 0) + 1
    print("\n" + ", ".join(f"{n} {word}" for word, n in sorted(counts.items())) + f", of {len(rows)} percentiles")


def run(arguments):
    try:
        old, new = read(arguments.old), read(arguments.new)
    except evidence.BadResults as error:
        raise InputError(str(error)) from None
    rows = compare(old, new)
    if not rows:
        raise InputError(
            f"{arguments.old} and {arguments.new} have no executor and setting in common, there is nothing to compare"
        )
    try:
        print_table(rows)
        for line in other_differences(arguments.old, arguments.new):
            print(line)
        for line in only_in_one(old, new, (arguments.old, arguments.new)):
            print(line)
        sys.stdout.flush()
    except BrokenPipeError:  # the reader has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    if arguments.csv:
        with open(arguments.csv, "w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows([HEADER, *rows])


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("old", metavar="OLD")
    parser.add_argument("new", metavar="NEW")
    parser.add_argument("--csv", metavar="FILE", help="also write the table to this file")
    return run_script(run, parser.parse_args())


if __name__ == "__main__":
    sys.exit(main())
