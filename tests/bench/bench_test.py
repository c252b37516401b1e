"""`./sls bench`: its arithmetic on given numbers; that it runs, prints and writes what it says; and what
it answers to mistakes. How fast anything is, is no business of a test."""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(sys.argv.pop()).resolve() if __name__ == "__main__" else ROOT / "build"
sys.path.insert(0, str(ROOT))

from bench import loop, parts  # noqa: E402
from bench.programs import find_placements  # noqa: E402
from bench.results import LESS, Figure, format_number, format_table  # noqa: E402

GOOGLE_BENCHMARK = BUILD / "bin/sls_microbench"


def bench(*words, check=0):
    done = subprocess.run([ROOT / "sls", "bench", *map(str, words)], capture_output=True, text=True,
                          env={**os.environ, "SLS_BUILD": str(BUILD)}, timeout=240, check=False)
    if check is not None and done.returncode != check:
        raise AssertionError(f"ended with {done.returncode}: {done.stdout}{done.stderr}")
    return done


class BreakdownTest(unittest.TestCase):
    def test_each_part_is_what_its_round_trip_takes_longer_and_they_add_up(self):
        parts_of_step = loop.calc_parts(10, 11, 20, 43, 50)
        self.assertEqual(parts_of_step.pop("sum: one step with recorder"), 50)
        self.assertEqual(list(parts_of_step.values()), [10, 1, 20, 12, 7])
        self.assertEqual(sum(parts_of_step.values()), 50)


class FigureTest(unittest.TestCase):
    def test_the_ratio_is_of_the_figure_and_the_bound_of_the_same_round(self):
        figure = Figure("part", "speed", "steps/s", [80.0, 90.0, 50.0], "bound", [100.0, 100.0, 50.0])
        self.assertEqual(figure.ratios, [0.8, 0.9, 1.0])
        json_figure = figure.to_json()
        self.assertEqual(json_figure["ratio"]["median"], 0.9)  # not that of the medians, 0.8
        self.assertEqual((json_figure["median"], json_figure["min"], json_figure["max"]), (80, 50, 90))
        self.assertEqual(json_figure["bound"]["median"], 100)

    def test_where_less_is_better_the_ratio_falls_as_the_figure_grows(self):
        self.assertEqual(Figure("part", "time", "µs", [4.0], "bound", [1.0], LESS).ratios, [0.25])

    def test_goals_are_of_figures_or_of_their_ratios(self):
        speed = Figure("part", "speed", "rows/s", [99.0], goal=100)
        self.assertFalse(speed.is_goal_reached)
        share = Figure("part", "speed", "rows/s", [86.0], "bound", [100.0], goal=0.85,
                       is_goal_of_ratio=True)
        self.assertTrue(share.is_goal_reached)
        self.assertTrue(Figure("part", "growth", "1", [0.9], better=LESS, goal=1).is_goal_reached)
        self.assertFalse(Figure("part", "growth", "1", [1.1], better=LESS, goal=1).is_goal_reached)
        self.assertIsNone(Figure("part", "speed", "rows/s", [99.0]).is_goal_reached)
        self.assertNotIn("goal", Figure("part", "speed", "rows/s", [99.0]).to_json())

    def test_figures_without_values_or_with_bounds_of_other_rounds_are_refused(self):
        for values, bounds in (([], []), ([1.0, 2.0], [1.0]), ([1.0], [0.0]), ([0.0], [1.0])):
            with self.assertRaisesRegex(ValueError, "^part, name: expected "):
                Figure("part", "name", "s", values, "bound", bounds)

    def test_the_table_has_a_line_for_each_figure_and_one_for_each_bound(self):
        figures = [Figure("one", "first", "s", [1.0, 3.0, 2.0], "the bound", [1.0, 1.0, 1.0], LESS),
                   Figure("one", "second", "s", [1234.5], "the bound", [2469.0]),
                   Figure("two", "third", "m", [0.125], goal=1)]
        lines = format_table(figures).split("\n")
        self.assertEqual([line.split()[0] for line in lines],
                         ["figure", "one", "bound:", "first", "second", "two", "third"])
        self.assertRegex(lines[3], r"first +s +2 \(1 … 3\) +1 \(1 … 1\) +0\.50$")
        self.assertRegex(lines[4], r"second +s +1,234 +2,469 +0\.50$")
        self.assertRegex(lines[6], r"third +m +0\.125 +≥ 1: missed$")

    def test_numbers_have_three_digits_or_are_whole(self):
        self.assertEqual([format_number(x) for x in (0, 0.0012345, 1.23456, 99.96, 12345.6)],
                         ["0", "0.00123", "1.23", "100", "12,346"])


