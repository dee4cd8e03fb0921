# SPDX-License-Identifier: Apache-2.0
"""Statistics against what is known by other means; and the generated numbers of a README against its results."""

import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from inference import (
    PERCENTILES,
    RESAMPLES,
    Samples,
    difference,
    rank_test,
    ratio,
    weighted_quantiles,
)  # noqa: E402

ROOT = HERE.parents[1]


def normal(mean, repetitions=5, size=200, seed=1):
    generator = np.random.default_rng(seed)
    return [generator.normal(mean, 1, size) for _ in range(repetitions)]


class Quantiles(unittest.TestCase):
    def test_weighted_ones_are_those_of_repeated_values(self):
        generator = np.random.default_rng(3)
        values, weights = np.sort(generator.normal(size=57)), generator.integers(0, 4, 57)
        expected = np.quantile(np.repeat(values, weights), PERCENTILES)
        np.testing.assert_allclose(weighted_quantiles(values, weights), expected)

    def test_interval_covers_the_estimate_and_is_the_same_every_time(self):
        first, second = (Samples(normal(10)).estimate(0.5) for _ in range(2))
        self.assertEqual(first, second)
        self.assertLess(first.low, first.value)
        self.assertGreater(first.high, first.value)

    def test_intervals_cover_the_true_median_about_as_often_as_they_say(self):
        covered = sum(
            not Samples(normal(10, repetitions=20, size=50, seed=s)).estimate(0.5).excludes(10)
            for s in range(60)
        )
        self.assertGreater(covered, 50)

    def test_repetitions_that_differ_widen_the_interval(self):
        alike, apart = Samples(normal(10)), Samples([r + k for k, r in enumerate(normal(10))])
        width = lambda s: s.estimate(0.5).high - s.estimate(0.5).low  # noqa: E731
        self.assertGreater(width(apart), 4 * width(alike))

    def test_one_repetition_is_resampled_in_blocks_unless_it_is_exact_or_short(self):
        one = normal(10, repetitions=1)
        self.assertTrue(Samples(one).estimate(0.5).has_interval)
        self.assertFalse(Samples(one, exact=True).estimate(0.5).has_interval)
        self.assertFalse(Samples([one[0][:10]]).estimate(0.5).has_interval)

    def test_one_disturbed_repetition_does_not_move_the_middle_worst_case(self):
        self.assertEqual(Samples([[3, 5], [1, 9, 2], [4], [6, 2], [800, 1]]).middle_worst(), 6)

    def test_resamples_are_drawn(self):
        self.assertEqual(Samples(normal(10)).resampled().shape, (RESAMPLES, len(PERCENTILES)))


class Comparisons(unittest.TestCase):
    def test_ratio_and_difference_of_separate_groups_leave_out_nothing_changed(self):
        low, high = Samples(normal(10)), Samples(normal(20, seed=2))
        self.assertTrue(ratio(high, low, 0.5).excludes(1))
        self.assertTrue(difference(high, low, 0.5).excludes(0))
        self.assertAlmostEqual(ratio(high, low, 0.5).value, 2, delta=0.05)

    def test_equal_groups_are_within_noise(self):
        self.assertFalse(difference(Samples(normal(10)), Samples(normal(10, seed=2)), 0.5).excludes(0))

    def test_rank_test_of_separate_groups(self):
        test = rank_test(Samples(normal(10)), Samples(normal(20, seed=2)))
        self.assertEqual(test.cliffs_delta.value, 1)
        self.assertEqual(test.superiority, 1)
        self.assertEqual(test.magnitude, "large")
        self.assertLess(test.p_value, 1e-6)

    def test_rank_test_of_equal_groups_and_ties(self):
        test = rank_test(Samples(normal(10)), Samples(normal(10, seed=2)))
        self.assertEqual(test.magnitude, "negligible")
        self.assertFalse(test.cliffs_delta.excludes(0))
        tied = rank_test(Samples([[1.0, 1.0]], exact=True), Samples([[1.0, 1.0, 1.0]], exact=True))
        self.assertEqual(tied.cliffs_delta.value, 0)

    def test_the_worse_group_has_a_negative_delta(self):
        self.assertEqual(rank_test(Samples(normal(20)), Samples(normal(10, seed=2))).cliffs_delta.value, -1)


class Numbers(unittest.TestCase):
    def test_a_number_that_does_not_agree_is_found_and_mended(self):
        with tempfile.TemporaryDirectory() as name:
            root = Path(name)
            shutil.copytree(
                ROOT / "results",
                root / "results",
                ignore=shutil.ignore_patterns("traces", "*.svg", "*.png", "*.gz"),
            )
            shutil.copy2(ROOT / "README.md", root)
            call = lambda *words: subprocess.run(  # noqa: E731
                [sys.executable, "-B", str(ROOT / "launch_scripts/check_numbers.py"), "--root", name, *words],
                capture_output=True,
                text=True,
                check=False,
            )
            readme = root / "README.md"
            self.assertEqual(call("--check").returncode, 0)
            before = readme.read_text(encoding="utf-8")
            readme.write_text(before.replace("| `default` | 240 |", "| `default` | 241 |"), encoding="utf-8")
            found = call("--check")
            self.assertEqual(found.returncode, 1)
            self.assertIn("hot_path_table", found.stderr)
            self.assertEqual(call().returncode, 0)
            self.assertEqual(readme.read_text(encoding="utf-8"), before)
            readme.write_text(before.replace("<!-- generated: bench_bars -->", ""), encoding="utf-8")
            self.assertIn("bench_bars", call("--check").stderr)
            readme.write_text(before, encoding="utf-8")
            page = root / "results/paper/report.md"
            page.write_text(
                page.read_text(encoding="utf-8").replace("worst cases", "best cases"), encoding="utf-8"
            )
            found = call("--check")
            self.assertEqual(found.returncode, 1)
            self.assertIn("slowdown", found.stderr)


if __name__ == "__main__":
    unittest.main()
