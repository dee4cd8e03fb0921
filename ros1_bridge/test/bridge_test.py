#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Tests the bridge between a real benchmark and a real roscore from the view of a ROS 1 subscriber.

`bridge_test.py soak --seconds 300` runs the long memory test."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import partners
from partners import CLOCK, CLOUD, DIAGNOSTICS, FLOAT, GRAPH, TEXT, TRANSFORMS, BridgeTest, wait_for

HOT_PATH = "hot_path"
TOPICS = {
    f"/hotpath/latency/{HOT_PATH}": FLOAT,
    "/hotpath/response_time/ObjectCollisionEstimator": FLOAT,
    "/hotpath/graph": GRAPH,
    "/hotpath/run": TEXT,
    "/diagnostics": DIAGNOSTICS,
    "/hotpath/points/FrontLidarDriver": CLOUD,
    "/tf_static": TRANSFORMS,
}
RUN = {"/hotpath/run": TEXT}
WRONG_USE = 2
TRACED_SYSTEM = os.environ.get("TRACED_SYSTEM", "")


def executor_of(run: Any) -> Any:
    return json.loads(run["data"])["executor"]


def values_of(diagnostics: Any, name: str) -> Any:
    """{key: value} of the status whose name ends with `name`; None if the array has no such status."""
    for status in diagnostics["status"]:
        if status["name"].endswith(name):
            return {v["key"]: v["value"] for v in status["values"]}
    return None


