#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# test.sh: all checks from scratch: installs missing packages, checks the format, builds the
# super-project and the colcon packages with warnings as errors, and runs all tests.
set -euo pipefail
. "$(dirname "$0")/usage.sh"
[ $# -eq 0 ] || wrong_use "unknown arguments $*"
cd "$(dirname "$0")/.."

launch_scripts/setup.sh test
echo "== format"
launch_scripts/format.sh --check
echo "== build"
launch_scripts/build.sh -DBUILD_TESTING=ON -DHOTPATH_WARNINGS_AS_ERRORS=ON
echo "== colcon, debug build"
# Like the preset `debug`, but with line tables only: assertions, no optimisation. Only this build
# finds two types with the same name. A unity build, as above, takes a third of the time; tidy.sh and
# the sanitizers compile each file alone, and find missing includes.
launch_scripts/colcon_build.sh --bench-target hotpath \
  -DBUILD_TESTING=OFF -DHOTPATH_WARNINGS_AS_ERRORS=ON -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-O0 \
  -DHOTPATH_ONE_DEFINITION=ON -DCMAKE_UNITY_BUILD=ON
echo "== commands of the debug build"
HOTPATH=$PWD/build_colcon/hotpath_bench/hotpath /usr/bin/python3 -B -m pytest bench/test/commands_test.py
echo "== tests"
# Tests that measure in real time run alone (RUN_SERIAL).
ctest --test-dir build --output-on-failure --parallel 2
