"""Statistics of campaigns, against closed forms, scipy and enumeration."""

import math
import unittest

import numpy as np
from scipy import stats

from sls.campaign.statistics import (calc_medians, calc_paired_difference, calc_quantiles, calc_share_interval,
                                     calc_sign_p, calc_wilson_interval, find_interval_rank)


class WilsonTest(unittest.TestCase):
    def test_it_agrees_with_scipy(self):
        for count, total, level in ((0, 10, 0.95), (10, 10, 0.95), (3, 17, 0.9), (60, 200, 0.99)):
            theirs = stats.binomtest(count, total).proportion_ci(level, "wilson")
            np.testing.assert_allclose(calc_wilson_interval(count, total, level), theirs,
                                       atol=1e-12)

    def test_the_ends_are_exact_where_nothing_or_everything_counts(self):
        self.assertEqual(calc_wilson_interval(0, 50)[0], 0.0)
        self.assertEqual(calc_wilson_interval(50, 50)[1], 1.0)
        self.assertEqual(calc_wilson_interval(0, 0), (0.0, 1.0))

    def test_impossible_counts_are_refused(self):
        for count, total in ((-1, 3), (4, 3)):
            with self.assertRaisesRegex(ValueError, f"from 0 to 3, got {count}"):
                calc_wilson_interval(count, total)


class DrawsTest(unittest.TestCase):
    def test_a_run_of_each_draw_is_wilsons_interval(self):
        self.assertEqual(calc_share_interval(np.arange(40) < 7, np.arange(40)), calc_wilson_interval(7, 40))

    def test_runs_that_follow_their_draw_know_no_more_than_the_draws(self):
        lost = np.repeat(np.arange(50) < 15, 20)  # all 20 runs of a draw are lost, or none
        low, high = calc_share_interval(lost, np.repeat(np.arange(50), 20))
        ours, theirs = high - low, np.subtract(*calc_wilson_interval(15, 50)[::-1])
        self.assertTrue(1.0 < ours / theirs < 1.05, ours / theirs)  # t of 49 degrees is 1.025 z
        self.assertEqual(calc_share_interval(np.zeros(1000), np.repeat(np.arange(50), 20)),
                         calc_wilson_interval(0, 50))
        self.assertEqual(calc_share_interval(np.arange(20) < 3, np.zeros(20)), (0.0, 1.0))

    def test_it_covers_the_share_of_draws_with_runs_in_common(self):
        """300 campaigns of 40 draws; the share lost differs from draw to draw with a beta distribution."""
        random, covered, naive = np.random.default_rng(5), 0, 0
        draw = np.repeat(np.arange(40), 25)
        for _ in range(300):
            lost = random.random(1000) < np.repeat(random.beta(0.6, 1.4, 40), 25)  # its mean is 0.3
            low, high = calc_share_interval(lost, draw)
            covered += low <= 0.3 <= high
            low, high = calc_wilson_interval(int(lost.sum()), 1000)
            naive += low <= 0.3 <= high
        # Five standard deviations below 95 % of 300.
        self.assertGreater(covered / 300, 0.95 - 5 * math.sqrt(0.95 * 0.05 / 300))
        self.assertLess(naive / 300, 0.8)

    def test_medians_of_groups_agree_with_numpy(self):
        random = np.random.default_rng(2)
        values, group = random.normal(size=101), random.integers(0, 9, 101)
        np.testing.assert_allclose(calc_medians(values, group),
                                   [np.median(values[group == place]) for place in range(9)], rtol=1e-15)


class DistributionTest(unittest.TestCase):
    def test_quantiles_agree_with_numpy(self):
        values = np.random.default_rng(1).normal(size=137)
        shares = (0.0, 0.05, 0.5, 0.9, 1.0)
        np.testing.assert_allclose(calc_quantiles(values, shares), np.quantile(values, shares),
                                   rtol=0, atol=1e-15)

    def test_infinite_values_count_as_values(self):
        values = np.array([1.0, 2.0, np.inf, np.inf, np.nan])
        np.testing.assert_array_equal(calc_quantiles(values, (0.0, 0.5, 0.9)), [1, np.inf, np.inf])
        self.assertTrue(np.all(np.isnan(calc_quantiles(np.array([]), (0.1, 0.5)))))


class PairedTest(unittest.TestCase):
    def test_mcnemars_test_agrees_with_scipys_binomial_test(self):
        for one, other in ((0, 5), (3, 12), (40, 41), (1000, 1200)):
            self.assertAlmostEqual(calc_sign_p(one, other),
                                   stats.binomtest(one, one + other, 0.5).pvalue, delta=1e-12)
        self.assertEqual(calc_sign_p(0, 0), 1.0)

    def test_the_interval_of_the_median_covers_at_least_its_level(self):
        for n in range(1, 200):
            rank = find_interval_rank(n)
            # 2^n P(B < k) of n fair coins, a whole number.
            below = sum(math.comb(n, i) for i in range(rank))
            self.assertLessEqual(40 * below, 2**n, n)
            self.assertGreater(40 * (below + math.comb(n, rank)), 2**n, n)  # k + 1 would be too large
        self.assertEqual([find_interval_rank(n) for n in (5, 6, 20)], [0, 1, 6])  # from tables of the sign test

    def test_differences_are_taken_pair_by_pair(self):
        a = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, np.nan, np.inf])
        b = np.array([2.0, 4.0, 6.0, 8.0, 10.0, 6.0, 1.0, np.inf])
        paired = calc_paired_difference(a, b)
        self.assertEqual((paired.count, paired.median, paired.smaller, paired.larger),
                         (6, 2.5, 0, 5))
        self.assertEqual((paired.low, paired.high), (0.0, 5.0))
        self.assertAlmostEqual(paired.p, 2 / 32)
        few = calc_paired_difference(a[:3], b[:3])
        self.assertEqual((few.low, few.high), (-np.inf, np.inf))
        none = calc_paired_difference(a[6:], b[6:])
        self.assertEqual((none.count, none.p), (0, 1.0))
