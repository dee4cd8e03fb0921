# SPDX-License-Identifier: Apache-2.0
"""Wrong use and faults: one clear sentence, the right exit code, and no half result that looks
whole."""

import os
import resource
import shutil
import signal
import subprocess
import unittest
from pathlib import Path
from typing import Any

from hotpath_command import HOTPATH, CommandTest, RunFolder

WRONG_USE, FAILURE = 2, 1
NOBODY = 65534
COMMANDS = (
    "run",
    "compare",
    "simulate",
    "timeline",
    "replay",
    "validate",
    "list",
    "graph",
    "analyze",
    "experiment",
    "machine",
    "bench",
    "sweep",
    "capacity",
    "advise",
    "import",
    "export",
    "check",
    "recover",
    "summarize",
    "report",
    "diff",
)
IS_ROOT = os.geteuid() == 0
BRIEF = ("--transport", "intra_process", "--load", 5, "--duration", 0.2, "--warm-up", 0)
LONG = ("--duration", 30, "--warm-up", 0)


def can_unshare_network() -> bool:
    return subprocess.run(["unshare", "-n", "true"], capture_output=True).returncode == 0


class FaultTest(CommandTest):
    def assert_says(self, err: str, *parts: str) -> None:
        """Checks that hotpath printed exactly one error line, which contains all `parts`. Notes and
        Fast DDS's log do not count."""
        sentences = [line for line in err.splitlines() if line.startswith("hotpath: ")]
        self.assertEqual(len(sentences), 1, err)
        for part in parts:
            self.assertIn(part, sentences[0])
        for sign in ("terminate called", "what():", "Aborted", "core dumped", "Traceback", "std::"):
            self.assertNotIn(sign, err)

    def assert_refused(self, arguments: Any, *parts: str, code: Any = WRONG_USE, **options: Any) -> Any:
        found, out, err = self.command(*arguments, **options)
        self.assertEqual(found, code, err)
        self.assertEqual(out, "")
        self.assert_says(err, *parts)
        return err

    def assert_nothing_looks_whole(self, output: str | Path) -> None:
        """Checks that the folder of a failed run, if any, does not look like a result."""
        path = self.folder / output
        if not path.exists():
            return
        self.assertFalse((path / "jobs.csv").exists())
        self.assertFalse((path / "chains.csv").exists())
        self.assertFalse((path / "summary.json").exists())
        if (path / "run.json").exists():
            self.assertFalse(RunFolder(path).run["complete"])

    def children(self, process: Any) -> list[Any]:
        try:
            text = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text()
        except OSError:
            return []
        return [int(pid) for pid in text.split()]

    def start_and_await_jobs(self, *arguments: object, count: int, **options: Any) -> Any:
        """Starts a run of `count` processes and waits until its executor threads run."""
        process = self.start(*arguments, **options)
        self.addCleanup(lambda: process.poll() is None and process.kill())

        def running() -> bool:
            self.assertIsNone(process.poll(), "the command ended early")
            found = self.children(process)
            return len(found) == count and all(self.has_executor_thread(pid) for pid in found)

        self.wait_for(running, "the run did not begin")
        return process

    @staticmethod
    def has_executor_thread(pid: int) -> bool:
        try:
            names = [t.joinpath("comm").read_text() for t in Path(f"/proc/{pid}/task").iterdir()]
        except OSError:
            return False
        return "executor\n" in names


