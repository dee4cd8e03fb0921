# SPDX-License-Identifier: Apache-2.0
"""Report of one `hotpath bench` folder: reads bench.json, writes report.md and its pictures.

Every number is the median over the repetitions, its spread the smallest and the largest of them.
"""

import argparse
import json
import re
import statistics
import sys
from pathlib import Path

from run_data import BLUE, FAINT, GREEN, ORANGE, PURPLE, SKY_BLUE, VERMILION, InputError
from run_data import plt, run_script, save, three_digits, write_title

COLOURS = (BLUE, ORANGE, GREEN, VERMILION, PURPLE, SKY_BLUE, FAINT, "#000000", "#F0E442", "#999999")


# CPU time of one callback of the Autoware graph without work on the real ROS 2 stack (reference_system/ros2_reference), µs.
ROS2_CALLBACK_US = {"default": 285, "static": 215, "events-ro": 135, "rm-ro": 120}
SIMULATED = r"simulate_600s/{}/(.+)"


class Bench:
    """The figures of one folder."""

    def __init__(self, folder):
        self.folder = Path(folder)
        path = self.folder / "bench.json"
        try:
            self.facts = json.loads(path.read_text(encoding="utf-8"))
            self.values = {(f["benchmark"], f["metric"]): f["values"] for f in self.facts["figures"]}
            self.complexities = {c["benchmark"]: c for c in self.facts["complexities"]}
            self.machine = self.facts["machine"]
        except OSError as error:
            raise InputError(f"{path}: {error.strerror}; give a folder written by `hotpath bench`") from None
        except (ValueError, KeyError, TypeError) as error:
            raise InputError(f"{path}: not written by `hotpath bench`: {error!r}") from None
        if not self.values:
            raise InputError(f"{path}: no figures, there is nothing to report")

    def median(self, benchmark, metric="time_ns"):
        """None where it was not measured."""
        values = self.values.get((benchmark, metric))
        return statistics.median(values) if values else None

    def matching(self, pattern, metric="time_ns"):
        """{groups of the pattern: median} of every benchmark whose whole name matches."""
        found = {}
        for benchmark, its_metric in self.values:
            match = re.fullmatch(pattern, benchmark)
            if match and its_metric == metric:
                found[match.groups()] = self.median(benchmark, metric)
        return found

    def where(self):
        m = self.machine
        return f"{m['cpu_model']}, {m['processors']} cores · Linux {m['kernel']} · {m['compiler']} {m['build_type']}"

    def subtitle(self):
        return f"{self.where()}\n{self.facts['date']} · {self.facts['repetitions']} repetitions"


class Bars:
    """What the figures are held against."""

    def __init__(self, bench):
        self.rows = []
        keys = bench.median("push_pop/std::priority_queue/ready/100")
        for executor in ("rm-ro", "fp-ro", "edf-ro"):
            decide = bench.median(f"timer_cycle/{executor}/ready:100/tasks/1000", "decide_ns")
            self.add(f"one decision of {executor}, 100 ready jobs, ns", decide, 100)
            self.add_ratio(f"… to push and pop of std::priority_queue ({executor})", decide, keys, 1.5)
        queue = bench.median("push_pop/PriorityEventsQueue/ready/100")
        self.add_ratio("PriorityEventsQueue to std::priority_queue, push and pop, 100 ready", queue, keys, 1.5)
        for (executor,), jobs_per_s in bench.matching(SIMULATED.format("timers_only_90"), "jobs_per_s").items():
            if executor == "rm-ro":
                self.add("one simulated job of timers_only_90 with rm-ro, ns", 1e9 / jobs_per_s, 333)
        slowest = max(bench.matching(SIMULATED.format("autoware")).values(), default=None)
        self.add("600 s of Autoware simulated, slowest executor, ms", scaled(slowest, 1e-6), 300)
        for executor in ("rm-ro", "edf-ro"):
            for wake in (0, 1):
                name = f"release_pass/{executor}/due:1/wake:{wake}"
                self.add(
                    f"delta of {executor}, {'with' if wake else 'without'} wake-up, median, µs",
                    scaled(bench.median(name, "delta_p50_ns"), 1e-3),
                    None if wake else 2,
                )
        for policy in ("other", "fifo:90"):
            self.add(
                f"wake-up of the timer thread to a bare sleep, medians, {policy}",
                bench.median(f"wake_up/policy:{policy}", "ratio_to_bare_sleep"),
                1.1,
            )
        for path in ("in_process", "shared_memory", "udp"):
            name = f"one_way/fastdds_{path}/kib:4/subscribers:1/"
            self.add_ratio(
                f"publish to callback to raw Fast DDS, 4 KiB, {path.replace('_', ' ')}, medians",
                bench.median(name + "hotpath", "latency_p50_ns"),
                bench.median(name + "raw_fastdds", "latency_p50_ns"),
                1.3 if path == "in_process" else None,
            )
        raw = bench.median("callback/raw_fastdds")
        for executor, real in ROS2_CALLBACK_US.items():
            ours = bench.median(f"callback/executor:{executor}/transport:fastdds")
            self.add(f"CPU of a callback without work, {executor} on Fast DDS, µs", scaled(ours, 1e-3), real / 5)
            self.add_ratio(f"… to the same graph on raw Fast DDS ({executor})", ours, raw, None)

    def add(self, what, value, bar):
        if value is not None:
            self.rows.append((what, value, bar))

    def add_ratio(self, what, value, yardstick, bar):
        if value is not None and yardstick:
            self.add(what, value / yardstick, bar)

    def table(self):
        if not self.rows:
            return []
        lines = ["## Against the bar", "", "| what | measured | bar | |", "| --- | ---: | ---: | --- |"]
        for what, value, bar in self.rows:
            verdict = "" if bar is None else "met" if value <= bar else "**not met**"
            lines.append(f"| {what} | {three_digits(value)} | {'' if bar is None else bar} | {verdict} |")
        return lines + [""]


