"""Runs of a campaign from Python: measures and certificate equal those of a recording of the same flight;
mistakes, Ctrl-C and other threads."""

import json
import math
import re
import shutil
import signal
import subprocess
import sys
import threading
import time

import support
import numpy as np
from places import BUILD, ROOT

import _sls_core
from sls.campaign.campaign import MEASURES
from sls.input_error import InputError
from sls.measures import measure
from sls.recordings import Recording

SCENARIOS = ROOT / "config/scenarios"
LONG = ("{ model: analytic, step_s: 0.004, initial: { load_position_m: [0, 0, -0.5] } }", "100000")
"""Values of the keys `plant` and `mission.0.for_s`: a flight of many seconds."""


class CampaignRunsTest(support.FolderTest):
    def fly_and_record(self, name, path, value):
        """Flies a run, and records its scenario with the program `closed_loop`. Returns the measures by
        column, the outcome and the reason."""
        runs = _sls_core.Runs(str(SCENARIOS / f"{name}.yaml"), [path], list(MEASURES))
        outcome, reason, values, certificate, steps = runs.fly([value], True)
        scenario = self.write("run.yaml", runs.scenario_text([value]))
        subprocess.run([BUILD / "bin/closed_loop", "--scenario", scenario, "--out",
                        self.folder / "r"], capture_output=True, timeout=120, check=False)
        manifest = json.loads((self.folder / "r/manifest.json").read_text())
        self.assertEqual(certificate, manifest["certificate"])
        self.assertEqual(steps, manifest["last_step"] + 1)
        self.assertEqual(len(values), len(runs.columns))
        return dict(zip(runs.columns, values)), outcome, reason

    def test_measures_are_those_of_the_recording(self):
        """Bit for bit: both make them with one set of functions, of the same rows."""
        column = re.compile(r"(?:stage_(\d+)_)?(.+?)(?:_([xyz]))?(_m|_s|_rad|_n|_j|)")
        for name, path, value in (("setpoints", "vehicle.load_mass_kg", "0.25"),
                                  ("mission", "controller.gains.lqr.horizontal", "20"),
                                  ("faulty_figure_eight", "faults.0.noise.seed", "17"),
                                  ("multirotor_setpoints", "vehicle.load_mass_kg", "0.22")):
            with self.subTest(name):
                ours, outcome, reason = self.fly_and_record(name, path, value)
                self.assertEqual((outcome, reason), ("finished", ""))
                recording = Recording(self.folder / "r")
                error = np.linalg.norm(recording.trajectory.calc_error(), axis=1)
                np.testing.assert_allclose(ours["load_error_max_m"], np.max(error), rtol=1e-12)
                for text, number in ours.items():
                    stage, measured, axis, unit = column.fullmatch(text).groups()
                    options = {"stage": stage and int(stage), "axis": axis}
                    try:
                        theirs = measure(recording, measured + unit, vehicle_id=0, **options).value
                    except InputError:
                        theirs = math.nan
                    if text == "time_of_loss_s":
                        self.assertEqual((number != number, theirs), (True, math.inf))
                    else:
                        np.testing.assert_array_equal(number, theirs, err_msg=text)
                shutil.rmtree(self.folder / "r")

    def test_a_lost_load_is_measured_up_to_the_loss_and_certified_to_the_end(self):
        fault = "[{ delay: { on: command, by_s: 0.26 } }]"
        ours, outcome, reason = self.fly_and_record("figure_eight", "faults", fault)
        self.assertEqual(outcome, "lost")
        # The time at which `./sls delay-margin figure_eight` loses the load.
        self.assertEqual(reason, "load more than 1 m further from its reference than in the base "
                         "flight, at 20.396 s")
        self.assertEqual(ours["time_of_loss_s"], 20.396)
        flight = Recording(self.folder / "r").load_flight(0, "r")
        rows = flight.time_s <= 20.396
        error = np.linalg.norm(flight.p_WL[rows] - flight.p_WL_ref[rows], axis=1)
        np.testing.assert_allclose(ours["load_error_max_m"], np.max(error), rtol=1e-12)

    def test_mistakes_are_errors_of_one_line_with_file_and_key(self):
        file = str(SCENARIOS / "short.yaml")

        def make(measures=("outcome",), base=file, period_s=None):
            return _sls_core.Runs(base, ["vehicle.load_mass_kg"], list(measures), period_s)

        for message, work in (
                ("short.yaml:3: vehicle.load_mass_kg: expected > 0, got -1",
                 lambda: make().check(["-1"])),
                ("short.yaml:3: vehicle.load_mass_kg: expected > 0, got -1",
                 lambda: make().fly(["-1"], False)),
                ("expected 1 values, one for each path, got 0", lambda: make().check([])),
                ("measure: expected load_error_rms, .* got 'mean'", lambda: make(["mean"])),
                ("short.yaml: --period-s: expected > 0, got -1", lambda: make(period_s=-1.0)),
                ("short.yaml: vehicles: expected 1, as in the base scenario, got 2",
                 lambda: _sls_core.Runs(file, ["vehicles"], ["outcome"]).check(["2"])),
                ("nothing.yaml: expected a scenario file, got none", lambda: make(base="nothing.yaml"))):
            with self.subTest(message):
                with self.assertRaisesRegex(_sls_core.ConfigError, message) as raised:
                    work()
                self.assertNotIn("\n", str(raised.exception))

    def test_another_period_is_in_the_text_of_each_run(self):
        runs = _sls_core.Runs(str(SCENARIOS / "short.yaml"), ["vehicle.load_mass_kg"], ["outcome"], 0.02)
        self.assertIn("period_s: 0.02", runs.scenario_text(["0.3"]))
        self.assertEqual(runs.fly(["0.3"], False), ("finished", "", [], "", 101))

    def make_long_runs(self):
        return _sls_core.Runs(str(SCENARIOS / "figure_eight.yaml"), ["plant", "mission.0.for_s"],
                              ["load_error_rms"])

    def test_other_threads_run_while_it_flies(self):
        runs, ticks, is_over = self.make_long_runs(), [], threading.Event()

        def tick():
            while not is_over.wait(0.005):
                ticks.append(time.monotonic())

        thread = threading.Thread(target=tick)
        thread.start()
        began = time.monotonic()
        runs.fly([LONG[0], "3000"], False)
        ended = time.monotonic()
        is_over.set()
        thread.join()
        self.assertGreater(sum(began < at < ended for at in ticks), 3)

    def test_ctrl_c_ends_a_flight(self):
        """The flight takes longer than the test waits."""
        program = f"""
import threading
import _sls_core
runs = _sls_core.Runs({str(SCENARIOS / "figure_eight.yaml")!r}, ["plant", "mission.0.for_s"], [])
try:
    threading.Timer(0.2, print, ["flies"], {{"flush": True}}).start()
    runs.fly({list(LONG)!r}, True)
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""
        process = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
        with process:
            try:
                self.assertEqual(process.stdout.readline(), "flies\n")
                process.send_signal(signal.SIGINT)
                said, _ = process.communicate(timeout=20)
                self.assertEqual((said, process.returncode), ("interrupted\n", 0))
            finally:
                process.kill()
