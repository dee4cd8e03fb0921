#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# ros_node.sh PROGRAM IGNORED ARGUMENTS...: lets roslaunch run a program of this tree, wherever it
# was built, or else the installed one in PATH. roslaunch finds only programs of ROS packages. The
# launch files therefore name a program that every ROS 1 has (IGNORED) and set this script as its
# launch-prefix; the script runs PROGRAM instead.
set -euo pipefail
program=$1
shift 2
cd "$(dirname "$0")/.."

case $program in
  hotpath) places=(build/bench install/hotpath_bench/bin) ;;
  hotpath_ros1_bridge) places=(build/ros1_bridge install/hotpath_ros1_bridge/bin) ;;
  *) echo "ros_node.sh: unknown program $program" >&2; exit 2 ;;
esac
installed=$(command -v "$program" || true)
for place in ${HOTPATH_PROGRAMS:-} "${places[@]}" ${installed:+"$(dirname "$installed")"}; do
  if [ -x "$place/$program" ]; then
    # Results of an installed program go to roslaunch's working directory, not into /usr/share.
    [ -f CMakeLists.txt ] || cd "$OLDPWD"
    arguments=("$@")
    if [ "$program" = hotpath ]; then  # not a ROS node: drop roslaunch's __name:= and __log:= arguments
      arguments=()
      for argument in "$@"; do [[ $argument == __*:=* ]] || arguments+=("$argument"); done
    fi
    exec "$place/$program" "${arguments[@]}"
  fi
done
echo "ros_node.sh: $program is not built; run launch_scripts/setup.sh ros, then launch_scripts/build.sh" >&2
exit 2
