"""Command lines, figures and reports, from recordings written here; the report in a browser."""

import base64
import os
import re
import subprocess
import sys
import unittest
from unittest import mock
from dataclasses import replace
from pathlib import Path

import browser
import support
import numpy as np

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from places import BUILD, ROOT
from sls import figures
from sls.recordings import Recording
from support import write_recording

LONG = "_figure_eight_with_a_heavier_load_a_delay_and_a_gust_from_the_north"[:63]
NO_SCENE = "sls: report without its scene: "
VIEWER, FLYER = BUILD / "bin/sls_view", BUILD / "bin/closed_loop"
os.environ.pop("SLS_VIEW", None)  # only tests of the scene use sls_view

ALL = {"positions", "errors", "path", "angles", "forces", "attitude"}
BODY = ALL - {"attitude"} | {"body_attitude", "body_rates", "rotors", "thrust"}


def names_of(folder, kind):
    return {path.stem for path in Path(folder).glob(f"*.{kind}")}


def without_drawing(test):
    """Where only names or text count: figures are made but empty files are written, because drawing takes seconds."""
    return mock.patch("sls.figures.save", lambda figure, path, *_, **__: path.write_text("<svg></svg>"))(test)


class PlotTest(support.FolderTest):
    def load(self, **what):
        return Recording(write_recording(self.folder / "r", **what)).load_flight(0, "r")

    @without_drawing
    def test_one_recording_gives_every_figure_as_png_and_pdf_beside_it(self):
        write_recording(self.folder / "r")
        code, output = self.run_sls("plot", "r")
        self.assertEqual((code, output), (0, "sls: figures: r/figures\n"))
        self.assertEqual(names_of(self.folder / "r/figures", "png"), ALL)
        self.assertEqual(names_of(self.folder / "r/figures", "pdf"), ALL)

    def test_the_same_recording_gives_the_same_bytes_as_png_and_pdf(self):
        write_recording(self.folder / "r")
        for place, panels in (("first", ("errors", "path")), ("again", ("path",))):
            self.assertEqual(self.run_sls("plot", "r", "--out", place, "--panels", *panels)[0], 0)
        first, again = ({path.name: path.read_bytes() for path in (self.folder / place).glob("path.*")}
                        for place in ("first", "again"))
        self.assertEqual({name: data[:4] for name, data in again.items()}, {"path.png": b"\x89PNG", "path.pdf": b"%PDF"})
        self.assertEqual(first, again)

    @without_drawing
    def test_several_are_overlaid_with_names_and_a_log_without_forces_is_no_obstacle(self):
        write_recording(self.folder / "r", last=150, complete=False)
        self.write("log.csv", "Time,qx,qy,qz,lx,ly,lz,a,b\n"
                              "0,0,0,-2,0,0,-1,0,0\n1,0,0,-2,0,0,-1,0,0\n")
        code, output = self.run_sls("plot", "r", "log.csv", "--out", "o", "--name", "ours",
                                         "published")
        self.assertEqual(code, 0, output)
        self.assertIn("sls: r: incomplete: its recorder was killed", output)
        self.assertEqual(names_of(self.folder / "o", "png"), ALL)
        # Without a recording there is neither an error nor a force.
        self.assertEqual(self.run_sls("plot", "log.csv", "--out", "p")[0], 0)
        self.assertEqual(names_of(self.folder / "p", "png"), {"positions", "path", "angles"})

    @without_drawing
    def test_a_fleet_has_an_overview_of_all_and_figures_of_one(self):
        write_recording(self.folder / "r", last=50, vehicles=(0, 1, 2))
        self.assertEqual(self.run_sls("plot", "r", "--vehicle", "2")[0], 0)
        self.assertEqual(names_of(self.folder / "r/figures", "png"), ALL | {"fleet"})
        self.expect_refused(["plot", "r", "--vehicle", "3"], "expected a vehicle of this recording")

    def test_a_flight_of_one_state_has_no_figures_and_no_axes(self):
        write_recording(self.folder / "r", last=0, complete=False, rotors=4)
        code, output = self.run_sls("plot", "r")
        self.assertEqual(code, 2)
        self.assertIn("sls: error: r: expected a flight of two states or more, got one that ended at its first", output)
        self.assertFalse((self.folder / "r/figures").exists())
        self.assertEqual(self.run_sls("report", "r")[0], 0)
        page = (self.folder / "r/report.html").read_text()
        self.assertIn("No data: the flight ended at step 0.", page)
        self.assertNotIn("<figure", page)

    @without_drawing
    def test_a_multirotor_has_figures_of_attitude_rates_rotors_and_thrust(self):
        write_recording(self.folder / "r", last=50, rotors=4, vehicles=(0, 1))
        write_recording(self.folder / "six", last=50, rotors=6)
        write_recording(self.folder / "point", last=50)
        self.assertEqual(self.run_sls("plot", "r")[0], 0)
        self.assertEqual(names_of(self.folder / "r/figures", "png"), BODY | {"fleet"})
        self.assertEqual(self.run_sls("report", "r")[0], 0)
        page = (self.folder / "r/report.html").read_text()
        self.assertEqual(set(re.findall(r'<figure id="(\w+)">', page)), BODY | {"fleet"})
        # Together with a point mass, and with a vehicle that has another number of rotors.
        self.assertEqual(self.run_sls("plot", "point", "r", "six", "--out", "o")[0], 0)
        self.assertEqual(names_of(self.folder / "o", "png"), BODY)

    def test_load_and_quadrotor_have_one_colour_each_in_scene_and_figures(self):
        flight = self.load(last=50)
        drawn = figures.make_figures([flight])
        colours = dict(re.findall(r"--(\w+): (#\w+)", (ROOT / "python/sls/colours.css").read_text()))
        lines = {line.get_label(): line.get_color() for line in drawn["positions"].axes[0].lines}
        self.assertEqual((lines["load"], lines["quadrotor"], lines["reference"]),
                         (colours["load"], colours["quad"], colours["reference"]))
        self.assertEqual(drawn["errors"].axes[0].lines[0].get_color(), colours["load"])
        self.assertEqual(drawn["forces"].axes[0].lines[0].get_color(), colours["quad"])
        style = "".join(file.read_text() for file in (ROOT / "tools/view/page/src").rglob("*.css"))
        self.assertIn("python/sls/colours.css", style)
        for colour in colours.values():
            self.assertNotIn(colour, style)

    def test_flights_drawn_together_differ_in_line_style_too(self):
        flight = self.load(last=50)
        flights = [replace(flight, name=str(number)) for number in range(9)]
        for name, figure in figures.make_figures(flights).items():
            lines = [line for line in figure.axes[0].lines if line.get_label() != "reference"]
            styles = [(line.get_color(), line.get_linestyle()) for line in lines]
            self.assertEqual(len(set(styles)), 9, name)
            self.assertEqual(len({style for _, style in styles}), 4, name)

    def test_a_long_line_is_thinned_and_keeps_its_extremes_and_gaps(self):
        values = np.sin(np.arange(300_000) * 1e-3)
        values[[123_457, 200_001, -1]] = 9, -8, 7
        values[150_000:150_003] = np.nan
        axes = Figure().add_subplot()
        figures.draw(axes, np.delete(np.arange(300_000.0), slice(50_000, 90_000)), np.delete(values, slice(50_000, 90_000)))
        x, y = axes.lines[0].get_data()
        self.assertLess(len(y), 45_000)
        self.assertEqual((np.nanmax(y), np.nanmin(y), y[-1]), (9, -8, 7))
        self.assertTrue(np.all(np.diff(x[np.isfinite(x)]) > 0))
        for begin, end in ((49_900, 90_100), (149_900, 150_100)):  # a NaN parts the line there
            self.assertTrue(np.isnan(y[np.argmax(x > begin):np.argmax(x > end)]).any())

    def test_a_report_takes_little_memory_for_each_step(self):
        scenario = (ROOT / "config/scenarios/short.yaml").read_text().replace("period_s: 0.004", "period_s: 0.001")
        measure = ("import re, sys; from sls import figures; from sls.__main__ import main; "
                   "figures.LINE_POINTS = 10_000; code = main(['report', sys.argv[1]]); "
                   "print(re.search(r'VmHWM:\\s*(\\d+)', open('/proc/self/status').read())[1]); sys.exit(code)")
        kilobytes = []
        for seconds in (15, 65):  # beyond the most points of a line
            file = self.write("long.yaml", scenario.replace("for_s: 2", f"for_s: {seconds}"))
            subprocess.run([FLYER, f"--scenario={file}", f"--out={self.folder / 'r'}", "--force"], check=True,
                           capture_output=True)
            kilobytes.append(int(subprocess.run([sys.executable, "-B", "-c", measure, self.folder / "r"], check=True,
                                                capture_output=True, text=True).stdout))
        self.assertLess((kilobytes[1] - kilobytes[0]) / 50_000, 0.4, kilobytes)

    def test_figures_for_a_paper_have_its_width_no_title_and_the_chosen_panels(self):
        write_recording(self.folder / "r", last=50)
        code, output = self.run_sls("plot", "r", "--paper", "1", "--panels", "errors:2,6", "path", "--out", "o")
        self.assertEqual(code, 0, output)
        self.assertEqual({path.name for path in (self.folder / "o").iterdir()}, {"errors.pdf", "path.pdf"})
        box = re.search(rb"/MediaBox \[ 0 0 (\S+) ", (self.folder / "o/errors.pdf").read_bytes())
        self.assertEqual(float(box[1]), 3.5 * 72)
        self.assertNotIn(b"/Type3", (self.folder / "o/errors.pdf").read_bytes())
        flight = Recording(self.folder / "r").load_flight(0, "r")
        figure = figures.make_figures([flight], (), 2.0, {"errors": [2, 6]})["errors"]
        self.assertEqual([axes.get_ylabel() for axes in figure.axes], ["|x| (m)", "|z| (m)"])
        self.assertEqual(([axes.get_xlabel() for axes in figure.axes], figure.texts), (["", "time (s)"], []))
        self.expect_refused(["plot", "r", "--panels", "errors:7"], "--panels: expected panels of 1 to 6 of", "got 7")
        self.expect_refused(["plot", "r", "--panels", "rotors"], "some of positions, errors, ", "got 'rotors'")
        self.expect_refused(["plot", "r", "--panels", "errors:x"], "expected NAME or NAME:N,…, got 'errors:x'")
        self.expect_refused(["plot", "r", "--paper", "9"], "--paper: expected 0.5 to 4 columns, got '9'")

    def test_an_error_that_is_always_0_has_no_logarithmic_axis(self):
        figure = figures.make_figures([self.load(last=50)])["errors"]  # a set-point: no error in x and y
        self.assertEqual([axes.get_yscale() for axes in figure.axes], ["linear"] * 5 + ["log"])
        self.assertEqual([text.get_text() for text in figure.axes[1].texts], ["0 at every step"])
        self.assertEqual(list(figure.axes[1].get_yticks()), [])

    def test_long_names_stay_within_the_figure(self):
        flight = self.load(last=50)
        for paper in (None, 1.0):
            flights = [replace(flight, name=f"{number}{LONG}") for number in range(5)]
            figure = figures.make_figures(flights, (), paper)["errors"]
            FigureCanvasAgg(figure).draw()
            legend, page = figure.legends[0].get_window_extent(), figure.bbox
            self.assertLessEqual(legend.x1, page.x1)
            self.assertGreater(legend.y0, max(axes.get_window_extent().y1 for axes in figure.axes))

    def test_commanded_and_actual_motion_are_drawn_together(self):
        flight = self.load(last=50, rotors=4)
        drawn = figures.make_figures([flight])
        for name, rows in (("body_attitude", 3), ("rotors", 4), ("thrust", 1)):
            all_axes = drawn[name].axes
            self.assertEqual([len(axes.lines) for axes in all_axes[:rows]], [2] * rows, name)
            labels = all_axes[0].get_legend_handles_labels()[1]
            self.assertEqual(labels, ["set-point", "real"], name)
        steps = np.arange(1, 51)  # at step 0 there is no set-point yet
        for axis in range(3):
            asked, real = [line.get_ydata() for line in drawn["body_attitude"].axes[axis].lines]
            expected = np.degrees([support.angles_of(step)[axis] for step in steps])
            np.testing.assert_allclose(asked[1:], expected, rtol=0, atol=1e-12)
            np.testing.assert_allclose(real[1:], expected - np.degrees(0.01), rtol=0, atol=1e-12)
            self.assertTrue(np.isnan(asked[0]))
        asked, real = [line.get_ydata() for line in drawn["rotors"].axes[3].lines]
        np.testing.assert_array_equal(asked, 940 + np.arange(51))
        np.testing.assert_array_equal(real, asked - 5)
        asked, real = [line.get_ydata() for line in drawn["thrust"].axes[0].lines]
        self.assertEqual((asked[1], real[1]), (16, 15.5))
        self.assertEqual(drawn["thrust"].axes[1].lines[0].get_ydata()[1], 1.96)
        rate = drawn["body_rates"].axes[1].lines[0].get_ydata()
        np.testing.assert_allclose(rate, np.degrees(-0.2))

    def test_every_stage_is_marked_on_all_axes(self):
        flight = self.load(last=600)
        eight = flight.stages[1]
        flight = replace(flight, stages=(*flight.stages[:1], replace(eight, end=500),
                                         replace(eight, index=2, first=500)))
        for name, figure in figures.make_figures([flight]).items():
            marks = [len([line for line in axes.lines if len(line.get_xdata()) == 2])
                     for axes in figure.axes]
            if name != "path":
                self.assertEqual(marks, [2] * len(marks), name)

    def test_no_line_is_drawn_where_an_angle_goes_on_at_its_other_end(self):
        angles = np.radians([[170.0, 0], [179, 1], [-179, 2], [-170, 3]])
        broken = figures.break_at_turns(angles)
        np.testing.assert_array_equal(np.isnan(broken[:, 0]), [False, False, True, False])
        np.testing.assert_array_equal(broken[:, 1], angles[:, 1])

    def test_mistakes_are_refused_in_one_line(self):
        write_recording(self.folder / "r", last=5)
        self.write("f", "")
        (self.folder / "empty").mkdir()
        self.expect_refused(["plot"], "plot: the following arguments are required: DIR")
        self.expect_refused(["plot", "nowhere"], "nowhere: expected a file, got: No such file")
        self.expect_refused(["plot", "empty"], "empty: expected a recording")
        self.expect_refused(["report", "empty"], "empty: expected a recording")
        self.expect_refused(["report", "f"], "f: expected a recording")
        self.expect_refused(["plot", "r", "--name", "a", "b"], "--name: expected 1 names", "got 2")
        self.expect_refused(["plot", "r", "--out", "f"], "--out f: expected a folder, got: File")
        self.expect_refused(["plot", "r", "--nonsense"], "unrecognized arguments: --nonsense")
        self.expect_refused(["plot", "r", "--format", "csv"], "--format: invalid choice: 'csv'")
        self.expect_refused(["nonsense"], "invalid choice: 'nonsense'")
        self.expect_refused(["study", "--reuse", "--recordings", "empty", "--out", "s"],
                            "empty/figure_eight_1ms: expected a recording")

    def test_only_the_view_turns_z_up_and_stays_right_handed(self):
        axes = figures.to_z_up(np.eye(3))
        np.testing.assert_array_equal(axes[2], [0, 0, -1])
        self.assertEqual(np.linalg.det(axes), 1.0)

    def test_no_line_is_drawn_across_a_gap(self):
        time_s = np.array([0.0, 0.1, 0.2, 0.6, 0.7])
        times, values = figures.break_at_gaps(time_s, np.arange(5.0))
        np.testing.assert_array_equal(times, [0, 0.1, 0.2, np.nan, 0.6, 0.7])
        np.testing.assert_array_equal(values, [0, 1, 2, np.nan, 3, 4])


