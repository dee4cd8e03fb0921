# SPDX-License-Identifier: Apache-2.0
"""Starts the bridge's real partners for tests: roscore, benchmark and subscribers, isolated from
other programs."""

import json
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import xmlrpc.client
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.append(str(Path(__file__).resolve().parents[2] / "bench" / "test"))
import shared_memory  # noqa: E402

BRIDGE = os.environ.get("HOTPATH_BRIDGE", "hotpath_ros1_bridge")
HOTPATH = os.environ.get("HOTPATH", "hotpath")
TIME_LIMIT_S = 60
LISTENER = Path(__file__).with_name("listener.py")
PYTHON = "/usr/bin/python3"

GRAPH = "visualization_msgs/MarkerArray"
DIAGNOSTICS = "diagnostic_msgs/DiagnosticArray"
FLOAT = "std_msgs/Float64"
TEXT = "std_msgs/String"
CLOUD = "sensor_msgs/PointCloud2"
TRANSFORMS = "tf2_msgs/TFMessage"
CLOCK = "rosgraph_msgs/Clock"


def free_port() -> Any:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def wait_for(condition: Callable[[], Any], what: str, limit: Any = TIME_LIMIT_S) -> Any:
    """Waits for a true value of `condition()` and returns it."""
    end = time.monotonic() + limit
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.02)
    raise AssertionError(f"not within {limit} s: {what}")


class Process:
    """A running program whose output is captured."""

    def __init__(self, command: Any, environment: Any, folder: Path, ended_by: Any = signal.SIGINT) -> None:
        self.command, self.ended_by = command, ended_by
        self.lines: list[str] = []
        self.process: Any = subprocess.Popen(
            [str(c) for c in command], env=environment, cwd=folder, text=True, start_new_session=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, errors="replace",
        )  # fmt: skip
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()

    def read(self) -> None:
        for line in self.process.stdout:
            self.lines.append(line.rstrip("\n"))

    @property
    def output(self) -> str:
        return "\n".join(self.lines)

    def wait(self, limit: Any = TIME_LIMIT_S) -> Any:
        """Its exit code."""
        code = self.process.wait(limit)
        self.reader.join(limit)
        return code

    def end(self, number: Any = None) -> Any:
        if self.process.poll() is None:
            self.process.send_signal(number or self.ended_by)
        try:
            return self.wait()
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            raise AssertionError(f"did not end: {self.command}\n{self.output}") from None

    def kill(self) -> None:
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()

    def clean_up(self) -> None:
        """Ends the program gracefully if possible: roscore's children are not in its process group."""
        if self.process.poll() is None:
            self.process.send_signal(self.ended_by)
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.kill()
        self.reader.join(10)
        for stream in (self.process.stdin, self.process.stdout):
            stream.close()

    def says(self, text: str, limit: Any = TIME_LIMIT_S) -> None:
        wait_for(lambda: text in self.output, f"`{text}` from {self.command}\n{self.output}", limit)

    def memory_kib(self) -> int:
        for line in Path(f"/proc/{self.process.pid}/status").read_text().splitlines():
            if line.startswith("VmRSS:"):
                return int(line.split()[1])
        raise AssertionError("no VmRSS")


class Listener(Process):
    """A ROS 1 subscriber in another process."""

    def __init__(self, topics: Any, environment: Any, folder: Path) -> None:
        self.by_topic: dict[Any, list[Any]] = {topic: [] for topic in [None, *topics]}
        super().__init__([PYTHON, LISTENER, *(f"{t}={n}" for t, n in topics.items())], environment, folder)
        wait_for(lambda: self.by_topic[None], "the listener's first line")

    def read(self) -> None:
        for line in self.process.stdout:
            if line.startswith("{"):
                record = json.loads(line)
                self.by_topic[record["topic"]].append(record["message"])
            else:
                self.lines.append(line.rstrip("\n"))

    def messages(self, topic: str) -> list[Any]:
        if "bad callback" in self.output:
            raise AssertionError(self.output)
        return list(self.by_topic[topic])

    def forget(self) -> None:
        for messages in self.by_topic.values():
            messages.clear()

    def wait_for(self, topic: str, condition: Any = lambda message: True, limit: Any = TIME_LIMIT_S) -> Any:
        """The first message of the topic for which the condition holds."""
        seen = 0

        def found() -> Any:
            nonlocal seen
            messages = self.messages(topic)
            new, seen = messages[seen:], len(messages)
            return next(([m] for m in new if condition(m)), None)

        return wait_for(found, f"a message on {topic}", limit)[0]


