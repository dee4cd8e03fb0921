# SPDX-License-Identifier: Apache-2.0
"""The data of the interactive part of a page: distributions and curves from the C++ library, jobs and outputs from
`hotpath report --json`."""

import base64
import contextlib
import hashlib
import json
import math
import tempfile
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hotpath_report import hotpath_command, style
from hotpath_report.errors import InputError, RunError
from hotpath_report.hotpath_command import PACKAGE
from hotpath_report.run import Run
from hotpath_report.shown_text import printable_content
from hotpath_report.statistics import Estimate, Samples
from hotpath_report.tables import NS_PER_MS, read_table

SCRIPT = PACKAGE / "web" / "page.js"
LARGEST_ANALYZED = 200_000_000  # bytes of jobs.csv, which `hotpath analyze` and `explain` read
POINTS_OF_DECADE = 20  # of the logarithmic tail of a distribution
LOGARITHMIC = 8  # ratio of the largest to the least value from which an axis is logarithmic
ENDS = ("value", "low", "high")

Bounds = dict[tuple[str, str, str], float]  # ms by executor, kind (chain or task) and name


@dataclass(frozen=True)
class Measured:
    """The samples (ms) of one chain or task in all runs, by executor."""

    kind: str  # chain or task
    name: str
    title: str
    measure: str
    figure: str  # id of the violins; empty: none
    runs: Sequence[Mapping[str, Samples]] = ()

    def samples(self, series: Sequence[dict[str, Any]]) -> list[Samples | None]:
        """The samples of each series."""
        return [self.runs[of["run"]].get(of["executor"]) for of in series]

    def target(
        self, samples: Iterable[Samples | None], marks: Sequence[dict[str, Any]] = ()
    ) -> dict[str, Any]:
        """The distributions, given for each series."""
        names = {key: getattr(self, key) for key in ("kind", "name", "title", "measure", "figure")}
        return names | {"curves": [curve(k, s) for k, s in enumerate(samples) if s], "marks": list(marks)}


def curve(series: int, samples: Samples) -> dict[str, Any]:
    """A distribution with its intervals, in ms rounded to nanoseconds: evenly up to the probability 0.9, then evenly
    on the logarithmic axis up to the last probability that the samples resolve, and 1."""
    n = len(samples)
    steps = math.floor(max(0.0, math.log10(n) - 1) * POINTS_OF_DECADE)
    tail = 1 - 0.1 * 10.0 ** -(np.arange(1, steps + 1) / POINTS_OF_DECADE)
    q = np.concatenate([np.arange(0, 46) / 50, np.round(tail, 12), [1.0]])
    columns = np.round(samples.estimates(q), 6).T.tolist()
    ends = {key: [None if math.isnan(v) else v for v in column] for key, column in zip(ENDS, columns)}
    return {"series": series, "n": n, "repetitions": len(samples.repetitions), "q": q.tolist(), **ends}


def looks_of(found: Sequence[tuple[str, str]]) -> list[dict[str, Any]]:
    """The looks of curves, given as executor and label."""
    dashes = style.dashes_of([executor for executor, _ in found])
    return [
        {"label": label, "colour": style.colour_of(executor), "dash": dash}
        for (executor, label), dash in zip(found, dashes)
    ]


def curves_of(found: Sequence[tuple[int, str, str]]) -> list[dict[str, Any]]:
    """The series of a document, given as number of the run, executor and label."""
    looks = looks_of([(executor, label) for _, executor, label in found])
    return [{"run": run, "executor": executor, **look} for (run, executor, _), look in zip(found, looks)]


def bounds_of(run: Run) -> Bounds:
    """The tightest bounds that `hotpath analyze` gives for a run; empty where it gives none, or would read long."""
    bounds = {(b["executor"], "task", b["task"]): float(b["ms"]) for b in run.facts.get("bounds", [])}
    jobs, graph = run.folder / "jobs.csv", run.facts["graph"].get("file")
    if not graph or not jobs.exists() or jobs.stat().st_size > LARGEST_ANALYZED:
        return bounds
    with tempfile.TemporaryDirectory() as folder, contextlib.suppress(InputError, RunError):
        path = Path(folder) / "bounds.csv"
        hotpath_command.output_of("analyze", graph, "--trace", run.folder, "--csv", path)
        rows = read_table(path, ["executor", "kind", "name", "bound_ns"])
        rows = rows[rows["kind"].isin(["chain", "task"])]
        for key, bound in rows.groupby(["executor", "kind", "name"])["bound_ns"].min().items():
            bounds[key] = float(bound) / NS_PER_MS
    return bounds


