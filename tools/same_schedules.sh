#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Proves that two builds of `hotpath` make the same schedules: every graph that the old one can read, every executor that it
# has, three seeds, phases in creation order and at random; jobs.csv and the first six columns of chains.csv must be
# identical byte by byte (versions up to 0.1.0 lack the seventh, sink_task).
# Usage: tools/same_schedules.sh OLD_HOTPATH NEW_HOTPATH
set -euo pipefail
[ $# -eq 2 ] || { echo "usage: same_schedules.sh OLD_HOTPATH NEW_HOTPATH" >&2; exit 2; }
export HOTPATH_FIGURES=none
executors=$("$1" list executors | cut -d" " -f1 | paste -sd,)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
compared=0 different=0
for graph in $("$1" list graphs | cut -d' ' -f1); do
  "$1" graph "$graph" >/dev/null 2>&1 || continue  # newer than the old program
  for seed in 1 2 3; do
    for phases in creation random; do
      for program in "$1" "$2"; do
        side=$([ "$program" = "$1" ] && echo old || echo new)
        rm -rf "${folder:?}/$side"
        "$program" simulate --graph "$graph" --executors "$executors" --seed "$seed" --phases "$phases" --duration 20 \
          --repetitions 2 --output "$folder/$side" >/dev/null
      done
      for columns in jobs.csv:1- chains.csv:1-6; do
        file=${columns%:*}
        compared=$((compared + 1))
        cmp <(cut -d, -f"${columns#*:}" "$folder/old/$file") <(cut -d, -f"${columns#*:}" "$folder/new/$file") ||
          { echo "$graph $seed $phases: $file differs"; different=$((different + 1)); }
      done
    done
  done
done
echo "$compared files compared, $different differ"
[ "$different" -eq 0 ]