class ReportTest(support.FolderTest):
    def make_page(self, **what):
        write_recording(self.folder / "r", **what)
        code, output = self.run_sls("report", "r")
        self.assertEqual(code, 0)
        self.assertRegex(output, f"^{NO_SCENE}expected the program sls_view.*\nsls: report: r/report.html\n$")
        return (self.folder / "r/report.html").read_text()

    @without_drawing
    def test_it_tells_scenario_parameters_metrics_events_and_figures(self):
        page = self.make_page()
        for part in ("<title>synthetic: flight report</title>", "complete", "timing: exact",
                     "0123456789abcdef", "1.5 kg", "0.2 kg", "0.01 s", "lockstep",
                     "0 set_point", "1 eight, &quot;two laps&quot;", "lap 2", "1.96", "0.010",
                     "waiting: waiting for: recorder, client", "finished: mission finished",
                     "resent 7", "figure_eight: { amplitude_m", "f" * 64):
            self.assertIn(part, page)
        self.assertEqual(set(re.findall(r'<figure id="(\w+)">', page)), ALL)

    @without_drawing
    def test_a_stage_may_be_called_anything(self):
        write_recording(self.folder / "r")
        path = self.folder / "r/reference.csv"
        path.write_text(path.read_text().replace(",set_point,", ",a|b|c,"))
        self.assertEqual(self.run_sls("report", "r")[0], 0)
        page = (self.folder / "r/report.html").read_text()
        self.assertEqual(page.count("<tr><td>0 a|b|c</td><td>0</td><td>3.99</td>"), 2)

    @without_drawing
    def test_it_says_what_is_missing(self):
        page = self.make_page(last=150, complete=False, missing=[
            {"vehicle_id": 0, "topic": "sls/state", "from": 151, "to": 160}])
        for part in (">incomplete<", "its recorder was killed", "10 samples missing"):
            self.assertIn(part, page)

    @without_drawing
    def test_text_of_a_recording_is_text_and_no_markup(self):
        write_recording(self.folder / "r", last=5)
        path = self.folder / "r/scenario.yaml"
        path.write_text(path.read_text() + "# <script>alert(1)</script>\n")
        self.assertEqual(self.run_sls("report", "r")[0], 0)
        self.assertNotIn("<script", (self.folder / "r/report.html").read_text())

    @unittest.skipUnless(browser.PROGRAM, browser.MISSING)
    def test_a_browser_renders_it_without_a_word(self):
        text = self.make_page(vehicles=(0, 1))
        for reference in re.findall(r'(?:src|href)="([^"]*)"', text):
            self.assertTrue(reference.startswith("data:"), reference[:80])
        self.assertNotIn("http", re.sub(r'"data:[^"]*"', "", text))
        for picture in re.findall(r'src="data:image/svg\+xml;base64,([^"]*)"', text):
            self.assertIn(b"prefers-color-scheme: dark", base64.b64decode(picture))
        document, console = browser.render(self.folder / "r/report.html")
        self.assertEqual(console, [])
        self.assertIn('data-seen="7"', document)
        self.assertIn('data-broken="0"', document)
        self.assertIn('data-overflow="0"', document)
        self.assertIn('data-requests="0"', document)
        self.assertIn('data-ground="rgb(244, 245, 247)"', document)
        self.assertIn("Load position error per stage", document)

    @unittest.skipUnless(browser.PROGRAM, browser.MISSING)
    @without_drawing
    def test_in_the_dark_the_page_is_dark_and_long_names_fit_700_pixels(self):
        write_recording(self.folder / "r")
        for name in ("manifest.json", "scenario.yaml", "reference.csv"):
            path = self.folder / "r" / name
            path.write_text(path.read_text().replace("synthetic", f"s{LONG}").replace(",set_point,", f",s{LONG},"))
        self.assertEqual(self.run_sls("report", "r")[0], 0)
        document, _ = browser.render(self.folder / "r/report.html", browser.DARK, browser.NARROW)
        self.assertIn('data-ground="rgb(14, 18, 22)"', document)
        self.assertIn('data-overflow="0"', document)

    @unittest.skipUnless(browser.PROGRAM, browser.MISSING)
    def test_the_browser_would_tell_what_is_wrong(self):
        page = self.write("bad.html", '<body><div style="width: 3000px">x</div>'
                                      '<img src="data:image/png;base64,AAAA">'
                                      "<script>console.error('no good')</script></body>")
        document, console = browser.render(page)
        self.assertIn('data-broken="1"', document)
        self.assertNotIn('data-overflow="0"', document)
        self.assertTrue(any("no good" in line for line in console), console)


