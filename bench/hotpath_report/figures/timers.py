# SPDX-License-Identifier: Apache-2.0
"""Dropped jobs and response times of timers-only sets, as the figures of the paper's Section VII-A."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hotpath_report import style
from hotpath_report.errors import InputError
from hotpath_report.figures import violins
from hotpath_report.figures.violins import Row
from hotpath_report.hotpath_command import executor_named
from hotpath_report.run import SOURCES, Run
from hotpath_report.samples import GROUPS, TimerRuns
from hotpath_report.style import FAINT, INK

MOST_SETTINGS = 5
BAND = 0.82  # of a row, shared by the settings


def alphas(count: int) -> list[float]:
    """Shades of an executor's colour: the paler, the earlier the setting."""
    return [0.4 + 0.55 * k / max(1, count - 1) for k in range(count)] if count > 1 else [0.85]


def draw_rates(
    axes: Axes, place: tuple[float, float], rates: Sequence[float | None], look: dict[str, Any]
) -> None:
    """Simulated bar, live mark and real mark of one executor and setting; a tick where nothing was dropped."""
    y, height = place
    simulated, live, real = rates
    known = [r for r in rates if r is not None]
    if not any(known):
        text = "✓" if known else "no data"
        axes.annotate(text, (0, y), (4, 0), textcoords="offset points", va="center", fontsize=8)
        return
    bar = live if simulated is None else simulated
    if bar is not None:
        axes.barh(y, bar, height=0.9 * height, zorder=2, **look)
    if live is not None and simulated is not None:
        axes.plot([live], [y], "o", color=INK, markersize=4.5, zorder=4)
    if real is not None:
        axes.plot([real], [y], **style.reference_mark(markersize=5.5, zorder=3))
    number = bar or max(known)
    offset = {"xytext": (7, 0), "textcoords": "offset points", "va": "center", "fontsize": 8, "color": FAINT}
    axes.annotate(f"{number:.1f}" if number >= 0.1 else f"{number:.2g}", (max(known), y), **offset)


def drops(runs: TimerRuns, executors: Sequence[str], labels: Mapping[Any, str], width: float) -> Figure:
    """Dropped jobs of all timers, and of the IMU alone; `labels` names each setting."""
    settings = list(labels)
    step = BAND / len(settings)
    figure, panels = style.new_figure(width, 0.8 + 0.17 * len(settings) * len(executors), 1, 2, share_y=True)
    for axes, group, title in zip(panels, (None, "imu"), ("All timers", "IMU alone")):
        style.rows_of_labels(axes, executors)
        for y, executor in enumerate(executors):
            for k, (setting, alpha) in enumerate(zip(settings, alphas(len(settings)))):
                rates = [runs.drop_percent(setting, source, executor, group) for source in (*SOURCES, "real")]
                place = (y + (k - (len(settings) - 1) / 2) * step, step)
                draw_rates(axes, place, rates, {"color": style.colour_of(executor), "alpha": alpha})
        axes.set_title(title)
        axes.margins(x=0.14)
        axes.set_xlim(0, max(1e-3, axes.get_xlim()[1]))
        axes.set_xlabel("dropped jobs (% of the timestamps)")
    handles: list[Any] = [
        style.patch(label, alpha=a) for label, a in zip(labels.values(), alphas(len(settings)))
    ]
    sources = set(runs.counts["source"])
    if {*SOURCES} <= sources:
        handles += [style.patch("bar: simulated", alpha=0.6), style.dot("live", markersize=5)]
    if "real" in sources:
        handles.append(style.dot("real ROS 2 stack", **style.reference_mark()))
    handles.append(style.dot("no job dropped", "$✓$", markersize=7))
    style.add_key(figure, handles, 7)
    return figure


def draw_deadlines(axes: Axes, deadlines: Iterable[float]) -> None:
    """Lines at deadlines (ms); an arrow says that one lies beyond every response time."""
    limit = axes.get_xlim()[1]
    for deadline in deadlines:
        beyond = deadline > limit
        if not beyond:
            axes.axvline(deadline, color=FAINT, linewidth=1.1, linestyle=style.DASHED, zorder=1)
        axes.annotate(
            f"deadline {deadline:g} ms" + (" →" if beyond else ""),
            (min(deadline, limit), 1),
            (0, 2),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            ha="right" if beyond else "center",
            fontsize=8,
            color=FAINT,
        )


