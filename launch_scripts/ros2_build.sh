#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# ros2_build.sh [--test] [--no-command] [--sanitize thread|address] [--distro NAME]
#   [CMAKE ARGUMENTS...]: builds the command hotpath, the packages of ros2/ and their dependencies
# with colcon into build_ros2/DISTRO/, for the sourced ROS 2 or, without one, for each in /opt/ros.
#   --test      also builds and runs the tests
#   --no-command  leaves out the command hotpath; tests that need it use that of build/
#   --sanitize  builds and runs the tests under that sanitizer in build_ros2/DISTRO-SANITIZER/,
#               without the command; `address` includes undefined behaviour
#   --distro    builds for this distribution; may be repeated
set -euo pipefail
. "$(dirname "$0")/usage.sh"
root=$PWD
export PATH="/usr/bin:$PATH"

test=OFF
command=ON
sanitizer=
distros=()
while [ $# -gt 0 ]; do
  case $1 in
    --test) test=ON && shift ;;
    --no-command) command=OFF && shift ;;
    --sanitize | --distro)
      [ $# -ge 2 ] || wrong_use "$1 needs a value"
      if [ "$1" = --distro ]; then distros+=("$2"); else sanitizer=$2; fi
      shift 2
      ;;
    *) break ;;
  esac
done
check_cmake_arguments "$@"
case $sanitizer in
  '') flags= ;;
  thread) flags=thread ;;
  address) flags=address,undefined ;;
  *) wrong_use "--sanitize takes thread or address, not $sanitizer" ;;
esac
sourced=${ROS_DISTRO:-$(sed -n 's|.*/opt/ros/\([^/:]*\).*|\1|p' <<<"${AMENT_PREFIX_PATH:-}")}
if [ ${#distros[@]} -eq 0 ] && [ -n "$sourced" ]; then
  distros=("$sourced")
elif [ ${#distros[@]} -eq 0 ]; then
  for setup in /opt/ros/*/setup.bash; do
    [ -f "$setup" ] && distros+=("$(basename "$(dirname "$setup")")")
  done
fi
if [ ${#distros[@]} -eq 0 ]; then
  echo "left out: hotpath_rclcpp and its tests, because no ROS 2 is sourced and none is in /opt/ros" >&2
  exit 0
fi

[ -n "$sanitizer" ] && test=ON && command=OFF

# build DISTRO: call it in a subshell, since each distribution sets its own environment.
build() {
  local base=build_ros2/$1${sanitizer:+-$sanitizer}
  mkdir -p "$base/log"
  local cmake=(--cmake-args -G Ninja -DHOTPATH_FASTDDS=OFF -DPython3_EXECUTABLE=/usr/bin/python3)
  if [ -n "$flags" ]; then
    cmake+=(-DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG= -DCMAKE_CXX_FLAGS="-O1 -g1 -fno-omit-frame-pointer -fsanitize=$flags")
  fi
  shift
  run() {
    local testing=$1 folders=()
    shift
    while [ "$1" != -- ]; do folders+=("$1") && shift; done
    shift
    colcon --log-base "$base/log" build --build-base "$base/build" --install-base "$base/install" \
      --base-paths "${folders[@]}" --executor sequential --event-handlers console_direct+ \
      "${cmake[@]}" -DBUILD_TESTING="$testing" "$@" >"$base/log/output" 2>&1 || { tail -60 "$base/log/output" >&2; exit 1; }
  }
  # Under a sanitizer, hotpath_rclcpp compiles the parts of executor and reference_system that it
  # needs itself.
  local before=(ros2/hotpath_rclcpp_interfaces)
  [ -n "$sanitizer" ] || before+=(executor reference_system)
  [ "$command" = OFF ] || before+=(sensor tracing analysis bench)
  run OFF "${before[@]}" -- "$@"
  . "$base/install/local_setup.bash"
  run "$test" ros2/hotpath_rclcpp -- "$@"
  . "$base/install/local_setup.bash"
  [ -n "$sanitizer" ] || run OFF ros2/hotpath_rclcpp_system -- "$@"
  [ "$command" = OFF ] || run OFF ros2/hotpath -- "$@"
  [ "$test" = OFF ] && return
  . "$base/install/local_setup.bash"
  [ "$command" = ON ] || [ ! -x build/bench/hotpath ] || export HOTPATH_COMMAND=$root/build/bench/hotpath
  local local=ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST
  [ "$ROS_DISTRO" = humble ] && local=ROS_LOCALHOST_ONLY=1
  # The tests get their own domain, so that they meet no other program's nodes. ros2/sanitizers/
  # lists the suppressions with their reasons; AddressSanitizer also ignores the sized-delete
  # mismatch of Fast DDS. The system's and ROS 2's libraries are not instrumented, so their internal
  # errors are not reported. ThreadSanitizer slows rclcpp's own executors so much that they lose
  # samples and hang: their tests are skipped.
  [ "$sanitizer" = thread ] && export GTEST_FILTER='-*/single:*/multi:*/events'
  TSAN_OPTIONS="suppressions=$root/ros2/sanitizers/thread.supp ignore_noninstrumented_modules=1" \
    ASAN_OPTIONS="new_delete_type_mismatch=0" \
    env "$local" ROS_DOMAIN_ID=${ROS_DOMAIN_ID:-$((100 + $$ % 100))} \
    ctest --test-dir "$base/build/hotpath_rclcpp" --output-on-failure
  sed -n '/^left out: /p' "$base/build/hotpath_rclcpp/Testing/Temporary/LastTest.log"
}

for distro in "${distros[@]}"; do
  echo "== ROS 2 $distro"
  (
    set +u  # ROS 2's scripts read unset variables
    [ "$distro" = "$sourced" ] || . "/opt/ros/$distro/setup.bash"
    cd "$root"
    build "$distro" "$@"
  )
done
