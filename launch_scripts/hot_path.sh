#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# hot_path.sh [--all] [OPTIONS...]: the hot-path benchmark from scratch: installs missing
# packages, builds, simulates Autoware's reference system under ROS 2's executors and the paper's,
# and measures it live, in less than 100 seconds. `--all` measures all executors; further options
# go to `hotpath run`.
set -euo pipefail
. "$(dirname "$0")/usage.sh"

launch_scripts/setup.sh compile
launch_scripts/setup.sh first & # Debian's Python packages take a processor for half a minute
figures=$!
trap wait EXIT  # an installation is not left behind
echo "Building (the first build takes some minutes)"
# Only the commands that it needs, unless the others are built already.
all=$(sed -n 's/^HOTPATH_ALL_COMMANDS:BOOL=//p' build/CMakeCache.txt 2>/dev/null || true)
HOTPATH_TARGET=hotpath launch_scripts/build.sh -DBUILD_TESTING=OFF "-DHOTPATH_ALL_COMMANDS=${all:-OFF}"
wait "$figures"
hotpath=build/bench/hotpath

executors=default,static,events-ro,rm-ro,edf-ro
if [ "${1:-}" = --all ]; then
  executors=all
  shift
fi
taken=yes # a graph, before all options
given=" $* "
has() { [[ $given == *" $1 "* || $given == *" $1="* ]]; }

system=() # what is simulated and measured
if ! has --executors && ! has --deployments; then system=(--executors "$executors"); fi

# The simulated answer: the options that `hotpath simulate` has, too.
known=$("$hotpath" simulate --help-all)
simulated=("${system[@]}")
for word in "$@"; do
  if [[ $word == --* ]]; then
    name=${word%%=*}
    taken=no
    case $name in
      --output | --json | --duration | --warm-up | --repetitions) ;;
      *) if grep -q -- "$name\b" <<< "$known"; then taken=yes; fi ;;
    esac
  fi
  if [ $taken = yes ]; then simulated+=("$word"); fi
done
output=${HOTPATH_OUTPUT:-runs/hot_path-$(date +%Y%m%d-%H%M%S)}
echo "Simulated for a minute, without costs:"
HOTPATH_FIGURES=none "$hotpath" simulate "${simulated[@]}" --duration 60 --no-trace --output "$output-simulated" \
  || echo "The simulation failed; the measurement follows"

# The live answer: 150 outputs of each executor. One CPU, as in the paper's uniprocessor model; the
# last CPU has the fewest interrupts on most machines.
measured=("${system[@]}")
if ! has --quick; then
  has --repetitions || measured+=(--repetitions 3)
  has --duration || measured+=(--duration 5.5)
  has --warm-up || measured+=(--warm-up 0.5)
fi
has --cpus || measured+=(--cpus $(($(nproc --all) - 1)))
echo "Measured live:"
"$hotpath" run "${measured[@]}" --output "$output" "$@"
echo "Figure: $output/hot_path.png (and .svg); all jobs: $output/jobs.csv; summary: $output/summary.json"
