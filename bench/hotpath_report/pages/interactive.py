# SPDX-License-Identifier: Apache-2.0
"""The data of the interactive part of a page: distributions and curves, and jobs and outputs of stored runs."""

import base64
import contextlib
import hashlib
import json
import math
import zlib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from hotpath_report import style
from hotpath_report.errors import InputError, RunError
from hotpath_report.files import NS_PER_MS
from hotpath_report.hotpath_command import PACKAGE, ask, output_of
from hotpath_report.run import Run
from hotpath_report.shown_text import printable, printable_content
from hotpath_report.statistics import Estimate, Samples

SCRIPT = PACKAGE / "web" / "page.js"
LOGARITHMIC = 8  # ratio of the largest to the least value from which an axis is logarithmic
ENDS = ("value", "low", "high")

Series = Sequence[dict[str, Any]]
Mark = tuple[float, str, int | None]  # ms, label and number of the series; None: of all
Bounds = dict[tuple[str, str, str], float]  # ms by executor, kind (chain or task) and name

# What a distribution is of: kind (chain or task), name, title, measure, and the id of its violins or nothing; and the
# samples (ms) by executor in each run.
Measured = tuple[dict[str, str], Sequence[Mapping[str, Samples]]]


def target(
    what: dict[str, str], runs: Sequence[Mapping[str, Samples]], series: Series, marks: Iterable[Mark] = ()
) -> dict[str, Any]:
    """The distributions of each series, with marks."""
    found = (runs[of["run"]].get(of["executor"]) for of in series)
    curves = [{"series": k, **samples.curve()} for k, samples in enumerate(found) if samples]
    ordered = sorted(marks, key=lambda mark: mark[0])
    shown = [{"label": label, "ms": ms, "series": number} for ms, label, number in ordered]
    return what | {"curves": curves, "marks": shown}


def curves_of(found: Sequence[tuple[int, str, str]]) -> list[dict[str, Any]]:
    """The series of a document, given as number of the run, executor and label."""
    dashes = style.dashes_of([executor for _, executor, _ in found])
    return [
        {"run": run, "executor": executor, "label": label, "colour": style.colour_of(executor), "dash": dash}
        for (run, executor, label), dash in zip(found, dashes)
    ]


def bounds_of(run: Run) -> Bounds:
    """The tightest bounds that `hotpath analyze` gives for a run; empty where it gives none, or would read long."""
    bounds = {(b["executor"], "task", b["task"]): float(b["ms"]) for b in run.facts.get("bounds", [])}
    graph = run.facts["graph"].get("file")
    if not graph or not run.is_quickly_read():
        return bounds
    with contextlib.suppress(InputError, RunError):
        tightest: Bounds = {}
        for row in json.loads(output_of("analyze", graph, "--trace", run.folder, "--json")):
            key = (printable(row["executor"]), row["kind"], printable(row["name"]))
            if row["bound_ns"] is not None:  # a method may bound other rows only
                tightest[key] = min(tightest.get(key, math.inf), row["bound_ns"] / NS_PER_MS)
        bounds |= tightest
    return bounds


def marks_of(
    what: dict[str, str], runs: Sequence[Run], bounds: Sequence[Bounds], series: Series
) -> list[Mark]:
    """Bounds, deadlines and the computation on the path."""
    marks: set[Mark] = set()
    kind, name = what["kind"], what["name"]
    if kind == "chain" and runs[0].facts.get("chains", [name])[:1] == [name]:
        marks |= {(x["ms"], x["label"], None) for x in runs[0].facts.get("limits", []) if x["ms"] > 0}
    for run in (run for run in runs if kind == "task" and run.summarized("executors")):
        deadlines = (row["deadline_ms"] for row in run.timer_counts() if row["task"] == name)
        marks |= {(ms, "deadline", None) for ms in deadlines if ms}
    for number, of in enumerate(series):
        if bound := bounds[of["run"]].get((of["executor"], kind, name)):
            marks.add((round(bound, 6), f"bound of {of['label']}", number))
    return sorted(marks)


def page_data(runs: Sequence[Run], sources: Mapping[str, Sequence[str]], **parts: Any) -> dict[str, Any]:
    """What the interactive part shows, as web/src/data.ts describes it: jobs, outputs and causes of stored runs, then
    executors by source that are known by their samples alone, and these parts."""
    data: dict[str, Any] = {"causes": [], "rules": [], "targets": [], "series": [], "runs": []}
    if runs:
        data |= printable_content(ask("page", [str(run.folder) for run in runs]))
    for run, of in zip(runs, data["runs"]):
        of |= {"name": str(run.folder), "warm_up_ns": round(run["warm_up_s"] * 1e9)}
    nothing: dict[str, Any] = {"tasks": [], "notes": [], "warm_up_ns": 0}
    data["runs"] += [{"name": of, "executors": names} | nothing for of, names in sources.items()]
    return data | parts


def of_samples(executors: Mapping[str, Sequence[str]], **parts: Any) -> dict[str, Any]:
    """The data of executors by source that are known by their samples alone, with these parts."""
    found = [(k, e, f"{e}, {source}") for k, (source, names) in enumerate(executors.items()) for e in names]
    return page_data((), executors, series=curves_of(found), **parts)


def document(runs: Sequence[Run], names: Sequence[str], measured: Sequence[Measured]) -> dict[str, Any]:
    """The data of stored runs."""
    series = curves_of(
        [
            (number, executor, f"{executor} in {names[number]}" if len(runs) > 1 else executor)
            for number, run in enumerate(runs)
            for executor in run.executors
        ]
    )
    bounds = [bounds_of(run) for run in runs]
    targets = [target(what, of, series, marks_of(what, runs, bounds, series)) for what, of in measured]
    return page_data(runs, {}, series=series, targets=targets)


Points = Mapping[float, Estimate]  # by x


def plot(title: str, x: str, found: Mapping[str, Points], figure: str = "") -> dict[str, Any]:
    """Lines of executors with their intervals over `x`, in place of the page's static `figure`. Latencies that differ
    much have a logarithmic axis."""
    lines: list[dict[str, Any]] = []
    for look, points in zip(curves_of([(0, executor, executor) for executor in found]), found.values()):
        ordered = sorted(points.items())
        rows = [[float(at), *(None if math.isnan(v) else round(v, 6) for v in of)] for at, of in ordered]
        if rows:
            lines.append(look | dict(zip(("x", *ENDS), map(list, zip(*rows)))))
    known = [value for line in lines for value in line["value"] if value is not None]
    far_apart = max(known, default=0) > LOGARITHMIC * min(known, default=0) > 0
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
