"""The study flown again gives the committed page, and the numbers of its chapter on PX4 agree with its
flights. Takes minutes: `./sls test --slow`."""

import contextlib
import csv
import math
import pathlib
import tempfile
import unittest

import numpy as np
from places import launch

from delay_formula_test import GAINS, solve_error_ratio
from sls import study
from sls.delay_formula import Lateness

LAP_FROM_S, LAP_TO_S = 26.0, 42.0  # of px4_*: 10 s of holding, then two laps of 16 s


def read_rows(path, names, from_s=-math.inf, to_s=math.inf):
    with open(path) as file:
        return np.array([[float(row[name]) for name in names] for row in csv.DictReader(file)
                         if from_s <= float(row["sim_time_s"]) <= to_s])


def calc_lap_errors(folder, file, z_shift=0.0):
    """Errors of the second lap, with its first and last row, as in the page."""
    names = ("load_x_m", "load_y_m", "load_z_m")
    load = read_rows(folder / file, ("step", *names), LAP_FROM_S, LAP_TO_S)
    reference = read_rows(folder / "reference.csv", ("step", "ref_x_m", "ref_y_m", "ref_z_m"),
                          LAP_FROM_S, LAP_TO_S)
    load = load[np.isin(load[:, 0], reference[:, 0])]
    return load[:, 1:] - reference[:, 1:] - [0, 0, z_shift]


class StudyTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with contextlib.ExitStack() as stack:
            cls.folder = pathlib.Path(stack.enter_context(tempfile.TemporaryDirectory()))
            launch("study", "--out", "s", "--recordings", "r", cwd=cls.folder, timeout=1500)
            cls.addClassCleanup(stack.pop_all().close)
        cls.page = (cls.folder / "s/study.md").read_text()

    def find_cells(self, begin, table=0):
        """The cells of a row that begins with `begin`: that in the `table`th table with such a row."""
        rows = [line for line in self.page.splitlines() if line.startswith(f"| {begin}")]
        return [cell.strip() for cell in rows[table].strip("|").split("|")][1:]

    def test_the_committed_page_is_what_the_command_writes(self):
        self.assertEqual(self.page, (study.ROOT / "docs/study.md").read_text())
        names = {path.name for path in (self.folder / "s/study").iterdir()}
        self.assertEqual(names, {path.name for path in (study.ROOT / "docs/study").iterdir()})

    def test_the_ingredients_are_the_errors_of_their_flights(self):
        for table, file in ((0, "measured.csv"), (1, "state.csv")):
            for name, z_shift in (("px4_stale", 0.0), ("px4_published", 0.1), ("px4_fitted", 0.1)):
                errors = calc_lap_errors(self.folder / "r" / name, file, z_shift)
                expected = [*np.sqrt(np.mean(errors**2, axis=0)), *np.max(np.abs(errors), axis=0)]
                cells = self.find_cells(f"`{name}`: ", table)[:6]
                # Three digits are printed.
                np.testing.assert_allclose([float(cell) for cell in cells], expected, rtol=6e-3)

    def test_flights_with_a_late_force_follow_the_linear_formula(self):
        """Compares the errors of the second lap with the solution of the linear equations of motion for
        each frequency. The tolerance is 0.5 %, because the law is exact but the angles of the flight are not small."""
        for gains, name in ((GAINS, "reversed"), (GAINS[::-1], "right")):
            for delay_ms in (40, 120, 200):
                folder = self.folder / f"r/ideal_{name}_delay_{delay_ms}ms"
                rms = np.sqrt(np.mean(calc_lap_errors(folder, "state.csv")**2, axis=0))
                late = Lateness(1e-3 * delay_ms + 0.002)  # plus half the hold of 4 ms
                for axis, amplitude in ((0, 1.5), (1, 0.75)):
                    s = 2j * math.pi / 16 * (axis + 1)
                    expected = amplitude / math.sqrt(2) * abs(solve_error_ratio(gains, late, s, rod_m=1.0))
                    self.assertAlmostEqual(rms[axis] / expected, 1, delta=0.005)

    def test_the_attitude_reaches_63_percent_after_0_17_seconds(self):
        for name in ("roll", "pitch"):
            rows = read_rows(self.folder / f"r/attitude_step_{name}/state.csv",
                             ("sim_time_s", "att_w", "att_x", "att_y"))
            tilt = 2 * np.hypot(rows[:, 2], rows[:, 3])  # holds for small angles without yaw
            first = np.flatnonzero(tilt >= 0.632 * 0.1)[0]
            self.assertAlmostEqual(rows[first, 0] - 2.0, 0.17, delta=0.02)
        said = float(self.page.split("reaches 63 % after ")[1].split(" s")[0])
        self.assertAlmostEqual(said, 0.17, delta=0.02)

    def test_the_reversed_gains_tolerate_more_delay(self):
        margins = {}
        for line in self.page.splitlines():
            cells = [cell.strip() for cell in line.strip("|").split("|")]
            if len(cells) == 7 and cells[2] in ("reversed", "right"):
                margins[tuple(cells[:3])] = float(cells[3])
        for vehicle, mission in (("`px4_ideal`", "the eight"),
                                 ("`px4_attitude`", "a step of 0.2 m"),
                                 ("`px4_fitted`", "a step of 0.2 m")):
            self.assertGreater(margins[vehicle, mission, "reversed"],
                               margins[vehicle, mission, "right"] + 0.05)
