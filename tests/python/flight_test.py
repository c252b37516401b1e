"""A real flight of the programs of this build, with its figures and its report."""

import re
import subprocess
import textwrap
import time

import support
import numpy as np
from own_domain import OwnDomain
from places import BUILD, ROOT, launch

from sls.figures import make_figures
from sls.metrics import calc_stage_metrics
from sls.recordings import Recording
from sls.study import PUBLISHED_LAP_2
from sls.tables import format_error

HOVER = """name: hover
vehicle: { quad_mass_kg: 1.5, load_mass_kg: 0.2, rod_length_m: 1.0, gravity_m_s2: 9.8 }
plant:
  model: multirotor
  inertia_kg_m2: [0.029, 0.029, 0.055]
  rotor: { thrust_constant_n_s2: 5.0e-6, torque_constant_m: 0.05, max_speed_rad_s: 1100,
           lag_up_s: 0.0125, lag_down_s: 0.025 }
  rotors:
    - { position_m: [0.2, 0.2, 0], spin: ccw }
    - { position_m: [-0.2, -0.2, 0], spin: ccw }
    - { position_m: [0.2, -0.2, 0], spin: cw }
    - { position_m: [-0.2, 0.2, 0], spin: cw }
  step_s: 0.001
  initial: { load_position_m: [0, 0, -1] }
autopilot: { model: px4, period_s: 0.004, thrust_map: exact }
sync: { mode: lockstep, period_s: 0.004, wait_for: { controllers: 1, recorders: 1, timeout_s: 30 } }
controller: { gains: { lqr: { horizontal: 10, vertical: 5 } } }
mission:
  - set_point: { position_m: [0, 0, -1] }
    for_s: 1
"""


class FlightTest(support.FolderTest):
    def run_launcher(self, *arguments):
        done = launch(*arguments, cwd=self.folder)
        return done.stdout + done.stderr

    def test_the_short_flight_is_plotted_and_reported(self):
        domain = self.enterContext(OwnDomain())
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
        self.write("hover.yaml", HOVER)
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
        domain = self.enterContext(OwnDomain())
        printed = self.run_launcher("demo", "figure_eight", "--out", "r", "--domain", domain)
        table = re.search(r"Load position error on the second lap.*?\n\n", printed, re.DOTALL)[0]
        readme = (ROOT / "README.md").read_text()
        self.assertIn(textwrap.indent(table, "    "), readme)
        study_page = (ROOT / "docs/study.md").read_text()
        for row in PUBLISHED_LAP_2[1:]:
            self.assertRegex(table, rf"{re.escape(row[0])} +{' +'.join(row[1:])}\n")
            self.assertIn(f"| published: {' | '.join(row)} |", study_page)

    def start(self, program, *arguments):
        process = subprocess.Popen([f"{BUILD}/bin/{program}", *arguments], cwd=self.folder,
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def test_laps_are_those_of_the_flight_for_a_recorder_that_joins_late(self):
        domain = self.enterContext(OwnDomain())
        text = (ROOT / "config/scenarios/short.yaml").read_text()
        for old, new in (("recorders: 1", "recorders: 0"), ("period_s: 16", "period_s: 6"),
                         ("for_s: 2", "for_s: 20")):
            self.assertIn(old, text)
            text = text.replace(old, new)
        self.write("s.yaml", text)
        same = ("--scenario", "s.yaml", "--domain", domain)
        # The writer keeps 180 batches of at most 27 steps: step 0 is lost for a late recorder.
        profiles = (ROOT / "config/qos/endpoints.xml").read_text()
        begin = profiles.index('<data_writer profile_name="sls_record_writer">')
        end = profiles.index("</data_writer>", begin) + len("</data_writer>")
        writer = profiles[begin:end].replace("5000<", "180<")
        qos = (ROOT / "config/qos/default.xml").read_text()
        self.write("qos.xml", qos.replace("</profiles>", writer + "</profiles>"))
        server = self.start("sim_server", *same, "--period-s", "0.001", "--qos", "qos.xml")
        operator = ("ctl", "--domain", domain, "--timeout-s", "100")
        self.run_launcher(*operator, "pause")  # the flight begins paused
        client = self.start("control_client", *same)
        self.run_launcher(*operator, "step", "5500")  # the first lap has 6,000 steps
        recorder = self.start("recorder", "--out", "r", "--domain", domain)
        deadline = time.monotonic() + 100
        while len(self.read_rows("command")) < 2000 and time.monotonic() < deadline:
            time.sleep(0.1)
        self.run_launcher(*operator, "resume")
        self.assertEqual([process.wait(200) for process in (server, client)], [0, 0])
        self.assertEqual(recorder.wait(200), 1)  # incomplete

        state, reference = self.read_rows("state"), self.read_rows("reference")
        first = int(state["step"][0])
        self.assertTrue(0 < first < 6000, first)
        self.assertEqual(len(state), 20001 - first)
        error = state["load_x_m"] - reference["ref_x_m"]
        self.run_launcher("report", "r")
        written, page = [(self.folder / "r" / name).read_text()
                         for name in ("flight.txt", "report.html")]
        for label, begin, end in (("lap 1 (part)", first, 6000), ("lap 2", 6000, 12000),
                                  ("lap 3", 12000, 18000), ("lap 4 (part)", 18000, 20001)):
            rms = np.sqrt(np.mean(error[begin - first:end - first]**2))
            self.assertRegex(written, row := rf"\n +{re.escape(label)} +(\S+)")
            number = float(re.search(row, written)[1])
            np.testing.assert_allclose(number, rms, rtol=5e-3)  # three digits
            self.assertIn(f"<td>{label}</td><td>{begin / 1000:g}</td><td>{(end - 1) / 1000:g}</td>"
                          f"<td>{format_error(rms)}</td>", page)
        self.assertEqual(len(re.findall(r"\n +lap ", written)), 4)
        self.assertEqual(page.count("<td>lap "), 4)

    def read_rows(self, name):
        """The rows that are on the disk at this time."""
        path = self.folder / "r" / f"{name}.csv"
        lines = path.read_text().split("\n")[:-1] if path.exists() else []
        return np.genfromtxt(lines, delimiter=",", names=True) if len(lines) > 2 else []
