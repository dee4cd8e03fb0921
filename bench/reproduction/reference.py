# SPDX-License-Identifier: Apache-2.0
"""What the real ROS 2 stack measured on the same workloads: reference_system/ros2_reference, in this program's names."""

from pathlib import Path

from evidence import group_of, read_table

HERE = Path(__file__).resolve().parent
FOLDERS = (
    HERE.parents[1] / "reference_system" / "ros2_reference",
    HERE.parents[1] / "hotpath_reference_system" / "ros2_reference",
)
# The fork's prioritised queues give every subscription one top priority (rule `first`).
TIMERS_NAMES = {"default": "default", "static": "static", "events": "events-ro", "rm": "rm-ro", "edf": "edf-ro"}
AUTOWARE_NAMES = {
    "singlethreaded": "default",
    "staticsinglethreaded": "static",
    "multithreaded": "multi",
    "events": "events-ro",
    "events_re": "events-re",
    "rm": "rm-ro",
    "edf": "edf-ro",
}
TRACED = ("events-re",)  # not among the authors' programs, but in the golden traces
AUTOWARE_CRUNCH_LIMIT = "6000"  # 80 % of one core on the reference machine


def traced_rows(path):
    """The same columns from a golden trace: timestamps that a timer has consumed, less its jobs, were dropped."""
    timers, rows = {}, []
    for line in path.read_text(encoding="utf-8").splitlines():
        words = line.split()
        if line.startswith("#"):
            timers[words[1]] = {"period": int(words[3]), "first": int(words[7]), "ends": [], "next": int(words[7])}
        else:
            task, _, _, end, following = line.split(",")
            timers[task]["ends"].append(int(end) - (int(following) - timers[task]["period"]))
            timers[task]["next"] = int(following)
    for task, t in timers.items():
        released = (t["next"] - t["first"]) // t["period"]
        late = sum(response > t["period"] for response in t["ends"])
        rows.append(
            {
                "task": task,
                "released": released,
                "dropped": released - len(t["ends"]),
                "deadline_overruns": late,
                "response_max_ms": max(t["ends"]) / 1e6,
            }
        )
    return rows


class Reference:
    def __init__(self):
        folder = next((f for f in FOLDERS if f.is_dir()), None)
        timers = read_table(folder / "rclcpp_timers_only.csv") if folder else []
        autoware = read_table(folder / "rclcpp_autoware.csv") if folder else []
        self.timers = {}
        for row in timers:
            key = (int(row["utilisation_percent"]), TIMERS_NAMES[row["executor"]])
            self.timers.setdefault(key, []).append(row)
        for executor in TRACED if folder else ():
            for percent in (60, 80, 90):
                self.timers[(percent, executor)] = traced_rows(
                    folder / "traces" / f"timers_only_{percent}.{executor}.csv"
                )
        self.hot_path = {
            AUTOWARE_NAMES[row["executor"]]: row for row in autoware if row["crunch_limit"] == AUTOWARE_CRUNCH_LIMIT
        }

    def rows(self, percent, executor, group=None):
        return [r for r in self.timers.get((percent, executor), []) if group is None or group_of(r["task"]) == group]

    def total(self, what, percent, executor, group=None):
        """Sum of a column; None where this executor was not measured."""
        rows = self.rows(percent, executor, group)
        return sum(int(r[what]) for r in rows) if rows else None

    def drop_percent(self, percent, executor, group=None):
        released = self.total("released", percent, executor, group)
        return 100 * self.total("dropped", percent, executor, group) / released if released else None

    def worst_response(self, percent, executor, group):
        return max((float(r["response_max_ms"]) for r in self.rows(percent, executor, group)), default=None)

    def hot_path_ms(self, executor, quantile):
        """`quantile` is p50, p90, p99 or max."""
        row = self.hot_path.get(executor)
        return float(row[f"hot_path_{quantile}_ms"]) if row else None
