# SPDX-License-Identifier: Apache-2.0
"""Compares live publishing and replay, as received by a Fast DDS reader in another process, with
the run's results."""

import collections
import json
import os
import random
import signal
import subprocess
import threading
from pathlib import Path
from typing import Any

from hotpath_command import CommandTest, ONE, RunFolder, children

LISTENER = (os.environ.get("DDS_PARTNER", "dds_partner"), "listen")
SHORT = ("--load", 20, "--duration", 1.2, "--warm-up", 0.3)


class Received:
    """A listener's output, by kind and in order."""

    def __init__(self, text: str) -> None:
        self.by_kind: dict[str, list[Any]] = collections.defaultdict(list)
        for line in text.splitlines():
            sample = json.loads(line)
            self.by_kind[sample["kind"]].append(sample)
        self.samples, self.statistics = self.by_kind["sample"], self.by_kind["statistics"]

    @property
    def run(self) -> Any:
        (info,) = self.by_kind["run"]
        return info

    @property
    def last(self) -> Any:
        (last,) = [s for s in self.statistics if s["last"]]
        return last

    def values(self) -> list[Any]:
        """Rows as in RunFolder.chains(), in order."""
        chains = self.run["chains"]
        return [
            (chains[s["chain"]]["name"], s["job"], s["hot_path_latency_ns"],
             s["end_to_end_latency_ns"] if s["end_to_end_latency_ns"] >= 0 else None)
            for s in self.samples
        ]  # fmt: skip


class LiveTest(CommandTest):
    def setUp(self) -> None:
        super().setUp()
        self.domain = random.randint(100, 200)

    def listen(self, *arguments: object) -> Any:
        """Starts a listener and waits until it is ready."""
        process: Any = subprocess.Popen(
            [*LISTENER, "--domain", str(self.domain), *map(str, arguments)], stdout=subprocess.PIPE, text=True
        )
        self.addCleanup(process.kill)
        self.assertEqual(json.loads(process.stdout.readline())["kind"], "ready")
        return process

    def received(self, listener: Any) -> Any:
        killer = threading.Timer(90, listener.kill)
        killer.start()
        out = listener.stdout.read()  # communicate() would lose what a reader of lines has read ahead
        killer.cancel()
        self.assertEqual(listener.wait(), 0)
        return Received(out)

    def measure_live(self, *arguments: object) -> Any:
        return self.measure("run", *ONE, "--domain", self.domain, "--live", *arguments)

    def replay(self, *arguments: object, output: str = "run") -> None:
        code, out, err = self.command("replay", output, "--domain", self.domain, *arguments)
        self.assertEqual((code, out, err), (0, "", ""))

    def check_samples(self, received: Any, folder: RunFolder) -> None:
        """Checks that each row of chains.csv was received once, numbered by chain without gaps."""
        ((key, rows),) = folder.chains().items()
        self.assertEqual(sorted(received.values(), key=repr), sorted(rows, key=repr), key)
        numbers = collections.defaultdict(list)
        for sample in received.samples:
            numbers[sample["chain"]].append(sample["number"])
        for of_chain in numbers.values():
            self.assertEqual(of_chain, list(range(len(of_chain))))
        self.assertGreater(len(rows), 0)

    def check_last_statistics(self, received: Any, folder: RunFolder) -> None:
        """Checks the counts against jobs.csv, and overruns and latencies against summary.json."""
        (jobs,) = folder.jobs().values()
        (executor,) = folder.summary()["executors"]
        overruns = {task["task"]: task.get("deadline_overruns", 0) for task in executor["tasks"]}
        names = [node["name"] for node in received.run["nodes"]]
        for name, node in zip(names, received.last["nodes"], strict=True):
            own = [j for j in jobs if j.node == name]
            count = collections.Counter(j.outcome for j in own)
            self.assertEqual(
                (node["ran"], node["skipped"], node["overwritten"], node["queued"]),
                (count["ran"], count["skipped"], count["overwritten"], count["queued"] + count["running"]),
                name,
            )
            # The summary also counts jobs that never finished.
            late = sum(overruns[task] for task in {j.task for j in own}) - node["overruns"]
            self.assertTrue(0 <= late <= node["queued"], name)
        self.assertGreater(len(executor["chains"]), 0)
        for chain, summary in zip(received.last["chains"], executor["chains"], strict=True):
            exact = summary["hot_path_latency_ms"]
            self.assertEqual(chain["samples"], exact["n"])
            self.assertAlmostEqual(chain["latency_max_ns"] / 1e6, exact["max"])
        self.assertEqual(received.last["samples_lost"], 0)

    def check_statistics(self, received: Any) -> None:
        self.assertEqual([s["number"] for s in received.statistics], list(range(len(received.statistics))))
        stamps = [s["stamp_ns"] for s in received.statistics]
        self.assertEqual(stamps, sorted(stamps))
        runs = {s["run_id"] for s in received.statistics + received.samples}
        self.assertEqual(runs, {received.run["run_id"]})
        for before, after in zip(received.statistics, received.statistics[1:]):
            for a, b in zip(before["nodes"], after["nodes"], strict=True):
                for count in ("ran", "skipped", "overwritten", "overruns"):
                    self.assertLessEqual(a[count], b[count])

    def check_run(self, received: Any, folder: RunFolder, origin: str, transport: str) -> None:
        info = received.run
        self.assertEqual((info["origin"], info["transport"]), (origin, transport))
        self.assertEqual((info["graph"], info["executor"], info["repetition"]), ("autoware", "rm-ro", 0))
        self.assertEqual(len(info["nodes"]), 24)
        self.assertEqual(sum(n["hot"] for n in info["nodes"]), 8)
        self.assertEqual([c["name"] for c in info["chains"]], ["hot_path"])
        for fact in ("duration_s", "load_percent", "seed"):
            self.assertEqual(info["facts"][fact], folder.run[fact])


