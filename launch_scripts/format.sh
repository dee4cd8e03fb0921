#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# format.sh [--check]: formats the C++ and Python sources. With --check, changes nothing: lists
# unformatted files, and checks style and types of the Python sources. Skips Python tools that are
# not installed (`setup.sh test` installs them).
set -euo pipefail
. "$(dirname "$0")/usage.sh"
case "$#:${1:-}" in
  0: | 1:--check) ;;
  *) wrong_use "unknown arguments $*" ;;
esac
mode=(-i) python=()
[ "${1:-}" = --check ] && mode=(--dry-run --Werror) python=(--check)
mapfile -t sources < <(git ls-files '*.py')
started=()
# start TOOL ARGUMENTS...: runs it beside the others, if it is installed.
start() { if command -v "$1" >/dev/null; then "$@" & started+=($!); fi; }
if [ "${1:-}" = --check ]; then
  start mypy --no-error-summary "${sources[@]}"
  start flake8 "${sources[@]}"
fi
start black "${python[@]}" "${sources[@]}"
git ls-files '*.cpp' '*.hpp' | xargs clang-format "${mode[@]}" || failed=1
for process in "${started[@]}"; do
  wait "$process" || failed=1
done
exit ${failed:-0}