class WholeRun(BridgeTest):
    def latencies(self, output: str | Path) -> list[Any]:
        with open(self.folder / output / "chains.csv", newline="") as file:
            return [int(row["hot_path_latency_ns"]) for row in csv.DictReader(file)]

    def await_last(self, listener: Any, expected: Any) -> None:
        def arrived() -> Any:
            samples = listener.messages(f"/hotpath/latency/{HOT_PATH}")
            return samples and round(samples[-1]["data"] * 1e6) == expected[-1]

        wait_for(arrived, "the run's last sample")

    def check_latencies(self, listener: Any, expected: Any) -> None:
        """Checks that the topic carries each sample of the run's result once and in order, from the
        moment of connection on."""
        samples = listener.messages(f"/hotpath/latency/{HOT_PATH}")
        self.assertGreater(len(samples), len(expected) / 2)
        self.assertEqual([round(m["data"] * 1e6) for m in samples], expected[-len(samples) :])

    def check_graph(self, listener: Any) -> None:
        markers = listener.messages("/hotpath/graph")[-1]["markers"]
        groups: dict[Any, Any] = {}
        for marker in markers:
            groups.setdefault(marker["ns"], []).append(marker)
        self.assertEqual(len(groups["nodes"]), 24)
        self.assertEqual(len({(m["ns"], m["id"]) for m in markers}), len(markers))
        self.assertEqual(len(groups["figures"]), 24)
        self.assertTrue(any("ms" in m["text"] for m in groups["figures"]))
        self.assertIn("rm-ro", groups["title"][0]["text"])
        self.assertIn("median", groups["chains"][0]["text"])

    def check_points(self, listener: Any) -> None:
        clouds = listener.messages("/hotpath/points/FrontLidarDriver")
        self.assertGreater(len(clouds), 10)
        for cloud in clouds:
            self.assertEqual([f["name"] for f in cloud["fields"]], ["x", "y", "z", "intensity"])
        frames = {t["child_frame_id"] for t in listener.messages("/tf_static")[-1]["transforms"]}
        self.assertEqual(frames, {"hotpath/FrontLidarDriver", "hotpath/RearLidarDriver"})
        self.assertIn(clouds[0]["header"]["frame_id"], frames)

    def test_everything_arrives_and_can_be_recorded_and_played_back(self) -> None:
        self.master.start()
        bridge = self.start_bridge()
        bridge.says("waiting for a benchmark")
        listener = self.listen(TOPICS)
        record = self.start_process(["rosbag", "record", "-q", "-a", "-O", "all.bag"])
        wait_for(lambda: (self.folder / "all.bag.active").exists(), "the bag")
        begun = time.time_ns()
        benchmark = self.start_benchmark(3)
        self.assertEqual(benchmark.wait(), 0, benchmark.output)
        expected = self.latencies("run")
        self.assertGreater(len(expected), 20)
        self.await_last(listener, expected)
        bridge.says("the benchmark has gone")
        ended = time.time_ns()

        self.assertEqual({t: n for t, n in self.master.topics().items() if t in TOPICS}, TOPICS)
        self.check_latencies(listener, expected)
        stamps = [m["header"]["stamp"] for m in listener.messages("/hotpath/points/FrontLidarDriver")]
        self.assertEqual(stamps, sorted(stamps))
        self.assertTrue(begun < stamps[0] and stamps[-1] < ended)
        self.check_graph(listener)
        self.check_points(listener)
        run = json.loads(listener.messages("/hotpath/run")[0]["data"])
        self.assertEqual((run["graph"], run["executor"], run["origin"]), ("autoware", "rm-ro", "live"))
        self.assertEqual(len(run["nodes"]), 24)
        self.check_health(listener, expected)

        self.assertEqual(record.end(), 0, record.output)
        self.assert_ends_well(bridge)
        self.check_playback(expected)
        self.check_replay(expected)

    def check_replay(self, expected: Any) -> None:
        """Replays the stored result through a bridge and checks samples and clock."""
        bridge = self.start_bridge()
        bridge.says("waiting for a benchmark")
        listener = self.listen({**TOPICS, "/clock": CLOCK})
        replay = self.start_process(
            [partners.HOTPATH, "replay", "run", "--domain", self.domain, "--rate", 400]
        )
        self.assertEqual(replay.wait(), 0, replay.output)
        self.await_last(listener, expected)
        self.check_latencies(listener, expected)
        run = json.loads(listener.messages("/hotpath/run")[-1]["data"])
        self.assertEqual(run["origin"], "replay")
        clock = [m["clock"] for m in listener.messages("/clock")]
        self.assertEqual(clock, sorted(clock))
        self.assertLess(run["epoch_ns"], clock[0])
        self.assertGreater(clock[-1], run["epoch_ns"] + 2.5e9)  # of 3 s
        self.assert_ends_well(bridge)

    def check_health(self, listener: Any, expected: Any) -> None:
        diagnostics = listener.messages("/diagnostics")
        node = next(v for v in (values_of(d, ": FrontLidarDriver") for d in reversed(diagnostics)) if v)
        self.assertGreater(int(node["ran"]), 10)
        self.assertLessEqual({"skipped", "overwritten", "deadline overruns", "queue"}, node.keys())

        def complete(diagnostics: Any) -> Any:
            own = values_of(diagnostics, ": bridge")
            return own and int(own["chain_samples received"]) + int(own["samples before the first"]) == len(
                expected
            )

        own = listener.wait_for("/diagnostics", complete)
        for key, value in values_of(own, ": bridge").items():
            if "dropped" in key or "lost" in key or key in ("malformed", "samples of another run"):
                self.assertEqual((key, value), (key, "0"))

    def check_playback(self, expected: Any) -> None:
        topics = {topic: name for topic, name in TOPICS.items() if "latency" in topic}
        listener = self.listen(topics)
        options = ["-q", "-r", 8, "--wait-for-subscribers", "--bags=all.bag"]
        play = self.start_process(["rosbag", "play", *options, "--topics", *topics])
        self.assertEqual(play.wait(), 0, play.output)
        self.await_last(listener, expected)
        self.check_latencies(listener, expected)


