# SPDX-License-Identifier: Apache-2.0
"""The gate on made-up and simulated repetitions: alarms, power, errors and reports."""

import contextlib
import io
import json
import os
import subprocess
import sys
import tempfile
import unittest
from collections.abc import Iterable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from hotpath_report import hotpath_command
from hotpath_report.__main__ import main
from hotpath_report.errors import InputError
from hotpath_report.comparison import sides
from hotpath_report.comparison.gate import junit, markdown, power, verdict
from hotpath_report.comparison.judgement import Judgement
from hotpath_report.comparison.judgement import judge as judge_sides
from hotpath_report.comparison.sides import Side
from hotpath_report.statistics import Samples
from hotpath_report.tables import read_table

BENCH = Path(__file__).resolve().parents[2]  # holds the package
FIELD = BENCH / "test" / "field"
EXECUTORS = ("default", "static", "events-ro", "rm-ro")
NOISE = 0.02  # standard deviation of a repetition's median


def build(
    generator: np.random.Generator,
    repetitions: int = 8,
    slower: Any = None,
    by: float = 1.1,
    shared: Iterable[Any] = (),
) -> Any:
    """Samples of each executor: repetitions with noise, scaled by the factors `shared`."""
    made = {}
    for executor in EXECUTORS:
        factors = np.broadcast_to(by if executor == slower else 1, repetitions) * (shared or 1)
        of = [20 * f * np.exp(generator.normal(0, NOISE)) * generator.uniform(0.8, 1.4, 100) for f in factors]
        made["hot path", "autoware", "live", "80 %", executor, ""] = Samples(of)
    return made


def losses(generator: np.random.Generator, repetitions: int = 8, mean: float = 3.0) -> dict[Any, Any]:
    return {
        ("lost", "autoware", "live", "80 %", e, ""): dict(enumerate(generator.poisson(mean, repetitions)))
        for e in EXECUTORS
    }


def simulated(*medians: float, first: int = 1) -> dict[Any, Any]:
    """Samples of simulations with seeds from `first`."""
    of = [[m, m, 2 * m] for m in medians]
    numbers = range(first, first + len(of))
    return {("hot path", "autoware", "simulated", "80 %", "rm-ro", ""): Samples(of, True, numbers)}


def judge(old: Any, new: Any, counts: Any = ({}, {}), interleaved: bool = False) -> list[Judgement]:
    """Judges samples and losses of two sides."""
    return judge_sides(Side(old, counts[0], {}), Side(new, counts[1], {}), interleaved)


class Gate(unittest.TestCase):
    def judged(self, seed: int, slower: Any = None, more_losses: float = 0.0) -> Any:
        generator = np.random.default_rng(seed)
        counts = losses(generator), losses(generator, mean=3.0 + more_losses)
        return judge(build(generator), build(generator, slower=slower), counts)

    def test_the_same_build_twice_does_not_fire(self) -> None:
        fired = sum(any(j.worse for j in self.judged(seed)) for seed in range(40))
        self.assertLessEqual(fired, 1)

    def test_ten_percent_in_one_executor_fires_and_no_other(self) -> None:
        found = 0
        for seed in range(40):
            worse = [j.what for j in self.judged(seed, slower="static") if j.worse and j.measure == "p50"]
            found += worse == ["hot path autoware live 80 % static"]
        self.assertGreaterEqual(found, 38)

    def test_losses_fire(self) -> None:
        worse = {j.measure for j in self.judged(1, more_losses=20) if j.worse}
        self.assertEqual(worse, {"lost jobs and samples"})

    def test_a_faster_build_does_not_fire(self) -> None:
        generator = np.random.default_rng(1)
        fast = build(generator, slower="static", by=0.5)
        self.assertFalse(any(j.worse for j in judge(build(generator), fast, ({}, {}))))

    def test_interleaved_repetitions_are_pairs(self) -> None:
        shared = tuple(np.exp(np.linspace(-0.5, 0.5, 8)))  # a machine that becomes slower
        generator = np.random.default_rng(1)
        old, new = build(generator, shared=shared), build(generator, slower="static", shared=shared)
        worse = {
            turns: {j.what for j in judge(old, new, ({}, {}), turns) if j.worse} for turns in (True, False)
        }
        self.assertEqual(worse, {True: {"hot path autoware live 80 % static"}, False: set()})

    def test_too_few_repetitions_are_refused(self) -> None:
        generator = np.random.default_rng(1)
        with self.assertRaisesRegex(InputError, "needs 3 repetitions on each side, one side has 2"):
            judge(build(generator), build(generator, repetitions=2), ({}, {}))
        with self.assertRaisesRegex(
            InputError, "of other seeds on each side, one side has 1; .* same --seed"
        ):
            judge(simulated(10), simulated(10, first=2), ({}, {}))

    def test_the_stated_power_holds(self) -> None:
        judgements = self.judged(1)
        told = [j.detectable_percent for j in judgements if not j.lost]
        self.assertIn(f"a growth of {np.median(told):.1f} % would be found", power(judgements))
        of_static = next(j for j in judgements if "static" in j.what and j.measure == "p50")
        found = 0
        for seed in range(40):
            generator = np.random.default_rng(100 + seed)
            new = build(generator, slower="static", by=1 + of_static.detectable_percent / 100)
            found += any(j.worse and "static" in j.what for j in judge(build(generator), new, ({}, {})))
        self.assertGreater(found, 30)


