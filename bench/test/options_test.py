# SPDX-License-Identifier: Apache-2.0
"""Every option of every command has an effect: it changes the result, it is rejected where it would
be ignored, or it is listed here with the reason why it changes nothing. --help supplies the
commands and their options."""

import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from option_cases import TESTS, Changes, Elsewhere, OptionTest, Refused, Same, options_of

REFERENCE = TESTS.parents[1] / "reference_system" / "ros2_reference"
GOLDEN = REFERENCE / "traces" / "timers_only_80.rm-ro.csv"
THREADS = Same({"--threads": 3}, "results do not depend on the number of threads")
ELSEWHERE = Changes({"--output": "elsewhere"})
JSON = Elsewhere("every command that has it is run with it", "commands_test.py")
BRIEF = {"--duration": 1, "--warm-up": 0}

# The options of simulated systems.
GRAPHS = {
    "--graph": Changes({"--graph": "sequences"}),
    "--load": Changes({"--load": 50}),
    "--rate": Changes({"--rate": 110}),
    "--copies": Changes({"--copies": 2}),
    "--phases": Changes({"--phases": "synchronous"}),
    "--phases-file": Changes({"--phases-file": REFERENCE / "rclcpp_autoware_phases.csv"}),
    "--phase-step": Changes({"--phase-step": 3}, {"--phases": "creation"}),
    "--rule": Changes({"--rule": "first"}),
    "--entity-order": Changes({"--entity-order": "reverse"}),
    "--ties": Changes({"--ties": "fifo"}),
    "--seed": Changes({"--seed": 2}, {"--phases": "random"}),
    "--executors": Changes({"--executors": "default,edf-ro"}),
    "--deployments": Changes({"--deployments": "isolated"}, {"--cores": 2}),
    "--duration": Changes({"--duration": 2}),
    "--warm-up": Changes({"--warm-up": 0.5}),
    "--threads": THREADS,
    "--output": ELSEWHERE,
    "--json": JSON,
}
PLATFORM = {
    "--cores": Changes({"--cores": 2}, {"--executors": "multi:2"}),
    "--timer-thread": Changes({"--timer-thread": "equal"}),
    "--release-cost-us": Changes({"--release-cost-us": 100}),
    "--pass-cost-us": Changes({"--pass-cost-us": 100}),
    "--dispatch-cost-us": Changes({"--dispatch-cost-us": 100}),
    "--timer-dispatch-cost-us": Changes({"--timer-dispatch-cost-us": 100}),
    "--subscription-dispatch-cost-us": Changes({"--subscription-dispatch-cost-us": 100}),
    "--wait-cost-us": Changes({"--wait-cost-us": 100}),
    "--wait-cost-per-entity-us": Changes({"--wait-cost-per-entity-us": 10}),
    "--wake-up-us": Changes({"--wake-up-us": 100}),
    "--delivery-delay-us": Changes({"--delivery-delay-us": 100}),
}
SIMULATIONS = GRAPHS | PLATFORM | {
    "--phases-of": Changes({"--phases-of": "{run}"}),
    "--repetitions": Changes({"--repetitions": 3}),
    "--max-backlog": Changes({"--max-backlog": 1}, {"--load": 95}, refused="overload: more than 1 "),
    "--execution-times": Changes({"--execution-times": "uniform"}, {"--graph": "callbacks"}),
}  # fmt: skip

