"""A real flight of the programs of this build, with its figures and its report."""

import re
import textwrap

import numpy as np
import sls
import support
from own_domain import own_domain
from places import ROOT, launch
from sls.figures import make_figures
from sls.metrics import calc_stage_metrics
from sls.recordings import Recording
from sls.study import PUBLISHED_LAP_2

ROTORS = [{"position_m": [x, y, 0], "spin": "ccw" if x * y > 0 else "cw"} for x in (0.2, -0.2) for y in (0.2, -0.2)]


class FlightTest(support.FolderTest):
    def run_launcher(self, *arguments):
        done = launch(*arguments, cwd=self.folder)
        return done.stdout + done.stderr

    def test_the_short_flight_is_plotted_and_reported(self):
        domain = self.enterContext(own_domain())
        self.run_launcher("run", "short", "--out", "r", "--domain", domain)
        self.assertIn("figures: r/figures", self.run_launcher("plot", "r", "--panels", "path", "errors"))
        self.assertIn("report: r/report.html", self.run_launcher("report", "r"))
        self.assertEqual(len(list((self.folder / "r/figures").iterdir())), 4)
        page = (self.folder / "r/report.html").read_text()
        self.assertIn("finished: mission finished", page)

        # The text that the recorder writes is an independent check of the metrics.
        flight = Recording(self.folder / "r").load_flight(0, "r")
        self.assertEqual(len(flight.time_s), 501)  # 2 s at 4 ms
        stage, lap = calc_stage_metrics(flight)
        text = (self.folder / "r/flight.txt").read_text()
        written = re.search(r"0 figure_eight, 0 s to 2 s\n  all +(.*)", text)
        numbers = [float(number) for number in written[1].split()[:6]]
        np.testing.assert_allclose([*stage.rms_m, *stage.max_m], numbers, rtol=5e-3)
        np.testing.assert_array_equal(lap.rms_m, stage.rms_m)

        # The attitude is equal to the recorder's.
        table = np.genfromtxt(self.folder / "r/flight.csv", delimiter=",", names=True)
        np.testing.assert_allclose(flight.calc_attitude()[:, 0], table["roll_rad"], atol=1e-12)
        np.testing.assert_allclose(flight.calc_attitude()[:, 1], table["pitch_rad"], atol=1e-12)

        # A recording that was plotted is still replaced by the next flight.
        self.run_launcher("run", "short", "--out", "r", "--force", "--domain", domain, "--qos",
                          ROOT / "config/qos/udp.xml")
        self.assertFalse((self.folder / "r/report.html").exists())
        self.assertFalse((self.folder / "r/figures").exists())

    def test_a_multirotor_that_hovers_shows_the_forces_of_its_weights(self):
        self.write("hover.yaml", sls.load_scenario("multirotor_figure_eight", changes={
            "plant.rotors": ROTORS, "mission": [{"set_point": {"position_m": [0, 0, -0.5]}, "for_s": 1}]}).text)
        self.run_launcher("run", "hover.yaml", "--in-process", "--out", "r")
        flight = Recording(self.folder / "r").load_flight(0, "r")
        # Thrust m g, tension m_L g; each of the four rotors gives a fourth of the thrust, k w².
        np.testing.assert_allclose(flight.body.thrust, 1.7 * 9.8, rtol=1e-9)
        np.testing.assert_allclose(flight.body.thrust_set[1:], 1.7 * 9.8, rtol=1e-9)
        np.testing.assert_allclose(flight.body.rod_tension, 0.2 * 9.8, rtol=1e-9)
        speed = np.sqrt(1.7 * 9.8 / 4 / 5.0e-6)
        np.testing.assert_allclose(flight.body.rotor_speed, np.full((251, 4), speed), rtol=1e-9)
        np.testing.assert_allclose(flight.body.rotor_speed_set, flight.body.rotor_speed, rtol=1e-9)
        np.testing.assert_allclose(flight.body.q_WB, np.tile([1, 0, 0, 0], (251, 1)), atol=1e-12)
        self.assertLessEqual({"body_attitude", "body_rates", "rotors", "thrust"}, make_figures([flight]).keys())

    def test_documents_show_what_the_demo_prints_beside_the_published_figures(self):
        domain = self.enterContext(own_domain())
        printed = self.run_launcher("demo", "figure_eight", "--out", "r", "--domain", domain)
        table = re.search(r"Load position error on the second lap.*?\n\n", printed, re.DOTALL)[0]
        readme = (ROOT / "README.md").read_text()
        self.assertIn(textwrap.indent(table, "    "), readme)
        study_page = (ROOT / "docs/study.md").read_text()
        for row in PUBLISHED_LAP_2[1:]:
            self.assertRegex(table, rf"{re.escape(row[0])} +{' +'.join(row[1:])}\n")
            self.assertIn(f"| published: {' | '.join(row)} |", study_page)