def draw_bounds(axes: Axes, executors: Sequence[str], bounds: Mapping[str, float]) -> None:
    """A line at the analytical bound (ms) of each executor that has one within the axis."""
    for y, executor in enumerate(executors):
        bound = bounds.get(executor)
        if bound is not None and bound <= axes.get_xlim()[1]:
            axes.plot(
                [bound] * 2, [y - 0.45, y + 0.45], color=style.colour_of(executor), linewidth=2.2, zorder=5
            )


Bounds = Mapping[tuple[Any, str], Mapping[str, float]]  # {(setting, group): {executor: ms}}


def responses(
    runs: TimerRuns,
    groups: Sequence[str],
    settings: Mapping[Any, str],
    bounds: Bounds,
    width: float,
) -> Figure:
    """Response times: a row of panels for each group of timers, a column for each setting."""
    executors = runs.executors()
    height = 0.55 + (0.42 if not style.is_narrow(width) else 0.4) * len(executors)
    figure, panels = style.new_figure(width, height, len(groups), len(settings), share_y=True)
    places = [(group, setting) for group in groups for setting in settings]
    rows = {
        (group, setting): [
            Row(e, e, [runs.samples(setting, s, e, group) for s in SOURCES]) for e in executors
        ]
        for group, setting in places
    }
    sources = violins.sources_of(row for found in rows.values() for row in found)
    for axes, (group, setting) in zip(panels, places):
        limit = violins.axis_limit(row for s in settings for row in rows[group, s])
        violins.draw_rows(axes, rows[group, setting], limit, sources)
        draw_deadlines(axes, runs.of_group("deadline_ms", group, setting))
        draw_bounds(axes, executors, bounds.get((setting, group), {}))
        for y, executor in enumerate(executors):
            worst = runs.worst_ms(setting, "real", executor, group)
            if worst is not None and worst <= limit:
                axes.plot([worst], [y + 0.26], **style.reference_mark(zorder=6))
        axes.set_title(settings[setting], pad=14)
        axes.set_xlabel(f"{GROUPS[group]}: response time (ms)")
    marks: list[Any] = [style.line("deadline", color=FAINT, linewidth=1.1, linestyle=style.DASHED)]
    if any(bounds.values()):
        marks.append(style.line("analytical bound", color=style.SERIES[0], linewidth=2.2))
    if "real" in set(runs.counts["source"]):
        marks.append(style.dot("worst of the real ROS 2 stack", **style.reference_mark()))
    violins.add_key(figure, sources, marks)
    return figure


def bounds_of(runs: TimerRuns) -> dict[tuple[Any, str], dict[str, float]]:
    """The largest bound (ms) of each group's tasks under the executors with priorities."""
    found: dict[tuple[Any, str], dict[str, float]] = {}
    for group in GROUPS:
        for (setting, executor), rows in runs.counts.groupby(["setting", "executor"]):
            mine = rows[rows["task"].str.lower().str.contains(group)]["bound_ms"].dropna()
            known = executor_named(executor)
            if len(mine) and known is not None and known.family == "priority_events":
                found.setdefault((setting, group), {})[executor] = float(mine.max())
    return found


def subtitle(runs: Sequence[Run]) -> str:
    """How it ran, without graphs and loads, which the panels name; lines for each kind of run."""
    first = {run.source: run for run in reversed(runs)}
    return "\n".join(
        f"{source}: {first[source].conditions()}\n{first[source].where()}" for source in sorted(first)
    )


def draw_runs(folders: Sequence[str], output: str | None) -> None:
    """Writes timers_only_dropped and timers_only_response. Raises InputError."""
    given = sorted(map(Run, folders), key=lambda run: (run["load_percent"], run.source))
    names = {run.setting for run in given}
    if len(names) > MOST_SETTINGS:
        raise InputError(f"{len(names)} graphs given; at most {MOST_SETTINGS} fit into one figure")
    runs = TimerRuns.of_runs(given)
    groups = [g for g in GROUPS if runs.responses["task"].str.lower().str.contains(g).any()]
    if not groups:
        wanted = ", ".join(GROUPS.values())
        raise InputError(
            f"{given[0].folder / 'jobs.csv'}: after the warm-up no timer ran whose name contains {wanted}"
        )
    labels = {setting: setting for setting in runs.settings()}
    partial = any(run.partial for run in given)
    figure = drops(runs, runs.executors(), labels, style.WIDE)
    style.add_title(figure, "Dropped jobs per executor", subtitle(given), partial)
    style.save(figure, output or folders[0], "timers_only_dropped")
    width = max(style.WIDE, 1.2 + 2.7 * len(labels))
    figure = responses(runs, groups, labels, bounds_of(runs), width)
    style.add_title(figure, "Response times of executed jobs", subtitle(given), partial)
    style.save(figure, output or folders[0], "timers_only_response")
