#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# setup.sh [compile | first | ros | test]: installs the packages that building and running needs on Debian
# 12. `compile` and `first`: only for launch_scripts/hot_path.sh, `compile` without figures; `ros`: also
# for the ROS 1 bridge and RViz; `test`: for all tests.
set -euo pipefail
. "$(dirname "$0")/usage.sh"
case "$#:${1:-}" in
  0: | 1:compile | 1:first | 1:ros | 1:test) ;;
  *) wrong_use "unknown arguments $*" ;;
esac

packages=(
  build-essential cmake ninja-build
  libfastrtps-dev libfastcdr-dev fastddsgen default-jre-headless
  libyaml-cpp-dev nlohmann-json3-dev libcli11-dev libboost-dev zlib1g-dev pkg-config
)
# munkres: else Debian's fonttools, of matplotlib, installs SciPy with the headers of Python and OpenBLAS.
[ "${1:-}" = compile ] || packages+=(python3-matplotlib python3-munkres python3-jinja2 python3-tqdm)
[[ "${1:-}" =~ ^(compile|first)$ ]] || packages+=(libbabeltrace2-dev libopenmpi-dev openmpi-bin graphviz)
ros=(
  libroscpp-dev libstd-msgs-dev libdiagnostic-msgs-dev libgeometry-msgs-dev libros-rosgraph-msgs-dev libsensor-msgs-dev
  libtf2-msgs-dev libvisualization-msgs-dev
  python3-roslaunch python3-rosbag python3-rosnode python3-rosparam python3-rospy python3-rostopic
  python3-std-msgs python3-diagnostic-msgs python3-geometry-msgs python3-rosgraph-msgs python3-sensor-msgs
  python3-tf2-msgs python3-visualization-msgs
)
if [ "${1:-}" = ros ]; then
  packages+=("${ros[@]}" rviz)
elif [ "${1:-}" = test ]; then
  packages+=("${ros[@]}")
  packages+=(
    libgtest-dev libgmock-dev libbenchmark-dev clang clang-format clang-tidy libclang-rt-14-dev black flake8 mypy python3-pytest python3-jsonschema chromium
    ccache colcon python3-colcon-metadata python3-colcon-package-information python3-colcon-ros python3-colcon-cmake python3-colcon-bash python3-colcon-parallel-executor python3-colcon-test-result
    libbenchmark-tools python3-scipy
    chromium-driver python3-selenium node-typescript esbuild
  )
  command -v npm >/dev/null || packages+=(npm)
fi

missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
done
# The npm packages of the tests of the interactive page; these tests are left out without them.
add_npm_packages() {
  local web
  web="$(dirname "$0")/../bench/hotpath_report/web"
  [ "$1" != test ] || [ "$web/node_modules/.package-lock.json" -nt "$web/package-lock.json" ] ||
    npm ci --silent --ignore-scripts --prefix "$web" || echo "note: npm ci failed in $web" >&2
}
[ ${#missing[@]} -eq 0 ] && { add_npm_packages "${1:-}"; exit 0; }

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "setup.sh: sudo not found; install as root: ${missing[*]}" >&2; exit 1; }
  as_root=(sudo)
fi
echo "Installing ${missing[*]}"
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" \
  >/dev/null
add_npm_packages "${1:-}"
