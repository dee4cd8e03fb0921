# SPDX-License-Identifier: Apache-2.0
"""Others on the same DDS domain: they change no record, and the run counts what was not its own; nothing listens beyond
this machine unless asked for."""

import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import unittest

from hotpath_command import CommandTest, RunFolder

STRANGER = os.environ.get("STRANGER", "stranger")
DOMAIN = 100 + os.getpid() % 100
RUN = ("run", "--load", 5, "--duration", 3, "--warm-up", 0, "--domain", DOMAIN, "--output", "run")


def sockets_of(session):
    """(protocol, address) of all internet sockets that processes of the session hold."""
    inodes = set()
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            fields = (process / "stat").read_text().rpartition(")")[2].split()
            if int(fields[3]) != session:
                continue
            for file in (process / "fd").iterdir():
                found = re.match(r"socket:\[(\d+)\]", os.readlink(file))
                if found:
                    inodes.add(found[1])
        except OSError:
            continue
    sockets = set()
    for protocol in ("udp", "tcp", "udp6", "tcp6", "raw"):
        for line in pathlib.Path(f"/proc/net/{protocol}").read_text().splitlines()[1:]:
            fields = line.split()
            if fields[9] in inodes:
                sockets.add((protocol, fields[1].rpartition(":")[0]))
    return sockets


def is_local(protocol, address):
    """Whether it is this machine's loopback, or a multicast group, which is joined on an interface."""
    if len(address) != 8:
        return False
    ip = socket.inet_ntoa(struct.pack("=I", int(address, 16)))
    return protocol == "udp" and (ip.startswith("127.") or 224 <= int(ip.split(".")[0]) < 240)


class Strangers(CommandTest):
    def strange(self, *arguments):
        stranger = subprocess.Popen([STRANGER, "--domain", str(DOMAIN), *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)  # fmt: skip
        self.addCleanup(stranger.stdout.close)
        self.addCleanup(stranger.wait)
        self.addCleanup(stranger.kill)
        return stranger

    def run_beside_strangers(self, partition):
        strangers = [self.strange("--topic", t, "--partition", partition) for t in ("FrontLidarDriver", "PointsTransformerFront", "ObjectCollisionEstimator")]  # fmt: skip
        code, _, err = self.command(*RUN)
        for stranger in strangers:
            stranger.send_signal(signal.SIGTERM)
            self.assertGreater(int(stranger.communicate()[0]), 0)
        self.assertEqual(code, 0, err)
        run = RunFolder(self.folder / "run")
        self.assertTrue(run.run["complete"])
        return run

    def test_readers_meet_no_writers_of_others(self):
        run = self.run_beside_strangers("hotpath-*")
        self.assertTrue(all(e["loss_equations"]["hold"] for e in run.summary()["executors"]))
        self.assertNotIn("samples", " ".join(run.run["warnings"]))

    def test_samples_of_others_are_left_out_and_counted(self):
        # Of those that are in all partitions. In a reader's history their samples may replace ours, so that the loss
        # equations need not hold.
        run = self.run_beside_strangers("*")
        self.assertIn("samples of other programs", " ".join(run.run["warnings"]))

    def test_those_that_come_and_go_disturb_nothing(self):
        process = self.start(*RUN, stderr=subprocess.DEVNULL)
        came = 0
        while process.poll() is None:
            stranger = self.strange("--topic", "FrontLidarDriver")
            came += 1
            try:
                process.wait(0.5)
            except subprocess.TimeoutExpired:
                pass
            stranger.kill()
            stranger.wait()
        code, _, err = self.finish(process)
        self.assertEqual(code, 0, err)
        self.assertGreater(came, 2)
        self.assertTrue(RunFolder(self.folder / "run").run["complete"])

    def test_telemetry_goes_on_beside_nonsense_on_its_topics(self):
        for topic, kind in {"run": "RunInfo", "statistics": "Statistics", "chain_samples": "ChainSample"}.items():
            self.strange("--topic", f"hotpath/{topic}", "--type", f"hotpath::telemetry::{kind}", "--size", 200, "--partition", "")  # fmt: skip
        code, _, err = self.command(*RUN, "--live")
        self.assertEqual(code, 0, err)
        self.assertTrue(RunFolder(self.folder / "run").run["complete"])

    def listening(self, *arguments):
        process = self.start(*arguments)
        self.addCleanup(lambda: process.poll() is None and process.kill())
        seen = set()

        def listens():
            seen.update(sockets_of(process.pid))
            return process.poll() is not None

        self.wait_for(listens, "the run did not end")
        self.finish(process)
        return seen

    def test_nothing_listens_beyond_this_machine(self):
        for more in ([], ["--live"], ["--processes", 2], ["--network", "shared_memory", "--processes", 2]):
            with self.subTest(more=more):
                output = "run" + "".join(map(str, more)).replace("-", "")
                sockets = self.listening(*RUN[:-1], output, *more)
                self.assertTrue(sockets, "it has no socket at all")
                self.assertEqual({s for s in sockets if not is_local(*s)}, set())

    def test_the_check_finds_what_listens_everywhere(self):
        sockets = self.listening(*RUN, "--all-interfaces")
        self.assertTrue({s for s in sockets if not is_local(*s)})


if __name__ == "__main__":
    unittest.main()
