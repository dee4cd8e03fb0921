#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# nightly.sh: the checks that take hours: all tests under sanitizers, two types with one name,
# three hours of fuzzing (ten million inputs), clang-tidy of all sources, interleavings, and a soak
# of two hours. Runs all of them, and ends with exit code 1 if one failed.
set -uo pipefail
. "$(dirname "$0")/usage.sh"
[ $# -eq 0 ] || wrong_use "unknown arguments $*"
cd "$(dirname "$0")/.."

failed=()
# check NAME COMMAND...
check() {
  step "$@" || failed+=("$1")
}
# Only an unoptimised build has a symbol for each function.
one_definition() {
  cmake --preset debug -DBUILD_TESTING=OFF -DCMAKE_UNITY_BUILD=ON -DCMAKE_CXX_FLAGS_DEBUG=-O0 \
    -DHOTPATH_ONE_DEFINITION=ON >build-debug.log &&
    cmake --build --preset debug >>build-debug.log || { grep -A8 'multiple places' build-debug.log; return 1; }
}
check install launch_scripts/setup.sh test
check build launch_scripts/build.sh -DBUILD_TESTING=ON
check interleavings tools/interleavings.py
check soak tools/soak.py
check sanitizers launch_scripts/sanitize.sh --all
check one-definition one_definition
check tidy launch_scripts/tidy.sh
check fuzzing launch_scripts/fuzz.sh 180
[ ${#failed[@]} -eq 0 ] || { echo "failed: ${failed[*]}"; exit 1; }
