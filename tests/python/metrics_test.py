"""Metrics against closed forms."""

import math
import unittest

import support
import numpy as np

from sls import metrics
from sls.trajectory import Trajectory, Stage
from sls.published_logs import calc_rod

PERIOD_S = 1e-3


def make_flight(time_s, p_WL, reference, stages):
    nothing = np.full(len(time_s), np.nan)
    return Trajectory("flight", time_s, p_WL, p_WL, reference, nothing, nothing,
                  np.full((len(time_s), 3), np.nan), stages, period_s=time_s[1] - time_s[0])


def list_laps(flight):
    """Label, first and last row of the laps of the first stage."""
    return [(lap.label, lap.rows[0], lap.rows[-1])
            for lap in metrics.split_laps(flight, flight.stages[0])]


def respond(time_s, damping, frequency):
    """Step response of frequency² / (s² + 2 damping frequency s + frequency²), damping < 1."""
    damped = frequency * math.sqrt(1 - damping**2)
    decay = np.exp(-damping * frequency * time_s)
    return 1 - decay * (np.cos(damped * time_s)
                        + damping * frequency / damped * np.sin(damped * time_s))


class StepMetricsTest(unittest.TestCase):
    time_s = np.arange(0, 20, PERIOD_S)

    def test_overshoot_of_a_second_order_response_is_known(self):
        for damping in (0.1, 0.3, 0.5, 0.7, 0.9):
            response = 3.0 - 5.0 * respond(self.time_s, damping, 2.0)
            expected = math.exp(-math.pi * damping / math.sqrt(1 - damping**2))
            # The response is flat around its peak: the nearest sample is at most (ω T)² / 8 below the peak.
            self.assertAlmostEqual(metrics.calc_overshoot(response, -2.0), expected, delta=1e-6)

    def test_a_response_that_only_approaches_its_target_has_no_overshoot(self):
        self.assertEqual(metrics.calc_overshoot(1 - np.exp(-self.time_s), 1.0), 0.0)

    def test_settling_time_of_a_first_order_response_is_known(self):
        for constant_s in (0.2, 1.0, 3.0):
            response = -4.0 + 7.0 * np.exp(-self.time_s / constant_s)
            settled = metrics.calc_settling_time(self.time_s, response, -4.0)
            # The error is 2 % after ln 50 time constants; the next sample is at most a period later.
            self.assertGreaterEqual(settled, constant_s * math.log(50))
            self.assertLessEqual(settled, constant_s * math.log(50) + PERIOD_S)

    def test_settling_time_of_a_critically_damped_response_is_known(self):
        frequency = 2.0
        response = 1 - (1 + frequency * self.time_s) * np.exp(-frequency * self.time_s)
        low, high = 0.0, 20.0  # bisection of (1 + x) exp(-x) = 0.02, whose left side falls with x
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if (1 + middle) * math.exp(-middle) > 0.02 else (low, middle)
        settled = metrics.calc_settling_time(self.time_s, response, 1.0)
        self.assertAlmostEqual(settled, high / frequency, delta=PERIOD_S)

    def test_settling_time_waits_for_the_last_swing_out_of_the_band(self):
        # An undamped swing of 3 % for 10 s, then rest: the swing leaves the band of 2 % at each peak.
        response = np.where(self.time_s < 10, 1 + 0.03 * np.sin(2 * np.pi * self.time_s), 1.0)
        response[0] = 0.0
        settled = metrics.calc_settling_time(self.time_s, response, 1.0)
        last_crossing_s = 10 - math.asin(2 / 3) / (2 * math.pi)
        self.assertAlmostEqual(settled, last_crossing_s, delta=PERIOD_S)

    def test_settling_time_is_infinite_without_settling_and_nan_without_a_step(self):
        self.assertEqual(metrics.calc_settling_time(self.time_s, 0.1 * self.time_s, 1.0), math.inf)
        still = np.full_like(self.time_s, 0.995)
        self.assertTrue(math.isnan(metrics.calc_settling_time(self.time_s, still, 1.0)))
        self.assertTrue(math.isnan(metrics.calc_overshoot(still, 1.0)))

    def test_settling_time_counts_from_the_first_row(self):
        late = self.time_s + 100.0
        response = 1 - np.exp(-self.time_s)
        self.assertAlmostEqual(metrics.calc_settling_time(late, response, 1.0), math.log(50),
                               delta=1.01 * PERIOD_S)

    def test_steady_state_error_is_the_mean_of_the_last_tenth(self):
        # The last 2 s hold 0.25 and whole periods of a sine. Earlier values do not count.
        errors = np.where(self.time_s < 17.9, 9.0, 0.25 + np.sin(np.pi * self.time_s))
        steady = metrics.calc_steady_state_error(self.time_s, np.column_stack([errors, -errors]))
        np.testing.assert_allclose(steady, [0.25, -0.25], atol=1e-3)


