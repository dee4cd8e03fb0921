#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# ros2_bars.sh [FOLDER] [OPTIONS...]: measures the performance targets of hotpath_rclcpp on the real
# ROS 2 stack. Alternates repetitions of rclcpp's executors and hotpath's on one CPU, for about 22
# minutes, and writes the runs into FOLDER. Then tools/ros2_bars.py, with OPTIONS, reports which
# targets are met. Uses the sourced ROS 2 (default: Jazzy in /opt/ros) and the workspace of
# ros2_build.sh.
set -euo pipefail
. "$(dirname "$0")/usage.sh"
[[ ${1:-} != -* ]] || wrong_use "$1 is no folder; OPTIONS follow the folder"
output=${1:-runs/ros2_bars-$(date +%Y%m%d-%H%M%S)}

set +u  # ROS 2's scripts read unset variables
[ -n "${AMENT_PREFIX_PATH:-}" ] || . /opt/ros/jazzy/setup.bash
. "build_ros2/${ROS_DISTRO:-jazzy}/install/local_setup.bash"
set -u

# The last CPU has the fewest interrupts on most machines.
cpu=$(($(nproc --all) - 1))
compare() {
  build/bench/hotpath run --stack rclcpp --cpus "$cpu" --warm-up 2 --output "$output/$1" "${@:2}"
}
compare autoware --load 80 --executors default,events-ro,rm-ro,edf-ro --repetitions 5 --duration 30
compare no_work --load 0 --executors default,static,events-ro,rm-ro --repetitions 5 --duration 10
compare timers --graph timers_only_90 --executors default,rm-ro,edf-ro --repetitions 3 --duration 30
exec env PYTHONPATH=bench /usr/bin/python3 -B tools/ros2_bars.py "$output" "${@:2}"