def scaled(value, factor):
    return None if value is None else value * factor


def group(found):
    """{first group of the pattern: [(last group as number, value)]}, each list ascending."""
    lines = {}
    for groups, value in found.items():
        lines.setdefault(groups[0], []).append((int(groups[-1]), value))
    return {name: sorted(points) for name, points in lines.items()}


def draw_lines(axes, lines, title, x_label):
    for colour, (name, points) in zip(COLOURS, lines.items()):
        axes.loglog([x for x, _ in points], [y for _, y in points], "o-", color=colour, label=name, markersize=4)
    axes.set(title=title, xlabel=x_label, ylabel="ns")
    axes.grid(which="major", axis="both")
    axes.legend(fontsize=8, frameon=False, ncol=2, loc="upper left")
    axes.margins(y=0.25)


def new_figure(bench, title, panels):
    figure, axes = plt.subplots(1, panels, figsize=(6.5 * panels, 5.6), squeeze=False)
    partial = bench.facts.get("complete") is not True
    used = write_title(figure, title, bench.subtitle(), partial)
    figure.subplots_adjust(top=1 - used - 0.08, bottom=0.16, left=0.14 / panels + 0.02, right=0.98, wspace=0.25)
    return figure, axes[0]


def scheduler_section(bench):
    decide = group(bench.matching(r"timer_cycle/([^/]+)/ready:100/tasks/(\d+)", "decide_ns"))
    full = group(bench.matching(r"timer_cycle/([^/]+)/ready:full/tasks/(\d+)", "decide_ns"))
    push_pop = group(bench.matching(r"push_pop/([^/]+)/ready/(\d+)"))
    if not full:
        return []
    figure, axes = new_figure(bench, "Scheduling decisions", 3)
    draw_lines(axes[0], decide, "One decision, 100 ready jobs", "tasks")
    draw_lines(axes[1], full, "One decision, all tasks ready", "tasks")
    draw_lines(axes[2], push_pop, "Push and pop of the queues alone", "ready jobs")
    save(figure, bench.folder, "bench_scheduler")
    lines = ["## Scheduler", "", "![](bench_scheduler.svg)", "", "Growth with the number of tasks:", ""]
    lines += ["| benchmark | fit | of the unit, ns | error of the fit |", "| --- | --- | ---: | ---: |"]
    for name, c in bench.complexities.items():
        if name.startswith("drain/") or "ready:full" in name:
            lines.append(
                f"| {name} | {c['order']} | {three_digits(c['coefficient_ns'])} | {c['rms_percent']:.0f} % |"
            )
    return lines + [""]


def simulator_section(bench):
    lines = []
    for graph in ("timers_only_90", "autoware"):
        times = bench.matching(SIMULATED.format(graph))
        speeds = bench.matching(SIMULATED.format(graph), "jobs_per_s")
        for (executor,), time in times.items():
            speed = speeds[(executor,)] / 1e6
            lines.append(f"| {graph} | {executor} | {three_digits(time / 1e6)} | {three_digits(speed)} |")
    if not lines:
        return []
    head = ["## Simulator", "", "Ten minutes without a trace:", ""]
    head += ["| graph | executor | ms | million jobs/s |", "| --- | --- | ---: | ---: |"]
    growth = ["", "Growth with the number of tasks, two seconds:", ""]
    growth += ["| benchmark | fit | of the unit, ns | error of the fit |", "| --- | --- | ---: | ---: |"]
    for name, c in bench.complexities.items():
        if name.startswith("simulate/"):
            coefficient, error = three_digits(c["coefficient_ns"]), c["rms_percent"]
            growth.append(f"| {name} | {c['order']} | {coefficient} | {error:.0f} % |")
    return head + lines + growth + [""]


