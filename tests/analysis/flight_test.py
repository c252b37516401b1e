"""A real flight, plotted and reported; the programs are those of this build."""

import os
import re
import subprocess
import unittest

import support
import numpy as np

from analysis.metrics import calc_stage_metrics
from analysis.recordings import Recording

LAUNCHER = support.ROOT / "sls"


class FlightTest(support.FolderTest):
    def run_launcher(self, *arguments):
        done = subprocess.run([LAUNCHER, *arguments], cwd=self.folder, capture_output=True,
                              env={**os.environ, "SLS_BUILD": support.BUILD}, text=True,
                              timeout=200)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stderr

    def test_the_short_flight_is_plotted_and_reported(self):
        domain = self.enterContext(support.OwnDomain())
        self.run_launcher("run", "short", "--out", "r", "--domain", domain)
        self.assertIn("figures: r/figures", self.run_launcher("plot", "r"))
        self.assertIn("report: r/report.html", self.run_launcher("report", "r"))
        self.assertEqual(len(list((self.folder / "r/figures").iterdir())), 12)
        page = (self.folder / "r/report.html").read_text()
        self.assertIn("finished: mission finished", page)

        # What the recorder has written for people is a second opinion on the metrics.
        flight = Recording(self.folder / "r").load_flight(0, "r")
        self.assertEqual(len(flight.time_s), 501)  # 2 s at 4 ms
        stage, lap = calc_stage_metrics(flight)
        text = (self.folder / "r/flight.txt").read_text()
        written = re.search(r"0 figure_eight +0 +2 +(.*)", text)
        numbers = [float(number) for number in written[1].split()[:6]]
        np.testing.assert_allclose([*stage.rms_m, *stage.max_m], numbers, rtol=5e-3)
        np.testing.assert_array_equal(lap.rms_m, stage.rms_m)

        # The attitude is the recorder's, too.
        table = np.genfromtxt(self.folder / "r/flight.csv", delimiter=",", names=True)
        np.testing.assert_allclose(flight.calc_attitude()[:, 0], table["roll_rad"], atol=1e-12)
        np.testing.assert_allclose(flight.calc_attitude()[:, 1], table["pitch_rad"], atol=1e-12)

        # A recording that was plotted is still replaced by the next flight.
        self.run_launcher("run", "short", "--out", "r", "--force", "--domain", domain)
        self.assertFalse((self.folder / "r/report.html").exists())
        self.assertFalse((self.folder / "r/figures").exists())


if __name__ == "__main__":
    unittest.main()