class StageMetricsTest(unittest.TestCase):
    def test_rms_of_a_sine_is_its_amplitude_over_root_two(self):
        phase = 2 * np.pi * np.arange(1000) / 1000
        values = np.column_stack([3 * np.sin(phase), np.cos(phase), np.full(1000, -2.0)])
        np.testing.assert_allclose(metrics.calc_rms(values),
                                   [3 / math.sqrt(2), 1 / math.sqrt(2), 2], rtol=1e-12)
        np.testing.assert_allclose(metrics.calc_max(values), [3, 1, 2], rtol=1e-12)

    def test_laps_are_those_of_the_recorder(self):
        # Two laps of 16 s at 4 ms, from 0.004 s · 100 on. The last row belongs to the second lap.
        time_s = np.arange(100, 8101) * 0.004
        zeros = np.zeros((8001, 3))
        flight = make_flight(time_s, zeros, zeros, (Stage(0, "eight", 0, 8001, 0.4, 32, 16),))
        self.assertEqual(list_laps(flight), [("lap 1", 0, 3999), ("lap 2", 4000, 8000)])

    def test_a_lap_that_the_rows_do_not_span_is_marked(self):
        def list_of(first, last, duration_s):
            time_s = np.arange(first, last + 1) * 0.004
            zeros = np.zeros((len(time_s), 3))
            return list_laps(make_flight(time_s, zeros, zeros, (
                Stage(0, "eight", 0, len(time_s), 0, duration_s, 16),)))

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
        zeros = np.zeros((3000, 3))
        for lap_s, count in ((0.004, 1000), (1e-9, 1)):
            flight = make_flight(time_s, zeros, zeros, (Stage(0, "eight", 0, 3000, 0, 12, lap_s),))
            self.assertEqual(len(list_laps(flight)), count)

    def test_a_step_whose_beginning_was_not_recorded_is_none(self):
        time_s = np.arange(100, 300) * 0.1
        zeros = np.zeros((200, 3))
        for start_s, is_step in ((10.0, True), (9.9, False)):
            flight = make_flight(time_s, zeros, zeros, (Stage(0, "hold", 0, 200, start_s),))
            found, = metrics.calc_stage_metrics(flight)
            self.assertEqual(found.step is not None, is_step)

    def test_a_stage_that_another_follows_keeps_its_last_row_in_its_lap(self):
        time_s = np.arange(0, 301) * 0.01
        zeros = np.zeros((301, 3))
        flight = make_flight(time_s, zeros, zeros, (Stage(0, "eight", 0, 200, 0, 2, 1),
                                                    Stage(1, "hold", 200, 301, 2)))
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
        p_WL = np.column_stack([respond(time_s, 0.5, 2.0), time_s * 0, time_s * 0])
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
        for f_Q_W, (roll, pitch) in zip(force, flight.calc_attitude()):
            about_x = np.array([[1, 0, 0], [0, math.cos(roll), -math.sin(roll)],
                                [0, math.sin(roll), math.cos(roll)]])
            about_y = np.array([[math.cos(pitch), 0, math.sin(pitch)], [0, 1, 0],
                                [-math.sin(pitch), 0, math.cos(pitch)]])
            realised = -np.linalg.norm(f_Q_W) * about_y @ about_x @ [0, 0, 1]
            np.testing.assert_allclose(realised, f_Q_W, rtol=0, atol=1e-12)

    def test_a_hanging_rod_points_down_and_every_rod_has_length_one(self):
        np.testing.assert_array_equal(calc_rod(np.zeros(1), np.zeros(1)), [[0, 0, 1]])
        rods = calc_rod(np.linspace(-1, 1, 9), np.linspace(1, -1, 9))
        np.testing.assert_allclose(np.linalg.norm(rods, axis=1), 1, atol=1e-15)


if __name__ == "__main__":
    unittest.main()
