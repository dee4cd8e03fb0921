#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# setup.sh [compile | first | ros | build | test]: installs the packages that building and running needs
# on Debian 12. `compile` and `first`: only for launch_scripts/hot_path.sh, `compile` without figures; `ros`:
# also for the ROS 1 bridge and RViz; `test`: for all tests, of which `build` is what compiling them needs.
set -euo pipefail
. "$(dirname "$0")/usage.sh"
case "$#:${1:-}" in
  0: | 1:compile | 1:first | 1:ros | 1:build | 1:test) ;;
  *) wrong_use "unknown arguments $*" ;;
esac
for_any_of() { [[ " $* " == *" ${mode:-run} "* ]]; }
mode=${1:-}

packages=(
  build-essential cmake ninja-build
  libfastrtps-dev libfastcdr-dev fastddsgen default-jre-headless
  libyaml-cpp-dev nlohmann-json3-dev libcli11-dev libboost-dev zlib1g-dev pkg-config
)
# munkres: else Debian's fonttools, of matplotlib, installs SciPy with the headers of Python and OpenBLAS.
for_any_of compile build || packages+=(python3-matplotlib python3-munkres python3-jinja2 python3-tqdm)
for_any_of compile first || packages+=(libbabeltrace2-dev graphviz)
for_any_of ros build test && packages+=(
  libroscpp-dev libstd-msgs-dev libdiagnostic-msgs-dev libgeometry-msgs-dev libros-rosgraph-msgs-dev libsensor-msgs-dev
  libtf2-msgs-dev libvisualization-msgs-dev
  python3-roslaunch python3-rosbag python3-rosnode python3-rosparam python3-rospy python3-rostopic
  python3-std-msgs python3-diagnostic-msgs python3-geometry-msgs python3-rosgraph-msgs python3-sensor-msgs
  python3-tf2-msgs python3-visualization-msgs
)
for_any_of ros && packages+=(rviz)
for_any_of build test && packages+=(
  libgtest-dev libgmock-dev libbenchmark-dev ccache colcon python3-colcon-metadata python3-colcon-package-information
  python3-colcon-ros python3-colcon-cmake python3-colcon-bash python3-colcon-parallel-executor python3-colcon-test-result
)
if for_any_of test; then
  packages+=(
    clang clang-format clang-tidy libclang-rt-14-dev black flake8 mypy python3-pytest python3-jsonschema
    libbenchmark-tools python3-scipy chromium chromium-driver python3-selenium node-typescript esbuild
  )
  command -v npm >/dev/null || packages+=(npm)
fi

missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
done
# The npm packages of the tests of the interactive page; these tests are left out without them.
add_npm_packages() {
  local web=bench/hotpath_report/web
  ! for_any_of test || [ "$web/node_modules/.package-lock.json" -nt "$web/package-lock.json" ] ||
    npm ci --silent --ignore-scripts --prefix "$web" || echo "note: npm ci failed in $web" >&2
}
[ ${#missing[@]} -eq 0 ] && { add_npm_packages; exit 0; }

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "setup.sh: sudo not found; install as root: ${missing[*]}" >&2; exit 1; }
  as_root=(sudo)
fi
echo "Installing ${missing[*]}"
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" \
  >/dev/null
add_npm_packages
