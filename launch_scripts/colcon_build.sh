#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# `colcon build` of all packages, into build_colcon/ and install/. The root CMakeLists.txt, which is for people without
# colcon, hides the packages from a bare `colcon build`; base paths show them. Further arguments go to CMake.
set -euo pipefail
cd "$(dirname "$0")/.."
export PATH="/usr/bin:$PATH"

packages=()
for folder in executor reference_system analysis bench ros1_bridge; do
  [ -f "$folder/package.xml" ] && packages+=("$folder")
done
# A package.xml that colcon cannot read silently loses its dependencies; `ros.cmake` shows that it could.
found=$(colcon --log-base build_colcon/log list --base-paths "${packages[@]}")
if [ "$(grep -c 'ros.cmake' <<<"$found")" -ne ${#packages[@]} ]; then
  echo "colcon_build.sh: colcon does not read every package.xml:" >&2
  echo "$found" >&2
  exit 1
fi
colcon --log-base build_colcon/log build --build-base build_colcon --base-paths "${packages[@]}" \
  --event-handlers console_direct- --cmake-args "$@"
