#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# A benchmark that ROS 1 watches, without roslaunch: starts roscore if there is none, the bridge, RViz and rosbag if asked
# for, and the benchmark; ends what it has started with the benchmark or with Ctrl-C.
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
  # The last first: rosbag closes its file before its master goes.
  for ((i = ${#started[@]} - 1; i >= 0; --i)); do
    kill -INT "${started[i]}" 2>/dev/null || true
    wait "${started[i]}" 2>/dev/null || true
  done
}
trap end_all EXIT
trap 'exit 130' INT
trap 'exit 143' TERM
# Each in a separate process group, which Ctrl-C does not reach: they end in our order.
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
