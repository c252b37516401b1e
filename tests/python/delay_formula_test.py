"""The linear formula, compared with the equations from which it is derived."""

import unittest

import numpy as np

from sls.delay_formula import (HorizontalChain, Lateness, calc_error_ratio,
                               calc_stability_limit)

QUAD_KG, LOAD_KG, ROD_M, GRAVITY = 1.5, 0.2, 1.25, 9.8
SWING_2 = (1 + LOAD_KG / QUAD_KG) * GRAVITY / ROD_M
GAINS = (5.4399, 9.7962, 8.4827, 3.1623)
CASES = (Lateness(0.05, 0.0), Lateness(0.0, 0.154), Lateness(0.08, 0.1))


def make_chain(gains):
    return HorizontalChain(*gains, swing_rad_s=SWING_2**0.5)


def solve_error_ratio(gains, late, s, rod_m=ROD_M):
    """The error ratio from Newton's equations of quadrotor and load, and the law. Unknowns: x_Q, y, F;
    y_r = 1."""
    swing_2 = (1 + LOAD_KG / QUAD_KG) * GRAVITY / rod_m
    feedback = sum(gain * s**power for power, gain in enumerate(gains))
    late_force = np.exp(-s * late.delay_s) / (1 + late.lag_s * s) * QUAD_KG * rod_m / GRAVITY
    matrix = [[QUAD_KG * s**2, LOAD_KG * s**2, -1],
              [-GRAVITY / rod_m, s**2 + GRAVITY / rod_m, 0],
              [0, late_force * (feedback - swing_2 * s**2), 1]]
    right = [0, 0, late_force * (s**4 + feedback)]
    return 1 - np.linalg.solve(np.array(matrix), np.array(right))[1]


def count_unstable_roots(gains, late):
    """Number of roots of the denominator in the right half plane, by the argument principle: its turns
    about 0 along the edge, up to |s| = 200. For larger |s| the term s⁴ dominates."""
    edge = np.concatenate([1j * np.linspace(-200, 200, 400001),
                           200 * np.exp(1j * np.linspace(np.pi / 2, -np.pi / 2, 40001))])
    transfer = np.exp(-edge * late.delay_s) / (1 + late.lag_s * edge)
    feedback = sum(gain * edge**power for power, gain in enumerate(gains))
    values = edge**4 + SWING_2 * edge**2 * (1 - transfer) + transfer * feedback
    angles = np.unwrap(np.angle(values / (edge + 1)**4))
    return round(abs(angles[-1] - angles[0]) / (2 * np.pi))


class DelayFormulaTest(unittest.TestCase):
    def test_a_force_in_time_makes_no_error(self):
        self.assertEqual(calc_error_ratio(make_chain(GAINS), Lateness(), 0.4j), 0)

    def test_the_error_is_that_of_the_equations_of_motion(self):
        for late in CASES:
            for s in (0.39j, 0.79j, 3j, 0.1 + 1j):
                np.testing.assert_allclose(calc_error_ratio(make_chain(GAINS), late, s),
                                           solve_error_ratio(GAINS, late, s), rtol=1e-10)

    def test_roots_enter_the_right_half_plane_at_the_stability_limit(self):
        for gains in (GAINS, GAINS[::-1]):
            for lag_s in (0.0, 0.154):
                limit = calc_stability_limit(make_chain(gains), lag_s)
                for delay_s, roots in ((0.0, 0), (limit - 5e-4, 0), (limit + 5e-4, 2)):
                    self.assertEqual(count_unstable_roots(gains, Lateness(delay_s, lag_s)), roots)
