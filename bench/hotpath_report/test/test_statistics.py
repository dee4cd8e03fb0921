# SPDX-License-Identifier: Apache-2.0
"""The client of the C++ statistics, which analysis/test/statistics_test.cpp tests."""

import unittest
from typing import Any

import numpy as np

from hotpath_report.statistics import PERCENTILES, Samples, fit_line, rank_test, ratio


def normal(mean: float, repetitions: int = 5, seed: int = 1) -> list[Any]:
    generator = np.random.default_rng(seed)
    return [generator.normal(mean, 1, 200) for _ in range(repetitions)]


class Quantiles(unittest.TestCase):
    def test_quantiles_and_the_mean_equal_those_of_numpy(self) -> None:
        generator = np.random.default_rng(3)
        values = generator.normal(size=57)
        found = [Samples([values[:20], values[20:]]).quantile(p) for p in PERCENTILES]
        np.testing.assert_allclose(found, np.quantile(values, list(PERCENTILES)))

    def test_one_repetition_is_resampled_in_blocks_unless_it_is_exact_or_short(self) -> None:
        one = normal(10, repetitions=1)
        self.assertTrue(Samples(one).estimate(0.5).has_interval)
        self.assertFalse(Samples(one, exact=True).estimate(0.5).has_interval)
        self.assertFalse(Samples([one[0][:10]]).estimate(0.5).has_interval)

    def test_one_disturbed_repetition_does_not_move_the_middle_worst_case(self) -> None:
        self.assertEqual(Samples([[3, 5], [1, 9, 2], [4], [6, 2], [800, 1]]).middle_worst(), 6)


class Comparisons(unittest.TestCase):
    def test_intervals_of_separate_groups_exclude_no_change(self) -> None:
        low, high = Samples(normal(10)), Samples(normal(20, seed=2))
        self.assertGreater(ratio(high, low, 0.5).low, 1)
        self.assertAlmostEqual(ratio(high, low, 0.5).value, 2, delta=0.05)

    def test_a_line_follows_the_weights(self) -> None:
        np.testing.assert_allclose(fit_line((1, 2, 3), (1, 2, 9), (0, 1, 1)), (7, -12))

    def test_rank_test_of_separate_groups(self) -> None:
        low, high = Samples(normal(10)), Samples(normal(20, seed=2))
        test = rank_test(low, high)
        self.assertEqual((test.cliffs_delta.value, test.magnitude), (1, "large"))
        self.assertLess(test.p_value, 1e-6)
        self.assertEqual(rank_test(high, low).cliffs_delta.value, -1)