def percentiles_table(bench, title, rows):
    """`rows`: (label, benchmark, prefix of the metrics); in microseconds."""
    lines = ["", f"| {title}, µs | p50 | p99 | p99.9 | max |", "| --- | ---: | ---: | ---: | ---: |"]
    for label, benchmark, prefix in rows:
        values = [bench.median(benchmark, f"{prefix}_{q}_ns") for q in ("p50", "p99", "p999", "max")]
        if None not in values:
            lines.append(f"| {label} | " + " | ".join(three_digits(v / 1e3) for v in values) + " |")
    return lines if len(lines) > 3 else []


def executor_section(bench):
    names = [n for (n,) in bench.matching(r"dispatch_timer/(.+)", "lateness_p50_ns")]
    if not names:
        return []
    lines = ["## Executor"]
    release = [
        (f"{symbol}, {executor}, {due} due, {'with' if wake == '1' else 'without'} wake-up",
         f"release_pass/{executor}/due:{due}/wake:{wake}", symbol)
        for executor, due, wake in bench.matching(r"release_pass/([^/]+)/due:(\d+)/wake:(\d)")
        for symbol in ("delta", "k")
    ]
    live = [
        (f"delta, {executor}, live, executor {state}", f"live_release/{executor}/executor:{state}", "delta")
        for executor, state in bench.matching(r"live_release/([^/]+)/executor:(.+)")
    ]
    lines += percentiles_table(bench, "release of timers (delta per timer, k per pass)", release + live)
    policies = [p for (p,) in bench.matching(r"wake_up/policy:(.+)")]
    wake_up = [(f"{p}, {what}", f"wake_up/policy:{p}", prefix) for p in policies
               for what, prefix in (("timer thread", "wake_up"), ("bare sleep", "bare_sleep"))]
    lines += percentiles_table(bench, "wake-up", wake_up)
    dispatch = [(f"timer to start, {n}", f"dispatch_timer/{n}", "lateness") for n in names]
    dispatch += [(f"sample to start, {n}", f"dispatch_sample/{n}", "arrival_to_start")
                 for n in names + ["condition_variable"]]
    lines += percentiles_table(bench, "dispatch on an idle executor", dispatch)
    lines += ["", "| CPU and throughput | CPU per callback at 1000/s, µs | idle at 100/s, % of a core | "
              "jobs/s, 1 ready | jobs/s, 100 ready |", "| --- | ---: | ---: | ---: | ---: |"]
    threads = [n for (n,) in bench.matching(r"throughput/(multi:\d+)/ready:1")]
    for n in names + threads + ["bare_sleep"]:
        cells = [
            scaled(bench.median(f"timers_only/{n}/per_s:1000", "cpu_per_callback_ns"), 1e-3),
            bench.median(f"timers_only/{n}/per_s:100", "cpu_percent"),
            bench.median(f"throughput/{n}/ready:1", "jobs_per_s"),
            bench.median(f"throughput/{n}/ready:100", "jobs_per_s"),
        ]
        lines.append(f"| {n} | " + " | ".join("" if c is None else f"{c:.3g}" if c < 1e3 else f"{c:.0f}"
                                             for c in cells) + " |")
    return lines + [""]