class SimulatedPairs(unittest.TestCase):
    def worse(self, old: Any, new: Any) -> list[Any]:
        return [j.worse for j in judge(old, new, ({}, {}))]

    def test_one_repetition_differs_by_any_amount(self) -> None:
        self.assertEqual(self.worse(simulated(10), simulated(10.001)), [True] * 3)
        self.assertEqual(self.worse(simulated(10), simulated(9.999)), [False] * 3)

    def test_equal_results_are_no_change(self) -> None:
        same = judge(simulated(10, 17, 12), simulated(10, 17, 12), ({}, {}))
        self.assertIn("No change: in each pair of equal draws all 3 measures are the same", verdict(same))
        self.assertFalse(any(j.worse for j in same))
        self.assertEqual(same[0].cells()[-1], "the same")

    def test_repetitions_of_one_seed_are_pairs(self) -> None:
        old, new = (10, 17, 12, 30, 22), (10.5, 17.85, 12.6, 31.5, 23.1)
        self.assertEqual(self.worse(simulated(*old), simulated(*new)), [True] * 3)
        self.assertEqual(self.worse(simulated(*old), simulated(*new, first=11)), [False] * 3)
        self.assertEqual(self.worse(simulated(*old), simulated(*reversed(new))), [False] * 3)

    def test_pairs_that_disagree_are_not_enough(self) -> None:
        old = (10, 10, 10, 10, 10)
        self.assertEqual(self.worse(simulated(*old), simulated(10.5, 10.5, 9, 10.5, 10.5)), [False] * 3)

    def test_compares_common_seeds(self) -> None:
        self.assertEqual(self.worse(simulated(10, 17, 12), simulated(17.1, first=2)), [True] * 3)


class Counts(unittest.TestCase):
    """Outputs and jobs: what one side has and the other has not."""

    CHAIN = ("hot path", "x", "simulated", "80 %", "rm-ro", "")
    TIMER = ("response", "T", "simulated", "80 %", "rm-ro", "")

    def verdicts(self, old: Any, new: Any) -> dict[str, str]:
        """{measure: verdict} of two sides' outputs."""
        judged = judge_sides(Side({}, {}, old), Side({}, {}, new))
        return {j.measure: j.cells()[-1] for j in judged}

    def counts(self, chain: Any = (50, 50, 50), timer: Any = (50, 50, 50), **others: Any) -> dict[Any, Any]:
        made = {self.CHAIN: dict(enumerate(chain)), self.TIMER: dict(enumerate(timer))}
        return made | {(*self.CHAIN[:4], name, ""): dict(enumerate(of)) for name, of in others.items()}

    def test_one_thing_after_the_other_is_missing_on_a_side(self) -> None:
        whole = self.counts(other=(5, 5, 5))
        self.assertEqual(self.verdicts(whole, whole), {"outputs": "the same"})
        lacks = {
            "outputs of one repetition": self.counts(chain=(50, 0, 50), other=(5, 5, 5)),
            "most outputs of one repetition": self.counts(chain=(50, 20, 50), other=(5, 5, 5)),
            "jobs of a timer": self.counts(timer=(50, 50, 0), other=(5, 5, 5)),
            "the chain": {key: v for key, v in whole.items() if key != self.CHAIN},
            "the timer": {key: v for key, v in whole.items() if key != self.TIMER},
            "an executor": self.counts(),
            "a repetition": self.counts((50, 50), (50, 50), other=(5, 5)),
        }
        for what, side in lacks.items():
            with self.subTest(what):
                self.assertIn("WORSE", self.verdicts(whole, side).values())
                gained = self.verdicts(side, whole)
                self.assertNotIn("WORSE", gained.values())
                self.assertNotEqual(set(gained.values()), {"the same"})

    def test_one_output_that_ends_after_the_run_is_no_loss(self) -> None:
        self.assertEqual(
            self.verdicts(self.counts(), self.counts(chain=(50, 49, 50)))["outputs"], "not worse"
        )
        self.assertEqual(self.verdicts(self.counts(), self.counts(chain=(45, 45, 45)))["outputs"], "WORSE")


