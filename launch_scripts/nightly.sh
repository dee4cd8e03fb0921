#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# nightly.sh: the checks that take hours: all tests under sanitizers, types of the same name,
# three hours of fuzzing (ten million inputs), clang-tidy of all sources, interleavings, large graphs,
# packages in an empty root, and a soak of two hours. Runs all of them, and ends with exit code 1 if
# one failed.
set -uo pipefail
. "$(dirname "$0")/usage.sh"
[ $# -eq 0 ] || wrong_use "unknown arguments $*"

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
# large NODES LENGTH PERIOD_MS OPTIONS...: runs a graph of chains live, and checks its schedule.
large() {
  local folder code=0
  folder=$(mktemp -d)
  awk -v nodes="$1" -v length_="$2" -v period="$3" 'BEGIN {
    print "name: chains\nnodes:"
    for (i = 0; i < nodes; ++i)
      if (i % length_) printf "  - {name: N%d, type: transform, input: N%d, execution_time_ms: 0.001}\n", i, i - 1
      else printf "  - {name: N%d, type: sensor, period_ms: %s}\n", i, period
  }' >"$folder/graph.yaml"
  build/bench/hotpath run "$folder/graph.yaml" --executors rm-ro --duration 10 --warm-up 0 "${@:4}" \
    --output "$folder/run" && build/bench/hotpath doctor "$folder/run" || code=1
  rm -r "$folder"
  return $code
}
# The build of hot_path.sh.
first_commands() {
  cmake -S . -B build-first -G Ninja -DCMAKE_UNITY_BUILD=ON -DHOTPATH_ALL_COMMANDS=OFF >build-first.log &&
    cmake --build build-first --target hotpath >>build-first.log || { tail -20 build-first.log; return 1; }
  HOTPATH_FIGURES=none build-first/bench/hotpath simulate autoware --output "$(mktemp -d)/run" &&
    build-first/bench/hotpath import ctf trace 2>&1 | grep -q 'Not built yet'
}
check install launch_scripts/setup.sh test
check build launch_scripts/build.sh -DBUILD_TESTING=ON
check first-commands first_commands
check interleavings env HOTPATH_INTERLEAVINGS=70000 \
  build/executor/hotpath_executor_interleavings_test --gtest_output=json:build/interleavings.json
check 5000-nodes large 5000 5 1000 --phases random
check 10000-tasks large 10000 5 1000 --phases random --transport intra_process
check 100-processes large 200 2 100 --processes 100
check 1000-a-second large 6 6 1
check every-fault env HOTPATH_FAULTS=0 ctest --test-dir build -R failing_calls_test --output-on-failure
check soak tools/soak.py
check packages launch_scripts/package.sh --test
check sanitizers launch_scripts/sanitize.sh --all
check one-definition one_definition
check tidy launch_scripts/tidy.sh
check fuzzing launch_scripts/fuzz.sh 180
[ ${#failed[@]} -eq 0 ] || { echo "failed: ${failed[*]}"; exit 1; }
