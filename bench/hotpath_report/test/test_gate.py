# SPDX-License-Identifier: Apache-2.0
"""The gate against made-up repetitions: how often it fires, what it refuses, what its reports say."""

import unittest
from xml.etree import ElementTree

import numpy as np

from hotpath_report.errors import InputError
from hotpath_report.pages.judgement import Judgement, holm, judge
from hotpath_report.pages.gate import junit, markdown
from hotpath_report.statistics import Samples

EXECUTORS = ("default", "static", "events-ro", "rm-ro")
NOISE = 0.02  # of a repetition's median


def build(generator, repetitions=8, slower=None, by=1.1):
    """Samples of each executor: repetitions that differ by noise."""
    made = {}
    for executor in EXECUTORS:
        factor = by if executor == slower else 1
        of = [
            20 * factor * np.exp(generator.normal(0, NOISE)) * generator.uniform(0.8, 1.4, 100)
            for _ in range(repetitions)
        ]
        made["hot path", "autoware", "live", "80 %", executor, ""] = Samples(of)
    return made


def losses(generator, repetitions=8, mean=3.0):
    return {
        ("lost", "autoware", "live", "80 %", e, ""): list(generator.poisson(mean, repetitions))
        for e in EXECUTORS
    }


class Gate(unittest.TestCase):
    def judged(self, seed, slower=None, more_losses=0.0):
        generator = np.random.default_rng(seed)
        counts = losses(generator), losses(generator, mean=3.0 + more_losses)
        return judge(build(generator), build(generator, slower=slower), counts, intervals=False)

    def test_the_same_build_twice_does_not_fire(self):
        fired = sum(any(j.worse for j in self.judged(seed)) for seed in range(40))
        self.assertLessEqual(fired, 1)

    def test_ten_percent_in_one_executor_fires_and_no_other(self):
        found = 0
        for seed in range(40):
            worse = [j.what for j in self.judged(seed, slower="static") if j.worse and j.measure == "p50"]
            found += worse == ["hot path autoware live 80 % static"]
        self.assertGreaterEqual(found, 38)

    def test_losses_fire(self):
        worse = {j.measure for j in self.judged(1, more_losses=20) if j.worse}
        self.assertEqual(worse, {"lost jobs and samples"})

    def test_a_faster_build_does_not_fire(self):
        generator = np.random.default_rng(1)
        fast = build(generator, slower="static", by=0.5)
        self.assertFalse(any(j.worse for j in judge(build(generator), fast, ({}, {}))))

    def test_exact_runs_differ_by_any_amount(self):
        key = ("hot path", "autoware", "simulated", "80 %", "rm-ro", "")
        old, new = ({key: Samples([[10.0, value]], exact=True)} for value in (11.0, 11.001))
        self.assertEqual([j.worse for j in judge(old, new, ({}, {}))], [True, True])
        self.assertFalse(any(j.worse for j in judge(old, old, ({}, {}))))

    def test_too_few_repetitions_are_refused(self):
        generator = np.random.default_rng(1)
        with self.assertRaisesRegex(InputError, "needs 3 repetitions on each side, and one has 2"):
            judge(build(generator), build(generator, repetitions=2), ({}, {}))

    def test_holms_example(self):
        judgements = [Judgement("", "p50", 1, 1, 1, None, p, True) for p in (0.01, 0.04, 0.03, 0.005)]
        holm(judgements)
        np.testing.assert_allclose([j.adjusted for j in judgements], [0.03, 0.06, 0.06, 0.02])

    def test_reports(self):
        generator = np.random.default_rng(4)
        judgements = judge(build(generator), build(generator, slower="rm-ro", by=1.5), ({}, {}))
        root = ElementTree.fromstring(junit(judgements).encode())
        self.assertEqual(root[0].attrib["tests"], "8")
        failed = [case.attrib["classname"] for case in root[0] if len(case)]
        self.assertEqual(set(failed), {"hot path autoware live 80 % rm-ro"})
        lines = markdown(judgements, "old", "new").splitlines()
        self.assertIn("2 of 8 measures became worse", lines[0])
        self.assertIn("WORSE", lines[6])
        self.assertRegex(lines[6], r"\+[45]\d\.\d % \| \[\+")


if __name__ == "__main__":
    unittest.main()