class DistributionTest(unittest.TestCase):
    def test_percentiles_are_of_the_nearest_rank(self):
        values = [float(x) for x in range(1000, 0, -1)]
        self.assertEqual([loop.percentile(values, share) for share in loop.PERCENTILES.values()],
                         [500, 990, 999, 1000])
        self.assertEqual(loop.percentile([7.0], 0.5), 7)

    def test_of_a_sample_sent_again_the_first_time_counts(self):
        self.assertEqual(loop.parse_stamps("0,1000\n0,9000\n1,2000\n"), {0: 1000, 1: 2000})

    def test_no_step_is_counted_twice_or_with_a_rest_in_it(self):
        before = {step: step * 100_000 for step in range(5)}
        after = {step: step * 100_000 + 10**9 for step in range(5, 8)}
        batches = [before, {**{3: 300_000, 4: 400_000}, **after}]
        # 0→1 … 3→4 before the rest, which is between 4 and 5; 5→6 and 6→7 after it.
        self.assertEqual(loop.calc_step_times(batches), [100.0] * 6)

    def test_lateness_counts_from_the_earliest_state(self):
        self.assertEqual(loop.calc_lateness({0: 5_000, 1: 1_004_000, 3: 3_010_000}, 1_000_000),
                         [1.0, 0.0, 6.0])

    def test_late_steps_are_read_from_the_label(self):
        self.assertEqual(loop.count_late("real-time, 3 of 500 late, worst age 4 ms"), 3)
        self.assertEqual(loop.count_late("degraded: real-time, 7 of 500 late, worst age 8 ms, "
                                         "1 s lost in 2 slips"), 7)
        with self.assertRaises(loop.MeasurementError):
            loop.count_late("exact")


class RealTimeSearchTest(unittest.TestCase):
    def search(self, most):
        seen = []

        def holds(_, vehicles, __):
            seen.append(vehicles)
            return vehicles <= most

        original, parts.holds_real_time = parts.holds_real_time, holds
        try:
            return parts.find_most_in_real_time(None, False).median, seen
        finally:
            parts.holds_real_time = original

    def test_the_largest_fleet_that_holds_is_found(self):
        for most in (0, 10, 90, 100, 170, 250):
            found, seen = self.search(most)
            self.assertEqual(found, most)
            self.assertLessEqual(max(seen), 256)


class ProgramTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_mistakes_give_one_line_and_exit_code_two(self):
        for words, cause in ((["--only", "nonsense"], "nonsense"), (["--nonsense"], "--nonsense"),
                             (["--only"], "--only"), (["--json", self.folder / "no/file"], "--json"),
                             (["--out", "/proc/none"], "--out")):
            said = bench(*words, check=2).stderr
            self.assertEqual(said.count("\n"), 1, said)
            self.assertIn("error: ", said)
            self.assertIn(cause, said)

    def test_help_names_every_part(self):
        said = bench("--help").stdout
        for part in ("lockstep", "breakdown", "round-trip", "realtime", "plant", "recorder", "fleet", "qos"):
            self.assertIn(part, said)

    def check(self, file, part):
        result = json.loads(file.read_text())
        self.assertTrue(result["quick"])
        self.assertGreaterEqual(result["machine"]["cores"], 1)
        self.assertEqual({figure["part"] for figure in result["figures"]}, {part})
        for figure in result["figures"]:
            self.assertLessEqual(figure["min"], figure["median"])
            self.assertLessEqual(figure["median"], figure["max"])
            if "ratio" in figure:
                self.assertGreater(figure["ratio"]["min"], 0)
        return result["figures"]

    def test_a_quick_lockstep_part_has_bounds_a_table_and_a_plot(self):
        file = self.folder / "bench.json"
        words = ["--quick", "--only", "lockstep", "--json", file]
        try:
            import matplotlib  # noqa: F401
            words += ["--out", self.folder / "plots"]
        except ImportError:
            pass
        said = bench(*words)
        figures = self.check(file, "lockstep")
        self.assertIn("shared memory, with recorder", said.stdout)
        # In each placement of the programs two transports, with and without recorder, and once more
        # with one beside without.
        self.assertEqual(sum("ratio" in figure for figure in figures), 6 * len(find_placements()))
        if "--out" in words:
            self.assertTrue((self.folder / "plots/lockstep.png").read_bytes().startswith(b"\x89PNG"))
            self.assertIn("<svg", (self.folder / "plots/lockstep.svg").read_text())

    def test_the_breakdown_has_the_same_parts_for_each_transport_and_placement(self):
        file = self.folder / "bench.json"
        bench("--quick", "--only", "breakdown", "--json", file)
        steps = {}
        for figure in self.check(file, "breakdown"):
            where, name = figure["name"].split(": ", 1)
            steps.setdefault(where, set()).add(name)
        self.assertEqual(len(steps), 2 * len(find_placements()))
        for names in steps.values():
            self.assertEqual(names, set(loop.calc_parts(1, 2, 3, 4, 5)))

    def test_a_quick_recorder_part_loses_nothing(self):
        file = self.folder / "bench.json"
        bench("--quick", "--only", "recorder", "--json", file)
        names = [figure["name"] for figure in self.check(file, "recorder")]
        self.assertTrue(any("recorder process" in name for name in names), names)

    @unittest.skipUnless(GOOGLE_BENCHMARK.exists(), "skipped: libbenchmark-dev is missing")
    def test_a_quick_plant_part_compares_with_the_closed_form(self):
        file = self.folder / "bench.json"
        bench("--quick", "--only", "plant", "--json", file)
        ratios = [figure for figure in self.check(file, "plant") if "ratio" in figure]
        self.assertEqual(len(ratios), 4)  # 1, 2, 10 and 100 vehicles


if __name__ == "__main__":
    unittest.main()
