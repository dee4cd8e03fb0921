#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# colcon_build.sh [CMAKE ARGUMENTS...]: builds all packages with colcon into build_colcon/ and
# install/, except those of ros2/. `ctest --test-dir build_colcon` runs their tests.
set -euo pipefail
. "$(dirname "$0")/usage.sh"
check_cmake_arguments "$@"
# Without MAKEFLAGS, colcon starts no second compilation while other programs keep the machine busy.
export CMAKE_GENERATOR=Ninja MAKEFLAGS="-j$(nproc)"
use_compiler_cache

# colcon silently ignores the dependencies of a package.xml that it cannot read; type `ros.cmake`
# shows that it read it. It takes the root for a package unless it reads colcon.pkg.
packages=$(git ls-files '*/package.xml' | xargs -n 1 dirname | sort)
found=$(colcon --log-base build_colcon/log --log-level error list)
if [ "$(cut -f 2 <<<"$found" | sort)" != "$packages" ] || grep -v 'ros\.' <<<"$found"; then
  echo "colcon_build.sh: colcon does not find the packages (launch_scripts/setup.sh test):" >&2
  echo "$found" >&2
  exit 1
fi
mapfile -t folders < <(grep -v '^ros2/' <<<"$packages")
colcon --log-base build_colcon/log build --build-base build_colcon --base-paths "${folders[@]}" \
  --event-handlers console_direct+ --cmake-args "$@" >build_colcon/log/output 2>&1 ||
  { grep -E -A12 'error|FAILED' build_colcon/log/output || tail -60 build_colcon/log/output; exit 1; } >&2
# One run of ctest for all packages: no test of one package runs beside a serial one of another.
for folder in "${folders[@]}"; do
  echo "subdirs(hotpath_$folder)"
done >build_colcon/CTestTestfile.cmake
