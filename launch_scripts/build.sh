#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds the super-project into build/, or only HOTPATH_TARGET of it. Further arguments go to CMake's configuration.
set -euo pipefail
cd "$(dirname "$0")/.."

# Debian's Python first: another one in PATH lacks Debian's modules.
export PATH="/usr/bin:$PATH"
# The sources of a target are compiled several at a time, which halves the time of a whole build. After a small change
# the preset `release` takes less.
cmake -S . -B build -G Ninja -DCMAKE_UNITY_BUILD=ON "$@" >build.log 2>&1 || { cat build.log; exit 1; }
cmake --build build --target "${HOTPATH_TARGET:-all}" >>build.log 2>&1 || { grep -E -A12 'error|FAILED' build.log || cat build.log; exit 1; }
