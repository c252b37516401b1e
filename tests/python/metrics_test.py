"""Stages, laps, commanded attitudes. tests/common/model/measures_test.cpp tests the formulas."""

import math
import unittest

import numpy as np
from scipy.spatial.transform import Rotation

from sls import metrics
from sls.trajectory import Trajectory, Stage
from sls.published_logs import calc_rod


def make_flight(time_s, p_WL, reference, stages):
    nothing = np.full(len(time_s), np.nan)
    return Trajectory("flight", time_s, p_WL, p_WL, reference, nothing, nothing,
                  np.full((len(time_s), 3), np.nan), stages, period_s=time_s[1] - time_s[0])


def make_still_flight(time_s, *stages):
    zeros = np.zeros((len(time_s), 3))
    return make_flight(time_s, zeros, zeros, stages)


def list_laps(flight):
    """Label, first and last row of the laps of the first stage."""
    return [(lap.label, lap.rows[0], lap.rows[-1])
            for lap in metrics.split_laps(flight, flight.stages[0])]


class StageMetricsTest(unittest.TestCase):
    def test_laps_are_those_of_the_recorder(self):
        # Two laps of 16 s at 4 ms, from 0.004 s · 100 on. The last row belongs to the second lap.
        time_s = np.arange(100, 8101) * 0.004
        flight = make_still_flight(time_s, Stage(0, "eight", 0, 8001, 0.4, 32, 16))
        self.assertEqual(list_laps(flight), [("lap 1", 0, 3999), ("lap 2", 4000, 8000)])

    def test_a_lap_that_the_rows_do_not_span_is_marked(self):
        def list_of(first, last, duration_s):
            time_s = np.arange(first, last + 1) * 0.004
            return list_laps(make_still_flight(time_s, Stage(0, "eight", 0, len(time_s), 0, duration_s, 16)))

        self.assertEqual(list_of(0, 6000, 24),
                         [("lap 1", 0, 3999), ("lap 2 (part)", 4000, 6000)])
        self.assertEqual(list_of(0, 3999, 24), [("lap 1", 0, 3999)])
        self.assertEqual(list_of(0, 3998, 24), [("lap 1 (part)", 0, 3998)])
        # A recorder that joined 20 s after the stage began, and recorders that joined at the start of a lap.
        self.assertEqual(list_of(5000, 12000, 48),
                         [("lap 2 (part)", 0, 2999), ("lap 3", 3000, 7000)])
        self.assertEqual(list_of(4000, 6000, 24), [("lap 2 (part)", 0, 2000)])
        self.assertEqual(list_of(4000, 8000, 32), [("lap 2", 0, 4000)])

    def test_laps_shorter_than_a_period_make_no_endless_table(self):
        time_s = np.arange(0, 3000) * 0.004
        for lap_s, count in ((0.004, 1000), (1e-9, 1)):
            flight = make_still_flight(time_s, Stage(0, "eight", 0, 3000, 0, 12, lap_s))
            self.assertEqual(len(list_laps(flight)), count)

    def test_a_step_whose_beginning_was_not_recorded_is_none(self):
        time_s = np.arange(100, 300) * 0.1
        for start_s, is_step in ((10.0, True), (9.9, False)):
            flight = make_still_flight(time_s, Stage(0, "hold", 0, 200, start_s))
            found, = metrics.calc_stage_metrics(flight)
            self.assertEqual(found.step is not None, is_step)

    def test_a_stage_that_another_follows_keeps_its_last_row_in_its_lap(self):
        time_s = np.arange(0, 301) * 0.01
        flight = make_still_flight(time_s, Stage(0, "eight", 0, 200, 0, 2, 1), Stage(1, "hold", 200, 301, 2))
        self.assertEqual(list_laps(flight), [("lap 1", 0, 99), ("lap 2", 100, 199)])
        labels = [found.label for found in metrics.calc_stage_metrics(flight)]
        self.assertEqual(labels, ["0 eight", "lap 1", "lap 2", "1 hold"])

    def test_rows_without_a_reference_do_not_count(self):
        reference = np.zeros((100, 3))
        reference[:40] = np.nan
        p_WL = np.ones((100, 3))
        p_WL[:40] = 1000.0
        flight = make_flight(np.arange(100) * 0.1, p_WL, reference, (Stage(0, "hold", 0, 100, 0),))
        found, = metrics.calc_stage_metrics(flight)
        np.testing.assert_array_equal(found.rms_m, [1, 1, 1])
        self.assertAlmostEqual(found.from_s, 4.0)

    def test_only_stages_with_a_constant_reference_are_steps(self):
        time_s = np.arange(0, 20, 0.01)
        p_WL = np.column_stack([1.0 - np.exp(-time_s), time_s * 0, time_s * 0])
        still = np.tile([1.0, 0.0, 0.0], (2000, 1))
        moving = still + np.column_stack([1e-9 * time_s, 0 * time_s, 0 * time_s])
        for reference, is_step in ((still, True), (moving, False)):
            flight = make_flight(time_s, p_WL, reference, (Stage(0, "s", 0, 2000, 0),))
            found, = metrics.calc_stage_metrics(flight)
            self.assertEqual(found.step is not None, is_step)
        self.assertTrue(math.isnan(metrics.calc_over(
            make_flight(time_s, p_WL, still, ()), np.arange(2000), "").step.overshoot[1]))

    def test_the_commanded_attitude_realises_the_force(self):
        force = np.random.default_rng(1).normal(size=(50, 3)) + [0, 0, -12]
        nothing = np.zeros((50, 3))
        flight = Trajectory("f", np.arange(50.0), nothing, nothing, nothing, nothing[:, 0],
                        nothing[:, 0], force)
        down = Rotation.from_euler("YX", flight.calc_attitude()[:, ::-1]).apply([0, 0, 1])
        np.testing.assert_allclose(-np.linalg.norm(force, axis=1)[:, None] * down, force, rtol=0, atol=1e-12)

    def test_a_hanging_rod_points_down_and_every_rod_has_length_one(self):
        np.testing.assert_array_equal(calc_rod(np.zeros(1), np.zeros(1)), [[0, 0, 1]])
        rods = calc_rod(np.linspace(-1, 1, 9), np.linspace(1, -1, 9))
        np.testing.assert_allclose(np.linalg.norm(rods, axis=1), 1, atol=1e-15)
