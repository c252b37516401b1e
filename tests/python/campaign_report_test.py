"""The page of a campaign and the comparison of two, from tables written here."""

import csv
import json
import subprocess
import sys
import unittest
from html.parser import HTMLParser

import browser
import support
import numpy as np
from scipy import stats

from sls.campaign.compare import compare
from sls.campaign.pairs import describe_changes, find_pairs
from sls.campaign.report import make_campaign_report
from sls.campaign.run_table import count_points, leave_out_numbers, read_runs
from sls.campaign.statistics import calc_paired_difference
from sls.input_error import InputError

KEYS = ("vehicle.load_mass_kg", "faults.0.delay.by_s", "controller")
LAWS = ('{law: "qsf", gains: {lqr: 1}}', '{law: "pid", gains: {a: 2}}')
MEASURES = ("load_error_rms_m", "load_error_max_m", "stage_0_settling_x_s", "time_of_loss_s")
CAMPAIGN = """base: eight.yaml
vary:
  vehicle.load_mass_kg: { normal: [0.2, 0.05] }
  faults.0.delay.by_s: { uniform: [0, 0.32] }
  controller: { list: [qsf, pid] }
# <script>alert(1)</script>
"""
ONE_RUN_OF_A_DRAW = "vary: { k: { uniform: [0, 1] } }\n"
NO_DRAWS = "vary: { k: { grid: [0, 1, 20] }, law: { list: [qsf, pid] } }\n"


