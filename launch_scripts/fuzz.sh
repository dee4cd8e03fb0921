#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# fuzz.sh [MINUTES] [--replay] [--publish] [--seed N] [--only TARGET,...]: builds the fuzz targets
# and runs them on all CPUs for MINUTES in total (default: 1). Exit code 1 after a finding; see
# tools/fuzz.py.
set -euo pipefail
. "$(dirname "$0")/usage.sh"
use_compiler_cache
{ cmake --preset fuzz && cmake --build --preset fuzz; } >build-fuzz.log 2>&1 || { tail -40 build-fuzz.log; exit 1; }
exec tools/fuzz.py "$@"
