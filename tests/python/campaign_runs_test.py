"""Runs of a campaign from Python: measures and certificate equal those of a recording of the same flight;
mistakes, Ctrl-C and other threads."""

import json
import math
import shutil
import signal
import subprocess
import sys
import threading
import time
import unittest

import support
import numpy as np

sys.path.insert(0, str(support.BUILD / "python"))
try:
    import _sls_core
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

from sls.metrics import calc_stage_metrics  # noqa: E402
from sls.recordings import Recording  # noqa: E402

SCENARIOS = support.ROOT / "config/scenarios"
MEASURES = ["load_error_rms", "load_error_max", "settling", "overshoot", "tilt_max", "force_max",
            "time_of_loss", "outcome"]
LONG = ("{ model: analytic, step_s: 0.004, initial: { load_position_m: [0, 0, -0.5] } }", "100000")
"""Values of the keys `plant` and `mission.0.for_s`: a flight of many seconds."""


class CampaignRunsTest(support.FolderTest):
    def fly_and_record(self, name, path, value):
        """Flies a run, and records its scenario with the program `closed_loop`. Returns the measures by
        column, the outcome and the reason."""
        runs = _sls_core.Runs(str(SCENARIOS / f"{name}.yaml"), [path], MEASURES)
        outcome, reason, values, certificate, steps = runs.fly([value], True)
        scenario = self.write("run.yaml", runs.scenario_text([value]))
        subprocess.run([support.BUILD / "bin/closed_loop", "--scenario", scenario, "--out",
                        self.folder / "r"], capture_output=True, timeout=120, check=False)
        manifest = json.loads((self.folder / "r/manifest.json").read_text())
        self.assertEqual(certificate, manifest["certificate"])
        self.assertEqual(steps, manifest["last_step"] + 1)
        self.assertEqual(len(values), len(runs.columns))
        return dict(zip(runs.columns, values)), outcome, reason

    def expect_equal(self, ours, name, theirs):
        for axis, value in zip("xyz", theirs):
            np.testing.assert_allclose(ours[name.format(axis)], value, rtol=1e-12, err_msg=name)

    def test_measures_are_the_metrics_of_the_recording(self):
        for name, path, value in (("setpoints", "vehicle.load_mass_kg", "0.25"),
                                  ("mission", "controller.gains.lqr.horizontal", "20"),
                                  ("faulty_figure_eight", "faults.0.noise.seed", "17")):
            with self.subTest(name):
                ours, outcome, reason = self.fly_and_record(name, path, value)
                self.assertEqual((outcome, reason), ("finished", ""))
                self.assertTrue(math.isnan(ours["time_of_loss_s"]))
                flight = Recording(self.folder / "r").load_flight(0, "r")
                stages = [stage for stage in calc_stage_metrics(flight) if stage.label[0].isdigit()]
                self.assertEqual(len(stages), len(flight.stages))
                for index, stage in enumerate(stages):
                    prefix = f"stage_{index}_"
                    self.expect_equal(ours, prefix + "load_error_rms_{}_m", stage.rms_m)
                    self.expect_equal(ours, prefix + "load_error_max_{}_m", stage.max_m)
                    self.assertEqual(prefix + "overshoot_x" in ours, stage.step is not None)
                    if stage.step:
                        self.expect_equal(ours, prefix + "settling_{}_s", stage.step.settling_time_s)
                        self.expect_equal(ours, prefix + "overshoot_{}", stage.step.overshoot)
                error = flight.p_WL - flight.p_WL_ref
                self.expect_equal(ours, "load_error_rms_{}_m", np.sqrt(np.mean(error**2, axis=0)))
                self.expect_equal(ours, "load_error_max_{}_m", np.max(np.abs(error), axis=0))
                np.testing.assert_allclose(ours["load_error_max_m"],
                                           np.max(np.linalg.norm(error, axis=1)), rtol=1e-12)
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
                ("fleet.yaml: vehicles: expected one vehicle",
                 lambda: make(base=str(SCENARIOS / "fleet.yaml"))),
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
        paths = [str(support.BUILD / "python"), str(support.ROOT / "python")]
        program = f"""
import sys, threading
sys.path[:0] = {paths!r}
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


if __name__ == "__main__":
    unittest.main()
