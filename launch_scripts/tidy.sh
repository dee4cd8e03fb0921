#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# tidy.sh [--minutes N] [--commits N] [FILE...]: checks all C++ sources, or only the given ones, with
# clang-tidy and the checks in .clang-tidy. With --commits, it checks those that the last N commits
# changed. With --minutes, it checks the files that changed last first, starts no file after N
# minutes, and prints how many it did not reach. Exit code 1 after a finding.
set -euo pipefail
. "$(dirname "$0")/usage.sh"
export PATH="/usr/bin:$PATH"

deadline=0 commits=()
while [ "${1:-}" = --minutes ] || [ "${1:-}" = --commits ]; do
  [[ ${2:-} =~ ^[0-9]+$ ]] || wrong_use "$1 takes a whole number, not '${2:-}'"
  if [ "$1" = --minutes ]; then deadline=$((EPOCHSECONDS + 60 * $2)); else commits=("-$2"); fi
  shift 2
done
[[ ${1:-} != -* ]] || wrong_use "unknown argument $1"
command -v clang-tidy >/dev/null || { echo "tidy.sh: install clang-tidy (launch_scripts/setup.sh test)" >&2; exit 2; }
{ cmake --preset ci && cmake --build --preset ci --target generated_code; } >build-ci.log 2>&1 || { tail -40 build-ci.log; exit 1; }

changed_last() {
  { git log "${commits[@]}" --format= --name-only -- '*.cpp' && { [ ${#commits[@]} -gt 0 ] || git ls-files '*.cpp'; }; } |
    awk '!seen[$0]++'
}
compiled=$(sed -n 's|^ *"file": "'"$PWD"'/\(.*\.cpp\)",\{0,1\}$|\1|p' build-ci/compile_commands.json)
[ $# -gt 0 ] || mapfile -t files < <(changed_last | grep -xF -f <(echo "$compiled"))
[ $# -gt 0 ] && files=("$@")
[ ${#files[@]} -gt 0 ] || { echo "clang-tidy: no source changed"; exit 0; }

# Debian's clang 14 rejects some C++20 that g++ compiles, such as captured structured bindings. Names
# that it does not know lack an include.
unknown="use of undeclared identifier|unknown type name|no (type|member|template) named .* in namespace"
unknown+="|implicit instantiation of undefined template"
export unknown
check() {
  local output status=0
  if [ "$1" -gt 0 ] && [ "$EPOCHSECONDS" -ge "$1" ]; then
    echo "left out: clang-tidy of $2, because the time was over" >&3
    return
  fi
  # Clang does not know GCC's garbage collector.
  output=$(clang-tidy -p build-ci --quiet --extra-arg=-Wno-unused-command-line-argument "$2" 2>&1) || status=1
  if grep -q '\[clang-diagnostic-error' <<<"$output" && ! grep -qE "error: .*($unknown)" <<<"$output"; then
    echo "left out: clang-tidy of $2, which clang cannot read" >&3
    return
  fi
  [ -z "$output" ] || sed '/^[0-9]* warnings generated\.$/d' <<<"$output"
  return $status
}
export -f check
status=0
skipped=$(mktemp)
trap 'rm -f "$skipped"' EXIT
printf '%s\0' "${files[@]}" |
  xargs -0 -n 1 -P "$(nproc)" bash -o pipefail -c 'check "$@"' check "$deadline" 3>>"$skipped" || status=1
echo "clang-tidy: $((${#files[@]} - $(wc -l <"$skipped"))) of ${#files[@]} files checked"
grep 'cannot read' "$skipped" || true
late=$(grep -c 'the time was over' "$skipped" || true)
[ "$late" -eq 0 ] || echo "left out: clang-tidy of $late files, because the time was over"
exit $status
