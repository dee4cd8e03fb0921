# SPDX-License-Identifier: Apache-2.0
"""Watches programs with `hotpath watch`: a program that calls tracepoints like rclcpp, with a stand-in
for tracetools and with the real library, and programs without tracepoints."""

import collections
import contextlib
import functools
import json
import os
import pty
import select
import shutil
import signal
import subprocess
from pathlib import Path
from typing import Any

from analyze_case import COMMAND, SENSOR, TRANSFORM, graph_text
from hotpath_command import CommandTest, HOTPATH, ONE, RunFolder

TRACED_SYSTEM = os.environ["TRACED_SYSTEM"]
REAL = Path(os.environ.get("AMENT_PREFIX_PATH", "/opt/ros/jazzy").split(":")[0]) / "lib"


class WatchTest(CommandTest):
    def watched(self, *arguments: object, code: int = 0) -> Any:
        """(the lines of JSON, standard error)"""
        ended, out, err = self.command("watch", "--json", *arguments)
        self.assertEqual(ended, code, err)
        return [json.loads(line) for line in out.splitlines()], err

    def terminated(self, process: Any) -> tuple[str, str]:
        """Standard output and error of a watcher that was asked to end."""
        process.send_signal(signal.SIGTERM)
        code, out, err = self.finish(process)
        self.assertEqual(code, 128 + signal.SIGTERM)
        return out, err

    def assert_counts(self, report: Any) -> None:
        """Of a timer with 90 jobs, whose every third message is taken."""
        timer, subscription = report["callbacks"]
        self.assertEqual((timer["node"], timer["kind"], timer["period_ms"]), ("/source", "timer", 1))
        self.assertEqual((timer["jobs"], timer["lost"]), (90, 0))
        self.assertEqual((subscription["node"], subscription["topic"]), ("/space/sink", "/a"))
        self.assertEqual((subscription["jobs"], subscription["lost"]), (30, 60))
        self.assertEqual(report["events"], 9 + 90 * 4 + 30 * 3)
        self.assertEqual([report[key] for key in ("dropped", "damaged", "late")], [0, 0, 0])
        self.assertGreaterEqual(subscription["response_ms"]["max"], subscription["execution_ms"]["max"])

    def test_counts_jobs_and_losses(self) -> None:
        reports, err = self.watched("--once", "--", TRACED_SYSTEM, 90, 3)
        self.assertEqual((err, len(reports)), ("done\n", 1))
        self.assert_counts(reports[0])

    def test_counts_the_same_with_the_real_tracetools(self) -> None:
        if not (REAL / "libtracetools.so").exists():
            self.skipTest("left out: no ROS 2 was found")
        self.environment["LD_LIBRARY_PATH"] = str(REAL)
        reports, err = self.watched("--once", "--", TRACED_SYSTEM, 90, 3)
        self.assertEqual(err, "done\n")
        self.assert_counts(reports[-1])

    def test_adds_the_sensor_to_other_preloaded_libraries(self) -> None:
        self.environment["LD_PRELOAD"] = os.environ["FAILING_CALLS"]
        _, err = self.watched("--once", "--", "sh", "-c", "echo $LD_PRELOAD")
        self.assertRegex(err, "libhotpath_watch.so:.*libfailing_calls.so\n")

    def test_keeps_the_signals_and_the_file_mode_mask_of_the_program(self) -> None:
        before = os.umask(0o022)
        try:
            _, err = self.watched("--once", "--", "sh", "-c", "umask; grep SigIgn /proc/self/status")
        finally:
            os.umask(before)
        mask, ignored = err.splitlines()[:2]
        self.assertEqual(int(mask, 8), 0o022)
        self.assertFalse(int(ignored.split()[1], 16) & (1 << (signal.SIGXFSZ - 1)))

    def test_ends_the_program_after_the_given_time(self) -> None:
        reports, _ = self.watched("--for", 0.5, "--", TRACED_SYSTEM, 1_000_000, 1, 1)
        self.assertGreater(reports[-1]["callbacks"][0]["jobs"], 0)
        self.watched("--for", 0.1, "--", "sh", "-c", "trap '' INT; exec sleep 100")

    def test_an_interrupt_of_a_terminal_is_neither_a_failure_nor_silence(self) -> None:
        """It reaches the program as well. What remains of the program ends a second later."""
        path = self.file("callbacks: [{node: source, maximum_distance_ms: {value: 300, from: given}}]")
        node = f"{TRACED_SYSTEM} 1000000 1 10"
        launch = f"trap : INT; {node}; trap - INT; exec tail -f /dev/null"
        for script in (launch, f"exec {node}"):
            process = self.start("watch", "--json", "--contract", path, "--", "sh", "-c", script)
            self.assertTrue(process.stdout.readline())
            os.killpg(process.pid, signal.SIGINT)
            code, out, err = self.finish(process)
            self.assertEqual((code, err), (128 + signal.SIGINT, ""))
            [term] = json.loads(out.splitlines()[-1])["contract"]["terms"]
            self.assertEqual(term["verdict"], "held", script)

    def test_the_program_outlives_a_killed_watcher(self) -> None:
        process = self.start("watch", "--json", "--", TRACED_SYSTEM, 1500, 1, 1)
        self.assertTrue(process.stdout.readline())
        process.kill()
        self.assertEqual(process.communicate(timeout=60)[1], "done\n")
        self.watched("--once", "--", "true")  # removes what the killed watcher left in /dev/shm

    def file(self, *lines: str) -> Path:
        """A contract or a graph."""
        return self.written("input.yaml", "\n".join(lines) + "\n")

    def contract(self, budget_ms: Any) -> Path:
        return self.file(
            "callbacks:",
            f"- {{node: source, budget_ms: {{value: {budget_ms}, from: measured}}}}",
            "- {node: space.sink, topic: a, depth: {value: 1, from: given}}",
        )

    def test_a_contract_that_holds(self) -> None:
        arguments = ("--contract", self.contract(100_000), "--fail-on", "broken", "--once", "--")
        reports, _ = self.watched(*arguments, TRACED_SYSTEM, 10, 1)
        terms = reports[0]["contract"]["terms"]
        self.assertEqual([(t["verdict"], t["checked"]) for t in terms], [("held", 10), ("held", 10)])
        self.assertEqual(reports[0]["contract"]["incident"], "")

    def test_a_broken_contract(self) -> None:
        arguments = ("--contract", self.contract(4), "--once")
        system = ("--", TRACED_SYSTEM, 3, 1, 10, 5)  # jobs of at least 5 ms
        out = self.accepted("watch", *arguments, *system)
        self.assertRegex(out, r"Incident: .* source \(timer\) ran .* ms, budget 4.000 ms \(measured\)")
        reports, err = self.watched(*arguments, "--fail-on", "broken", *system, code=3)
        self.assertIn("the contract", err)
        self.assertEqual([t["broken"] for t in reports[0]["contract"]["terms"]], [3, 0])
        for wrong in (("--contract", "missing.yaml"), ("--fail-on", "broken"), ("--keep", 5)):
            self.refused("watch", *wrong, *system)

    def test_states_an_incident_at_once(self) -> None:
        process = self.start(
            *("watch", "--json", "--output", "record", "--contract", self.contract(4)),
            *("--", TRACED_SYSTEM, 1_000_000, 1, 10, 5),
        )
        reports = []
        while "event" not in (event := json.loads(process.stdout.readline())):
            reports.append(event)
        self.assertEqual((event["event"], event["number"]), ("incident", 1))
        says = r"^\d\d:\d\d:\d\d\.\d{3} source \(timer\) (ran|has run for) .* ms.*, budget 4.000"
        self.assertRegex(event["incident"], says)
        self.assertEqual(event["snapshot"], "record/snapshot_1")
        stated = [incident for r in reports for incident in r["contract"]["incidents"]]
        self.assertEqual(stated, [], "it is stated first")
        self.terminated(process)
        if not shutil.which("babeltrace2"):
            self.skipTest("left out: babeltrace2 was not found")
        shown = subprocess.check_output(["babeltrace2", self.folder / "record/snapshot_1"], text=True)
        [mark] = [line for line in shown.splitlines() if "hotpath:incident" in line]
        self.assertIn(event["incident"], mark)

    def test_watches_a_live_run(self) -> None:
        """hotpath's own executors are watched like those of ROS 2."""
        path = "chains: [{name: path, nodes: [source, sink], sources: [source], sink: sink}]"
        nodes = SENSOR.format("source", 20, 1), COMMAND.format("sink", "source", 1)
        graph = self.file(graph_text(*nodes, more=path))
        self.accepted("analyze", graph, "--executors", "rm-ro", "--contract", "contract.yaml")
        run = ("run", "--graph", graph, *map(str, ONE), "--transport", "intra_process", "--output", "live")
        reports, _ = self.watched(
            *("--once", "--contract", "contract.yaml", "--"), HOTPATH, *run, "--duration", 1, "--warm-up", 0
        )
        live = RunFolder(self.folder / "live")
        (rows,) = live.jobs().values()
        jobs = collections.Counter(job.node for job in rows if job.outcome in ("ran", "running"))
        seen = {callback["node"]: callback for callback in reports[-1]["callbacks"]}
        for node in ("source", "sink"):
            self.assertLessEqual(abs(seen["/" + node]["jobs"] - jobs[node]), 1, "the end of the last one")
        (outputs,) = live.chains().values()
        [chain] = reports[-1]["chains"]
        self.assertLessEqual(abs(chain["outputs"] - len(outputs)), 1)
        self.assertEqual(chain["chain"], "path")
        self.assertGreaterEqual(chain["hot_path_ms"]["max"], 1)  # a job of the source
        # A timer's job may start up to 1 ms before its derived timestamp.
        self.assertGreaterEqual(chain["age_ms"]["max"], chain["hot_path_ms"]["max"] - 1)
        threads = reports[-1]["executor_threads"]
        self.assertEqual({thread["executor"] for thread in threads}, {"rm-ro"})
        self.assertTrue(all(thread["policy"] and thread["processors"] for thread in threads))

    def test_the_contract_of_an_analysis(self) -> None:
        nodes = SENSOR.format("source", 100, 2), TRANSFORM.format("space.sink", "source", 1)
        graph = self.file(graph_text(*nodes))
        analyze = ("analyze", graph, "--contract", "contract.yaml")
        self.accepted(*analyze, "--executors", "rm-ro")
        reports, _ = self.watched("--contract", "contract.yaml", "--once", "--", TRACED_SYSTEM, 3, 1, 100, 5)
        stated = reports[0]["contract"]["terms"]
        terms = {(t.get("callback") or t.get("thread") or t.get("topic"), t["term"]): t for t in stated}
        source, sink = "source (timer)", "space.sink/source"
        given = {(of, term): t["limit"] for (of, term), t in terms.items() if t["from"] == "given"}
        derived = {key: t["limit"] for key, t in terms.items() if t["from"] == "derived"}
        listed = [("rm-ro", "serves"), ("source", "publishers"), ("space.sink", "publishers")]
        expected = dict.fromkeys([*listed, (source, "publishes"), (sink, "publishes")])
        expected |= {(source, "budget_ms"): 2, (source, "period_ms"): 100, ("rm-ro", "wait_ms"): 1}
        self.assertEqual(given, expected | {(sink, "budget_ms"): 1, (sink, "depth"): 1})
        bound = derived.pop((source, "response_ms"))
        self.assertGreaterEqual(bound, 2)
        self.assertGreater(derived.pop((sink, "response_ms")), 0)
        # The source publishes from its timestamp to its bound.
        longest = {(of, "maximum_distance_ms"): 100 + bound for of in (source, sink)}
        self.assertEqual(derived, longest | {(sink, "minimum_distance_ms"): 100 - bound, (sink, "lost"): 0})
        self.assertEqual(terms[source, "budget_ms"]["verdict"], "broken")
        self.assertEqual(terms[source, "period_ms"]["verdict"], "held")
        for wrong in (("--executors", "rm-ro,default"), (), ("--executors", "rm-ro", "--phases", "given")):
            self.refused(*analyze, *wrong, says="--contract")

    def test_the_contract_of_a_recorded_run(self) -> None:
        nodes = SENSOR.format("source", 100, 2), COMMAND.format("sink", "source", 1)
        graph = self.file(graph_text(*nodes))
        self.accepted("simulate", "--graph", graph, *map(str, ONE), "--output", "run", "--duration", 3)
        jobs = self.folder / "run" / "jobs.csv"
        rows = [row.split(",") for row in jobs.read_text().splitlines()]
        for row in rows[1:]:  # on one processor, where the sink's thread displaces the source's for 1 ms of 4
            row[12:14] = str(int(row[3] != "timer")), "0"
            row[9] = str(int(row[9]) + 2_000_000) if row[3] == "timer" else row[9]
            row[16] = "0" if row[16] == "1" else row[16]  # the first job published two messages
        jobs.write_text("".join(",".join(row) + "\n" for row in rows))
        facts = self.folder / "run" / "run.json"
        facts.write_text(facts.read_text().replace('"kind": "simulated"', '"kind": "recorded"'))
        analyze = ("analyze", graph, "--contract", "contract.yaml", "--margin", 300)
        self.accepted(*analyze, "--trace", "run")
        text = (self.folder / "contract.yaml").read_text()
        for limit in ("budget_ms: {value: 12,", "budget_ms: {value: 6,", "maximum_distance_ms: {value: 404,"):
            self.assertIn(limit + " from: measured}", text, "3 and 1 ms, and 300 % or 5 ms more; 101 ms")
        for more in ("and 300 % (at least 5 ms) more", "publishes: [{topic: source, several: true}]"):
            self.assertIn(more, text)
        self.refused(*analyze, says="--margin")

    def test_records_on_request_the_last_events(self) -> None:
        process = self.start(
            "watch", "--json", "--output", "record", "--keep", 1, "--", TRACED_SYSTEM, 1_000_000, 1, 10
        )
        reports = [json.loads(process.stdout.readline()) for _ in range(3)]
        self.assertGreater(reports[-1]["callbacks"][0]["jobs"], 0)
        process.send_signal(signal.SIGUSR1)
        self.wait_for((self.folder / "record" / "snapshot_1").exists, "a snapshot")
        self.assertIn("requested by SIGUSR1", self.terminated(process)[1])
        out = self.accepted("import", "ctf", "record/snapshot_1", "--output", "imported")
        self.assertIn("2 nodes, 2 tasks", out)
        self.assertEqual(self.command("watch", "--output", "record", "--", "true")[0], 2, "it is not empty")

    def test_a_snapshot_follows_one_that_is_being_written(self) -> None:
        """The program stops the watcher, which then meets a request and an incident at once."""
        script = f"kill -STOP $PPID; {TRACED_SYSTEM} 30 1 10 5; kill -USR1 $PPID; kill -CONT $PPID"
        record = ("--output", "record", "--contract", self.contract(4))
        lines, err = self.watched(*record, "--", "sh", "-c", script)
        [event, *_] = [line for line in lines if "event" in line]
        self.assertEqual(event["snapshot"], "record/snapshot_2")
        self.assertIn("record/snapshot_1: requested by SIGUSR1", err)
        self.assertRegex(err, r"record/snapshot_2: .*budget 4\.000 ms")
        snapshots = sorted(folder.name for folder in (self.folder / "record").iterdir())
        self.assertEqual(snapshots, ["snapshot_1", "snapshot_2"])

    def test_names_a_step_of_the_clock(self) -> None:
        step = {"HOTPATH_CLOCK_STEP": "-60", "HOTPATH_CLOCK_STEP_AFTER": "2"}
        self.environment |= {"LD_PRELOAD": os.environ["STEPPING_CLOCK"], **step}
        contract = ("--contract", self.contract(100_000))
        process = self.start("watch", "--json", *contract, "--", TRACED_SYSTEM, 1_000_000, 1, 10)
        lines = (json.loads(process.stdout.readline()) for _ in range(30))
        event = next(line for line in lines if "event" in line)
        self.assertRegex(event["incident"], r"the clock was set back by (59999|60000)\.\d{3} ms$")
        self.terminated(process)

    def test_refreshes_its_tables_on_a_terminal(self) -> None:
        terminal, slave = pty.openpty()
        self.addCleanup(os.close, terminal)
        self.environment["TERM"] = "xterm"
        process = self.start(
            *("watch", "--contract", self.contract(1), "--", TRACED_SYSTEM, 1_000_000, 1, 10, 2),
            stdout=slave,
        )
        os.close(slave)
        screen = ""

        def shows(text: str) -> bool:
            nonlocal screen
            with contextlib.suppress(OSError):  # the other side was closed
                if select.select([terminal], [], [], 0)[0]:
                    screen += os.read(terminal, 65536).decode(errors="replace")
            return text in screen

        for text in ("\033[2J", "/source (timer 10 ms)", "/space/sink /a", "Threads", "Incident: "):
            self.wait_for(functools.partial(shows, text), text)
        process.send_signal(signal.SIGTERM)
        self.wait_for(functools.partial(shows, "Contract"), "the verdicts at the end")
        self.wait_for(lambda: (shows(""), process.poll() is not None)[1], "the end")
        process.stderr.close()

    def attachable(self, *arguments: object) -> subprocess.Popen[str]:
        """Starts the traced system so that watchers can attach to it."""
        out = self.accepted("watch", "--print-environment")
        variables = dict(line.split("=", 1) for line in out.splitlines())
        self.assertEqual(list(variables), ["LD_PRELOAD", "HOTPATH_WATCH"])
        words = [TRACED_SYSTEM, *map(str, arguments)]
        environment = {**os.environ, **variables}
        program = subprocess.Popen(words, env=environment, stdout=subprocess.PIPE, text=True)
        self.addCleanup(program.wait)
        self.addCleanup(program.kill)
        if program.stdout is not None:
            self.addCleanup(program.stdout.close)
        return program

    def rings_of(self, program: subprocess.Popen[str]) -> list[str]:
        return [str(ring) for ring in Path("/dev/shm").glob(f"hotpath_watch.attachable.{program.pid}.*")]

    def test_attaches_to_running_programs(self) -> None:
        program = self.attachable(1_000_000, 1, 5)
        self.wait_for(lambda: len(self.rings_of(program)) == 2, "rings")
        for _ in range(2):  # the second watcher learns of the nodes as well
            reports, err = self.watched("--for", 1, "--once", "--contract", self.contract(100_000))
            self.assertEqual(len(reports), 1)
            self.assertIn(f"attached to process {program.pid} (traced_system)", err)
            timer, subscription = reports[0]["callbacks"]
            self.assertEqual((timer["node"], timer["kind"]), ("/source", "timer"))
            self.assertEqual((subscription["node"], subscription["topic"]), ("/space/sink", "/a"))
            self.assertGreater(timer["jobs"], 0)
            self.assertLess(timer["response_ms"]["max"], 100_000, "not since its creation")
            self.assertEqual([reports[0][key] for key in ("dropped", "damaged", "late")], [0, 0, 0])
            self.assertEqual({t["verdict"] for t in reports[0]["contract"]["terms"]}, {"held"})
            self.assertEqual({t["policy_before"] for t in reports[0]["executor_threads"]}, {None})
        self.assertIsNone(program.poll(), "it goes on")
        program.kill()
        program.communicate()
        self.assertEqual(len(self.rings_of(program)), 2)
        self.watched("--for", 0.1, "--once")  # removes what the killed program left
        self.assertEqual(self.rings_of(program), [])

    def test_an_attachable_program_leaves_nothing_behind(self) -> None:
        program = self.attachable(10, 1)
        self.assertEqual(program.communicate()[0], "done\n")
        self.assertEqual((program.returncode, self.rings_of(program)), (0, []))

    def test_waits_for_programs_and_rejects_a_second_watcher(self) -> None:
        first = self.start("watch", "--json")
        self.assertEqual(json.loads(first.stdout.readline())["events"], 0)
        self.rejected("watch", "--for", 1, code=1, says="another `hotpath watch` is attached")
        program = self.attachable(3000, 1, 1)
        while not (report := json.loads(first.stdout.readline()))["callbacks"]:
            pass
        self.assertEqual(report["callbacks"][0]["node"], "/source")
        self.assertEqual(program.communicate()[0], "done\n")
        out, err = self.terminated(first)
        self.assertEqual(json.loads(out.splitlines()[-1])["callbacks"][0]["jobs"], 3000)
        self.assertIn("no program runs with the sensor", err)
        self.assertEqual(self.rings_of(program), [], "the watcher removed them")
        self.refused("watch", "--print-environment", "--once")

    def test_reports_programs_that_fail(self) -> None:
        """Also if the ends of children were ignored when the watcher started."""
        for prefix in ("", "env --ignore-signal=CHLD"):
            words = [*prefix.split(), HOTPATH, "watch", "--once", "--", "sh", "-c", "exit 3"]
            ended = subprocess.run(words, capture_output=True, text=True, timeout=60)
            self.assertEqual(ended.returncode, 1)
            self.assertIn("`sh` ended with exit code 3", ended.stderr)
            self.assertIn("no tracepoint was recorded", ended.stderr)
        says = "`no-such-program` could not be started"
        self.rejected("watch", "--once", "--", "no-such-program", code=1, says=says)
