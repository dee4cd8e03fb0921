#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# test.sh: all checks from scratch: installs missing packages, builds the colcon packages with assertions
# and with warnings as errors, checks the format and the ceilings of lines, and runs all tests.
set -euo pipefail
. "$(dirname "$0")/usage.sh"
[ $# -eq 0 ] || wrong_use "unknown arguments $*"

step install launch_scripts/setup.sh build
launch_scripts/setup.sh test & # what only the checks need, beside the build
checkers=$!
trap wait EXIT # an installation is not left behind
# Like the preset `release`, but with assertions. A unity build takes a third of the time; tidy.sh
# compiles each file alone, and finds missing includes.
step build launch_scripts/colcon_build.sh \
  -DBUILD_TESTING=ON -DHOTPATH_WARNINGS_AS_ERRORS=ON -DCMAKE_CXX_FLAGS_RELWITHDEBINFO=-O2 -DCMAKE_UNITY_BUILD=ON
step packages wait "$checkers"
step format launch_scripts/format.sh --check
step ceilings tools/ceilings.py
# Tests that measure in real time run alone (RUN_SERIAL); others of live runs mostly wait.
step tests ctest --test-dir build_colcon --output-on-failure --parallel $(($(nproc) + 2))