class WrongUse(FaultTest):
    def test_options(self) -> None:
        for arguments, parts in {
            (): ["a command is missing", "run, compare"],
            ("rum",): ["`rum`", "run, compare"],
            ("run", "--fast"): ["--fast", "hotpath run --help"],
            ("run", "--duration", "soon"): ["--duration", "`soon`", "0.1"],
            ("run", "--repetitions", "2.5"): ["--repetitions", "`2.5`", "whole number"],
            ("run", "--repetitions", 0): ["--repetitions", "1 to 10000"],
            ("run", "--load", -1): ["--load", "`-1`"],
            ("run", "--transport", "tcp"): ["--transport", "tcp", "fastdds,intra_process"],
            ("run", "--domain", 233): ["--domain", "0 to 232"],
            ("run", "--executor", "best"): ["`best`", "edf-ro"],
            ("run", "--executor", "rm-ro:last"): ["`last`", "inherit"],
            ("run", "--executor", "multi:0"): ["between 1 and"],
            ("compare", "--executors", "rm-ro,rm-ro"): ["`rm-ro`", "twice"],
            ("run", "--cpus", "4000"): ["--cpus", "may not use processor 4000"],
            ("run", "--cpus", "1-"): ["--cpus", "`1-`"],
            ("run", "--timer-policy", "fifo"): ["`fifo`", "fifo:N"],
            ("run", "--processes", 2, "--transport", "intra_process"): ["--processes", "fastdds"],
            ("run", "--processes", 25): ["--processes", "24 nodes"],
            ("run", "--phases", "given"): ["--phases given", "phase_ms"],
            ("run", "--phases", "absent.csv"): ["absent.csv"],
            ("run", "--graph", "autowear"): ["autowear", "autoware"],
        }.items():
            with self.subTest(arguments=arguments):
                self.assert_refused(arguments, *parts)
        self.assertFalse((self.folder / "runs").exists())

    def test_graph_files(self) -> None:
        graph = self.folder / "graph.yaml"
        graph.write_text("name: mine\nnodes:\n  - {name: A, type: sensor, period: 100}\n")
        self.assert_refused(["run", "--graph", graph], f"{graph}:3", "period")
        graph.write_text("name: [mine\n")
        self.assert_refused(["graph", graph], f"{graph}:")
        self.assert_refused(["run", "--graph", self.folder], str(self.folder))
        self.assert_refused(
            ["run", "--graph", "./absent.yaml"], "absent.yaml", "cannot be read (No such file"
        )

    @unittest.skipUnless(IS_ROOT, "needs root to become somebody else")
    def test_unreadable_graph_file(self) -> None:
        graph = self.folder / "graph.yaml"
        graph.write_text("name: secret\n")
        graph.chmod(0)
        self.assert_refused(["run", "--graph", graph], str(graph), user=NOBODY, group=NOBODY)

    def test_output_folder(self) -> None:
        (self.folder / "file").write_text("")
        self.assert_refused(["run", *BRIEF, "--output", "file/below"], "file/below", "--output")
        self.assert_refused(["run", *BRIEF, "--output", "file"], "file", "--output")
        self.assert_refused(["run", *BRIEF, "--output", "/proc/x"], "/proc/x", "--output")
        self.measure("run", *BRIEF)
        before = {f: f.read_bytes() for f in (self.folder / "run").iterdir()}
        self.assert_refused(["run", *BRIEF, "--output", "run"], "holds files already")
        self.assertEqual({f: f.read_bytes() for f in (self.folder / "run").iterdir()}, before)

    @unittest.skipUnless(IS_ROOT, "needs root to become somebody else")
    def test_output_folder_of_somebody_else(self) -> None:
        (self.folder / "theirs").mkdir(mode=0o755)
        options = {"user": NOBODY, "group": NOBODY}
        self.assert_refused(["run", *BRIEF, "--output", "theirs"], "cannot be written (Perm", **options)

    def test_help_is_no_error(self) -> None:
        for command in ((), *((c,) for c in COMMANDS)):
            code, out, err = self.command(*command, "--help")
            self.assertEqual((code, err), (0, ""))
            self.assertIn("Usage: hotpath", out)
            self.assertLessEqual(max(map(len, out.splitlines())), 100)


