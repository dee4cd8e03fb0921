#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# hot_path.sh [--all] [OPTIONS...]: the hot-path benchmark from scratch: installs missing
# packages, builds, and compares the paper's executors live on the Autoware reference system.
# `--all` compares all executors; further options go to `hotpath compare`.
set -euo pipefail
. "$(dirname "$0")/usage.sh"
cd "$(dirname "$0")/.."

launch_scripts/setup.sh
echo "Building (the first build takes some minutes)"
HOTPATH_TARGET=hotpath launch_scripts/build.sh -DBUILD_TESTING=OFF

options=()
# default OPTION VALUE: adds the option unless the user gave it.
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
# One CPU, as in the paper's uniprocessor model; the last CPU has the fewest interrupts on most
# machines.
default --cpus $(($(nproc --all) - 1))
default --repeat-slow 2
output=${HOTPATH_OUTPUT:-runs/hot_path-$(date +%Y%m%d-%H%M%S)}
build/bench/hotpath compare "${options[@]}" --output "$output" "$@"
echo "Figure: $output/hot_path.png (and .svg); all jobs: $output/jobs.csv; summary: $output/summary.json"
