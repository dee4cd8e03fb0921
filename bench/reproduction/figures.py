# SPDX-License-Identifier: Apache-2.0
"""The figures of a reproduction, by item.

A drawing function takes the evidence, the real stack's reference and a width in inches, and returns the figure, and
header and rows of the CSV behind it; None where there are no data. Each is drawn for wide and for narrow pages.
"""

from cells import PAPER_HOT_PATH, RULE_VARIANTS
from figures_analysis import reductions, release_cost
from figures_hot_path import hot_path_of, load_map, phase_map
from figures_timers import dropped_jobs, responses, tightness

ALL_ON_AUTOWARE = ("default", "static", "multi", "events-ro", "events-re", "rm-ro", "rm-re", "edf-ro", "edf-re")

# By item: (name of the figure, what it shows, drawing function)
FIGURES = {
    "dropped-jobs": [("dropped_jobs", "Dropped jobs of each executor on the three timers-only sets", dropped_jobs)],
    "wcrt-table": [
        ("bound_tightness", "Worst observed response time of each task in percent of its bound", tightness)
    ],
    "response-camera": [("response_camera", "Response times of the camera timers", responses("camera"))],
    "response-lidar": [("response_lidar", "Response times of the LiDAR timers", responses("lidar"))],
    "response-imu": [("response_imu", "Response times of the IMU timer", responses("imu"))],
    "end-to-end": [("end_to_end_reduction", "Reduction of the end-to-end bound of each chain", reductions)],
    "hot-path": [("hot_path", "Hot-path latency under the paper's four executors", hot_path_of(PAPER_HOT_PATH))],
    "overhead": [("release_cost", "Length of a releaser's pass over the timers that it releases", release_cost)],
    "executors": [("hot_path_all", "Hot-path latency under all executors", hot_path_of(ALL_ON_AUTOWARE))],
    "rules": [
        ("hot_path_rules", "Hot-path latency under rules and ties", hot_path_of(RULE_VARIANTS, "rules", False))
    ],
    "load": [("hot_path_load", "Hot-path latency over load", load_map)],
    "phases": [("hot_path_phases", "Worst hot-path latency over random phases", phase_map)],
}
