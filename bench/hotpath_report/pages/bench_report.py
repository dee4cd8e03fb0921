# SPDX-License-Identifier: Apache-2.0
"""Report of one `hotpath bench` folder: reads bench.json, writes report.md and its pictures.

Every number is the median over the repetitions.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from hotpath_report.figures import bench as figures
from hotpath_report.pages.bars import Bars
from hotpath_report.pages.bench_data import AUTOWARE, ROS2_CALLBACK_US, SIMULATED, Bench, scaled, three_digits
from hotpath_report.pages.writer import Section, Table, environment
from hotpath_report.tables import write_file

QUANTILES = {"p50": "p50", "p99": "p99", "p999": "p99.9", "max": "max"}


def table(title: str, header: list[str], rows: Iterable[list[Any]]) -> list[Table]:
    """A table of numbers, unless it has no row; numbers get three digits, and what was not measured is empty."""
    texts = [[c if isinstance(c, str) else three_digits(c) for c in row] for row in rows]
    return [Table(title, header, texts, numbers=True)] if texts else []


def growth(bench: Bench, prefixes: tuple[str, ...], infix: str, title: str) -> list[Table]:
    """How the time of benchmarks grows with the number of tasks."""
    rows = [
        [name, c["order"], c["coefficient_ns"], f"{c['rms_percent']:.0f} %"]
        for name, c in bench.complexities.items()
        if name.startswith(prefixes) or infix in name
    ]
    return table(title, ["benchmark", "fit", "of the unit, ns", "error of the fit"], rows)


def percentiles(bench: Bench, title: str, rows: Iterable[tuple[str, str, str]]) -> list[Table]:
    """`rows`: label, benchmark, prefix of the metrics; in microseconds."""
    cells = [
        [label, *(scaled(bench.median(benchmark, f"{prefix}_{q}_ns"), 1e-3) for q in QUANTILES)]
        for label, benchmark, prefix in rows
    ]
    return table("", [f"{title}, µs", *QUANTILES.values()], (row for row in cells if None not in row))


def scheduler(bench: Bench) -> Section | None:
    """Decisions and queues."""
    if not figures.draw_scheduler(bench):
        return None
    found = growth(bench, ("drain/",), "ready:full", "Growth with the number of tasks")
    return Section("bench_scheduler", "Scheduler", "", "", tables=found)


def simulator(bench: Bench) -> Section | None:
    """Speed of the simulator."""
    rows = []
    for graph in ("timers_only_90", AUTOWARE):
        speeds = bench.matching(SIMULATED.format(graph), "jobs_per_s")
        for (executor,), time in bench.matching(SIMULATED.format(graph)).items():
            rows.append([graph, executor, time / 1e6, speeds[(executor,)] / 1e6])
    if not rows:
        return None
    tables = table("Ten minutes without a trace", ["graph", "executor", "ms", "million jobs/s"], rows)
    never = "\0"  # no benchmark has it
    tables += growth(bench, ("simulate/",), never, "Growth with the number of tasks, two seconds")
    return Section("", "Simulator", "", "", tables=tables)


def throughput(bench: Bench, names: list[str]) -> list[Table]:
    """CPU time and jobs per second."""
    metrics = (
        ("timers_only/{}/per_s:1000", "cpu_per_callback_ns", 1e-3),
        ("timers_only/{}/per_s:100", "cpu_percent", 1),
        ("throughput/{}/ready:1", "jobs_per_s", 1),
        ("throughput/{}/ready:100", "jobs_per_s", 1),
    )
    threads = [n for (n,) in bench.matching(r"throughput/(multi:\d+)/ready:1")]
    rows = [
        [n, *(scaled(bench.median(benchmark.format(n), metric), factor) for benchmark, metric, factor in metrics)]
        for n in [*names, *threads, "bare_sleep"]
    ]
    header = ["CPU and throughput", "CPU per callback at 1000/s, µs", "idle at 100/s, % of a core"]
    return table("", [*header, "jobs/s, 1 ready", "jobs/s, 100 ready"], rows)


def executor(bench: Bench) -> Section | None:
    """Releases, wake-ups and dispatch."""
    names = [n for (n,) in bench.matching(r"dispatch_timer/(.+)", "lateness_p50_ns")]
    if not names:
        return None
    passes = bench.matching(r"release_pass/([^/]+)/due:(\d+)/wake:(\d)", "delta_p50_ns")
    release = [
        (
            f"{symbol}, {e}, {due} due, {'with' if wake == '1' else 'without'} wake-up",
            f"release_pass/{e}/due:{due}/wake:{wake}",
            symbol,
        )
        for e, due, wake in passes
        for symbol in ("delta", "k")
    ]
    live = bench.matching(r"live_release/([^/]+)/executor:(.+)", "delta_p50_ns")
    release += [(f"delta, {e}, live, executor {s}", f"live_release/{e}/executor:{s}", "delta") for e, s in live]
    wake_up = [
        (f"{policy}, {what}", f"wake_up/policy:{policy}", prefix)
        for (policy,) in bench.matching(r"wake_up/policy:(.+)", "wake_up_p50_ns")
        for what, prefix in (("timer thread", "wake_up"), ("bare sleep", "bare_sleep"))
    ]
    dispatch = [(f"timer to start, {n}", f"dispatch_timer/{n}", "lateness") for n in names]
    others = [*names, "condition_variable"]
    dispatch += [(f"sample to start, {n}", f"dispatch_sample/{n}", "arrival_to_start") for n in others]
    tables = percentiles(bench, "release of timers (delta per timer, k per pass)", release)
    tables += percentiles(bench, "wake-up", wake_up) + percentiles(bench, "dispatch on an idle executor", dispatch)
    return Section("", "Executor", "", "", tables=tables + throughput(bench, names))


def transport(bench: Bench) -> Section | None:
    """One-way latency and CPU time of messages."""
    found = figures.one_way(bench)
    if not found:
        return None
    figures.draw_transport(bench, found)
    rows = []
    for path, kib, subscribers in sorted({k[:3] for k in found}, key=lambda k: (k[0], int(k[1]), int(k[2]))):
        name = f"one_way/{path}/kib:{kib}/subscribers:{subscribers}/"
        (ours, raw), (cpu, raw_cpu) = (
            [scaled(bench.median(name + who, metric), 1e-3) for who in ("hotpath", "raw_fastdds")]
            for metric in ("latency_p50_ns", "cpu_per_message_ns")
        )
        rows.append([path, kib, subscribers, ours, raw, ours / raw if ours and raw else None, cpu, raw_cpu])
    header = ["path", "KiB", "subscribers", "p50, µs", "raw Fast DDS", "ratio", "CPU per message, µs", "raw Fast DDS"]
    return Section("bench_transport", "Transport", "", "", tables=table("", header, rows))


def hot_path(bench: Bench) -> Section | None:
    """The reference system, and what a callback without work costs."""
    found = sorted(bench.matching(r"hot_path/executor:([^/]+)/transport:(.+)", "hot_path_p50_ns"))
    if not found:
        return None
    figures.draw_hot_path(bench, found)
    rows = [(f"{e}, {t}", f"hot_path/executor:{e}/transport:{t}", "hot_path") for e, t in found]
    tables = percentiles(bench, "latency", rows)
    transports = ["intra_process", "fastdds"]
    raw = scaled(bench.median("callback/raw_fastdds"), 1e-3)
    cells = []
    for name in dict.fromkeys(e for e, _ in found):
        ours = [scaled(bench.median(f"callback/executor:{name}/transport:{t}"), 1e-3) for t in transports]
        cells.append([name, *ours, raw, ROS2_CALLBACK_US.get(name)])
    header = ["CPU per callback without work, µs", *transports, "raw Fast DDS", "ROS 2"]
    return Section("bench_hot_path", "Hot path", "", "", tables=tables + table("", header, cells))


def write(folder: str) -> None:
    """Writes report.md. Raises InputError."""
    bench = Bench(folder)
    noise = bench.machine["noise"]
    hiccups = [
        f"core {h['cpu']} {h['p999_ns'] / 1e3:.3g} / {h['max_ns'] / 1e3:.0f}" for h in noise["hiccups"]
    ]
    sections = [make(bench) for make in (scheduler, simulator, executor, transport, hot_path)]
    text = environment().get_template("bench.md.j2").render(
        bench=bench,
        hiccups=", ".join(hiccups),
        clock_ns=noise["clock_cost_ns"],
        bars=Bars(bench).table(),
        sections=[section for section in sections if section],
    )
    path = Path(folder) / "report.md"
    write_file(path, text)
    print(path)