class Master:
    """A roscore that can be killed and started again at the same port."""

    def __init__(self, test: Any) -> None:
        self.test, self.port = test, free_port()
        self.uri = f"http://127.0.0.1:{self.port}"
        self.roscore: Any = None

    def start(self) -> Any:
        self.roscore = self.test.start_process(["roscore", "-p", self.port], ended_by=signal.SIGINT)
        wait_for(self.answers, "roscore", TIME_LIMIT_S)
        return self

    def answers(self) -> Any:
        try:
            return self.call("getParam", "/run_id")
        except (OSError, xmlrpc.client.Error, AssertionError):
            return None

    def call(self, method: Any, *arguments: object) -> Any:
        with xmlrpc.client.ServerProxy(self.uri) as proxy:
            code, message, value = getattr(proxy, method)("/test", *arguments)
        if code != 1:
            raise AssertionError(message)
        return value

    def topics(self) -> dict[Any, Any]:
        """{topic: type} of all published topics."""
        return dict(self.call("getPublishedTopics", ""))

    def stop(self) -> None:
        self.roscore.end()


class BridgeTest(unittest.TestCase):
    """A test with its own folder, master and DDS domain."""

    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory(prefix="hotpath_bridge_test_")
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        if shared_memory.PRIVATE_NETWORK:
            shared_memory.make_private()
        self.domain = random.SystemRandom().randrange(100, 200)
        self.master = Master(self)
        self.environment = dict(
            os.environ, ROS_MASTER_URI=self.master.uri, ROS_IP="127.0.0.1", ROS_HOME=str(self.folder / "ros"),
            ROS_LOG_DIR=str(self.folder / "ros" / "log"),
            PATH="/usr/bin:" + os.environ["PATH"],
        )  # fmt: skip
        self.environment.pop("ROS_NAMESPACE", None)

    def start_process(self, command: Any, ended_by: Any = signal.SIGINT, **environment: str) -> Any:
        process = Process(command, {**self.environment, **environment}, self.folder, ended_by)
        self.addCleanup(process.clean_up)
        return process

    def start_bridge(self, *arguments: object, domain: Any = None, **environment: str) -> Any:
        domain = self.domain if domain is None else domain
        return self.start_process([BRIDGE, "--domain", domain, *arguments], **environment)

    def start_benchmark(
        self, duration: float, executor: str = "rm-ro", domain: Any = None, output: str = "run"
    ) -> Any:
        domain = self.domain if domain is None else domain
        command = [HOTPATH, "run", "--repetitions", 1, "--live", "--domain", domain, "--load", 20]
        options = ["--executors", executor, "--duration", duration, "--output", output]
        return self.start_process([*command, *options])

    def listen(self, topics: Any) -> Any:
        listener = Listener(topics, self.environment, self.folder)
        self.addCleanup(listener.clean_up)
        return listener

    def assert_ends_well(self, process: Any, number: Any = signal.SIGINT) -> None:
        self.assertEqual(process.end(number), 0, process.output)
        for sign in ("terminate called", "Aborted", "Segmentation", "what():", "Assertion"):
            self.assertNotIn(sign, process.output)


def main() -> None:
    if "--failfast" not in sys.argv:
        sys.argv.append("--failfast")
    unittest.main()
