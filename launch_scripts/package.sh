#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# package.sh [--test]: builds the Debian packages `hotpath` and `hotpath-ros1-bridge` into
# build-package/packages/. --test also installs them with their dependencies in an empty
# Debian 12 root, and runs them there; it needs root and 2 GB of disk space.
set -euo pipefail
. "$(dirname "$0")/usage.sh"
cd "$(dirname "$0")/.."
test=OFF
case "${1:-}" in
  '') ;;
  --test) test=ON ;;
  *) wrong_use "unknown argument $1" ;;
esac
[ "$test" = OFF ] || [ "$(id -u)" -eq 0 ] || { echo "package.sh: --test needs root" >&2; exit 2; }

export PATH="/usr/bin:$PATH"
unset AMENT_PREFIX_PATH CMAKE_PREFIX_PATH  # nothing of a sourced ROS 2 belongs into these packages
cmake --preset package >build-package.log
cmake --build build-package >>build-package.log 2>&1 || { tail -40 build-package.log >&2; exit 1; }
rm -rf build-package/packages
(cd build-package && cpack >>../build-package.log 2>&1) || { tail -40 build-package.log >&2; exit 1; }
ls build-package/packages/*.deb
[ "$test" = ON ] || exit 0

command -v debootstrap >/dev/null || apt-get install -y -qq --no-install-recommends debootstrap >/dev/null
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Codename: bookworm' | head -1)
root=$(mktemp -d)
chmod 755 "$root"
trap 'umount "$root/proc" 2>/dev/null || true; rm -rf --one-file-system "$root"' EXIT
debootstrap --variant=minbase bookworm "$root" "$mirror" >build-package/debootstrap.log ||
  { tail -5 build-package/debootstrap.log >&2; exit 1; }
cp /etc/apt/apt.conf.d/* "$root/etc/apt/apt.conf.d/"
cp build-package/packages/*.deb "$root/root/"
mount -t proc proc "$root/proc"
echo "== in an empty Debian 12"
chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root DEBIAN_FRONTEND=noninteractive bash -euc '
  cd /root
  apt-get update -qq
  apt-get install -y -qq --no-install-recommends ./*.deb >install.log 2>&1 || { tail -20 install.log; exit 1; }
  hotpath --version
  hotpath simulate --duration 10 --output simulated
  hotpath report simulated
  hotpath explain simulated --executor rm-ro
  hotpath analyze autoware --executors rm-ro
  hotpath bench --quick --only scheduler --output bench
  hotpath run --executors rm-ro --repetitions 1 --transport intra_process --duration 1 --output run
  hotpath_ros1_bridge --help
  bash -c ". /usr/share/bash-completion/completions/hotpath; complete -p hotpath"
  for file in simulated/report/report.html bench/report.md run/summary.json /usr/lib/libhotpath_watch.so; do
    test -s "$file"
  done
  apt-get purge -y -qq hotpath hotpath-ros1-bridge >/dev/null
  left=$(find /usr -path "*hotpath*")
  test -z "$left" || { echo "left behind: $left"; exit 1; }
'
echo "== the packages install, run and can be removed"
