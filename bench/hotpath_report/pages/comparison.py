# SPDX-License-Identifier: Apache-2.0
"""Cells of tables that compare samples with a baseline."""

from typing import Any

from hotpath_report.statistics import Samples, rank_test, ratio

HEADER = [
    "samples / runs",
    *("median ms", "p99 ms", "worst ms"),
    *("worst-case ratio", "Cliff's delta", "rank test p"),
]


def percentile_cells(samples: Samples) -> list[str]:
    """Median, 99th percentile and worst value with their intervals."""
    return [samples.estimate(p).text(1) for p in (0.5, 0.99, 1.0)]


def compared(samples: Samples, baseline: Samples | None) -> list[Any]:
    """Cells below HEADER; without a baseline the comparison is empty."""
    cells = [f"{len(samples)} / {len(samples.repetitions)}", *percentile_cells(samples)]
    if not baseline:
        return [*cells, "", "", ""]
    test = rank_test(samples, baseline)
    delta = f"{test.cliffs_delta.text(2)} ({test.magnitude})"
    return [*cells, ratio(baseline, samples, 1.0).text(2), delta, test.p_text]