# By command: its arguments, and the effect of each option.
CASES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "simulate": (
        {"--executors": "default,rm-ro", "--output": "out", **BRIEF},
        SIMULATIONS | {
            "--work": Same({"--work": "wall"}, "virtual time has one kind of work", recorded=True),
            "--no-trace": Changes({"--no-trace": True}),
        },
    ),
    "capacity": (
        {"--executors": "default,rm-ro", "--from": 60, "--to": 120, "--resolution": 30, "--coarse": 3,
         "--repetitions": 2, "--output": "out", **BRIEF},
        SIMULATIONS | {
            "--load": Refused({"--load": 50}, "--over"),
            "--work": Refused({"--work": "wall"}, "--live"),
            "--phases": Changes({"--phases": "synchronous"}),
            "--timer-thread": Changes({"--timer-thread": "equal"}, {"--executors": "rm-re"}),
            "--max-backlog": Changes({"--max-backlog": 1}),
            "--over": Changes({"--over": "rate"}),
            "--require": Changes({"--require": "latency:30"}),
            "--from": Changes({"--from": 30}),
            "--to": Changes({"--to": 90}),
            "--resolution": Changes({"--resolution": 15}),
            "--coarse": Changes({"--coarse": 2}),
            "--live": Refused({"--live": True, "--threads": 2}, "--threads"),
            "--live-options": Refused({"--live-options": "--domain 3"}, "--live"),
        },
    ),
    "advise": (
        {"GRAPH": "autoware", "--executors": "default,rm-ro", "--draws": 2, "--output": "out", **BRIEF},
        GRAPHS | {
            "--graph": Changes({"--graph": "sequences"}, {"GRAPH": None}),
            "--copies": Changes({"--copies": 2}, {"--cores": 2}),
            "--deployments": Changes({"--deployments": "isolated"}),
            "--seed": Changes({"--seed": 2}),
            "--for": Changes({"--for": "hot_path:median"}),
            "--now": Changes({"--now": "rm-ro"}),
            "--cores": Changes({"--cores": 2}),
            "--costs": Changes({"--costs": "graph"}),
            "--draws": Changes({"--draws": 3}),
            "--margin": Refused({"--margin": 1}, "--phases"),
            "--budget": Elsewhere("the number of draws in a given time depends on the machine",
                                  "advise_command_test.py"),
        },
    ),
    "analyze": (
        {"GRAPH": "timers_only_60", "--executors": "default,rm-ro"},
        PLATFORM | {
            "--contract": Elsewhere("a watched system is checked with it", "watch_test.py"),
            "--executors": Changes({"--executors": "edf-ro"}),
            "--load": Changes({"--load": 50}),
            "--rate": Changes({"--rate": 90}),
            "--copies": Changes({"--copies": 2}),
            "--phases": Changes({"--phases": "synchronous"}, {"--chain": "IMU,FrontCamera"}),
            "--phases-file": Changes({"--phases-file": GOLDEN}, {"--chain": "IMU,FrontCamera"}),
            "--phases-of": Changes({"--phases-of": "{timers}"}, {"--chain": "IMU,FrontCamera"}),
            "--cores": Changes({"--cores": 2}, {"--timer-thread": "equal"}),
            "--exact": Changes({"--exact": True}),  # says which phases it needs
            "--phase-uncertainty-us": Changes({"--phase-uncertainty-us": 100}, {"--phases": "synchronous"}),
            "--witness": Changes({"--witness": "worst"}, {"--phases": "synchronous"}),
            "--entity-order": Changes(
                {"--entity-order": "reverse"}, {"GRAPH": "sequences", "--phases": "creation"}
            ),
            "--trace": Changes({"--trace": "{timers}"}),
            "--deployments": Changes({"--deployments": "rm-threads"}),
            "--strict": Elsewhere("a live run must exceed a bound", "analyze_test.py"),
            "--chain": Changes({"--chain": "IMU,FrontCamera"}),
            "--csv": Changes({"--csv": "bounds.csv"}),
            "--page": Changes({"--page": "page"}),
            "--json": JSON,
            "--delta-us": Changes({"--delta-us": 100}),
        },
    ),
    "sweep": (
        {"FILE": "{sweep}", "--output": "out"},
        {
            "--threads": Elsewhere("only the printed estimate depends on it", "sweep_test.py"),
            "--rank-time-out": Elsewhere("it needs a rank that dies", "sweep_test.py"),
            "--yes": Elsewhere("it starts a sweep of more than an hour; sweep_test.py tests the rejection without it"),
            "--output": ELSEWHERE,
        },
    ),
    "timeline": (
        {"RUN": "{run}", "--csv": "rows.csv"},
        {
            "--executor": Changes({"--executor": "rm-ro"}),
            "--repetition": Changes({"--repetition": 1}),
            "--from": Changes({"--from": 300}),
            "--to": Changes({"--to": 300}),
            "--svg": Elsewhere("a chart takes seconds", "simulate_test.py"),
            "--perfetto": Changes({"--perfetto": "trace.json", "--csv": None}),
            "--csv": Changes({"--csv": "other.csv"}),
        },
    ),
    "explain": (
        {"RUN": "{run}"},
        {
            "--executor": Changes({"--executor": "rm-ro"}),
            "--repetition": Changes({"--repetition": 1}),
            "--chain": Changes({"--chain": "lane_detection"}, {"RUN": "{chains}"}),
            "--task": Changes({"--task": "RearLidarDriver"}),
            "--worst": Changes({"--worst": True}),
            "--quantile": Changes({"--quantile": 0.9}),
            "--sequence": Changes({"--sequence": 5}),
            "--json": Changes({"--json": True}),
        },
    ),
    "replay": (
        {"RUN": "{run}"},
        {"--live": Elsewhere("replay does nothing without it", "live_test.py")} | {
            option: Elsewhere("only subscribers see its effect", "live_test.py")
            for option in ("--executor", "--repetition", "--graph", "--speed", "--start", "--duration", "--domain")
        } | {"--all-interfaces": Elsewhere("it needs another machine")},
    ),
    "validate": (
        {"RUN": "{run}", "--output": "out"},
        {
            "--reference": Refused({"--reference": "nowhere"}, "nowhere"),
            "--all": Changes({"--all": True}),
            "--output": ELSEWHERE,
            "--json": JSON,
        },
    ),
    "list executors": ({}, {"--json": JSON}),
    "list graphs": ({}, {"--json": JSON}),
    "list deployments": ({}, {"--json": JSON}),
    "graph": (
        {"GRAPH": "autoware"},
        {
            "--dot": Changes({"--dot": True}),
            "--svg": Changes({"--svg": True}) if shutil.which("dot") else Elsewhere("there is no Graphviz"),
            "--cie": Changes({"--cie": True}),
            "--deployment": Changes({"--deployment": "isolated"}, {"--dot": True}),
        },
    ),
    "experiment wcrt-table": ({}, {"--output": ELSEWHERE, "--json": JSON}),
    "experiment waters": (
        {"--sets": 3, "--utilisations": 0.5, "--output": "out"},
        {
            "--sets": Changes({"--sets": 4}),
            "--utilisations": Changes({"--utilisations": 0.6}),
            "--seed": Changes({"--seed": 2}),
            "--threads": THREADS,
            "--paper-only": Changes({"--paper-only": True}),
            "--output": ELSEWHERE,
            "--json": JSON,
        },
    ),
    "machine": (
        {},
        {
            "--duration": Elsewhere("it is measured in real time", "bench_command_test.py"),
            "--output": Elsewhere("each measurement differs", "bench_command_test.py"),
            "--json": JSON,
        },
    ),
    "bench": (
        {},
        {
            option: Elsewhere("its programs measure", "bench_command_test.py")
            for option in ("--quick", "--repetitions", "--only", "--time-out", "--output", "--seed")
        },
    ),
    "summarize": (
        {"RUN": "{run}"},
        {
            "--responses": Changes({"--responses": "responses.csv"}),
            "--golden": Changes({"--golden": GOLDEN, "RUN": None}),
            "--json": JSON,
        },
    ),
    "report": (
        {"RUN": "{tiny}"},
        {"--output": Changes({"--output": "page"}), "--json": Changes({"--json": True})},
    ),
    "compare-results": (
        {"OLD": "{tiny}", "NEW": "{tiny}"},
        {
            "--gate": Changes({"--gate": True}),
            "--across-loads": Elsewhere("it needs runs of two loads", "../hotpath_report/test/test_gate.py"),
            "--page": Elsewhere("a page takes seconds", "result_pages_test.py"),
            "--json": JSON,
        } | {
            option: Elsewhere("every file that a command writes is tested there", "output_targets_test.py")
            for option in ("--csv", "--junit", "--markdown")
        },
    ),
    "import ctf": (
        {"TRACE": "{trace}", "--output": "out"},
        {
            "--output": ELSEWHERE,
            "--executor": Changes({"--executor": "static"}),
            "--deployment": Changes({"--deployment": "{deployment}"}),
            "--chain": Changes({"--chain": "FrontLidarDriver:ObjectCollisionEstimator"}),
            "--cores": Changes({"--cores": 3}),
            "--jobs": Changes({"--jobs": 100}),
        },
    ),
    "export ctf": ({"RUN": "{run}", "--output": "out"}, {"--output": ELSEWHERE}),
    "recover": ({}, {"--json": JSON}),
    "watch": (
        {},
        {
            option: Elsewhere("it watches in real time", "watch_test.py")
            for option in (
                *("--for", "--once", "--contract", "--fail-on", "--record", "--keep", "--json"),
                "--print-environment",
            )
        },
    ),
    "check": ({}, {}),
    "completion": ({}, {}),
}  # fmt: skip
LIVE = {"run", "compare"}  # options_live_test.py