class Live(LiveTest):
    def check_live(self, transport: str, *arguments: object) -> tuple[Any, Any]:
        listener = self.listen()
        folder = self.measure_live("--transport", transport, *SHORT, *arguments)
        received = self.received(listener)
        self.assertEqual(folder.run["warnings"], [w for w in folder.run["warnings"] if "ublishing" not in w])
        self.check_run(received, folder, "live", transport)
        self.check_statistics(received)
        self.check_samples(received, folder)
        self.check_last_statistics(received, folder)
        self.assertTrue(folder.accounts_for_all())
        return folder, received

    def test_intra_process_and_its_replay(self) -> None:
        folder, live = self.check_live("intra_process")
        self.assertEqual(live.run["topic_prefix"], "")
        listener = self.listen()
        self.replay("--rate", 200)
        replayed = self.received(listener)
        self.check_run(replayed, folder, "replay", "intra_process")
        self.check_statistics(replayed)
        self.check_samples(replayed, folder)
        self.check_last_statistics(replayed, folder)
        self.assertEqual(replayed.values(), live.values())
        self.check_clock(replayed, 1.5)

    def check_clock(self, received: Any, length_s: float) -> None:
        times = [c["time_ns"] for c in received.by_kind["clock"]]
        self.assertEqual(times, sorted(times))
        self.assertEqual(times[-1], received.run["epoch_ns"] + round(length_s * 1e9))
        self.assertEqual(received.last["stamp_ns"], times[-1])
        self.assertTrue(all(s["stamp_ns"] <= times[-1] for s in received.samples))

    def test_fastdds_in_two_processes(self) -> None:
        _, received = self.check_live("fastdds", "--processes", 2)
        self.assertRegex(received.run["topic_prefix"], "^run-[0-9a-f]{32}/$")

    def test_a_late_listener_gets_what_runs(self) -> None:
        process = self.start(
            "run", *ONE, "--domain", self.domain, "--live", "--transport", "intra_process", "--load", 5,
            "--duration", 30, "--warm-up", 0, "--output", "run",
        )  # fmt: skip
        self.addCleanup(process.kill)
        first = self.listen("--seconds", 60)
        next(line for line in first.stdout if '"sample"' in line)
        first.kill()
        first.communicate()
        late = self.listen()
        os.killpg(process.pid, signal.SIGINT)  # only after the late listener is ready
        self.finish(process)
        received = self.received(late)
        self.assertEqual(received.run["executor"], "rm-ro")
        self.check_samples(received, self.checked("run"))


