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
echo "== colcon"
# As a debug build, which takes less time and has the assertions that the other leaves out. Of bench, which takes most
# of the time, what needs every other package.
launch_scripts/colcon_build.sh --bench-target hotpath_bench_simulated \
  -DBUILD_TESTING=OFF -DHOTPATH_WARNINGS_AS_ERRORS=ON -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-O0 \
  -DCMAKE_UNITY_BUILD=ON
echo "== tests"
# Those that run in real time have the machine for themselves (RUN_SERIAL).
ctest --test-dir build --output-on-failure --parallel 2