class Machine(FaultTest):
    """Actions that this machine or this user does not permit."""

    def test_ros2_that_is_not_there(self) -> None:
        for name in ("AMENT_PREFIX_PATH", "HOTPATH_ROS2_RUNNER"):
            self.environment.pop(name, None)
        run = ("run", "--stack", "rclcpp", *BRIEF)
        self.assert_refused(run, "setup.bash", "ros2_build.sh")
        self.environment["AMENT_PREFIX_PATH"] = "/no/where"
        self.assert_refused(run, "hotpath_rclcpp_system", "--ros2-runner")
        self.assert_refused((*run, "--ros2-runner", "/no/where"), "no executable program /no/where")
        self.assert_refused(("run", "--stack", "ros"), "--stack", "native")

    def test_what_a_run_on_ros2_does_not_do(self) -> None:
        self.environment["AMENT_PREFIX_PATH"] = "/no/where"
        run = ("run", "--stack", "rclcpp", "--ros2-runner", "/bin/true", "--duration", "1")
        for option in (("--copies", "2"), ("--rate", "50"), ("--processes", "2"), ("--cpu-time",),
                       ("--transport", "intra_process"), ("--entity-order", "reverse")):  # fmt: skip
            self.assert_refused((*run, *option), "--stack rclcpp", "leave", option[0])
        self.assert_refused((*run, "--rmw", "nonsense"), "--rmw nonsense", "rmw_nonsense_cpp")
        timers = ("--executor", "events-ro", "--timer-policy", "other")
        self.assert_refused((*run, *timers), "events-ro@rclcpp", "--executor-policy")

    def test_an_executor_that_rclcpp_does_not_have(self) -> None:
        self.environment["AMENT_PREFIX_PATH"] = "/no/where"
        self.environment.pop("ROS_DISTRO", None)
        run = ("run", "--stack", "rclcpp", "--ros2-runner", "/bin/true", "--duration", "1", "--executor")
        self.assert_refused(
            (*run, "multi-fair"), "multi-fair@rclcpp", "rclcpp has no such executor", "static"
        )
        self.environment["ROS_DISTRO"] = "kilted"
        self.assert_refused((*run, "static"), "static@rclcpp", "ROS 2 kilted", "events-re")
        self.environment["ROS_DISTRO"] = "humble"
        self.assert_refused((*run, "events-re"), "events-re@rclcpp", "ROS 2 humble", "static, multi, rm-ro")

    @unittest.skipUnless(IS_ROOT, "needs root to give up its rights")
    def test_real_time_policy_asked_for_and_refused(self) -> None:
        err = self.assert_refused(
            ["run", *BRIEF, "--timer-policy", "fifo:50", "--output", "run"], "fifo:50", "refused",
            code=FAILURE, user=NOBODY, group=NOBODY,
        )  # fmt: skip
        self.assertNotIn("SCHED_FIFO was not permitted", err)
        self.assert_nothing_looks_whole("run")

    @unittest.skipUnless(IS_ROOT, "needs root to give up its rights")
    def test_real_time_policy_by_default_and_refused(self) -> None:
        output = self.folder / "run"
        code, _, err = self.command("run", *BRIEF, "--output", output, user=NOBODY, group=NOBODY)
        self.assertEqual(code, 0, err)
        self.assertIn("note: SCHED_FIFO was not permitted", err)
        folder = self.checked(output)
        self.assertTrue(folder.run["complete"])
        self.assertEqual(folder.run["runs"][0]["thread_policies"], ["executor other, timer_mgmt other"])
        self.assertIn("SCHED_FIFO", " ".join(folder.run["warnings"]))

    @unittest.skipUnless(IS_ROOT, "needs root to give up its rights")
    def test_locked_memory_refused(self) -> None:
        self.assert_refused(
            ["run", *BRIEF, "--lock-memory", "--output", "run"], "locking memory was refused",
            code=FAILURE, user=NOBODY, group=NOBODY,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_MEMLOCK, (0, 0)),
        )  # fmt: skip
        self.assert_nothing_looks_whole("run")

    def test_participant_cannot_be_created(self) -> None:
        self.assert_refused(
            ["run", "--duration", 0.2, "--warm-up", 0, "--output", "run"],
            "cannot be set up", "Too many open files", code=FAILURE,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (12, 12)),
        )  # fmt: skip
        self.assert_nothing_looks_whole("run")

    @unittest.skipUnless(can_unshare_network(), "needs a separate network namespace")
    def test_no_network_interface(self) -> None:
        code, out, err = self.finish(
            subprocess.Popen(
                ["unshare", "-n", HOTPATH, "run", "--processes", "2", "--time-out", "1", "--output", "run"],
                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=self.folder,
            )  # fmt: skip
        )
        self.assertEqual((code, out), (FAILURE, ""), err)
        self.assert_says(err, "DDS domain 0", "partners")
        self.assert_nothing_looks_whole("run")

    def test_file_size_limit(self) -> None:
        self.assert_refused(
            ["simulate", "--executors", "default", "--duration", "20", "--output", "run"],
            "jobs.csv.part", "File too large", code=FAILURE,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000)),  # more than run.json
        )  # fmt: skip
        self.assert_nothing_looks_whole("run")

    def test_disk_full(self) -> None:
        disk = self.folder / "disk"
        disk.mkdir()
        mount = ["mount", "-t", "tmpfs", "-o", "size=12k", "tmpfs", str(disk)]
        if not IS_ROOT or subprocess.run(mount, capture_output=True).returncode != 0:
            self.skipTest("cannot mount a tiny disk")
        self.addCleanup(subprocess.check_call, ["umount", disk])
        self.assert_refused(
            ["run", *BRIEF, "--output", disk / "run"], "No space left", "not complete", code=FAILURE
        )
        self.assert_nothing_looks_whole("disk/run")
        shutil.rmtree(disk / "run")
        self.accepted("simulate", "--executors", "default", "--duration", "20", "--output", "run")
        self.assert_refused(
            ["export", "ctf", "run", "--output", disk / "trace"], "disk is full", code=FAILURE
        )
        self.assertEqual(list(disk.iterdir()), [])

    def test_closed_standard_streams(self) -> None:
        """The numbers of closed standard streams must not be reused for result files."""
        output = self.folder / "run"
        process = subprocess.Popen(
            [HOTPATH, "run", *map(str, BRIEF), "--output", output],
            env=self.environment, preexec_fn=lambda: os.closerange(0, 3),
        )  # fmt: skip
        self.assertEqual(self.finish(process)[0], 0)
        self.assertTrue(self.checked(output).run["complete"])
        lines = (output / "jobs.csv").read_text().splitlines()
        self.assertEqual({line.split(",")[0] for line in lines}, {"executor", "rm-ro"})

    def test_full_standard_output(self) -> None:
        with open("/dev/full", "w") as full:
            output = self.folder / "run"
            code, _, err = self.command("run", *BRIEF, "--output", output, stdout=full)
        self.assertEqual(code, FAILURE)
        self.assert_says(err, "standard output")
        self.assertTrue(self.checked(output).run["complete"])

    def test_figure_that_cannot_be_drawn(self) -> None:
        del self.environment["HOTPATH_FIGURES"]
        self.environment["HOTPATH_LIBRARY"] = str(self.folder / "missing.so")
        output = self.folder / "run"
        code, _, err = self.command("run", "--load", 1, "--duration", 1, "--warm-up", 0, "--output", output)
        self.assertEqual(code, 0)
        self.assertIn("note: the figure was not drawn", err)
        self.assertNotIn("Traceback", err)
        self.assertTrue(self.checked(output).run["complete"])


