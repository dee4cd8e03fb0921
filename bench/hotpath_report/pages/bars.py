# SPDX-License-Identifier: Apache-2.0
"""What the measurements of `hotpath bench` are held against."""

from hotpath_report.pages.bench_data import AUTOWARE, ROS2_CALLBACK_US, SIMULATED, Bench, scaled, three_digits
from hotpath_report.pages.writer import Table

LEAST_GAIN = 5  # over the real ROS 2 stack's CPU time of a callback


class Bars:
    """Rows of what was measured and its bar, where it has one."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self.rows: list[tuple[str, float, float | None]] = []
        self.scheduler()
        self.releases()
        self.transport()

    def add(self, what: str, value: float | None, bar: float | None = None) -> None:
        """A row, unless it was not measured."""
        if value is not None:
            self.rows.append((what, value, bar))

    def add_ratio(self, what: str, value: float | None, yardstick: float | None, bar: float | None = None) -> None:
        """A row for a ratio, unless one of the two was not measured."""
        if value is not None and yardstick:
            self.add(what, value / yardstick, bar)

    def scheduler(self) -> None:
        """Decisions, queues and the simulator."""
        bench = self.bench
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
        slowest = max(bench.matching(SIMULATED.format(AUTOWARE)).values(), default=None)
        self.add("600 s of Autoware simulated, slowest executor, ms", scaled(slowest, 1e-6), 300)

    def releases(self) -> None:
        """Costs of a release, and wake-ups."""
        for executor in ("rm-ro", "edf-ro"):
            for wake in (0, 1):
                delta = self.bench.median(f"release_pass/{executor}/due:1/wake:{wake}", "delta_p50_ns")
                what = f"delta of {executor}, {'with' if wake else 'without'} wake-up, median, µs"
                self.add(what, scaled(delta, 1e-3), None if wake else 2)
        for policy in ("other", "fifo:90"):
            ratio = self.bench.median(f"wake_up/policy:{policy}", "ratio_to_bare_sleep")
            self.add(f"wake-up of the timer thread to a bare sleep, medians, {policy}", ratio, 1.1)

    def transport(self) -> None:
        """Messages and callbacks."""
        for path in ("in_process", "shared_memory", "udp"):
            ours, raw = (
                self.bench.median(f"one_way/fastdds_{path}/kib:4/subscribers:1/{who}", "latency_p50_ns")
                for who in ("hotpath", "raw_fastdds")
            )
            what = f"publish to callback to raw Fast DDS, 4 KiB, {path.replace('_', ' ')}, medians"
            self.add_ratio(what, ours, raw, 1.3 if path == "in_process" else None)
        raw = self.bench.median("callback/raw_fastdds")
        for executor, real in ROS2_CALLBACK_US.items():
            ours = self.bench.median(f"callback/executor:{executor}/transport:fastdds")
            what = f"CPU of a callback without work, {executor} on Fast DDS, µs"
            self.add(what, scaled(ours, 1e-3), real / LEAST_GAIN)
            self.add_ratio(f"… to the same graph on raw Fast DDS ({executor})", ours, raw)

    def table(self) -> Table | None:
        """All rows with their verdicts."""
        rows = []
        for what, value, bar in self.rows:
            verdict = "" if bar is None else "met" if value <= bar else "**not met**"
            rows.append([what, three_digits(value), "" if bar is None else bar, verdict])
        return Table("Against the bar", ["what", "measured", "bar", ""], rows, numbers=True) if rows else None