class LossOfAPartner(BridgeTest):
    def await_run(self, listener: Any, executor: str) -> None:
        """Waits until that run is shown, with samples."""
        listener.wait_for("/hotpath/run", lambda run: executor_of(run) == executor)
        before = len(listener.messages(f"/hotpath/latency/{HOT_PATH}"))
        wait_for(
            lambda: len(listener.messages(f"/hotpath/latency/{HOT_PATH}")) > before, f"samples of {executor}"
        )

    def test_bridge_first_and_each_partner_again(self) -> None:
        bridge = self.start_bridge()
        bridge.says("waiting for a ROS master")
        self.master.start()
        bridge.says("waiting for a benchmark")
        first = self.start_benchmark(60, "rm-ro", output="first")
        self.assertEqual(executor_of(self.listen(RUN).wait_for("/hotpath/run")), "rm-ro")

        self.master.stop()
        bridge.says("has gone; known subscribers go on")
        self.master.start()
        bridge.says("registered all topics with the new ROS master")
        again = self.listen(TOPICS)  # latched and live topics, through the new master
        again.wait_for("/hotpath/run")
        again.wait_for(f"/hotpath/latency/{HOT_PATH}")

        first.end()
        bridge.says("the benchmark has gone")
        second = self.start_benchmark(60, "edf-ro", output="second")
        self.await_run(again, "edf-ro")

        self.assert_ends_well(bridge, signal.SIGTERM)
        bridge = self.start_bridge()  # in the middle of a run
        listener = self.listen(TOPICS)
        self.assertEqual(executor_of(listener.wait_for("/hotpath/run")), "edf-ro")
        listener.wait_for(f"/hotpath/latency/{HOT_PATH}")
        second.kill()
        third = self.start_benchmark(60, "dm-ro", output="third")
        self.await_run(listener, "dm-ro")
        third.end()
        self.assert_ends_well(bridge)

    def test_two_domains_do_not_mix(self) -> None:
        self.master.start()
        other = 100 + (self.domain - 99) % 100
        left = self.start_bridge("__ns:=left")
        right = self.start_bridge("__ns:=right", domain=other)
        for bridge in (left, right):
            bridge.says("waiting for a benchmark")
        topics = {f"/{side}/hotpath/{name}": n for side in ("left", "right")
                  for name, n in (("run", TEXT), (f"latency/{HOT_PATH}", FLOAT))}  # fmt: skip
        listener = self.listen(topics)
        self.start_benchmark(60, "rm-ro", output="a")
        self.start_benchmark(60, "edf-ro", output="b", domain=other)
        for side in ("left", "right"):
            listener.wait_for(f"/{side}/hotpath/latency/{HOT_PATH}")
        for side, executor in (("left", "rm-ro"), ("right", "edf-ro")):
            self.assertEqual({executor_of(m) for m in listener.messages(f"/{side}/hotpath/run")}, {executor})
        for bridge in (left, right):
            self.assertNotIn("another run", bridge.output)
            self.assert_ends_well(bridge)


class WrongUse(BridgeTest):
    def assert_refused(self, *parts: str, arguments: Iterable[Any] = (), **environment: str) -> None:
        bridge = self.start_process([partners.BRIDGE, *arguments], **environment)
        self.assertEqual(bridge.wait(), WRONG_USE, bridge.output)
        for part in parts:
            self.assertIn(part, bridge.output)

    def test_without_a_master(self) -> None:
        self.assert_refused("--domain", arguments=["--domain", 300])
        self.assert_refused("--fast", arguments=["--fast"])
        self.assert_refused("`somewhere`", "http://localhost:11311", ROS_MASTER_URI="somewhere")
        self.assert_refused("ROS_MASTER_URI is not set", ROS_MASTER_URI="")
        for number in (signal.SIGINT, signal.SIGTERM):
            bridge = self.start_bridge("_points:=false")
            bridge.says(f"waiting for a ROS master at {self.master.uri}")
            bridge.says("ROS_MASTER_URI")
            self.assert_ends_well(bridge, number)

    def test_parameters_and_names(self) -> None:
        self.master.start()
        self.assert_refused("/hotpath_ros1_bridge/domain", "0 to 232", arguments=["_domain:=233"])
        self.master.call("deleteParam", "/hotpath_ros1_bridge")
        bridge = self.start_bridge("_point:=false")
        bridge.says("ignored unknown parameters ~point ")
        bridge.says("waiting for a benchmark")
        self.assert_refused("runs already", "__ns:=", arguments=[])
        self.assert_ends_well(bridge)

    def test_topic_of_another_type(self) -> None:
        self.master.start()
        self.start_process(["rostopic", "pub", "-r", "1", "/hotpath/graph", TEXT, "data: no graph"])
        wait_for(lambda: "/hotpath/graph" in self.master.topics(), "the other publisher")
        bridge = self.start_bridge()
        bridge.says("another node publishes /hotpath/graph as std_msgs/String")
        self.assert_ends_well(bridge)