class Processes(FaultTest):
    """Processes that die, hang, or are asked to end."""

    def two_processes(self, *arguments: object) -> Any:
        return self.start_and_await_jobs(
            "run", "--processes", 2, "--network", "shared_memory", "--output", "run", *arguments, count=2
        )

    def test_killed_child(self) -> None:
        process = self.two_processes("--duration", 1.5, "--warm-up", 0)
        os.kill(self.children(process)[1], signal.SIGKILL)
        code, out, err = self.finish(process)
        self.assertEqual((code, out), (FAILURE, ""))
        self.assert_says(err, "process 2 of 2", "Killed")
        self.assert_nothing_looks_whole("run")
        self.assertIn("Killed", RunFolder(self.folder / "run").run["failures"][0])

    def test_hanging_child(self) -> None:
        process = self.two_processes("--duration", 1, "--warm-up", 0, "--time-out", 1)
        os.kill(self.children(process)[0], signal.SIGSTOP)
        code, out, err = self.finish(process)
        self.assertEqual((code, out), (FAILURE, ""))
        self.assert_says(err, "process 1 of 2", "did not answer in time", "--time-out")
        self.assert_nothing_looks_whole("run")

    def test_a_failed_repetition_does_not_spoil_the_others(self) -> None:
        process = self.start_and_await_jobs(
            "compare", "--executors", "default,rm-ro", "--repetitions", 1, "--transport", "intra_process",
            "--duration", 0.8, "--warm-up", 0, "--output", "run", count=1,
        )  # fmt: skip
        os.kill(self.children(process)[0], signal.SIGKILL)
        code, out, err = self.finish(process)
        self.assertEqual(code, FAILURE)
        self.assert_says(err, "1 of 2 runs failed")
        folder = self.checked("run")
        self.assertFalse(folder.run["complete"])
        self.assertEqual(len(folder.run["failures"]), 1)
        failed = [r["executor"] for r in folder.run["runs"] if r["failure"]]
        whole = [r["executor"] for r in folder.run["runs"] if not r["failure"]]
        self.assertEqual((len(failed), len(whole)), (1, 1))
        self.assertEqual(folder.jobs().keys(), {(whole[0], 0)})
        self.assertFalse({f for f in folder.files() if f.endswith(".part")})

    def check_interrupted(self, process: Any, number: int) -> Any:
        code, out, err = self.finish(process)
        self.assertEqual(code, 128 + number, err)
        self.assertIn("partial", err)
        self.assertFalse([line for line in err.splitlines() if line.startswith("hotpath: ")], err)
        folder = self.checked("run")
        self.assertTrue(folder.run["partial"])
        self.assertFalse(folder.run["complete"])
        self.assertEqual(folder.run["failures"], [])
        self.assertFalse({f for f in folder.files() if f.endswith(".part")})
        return folder

    def test_interrupt_keeps_what_was_measured(self) -> None:
        process = self.two_processes(*LONG)
        self.await_work(process)
        os.killpg(process.pid, signal.SIGINT)
        folder = self.check_interrupted(process, signal.SIGINT)
        jobs = folder.jobs()["rm-ro", 0]
        self.assertIn("ran", {j.outcome for j in jobs})
        self.assertEqual({j.process for j in jobs}, {0, 1})
        self.assertTrue(folder.summary()["executors"][0]["loss_equations"]["hold"])

    def await_work(self, process: Any) -> None:
        """Waits until the children have used enough CPU time that jobs must have run."""

        def worked() -> bool:
            ticks = 0
            for pid in self.children(process):
                fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
                ticks += int(fields[11]) + int(fields[12])
            return ticks / os.sysconf("SC_CLK_TCK") > 0.5

        self.wait_for(worked, "no work is done")

    def test_termination_keeps_what_was_measured(self) -> None:
        process = self.start_and_await_jobs(
            "compare", "--executors", "rm-ro,default", "--transport", "intra_process", *LONG,
            "--output", "run", count=1,
        )  # fmt: skip
        self.await_work(process)
        process.terminate()
        folder = self.check_interrupted(process, signal.SIGTERM)
        self.assertEqual(len(folder.run["runs"]), 1)
        self.assertEqual(len(folder.jobs()), 1)

    def test_killed_command_leaves_no_process_and_no_shared_memory(self) -> None:
        process = self.two_processes(*LONG)
        children = self.children(process)
        process.kill()
        self.finish(process)
        self.wait_for(lambda: not any(os.path.exists(f"/proc/{c}") for c in children), "a child lives on")
        self.assert_nothing_looks_whole("run")
