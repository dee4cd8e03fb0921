# SPDX-License-Identifier: Apache-2.0
"""Age of the data under each executor, and hot-path latency, as in the paper's last figure (Section VII-C), and over
random phases."""

import itertools
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hotpath_report import style
from hotpath_report.errors import InputError
from hotpath_report.figures import violins
from hotpath_report.figures.violins import Drawing, Row
from hotpath_report.run import SOURCES, Run, samples_of
from hotpath_report.statistics import Samples
from hotpath_report.style import FAINT, INK

BASELINE = "default"
AGE = "age of the data in an output (ms)"
NOTE = "end of a violin: worst case, compared with `default`"
CREATION: dict[str, Any] = {"linewidth": 1.2, "linestyle": (0, (2, 1.5))}


def compared(samples: Samples, baseline: Samples | None) -> str:
    """A worst case relative to the baseline's, in a few words."""
    if not baseline or samples is baseline or samples.worst <= 0:
        return ""
    factor = baseline.worst / samples.worst
    if factor >= 1.05:
        return f" · {factor:.2g}× lower"
    return f" · {1 / factor:.2g}× higher" if 0 < factor <= 1 / 1.05 else " · the same"


def with_ratios(rows: list[Row], baseline: str = BASELINE) -> list[Row]:
    """The rows with each worst case's ratio to the baseline of the same source on the same stack."""
    first: dict[str, Mapping[str, Samples]] = {}
    for r in rows:
        first.setdefault(r.executor, r.samples)
    bases = [first.get(baseline + "".join(r.executor.partition("@")[1:]), {}) for r in rows]
    return [
        replace(r, notes={s: compared(of, base.get(s)) for s, of in r.samples.items()})
        for r, base in zip(rows, bases)
    ]


def draw_limits(axes: Axes, limits: Sequence[dict[str, Any]]) -> None:
    """Dashed lines at the computation on the path, with their names above the panel."""
    for number, limit in enumerate(limits):
        axes.axvline(limit["ms"], color=INK, linewidth=1.2, linestyle=style.DASHED, zorder=1)
        left = number == 0 and len(limits) > 1
        name = limit["label"].replace(" (", "\n(").split("\n")
        text = "\n".join(textwrap.fill(part, 24) for part in name)
        look = {"va": "bottom", "ha": "right" if left else "left", "linespacing": 1.15}
        place, offset = (limit["ms"], 1), (-4 if left else 4, 2)
        style.note(axes, f"{text}\n{limit['ms']:.3g} ms", place, offset, xycoords=style.ABOVE, **look)


def rows_of_runs(frames: Sequence[dict[str, Samples]], runs: Sequence[Run]) -> list[Row]:
    """Rows of one chain: each executor's first run of each source, followed by its further runs."""
    rows = []
    for executor in dict.fromkeys(e for run in runs for e in run.executors):
        of_source: dict[str, list[Samples]] = {source: [] for source in SOURCES}
        for run, found in zip(runs, frames):
            if executor in run.executors:
                of_source[run.source].append(found.get(executor, Samples([])))
        for k, both in enumerate(itertools.zip_longest(*of_source.values())):
            counts = ", ".join(str(len(s)) for s in both if s is not None)
            name = executor if k == 0 else f"{executor} ({k + 1})"
            rows.append(Row(f"{name}\nn = {counts}", executor, {s: of for s, of in zip(SOURCES, both) if of}))
    return rows


