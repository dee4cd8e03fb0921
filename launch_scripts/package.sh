#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# package.sh [--test]: builds the Debian packages `hotpath`, `hotpath-ros1-bridge` and, for a sourced
# ROS 2, `ros-DISTRO-hotpath` into build-package/packages/. --test also installs them with their
# dependencies in an empty root of this system's release, to which it copies the sourced ROS 2, and
# runs them there; it needs root and 2 GB of disk space.
set -euo pipefail
. "$(dirname "$0")/usage.sh"
test=OFF
case "${1:-}" in
  '') ;;
  --test) test=ON ;;
  *) wrong_use "unknown argument $1" ;;
esac
[ "$test" = OFF ] || [ "$(id -u)" -eq 0 ] || { echo "package.sh: --test needs root" >&2; exit 2; }

export PATH="/usr/bin:$PATH"
distro=${ROS_DISTRO:-}

# PriorityExecutor, its container and its preload library, and the process of `hotpath run --stack rclcpp`.
ros2_package() {
  local stage=build-package/ros2 name
  launch_scripts/ros2_build.sh --no-command --distro "$distro"
  rm -rf "$stage"
  mkdir -p "$stage/DEBIAN" build-package/debian
  for name in hotpath_rclcpp_interfaces hotpath_rclcpp hotpath_rclcpp_system; do
    DESTDIR=$stage cmake --install "build_ros2/$distro/build/$name" --prefix "/opt/ros/$distro" --strip >>build-package.log
  done
  touch build-package/debian/control  # dpkg-shlibdeps reads it
  # ROS 2's own libraries may be of a source build, of which dpkg knows nothing.
  local libraries
  libraries=$(cd build-package && dpkg-shlibdeps -O --ignore-missing-info \
    $(find ros2/opt -type f \( -name '*.so' -o -path '*/lib/hotpath_*/*' \)) 2>>../build-package.log)
  cat >"$stage/DEBIAN/control" <<END
Package: ros-$distro-hotpath
Version: $(sed -n 's|.*<version>\(.*\)</version>|\1|p' ros2/hotpath_rclcpp/package.xml)
Architecture: $(dpkg --print-architecture)
Maintainer: hotpath maintainers <maintainers@hotpath.example.org>
Section: science
Depends: ${libraries#*=}
Recommends: ros-$distro-rclcpp-components, hotpath
Description: Executors with fixed priorities and EDF for unpatched rclcpp
 A drop-in executor, its component container, a library to preload, and the
 process that hotpath measures on ROS 2.
END
  dpkg-deb --root-owner-group --build "$stage" build-package/packages >>build-package.log
}

(
  unset AMENT_PREFIX_PATH CMAKE_PREFIX_PATH # nothing of a sourced ROS 2 belongs into these packages
  cmake --preset package >build-package.log
  cmake --build build-package >>build-package.log 2>&1 || { tail -40 build-package.log >&2; exit 1; }
  rm -rf build-package/packages
  (cd build-package && cpack >>../build-package.log 2>&1) || { tail -40 build-package.log >&2; exit 1; }
)
[ -z "$distro" ] || ros2_package
ls build-package/packages/*.deb
[ "$test" = ON ] || exit 0

command -v debootstrap >/dev/null || apt-get install -y -qq --no-install-recommends debootstrap >/dev/null
release=$(. /etc/os-release && echo "$VERSION_CODENAME")
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' "Codename: $release" | head -1)
root=$(mktemp -d)
chmod 755 "$root"
trap 'umount "$root/proc" 2>/dev/null || true; rm -rf --one-file-system "$root"' EXIT
debootstrap --variant=minbase "$release" "$root" "$mirror" >build-package/debootstrap.log ||
  { tail -5 build-package/debootstrap.log >&2; exit 1; }
cp /etc/apt/apt.conf.d/* "$root/etc/apt/apt.conf.d/"
cp build-package/packages/*.deb "$root/root/"
libraries=() # packages of the libraries that the copied ROS 2 needs
if [ -n "$distro" ]; then
  mkdir -p "$root/opt/ros"
  cp -a "/opt/ros/$distro" "$root/opt/ros/"
  mapfile -t libraries < <(find "/opt/ros/$distro/lib" -name '*.so' -exec ldd {} + 2>/dev/null |
    sed -n 's|.* => .*/\(lib[^ ]*\) .*|*/\1|p' | sort -u | xargs dpkg -S 2>/dev/null | sed 's/: .*//' | sort -u)
fi
mount -t proc proc "$root/proc"
echo "== in an empty $release${distro:+ with ROS 2 $distro}"
chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root DEBIAN_FRONTEND=noninteractive bash -euc '
  cd /root
  apt-get update -qq
  apt-get install -y -qq --no-install-recommends ./*.deb "$@" >install.log 2>&1 || { tail -20 install.log; exit 1; }
  hotpath --version
  hotpath simulate --duration 10 --output simulated
  hotpath report simulated
  hotpath explain simulated --executors rm-ro
  hotpath analyze autoware --executors rm-ro
  hotpath bench --quick --only scheduler --output bench
  hotpath run --executors rm-ro --repetitions 1 --transport intra_process --duration 1 --output run
  hotpath_ros1_bridge --help
  bash -c ". /usr/share/bash-completion/completions/hotpath; complete -p hotpath"
  for file in simulated/report/report.html bench/report.md run/summary.json /usr/lib/libhotpath_watch.so; do
    test -s "$file"
  done
  packages=$(dpkg-query -W -f "\${Package}\n" "*hotpath*")
  for setup in /opt/ros/*/setup.bash; do
    [ -f "$setup" ] || continue
    set +u
    . "$setup"
    hotpath run --stack rclcpp --executors default,rm-ro --repetitions 1 --duration 2 --output rclcpp
    (timeout 5 "${setup%/*}/lib/hotpath_rclcpp/component_container_hotpath" --ros-args -p executor:=edf-ro || true) 2>&1 |
      grep "edf-ro"
  done
  apt-get purge -y -qq $packages >/dev/null
  left=$(find /usr /opt -path "*hotpath*")
  test -z "$left" || { echo "left behind: $left"; exit 1; }
' bash "${libraries[@]}"
echo "== the packages install, run and can be removed"
