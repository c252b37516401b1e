"""Shared by the tests of the package."""

import contextlib
import io
import json
import re

import folder_test
import numpy as np
from places import ROOT
from scipy.spatial.transform import Rotation


class FolderTest(folder_test.FolderTest):
    def run_sls(self, *arguments):
        """Runs the command line in the test's folder. Returns exit code and output."""
        from sls.__main__ import main
        with contextlib.chdir(self.folder), io.StringIO() as said:
            with contextlib.redirect_stderr(said):
                code = main([str(argument) for argument in arguments])
            return code, said.getvalue()

    def expect_refused(self, arguments, *parts):
        """Checks that the command prints one line that contains `parts`, and ends with exit code 2."""
        code, output = self.run_sls(*arguments)
        self.assertEqual(code, 2, output)
        self.assertEqual(output.count("\n"), 1, output)
        self.assertTrue(output.startswith("sls: error: "), output)
        for part in parts:
            self.assertIn(str(part), output)


def read_header(file):
    """The header of a file of the recorder for a plant without signals."""
    page = (ROOT / "docs/reference/recordings.md").read_text()
    table = page[page.index(f"\n## {file}"):].split("\n\n")[1].rstrip()
    rows = [line.split(" | ") for line in table.split("\n")[2:]]
    return ",".join(name for row in rows if "`truth.q_WB`" not in row[3]
                    and "`truth.w_WB_B" not in row[3] and "`truth.signals`" not in row[3]
                    for name in re.findall(r"`(\w+)`", row[0]))


STATE_HEADER, COMMAND_HEADER, REFERENCE_HEADER, STATUS_HEADER = map(
    read_header, ("state.csv", "command.csv", "reference.csv", "status.csv"))
PERIOD_S = 0.01
SCENARIO = """name: synthetic
vehicle: { quad_mass_kg: 1.5, load_mass_kg: 0.2, rod_length_m: 1.0, gravity_m_s2: 9.8 }
mission:
  - set_point: { position_m: [1, -1, -2] }
    for_s: 4
  - figure_eight: { amplitude_m: [1.5, 0.75, 0.5], period_s: 2 }
    for_s: 4
"""
STEPS_PER_STAGE = 400


def reference_of(step):
    """Stage, name and position of the synthetic reference: a set-point for 4 s, then two laps of 2 s."""
    if step < STEPS_PER_STAGE:
        return 0, "set_point", np.array([1.0, -1.0, -2.0])
    time_s = (step - STEPS_PER_STAGE) * PERIOD_S
    swing = np.sin(np.pi * time_s)
    return 1, 'eight, "two laps"', np.array([1.5 * swing, 0.75 * np.sin(2 * np.pi * time_s),
                                             0.5 * swing])


def load_of(step, vehicle_id):
    """Position of the load: 1 m above the set-point at first, then nearer; the error is 1 cm on the first
    lap and 1 mm on the second."""
    _, _, reference = reference_of(step)
    if step < STEPS_PER_STAGE:
        return reference + np.array([0, 0, -np.exp(-2 * step * PERIOD_S)]) * (1 + vehicle_id)
    return reference + (0.01 if step < STEPS_PER_STAGE + 200 else 0.001)


def angles_of(step):
    """Roll, pitch, yaw of the synthetic vehicle's set-point. The vehicle is 0.01 rad behind in each angle."""
    time_s = step * PERIOD_S
    return 0.4 * np.sin(time_s), -0.3 * np.cos(time_s), 0.1 * time_s


def quaternion_of(roll, pitch, yaw):
    """Unit quaternion w x y z of rotations about z, then y, then x."""
    return np.roll(Rotation.from_euler("ZYX", (yaw, pitch, roll)).as_quat(), 1)


def list_body_columns(rotors):
    """Columns of a plant with attitude and signals: sim_server/plants/multirotor/README.md, "Signals"."""
    return ["att_w", "att_x", "att_y", "att_z", "rate_x_rad_s", "rate_y_rad_s", "rate_z_rad_s",
            *(f"rotor_{n}_rad_s" for n in range(1, rotors + 1)),
            *(f"rotor_{n}_set_rad_s" for n in range(1, rotors + 1)),
            "att_set_w", "att_set_x", "att_set_y", "att_set_z", "thrust_set_n", "thrust_n",
            "rod_tension_n"]


def list_body_values(step, rotors):
    asked = angles_of(step)
    set_points = [900 + 10 * n + step for n in range(1, rotors + 1)]
    # At step 0 the autopilot has not run yet.
    att_set, thrust_set = (quaternion_of(*asked), 16) if step else ([1, 0, 0, 0], 0)
    return [*quaternion_of(*(angle - 0.01 for angle in asked)), 0.1, -0.2, 0.3,
            *(speed - 5 for speed in set_points), *set_points, *att_set, thrust_set, 15.5, 1.96]


def write_recording(folder, first=0, last=2 * STEPS_PER_STAGE, vehicles=(0,), complete=True,
                    missing=(), segment=1, rotors=0):
    """Writes a recording of steps `first` to `last` with the recorder's columns. With `rotors` it is that of
    a plant with attitude."""
    folder.mkdir(parents=True, exist_ok=True)
    header = ",".join([STATE_HEADER, *(list_body_columns(rotors) if rotors else ())])
    rows = {"state.csv": [header], "command.csv": [COMMAND_HEADER],
            "reference.csv": [REFERENCE_HEADER]}
    for step in range(first, last + 1):
        for vehicle in vehicles:
            stage, name, reference = reference_of(step)
            load = load_of(step, vehicle)
            quad = load - [0, 0, 1]
            quoted = '"' + name.replace('"', '""') + '"' if '"' in name else name
            numbers = [*quad, 0, 0, 0, *load, 0, 0, 0, 0.1, -0.2, 0, 0, 0, 0, 0,
                       *(list_body_values(step, rotors) if rotors else ())]
            rows["state.csv"].append(
                f"{vehicle},{step},{step * PERIOD_S!r}," + ",".join(f"{v:.17g}" for v in numbers))
            rows["command.csv"].append(f"{vehicle},{step},client,1,2,-16,3.5,none")
            rows["reference.csv"].append(
                f"{vehicle},{step},{step * PERIOD_S!r},{stage},{quoted},"
                + ",".join(f"{v:.17g}" for v in [*reference, *[0] * 12]))
    for name, lines in rows.items():
        (folder / name).write_text("\n".join(lines) + "\n")
    zeros = ",0" * (STATUS_HEADER.count(",") - 8)
    (folder / "status.csv").write_text(
        f"{STATUS_HEADER}\n0,waiting,\"waiting for: recorder, client\",0,,0,0{zeros},exact,\n"
        f"1,running,,0,,0,0{zeros},exact,\n2,running,,{last},,0,7{zeros},exact,\n"
        f"3,finished,mission finished,{last},client,12,7{zeros},exact,\n")
    (folder / "scenario.yaml").write_text(SCENARIO)
    (folder / "manifest.json").write_text(json.dumps({
        "complete": complete, "outcome": "finished" if complete else "recording",
        "reason": "mission finished" if complete else "", "run_id": "0123456789abcdef",
        "scenario": "synthetic", "scenario_sha256": "0" * 64, "vehicle_ids": list(vehicles),
        "period_s": PERIOD_S, "step_s": 0.001, "mode": "lockstep", "timing": "exact",
        "certificate": "f" * 64, "segment": {"number": segment, "first_step": first},
        "missing": list(missing)}))
    return folder