class WatchedSystem(BridgeTest):
    def reports(self) -> list[str]:
        """What `hotpath watch` says about a program with tracepoints."""
        contract = self.folder / "contract.yaml"
        contract.write_text("callbacks:\n- {node: source, period_ms: {value: 7, from: given}}\n")
        command = [partners.HOTPATH, "watch", "--json", "--contract", str(contract)]
        done = subprocess.run(
            [*command, "--", TRACED_SYSTEM, "100", "1"], check=True, capture_output=True, text=True
        )
        return done.stdout.splitlines()

    def test_what_the_watcher_says_is_published(self) -> None:
        self.master.start()
        listener = self.listen({"/diagnostics": DIAGNOSTICS})
        bridge = self.start_process([partners.BRIDGE, "--watch"])
        wait_for(lambda: "/diagnostics" in self.master.topics(), "the bridge's topic")
        line = self.reports()[-1] + "\n"

        def shown() -> Any:  # writes until the listener is connected
            bridge.process.stdin.write(line)
            bridge.process.stdin.flush()
            return listener.messages("/diagnostics")

        statuses = {status["name"]: status for status in wait_for(shown, "diagnostics")[0]["status"]}
        self.assertEqual(statuses["hotpath watch"]["level"], 0)
        self.assertEqual(statuses["hotpath watch: /space/sink /a"]["level"], 0)
        self.assertIn("period", statuses["hotpath contract: source (timer)"]["message"])
        self.assertIn(statuses["hotpath contract: source (timer)"]["level"], (1, 2))  # broken, or was
        bridge.process.stdin.close()
        self.assertEqual(bridge.wait(), 0, bridge.output)

    def test_other_input_is_rejected(self) -> None:
        self.master.start()
        bridge = self.start_process([partners.BRIDGE, "--watch"])
        bridge.process.stdin.write("callback  jobs/s\n")
        bridge.process.stdin.close()
        self.assertEqual(bridge.wait(), 1, bridge.output)
        self.assertIn("hotpath watch --json", bridge.output)


class StrangeRun(BridgeTest):
    def texts(self, value: Any) -> list[Any]:
        """All strings in a message, at any depth."""
        if isinstance(value, str):
            return [value]
        values = value.values() if isinstance(value, dict) else value if isinstance(value, list) else []
        return [text for v in values for text in self.texts(v)]

    def test_what_it_says_is_escaped_and_bounded(self) -> None:
        self.master.start()
        bridge = self.start_bridge()
        bridge.says("waiting for a benchmark")
        listener = self.listen({"/hotpath/graph": GRAPH, "/diagnostics": DIAGNOSTICS, **RUN})
        strange = self.start_process([os.environ.get("STRANGE_RUN", "strange_run"), self.domain])
        bridge.says(
            "another program publishes the DDS topic hotpath/clock as hotpath::telemetry::ChainSample"
        )
        bridge.says("has no place to draw it")
        graph = listener.wait_for("/hotpath/graph", lambda m: any(n["ns"] == "figures" for n in m["markers"]))
        nodes = listener.wait_for("/diagnostics", lambda m: not values_of(m, ": bridge"))
        own = listener.wait_for("/diagnostics", lambda m: values_of(m, ": bridge") and "x1b" in str(m))
        for text in self.texts([graph, nodes, own]):
            self.assertNotIn("\x1b", text)
            self.assertNotIn("\n", text)
            self.assertLess(len(text), 1000)
        run = json.loads(listener.wait_for("/hotpath/run")["data"])
        self.assertEqual(len({n["ros_name"] for n in run["nodes"]}), 2)
        self.assertTrue(all(len(n["ros_name"]) < 210 for n in run["nodes"]))
        self.assertNotIn("\x1b[2J", bridge.output)
        self.assertLess(max(map(len, bridge.lines)), 2000)
        self.assertEqual(strange.end(), 0)
        self.assert_ends_well(bridge)


class Soak(BridgeTest):
    """Checks memory over many runs with subscribers. Runs only on demand."""

    seconds: float | None = None

    def test_memory_is_bounded(self) -> None:
        if self.seconds is None:
            self.skipTest("only with `soak`")
        self.master.start()
        bridge = self.start_bridge()
        bridge.says("waiting for a benchmark")
        listener = self.listen({"/hotpath/graph": GRAPH, **RUN})
        end = time.monotonic() + self.seconds
        warm: int | None = None
        run = 0
        while time.monotonic() < end:
            run += 1
            benchmark = self.start_benchmark(10, output=f"run{run}")
            self.assertEqual(benchmark.wait(), 0, benchmark.output)
            listener.forget()
            memory = bridge.memory_kib()
            warm = warm or memory
            print(f"run {run}: {memory} KiB, {end - time.monotonic():.0f} s left", file=sys.stderr)
        self.assertLessEqual(memory, 1.1 * (warm or 0))
        self.assert_ends_well(bridge)


if __name__ == "__main__":
    if sys.argv[1:2] == ["soak"]:
        Soak.seconds = float(sys.argv[sys.argv.index("--seconds") + 1]) if "--seconds" in sys.argv else 300
        sys.argv[1:] = ["Soak"]
    partners.main()
