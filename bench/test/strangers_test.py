# SPDX-License-Identifier: Apache-2.0
"""Foreign programs on the same DDS domain: they change no record, and the run counts their samples.
second_host_test.py checks that without --all-interfaces nothing listens beyond this machine."""

import os
import re
import signal
import subprocess
from typing import Any

from hotpath_command import ONE, CommandTest

STRANGER = (os.environ.get("DDS_PARTNER", "dds_partner"), "strange")
DOMAIN = 100 + os.getpid() % 100
PLAN = ("run", *ONE, "--load", 5, "--warm-up", 0, "--domain", DOMAIN, "--duration")
RUN = (*PLAN, 2, "--output", "run")


class Strangers(CommandTest):
    def strange(self, *arguments: object) -> Any:
        stranger: Any = subprocess.Popen(
            [*STRANGER, "--domain", str(DOMAIN), *map(str, arguments)],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        self.addCleanup(stranger.stdout.close)
        self.addCleanup(stranger.wait)
        self.addCleanup(stranger.kill)
        return stranger

    def run_beside_strangers(self, *arguments: object) -> tuple[Any, int]:
        """A run while strangers publish on three of its topics, each with one reader; and the number
        of their samples."""
        strangers = [
            self.strange("--topic", t, *arguments)
            for t in ("FrontLidarDriver", "PointsTransformerFront", "ObjectCollisionEstimator")
        ]
        code, _, err = self.command(*RUN)
        for stranger in strangers:
            stranger.send_signal(signal.SIGTERM)
        written = [int(stranger.communicate()[0]) for stranger in strangers]
        self.assertEqual(code, 0, err)
        self.assertGreater(min(written), 0)
        run = self.checked("run")
        self.assertTrue(run.run["complete"])
        return run, sum(written)

    def test_publishers_under_the_topic_names_of_the_graph_are_not_matched(self) -> None:
        self.assertTrue(self.whole(self.run_beside_strangers("--partition", "*")[0]))

    def whole(self, run: Any) -> bool:
        self.assertNotIn("samples", " ".join(run.run["warnings"]))
        return bool(run.accounts_for_all())

    def test_samples_of_spies_are_left_out_and_counted(self) -> None:
        # Their samples may displace the run's own in a reader's history, so the loss equations need
        # not hold.
        run, written = self.run_beside_strangers("--spy")
        counted: Any = re.search(r"(\d+) samples of other programs", " ".join(run.run["warnings"]))
        self.assertIsNotNone(counted, run.run["warnings"])
        self.assertIn(int(counted[1]), range(1, written + 1))
        (jobs,) = run.jobs().values()
        own, ran = {(j.task, j.sequence) for j in jobs}, [j for j in jobs if j.outcome == "ran"]
        parents = {j.parent for j in ran if j.kind == "subscription"}
        self.assertGreater(len(parents), 100)
        self.assertEqual(parents - own, set(), "jobs of samples that no job of this run published")

    def test_a_reader_that_stops_holds_nobody_up(self) -> None:
        reader = self.strange("--topic", "FrontLidarDriver", "--spy", "--read")
        process = self.start(*RUN)
        self.addCleanup(lambda: process.poll() is None and process.kill())
        self.assertEqual(reader.stdout.readline(), "matched\n")
        reader.send_signal(signal.SIGSTOP)
        self.assertIsNone(process.poll(), "the run ended too early")
        code, _, err = self.finish(process)
        self.assertEqual(code, 0, err)
        self.assertTrue(self.whole(self.checked("run")))

    def test_those_that_come_and_go_disturb_nothing(self) -> None:
        process = self.start(*RUN, stderr=subprocess.DEVNULL)
        came = 0
        while process.poll() is None:
            strangers = [self.strange("--topic", "FrontLidarDriver", "--spy") for _ in range(4)]
            came += len(strangers)
            try:
                process.wait(0.2)
            except subprocess.TimeoutExpired:
                pass
            for stranger in strangers:
                stranger.kill()
                stranger.wait()
        code, _, err = self.finish(process)
        self.assertEqual(code, 0, err)
        self.assertGreater(came, 8)
        self.assertTrue(self.checked("run").run["complete"])
