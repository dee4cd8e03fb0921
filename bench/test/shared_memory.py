# SPDX-License-Identifier: Apache-2.0
"""A /dev/shm and a network for one test program, and files that it leaves behind."""

import ctypes
import fcntl
import functools
import os
import socket
import struct
import unittest
from pathlib import Path

FOLDER = Path("/dev/shm")
# LTTng's library, which ROS 2's tracetools loads, makes these for all programs of a machine or user.
LTTNG = "lttng-ust-wait-"
# Of <sched.h>, <sys/mount.h> and <net/if.h>.
CLONE_NEWNS, CLONE_NEWNET, MS_REC, MS_SLAVE = 0x20000, 0x40000000, 0x4000, 0x80000
SIOCSIFFLAGS, IFF_UP = 0x8914, 1
# Set for tests that run beside others with the same domains and ports.
PRIVATE_NETWORK = bool(os.environ.get("HOTPATH_PRIVATE_NETWORK"))


@functools.cache
def make_private() -> bool:
    """Gives this process, and all that it starts from now on, a /dev/shm of its own, in which no unrelated
    program leaves files; with PRIVATE_NETWORK also a loopback interface. False where that is not permitted:
    then both stay the machine's."""
    libc = ctypes.CDLL(None, use_errno=True)
    if PRIVATE_NETWORK and libc.unshare(CLONE_NEWNET) == 0:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
            fcntl.ioctl(any_socket, SIOCSIFFLAGS, struct.pack("16sh14x", b"lo", IFF_UP))
    if libc.unshare(CLONE_NEWNS) != 0 or libc.mount(b"none", b"/", None, MS_REC | MS_SLAVE, None) != 0:
        return False
    return bool(libc.mount(b"tmpfs", os.fsencode(FOLDER), b"tmpfs", 0, b"mode=1777") == 0)


def files() -> set[str]:
    """Names of the files of /dev/shm, without LTTng's."""
    return {file.name for file in FOLDER.iterdir() if not file.name.startswith(LTTNG)}


def in_use(name: str) -> bool:
    """Whether a living process has mapped or opened this file of /dev/shm."""
    path = FOLDER / name
    try:
        known = path.stat()
    except FileNotFoundError:
        return False
    device = f"{os.major(known.st_dev):02x}:{os.minor(known.st_dev):02x}"
    for process in Path("/proc").iterdir():
        if not process.name.isdigit():
            continue
        try:
            mapped = (line.split(maxsplit=5)[3:5] for line in (process / "maps").read_text().splitlines())
            if [device, str(known.st_ino)] in mapped:
                return True
            opened = [descriptor for descriptor in (process / "fd").iterdir() if descriptor.exists()]
            if any(os.path.samestat(descriptor.stat(), known) for descriptor in opened):
                return True
        except OSError:  # the process has ended
            pass
    return False


def left_behind(before: set[str]) -> set[str]:
    """New files of /dev/shm since `before` that no process uses. Where /dev/shm is not private, some may
    belong to unrelated programs."""
    return {name for name in files() - before if not in_use(name) and (FOLDER / name).exists()}


def expect_nothing_left_behind(test: unittest.TestCase) -> None:
    """The test fails at its end if it, or a program that it started, left a file behind."""
    make_private()
    before = files()
    test.addCleanup(lambda: test.assertEqual(left_behind(before), set(), "in /dev/shm"))
