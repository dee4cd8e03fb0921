# SPDX-License-Identifier: Apache-2.0
"""Which percentiles of NEW differ from those of OLD, with an interval of the difference, and whether beyond noise.

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

COMPARED = (0.5, 0.99, 1.0)
# Below it a difference is none: simulated values are whole nanoseconds.
NOTHING_MS = 1e-6


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