def draw_run(folder: str) -> None:
    """Writes hot_path.svg and .png into a run folder. Raises InputError."""
    run = Run(folder)
    if not (outputs := run.samples("chains")):
        why = "the run was shorter than its warm-up, or its graph declares no chain"
        raise InputError(f"{run.folder / 'chains.csv'}: no rows; {why}")
    aged = all(None not in row["age_ms"] for row in outputs)
    latencies = samples_of(outputs, "age_ms" if aged else "hot_path_ms", run.simulated)
    rows = {chain: with_ratios(rows_of_runs([of], [run])) for chain, of in latencies.items()}
    first = next(iter(rows.values()))
    figure, panels = style.new_figure(0.6 + 0.55 * len(first), len(rows))
    # Without work in the nodes there is no limit; it includes the work at both ends of the chain.
    limits = aged * sorted(
        (x for x in run.facts.get("limits", []) if x["ms"] > 0), key=lambda x: float(x["ms"])
    )
    for axes, (chain, of_chain) in zip(panels, rows.items()):
        limit = violins.axis_limit(of_chain, [x["ms"] for x in limits])
        if any(any(row.notes.values()) for row in of_chain):
            limit *= 1.12  # room for the note behind the longest violin
        violins.draw_rows(axes, of_chain, limit, violins.sources_of(first), " ms")
        axes.set_xlabel(AGE if aged else "hot-path latency (ms)")
        if len(rows) > 1:
            axes.set_title(chain)
        draw_limits(axes, limits if axes is panels[0] else ())
    key = [style.patch(NOTE, alpha=0)] if any(any(row.notes.values()) for row in first) else []
    violins.add_key(figure, violins.sources_of(first), key)
    answer = (
        next(iter(run.summarized("verdict")), "").split(". ")[0] if aged else "Hot-path latency per executor"
    )
    style.save(
        figure, folder, "hot_path", answer or "Age of the data per executor", run.what_ran(), run.partial
    )


def draw_rows(
    rows: list[Row], real_ms: Mapping[str, float] | None = None, label: str = "hot-path latency (ms)"
) -> Drawing:
    """One panel of rows, with the known worst cases (ms) of the real ROS 2 stack."""
    real = {y: real_ms[row.executor] for y, row in enumerate(rows) if real_ms and row.executor in real_ms}
    figure, (axes,) = style.new_figure(0.6 + 0.62 * len(rows))
    sources = violins.sources_of(rows)
    limit = violins.axis_limit(rows, real.values()) * 1.08
    violins.draw_rows(axes, rows, limit, sources)
    for y, worst in real.items():
        axes.plot([worst], [y + 0.26], **style.reference_mark(zorder=6))
    axes.set_xlabel(label)
    marks = [style.dot("worst of the real ROS 2 stack", **style.reference_mark())] if real else []
    violins.add_key(figure, sources, marks)
    table = violins.percentile_table(
        ({"source": source, "executor": row.executor}, samples)
        for row in rows
        for source, samples in row.samples.items()
    )
    return Drawing(figure, table)


def over_phases(
    draws: Mapping[tuple[str, str], Sequence[tuple[float, float]]],
    creation_ms: Mapping[str, float],
    executors: Sequence[str],
) -> Figure:
    """Worst latencies of random phase draws, beside that of the creation order."""
    shown = [e for e in executors if draws.get(("simulated", e))]
    rows = [Row(e, e, {"simulated": Samples([w] for _, w in draws["simulated", e])}) for e in shown]
    live = {e: [w for _, w in draws.get(("live", e), [])] for e in shown}
    figure, (axes,) = style.new_figure(1 + 0.5 * len(rows))
    limit = violins.axis_limit(rows, [w for worst in live.values() for w in worst])
    violins.draw_rows(axes, rows, limit, SOURCES)
    for y, executor in enumerate(shown):
        look: Any = {"color": style.colour_of(executor), "markeredgecolor": INK, "markeredgewidth": 0.7}
        axes.plot(live[executor], [y + 0.2] * len(live[executor]), "o", markersize=5, **look)
        if executor in creation_ms:
            axes.plot([creation_ms[executor]] * 2, [y - 0.42, y + 0.1], color=INK, zorder=5, **CREATION)
    axes.set_xlabel("worst hot-path latency of a draw of phases (ms)")
    handles: list[Any] = [
        style.patch("draws, simulated", alpha=0.42),
        style.line("median draw", linewidth=1.6),
        style.line("creation order, simulated", **CREATION),
    ]
    if any(live.values()):
        handles.append(style.dot("draws, live", color=FAINT, markeredgecolor=INK))
    style.add_key(figure, handles, 4)
    return figure
