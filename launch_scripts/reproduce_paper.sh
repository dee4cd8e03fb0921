#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The paper's evaluation from scratch: installs missing packages, builds, simulates every experiment
# and, with --live, measures it. Writes one page. See --help and --list.
set -euo pipefail
cd "$(dirname "$0")/.."

case " $* " in
  *" --help "* | *" -h "*) ;;
  *" --list "*) launch_scripts/setup.sh ;;
  *)
    launch_scripts/setup.sh
    [ -t 2 ] && echo "Building (the first build takes some minutes)" >&2
    HOTPATH_TARGET=hotpath launch_scripts/build.sh -DBUILD_TESTING=OFF
    ;;
esac
export HOTPATH=${HOTPATH:-build/bench/hotpath}
exec /usr/bin/python3 -I -B bench reproduce "$@"
