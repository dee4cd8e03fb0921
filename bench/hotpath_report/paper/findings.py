# SPDX-License-Identifier: Apache-2.0
"""Results of checks, and helpers shared by checks."""

import math
import tomllib
from collections.abc import Iterable, Sized
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd

from hotpath_report.errors import Missing
from hotpath_report.paper.evidence import Evidence
from hotpath_report.statistics import Estimate, Samples

REPRODUCED, PARTLY, NOT, NO_DATA = "reproduced", "partly", "not", "no data"

CLAIMS: dict[str, Any] = tomllib.loads(Path(__file__).with_name("claims.toml").read_text(encoding="utf-8"))
LIMITS: Any = SimpleNamespace(**CLAIMS["limits"])


@dataclass(frozen=True)
class Finding:
    """A verdict with its reason, as a sentence and in short."""

    verdict: str
    text: str
    short: str


TOO_FEW = Finding(NO_DATA, "too few samples for an interval", "too few")


def graded(good: int | bool, of: int | bool, some: int | bool | None = None) -> str:
    """Reproduced if all are good, partly if some are."""
    return REPRODUCED if good == of else PARTLY if (good if some is None else some) else NOT


def percents(values: Iterable[float]) -> str:
    """60 / 80 / 90 %."""
    return " / ".join("–" if math.isnan(v) else f"{v:.3g}" for v in values) + " %"


def above(estimate: Estimate, neutral: float) -> bool:
    """Whether the estimate lies above `neutral` beyond noise; exact values have no noise."""
    return estimate.value > neutral and (not estimate.has_interval or estimate.excludes(neutral))


def too_few(*groups: Samples) -> bool:
    """Whether a measurement was too short for an interval, and so for a verdict."""
    return any(not s.exact and not s.resampled for s in groups)


def need(*data: Sized) -> None:
    """Raises Missing if any of `data` is empty."""
    if not all(map(len, data)):
        raise Missing


def paper_rows(evidence: Evidence) -> pd.DataFrame:
    """Rows of Table I with the paper's release cost; bounds in ms, infinite if there is none."""
    rows = evidence.table("wcrt_table.csv")
    rows = rows[rows["delta_of"] == "paper"]
    need(rows)
    return rows.assign(bound_ms=(rows["bound_ns"] / 1e6).fillna(math.inf))
