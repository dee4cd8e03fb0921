# shellcheck shell=bash
# SPDX-License-Identifier: Apache-2.0
# The other scripts of this folder source this file first, which leads them to the root of the tree.
# Their usage is the comment at their beginning: with --help or -h they print it and do nothing else.
script=$(realpath "$0")
usage() { sed -n '/^#!/d; /^# SPDX/d; /^#/!q; s/^# \{0,1\}//p' "$script"; }
# wrong_use MESSAGE: ends the script with exit code 2.
wrong_use() {
  { echo "$(basename "$script"): $1"; usage; } >&2
  exit 2
}
# check_cmake_arguments ARGUMENTS...: CMake's own options have one dash (-DNAME=VALUE).
check_cmake_arguments() {
  local argument
  for argument in "$@"; do
    [[ $argument == -[A-Z]* ]] || wrong_use "unknown argument $argument"
  done
}

for argument in "$@"; do
  case $argument in
    --help | -h) usage && exit 0 ;;
  esac
done
cd "$(dirname "$script")/.."
# use_compiler_cache: CMake compiles with ccache, if it is installed, and finds Debian's Python first:
# another Python in PATH lacks Debian's modules.
use_compiler_cache() {
  export PATH="/usr/bin:$PATH"
  if command -v ccache >/dev/null; then
    export CMAKE_CXX_COMPILER_LAUNCHER=ccache
    # What ccache needs to store compilations with precompiled headers.
    export CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
    export CCACHE_DEPEND=1  # without preprocessing what it does not store yet
  fi
}
# step NAME COMMAND...: runs the command and prints how long it took.
step() {
  local begin=$SECONDS status=0
  echo "== $1"
  "${@:2}" || status=$?
  echo "== $1: $((SECONDS - begin)) s"
  return $status
}