class Simulations(unittest.TestCase):
    """Comparisons of real simulations with 5 repetitions."""

    folder: Path

    @classmethod
    def setUpClass(cls) -> None:
        folder = tempfile.TemporaryDirectory(prefix="hotpath_gate_")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)

    def simulate(self, *, load: int = 80, seed: int = 1, more: Iterable[Any] = ()) -> str:
        output = self.folder / f"{load}-{seed}{''.join(more)}"
        if not output.exists():
            words = "--duration 3 --phases random --executors default,rm-ro --repetitions 5"
            words += f" --load {load} --seed {seed}"
            command = [hotpath_command.program(), "simulate", *words.split(), *more, "--output", output]
            environment = os.environ | {"HOTPATH_FIGURES": "none"}
            subprocess.run(command, check=True, env=environment, stdout=subprocess.DEVNULL)
        return str(output)

    def gate(self, *words: str) -> tuple[Any, Any, Any]:
        """Exit code, standard output, standard error."""
        with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(
            io.StringIO()
        ) as err:
            code = main(["diff", *words, "--gate"])
        return code, out.getvalue(), err.getvalue()

    def test_finds_five_percent_more_load_every_time(self) -> None:
        for seed in range(1, 51, 10):
            folders = self.simulate(seed=seed), self.simulate(load=84, seed=seed)
            code, out, err = self.gate(*folders, "--across-loads")
            self.assertEqual((code, err), (1, ""), out)
        self.assertIn("80 % to 84 % rm-ro", out)
        self.assertIn("simulated repetitions of equal draws pair by pair", out)

    def test_other_seeds_raise_no_alarm(self) -> None:
        fired = 0
        for seed in range(1, 41, 10):
            code, out, err = self.gate(self.simulate(seed=seed), self.simulate(seed=seed + 10))
            self.assertIn("independent repetitions", out, err)
            self.assertIn("Simulate both with the same --seed", out)
            fired += code
        self.assertEqual(fired, 0)

    def test_the_same_simulation_is_no_change(self) -> None:
        code, out, err = self.gate(self.simulate(), self.simulate(more=("--threads=1",)))
        self.assertEqual((code, err), (0, ""))
        self.assertIn("No change: ", out)

    def test_compares_other_loads_only_on_request(self) -> None:
        code, out, err = self.gate(self.simulate(), self.simulate(load=84))
        self.assertEqual((code, out), (2, ""))
        self.assertIn("has load 80 %, ", err)
        self.assertIn("compare them with --across-loads", err)

    def test_the_command_passes_the_option(self) -> None:
        words = "diff", self.simulate(), self.simulate(load=84), "--gate", "--across-loads"
        done = subprocess.run(
            [hotpath_command.program(), *words], capture_output=True, text=True, check=False
        )
        self.assertEqual((done.returncode, done.stderr), (1, ""))
        self.assertIn("80 % to 84 %", done.stdout)

    def test_needs_no_jobs(self) -> None:
        with_jobs, without = (
            Path(self.simulate(load=140, more=more)) for more in ((), ("--no-trace", "--max-backlog=1000000"))
        )
        outcomes = read_table(with_jobs / "jobs.csv", ["executor", "repetition", "outcome"])
        lost = outcomes[outcomes["outcome"].isin(["skipped", "overwritten"])]
        counts = lost.groupby(["executor", "repetition"]).size()
        self.assertGreater(counts.sum(), 10)
        for folder in (with_jobs, without):
            for (*_, executor, _), of_repetition in sides.side(folder).losses.items():
                expected = {1 + r: counts.get((executor, r), 0) for r in range(5)}
                self.assertEqual(of_repetition, expected)
        code, out, err = self.gate(self.simulate(), self.simulate(more=("--no-trace",)))
        self.assertEqual((code, err), (0, ""), out)

    def test_a_summary_of_an_older_version_is_named_with_a_remedy(self) -> None:
        older = Path(self.simulate(more=("--threads=2",)))
        summary = json.loads((older / "summary.json").read_text())
        for executor in summary["executors"]:
            del executor["losses"]
        (older / "summary.json").write_text(json.dumps(summary))
        for words in ((self.simulate(), str(older)), (str(older), self.simulate())):
            code, out, err = self.gate(*words)
            self.assertEqual((code, out), (2, ""))
            self.assertIn(f"{older}/summary.json: an older version wrote it", err)
        hotpath_command.output_of("report", "--summary", older)
        self.assertEqual(self.gate(self.simulate(), str(older))[0], 0)

    def field(self, graph: str, name: str, *words: str) -> str:
        """Simulates one of the graphs with right values from public reports."""
        output = self.folder / name
        command: list[Any] = [
            hotpath_command.program(),
            "simulate",
            "--graph",
            FIELD / graph if graph.endswith(".yaml") else graph,
            *words,
            "--output",
            output,
        ]
        environment = os.environ | {"HOTPATH_FIGURES": "none"}
        subprocess.run(command, check=True, env=environment, stdout=subprocess.DEVNULL)
        return str(output)

    def test_a_chain_that_falls_silent_is_worse(self) -> None:
        words = "--executors fp-ro --phases random --repetitions 5 --duration 5".split()
        old = self.field("silent_chain.yaml", "with_outputs", *words)
        new = self.field("silent_chain.yaml", "silent", *words, "--platform", "dispatch_cost_us=4000")
        code, out, _ = self.gate(old, new)
        self.assertEqual(code, 1)
        self.assertRegex(out, r"hot path x .* outputs +49.2 +0 .*WORSE")
        self.assertEqual(self.gate(new, old)[0], 0)

    def test_other_draws_are_no_pair(self) -> None:
        words = ("--executors", "default", "--duration", "2")
        jittered = [self.field("jittered_timers.yaml", f"jitter_{n}", *words, "--seed", n) for n in "12"]
        code, _, err = self.gate(*jittered)
        self.assertEqual(code, 2)
        self.assertIn("the gate needs 3 repetitions", err)
        phases = "--executors default,rm-ro --repetitions 3 --duration 2 --phases".split()
        runs = [self.field("autoware", f"of_{n}", *phases, self.simulate(seed=n)) for n in (1, 11)]
        self.assertIn("independent repetitions", self.gate(*runs)[1])

    def test_runs_of_other_lengths_are_no_pair(self) -> None:
        code, out, _ = self.gate(self.simulate(), self.simulate(more=("--warm-up=1",)))
        self.assertIn("independent repetitions", out)
        self.assertEqual(code, 0, out)

    def test_raises_no_warning(self) -> None:
        words = ["diff", self.simulate(), self.simulate(load=84), "--gate", "--across-loads"]
        command = [sys.executable, "-W", "error", "-I", "-B", str(BENCH), *words]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stderr), (1, ""))


class Reports(unittest.TestCase):
    def test_reports(self) -> None:
        generator = np.random.default_rng(4)
        judgements = judge(build(generator), build(generator, slower="rm-ro", by=1.5), ({}, {}))
        root = ElementTree.fromstring(junit(judgements).encode())
        self.assertEqual(root[0].attrib["tests"], "12")
        failed = [case.attrib["classname"] for case in root[0] if len(case)]
        self.assertEqual(set(failed), {"hot path autoware live 80 % rm-ro"})
        lines = markdown(judgements, "old", "new").splitlines()
        self.assertIn("3 of 12 measures became worse", lines[0])
        self.assertIn("WORSE", lines[6])
        self.assertRegex(lines[6], r"\+[45]\d\.\d % \| \[\+")
