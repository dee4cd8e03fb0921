# SPDX-License-Identifier: Apache-2.0
"""What a check answers with, and what the checks share."""

import math
from collections.abc import Iterable, Sized
from dataclasses import dataclass

import pandas as pd

from hotpath_report.errors import Missing
from hotpath_report.paper.evidence import Evidence
from hotpath_report.statistics import Estimate, Samples

REPRODUCED, PARTLY, NOT, NO_DATA = "reproduced", "partly", "not", "no data"
VERDICTS = (REPRODUCED, PARTLY, NOT, NO_DATA)

STOCK = ("default", "static", "events-ro", "events-re")
WAIT_SETS = ("default", "static")
PAPERS_OWN = ("rm-ro", "rm-re", "edf-ro", "edf-re")
OTHERS_ON_HOT_PATH = ("default", "static", "events-ro")
LIVE_LOSS_TOLERANCE_PERCENT = 0.1
REPEATEDLY_PERCENT = (
    LIVE_LOSS_TOLERANCE_PERCENT  # what counts as lost there must be more than what is excused here
)
TEN_PERCENT_RANGE = (5, 20)
TABLE_TOLERANCE_MS = 0.005
PAPER_DELTA_MS, PAPER_TOTAL_DELTA_MS, TOTAL_DELTA_TOLERANCE_MS = 0.12, 0.84, 0.01
ALMOST_90_RANGE = (85, 90)
PAPER_SLOWDOWN, SLOWDOWN_FACTOR = 2.6, 1.25
LARGE_EFFECT, LARGEST_P = 0.474, 0.01
PAPER_RATE_HZ, RATE_TOLERANCE_PERCENT = 10, 2
TASKS = 7
DEADLINES_MS = {"IMU": 30, "Camera": 84, "LiDAR": 200}  # the periods


@dataclass(frozen=True)
class Finding:
    """A verdict with its reason, in a sentence and in a few characters."""

    verdict: str
    text: str
    short: str


TOO_FEW = Finding(NO_DATA, "too few samples for an interval", "too few")


def graded(good: int | bool, of: int | bool, some: int | bool | None = None) -> str:
    """Reproduced where all are good, partly where some are."""
    return REPRODUCED if good == of else PARTLY if (good if some is None else some) else NOT


def percents(values: Iterable[float]) -> str:
    """60 / 80 / 90 %."""
    return " / ".join("–" if math.isnan(v) else f"{v:.3g}" for v in values) + " %"


def above(estimate: Estimate, neutral: float) -> bool:
    """Whether it lies above `neutral` beyond noise; what is exact has no noise."""
    return estimate.value > neutral and (not estimate.has_interval or estimate.excludes(neutral))


def too_few(*groups: Samples) -> bool:
    """Samples of a measurement that was too brief for an interval: they decide nothing."""
    return any(not s.exact and not s.resampled for s in groups)


def need(*data: Sized) -> None:
    """Raises Missing unless there are data of each kind."""
    if not all(map(len, data)):
        raise Missing


def paper_rows(evidence: Evidence) -> pd.DataFrame:
    """Rows of Table I with the paper's release cost; a bound that does not exist is infinite (ms)."""
    rows = evidence.table("wcrt_table.csv")
    rows = rows[rows["delta_of"] == "paper"]
    need(rows)
    return rows.assign(bound_ms=(rows["bound_ns"] / 1e6).fillna(math.inf))