class Faults(LiveTest):
    def child_named(self, process: Any, name: str) -> Any:
        return next(
            (c for c in children(process) if Path(f"/proc/{c}/comm").read_text() == name + "\n"), None
        )

    def start_live(self, *arguments: object) -> Any:
        process = self.start("run", *ONE, "--live", "--domain", self.domain, "--output", "run", *arguments)
        self.addCleanup(process.kill)
        self.wait_for(lambda: self.child_named(process, "live_sender"), "nothing publishes")
        return process

    def test_the_run_goes_on_without_its_sender(self) -> None:
        process = self.start_live("--transport", "intra_process", "--duration", 1, "--warm-up", 0)
        os.kill(self.child_named(process, "live_sender"), signal.SIGKILL)
        code, _, err = self.finish(process)
        self.assertEqual(code, 0, err)
        self.assertIn("Live publishing stopped (its process was ended by a signal (Killed))", err)
        folder = self.checked("run")
        self.assertTrue(folder.run["complete"] and folder.accounts_for_all())

    def test_a_killed_run_ends_its_sender(self) -> None:
        listener = self.listen()
        process = self.start_live("--transport", "intra_process", "--duration", 30, "--warm-up", 0)
        sender = self.child_named(process, "live_sender")
        next(line for line in listener.stdout if '"statistics"' in line)
        process.kill()
        self.finish(process)
        self.wait_for(lambda: not os.path.exists(f"/proc/{sender}"), "the sender lives on")
        self.assertTrue(self.received(listener).statistics[-1]["last"])

    def test_an_interrupted_replay_ends_in_order(self) -> None:
        brief = ("--load", 5, "--duration", 0.5, "--warm-up", 0)
        self.measure("run", *ONE, "--transport", "intra_process", *brief)
        listener = self.listen()
        process = self.start("replay", "run", "--domain", self.domain, "--rate", 1)
        next(line for line in listener.stdout if '"clock"' in line)
        process.send_signal(signal.SIGINT)
        code, out, err = self.finish(process)
        self.assertEqual((code, out, err), (128 + signal.SIGINT, "", ""))
        self.assertTrue(self.received(listener).statistics[-1]["last"])


class Replay(LiveTest):
    def test_a_part_of_a_simulated_run(self) -> None:
        folder = self.measure("simulate", "--executors", "rm-ro,default", "--duration", 4, "--warm-up", 1)
        listener = self.listen()
        self.replay("--executors", "default", "--from", 2, "--duration", 1, "--rate", 400)
        received = self.received(listener)
        self.assertEqual((received.run["executor"], received.run["transport"]), ("default", "simulated"))
        self.assertAlmostEqual(received.last["run_time_s"], 3)
        jobs = folder.jobs()["default", 0]
        ran = [j for j in jobs if j.outcome == "ran"]
        sink = {j.sequence: j.finish for j in ran if j.node == "ObjectCollisionEstimator"}
        outputs = [c for c in folder.chains()["default", 0] if 2e9 <= sink[c[1]] <= 3e9]
        self.assertEqual(received.values(), outputs)
        finished = collections.Counter(j.node for j in ran if j.finish <= 3e9)
        for node, last in zip(received.run["nodes"], received.last["nodes"], strict=True):
            self.assertEqual(last["ran"], finished[node["name"]], node["name"])

    def test_an_output_of_a_fusion_is_the_job_that_completed_the_set(self) -> None:
        graph = Path(__file__).with_name("field") / "fusion_sink.yaml"
        folder = self.measure("simulate", graph, "--executors", "rm-ro", "--duration", 2, "--warm-up", 0)
        listener = self.listen()
        self.replay("--rate", 400)
        received = self.received(listener)
        starts: dict[str, dict[int, int]] = {"F/t": {}, "F/s": {}}
        for job in folder.jobs()["rm-ro", 0]:
            if job.task in starts and job.outcome == "ran":
                starts[job.task][job.sequence] = received.run["epoch_ns"] + job.start
        stamps = {sample["job"]: sample["stamp_ns"] for sample in received.samples}
        self.assertEqual(stamps, starts["F/t"])
        self.assertNotEqual(stamps, {job: starts["F/s"][job] for job in stamps})


class SlowReader(LiveTest):
    def test_a_slow_reader_blocks_nobody_and_its_losses_are_counted(self) -> None:
        folder = self.measure("simulate", "--executors", "rm-ro", "--duration", 200, "--warm-up", 0)
        rows = folder.chains()["rm-ro", 0]
        kept = 1024
        self.assertGreater(len(rows), kept + 500)

        stopped, healthy = self.listen(), self.listen()
        process = self.start("replay", "run", "--domain", self.domain, "--rate", 6000)
        next(line for line in stopped.stdout if '"clock"' in line)
        stopped.send_signal(signal.SIGSTOP)
        received = self.received(healthy)
        self.assertEqual(self.finish(process), (0, "", ""))
        stopped.kill()
        stopped.communicate()
        self.assertEqual([s["number"] for s in received.samples], list(range(len(rows))))
        self.assertGreater(received.last["samples_lost"], 0)
        self.assertLess(received.last["samples_lost"], len(rows))
