# SPDX-License-Identifier: Apache-2.0
"""The data of the interactive part of a page about runs: distributions from the C++ library, jobs
and outputs from `hotpath report --json`."""

import base64
import contextlib
import hashlib
import json
import math
import tempfile
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hotpath_report import hotpath_command, style
from hotpath_report.errors import InputError, RunError
from hotpath_report.hotpath_command import PACKAGE
from hotpath_report.run import Run
from hotpath_report.shown_text import printable_content
from hotpath_report.statistics import Samples, Values
from hotpath_report.tables import NS_PER_MS, read_table

SCRIPT = PACKAGE / "web" / "page.js"
LARGEST_ANALYZED = 200_000_000  # bytes of jobs.csv, which `hotpath analyze` and `explain` read
POINTS_OF_DECADE = 20  # of the logarithmic tail of a distribution

ByExecutor = dict[str, Samples]


@dataclass(frozen=True)
class Measured:
    """The samples (ms) of one chain or task in all runs."""

    kind: str  # chain or task
    name: str
    title: str
    measure: str
    figure: str  # id of the violins; empty: none
    runs: Sequence[ByExecutor]


def probabilities(n: int) -> Values:
    """Where a distribution of `n` samples is drawn: evenly up to 0.9, then evenly on the
    logarithmic axis up to the last probability that `n` samples resolve, and 1."""
    body = np.arange(0, 46) / 50
    decades = max(0.0, math.log10(n) - 1)
    tail = 1 - 0.1 * 10.0 ** -(np.arange(1, math.floor(decades * POINTS_OF_DECADE) + 1) / POINTS_OF_DECADE)
    return np.concatenate([body, np.round(tail, 12), [1.0]])


def curve(series: int, samples: Samples) -> dict[str, Any]:
    """A distribution with its intervals, in ms rounded to nanoseconds."""
    q = probabilities(len(samples))
    columns = np.round(samples.estimates(q), 6).T.tolist()
    value, low, high = ([None if math.isnan(v) else v for v in column] for column in columns)
    return {
        "series": series,
        "n": len(samples),
        "repetitions": len(samples.repetitions),
        "q": q.tolist(),
        "value": value,
        "low": low,
        "high": high,
    }


def curves_of(found: Sequence[tuple[int, str, str]]) -> list[dict[str, Any]]:
    """The looks of curves, given as number of the run, executor and label."""
    dashes = style.dashes_of([executor for _, executor, _ in found])
    return [
        {"run": run, "executor": executor, "label": label, "colour": style.colour_of(executor), "dash": dash}
        for (run, executor, label), dash in zip(found, dashes)
    ]


def bounds_of(run: Run) -> dict[tuple[str, str, str], float]:
    """The tightest bound (ms) of each (executor, kind, name) that `hotpath analyze` gives for a run, in
    which kind is chain or task; empty where it gives none, or would read long."""
    bounds = {(b["executor"], "task", b["task"]): float(b["ms"]) for b in run.facts.get("bounds", [])}
    jobs, graph = run.folder / "jobs.csv", run.facts["graph"].get("file")
    if not graph or not jobs.exists() or jobs.stat().st_size > LARGEST_ANALYZED:
        return bounds
    with tempfile.TemporaryDirectory() as folder, contextlib.suppress(InputError, RunError):
        path = Path(folder) / "bounds.csv"
        hotpath_command.output_of("analyze", graph, "--trace", run.folder, "--csv", path)
        rows = read_table(path, ["executor", "kind", "name", "bound_ns"])
        rows = rows[rows["kind"].isin(["hot_path", "task"])].replace({"kind": {"hot_path": "chain"}})
        for key, bound in rows.groupby(["executor", "kind", "name"])["bound_ns"].min().items():
            bounds[key] = float(bound) / NS_PER_MS
    return bounds


def marks_of(
    measured: Measured, runs: Sequence[Run], bounds: Sequence[dict[tuple[str, str, str], float]], series: Any
) -> list[dict[str, Any]]:
    """Bounds, deadlines and the computation on the path."""
    marks: set[tuple[float, str, int | None]] = set()
    if measured.kind == "chain" and runs[0].facts.get("chains", [measured.name])[:1] == [measured.name]:
        marks |= {(x["ms"], x["label"], None) for x in runs[0].facts.get("limits", []) if x["ms"] > 0}
    if measured.kind == "task":
        with_summary = [run for run in runs if (run.folder / "summary.json").exists()]
        rows = (row for run in with_summary for row in run.timer_counts().itertuples())
        marks |= {
            (row.deadline_ms, "deadline", None)
            for row in rows
            if row.task == measured.name and row.deadline_ms
        }
    for number, of in enumerate(series):
        if bound := bounds[of["run"]].get((of["executor"], measured.kind, measured.name)):
            marks.add((round(bound, 6), f"bound of {of['label']}", number))
    return [{"label": label, "ms": ms, "series": number} for ms, label, number in sorted(marks)]


