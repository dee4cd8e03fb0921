#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# From nothing to the hot-path benchmark: installs what is missing, builds, compares the paper's executors live on the
# Autoware reference system. `--all` takes all executors; further options go to `hotpath compare`.
set -euo pipefail
cd "$(dirname "$0")/.."

launch_scripts/setup.sh
echo "Building (some minutes the first time)"
HOTPATH_TARGET=hotpath launch_scripts/build.sh -DBUILD_TESTING=OFF

options=()
# default OPTION VALUE: unless the user gives that option.
default() {
  case " $given " in
    *" $1 "* | *" $1="*) ;;
    *) options+=("$1" "$2") ;;
  esac
}
executors=paper
if [ "${1:-}" = --all ]; then
  executors=all
  shift
fi
given="$*"
default --executors "$executors"
default --repetitions 3
default --duration 8
default --warm-up 1
# One processor, as in the paper's uniprocessor model; the last one has the fewest interrupts on most machines.
default --cpus $(($(nproc --all) - 1))
default --repeat-disturbed 2
output=${HOTPATH_OUTPUT:-runs/hot_path-$(date +%Y%m%d-%H%M%S)}
build/bench/hotpath compare "${options[@]}" --output "$output" "$@"
echo "The picture: $output/hot_path.png (and .svg); every job: $output/jobs.csv; the table: $output/summary.json"
