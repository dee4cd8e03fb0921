# SPDX-License-Identifier: Apache-2.0
"""Figures of `hotpath bench`: decisions, transport, and the hot path of the reference system."""

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes

from hotpath_report import style
from hotpath_report.pages.bench_data import Bench
from hotpath_report.style import SERIES

Lines = dict[str, list[tuple[int, float]]]  # {name: [(x, ns)]}, ascending
OneWay = Mapping[tuple[str, ...], float]  # {(path, KiB, subscribers, who): median in ns}


def group(found: Mapping[tuple[str, ...], float]) -> Lines:
    """One line for each first group of a pattern, over its last."""
    lines: Lines = {}
    for groups, value in found.items():
        lines.setdefault(groups[0], []).append((int(groups[-1]), value))
    return {name: sorted(points) for name, points in lines.items()}


def draw_lines(axes: Axes, lines: Lines, title: str, label: str) -> None:
    """Lines on logarithmic axes."""
    for colour, (name, points) in zip(SERIES, sorted(lines.items())):
        xs, ys = zip(*points)
        axes.loglog(xs, ys, "o-", color=colour, label=name, markersize=4)
    axes.set(title=title, xlabel=label, ylabel="ns")
    axes.legend(fontsize=8, ncol=2, loc="upper left")
    axes.margins(y=0.25)


def draw_scheduler(bench: Bench) -> bool:
    """Writes bench_scheduler; whether there was something to draw."""
    full = group(bench.matching(r"timer_cycle/([^/]+)/ready:full/tasks/(\d+)", "decide_ns"))
    if not full:
        return False
    decide = group(bench.matching(r"timer_cycle/([^/]+)/ready:100/tasks/(\d+)", "decide_ns"))
    push_pop = group(bench.matching(r"push_pop/([^/]+)/ready/(\d+)"))
    figure, axes = style.new_figure(18, 4.6, 1, 3)
    draw_lines(axes[0], decide, "One decision, 100 ready jobs", "tasks")
    draw_lines(axes[1], full, "One decision, all tasks ready", "tasks")
    draw_lines(axes[2], push_pop, "Push and pop of the queues alone", "ready jobs")
    style.add_title(figure, "Scheduling decisions", bench.subtitle(), bench.partial)
    style.save(figure, bench.folder, "bench_scheduler")
    return True


def one_way(bench: Bench) -> OneWay:
    """Medians of one-way latencies."""
    return bench.matching(r"one_way/([^/]+)/kib:(\d+)/subscribers:(\d+)/(.+)", "latency_p50_ns")


def draw_transport(bench: Bench, found: OneWay) -> None:
    """Writes bench_transport."""
    by_size: Lines = {}
    by_subscribers: Lines = {}
    for (path, kib, subscribers, who), value in found.items():
        label = path.replace("fastdds_", "") + (" (raw)" if who == "raw_fastdds" else "")
        if subscribers == "1":
            by_size.setdefault(label, []).append((int(kib), value))
        if kib == "4":
            by_subscribers.setdefault(label, []).append((int(subscribers), value))
    figure, axes = style.new_figure(13, 4.6, 1, 2)
    panels = ((by_size, "One subscriber", "KiB"), (by_subscribers, "4 KiB, all on one executor", "subscribers"))
    for panel, (lines, title, label) in zip(axes, panels):
        draw_lines(panel, {name: sorted(points) for name, points in lines.items()}, title, label)
    title = "One-way latency, publication to callback (medians)"
    style.add_title(figure, title, bench.subtitle(), bench.partial)
    style.save(figure, bench.folder, "bench_transport")


def draw_hot_path(bench: Bench, found: Sequence[tuple[str, ...]]) -> None:
    """Writes bench_hot_path: the median of each repetition. `found`: executors and transports."""
    executors, transports = (list(dict.fromkeys(sorted(names))) for names in zip(*found))
    figure, (axes,) = style.new_figure(8, 0.6 + 0.45 * len(executors))
    style.rows_of_labels(axes, executors)
    for y, executor in enumerate(executors):
        for k, transport in enumerate(transports):
            name = f"hot_path/executor:{executor}/transport:{transport}"
            medians = [v / 1e6 for v in bench.values.get((name, "hot_path_p50_ns"), [])]
            place = y + 0.3 * (k - (len(transports) - 1) / 2)
            look = {"color": style.colour_of(executor), "marker": "os^"[k % 3], "linestyle": "", "alpha": 0.8}
            axes.plot(medians, [place] * len(medians), **look)
    axes.set_xlim(left=0)
    axes.set_xlabel("median latency of each repetition (ms)")
    style.add_key(figure, [style.dot(t, "os^"[k % 3]) for k, t in enumerate(transports)], 6)
    style.add_title(figure, "The hot path of the reference system", bench.subtitle(), bench.partial)
    style.save(figure, bench.folder, "bench_hot_path")