def marks_of(
    measured: Measured, runs: Sequence[Run], bounds: Sequence[Bounds], series: Sequence[dict[str, Any]]
) -> list[dict[str, Any]]:
    """Bounds, deadlines and the computation on the path."""
    marks: set[tuple[float, str, int | None]] = set()
    if measured.kind == "chain" and runs[0].facts.get("chains", [measured.name])[:1] == [measured.name]:
        marks |= {(x["ms"], x["label"], None) for x in runs[0].facts.get("limits", []) if x["ms"] > 0}
    for run in (run for run in runs if measured.kind == "task" and run.has_summary()):
        counts = run.timer_counts()
        deadlines = counts["deadline_ms"][counts["task"] == measured.name]
        marks |= {(ms, "deadline", None) for ms in deadlines if ms}
    for number, of in enumerate(series):
        if bound := bounds[of["run"]].get((of["executor"], measured.kind, measured.name)):
            marks.add((round(bound, 6), f"bound of {of['label']}", number))
    return [{"label": label, "ms": ms, "series": number} for ms, label, number in sorted(marks)]


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
    data["targets"] = [m.target(m.samples(series), marks_of(m, runs, bounds, series)) for m in measured]
    return data


def run_of_samples(name: str, source: str, executors: Sequence[str]) -> dict[str, Any]:
    """What stands in the place of a run that is known by its samples alone."""
    of_jobs = {"tasks": [], "notes": [], "warm_up_ns": 0}
    return {"name": name, "source": source, "executors": executors, **of_jobs}


def without_jobs(**parts: Any) -> dict[str, Any]:
    """What the interactive part shows of a page without stored runs: these parts of a document()."""
    nothing: dict[str, Any] = {"causes": [], "rules": [], "series": [], "targets": [], "runs": []}
    return nothing | parts


def without_targets(executors: Mapping[str, Sequence[str]]) -> dict[str, Any]:
    """As document(), of samples alone: a series for each executor of each source, without targets."""
    found = [(k, e, f"{e}, {source}") for k, (source, names) in enumerate(executors.items()) for e in names]
    runs = [run_of_samples(source, source, names) for source, names in executors.items()]
    return without_jobs(series=curves_of(found), runs=runs)


Points = Mapping[float, Estimate]  # by x


def plot(title: str, x: str, found: Sequence[tuple[str, str, Points]], figure: str = "") -> dict[str, Any]:
    """Lines with their intervals over `x`, given as executor, label and points, in place of the page's static
    `figure`. Latencies that differ much have a logarithmic axis."""
    lines = []
    for (_, _, points), look in zip(found, looks_of([(executor, label) for executor, label, _ in found])):
        xs = sorted(points)
        rows = [[None if math.isnan(v) else round(v, 6) for v in points[at]] for at in xs]
        columns: dict[str, Any] = {key: [row[k] for row in rows] for k, key in enumerate(ENDS)}
        lines.append({**look, "x": list(map(float, xs)), **columns})
    lines = [line for line in lines if line["x"]]
    values = [value for line in lines for value in line["value"] if value is not None]
    far_apart = bool(values) and min(values) > 0 and max(values) > LOGARITHMIC * min(values)
    return {"title": title, "x": x, "log": "(ms)" in title and far_apart, "lines": lines, "figure": figure}


def embedded(data: dict[str, Any]) -> dict[str, str]:
    """What a page embeds: the document, deflated and in base64, the script, and a content security policy: no requests,
    and only this script. Raises RunError if the script is not installed."""
    try:
        script = SCRIPT.read_text(encoding="ascii").strip()
    except OSError as error:
        raise RunError(f"{SCRIPT}: {error.strerror}; install hotpath again") from None
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).encode()
    digest = base64.b64encode(hashlib.sha256(f"\n{script}\n".encode()).digest()).decode()
    policy = f"default-src 'none'; script-src 'sha256-{digest}'; style-src 'unsafe-inline'; img-src data:"
    return {"data": base64.b64encode(zlib.compress(text, 9)).decode(), "script": script, "policy": policy}
