#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Tests under sanitizers, in build folders of their presets: ThreadSanitizer for the live executor and the record log,
# AddressSanitizer with UndefinedBehaviorSanitizer for executor, graphs and analysis. With --all, the latter for every
# test but those of faults: they put a library in front of the system's, where the sanitizer's must be, or take the files
# and the memory that it needs, or lock memory, which it ignores.
set -euo pipefail
cd "$(dirname "$0")/.."
export PATH="/usr/bin:$PATH"

unity=OFF
# run PRESET TARGETS TESTS [NOT]: builds the targets and runs the tests whose names match, but for those that match NOT.
run() {
  local log="build-$1.log"
  echo "== $1"
  { cmake --preset "$1" -DCMAKE_UNITY_BUILD=$unity && cmake --build --preset "$1" --target $2; } >"$log" 2>&1 || { tail -40 "$log"; exit 1; }
  ctest --preset "$1" -R "$3" -E "${4:-^$}" --output-on-failure --no-tests=error
}

threads=(hotpath_executor_live_executor_test hotpath_executor_live_parts_test)
run tsan "${threads[*]}" "$(IFS='|'; echo "^(${threads[*]})\$")"
if [ "${1:-}" = --all ]; then
  # Debian's libbabeltrace2 loses 16 bytes when it refuses a trace, in a plugin that is unloaded before it can be named.
  # And it divides by zero, which is the import's to report: the preset leaves that signal alone.
  export HOTPATH_MUTATIONS=0
  unity=ON  # of everything it takes a third of the time
  run asan all . 'bench_(disk|failing_calls|((machine|process)_)?faults|second_host)_test'
else
  memory=(hotpath_executor_{trace,csv,simulator,wait_set,live_executor}_test)
  run asan "${memory[*]}" "$(IFS='|'; echo "^(${memory[*]})\$")"
fi