def target_of(
    measured: Measured, samples: Sequence[Samples | None], marks: list[dict[str, Any]]
) -> dict[str, Any]:
    """The distributions of one chain or task, given for each series."""
    names = {key: getattr(measured, key) for key in ("kind", "name", "title", "measure", "figure")}
    return names | {"curves": [curve(k, s) for k, s in enumerate(samples) if s], "marks": marks}


def samples_of(measured: Measured, series: Sequence[dict[str, Any]]) -> list[Samples | None]:
    """The samples of each series."""
    return [measured.runs[of["run"]].get(of["executor"]) for of in series]


def stored_part(runs: Sequence[Run], names: Sequence[str]) -> dict[str, Any]:
    """Jobs, outputs and causes of stored runs, without distributions."""
    if not runs:
        return {"causes": [], "rules": [], "runs": []}
    stored = json.loads(hotpath_command.output_of("feed", "page", *(run.folder for run in runs)))
    data: dict[str, Any] = printable_content(stored)
    for run, name, of in zip(runs, names, data["runs"]):
        of |= {"name": name, "source": run.facts["kind"], "warm_up_ns": round(run["warm_up_s"] * 1e9)}
    return data


def document(runs: Sequence[Run], names: Sequence[str], measured: Sequence[Measured]) -> dict[str, Any]:
    """Everything that the interactive part shows; web/src/data.ts describes it."""
    data = stored_part(runs, names)
    data["series"] = series = curves_of(
        [
            (number, executor, f"{executor} in {names[number]}" if len(runs) > 1 else executor)
            for number, run in enumerate(runs)
            for executor in run.executors
        ]
    )
    bounds = [bounds_of(run) for run in runs]
    data["targets"] = [
        target_of(m, samples_of(m, series), marks_of(m, runs, bounds, series)) for m in measured
    ]
    return data


def run_of_samples(name: str, source: str, executors: Sequence[str]) -> dict[str, Any]:
    """What stands in the place of a run that is known by its samples alone."""
    return {
        "name": name,
        "source": source,
        "executors": executors,
        "tasks": [],
        "notes": [],
        "warm_up_ns": 0,
    }


def without_jobs(**parts: Any) -> dict[str, Any]:
    """What the interactive part shows of a page without stored runs: these parts of a document()."""
    nothing: dict[str, Any] = {"causes": [], "rules": [], "series": [], "targets": [], "runs": []}
    return nothing | parts


def distributions(sources: Sequence[str], measured: Sequence[Measured]) -> dict[str, Any]:
    """As document(), of samples alone: a series for each executor of each source."""
    executors = [list(dict.fromkeys(e for m in measured for e in m.runs[k])) for k in range(len(sources))]
    series = curves_of([(k, e, f"{e}, {s}") for k, s in enumerate(sources) for e in executors[k]])
    return without_jobs(
        series=series,
        targets=[target_of(m, samples_of(m, series), []) for m in measured],
        runs=[run_of_samples(s, s, names) for s, names in zip(sources, executors)],
    )


@dataclass(frozen=True)
class Interactive:
    """What a page embeds."""

    data: str  # deflated JSON in base64
    script: str

    def policy(self) -> str:
        """The page's content security policy: no requests, and only its own script."""
        digest = base64.b64encode(hashlib.sha256(f"\n{self.script}\n".encode()).digest()).decode()
        style_and_images = "style-src 'unsafe-inline'; img-src data:"
        return f"default-src 'none'; script-src 'sha256-{digest}'; {style_and_images}"


def embedded(data: dict[str, Any]) -> Interactive:
    """The document and the script. Raises RunError if the script is not installed."""
    try:
        script = SCRIPT.read_text(encoding="ascii").strip()
    except OSError as error:
        raise RunError(f"{SCRIPT}: {error.strerror}; install hotpath again") from None
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).encode()
    return Interactive(base64.b64encode(zlib.compress(text, 9)).decode(), script)
