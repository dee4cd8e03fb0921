#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# build.sh [CMAKE ARGUMENTS...]: builds the super-project, or only its target HOTPATH_TARGET, into
# build/. Arguments go to CMake's configure step.
set -euo pipefail
. "$(dirname "$0")/usage.sh"
check_cmake_arguments "$@"

use_compiler_cache
# A unity build halves the time of a full build. After a small change the preset `release` is
# faster.
cmake -S . -B build -G Ninja -DCMAKE_UNITY_BUILD=ON -DHOTPATH_ALL_COMMANDS=ON "$@" >build.log 2>&1 || { cat build.log; exit 1; }
cmake --build build --target "${HOTPATH_TARGET:-all}" >>build.log 2>&1 || { grep -E -A12 'error|FAILED' build.log || cat build.log; exit 1; }
