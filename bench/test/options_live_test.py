# SPDX-License-Identifier: Apache-2.0
"""Every option of `run` and `compare` has an effect: run.json or jobs.csv differ with and without
it. Measured values always differ, so the test compares only values that follow from the options."""

import csv
from typing import Any

from option_cases import TESTS, Changes, Elsewhere, OptionTest, Refused, options_of

PHASES = TESTS.parents[1] / "reference_system" / "ros2_reference" / "rclcpp_autoware_phases.csv"
# Keys whose values differ between two runs with the same options.
MEASURED = {"bounds", "calibration", "command", "date", "machine", "warnings"}
OF_A_RUN = ("executor", "repetition", "first_timestamps_ms", "live", "thread_policies")
BASE = {
    "--executor": "rm-ro",
    "--load": 1,
    "--transport": "intra_process",
    "--duration": 0.1,
    "--warm-up": 0,
    "--output": "out",
}
DDS = {"--transport": "fastdds"}
RUN = {
    "--executor": Changes({"--executor": "default"}),
    "--deployments": Changes({"--deployments": "isolated"}, {"--executor": None}),
    "--graph": Changes({"--graph": "sequences"}),
    "--load": Changes({"--load": 2}),
    "--rate": Changes({"--rate": 110}),
    "--copies": Changes({"--copies": 2}),
    "--work": Changes({"--work": "wall"}),
    "--phases": Changes({"--phases": "synchronous"}),
    "--phases": Changes({"--phases": PHASES}),
    "--phase-step": Changes({"--phase-step": 3}),
    "--rule": Changes({"--rule": "first"}),
    "--entity-order": Changes({"--entity-order": "reverse"}, {"--executor": "default"}),
    "--ties": Changes({"--ties": "fifo"}),
    "--quick": Changes({"--quick": True, "--duration": None, "--warm-up": None}),
    "--duration": Changes({"--duration": 0.2}),
    "--warm-up": Changes({"--warm-up": 0.1}),
    "--repetitions": Changes({"--repetitions": 2}),
    "--seed": Changes({"--seed": 2}, {"--phases": "random"}),
    "--time-out": Elsewhere("it needs a process that hangs", "process_faults_test.py"),
    "--stack": Elsewhere("it needs ROS 2", "faults_test.py"),
    "--ros2-runner": Refused({"--ros2-runner": "x"}, "--stack"),
    "--rmw": Refused({"--rmw": "cyclonedds"}, "--stack"),
    "--json": Elsewhere("every command that has it is run with it", "commands_test.py"),
    "--transport": Changes(DDS),
    "--processes": Changes({"--processes": 2}, DDS),
    "--network": Changes({"--network": "shared_memory"}, DDS),
    "--all-interfaces": Changes({"--all-interfaces": True}, DDS),
    "--domain": Changes({"--domain": 7}, DDS),
    "--cpus": Changes({"--cpus": 0}),
    "--executor-policy": Changes({"--executor-policy": "other"}),
    "--timer-policy": Changes({"--timer-policy": "other"}),
    "--lock-memory": Changes({"--lock-memory": True}),
    "--cpu-time": Changes({"--cpu-time": True}, {"--work": "wall"}),
    "--live": Changes({"--live": True}),
    "--live-alternate": Changes({"--live-alternate": True}, {"--repetitions": 2}),
    "--live-cpus": Changes({"--live-cpus": 0}, {"--live": True}),
    "--output": Changes({"--output": "elsewhere"}),
}
COMPARE = {
    "--executors": Changes({"--executors": "default,rm-ro"}),
    "--deployments": Changes({"--deployments": "isolated"}),
    "--against": Elsewhere("it needs another build", "sweep_test.py"),
    "--junit": Elsewhere("it belongs to --against", "sweep_test.py"),
    "--markdown": Elsewhere("it belongs to --against", "sweep_test.py"),
}


class EveryLiveOptionCounts(OptionTest):
    def facts_of(self, run: Any) -> Any:
        runs = [{key: r[key] for key in OF_A_RUN if key in r} for r in run["runs"]]
        return {key: value for key, value in run.items() if key not in MEASURED} | {"runs": runs}

    def outcome(self, command: Any, arguments: Any) -> tuple[Any, Any, Any, Any]:
        code, results, facts, err = super().outcome(command, arguments)
        timed = {
            name: self.has_cpu_times(text) for name, text in results.items() if name.endswith("jobs.csv")
        }
        return code, dict.fromkeys(results.keys() - {""}) | timed, facts, err

    @staticmethod
    def has_cpu_times(jobs: Any) -> bool:
        return any(row["cpu_ns"] for row in csv.DictReader(jobs.decode().splitlines()))

    def differs(self, without: Any, with_it: Any) -> bool:
        """Whether the results differ, including run.json."""
        return with_it[:3] != without[:3]

    def test_run(self) -> None:
        code, results, facts, err = self.outcome("run", BASE)
        self.assertEqual(code, 0, err)
        again = self.outcome("run", {**BASE, "--seed": 1})
        self.assertEqual((again[0], again[1], again[2]), (code, results, facts), "the same options again")
        self.check_command("run", BASE, RUN)
        cases: tuple[tuple[dict[str, Any], bool], ...] = (
            ({}, True),  # work in CPU time
            ({"--load": 0}, False),
            ({"--work": "fixed"}, False),
            ({"--work": "fixed", "--cpu-time": True}, True),
        )
        for words, timed in cases:
            _, files, _, _ = self.outcome("run", BASE | {"--phases": "synchronous"} | words)
            self.assertEqual(files["out/jobs.csv"], timed, words)

    def test_compare_has_the_options_of_run_and_its_own(self) -> None:
        of_run, of_compare = ({o for o in options_of(self.help_of(c))} for c in ("run", "compare"))
        self.assertEqual(
            of_compare ^ of_run, {"--executor", "--executors", "--against", "--junit", "--markdown"}
        )
        base: dict[str, Any] = {**BASE, "--executor": None, "--executors": "default", "--repetitions": 1}
        for option, case in COMPARE.items():
            with self.subTest(option=option):
                self.check_option("compare", base, option, case)
