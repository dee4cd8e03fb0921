# SPDX-License-Identifier: Apache-2.0
"""Two hosts, emulated by network namespaces with a wire between them. Without --all-interfaces,
nothing listens beyond the host's own loopback, and publishers on the other host are not matched."""

import os
import signal
import subprocess
import tempfile
import unittest
from typing import Any

from hotpath_command import CommandTest, ONE
from sockets import groups_in, is_local, sockets_in
from strangers_test import STRANGER

HERE, THERE = (f"hotpath{os.getpid()}{side}" for side in "ab")
RUN = ("--load", 5, "--duration", 0.5, "--warm-up", 0)
# Every command that uses the network, with the options that change which sockets listen.
NETWORKED = {
    "run": ("run", *ONE, *RUN),
    "live": ("run", *ONE, *RUN, "--live"),
    "processes": ("run", *ONE, *RUN, "--processes", 2),
    "shared memory": ("run", *ONE, *RUN, "--processes", 2, "--network", "shared_memory", "--live"),
    "compare": ("run", "--executors", "default,rm-ro", "--repetitions", 1, *RUN),
    "deployments": ("run", "--repetitions", 1, "--deployments", "isolated", *RUN),
    "replay": ("replay", "stored"),
}


def ip(*arguments: object) -> None:
    subprocess.run(["ip", *map(str, arguments)], check=True, capture_output=True)


def inside(host: Any) -> list[Any]:
    return ["nsenter", f"--net=/run/netns/{host}"]


class SecondHost(CommandTest):
    @classmethod
    def setUpClass(cls) -> None:
        try:
            for host in (HERE, THERE):
                ip("netns", "add", host)
                cls.addClassCleanup(ip, "netns", "del", host)
                ip("-n", host, "link", "set", "lo", "up")
            ip("link", "add", "wire", "netns", HERE, "type", "veth", "peer", "name", "wire", "netns", THERE)
            for host, number in ((HERE, 1), (THERE, 2)):
                ip("-n", host, "address", "add", f"10.77.0.{number}/24", "dev", "wire")
                ip("-n", host, "link", "set", "wire", "up")
        except (OSError, subprocess.CalledProcessError) as error:
            cls.doClassCleanups()
            raise unittest.SkipTest(f"cannot make a second host (ip netns, as root): {error}")

    def start_here(self, *arguments: object) -> Any:
        process = self.start(*arguments, given=f"exec {' '.join(inside(HERE))}")
        self.addCleanup(process.kill)
        return process

    def network_of(self, *arguments: object) -> tuple[Any, Any]:
        """(sockets, multicast groups) seen on this host while the command ran. No other program
        runs on this host."""
        sockets, groups = set(), set()
        process = self.start_here(*arguments)

        def ended() -> bool:
            tables = f"/proc/{process.pid}/net"
            try:
                if os.readlink(f"/proc/{process.pid}/ns/net") != os.readlink("/proc/self/ns/net"):
                    sockets.update(sockets_in(tables).values())
                    groups.update(groups_in(tables))
            except OSError:
                pass  # it has ended meanwhile
            return process.poll() is not None

        self.wait_for(ended, "the command did not end")
        code, _, err = self.finish(process)
        self.assertEqual(code, 0, err)
        return sockets, groups

    def test_nothing_listens_beyond_the_loopback(self) -> None:
        self.accepted("simulate", "--duration", 0.5, "--warm-up", 0, "--output", "stored")
        for name, arguments in NETWORKED.items():
            with self.subTest(name):
                output = () if name == "replay" else ("--output", name.replace(" ", "_"))
                sockets, groups = self.network_of(*arguments, *output)
                self.assertTrue(sockets, "it has no socket at all")
                self.assertEqual({s for s in sockets if not is_local(*s)}, set())
                self.assertEqual({g for g in groups if g[0] != "lo"}, set())

    def test_the_check_finds_what_listens_everywhere(self) -> None:
        sockets, groups = self.network_of("run", *ONE, *RUN, "--all-interfaces", "--output", "run")
        self.assertTrue({s for s in sockets if not is_local(*s)})
        self.assertTrue({g for g in groups if g[0] == "wire"})

    def beside_a_stranger_there(self, *arguments: object) -> Any:
        """Standard error of a run while a program on the other host reads its topic names from
        discovery traffic and publishes there."""
        with tempfile.TemporaryFile() as log:
            stranger = subprocess.Popen(
                [*inside(THERE), *STRANGER, "--all-interfaces", "--topic", "FrontLidarDriver", "--spy"],
                stdout=log, stderr=log,
            )  # fmt: skip
            try:
                process = self.start_here("run", *ONE, *RUN[:-1], 2, "--output", "run", *arguments)
                code, _, err = self.finish(process)
            finally:
                stranger.send_signal(signal.SIGTERM)
                stranger.wait()
        self.assertEqual(stranger.returncode, 0, "the stranger failed")
        self.assertEqual(code, 0, err)
        return err

    def test_a_stranger_on_the_other_host_is_not_met(self) -> None:
        self.assertNotIn("samples of other programs", self.beside_a_stranger_there())
        self.checked("run")

    def test_with_all_interfaces_a_stranger_is_met(self) -> None:
        self.assertIn("samples of other programs", self.beside_a_stranger_there("--all-interfaces"))
