"""Reads recordings that this test writes in the recorder's format: complete, cut short, in segments, of
fleets."""

import io
import json
import shutil

import support
import numpy as np

from sls.figures import make_figures
from sls.trajectory import calc_roll_pitch_yaw
from sls.input_error import InputError
from sls.metrics import calc_stage_metrics
from sls.recordings import Recording
from support import PERIOD_S, STEPS_PER_STAGE, load_of, reference_of, write_recording


def replace_field(text, line, column, number):
    """The text of a table with another number in one of its lines, counted from 0."""
    rows = [row.split(",") for row in text.split("\n")]
    rows[line][rows[0].index(column)] = number
    return "\n".join(map(",".join, rows))


class RecordingsTest(support.FolderTest):
    def load(self, vehicle_id=0):
        return Recording(self.folder / "r").load_flight(vehicle_id, "r")

    def change(self, name, change):
        path = self.folder / "r" / name
        path.write_text(change(path.read_text()))

    def refuse(self, message, vehicle_id=0):
        with self.assertRaisesRegex(InputError, message):
            self.load(vehicle_id)

    def test_a_recording_reads_back_as_it_was_flown(self):
        write_recording(self.folder / "r")
        flight = self.load()
        self.assertEqual(flight.notes, ())
        for step in (0, 1, STEPS_PER_STAGE - 1, STEPS_PER_STAGE, 2 * STEPS_PER_STAGE):
            self.assertEqual(flight.time_s[step], step * PERIOD_S)
            np.testing.assert_array_equal(flight.p_WL[step], load_of(step, 0))
            np.testing.assert_array_equal(flight.p_WL_ref[step], reference_of(step)[2])
            np.testing.assert_array_equal(flight.f_Q_W[step], [1, 2, -16])
        self.assertEqual([(stage.name, stage.first, stage.end, stage.lap_s)
                          for stage in flight.stages],
                         [("set_point", 0, STEPS_PER_STAGE, None),
                          ('eight, "two laps"', STEPS_PER_STAGE, 2 * STEPS_PER_STAGE + 1, 2.0)])

    def test_the_controllers_input_is_the_measurement_or_else_the_truth(self):
        write_recording(self.folder / "r", last=3, vehicles=(0, 1))
        seen = Recording(self.folder / "r").load_seen(1, "r")
        np.testing.assert_array_equal(seen.p_WL[3], load_of(3, 1))
        # Every measured row has the values of step 0, as from a frozen sensor. The last row is missing.
        state = (self.folder / "r/state.csv").read_text().splitlines()
        old = {row.split(",")[0]: row.split(",")[3:] for row in state[:0:-1]}
        rows = [",".join(row.split(",")[:3] + old[row.split(",")[0]]) for row in state[1:-1]]
        (self.folder / "r/measured.csv").write_text("\n".join([state[0], *rows]) + "\n")
        seen = Recording(self.folder / "r").load_seen(1, "r")
        np.testing.assert_array_equal(seen.p_WL[2], load_of(0, 1))
        np.testing.assert_array_equal(seen.p_WQ[2], load_of(0, 1) - [0, 0, 1])
        np.testing.assert_array_equal(seen.p_WL_ref[2], reference_of(2)[2])
        self.assertTrue(np.isnan(seen.p_WL[3]).all())

    def test_a_body_reads_back_and_a_point_mass_has_none(self):
        write_recording(self.folder / "r", last=3)
        self.assertIsNone(self.load().body)
        write_recording(self.folder / "r", last=3, rotors=6)
        body = self.load().body
        np.testing.assert_allclose(
            calc_roll_pitch_yaw(body.q_WB_set)[3], support.angles_of(3), rtol=0, atol=1e-15)
        np.testing.assert_array_equal(body.w_WB_B[3], [0.1, -0.2, 0.3])
        np.testing.assert_array_equal(body.rotor_speed_set[3], [913, 923, 933, 943, 953, 963])
        np.testing.assert_array_equal(body.rotor_speed[3], body.rotor_speed_set[3] - 5)
        self.assertEqual((body.thrust[3], body.thrust_set[3], body.rod_tension[3]),
                         (15.5, 16, 1.96))
        # There is no set-point before the first step of the autopilot.
        self.assertTrue(np.isnan(body.q_WB_set[0]).all() and np.isnan(body.thrust_set[0]))

    def test_of_a_plant_with_attitude_alone_that_is_all_there_is(self):
        write_recording(self.folder / "r", last=3, rotors=4)
        def keep(text):
            lines = [line.split(",") for line in text.split("\n")]
            end = lines[0].index("rate_x_rad_s")
            return "\n".join(",".join(fields[:end]) for fields in lines)
        self.change("state.csv", keep)
        flight = self.load()
        self.assertEqual(flight.body.rotor_speed.shape, (4, 0))
        self.assertTrue(np.isfinite(flight.body.q_WB).all())
        self.assertTrue(np.isnan(flight.body.w_WB_B).all())
        # The attitude that realises its force is still known.
        figure = make_figures([flight])["body_attitude"]
        self.assertEqual([len(axes.lines) for axes in figure.axes], [2, 2, 2])

    def test_figures_leave_out_numbers_that_no_axis_can_show(self):
        write_recording(self.folder / "r", last=30)
        for name, of, number in (("state.csv", "load_x_m", "-1e155"), ("command.csv", "force_y_n", "1e308")):
            self.change(name, lambda text, of=of, number=number: replace_field(text, 20, of, number))
        for figure in make_figures([self.load()], panels={"forces": [], "path": []}).values():
            figure.savefig(io.BytesIO(), format="svg")

    def test_its_metrics_are_what_was_put_into_it(self):
        write_recording(self.folder / "r")
        stage, eight, first, second = calc_stage_metrics(self.load())
        # The remaining share of the step is exp(−2 t): 2 % after ln 50 / 2 = 1.956 s.
        np.testing.assert_array_equal(stage.step.settling_time_s, [np.nan, np.nan, 1.96])
        self.assertEqual(stage.max_m[2], 1.0)
        np.testing.assert_allclose(first.rms_m, 0.01, rtol=1e-9)
        np.testing.assert_allclose(second.max_m, 0.001, rtol=1e-9)
        self.assertIsNone(eight.step)

    def test_laps_count_from_the_start_of_a_stage_that_the_recorder_joined_late(self):
        write_recording(self.folder / "r", first=450)
        self.change("manifest.json", lambda text: json.dumps(
            {**json.loads(text), "stage_starts": [{"vehicle_id": 0, "stage": 1, "step": 400}]}))
        _, first, second = calc_stage_metrics(self.load())
        self.assertEqual([first.label, first.from_s, second.label, second.from_s], ["lap 1 (part)", 4.5, "lap 2", 6.0])

    def test_a_killed_recorder_leaves_what_is_read_and_said(self):
        write_recording(self.folder / "r", last=150, complete=False)
        self.change("state.csv", lambda text: text[:-30])
        self.change("reference.csv", lambda text: "\n".join(text.split("\n")[:-20]) + "\n")
        flight = self.load()
        self.assertEqual(len(flight.time_s), 150)
        self.assertEqual(flight.notes,
                         ("incomplete: its recorder was killed, or is still recording",
                          "state.csv: the last row is cut off and left out"))
        self.assertTrue(np.isnan(flight.p_WL_ref[-1]).all())
        self.assertTrue(np.isfinite(flight.p_WL_ref[100]).all())
        self.assertEqual(len(calc_stage_metrics(flight)), 1)

    def test_segments_are_joined_where_each_takes_over(self):
        write_recording(self.folder / "whole")
        write_recording(self.folder / "r", last=150, complete=False)
        write_recording(self.folder / "r/segment-2", first=140, last=500, complete=False, segment=2)
        write_recording(self.folder / "r/segment-3", first=501, segment=3)
        (self.folder / "r/segment-4").mkdir()  # its recorder was killed before it wrote a file
        flight, whole = self.load(), Recording(self.folder / "whole").load_flight(0, "w")
        for values, expected in ((flight.time_s, whole.time_s), (flight.p_WL, whole.p_WL),
                                 (flight.p_WL_ref, whole.p_WL_ref), (flight.f_Q_W, whole.f_Q_W)):
            np.testing.assert_array_equal(values, expected)
        self.assertEqual(flight.notes, ())

    def test_missing_samples_are_reported_and_not_invented(self):
        write_recording(self.folder / "r", complete=False, missing=[
            {"vehicle_id": 0, "topic": "sls/reference", "from": 200, "to": 202}])
        self.change("reference.csv", lambda text: "\n".join(
            line for line in text.split("\n") if line[:6] not in ("0,200,", "0,201,", "0,202,")))
        flight = self.load()
        self.assertIn("3 samples missing, first sls/reference step 200 of vehicle 0", flight.notes)
        self.change("manifest.json", lambda text: json.dumps(
            {**json.loads(text), "further_missing": {"gaps": 2, "samples": 40}}))  # which it does not list
        self.assertIn("43 samples missing, first sls/reference step 200 of vehicle 0", self.load().notes)
        self.assertEqual(list(np.flatnonzero(np.isnan(flight.p_WL_ref[:, 0]))), [200, 201, 202])
        self.assertEqual(len(flight.stages), 2)

    def test_the_last_status_may_be_in_an_earlier_segment(self):
        write_recording(self.folder / "r", last=150, complete=False)
        write_recording(self.folder / "r/segment-2", first=151, segment=2)
        status = self.folder / "r/segment-2/status.csv"
        status.write_text(status.read_text().split("\n")[0] + "\n")
        self.assertEqual(Recording(self.folder / "r").read_last_status()["phase"], "finished")

    def test_further_runs_in_the_folder_are_named(self):
        write_recording(self.folder / "r")
        write_recording(self.folder / "r/run-00000000000000aa")
        self.assertEqual(self.load().notes,
                         ("further runs are recordings of their own: run-00000000000000aa",))

    def test_each_vehicle_of_a_fleet_is_itself(self):
        write_recording(self.folder / "r", vehicles=(0, 1, 2))
        for vehicle in range(3):
            np.testing.assert_array_equal(self.load(vehicle).p_WL[0], load_of(0, vehicle))
        self.refuse(r"r: expected a vehicle of this recording \(0 to 2\), got 3", 3)

    def test_events_are_changes_of_phase_and_reason(self):
        write_recording(self.folder / "r")
        self.assertEqual([(event.time_s, event.text) for event in
                          Recording(self.folder / "r").list_events()],
                         [(0, "waiting: waiting for: recorder, client"), (0, "running"),
                          (8.0, "finished: mission finished")])

    def test_defects_of_its_files_are_named_with_file_and_line(self):
        def truncate_row(text):
            lines = text.split("\n")
            lines[5] = lines[5][:20]
            return "\n".join(lines)

        cases = (
            ("state.csv", truncate_row, "state.csv:6: expected 22 fields, got"),
            ("command.csv", truncate_row, "command.csv:6: expected 8 fields, got 7"),
            ("state.csv", lambda text: text.replace("\n0,3,0.03,", "\n0,3,x,"),
             "state.csv:5: sim_time_s: expected a number, got 'x'"),
            ("state.csv", lambda text: text.replace("load_x_m", "load"),
             "state.csv:1: expected a column 'load_x_m', got 'vehicle_id"),
            ("state.csv", lambda text: text.replace("\n0,3,", "\n0,2,"),
             "state.csv: vehicle 0: expected a step after 2, got 2"),
            ("state.csv", lambda text: "", "state.csv:1: expected a header, got an empty file"),
            ("state.csv", lambda text: text.split("\n")[0] + "\n",
             "state.csv: expected rows of vehicle 0, got none"),
            ("manifest.json", lambda text: "{", "manifest.json: expected JSON, got: "),
            ("manifest.json", lambda text: text.replace(": [0]", ": 0"), "vehicle_ids: expected a list, got 0"),
            ("scenario.yaml", lambda text: "a: [", "scenario.yaml:1: expected YAML, got a syntax error"),
            ("scenario.yaml", lambda text: "a: 1\n", "scenario.yaml: mission: expected a list, got null"),
        )
        for name, damage, message in cases:
            with self.subTest(message):
                write_recording(self.folder / "r", last=20)
                self.change(name, damage)
                self.refuse(message)
        shutil.rmtree(self.folder / "r")
        self.refuse("r: expected a recording")

    def test_a_manifest_of_an_earlier_version_will_do(self):
        folder = write_recording(self.folder / "r")
        manifest = json.loads((folder / "manifest.json").read_text())
        for key in ("segment", "certificate", "timing"):
            del manifest[key]
        (folder / "manifest.json").write_text(json.dumps(manifest))
        self.assertEqual(len(self.load().time_s), 2 * STEPS_PER_STAGE + 1)
