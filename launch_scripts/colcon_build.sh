#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# `colcon build` of all packages, into build_colcon/ and install/. The root CMakeLists.txt, which is for people without
# colcon, hides the packages from a bare `colcon build`; base paths show them. With --bench-target TARGET first, of the
# package hotpath_bench that target alone. Further arguments go to CMake.
set -euo pipefail
cd "$(dirname "$0")/.."
export PATH="/usr/bin:$PATH"

packages=()
for folder in campaign executor reference_system analysis bench ros1_bridge; do
  [ -f "$folder/package.xml" ] && packages+=("$folder")
done
# A package.xml that colcon cannot read silently loses its dependencies; `ros.cmake` shows that it could.
found=$(colcon --log-base build_colcon/log list --base-paths "${packages[@]}")
if [ "$(grep -c 'ros.cmake' <<<"$found")" -ne ${#packages[@]} ]; then
  echo "colcon_build.sh: colcon does not read every package.xml:" >&2
  echo "$found" >&2
  exit 1
fi
# build FOLDERS -- OPTIONS: the packages in these folders; what they need has been built before.
build() {
  local folders=()
  while [ "$1" != -- ]; do folders+=("$1") && shift; done
  shift
  colcon --log-base build_colcon/log build --build-base build_colcon --base-paths "${folders[@]}" \
    --event-handlers console_direct+ "$@" >build_colcon/log/output 2>&1 || { tail -60 build_colcon/log/output >&2; exit 1; }
}
if [ "${1:-}" = --bench-target ]; then
  target=$2
  shift 2
  others=()
  for folder in "${packages[@]}"; do [ "$folder" = bench ] || others+=("$folder"); done
  build "${others[@]}" -- --cmake-args "$@"
  set +u  # colcon's script asks for variables that may not be set
  . install/local_setup.bash
  set -u
  build bench -- --cmake-target "$target" --cmake-args "$@"
else
  build "${packages[@]}" -- --cmake-args "$@"
fi
