# SPDX-License-Identifier: Apache-2.0
"""Percentiles of OLD and NEW, their difference with its interval, and whether it lies beyond noise;
for reproductions also drop rates and verdicts, and for benchmarks their counters."""

from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from hotpath_report.bench_data import FILE, TIME, Bench, three_digits
from hotpath_report.comparison import sides
from hotpath_report.comparison.gate import gate as judge
from hotpath_report.comparison.sides import KEYS, NOTHING_MS, Key, Side, text_of
from hotpath_report.errors import InputError
from hotpath_report.pages import comparison_page
from hotpath_report.pages.writer import Table
from hotpath_report.paper.storage import TIMERS_FILE
from hotpath_report.statistics import PERCENTILES, Estimate, Samples, difference, percent_of
from hotpath_report.tables import read_json, show_json, text_table, write_output

COMPARED = (0.5, 0.99, 1.0)
TOLD_DROP_POINTS = 0.1
COLUMNS = [*KEYS, "percentile", "old_ms", "new_ms", "difference_ms", "interval_95_ms", "verdict"]


def verdict(old: Samples, new: Samples, estimate: Estimate) -> str:
    """Whether a difference lies beyond noise."""
    if old.exact and new.exact:
        return "the same" if abs(estimate.value) < NOTHING_MS else "differs (exact)"
    if not estimate.has_interval:
        return "no interval"
    return "beyond noise" if estimate.excludes(0) else "within noise"


def compare(old: Mapping[Key, Samples], new: Mapping[Key, Samples]) -> pd.DataFrame:
    """A row per percentile of each key that both sides have."""
    rows = []
    for key in sorted(old.keys() & new.keys()):
        for p in COMPARED:
            d = difference(new[key], old[key], p)
            interval = f"[{d.low:+.3f}, {d.high:+.3f}]" if d.has_interval else ""
            values = [f"{samples[key].quantile(p):.3f}" for samples in (old, new)]
            what = verdict(old[key], new[key], d)
            rows.append([*key, PERCENTILES[p], *values, f"{d.value:+.3f}", interval, what])
    return pd.DataFrame(rows, columns=COLUMNS)


def compare_counters(old: Path, new: Path) -> int:
    """Prints the medians of all counters of two `hotpath bench` folders. Raises InputError."""
    before, after = (Bench(folder).values for folder in (old, new))
    rows = []
    for key in sorted(before.keys() & after.keys()):
        if key[1] == TIME:  # compare.py of libbenchmark-tools compares times
            continue
        old_samples, new_samples = (Samples([v] for v in side[key]) for side in (before, after))
        d = difference(new_samples, old_samples, 0.5)
        cells = [three_digits(samples.quantile(0.5)) for samples in (old_samples, new_samples)]
        cells += [f"{d.value:+.3g}", f"[{d.low:+.3g}, {d.high:+.3g}]" if d.has_interval else ""]
        rows.append([" ".join(key), *cells, verdict(old_samples, new_samples, d)])
    if not rows:
        raise InputError(f"{old} and {new} have no counter in common, there is nothing to compare")
    header = ["counter", "old", "new", "difference", "95 % interval", ""]
    print(text_table(header, rows))
    print(f"{sum(row[-1] == 'beyond noise' for row in rows)} of {len(rows)} counters differ beyond noise.")
    print(f"Times: /usr/share/benchmark/compare.py benchmarks {old / FILE} {new / FILE}")
    show_json(pd.DataFrame(rows, columns=[*header[:-1], "verdict"]))
    return 0


def drop_rates(folder: Path) -> dict[Key, float]:
    """Dropped timestamps in percent, by study, source, setting, executor and group of timers."""
    if not (folder / "data" / TIMERS_FILE).exists():
        return {}
    sums = sides.timers_of(folder).groupby(KEYS[1:])[["skipped", "reached"]].sum()
    return {key: percent_of(skipped, reached) for key, skipped, reached in sums.itertuples() if reached}


def other_differences(folders: tuple[Path, Path]) -> Iterator[str]:
    """Sentences about differences in drop rates, verdicts and modes."""
    before, after = map(drop_rates, folders)
    for key in sorted(before.keys() & after.keys()):
        if abs(after[key] - before[key]) >= TOLD_DROP_POINTS:
            yield f"dropped jobs, {' '.join(key)}: {before[key]:.2f} % before, {after[key]:.2f} % now"
    if all((folder / "claims.json").exists() for folder in folders):
        found: Any = [{c["claim"]: c["verdict"] for c in read_json(f / "claims.json")} for f in folders]
        for claim in sorted(found[0].keys() & found[1].keys()):
            if found[0][claim] != found[1][claim]:
                yield f"verdict of {claim}: {found[0][claim]} before, {found[1][claim]} now"
    if all((folder / "facts.json").exists() for folder in folders):
        modes = [read_json(folder / "facts.json")["mode"] for folder in folders]
        if modes[0] != modes[1]:
            yield f"the modes differ ({', '.join(modes)}): maxima depend on the length of runs"


def compare_results(
    old: str,
    new: str,
    csv: str | None,
    gate: bool,
    across_loads: bool,
    page: str | None,
    **outputs: str | None,
) -> int:
    """Prints the differences, or runs the gate; writes the table as CSV. Raises InputError."""
    if gate:
        return judge(old, new, across_loads, outputs | {"page": page})
    folders = Path(old), Path(new)
    if all((folder / FILE).exists() for folder in folders):
        return compare_counters(*folders)
    both = [Side(sides.read(folder), {}, {}) for folder in folders]
    before, after = (side.samples for side in (sides.regardless_of_load(*both) if across_loads else both))
    rows = compare(before, after)
    if rows.empty:
        raise sides.nothing_in_common(old, new, before, after)
    if csv:
        write_output(Path(csv), "--csv", rows.to_csv(index=False))
    cells = [[text_of(key), *row] for key, row in zip(rows[KEYS].to_numpy(), rows[COLUMNS[6:]].to_numpy())]
    counts = ", ".join(f"{n} {word}" for word, n in sorted(Counter(rows["verdict"]).items()))
    sentences = list(other_differences(folders))
    print(text_table(["", "", "old ms", "new ms", "difference", "95 % interval", ""], cells))
    print(f"\n{counts}, of {len(rows)} percentiles", *sentences, sep="\n")
    show_json(rows)
    for folder, keys in zip(folders, (before.keys() - after.keys(), after.keys() - before.keys())):
        if keys:
            print(f"only in {folder}: {', '.join(sorted({text_of(key[:3]) for key in keys}))}")
    if page:
        header = ["", "percentile", "old ms", "new ms", "difference ms", "95 % interval", ""]
        table = Table("Differences", header, cells, numbers=True)
        comparison_page.write(Path(page), folders, (before, after), sentences, table)
    return 0