TINY = """name: tiny
nodes:
  - {name: S, type: sensor, period_ms: 100}
  - {name: C, type: command, input: S}
chains:
  - {name: path, nodes: [S, C], sources: [S], sink: C}
"""


class EveryOptionCounts(OptionTest):
    places: dict[str, Path]

    @classmethod
    def setUpClass(cls) -> None:
        super().setUpClass()
        (cls.folder / "tiny.yaml").write_text(TINY)
        runs = {
            "tiny": ("--graph", "tiny.yaml", "--executors", "default,rm-ro"),
            "chains": ("--graph", "sequences", "--executors", "default"),
            "run": ("--executors", "default,rm-ro", "--repetitions", 3, "--phases", "random", "--seed", 5),
            "timers": (
                "--graph",
                "timers_only_60",
                "--executors",
                "default,rm-ro",
                "--phases",
                "synchronous",
            ),
        }
        cls.places = {name: cls.folder / name for name in (*runs, "sweep", "deployment")}
        for name, words in runs.items():
            cls.must("simulate", *words, "--duration", 1, "--warm-up", 0, "--output", cls.places[name])
        cls.must("export", "ctf", cls.places["run"], "--output", cls.folder / "exported")
        cls.places["trace"] = cls.folder / "exported" / "default-0"
        cls.places["deployment"].write_text(
            "name: mine\nexecutors:\n  - {name: all, executor: static, owns: rest}\n"
        )
        cls.places["sweep"].write_text(
            "command: simulate\nfixed: {duration: 1, warm-up: 0}\naxes: {load: [40, 80]}\n"
        )

    @classmethod
    def must(cls, *words: object) -> None:
        done = cls.run_in(cls.folder, words)
        if done.returncode:
            raise AssertionError(done.stderr)

    def filled(self, words: Any) -> dict[Any, Any]:
        return {o: v.format(**self.places) if isinstance(v, str) else v for o, v in words.items()}

    def check_option(self, command: Any, base: Any, option: str, case: Any) -> None:
        if not isinstance(case, Elsewhere):
            case = type(case)(
                **{k: self.filled(v) if isinstance(v, dict) else v for k, v in vars(case).items()}
            )
        super().check_option(command, self.filled(base), option, case)

    def commands(self, command: str = "") -> Iterator[Any]:
        """All commands; subcommands after their parent's name."""
        names = re.findall(
            r"^  ([a-z][a-z-]+) ", self.help_of(command).partition("Subcommands:")[2], re.MULTILINE
        )
        for name in names:
            whole = f"{command} {name}".strip()
            yield from self.commands(whole) if "SUBCOMMAND" in self.help_of(whole) else [whole]

    def test_no_command_is_forgotten(self) -> None:
        self.assertEqual(set(self.commands()), CASES.keys() | LIVE)

    def test_commands(self) -> None:
        for command, (base, cases) in CASES.items():
            self.check_command(command, base, cases)

    def test_the_check_finds_an_option_that_is_ignored(self) -> None:
        """Planted defects: an option without effect, an option that ends with an error, and an
        option that is not listed."""
        base, cases = CASES["simulate"]
        with self.assertRaisesRegex(AssertionError, "--ties is ignored"):
            self.check_option("simulate", base, "--ties", Changes({"--ties": "lifo"}))
        with self.assertRaisesRegex(AssertionError, "--ties ends with an error"):
            self.check_option("simulate", base, "--ties", Changes({"--ties": "nonsense"}))
        with self.assertRaisesRegex(AssertionError, "simulate: list their effect here"):
            self.check_command("simulate", base, {k: v for k, v in cases.items() if k != "--ties"})
        self.assertIn("--ties", options_of(self.help_of("simulate")))


