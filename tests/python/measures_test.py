"""Which rows a measure covers, and what it refuses. tests/common/model/measures_test.cpp tests the formulas,
campaign_runs_test.py compares flights with campaigns."""

import json
import math

import support

from sls.input_error import InputError
from sls.measures import MEASURES, Measured, NotFlown, measure
from sls.recordings import Recording
from support import SCENARIO, write_recording


class MeasuresTest(support.FolderTest):
    def measure(self, name, vehicle_id=0, **options):
        return measure(Recording(self.folder / "r"), name, vehicle_id=vehicle_id, **options)

    def change(self, name, change):
        path = self.folder / "r" / name
        path.write_text(change(path.read_text()))

    def expect(self, name, value, unit, step, **options):
        measured = self.measure(name, **options)
        self.assertAlmostEqual(measured.value, value, delta=1e-12)
        time_s = None if step is None else step * support.PERIOD_S
        self.assertEqual(measured, Measured(measured.value, unit, step, time_s))

    def refuse(self, message, name, kind=InputError, **options):
        with self.assertRaisesRegex(kind, message) as raised:
            self.measure(name, **options)
        self.assertNotIn("\n", str(raised.exception))

    def test_stage_window_axis_and_vehicle_choose_what_counts(self):
        write_recording(self.folder / "r", vehicles=(0, 1))
        for options, rms in (({"window_s": (4, 5.99), "axis": "x"}, 0.01),
                             ({"window_s": (6, 8), "stage": 1}, 0.001 * math.sqrt(3)),
                             ({"stage": 1}, math.sqrt(3 * (200 * 0.01**2 + 201 * 0.001**2) / 401))):
            self.assertAlmostEqual(self.measure("load_error_rms_m", **options).value, rms, delta=1e-12)
        self.expect("load_error_max_m", 1, "m", 0)
        self.expect("load_error_max_m", 2, "m", 0, vehicle_id=1)
        self.expect("load_error_end_m", math.exp(-2 * 3.99), "m", 399, stage=0)
        self.expect("force_max_n", math.sqrt(261), "N", 0)
        self.expect("force_max_n", 2, "N", 300, axis="y", window_s=(3, 9))
        self.expect("tilt_max_rad", 0, "rad", 0)

    def test_settling_has_a_band_of_the_step_or_of_metres(self):
        write_recording(self.folder / "r")
        self.expect("settling_s", 1.96, "s", 196, stage=0)  # ln 50 / 2 = 1.956
        self.expect("settling_s", 1.96, "s", 196, stage=0, axis="z")
        self.expect("settling_s", 1.16, "s", 116, within_m=0.1)  # ln 10 / 2 = 1.151; the figure eight counts, too
        self.expect("settling_s", 3.46, "s", 346, within_m=0.001, for_s=0.5)  # ln 1000 / 2 = 3.454
        self.expect("settling_s", math.inf, "s", 800, within_m=0.001)
        self.expect("overshoot", 0, "", 399, stage=0)
        self.refuse("settling_s: expected within_m beside for_s, got for_s alone", "settling_s", stage=0, for_s=1)
        self.refuse("overshoot: expected a constant reference, .*, got one that moves", "overshoot")
        self.refuse("overshoot: expected a stage that begins at least 0.01 m from", "overshoot", stage=0, axis="x")

    def test_a_stage_that_the_recorder_joined_late_has_no_step(self):
        write_recording(self.folder / "r", first=50)
        self.change("manifest.json", lambda text: json.dumps(
            {**json.loads(text), "stage_starts": [{"vehicle_id": 0, "stage": 0, "step": 0}]}))
        self.refuse("overshoot: expected rows from the start of the stage on, got none before 0.5 s",
                    "overshoot", stage=0)

    def test_held_answers_are_late_and_age(self):
        write_recording(self.folder / "r")
        for step, fault in ((100, "held"), (300, "held"), (301, "held"), (302, "fail_safe")):
            self.change("command.csv", lambda text: text.replace(f"\n0,{step},client,1,2,-16,3.5,none",
                                                                 f"\n0,{step},client,1,2,-16,0,{fault}"))
        # A held step has no reference, but counts for what has no error.
        self.change("reference.csv", lambda text: "\n".join(
            line for line in text.split("\n") if not line.startswith("0,302,")))
        self.expect("late_steps", 4, "", 100)
        self.expect("late_steps", 3, "", 300, window_s=(2, 4))
        self.expect("late_steps", 0, "", None, stage=1)
        self.expect("answer_age_max_ms", 30, "ms", 302)
        self.expect("answer_age_max_ms", 10, "ms", 100, window_s=(0, 2))
        self.refuse("expected steps in 3.02 s to 3.021 s with a reference", "load_error_max_m",
                    kind=NotFlown, window_s=(3.02, 3.021))
        self.expect("tilt_max_rad", 0, "rad", 302, window_s=(3.02, 3.021))

    def test_a_body_has_an_attitude_and_rotors_with_limits(self):
        write_recording(self.folder / "r", rotors=2)  # set-points 910 + step and 920 + step
        self.refuse("rotor_saturation: expected the plant multirotor", "rotor_saturation")
        self.change("scenario.yaml", lambda text: SCENARIO + (
            "plant: { rotor: { max_speed_rad_s: 2e3 }, rotors: [{ max_speed_rad_s: 1610 }, {}] }\n"))
        self.expect("rotor_saturation", 101 / 801, "", 700)
        attitude = self.measure("attitude_max_rad", window_s=(0, 0))
        roll, pitch, _ = (angle - 0.01 for angle in support.angles_of(0))
        self.assertAlmostEqual(attitude.value, math.acos(math.cos(roll) * math.cos(pitch)), delta=1e-9)

    def test_a_flight_that_failed_lost_its_load_at_its_last_answer(self):
        write_recording(self.folder / "r", last=150)
        self.expect("time_of_loss_s", math.inf, "s", None)
        for outcome in ("failed", "recording"):
            self.change("manifest.json", lambda text: json.dumps({**json.loads(text), "outcome": outcome}))
            if outcome == "failed":
                self.expect("time_of_loss_s", 1.5, "s", 150)
        self.refuse("time_of_loss_s: expected a flight that finished or failed, got outcome recording",
                    "time_of_loss_s")

    def test_a_measure_that_a_recording_does_not_have_is_refused(self):
        write_recording(self.folder / "r", last=150)
        self.refuse(r"r: expected a measure, one of load_error_rms_m, .*; got 'speed'", "speed")
        self.refuse("tilt_max_rad: expected stage or window_s, got axis", "tilt_max_rad", axis="x")
        self.refuse("time_of_loss_s: expected no option, got stage", "time_of_loss_s", stage=0)
        self.refuse("load_error_rms_m: axis: expected x, y or z, got 'w'", "load_error_rms_m", axis="w")
        self.refuse("attitude_max_rad: expected a plant with an attitude", "attitude_max_rad")
        self.refuse(r"r: expected a vehicle of this recording \(0\), got 1", "tilt_max_rad", vehicle_id=1)
        self.refuse("expected steps of stage 1, got none in the answered steps of the flight, 0 s to 1.5 s",
                    "tilt_max_rad", kind=NotFlown, stage=1)
        self.refuse("expected steps of stage 0 in 2 s to 3 s", "tilt_max_rad", kind=NotFlown, stage=0,
                    window_s=(2, 3))

    def test_each_measure_has_its_unit_at_the_end_of_its_name(self):
        ends = {"m": "_m", "s": "_s", "rad": "_rad", "N": "_n", "J": "_j", "ms": "_ms", "": ""}
        for name, kind in MEASURES.items():
            self.assertTrue(name.endswith(ends[kind.unit]), name)
            self.assertNotIn("\n", kind.description)
