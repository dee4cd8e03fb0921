#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Shows a benchmark in ROS 1 without roslaunch: starts roscore if none is running, the bridge, RViz
# and rosbag on request, and the benchmark. When the benchmark ends, or on Ctrl-C, ends all programs
# that it started.
set -euo pipefail

usage="usage: live.sh [--domain N] [--rviz] [--record FILE] [options of \`hotpath run\`]"
domain=0 rviz=false record=
options=()
while [ $# -gt 0 ]; do
  case $1 in
    --help) echo "$usage"; exit 0 ;;
    --rviz) rviz=true; shift ;;
    --domain | --record)
      [ $# -ge 2 ] || { echo "live.sh: $1 needs a value; $usage" >&2; exit 2; }
      declare "${1#--}=$2"
      shift 2
      ;;
    *) options+=("$1"); shift ;;
  esac
done
[ -z "$record" ] || record=$(realpath -m "$record")

cd "$(dirname "$0")/.."
export PATH="/usr/bin:$PATH" ROS_MASTER_URI=${ROS_MASTER_URI:-http://localhost:11311}
started=()
end_all() {
  trap '' INT TERM
  # In reverse order, so that rosbag closes its file before the master ends.
  for ((i = ${#started[@]} - 1; i >= 0; --i)); do
    kill -INT "${started[i]}" 2>/dev/null || true
    wait "${started[i]}" 2>/dev/null || true
  done
}
trap end_all EXIT
trap 'exit 130' INT
trap 'exit 143' TERM
# Each program gets its own process group, which Ctrl-C does not reach, so that end_all sets the
# order.
set -m
start() {
  "$@" &
  started+=($!)
}

if ! rosparam get /run_id >/dev/null 2>&1; then
  port=${ROS_MASTER_URI##*:}
  start roscore -p "${port%/}" >/dev/null
  until rosparam get /run_id >/dev/null 2>&1; do
    kill -0 "${started[0]}" 2>/dev/null || { echo "live.sh: roscore did not start at $ROS_MASTER_URI" >&2; exit 1; }
    sleep 0.2
  done
fi
start launch_scripts/ros_node.sh hotpath_ros1_bridge - --domain "$domain"
if $rviz; then start rviz -d launch_scripts/hotpath.rviz; fi
if [ -n "$record" ]; then
  start rosbag record -O "$record" -e '/(.*/)?hotpath/.*|/diagnostics|/tf_static|/clock'
fi
start launch_scripts/ros_node.sh hotpath - run --live --domain "$domain" "${options[@]}"
wait "${started[-1]}"
