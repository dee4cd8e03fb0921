#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# colcon_build.sh [--bench-target TARGET] [CMAKE ARGUMENTS...]: builds all packages with colcon into
# build_colcon/ and install/, except those of ros2/. With --bench-target, it builds only TARGET of
# the package hotpath_bench.
set -euo pipefail
. "$(dirname "$0")/usage.sh"
target=
if [ "${1:-}" = --bench-target ]; then
  target=${2:-}
  [ -n "$target" ] || wrong_use "--bench-target needs a target"
  shift 2
fi
check_cmake_arguments "$@"
cd "$(dirname "$0")/.."
export PATH="/usr/bin:$PATH"

packages=()
for folder in campaign sensor tracing executor reference_system analysis bench ros1_bridge; do
  [ -f "$folder/package.xml" ] && packages+=("$folder")
done
# colcon silently ignores the dependencies of a package.xml that it cannot read; type `ros.cmake`
# shows that it read it.
found=$(colcon --log-base build_colcon/log list --base-paths "${packages[@]}")
if [ "$(grep -c 'ros.cmake' <<<"$found")" -ne ${#packages[@]} ]; then
  echo "colcon_build.sh: colcon does not read every package.xml:" >&2
  echo "$found" >&2
  exit 1
fi
# build FOLDERS -- OPTIONS: builds the packages in these folders; their dependencies must be built
# already.
build() {
  local folders=()
  while [ "$1" != -- ]; do folders+=("$1") && shift; done
  shift
  colcon --log-base build_colcon/log build --build-base build_colcon --base-paths "${folders[@]}" \
    --event-handlers console_direct+ "$@" >build_colcon/log/output 2>&1 || { tail -60 build_colcon/log/output >&2; exit 1; }
}
if [ -n "$target" ]; then
  others=()
  for folder in "${packages[@]}"; do [ "$folder" = bench ] || others+=("$folder"); done
  build "${others[@]}" -- --cmake-args "$@"
  set +u  # colcon's script reads unset variables
  . install/local_setup.bash
  set -u
  build bench -- --cmake-target "$target" --cmake-args "$@"
else
  build "${packages[@]}" -- --cmake-args "$@"
fi
