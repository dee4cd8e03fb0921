# SPDX-License-Identifier: Apache-2.0
"""The sockets and multicast groups of processes, from the kernel's tables."""

import socket
import struct
from pathlib import Path
from typing import Any

PROTOCOLS = ("udp", "tcp", "udp6", "tcp6", "raw")
ALL_HOSTS = "224.0.0.1"  # every interface joins this group


def sockets_in(tables: Any) -> Any:
    """{inode: (protocol, address)} of all internet sockets in a network namespace; `tables`:
    /proc/PID/net."""
    found = {}
    for protocol in PROTOCOLS:
        for line in (Path(tables) / protocol).read_text().splitlines()[1:]:
            fields = line.split()
            found[fields[9]] = (protocol, fields[1].rpartition(":")[0])
    return found


def dotted(address: Any) -> Any:
    """Converts an IPv4 address of the kernel's tables to dotted notation."""
    return socket.inet_ntoa(struct.pack("=I", int(address, 16)))


def is_local(protocol: str, address: Any) -> Any:
    """Whether the address is a loopback address, or a multicast group (groups_in() checks its
    interface)."""
    if len(address) != 8:
        return False
    ip = dotted(address)
    return protocol == "udp" and (ip.startswith("127.") or 224 <= int(ip.split(".")[0]) < 240)


def groups_in(tables: Any) -> Any:
    """(interface, multicast group) pairs of a network namespace, without ALL_HOSTS."""
    joined, interface = set(), ""
    for line in (Path(tables) / "igmp").read_text().splitlines()[1:]:
        fields = line.split()
        if not line.startswith("\t"):
            interface = fields[1]
        elif dotted(fields[0]) != ALL_HOSTS:
            joined.add((interface, dotted(fields[0])))
    return joined
