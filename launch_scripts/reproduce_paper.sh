#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# reproduce_paper.sh [OPTIONS...]: the paper's evaluation from scratch: installs missing packages,
# builds, simulates every experiment and, with --live, measures it. Writes one page. Options are those
# of `hotpath paper figures`; --list lists the items instead.
set -euo pipefail
. "$(dirname "$0")/usage.sh"

launch_scripts/setup.sh
[ -t 2 ] && echo "Building (the first build takes some minutes)" >&2
HOTPATH_TARGET=hotpath launch_scripts/build.sh -DBUILD_TESTING=OFF
hotpath=${HOTPATH:-build/bench/hotpath}
if [ "$*" = --list ]; then exec "$hotpath" list figures; fi
exec "$hotpath" paper figures "$@"
