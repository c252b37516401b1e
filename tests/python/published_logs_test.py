"""Reads the published formats from small files, which this test writes with independent formulas."""

import math

import support
import numpy as np

from sls.input_error import InputError
from sls.published_logs import load_log

ALPHA, BETA = 0.3, -0.2  # rad, true ones
ROD = (math.sin(BETA), -math.sin(ALPHA) * math.cos(BETA), math.cos(ALPHA) * math.cos(BETA))
QUAD = (1.0, 2.0, -3.0)
REFERENCE = (0.5, 0.25, -2.0)
VELOCITY = (0.1, 0.2, 0.3)
FORCE = (1.5, -2.5, -16.0)
HEADINGS = "Time,Des_Pos_X,Des_Pos_Y,Des_Pos_Z,X,Y,Z,Alpha,Beta"


def join(*numbers):
    return ",".join(f"{number!r}" for number in numbers)


class PublishedLogsTest(support.FolderTest):
    def expect_flight(self, flight, length, reference=REFERENCE, force=FORCE):
        np.testing.assert_array_equal(flight.p_WQ[0], QUAD)
        load = [q + length * r for q, r in zip(QUAD, ROD)]
        np.testing.assert_allclose(flight.p_WL[0], load, rtol=0, atol=1e-15)
        np.testing.assert_array_equal(flight.p_WL_ref[0], reference)
        np.testing.assert_array_equal(flight.f_Q_W[0], force)
        self.assertEqual((flight.alpha[0], flight.beta[0]), (ALPHA, BETA))

    def test_a_matlab_set_point_log_holds_the_quadrotor_where_its_headings_say_desired(self):
        load = [q + r for q, r in zip(QUAD, ROD)]
        file = self.write("a.csv", f"{HEADINGS}\n{join(0, *QUAD, *load, ALPHA, BETA)}\n"
                                   f"{join(0.02, *QUAD, *load, ALPHA, BETA)}")
        flight = load_log(file, "a")
        self.assertEqual(list(flight.time_s), [0, 0.02])
        self.expect_flight(flight, 1.0, [math.nan] * 3, [math.nan] * 3)

    def test_a_matlab_trajectory_log_holds_its_reference(self):
        load = [q + r for q, r in zip(QUAD, ROD)]
        file = self.write("a.csv", "t,rx,ry,rz,qx,qy,qz,lx,ly,lz,a,b\n"
                                   f"{join(0, *REFERENCE, *QUAD, *load, ALPHA, BETA)}\n")
        self.expect_flight(load_log(file, "a"), 1.0, REFERENCE, [math.nan] * 3)

    def gazebo_row(self, time_s=7.0):
        # As in the published file: the sign of alpha is wrong.
        return join(time_s, *REFERENCE, *QUAD, 0.01, 0.02, 0.03, *VELOCITY, -ALPHA, BETA, 0.4, 0.5,
                    *FORCE)

    def test_a_gazebo_log_has_alpha_with_the_wrong_sign_and_a_rod_of_1_1_metres(self):
        file = self.write("a.csv", f"{self.gazebo_row()}\n{self.gazebo_row(7.5)}\n")
        flight = load_log(file, "a")
        self.expect_flight(flight, 1.1)
        self.assertEqual(list(flight.time_s), [0.0, 0.5])
        # With the sign of the file the load would be on the other side of the quadrotor.
        self.assertLess(flight.p_WL[0, 1], flight.p_WQ[0, 1])

    def test_a_px4_log_has_no_attitude_and_a_rod_of_1_metre_or_another(self):
        row = join(0, *REFERENCE, *QUAD, *VELOCITY, ALPHA, BETA, 0.4, 0.5, *FORCE)
        file = self.write("a.log", row.replace(",", "\t") + "\n")
        self.expect_flight(load_log(file, "a"), 1.0)
        self.expect_flight(load_log(file, "a", rod_length_m=0.7), 0.7)

    def test_the_format_can_be_given(self):
        file = self.write("a.csv", self.gazebo_row() + "\n")
        self.expect_flight(load_log(file, "a", "gazebo"), 1.1)
        with self.assertRaisesRegex(InputError, r"a.csv:1: expected 17 columns \(px4\), got 20"):
            load_log(file, "a", "px4")

    def test_defects_are_named_with_file_line_and_what_was_expected(self):
        row = self.gazebo_row()
        cases = {
            "": "a.csv:1: expected a log, got an empty file",
            "1,2,3\n": r"a.csv:1: expected, without a header, 20 \(gazebo\), 17 \(px4\) columns, "
                       "got 3",
            "a,b,c\n": r"with a header, 9 \(matlab-setpoint\), 12 \(matlab-trajectory\) columns, "
                       "got 3",
            HEADINGS + "\n": "a.csv:2: expected rows, got none",
            f"{row}\n{row}\n{row[:-12]}\n": "a.csv:3: expected 20 columns, got",
            f"{row}\n{row.replace('7.0', 'seven')}\n":
                "a.csv:2: time: expected a number, got 'seven'",
            f"{row}\n{row},9\n": "a.csv:2: expected 20 columns, got 21",
        }
        for text, message in cases.items():
            with self.assertRaisesRegex(InputError, message):
                load_log(self.write("a.csv", text), "a")

    def test_a_file_that_is_no_text_or_not_there_is_refused(self):
        binary = self.folder / "b.csv"
        binary.write_bytes(b"1,2,\xff\xfe\n")
        with self.assertRaisesRegex(InputError, "b.csv: expected text, got byte 0xff at 4"):
            load_log(binary, "b")
        with self.assertRaisesRegex(InputError, "nowhere.csv: expected a file, got: No such file"):
            load_log(self.folder / "nowhere.csv", "c")