def make_rows(count, seed=1):
    """Pairs of runs with both laws. A run is lost if its delay is above 0.2 s, or 0.3 s with `pid`."""
    random = np.random.default_rng(seed)
    masses = random.normal(0.2, 0.05, count)
    for run in range(count):
        mass, delay = float(masses[run // 2]), 0.008 * (run // 2 % 41)
        limit = (0.2, 0.3)[run % 2]
        lost = delay > limit
        error = 0.1 + delay + (0.05 if run % 2 else 0.0)
        reason = f"load more than 1 m further from its reference, at {2 + run % 7} s" * lost
        outcome = "lost" if lost else "finished"
        if run % 100 == 99:
            outcome, reason = "failed", "plant: load_x_m is not finite"
        yield [run, repr(mass), repr(delay), LAWS[run % 2], outcome, reason, repr(error),
               repr(2 * error), "inf" if run % 5 == 0 else "3.5",
               repr(2.0 + run % 7) if lost else "", 8000, "ab" * 32]


class Reader(HTMLParser):
    """Parses a page into its tags, attributes and words. `open` lists the tags that are not closed."""

    VOID = {"meta", "link", "img", "br"}

    def __init__(self, page):
        super().__init__()
        self.open, self.tags, self.attributes, self.words = [], [], [], []
        self.feed(page)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += attrs
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += attrs

    def handle_endtag(self, tag):
        assert self.open and self.open[-1] == tag, (tag, self.open[-3:])
        self.open.pop()

    def handle_data(self, data):
        if data.strip():
            self.words.append(data.strip())


class CampaignTest(support.FolderTest):
    def write_campaign(self, name="c", rows=None, header=None, manifest=None, campaign=CAMPAIGN):
        folder = self.folder / name
        folder.mkdir()
        (folder / "campaign.yaml").write_text(campaign)
        (folder / "manifest.json").write_text(json.dumps(manifest or {
            "campaign": "synthetic", "file": "config/campaigns/synthetic.yaml", "engine": "local",
            "versions": {"level": "x86-64-v3"}, "outcomes": {"finished": 3}}))
        with (folder / "runs.csv").open("w", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(header or ["run", *KEYS, "outcome", "reason", *MEASURES, "steps",
                                       "certificate"])
            writer.writerows(make_rows(400) if rows is None else rows)
        return folder

    def expect_input_error(self, call, *parts):
        with self.assertRaises(InputError) as raised:
            call()
        text = str(raised.exception)
        self.assertNotIn("\n", text)
        for part in parts:
            self.assertIn(part, text)


class TableTest(CampaignTest):
    def test_numbers_become_arrays_and_text_becomes_words(self):
        table = read_runs(self.write_campaign() / "runs.csv")
        self.assertEqual((table.keys, table.measures), (KEYS, MEASURES))
        np.testing.assert_array_equal(table.run, np.arange(400))
        self.assertEqual(table.words["controller"][0], list(LAWS))
        self.assertEqual(table.numbers["faults.0.delay.by_s"][2], 0.008)
        self.assertTrue(np.isnan(table.numbers["time_of_loss_s"][0]))
        self.assertTrue(np.isinf(table.numbers["stage_0_settling_x_s"][0]))
        self.assertEqual(sum(table.count(name) for name in ("finished", "lost", "failed")), 400)
        self.assertEqual(table.count("failed"), 4)
        self.assertEqual(sum(table.reasons.values()), table.count("lost") + 4)
        self.assertEqual(len(table.reasons), 2)

    def test_reasons_that_differ_in_numbers_alone_are_one(self):
        self.assertEqual(leave_out_numbers("force beyond limit (200), at 5.912 s"),
                         "force beyond limit (…), at … s")
        self.assertEqual(leave_out_numbers("stage figure_eight_2 at -1e-09 m"),
                         "stage figure_eight_2 at … m")

    def test_numbers_beside_texts_are_one_value_however_they_are_written(self):
        cells = ["1", "2.5", "1", "auto", "1", "2.50", "1.0", "auto"]
        table = read_runs(self.write_campaign(
            rows=[[run, cell, "finished", "", 1, ""] for run, cell in enumerate(cells)],
            header=["run", "k", "outcome", "reason", "steps", "certificate"]) / "runs.csv")
        names, places = table.words["k"]
        self.assertEqual(names, ["1", "2.5", "auto"])
        np.testing.assert_array_equal(places, [0, 1, 0, 2, 0, 1, 0, 2])

    def test_the_draw_of_a_run_follows_from_the_campaign_file(self):
        for text, points in ((CAMPAIGN, 2), (ONE_RUN_OF_A_DRAW, 1), (NO_DRAWS, None), ("vary: [", None),
                             ("vary: { k: { grid: { from: 1, to: 2, values: 5 } } }\nseeds: [s]\n", 5),
                             ("vary: { a: { grid: [0, 1, 3] }, b: { list: [x, y] }, c: { sobol: [0, 1] }, "
                              "d: { derived: c } }\n", 6)):
            self.assertEqual(count_points(self.write("campaign.yaml", text)), points, text)

    def test_errors_of_own_measures_are_no_measure(self):
        folder = self.write_campaign(
            rows=[[0, "0.2", "finished", "", "1.5", "", 10, ""],
                  [1, "0.3", "finished", "", "", "ValueError: no 7", 10, ""]],
            header=["run", "k", "outcome", "reason", "peak_w", "own_error", "steps", "certificate"])
        table = read_runs(folder / "runs.csv")
        self.assertEqual(table.measures, ("peak_w",))
        self.assertEqual(dict(table.reasons), {"own measure: ValueError: no …": 1})
        self.assertIn("own measure: ValueError", make_campaign_report(folder))

    def test_damage_is_named_with_its_line(self):
        folder = self.write_campaign(rows=[*make_rows(2), [2, "0.2"]])
        self.expect_input_error(lambda: read_runs(folder / "runs.csv"), "runs.csv:4:",
                                "expected a run of 12 fields")
        other = self.write_campaign("d", rows=[["x", *row[1:]] for row in make_rows(1)])
        self.expect_input_error(lambda: read_runs(other / "runs.csv"), "runs.csv:2:", "'x'")
        self.expect_input_error(lambda: read_runs(self.folder / "none.csv"), "No such file")
        bad = self.write("bad.csv", "time,x\n1,2\n")
        self.expect_input_error(lambda: read_runs(bad), "bad.csv:1: expected the columns run")


class ReportTest(CampaignTest):
    def test_it_tells_outcomes_intervals_measures_and_the_worst_runs(self):
        folder = self.write_campaign()
        page = make_campaign_report(folder)
        table = read_runs(folder / "runs.csv")
        reader = Reader(page)
        words = " ".join(reader.words)
        for part in ("synthetic", f"{table.count('lost')} lost", "4 failed", "400 runs", "Wilson",
                     "Share lost along each varied key", "Median of the finished runs", "load_error_rms_m (m)",
                     "controller: qsf against pid", "McNemar", "All together", "Worst runs",
                     "./sls campaign config/campaigns/synthetic.yaml --runs 99-99 --out "
                     "/tmp/run-99", "x86-64-v3", "load_x_m is not finite", "base: eight.yaml"):
            self.assertIn(part, words)
        self.assertEqual(reader.open, [])
        # Three keys: 3 shares, 3 pairs with 2 maps each; 4 distributions; parallel coordinates.
        self.assertEqual(reader.tags.count("svg"), 3 + 6 + 4 + 1)

    def test_shares_and_intervals_are_those_of_the_table(self):
        page = make_campaign_report(self.write_campaign(rows=[
            [run, "0.2", "0.1", LAWS[0], "lost" if run < 3 else "finished", "", "1", "1", "1", "",
             1, ""] for run in range(10)], campaign=ONE_RUN_OF_A_DRAW))
        # 3 of 10: Wilson's interval is 10.78 % to 60.32 %, as in textbooks.
        self.assertIn("<td>lost</td><td>3</td><td>30 %</td><td>10.78 % to 60.32 %</td>", page)

    def test_a_field_without_a_finished_run_says_lost_or_failed_and_one_without_a_run_says_so(self):
        rows = [[run, str(run % 3), str(run // 3), LAWS[0], *outcome, "" if outcome[0] != "finished" else "0.5", "1",
                 "1", "", 1, ""] for run, outcome in enumerate(4 * [("finished", "")] + 2 * [("lost", "x")]
                                                               + [("failed", "y")])]
        page = make_campaign_report(self.write_campaign(rows=rows, campaign=NO_DRAWS))
        for title, colour in (("0, 0: 0.5 (1 finished)", "#21908d"), ("2, 1: – (1 lost)", "var(--axis)"),
                              ("0, 2: – (1 failed)", "var(--axis)"), ("1, 2: – (no run)", "var(--missing)")):
            self.assertIn(f'fill="{colour}"><title>{title}</title>', page)
        self.assertNotIn("95 %</th>", page.split("Measures")[0])
        self.assertNotIn("Wilson", page)

    def test_axes_have_names_units_and_round_ticks(self):
        rows = [[run, repr(0.0007 * run), str(run % 20), LAWS[0], "finished" if run % 7 else "lost", "",
                 repr(0.013 * run), "1", "1", "", 1, ""] for run in range(300)]
        words = Reader(make_campaign_report(self.write_campaign(
            rows=rows, manifest={"campaign": "c", "file": "f", "runs_csv_sha256": "abc"}))).words
        for label in ("vehicle.load_mass_kg (kg)", "faults.0.delay.by_s (s)", "load_error_rms_m (m)",
                      "share lost or failed", "runs", "runs up to here", "runs_csv_sha256"):
            self.assertIn(label, words)
        self.assertEqual(words[words.index("share lost or failed") + 1:][:6], [f"{n} %" for n in range(0, 101, 20)])
        first = words.index("vehicle.load_mass_kg (kg)")
        self.assertEqual(words[first - 5:first], ["0", "0.05", "0.1", "0.15", "0.2"])

    def test_it_refers_to_nothing_outside_itself_and_text_is_no_markup(self):
        page = make_campaign_report(self.write_campaign())
        for name, value in Reader(page).attributes:
            if name in ("src", "href"):
                self.assertTrue(value.startswith("data:"), value)
        self.assertNotIn("http", page)
        self.assertNotIn("<script", page)

    def test_the_same_campaign_gives_the_same_bytes(self):
        pages = [make_campaign_report(self.write_campaign(name)) for name in ("a", "b")]
        self.assertEqual(*pages)

    def test_it_copes_with_no_run_one_run_and_nothing_measured(self):
        for name, rows in (("none", []), ("one", list(make_rows(1))), ("lost", [
                [0, "0.2", "0.1", "x", "lost", "", "", "", "", "1.5", 4, ""]])):
            page = make_campaign_report(self.write_campaign(name, rows=rows))
            self.assertEqual(Reader(page).open, [], name)
        folder = self.write_campaign("bare", header=["run", "k", "outcome", "reason", "steps",
                                                     "certificate"],
                                     rows=[[run, run, "finished", "", 1, ""] for run in range(9)])
        self.assertIn("Nothing was measured", make_campaign_report(folder))

    def test_a_hundred_thousand_runs_make_a_small_page_in_little_memory(self):
        folder = self.folder / "c"
        self.write_campaign(rows=make_rows(100_000))
        code = ("import resource, sys, pathlib\n"
                "from sls.campaign.report import make_campaign_report\n"
                "page = make_campaign_report(pathlib.Path(sys.argv[1]))\n"
                "print(len(page.encode()),"
                " resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024)")
        done = subprocess.run([sys.executable, "-c", code, str(folder)], capture_output=True,
                              text=True, check=True, timeout=120)
        size, memory_mb = map(int, done.stdout.split())
        self.assertLess(size, 4_000_000)
        self.assertLess(memory_mb, 300)

    @unittest.skipUnless(browser.PROGRAM, browser.MISSING)
    def test_a_browser_renders_it_without_a_word_and_asks_for_nothing(self):
        folder = self.write_campaign()
        page = self.folder / "report.html"
        page.write_text(make_campaign_report(folder).replace("load_error_rms_m", 58 * "w" + "_rms_m"))
        document, console = browser.render(page, browser.DARK, browser.NARROW)
        self.assertIn('data-ground="rgb(14, 18, 22)"', document)
        self.assertEqual(console, [])
        self.assertIn('data-overflow="0"', document)
        self.assertIn('data-requests="0"', document)
        self.assertIn("Worst runs", document)
        picture = self.folder / "page.png"
        browser.take_picture(page, picture, 2400)
        self.assertGreater(picture.stat().st_size, 50_000)


class PairsTest(CampaignTest):
    def test_runs_that_differ_in_one_key_alone_are_pairs(self):
        table = read_runs(self.write_campaign() / "runs.csv")
        pairs = find_pairs(table, "controller")
        self.assertEqual([pairs.name_a, pairs.name_b], list(LAWS))
        np.testing.assert_array_equal(pairs.in_a, np.arange(0, 400, 2))
        np.testing.assert_array_equal(pairs.in_b, np.arange(1, 400, 2))
        np.testing.assert_array_equal(pairs.draw, np.arange(200))
        self.assertIsNone(find_pairs(table, "faults.0.delay.by_s"))

    def write_crossed(self, draws, points, rng, campaign):
        """Runs of `draws` draws at `points` points with two laws: `pid` is better or worse in all of a draw."""
        shift = rng.choice([-0.1, 0.1], draws)
        return self.write_campaign(
            header=["run", "_u", "k", "law", "outcome", "reason", "e_m", "steps", "certificate"],
            rows=[[run, draw / draws, point, law,
                   "lost" if (shift[draw] > 0) == (law == "pid") else "finished", "",
                   repr(float(1.0 + shift[draw] * (law == "pid"))), 1, ""]
                  for run, (draw, point, law) in enumerate(
                      (draw, point, law) for draw in range(draws) for point in range(points)
                      for law in ("qsf", "pid"))], campaign=campaign), int(np.sum(shift > 0))

    def test_draws_crossed_with_another_key_count_once(self):
        folder, worse = self.write_crossed(
            100, 20, np.random.default_rng(3),
            "vary: { _u: { uniform: [0, 1] }, k: { grid: [0, 1, 20] }, law: { list: [qsf, pid] } }\n")
        pairs = find_pairs(read_runs(folder / "runs.csv"), "law")
        expected = stats.binomtest(worse, 100, 0.5).pvalue
        self.assertGreater(expected, 0.01)
        self.assertIn(f"McNemar's exact p of 100 draws = {expected:.3g}", describe_changes(pairs))
        paired = calc_paired_difference(pairs.a.numbers["e_m"][pairs.in_a],
                                        pairs.b.numbers["e_m"][pairs.in_b], pairs.draw)
        self.assertEqual((paired.count, paired.larger), (100, worse))
        self.assertAlmostEqual(paired.p, expected)

    def test_without_draws_there_is_no_interval_and_no_p(self):
        folder, _ = self.write_crossed(1, 20, np.random.default_rng(3), NO_DRAWS)
        page = make_campaign_report(folder)
        self.assertIn("20 finish with", page)
        for part in ("McNemar", "exact p", " % to ", "Lines: 95 %"):
            self.assertNotIn(part, page)

    def test_runs_without_partners_are_no_pairs(self):
        rows = [row for row in make_rows(400) if row[0] % 2 == 0 or row[0] % 7 == 1]
        table = read_runs(self.write_campaign(rows=rows) / "runs.csv")
        self.assertIsNone(find_pairs(table, "controller"))


class CompareTest(CampaignTest):
    def test_equal_tables_are_told_by_their_bytes(self):
        a, b = self.write_campaign("a"), self.write_campaign("b")
        text = compare(a, b)
        self.assertIn("manifest.json: the same facts", text)
        self.assertIn("runs.csv: the same bytes, 400 runs", text)

    def test_outcomes_and_measures_are_compared_run_by_run(self):
        a = self.write_campaign("a")
        rows = list(make_rows(400))
        changed = [row for row in rows if row[4] == "finished"][:12]
        for row in changed:
            row[4], row[5] = "lost", "something at 3 s"
        for row in rows:
            row[6] = repr(float(row[6]) + 0.25)
        rows[1][7] = "100.0"
        b = self.write_campaign("b", rows=rows,
                                manifest={"campaign": "synthetic", "file": "here.yaml", "engine": "dask"})
        text = compare(a, b)
        for part in ("engine: local | dask", "runs.csv: 400 runs in both",
                     # The 12 runs are of 6 draws, of two runs each: p = 2 / 2^6.
                     "12 finish with A alone, 0 with B alone: McNemar's exact p of 200 draws = 0.0312",
                     "runs with another outcome", "runs that differ most in load_error_rms_m"):
            self.assertIn(part, text)
        line = next(line for line in text.splitlines() if line.startswith("  load_error_rms_m"))
        finished = {row[0] // 2 for row in rows if row[4] == "finished"}
        self.assertEqual(line.split()[1], str(len(finished)))
        self.assertEqual(line.split()[4:8], ["0.25", "0.25", "to", "0.25"])
        self.assertTrue(all(len(line) < 300 for line in text.splitlines()))

    def test_runs_that_only_one_has_are_counted(self):
        a = self.write_campaign("a")
        b = self.write_campaign("b", rows=list(make_rows(400))[100:])
        text = compare(a, b)
        self.assertIn("300 runs in both", text)
        self.assertIn("100 runs only in A", text)
        c = self.write_campaign("c", rows=list(make_rows(400))[:100])
        self.expect_input_error(lambda: compare(b, c), "c/runs.csv", "expected runs that")

    def test_campaigns_of_other_keys_or_values_are_refused_with_the_first_difference(self):
        a = self.write_campaign("a")
        header = ["run", "vehicle.load_mass_kg", "plant.step_s", "controller", "outcome", "reason",
                  *MEASURES, "steps", "certificate"]
        other_keys = self.write_campaign("k", header=header)
        self.expect_input_error(lambda: compare(a, other_keys), "varied key 2",
                                "expected 'faults.0.delay.by_s'", "got 'plant.step_s'")
        rows = list(make_rows(400))
        rows[7][1], rows[9][2], rows[300][3] = "0.3", "0.5", "x"
        other_values = self.write_campaign("v", rows=rows)
        self.expect_input_error(lambda: compare(a, other_values), "run 7: vehicle.load_mass_kg",
                                "got 0.3")
        rows = list(make_rows(400))
        rows[7][1] = "heavy"
        words = self.write_campaign("w", rows=rows)
        self.expect_input_error(lambda: compare(a, words), "run 7: vehicle.load_mass_kg",
                                "got heavy")

    def test_folders_without_a_result_are_refused(self):
        a = self.write_campaign("a")
        self.expect_input_error(lambda: compare(a, self.folder / "nowhere"),
                                "nowhere/manifest.json")
        (a / "runs.csv").unlink()
        self.expect_input_error(lambda: compare(a, a), "a/runs.csv", "no such file")
