# SPDX-License-Identifier: Apache-2.0
"""Figures of `hotpath bench`: decisions, transport and the hot path of the reference system."""

from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from hotpath_report import style
from hotpath_report.bench_data import SPEC, Bench
from hotpath_report.hotpath_command import executor_named
from hotpath_report.style import SERIES


def duration(ns: float, _position: int | None = None) -> str:
    """A tick in the largest unit of which it has at least one: `20 µs`."""
    units = [(size, unit) for size, unit in ((1e9, "s"), (1e6, "ms"), (1e3, "µs")) if ns >= size]
    size, unit = units[0] if units else (1, "ns")
    return f"{ns / size:g} {unit}"


def draw_lines(axes: Axes, bench: Bench, pattern: str, metric: str) -> bool:
    """Draws medians (ns) on logarithmic axes; returns whether there was data."""
    lines: dict[str, list[tuple[int, float]]] = {}
    for (name, x, *who), value in bench.matching(pattern, metric).items():
        label = name.removeprefix("fastdds_") + (" (raw)" if who == ["raw_fastdds"] else "")
        lines.setdefault(label, []).append((int(x), value))
    for series, (label, points) in zip(SERIES, sorted(lines.items())):
        colour = style.colour_of(label) if executor_named(label) else series
        axes.loglog(*zip(*sorted(points)), "o-", color=colour, label=label, markersize=4)
    axes.margins(y=0.25)
    low, high = axes.get_ylim()
    axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if high < 100 * low else (1,)))
    for axis, text in ((axes.xaxis, "{x:g}"), (axes.yaxis, FuncFormatter(duration))):
        axis.set_major_formatter(text)
        axis.set_minor_formatter(NullFormatter())
    if lines:
        axes.legend(fontsize=8, ncol=2, loc="upper left")
    return bool(lines)


def draw_hot_path(bench: Bench) -> bool:
    """Draws each repetition's median on the reference system; returns whether there was data."""
    found = bench.matching(r"hot_path/executor:([^/]+)/transport:(.+)", "hot_path_p50_ns")
    if not found:
        return False
    executors, transports = (sorted(set(names)) for names in zip(*found))
    figure, (axes,) = style.new_figure(8, 0.6 + 0.45 * len(executors))
    style.rows_of_labels(axes, executors)
    markers = dict(zip(transports, "os^D"))
    for executor, transport in found:
        name = f"hot_path/executor:{executor}/transport:{transport}"
        medians = [v / 1e6 for v in bench.values[name, "hot_path_p50_ns"]]
        place = executors.index(executor) + 0.3 * (transports.index(transport) - (len(transports) - 1) / 2)
        look = {"color": style.colour_of(executor), "linestyle": "", "alpha": 0.8}
        axes.plot(medians, [place] * len(medians), marker=markers[transport], **look)
    axes.set(xlim=(0, None), xlabel="median latency of each repetition (ms)")
    style.add_key(figure, [style.dot(t, marker) for t, marker in markers.items()], 6)
    style.add_title(figure, "Hot path of the reference system", bench.subtitle(), bench.partial)
    style.save(figure, bench.folder, "bench_hot_path")
    return True


def draw(bench: Bench) -> set[str]:
    """Writes all figures that have data and returns their names."""
    drawn = {"bench_hot_path"} if draw_hot_path(bench) else set()
    for spec in SPEC["figure"]:
        panels = spec["panel"]
        figure, axes = style.new_figure(6 * len(panels), 4.6, 1, len(panels))
        found = [draw_lines(a, bench, panel["of"], panel["metric"]) for a, panel in zip(axes, panels)]
        for a, panel in zip(axes, panels):
            a.set(title=panel["title"], xlabel=panel["x"])
        if any(found):
            style.add_title(figure, spec["title"], bench.subtitle(), bench.partial)
            style.save(figure, bench.folder, spec["name"])
            drawn.add(spec["name"])
    return drawn
