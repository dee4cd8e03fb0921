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
cd "$(dirname "$0")/.."
mode=(-i) python=()
[ "${1:-}" = --check ] && mode=(--dry-run --Werror) python=(--check)
git ls-files '*.cpp' '*.hpp' | xargs clang-format "${mode[@]}"

mapfile -t sources < <(git ls-files '*.py')
have() { command -v "$1" >/dev/null; }
if have black; then black "${python[@]}" "${sources[@]}"; fi
if [ "${1:-}" = --check ]; then
  if have flake8; then flake8 "${sources[@]}"; fi
  if have mypy; then mypy --no-error-summary "${sources[@]}"; fi
fi
