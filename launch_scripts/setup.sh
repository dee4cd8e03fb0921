#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing on Debian 12. `setup.sh` for building and running, `setup.sh test` for the tests as well.
set -euo pipefail

packages=(
  build-essential cmake ninja-build
  libfastrtps-dev libfastcdr-dev fastddsgen default-jre-headless
  libyaml-cpp-dev nlohmann-json3-dev libcli11-dev
  python3-matplotlib python3-scipy python3-jinja2 graphviz
)
if [ "${1:-}" = test ]; then
  packages+=(
    libgtest-dev libgmock-dev libbenchmark-dev clang-format chromium
    colcon python3-colcon-package-information python3-colcon-ros python3-colcon-cmake python3-colcon-bash python3-colcon-test-result
  )
fi

missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
done
[ ${#missing[@]} -eq 0 ] && exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "setup.sh: install as root: ${missing[*]}" >&2; exit 1; }
  as_root=(sudo)
fi
echo "Installing ${missing[*]}"
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" \
  >/dev/null