class Contradictions(OptionTest):
    """Pairs that are rejected because one option would be ignored; the message names both."""

    def test_pairs(self) -> None:
        for words, parts in (
            ("run --quick --duration 5", ("--quick", "--duration")),
            ("run --quick --repetitions 5", ("--quick", "--repetitions")),
            ("run --executor rm-ro --deployments isolated", ("--executor", "--deployments")),
            ("run --transport intra_process --network shared_memory", ("--transport", "--network")),
            ("run --transport intra_process --domain 3", ("--transport", "--domain")),
            ("run --transport intra_process --all-interfaces", ("--transport", "--all-interfaces")),
            ("run --ros2-runner x", ("--ros2-runner", "--stack")),
            ("run --rmw cyclonedds", ("--rmw", "--stack")),
            ("compare --against x --quick", ("--against", "--quick")),
            ("simulate --phases random --phase-step 3", ("--phases", "--phase-step")),
            ("simulate --phases given --phases-file x", ("--phases", "--phases-file")),
            ("simulate --phases given --phases-of x", ("--phases", "--phases-of")),
            ("simulate --phase-step 3 --phases-of x", ("--phase-step", "--phases-of")),
            ("advise --phase-step 3", ("--phases", "--phase-step")),
            ("advise autoware --graph sequences", ("--graph", "GRAPH")),
            ("analyze autoware --phases random --phases-of x", ("--phases", "--phases-of")),
            ("analyze autoware --phases random --phases-file x", ("--phases", "--phases-file")),
            ("analyze autoware --phases-of x --phases-file x", ("--phases-of", "--phases-file")),
            ("analyze autoware --trace x --rate 50", ("--trace", "--rate")),
            ("analyze autoware --trace x --copies 2", ("--trace", "--copies")),
            ("analyze autoware --trace x --entity-order reverse", ("--trace", "--entity-order")),
            ("analyze autoware --chain a,b --csv x", ("--chain", "--csv")),
            ("analyze autoware --delta-us 1 --release-cost-us 2", ("--delta-us", "--release-cost-us")),
            ("analyze autoware --chain nope", ("--chain", "nope")),
            ("bench --quick --repetitions 3", ("--quick", "--repetitions")),
            ("summarize run --golden x", ("RUN", "--golden")),
            ("summarize --golden x --json", ("--golden", "--json")),
            ("compare --against x --json", ("--against", "--json")),
            ("explain run --worst --sequence 3", ("--worst", "--sequence")),
            ("explain run --chain a --task b", ("--chain", "--task")),
            ("capacity --over load --load 50", ("--over", "--load")),
            ("capacity --over copies --from 1 --to 2000", ("--over", "--copies", "1000")),
            ("capacity --over rate --from 0", ("--over", "--rate")),
            ("capacity --live-options --quick", ("--live-options", "--live")),
        ):
            with self.subTest(words=words):
                code, results, _, err = self.outcome(words, {})
                self.assertEqual((code, results), (2, {"": ""}), err)
                for part in parts:
                    self.assertIn(part, err)

    def test_numbers_are_read_strictly(self) -> None:
        for words in (
            *(f"simulate --seed {n}" for n in ("-1", "+1", "0x10", "1e3", "18446744073709551616", "1.0")),
            *(f"experiment waters --threads {n}" for n in ("-1", "1025")),
            *(
                f"{command} --seed -1"
                for command in ("run", "compare", "capacity", "advise", "bench", "experiment waters")
            ),
        ):
            with self.subTest(words=words):
                code, _, _, err = self.outcome(words, {})
                self.assertEqual(code, 2, err)
                self.assertIn(f"{words.split()[-2]}: `{words.split()[-1]}` is not a whole number from", err)
        decimal: dict[str, Any] = {
            "--repetitions": "010",
            "--output": "out",
            "--executors": "default",
            **BRIEF,
        }
        run = self.outcome("simulate", decimal)[2]["out/run.json"]
        self.assertEqual(run["repetitions"], 10)

    def test_lists_have_no_empty_items(self) -> None:
        for words in ("simulate --executors , --output x", "compare --executors a,,b", "run --stack ,",
                      "bench --only a,",
                      "simulate --deployments ,a", "capacity --require ,", "analyze autoware --chain ,",
                      "analyze autoware --executors ,", "explain run --executor ,",
                      "experiment waters --utilisations 0.5,"):  # fmt: skip
            with self.subTest(words=words):
                code, _, _, err = self.outcome(words, {})
                self.assertEqual(code, 2, err)
                self.assertRegex(err, r"--[a-z]+: `[^`]*` has an empty item")
                self.assertIn([w for w in words.split() if w.startswith("--")][0], err)

    def test_an_option_that_no_executor_uses_is_noted(self) -> None:
        base: dict[str, Any] = {"--executors": "default", "--output": "out", **BRIEF}
        for words in (
            {"--ties": "fifo"},
            {"--rule": "first"},
            {"--entity-order": "reverse", "--executors": "rm-ro"},
        ):
            code, _, _, err = self.outcome("simulate", base | words)
            self.assertEqual(code, 0)
            self.assertIn(f"note: {next(iter(words))} changes nothing", err)
