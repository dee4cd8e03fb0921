#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# From nothing to passed tests: installs what is missing, checks the format, builds with warnings as errors in both
# ways (super-project and colcon), runs all tests.
set -euo pipefail
cd "$(dirname "$0")/.."

launch_scripts/setup.sh test
echo "== format"
launch_scripts/format.sh --check
echo "== build"
launch_scripts/build.sh -DBUILD_TESTING=ON -DHOTPATH_WARNINGS_AS_ERRORS=ON
echo "== colcon, debug build"
# As the preset `debug`, but without debug information: assertions, no optimisation, and every source file compiled by
# itself. A missing header and two types of one name show here alone.
launch_scripts/colcon_build.sh --bench-target hotpath \
  -DBUILD_TESTING=OFF -DHOTPATH_WARNINGS_AS_ERRORS=ON -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-O0
echo "== commands of the debug build"
HOTPATH=$PWD/build_colcon/hotpath_bench/hotpath PYTHONPATH=bench /usr/bin/python3 -B bench/test/commands_test.py
echo "== tests"
# Those that run in real time have the machine for themselves (RUN_SERIAL).
ctest --test-dir build --output-on-failure --parallel 2