class SceneTest(support.FolderTest):
    def make_report(self, folder, program):
        with mock.patch.dict(os.environ, {"SLS_VIEW": str(program)}):
            code, output = self.run_sls("report", folder)
        self.assertEqual(code, 0, output)
        page = self.folder / folder / "report.html"
        self.assertLessEqual(page.stat().st_size, 4_000_000)
        return page, output

    def fly(self, name, text=None):
        """Flies a shipped scenario, or `text`. Returns the recording's folder."""
        text = text or (ROOT / f"config/scenarios/{name}.yaml").read_text()
        scenario = self.write(f"{name}.yaml", text)
        subprocess.run([FLYER, "--scenario", scenario, "--out", self.folder / name], check=True,
                       capture_output=True, timeout=200)
        return name

    @without_drawing
    def test_a_program_that_fails_leaves_a_report_without_scene_and_one_line(self):
        write_recording(self.folder / "r", last=50)
        program = self.write("fails", "#!/bin/sh\necho first >&2\necho 'error: no page' >&2\nexit 1\n", 0o755)
        page, output = self.make_report("r", program)
        self.assertNotIn("<iframe", page.read_text())
        self.assertEqual(output, f"{NO_SCENE}error: no page\nsls: report: r/report.html\n")
        program.chmod(0o644)
        page, output = self.make_report("r", program)
        self.assertEqual(output.count("\n"), 2, output)
        self.assertIn(NO_SCENE, output)

    @unittest.skipUnless(browser.PROGRAM, browser.MISSING)
    def test_the_scene_is_not_printed(self):
        write_recording(self.folder / "r", last=0)
        program = self.write("scene", '#!/bin/sh\necho "<p>scene" > "$3"\n', 0o755)
        page, _ = self.make_report("r", program)
        self.assertIn("<iframe", page.read_text())
        with_scene = browser.count_printed_pages(page)
        page.write_text(re.sub("<iframe.*</iframe>", "", page.read_text(), flags=re.DOTALL))
        self.assertEqual(with_scene, browser.count_printed_pages(page))

    @without_drawing
    def test_a_program_that_writes_too_much_leaves_a_report_without_scene(self):
        write_recording(self.folder / "r", last=50)
        program = self.write("much", '#!/bin/sh\nhead -c 5000000 /dev/zero | tr "\\0" x > "$3"\n', 0o755)
        page, output = self.make_report("r", program)
        self.assertNotIn("<iframe", page.read_text())
        self.assertIn(f"{NO_SCENE}expected at most", output)

    @unittest.skipUnless(VIEWER.exists() and FLYER.exists(), "skipped: no sls_view in this build")
    def test_the_scene_is_in_the_report_and_the_same_recording_gives_the_same_bytes(self):
        page, output = self.make_report(self.fly("short"), VIEWER)
        self.assertEqual(output, "sls: report: short/report.html\n")
        first = page.read_bytes()
        self.assertEqual(first.count(b"<iframe"), 1)
        self.make_report("short", VIEWER)
        self.assertEqual(page.read_bytes(), first)

    @unittest.skipUnless(VIEWER.exists() and FLYER.exists(), "skipped: no sls_view in this build")
    def test_fleets_stay_within_4_mb(self):
        self.expect_large_scene(self.fly("fleet"))

    @unittest.skipUnless(VIEWER.exists() and FLYER.exists(), "skipped: no sls_view in this build")
    @without_drawing
    def test_scenes_of_long_flights_stay_within_4_mb(self):
        text = (ROOT / "config/scenarios/figure_eight.yaml").read_text()
        self.expect_large_scene(self.fly("long", re.sub(r"for_s: \d+", "for_s: 160", text)))

    @unittest.skipUnless(FLYER.exists(), "skipped: no closed_loop in this build")
    @without_drawing
    def test_one_load_on_cables_is_told_once_with_its_cables(self):
        text = (ROOT / "config/scenarios/cable_cut.yaml").read_text()
        name = self.fly("cable_cut", text.replace("release_s: 8", "release_s: 1").replace("for_s: 22", "for_s: 2"))
        flights = Recording(self.folder / name).load_fleet()
        drawn = figures.make_figures(flights[:1], flights)
        self.assertLessEqual({"team", "cables", "load_attitude"}, drawn.keys())
        self.assertNotIn("fleet", drawn)
        tension, length, _ = drawn["cables"].axes
        self.assertEqual(len(tension.lines), 4)
        for flight in flights:  # all vehicles find the same centre of the load
            np.testing.assert_allclose(flight.cable.p_WC, flights[0].cable.p_WC, rtol=0, atol=1e-12)
        page, _ = self.make_report(name, "")
        text = page.read_text()
        for part in ("0.25 kg, of it 0.0625 kg the share of this vehicle", "cable length", "<h2>Cables</h2>",
                     "Ends of all cables"):
            self.assertIn(part, text)
        self.assertRegex(text, r"<tr><td>0</td>(<td>[^<]*</td>){6}<td>1.004</td></tr>")  # the first step after the cut at 1 s
        self.assertRegex(text, r"<tr><td>3</td>(<td>[^<]*</td>){6}<td>–</td></tr>")

    def expect_large_scene(self, name):
        page, output = self.make_report(name, VIEWER)
        self.assertEqual(page.read_text().count("<iframe"), 1, output)
        self.assertGreater(page.stat().st_size, 2_000_000)  # the scene uses the allowed bytes
