#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# ros_node.sh PROGRAM IGNORED ARGUMENTS...: runs a program of this tree, wherever it was built, as roslaunch wants it.
# roslaunch finds programs only in ROS packages that are installed or in ROS_PACKAGE_PATH. The launch files therefore name
# a program that every roslaunch has, and put this script in front of it (launch-prefix), which runs ours instead.
set -euo pipefail
program=$1
shift 2
cd "$(dirname "$0")/.."

case $program in
  hotpath) places=(build/bench install/hotpath_bench/bin) ;;
  hotpath_ros1_bridge) places=(build/ros1_bridge install/hotpath_ros1_bridge/bin) ;;
  *) echo "ros_node.sh: unknown program $program" >&2; exit 2 ;;
esac
for place in ${HOTPATH_PROGRAMS:-} "${places[@]}"; do
  if [ -x "$place/$program" ]; then
    arguments=("$@")
    if [ "$program" = hotpath ]; then  # no ROS node: roslaunch's own arguments are not for it
      arguments=()
      for argument in "$@"; do [[ $argument == __*:=* ]] || arguments+=("$argument"); done
    fi
    exec "$place/$program" "${arguments[@]}"
  fi
done
echo "ros_node.sh: $program is not built: launch_scripts/setup.sh ros, then launch_scripts/build.sh" >&2
exit 2
