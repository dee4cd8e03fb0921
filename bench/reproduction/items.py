# SPDX-License-Identifier: Apache-2.0
"""The items of a reproduction: what the paper shows, and what lies beyond it, each with the studies that it needs."""

from dataclasses import dataclass

TIMERS = ("timers", "timers_with_release_cost")


@dataclass(frozen=True)
class Item:
    name: str
    title: str
    paper: str  # where the paper shows it; empty: it does not
    studies: tuple
    text: str


ITEMS = (
    Item(
        "dropped-jobs",
        "Dropped jobs",
        "Section VII-A, figure of dropped jobs",
        TIMERS,
        (
            "Timestamps of the seven timers for which no job was ever released, in percent of all that were reached"
            " after the warm-up: of all timers, and of the IMU alone, whose period is the shortest."
        ),
    ),
    Item(
        "wcrt-table",
        "Analytical worst-case response times",
        "Section VII-A, Table I",
        TIMERS + ("wcrt",),
        (
            "Theorem 1 with the release overhead of the paper, beside its printed values; and how close observed"
            " response times come to the bound of their task. The figure takes the exact non-preemptive analysis with"
            " the same overhead, whose bounds are at most those of Theorem 1."
        ),
    ),
    Item(
        "response-camera",
        "Response times of the cameras",
        "Section VII-A, figure of camera tasks",
        TIMERS,
        "Finish of a job minus its own timestamp, four camera timers together. Dropped jobs have no response time.",
    ),
    Item(
        "response-lidar",
        "Response times of the LiDARs",
        "Section VII-A, figure of LiDAR tasks",
        TIMERS,
        "Two LiDAR timers together: the longest periods, so the lowest priorities under RM.",
    ),
    Item(
        "response-imu",
        "Response times of the IMU",
        "Section VII-A, figure of IMU tasks",
        TIMERS,
        "The IMU's timer: the shortest period, so the highest priority under RM.",
    ),
    Item(
        "end-to-end",
        "Reduction of end-to-end bounds",
        "Section VII-B, histogram of reductions",
        ("waters",),
        (
            "WATERS 2015 task sets: how much smaller the bound of a chain is under the RM events executor than under"
            " the default one. Outlines show tighter analyses of the same chains."
        ),
    ),
    Item(
        "hot-path",
        "Hot path of the Autoware reference system",
        "Section VII-C, violin plot",
        ("autoware",),
        (
            "Start of the object collision estimator's callback minus start of the later LiDAR driver's callback that"
            " its data contains, at 80 % load of one core, timers created one after another as under rclcpp."
        ),
    ),
    Item(
        "overhead",
        "Overhead of a release",
        "Section VII-A, δ and Δ",
        ("wcrt",),
        (
            "What one pass of the releaser takes on this machine for so many timers at once: a constant k and δ for"
            " each timer."
        ),
    ),
    Item(
        "executors",
        "All executors on Autoware",
        "",
        ("autoware",),
        (
            "The executors that the paper leaves out there: EDF with inherited deadlines, release-and-execute, and"
            " the multi-threaded executor on two cores."
        ),
    ),
    Item(
        "rules",
        "Priorities of subscriptions, and ties",
        "",
        ("autoware", "rules"),
        (
            "Rule `inherit` (the paper's text: a subscription has the highest rate upstream of it) against `first`"
            " (its published artifact: subscriptions before all timers), and at equal priority the latest activation"
            " first (the default) against the earliest (`fifo`)."
        ),
    ),
    Item(
        "load",
        "Hot path against load",
        "",
        ("autoware", "load"),
        (
            "The paper gives one load. Curves are simulated, dots are live; above 100 % of one core no executor keeps"
            " up with everything."
        ),
    ),
    Item(
        "phases",
        "Hot path against phases",
        "",
        ("autoware", "phases"),
        (
            "The paper gives one order of creation. Each sample here is the worst latency of one random draw of all"
            " timers' phases; dots are live runs with the phases of the first draws, the dashed mark is the creation"
            " order."
        ),
    ),
)
NAMES = tuple(item.name for item in ITEMS)