def transport_section(bench):
    found = bench.matching(r"one_way/([^/]+)/kib:(\d+)/subscribers:(\d+)/(.+)", "latency_p50_ns")
    if not found:
        return []
    by_size, by_subscribers = {}, {}
    for (path, kib, subscribers, who), value in found.items():
        label = path.replace("fastdds_", "") + (" (raw)" if who == "raw_fastdds" else "")
        if subscribers == "1":
            by_size.setdefault(label, []).append((int(kib), value))
        if kib == "4":
            by_subscribers.setdefault(label, []).append((int(subscribers), value))
    figure, axes = new_figure(bench, "One-way latency, publication to callback (medians)", 2)
    ascending = lambda lines: {name: sorted(points) for name, points in sorted(lines.items())}  # noqa: E731
    draw_lines(axes[0], ascending(by_size), "One subscriber", "KiB")
    draw_lines(axes[1], ascending(by_subscribers), "4 KiB, all subscribers on one executor", "subscribers")
    save(figure, bench.folder, "bench_transport")
    lines = ["## Transport", "", "![](bench_transport.svg)"]
    lines += ["", "| path | KiB | subscribers | p50, µs | raw Fast DDS | ratio | CPU per message, µs | raw Fast DDS |",
              "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"]
    for path, kib, subscribers in sorted({k[:3] for k in found}, key=lambda k: (k[0], int(k[1]), int(k[2]))):
        name = f"one_way/{path}/kib:{kib}/subscribers:{subscribers}/"
        ours, raw = (scaled(bench.median(name + who, "latency_p50_ns"), 1e-3) for who in ("hotpath", "raw_fastdds"))
        cpu, raw_cpu = (
            scaled(bench.median(name + who, "cpu_per_message_ns"), 1e-3) for who in ("hotpath", "raw_fastdds")
        )
        ratio = ours / raw if ours and raw else None
        cells = ["" if v is None else three_digits(v) for v in (ours, raw, ratio, cpu, raw_cpu)]
        lines.append(f"| {path} | {kib} | {subscribers} | " + " | ".join(cells) + " |")
    return lines + [""]


def hot_path_section(bench):
    found = bench.matching(r"hot_path/executor:([^/]+)/transport:(.+)", "hot_path_p50_ns")
    if not found:
        return []
    transports = sorted({t for _, t in found})
    executors = list(dict.fromkeys(e for e, _ in sorted(found)))
    figure, (axes,) = new_figure(bench, "The hot path of the reference system", 1)
    for i, transport in enumerate(transports):
        for j, executor in enumerate(executors):
            values = bench.values.get((f"hot_path/executor:{executor}/transport:{transport}", "hot_path_p50_ns"), [])
            axes.plot([j + 0.25 * (i - 0.5)] * len(values), [v / 1e6 for v in values], "o", color=COLOURS[i],
                      label=transport if j == 0 else None, alpha=0.8)
    axes.set(title="Median latency of each repetition", ylabel="ms", xticks=range(len(executors)))
    axes.set_xticklabels(executors, rotation=30)
    axes.set_ylim(bottom=0)
    axes.legend(frameon=False)
    save(figure, bench.folder, "bench_hot_path")
    rows = [(f"{e}, {t}", f"hot_path/executor:{e}/transport:{t}", "hot_path") for e, t in sorted(found)]
    lines = ["## Hot path", "", "![](bench_hot_path.svg)"] + percentiles_table(bench, "latency", rows)
    return lines + callback_table(bench, executors) + [""]


def callback_table(bench, executors):
    """CPU time of a callback whose node has no work, beside Fast DDS alone and the real stack."""
    raw = scaled(bench.median("callback/raw_fastdds"), 1e-3)
    lines = ["", "| CPU per callback without work, µs | intra_process | fastdds | raw Fast DDS | ROS 2 |",
             "| --- | ---: | ---: | ---: | ---: |"]
    for executor in executors:
        intra, dds = (scaled(bench.median(f"callback/executor:{executor}/transport:{t}"), 1e-3)
                      for t in ("intra_process", "fastdds"))
        cells = ["" if v is None else three_digits(v) for v in (intra, dds, raw, ROS2_CALLBACK_US.get(executor))]
        lines.append(f"| {executor} | " + " | ".join(cells) + " |")
    return lines if len(lines) > 3 else []


def report(arguments):
    bench = Bench(arguments.folder)
    m = bench.machine
    lines = ["# What the executors cost", "", bench.where() + ", " + bench.facts["date"] + ".",
             f"{bench.facts['repetitions']} repetitions, each in fresh processes; numbers are medians over them.", ""]
    if bench.facts.get("complete") is not True:
        lines += ["**Partial: some measurements are missing.**", ""]
    hiccups = ", ".join(f"core {h['cpu']} {h['p999_ns'] / 1e3:.3g} / {h['max_ns'] / 1e3:.0f}"
                        for h in m["noise"]["hiccups"])
    lines += [f"Hiccups of a busy thread, p99.9 / maximum in µs: {hiccups}. One reading of the clock takes "
              f"{m['noise']['clock_cost_ns']:.0f} ns.", ""]
    lines += Bars(bench).table()
    for section in (scheduler_section, simulator_section, executor_section, transport_section, hot_path_section):
        lines += section(bench)
    path = bench.folder / "report.md"
    path.write_text("\n".join(lines), encoding="utf-8")
    print(path)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("folder", help="folder written by `hotpath bench`")
    return run_script(report, parser.parse_args())


if __name__ == "__main__":
    sys.exit(main())
