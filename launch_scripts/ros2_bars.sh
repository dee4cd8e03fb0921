#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# What hotpath_rclcpp promises, measured on the real stack: repetitions of rclcpp's executors and ours by turns on one
# processor, about 22 minutes, into the folder given first. Then tools/ros2_bars.py, with the further options, says what
# is met. Of a ROS 2 that is sourced, with the workspace of ros2_build.sh; by default Jazzy in /opt/ros.
set -euo pipefail
cd "$(dirname "$0")/.."
output=${1:-runs/ros2_bars-$(date +%Y%m%d-%H%M%S)}

set +u  # ROS 2's scripts ask for variables that may not be set
[ -n "${AMENT_PREFIX_PATH:-}" ] || . /opt/ros/jazzy/setup.bash
. "build_ros2/${ROS_DISTRO:-jazzy}/install/local_setup.bash"
set -u

# The last processor has the fewest interrupts on most machines.
cpu=$(($(nproc --all) - 1))
compare() {
  build/bench/hotpath compare --stack rclcpp --cpus "$cpu" --warm-up 2 --output "$output/$1" "${@:2}"
}
compare autoware --load 80 --executors default,events-ro,rm-ro,edf-ro --repetitions 5 --duration 30
compare no_work --load 0 --executors default,static,events-ro,rm-ro --repetitions 5 --duration 10
compare timers --graph timers_only_90 --executors default,rm-ro,edf-ro --repetitions 3 --duration 30
exec /usr/bin/python3 -B tools/ros2_bars.py "$output" "${@:2}"
