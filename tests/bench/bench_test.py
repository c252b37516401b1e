"""Tests of `./sls bench`: its arithmetic on given numbers, its output and files, and its error messages. No test
judges a speed."""

import importlib.util
import json
import os
import pathlib
import resource
import signal
import subprocess
import sys
import time
import unittest

from folder_test import FolderTest
from places import BUILD, ROOT, launch
from processes import wait_until

sys.path.insert(0, str(ROOT))
from bench import instructions, loop  # noqa: E402
from bench.programs import Programs  # noqa: E402
from bench.results import LESS, Figure, Rounds, format_number, format_table  # noqa: E402
from sls.errors import RunError  # noqa: E402

GOOGLE_BENCHMARK = BUILD / "bin/sls_microbench"


def is_alive(process):
    try:
        return ") Z " not in (process / "stat").read_text()
    except OSError:
        return False


class BoundTest(unittest.TestCase):
    def setUp(self):
        self.costs = loop.StepCosts.__new__(loop.StepCosts)
        self.costs.work = {"plant_us": 14.0, "law_us": 0.5}
        self.costs.futex = {(True, "one"): 100.0, (True, "two"): 15.0,
                            (False, "one"): 20.0, (False, "two"): 30.0}

    def test_a_hand_over_is_the_fastest_round_without_its_work(self):
        self.assertEqual(self.costs.hand_over(may_spin=True), 0.5)
        self.assertEqual(self.costs.hand_over(may_spin=False), 5.5)

    def test_with_one_processor_there_is_one_place(self):
        pairs, everywhere = loop.find_pairs(), os.sched_getaffinity(0)
        self.assertEqual(len(pairs), min(len(everywhere), 2))
        self.assertEqual([len(set(pair)) for pair in pairs.values()], [1, 2][:len(pairs)])
        os.sched_setaffinity(0, {max(everywhere)})
        try:
            self.assertEqual(loop.find_pairs(), {"on one processor": (max(everywhere),) * 2})
        finally:
            os.sched_setaffinity(0, everywhere)

    def test_the_parts_of_a_step_add_up_to_it(self):
        parts_of_step = loop.calc_parts(60.0, self.costs.work, 5.5)
        self.assertEqual(list(parts_of_step.items()), [
            ("plant", 14.0), ("law", 0.5), ("futex", 5.5), ("rest", 40.0)])

    def flights(self, speeds):
        return {how: loop.Flight(1000, speed, "exact", {"sim_server": 0.04,
                                 "control_client": 0.02 if how.may_spin else 0.01}, {})
                for how, speed in zip(loop.LOOPS, speeds)}

    def test_each_loop_stands_beside_its_bounds_with_what_is_between(self):
        figures = Rounds("lockstep")
        loop.add_speeds(figures, self.costs, self.flights([10000, 12500, 8000, 10000] * 2))
        made = {(figure.name, figure.bound_name): figure for figure in figures.make_figures()}
        name = "shared memory, with recorder, blocking"
        figure = made[name, loop.FUTEX_BOUND]
        self.assertAlmostEqual(figure.bounds[0], 1e6 / 15)
        self.assertEqual({part: values[0] for part, values in figure.parts.items()}, {
            "plant": 14.0, "law": 0.5, "futex": 5.5, "rest": 80.0, "recorder": 25.0})
        self.assertAlmostEqual(made[f"{name}, beside the same without", "the same without recorder"]
                               .ratios[0], 0.8)
        spinning = made["UDP, without recorder, spinning", loop.FUTEX_BOUND]
        self.assertEqual({part: values[0] for part, values in spinning.parts.items()}, {
            "plant": 14.0, "law": 0.5, "futex": 0.5, "rest": 65.0})

    def test_processor_time_is_for_a_step_and_stands_beside_that_without_spinning(self):
        figures = Rounds("lockstep")
        loop.add_processor_times(figures, self.flights([10000] * 8))
        made = {figure.name: figure for figure in figures.make_figures()}
        name = "UDP, with recorder, spinning: processor time"
        self.assertAlmostEqual(made[f"{name}, sim_server"].median, 40)
        self.assertAlmostEqual(made[f"{name}, all"].median, 60)
        self.assertAlmostEqual(made[f"{name}, all"].ratios[0], 50 / 60)


class FigureTest(unittest.TestCase):
    def test_the_ratio_is_of_the_figure_and_the_bound_of_the_same_round(self):
        figure = Figure("part", "speed", "steps/s", [80.0, 90.0, 50.0], "bound", [100.0, 100.0, 50.0])
        self.assertEqual(figure.ratios, [0.8, 0.9, 1.0])
        json_figure = figure.to_json()
        self.assertEqual(json_figure["ratio"]["median"], 0.9)  # the ratio of the medians is 0.8
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

    def test_parts_add_up_to_the_step_in_every_round(self):
        parts_us = {"plant": [60.0, 70.0], "rest": [40.0, 55.0]}
        figure = Figure("part", "speed", "steps/s", [10000.0, 8000.0], parts=parts_us)
        self.assertEqual(figure.to_json()["parts_us"]["rest"]["rounds"], [40, 55])
        for wrong in ({"plant": [60.0, 70.0]}, {"plant": [60.0, 70.0], "rest": [40.0, 30.0]}):
            with self.assertRaisesRegex(ValueError, "expected parts of 1"):
                Figure("part", "speed", "steps/s", [10000.0, 8000.0], parts=wrong)

    def test_below_the_table_each_step_stands_with_its_parts(self):
        figures = [Figure("one", "first", "steps/s", [10000.0],
                          parts={"plant": [60.0], "rest": [40.0]}),
                   Figure("one", "second", "µs", [50.0], parts={"rest": [50.0]}),
                   Figure("one", "third", "µs", [50.0])]
        lines = format_table(figures).split("\n")
        self.assertEqual([line.split() for line in lines[-3:]], [
            ["where", "a", "step", "goes,", "µs", "step", "plant", "rest"],
            ["one:", "first", "100", "60", "40"], ["one:", "second", "50", "50"]])
        self.assertTrue(lines[-1].endswith("  50"))  # below "rest"
        self.assertEqual(len(lines[-1]), len(lines[-2]))

    def test_figures_grow_by_one_value_in_each_round(self):
        rounds = Rounds("part")
        for value in (80.0, 90.0):
            rounds.add("speed", "steps/s", value, "bound", 100.0, {"rest": 1e6 / value}, goal=85)
            rounds.add("speed", "steps/s", value, "half", 50.0)
            rounds.add("time", "s", value, better=LESS)
        speed, half, time = rounds.make_figures()
        self.assertEqual((speed.values, speed.bounds, speed.goal), ([80, 90], [100, 100], 85))
        self.assertEqual(speed.parts["rest"], [1e6 / 80, 1e6 / 90])
        self.assertEqual(half.ratios, [1.6, 1.8])
        self.assertEqual((time.values, time.bounds, time.better), ([80, 90], [], LESS))

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

    def test_lateness_counts_from_the_earliest_state(self):
        self.assertEqual(loop.calc_lateness({0: 5_000, 1: 1_004_000, 3: 3_010_000}, 1_000_000),
                         [1.0, 0.0, 6.0])

    def test_late_steps_are_read_from_the_label(self):
        self.assertEqual(loop.count_late("real-time, 3 of 500 late, worst age 4 ms"), 3)
        self.assertEqual(loop.count_late("degraded: real-time, 7 of 500 late, worst age 8 ms, "
                                         "1 s lost in 2 slips"), 7)
        with self.assertRaises(RunError):
            loop.count_late("exact")


PROFILE = """\
version: 1
cmd: made up
positions: line
events: Ir

ob=(1) /lib/libc.so.6
fl=(1) ???
fn=(1) malloc
0 7
+2 1
ob=(2) /build/bin/sim_server
fn=(2) sls::sim::step(int)
0 3
cob=(1)
cfn=(1)
calls=2 0
0 8
0 4
cfn=(3) sls::sim::other()
calls=1 0
0 100
fn=(3)
0 100
totals: 115
"""


class InstructionsTest(FolderTest):
    def test_a_profile_gives_what_each_function_took_itself(self):
        self.assertEqual(instructions.parse_profile(PROFILE.splitlines(keepends=True)), {
            ("libc.so.6", "malloc"): 8, ("sim_server", "sls::sim::step(int)"): 7,
            ("sim_server", "sls::sim::other()"): 100})

    def test_a_step_is_what_the_longer_flight_took_more_on_the_threads_that_a_step_wakes(self):
        # Two threads; the second flies: 8,000 instructions more in 2,000 steps.
        for name, counts in (("fewer", (500, 1000)), ("more", (600, 9000))):
            for number, count in enumerate(counts, 1):
                (self.folder / f"{name}-{number:02}").write_text(
                    f"ob=(1) libc.so.6\nfn=(1) free\n0 {count}\nob=(2) libslow_clock.so\nfn=(2) time\n0 {count}\n")
        self.assertEqual(instructions.calc_per_step(self.folder / "fewer", self.folder / "more", 1),
                         {("libc.so.6", "free"): 4})

    def test_each_function_belongs_to_one_part(self):
        self.assertEqual(instructions.sum_parts({
            ("libc.so.6", "pthread_mutex_lock@@GLIBC_2.2.5"): 1, ("sim_server", "pthread_mutex_unlock"): 2,
            ("libfastrtps.so.2.9.1", "0x1"): 4, ("control_client", "sls::control::calc_qsf()"): 8,
            ("control_client", "sls::control::Answerer::answer()"): 16, ("libSimTKcommon.so.3.7", "f"): 32}),
            {"locks": 3, "Fast DDS": 4, "law and mission": 8, "our own": 16, "Simbody": 32})


class ProcessTest(FolderTest):
    def setUp(self):
        super().setUp()
        self.programs = Programs(BUILD, 0, self.folder)

    def test_busy_loops_are_processes_of_their_own_and_gone_at_the_end(self):
        with self.assertRaises(KeyError):
            with self.programs.busy_loops(3) as counting:
                self.assertEqual([process.poll() for process in counting], [None] * 3)
                raise KeyError
        self.assertEqual([process.returncode for process in counting], [-signal.SIGTERM] * 3)

    def test_no_busy_loop_outlives_a_bench_that_is_killed(self):
        script = ("import pathlib, signal, sys\nfrom bench.programs import Programs\n"
                  "programs = Programs(pathlib.Path(), 0, pathlib.Path(sys.argv[1]))\n"
                  "with programs.busy_loops(1) as counting:\n"
                  "    print(counting[0].pid, flush=True)\n    signal.pause()\n")
        with subprocess.Popen([sys.executable, "-c", script, self.programs.scratch], text=True,
                              stdout=subprocess.PIPE, env={**os.environ, "PYTHONPATH": f"{ROOT}:{ROOT}/python"}
                              ) as process:
            counting = pathlib.Path(f"/proc/{int(process.stdout.readline())}")
            wait_until(lambda: (counting / "comm").read_text() == "sh\n", 30, "setpriv has started the shell")
            process.kill()
        wait_until(lambda: not is_alive(counting), 30, "the loop has ended")

    def test_programs_are_waited_for_with_the_processor_time_that_they_took(self):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        burn = "import time\nwhile time.process_time() < 1: pass"
        took, said = self.programs.run_together({"burns": [sys.executable, "-c", burn], "says": ["echo", "1"]})
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.assertAlmostEqual(
            sum(took.values()), after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, delta=0.01)
        self.assertGreater(took["burns"], 0.99)
        self.assertEqual(said, {"burns": "", "says": "1\n"})

    def test_a_program_that_does_not_end_well_is_an_error(self):
        with self.assertRaisesRegex(RunError, "^fails ended with 3: why$"):
            self.programs.run_together({"fails": ["sh", "-c", "echo why; exit 3"], "sleeps": ["sleep", "0.5"]})


class ProgramTest(FolderTest):
    def test_mistakes_give_one_line_and_exit_code_two(self):
        for words, cause in ((["--only", "nonsense"], "nonsense"), (["--nonsense"], "--nonsense"),
                             (["--only"], "--only"), (["--json", self.folder / "no/file"], "--json"),
                             (["--out", "/proc/none"], "--out")):
            said = launch("bench", *words, code=2).stderr
            self.assertEqual(said.count("\n"), 1, said)
            self.assertIn("error: ", said)
            self.assertIn(cause, said)

    def test_help_names_every_part(self):
        said = launch("bench", "--help").stdout
        for part in ("lockstep", "load", "realtime", "plant", "start", "instructions"):
            self.assertIn(part, said)

    def measure(self, part, *words):
        """The figures of a quick run, and what it printed."""
        file = self.folder / "bench.json"
        said = launch("bench", "--quick", "--only", part, "--json", file, *words, timeout=600)
        result = json.loads(file.read_text())
        self.assertTrue(result["quick"])
        self.assertGreaterEqual(result["machine"]["cores"], 1)
        self.assertEqual({figure["part"] for figure in result["figures"]}, {part})
        for figure in result["figures"]:
            self.assertLessEqual(figure["min"], figure["median"])
            self.assertLessEqual(figure["median"], figure["max"])
            if "ratio" in figure:
                self.assertGreater(figure["ratio"]["min"], 0)
        return result["figures"], said.stdout

    def test_a_quick_start_part_measures_a_short_flight_with_the_launcher_and_without(self):
        figures = {figure["name"]: figure for figure in self.measure("start")[0]}
        self.assertEqual({figure["goal"]["value"] for figure in figures.values() if "goal" in figure},
                         {0.8, 0.7, 0.6, 0.9})
        self.assertEqual(len(figures), 5)
        self.assertTrue(all(0 < figure["min"] < 60 for figure in figures.values()))

    def test_a_quick_lockstep_part_has_bounds_a_table_and_a_plot(self):
        has_plots = importlib.util.find_spec("matplotlib") is not None
        figures, table = self.measure("lockstep", *["--out", self.folder / "plots"] * has_plots)
        self.assertIn("shared memory, with recorder", table)
        self.assertIn("where a step goes", table)
        loops = [figure for figure in figures if "rest" in figure.get("parts_us", {})]
        self.assertEqual([figure["name"] for figure in loops], [how.name for how in loop.LOOPS])
        for figure in loops:
            parts_us = [part["median"] for part in figure["parts_us"].values()]
            self.assertAlmostEqual(sum(parts_us), 1e6 / figure["median"], places=6)
        names = {figure["name"]: figure for figure in figures}
        for how in loop.LOOPS:
            for program in ("sim_server", "control_client", *(["recorder"] if how.is_recorded else [])):
                self.assertGreater(names[f"{how.name}: processor time, {program}"]["min"], 0)
        futex = [name for name in names if name.startswith("two processes by futex")]
        self.assertEqual(len(futex), 2 * len(loop.find_pairs()))
        one = names["one process, without files"]
        for name in futex:  # a round includes all the work of a step; 0.1 % for rounding
            self.assertLess(names[name]["median"], 1.001 * one["bound"]["median"])
        if has_plots:
            self.assertTrue((self.folder / "plots/lockstep.png").read_bytes().startswith(b"\x89PNG"))
            self.assertIn("<svg", (self.folder / "plots/lockstep.svg").read_text())

    def test_a_quick_load_part_compares_with_no_load_and_with_no_spinning(self):
        names = [figure["name"] for figure in self.measure("load")[0] if "ratio" in figure]
        self.assertEqual(sum("1 busy loop" in name for name in names), 3)
        self.assertEqual(sum("beside blocking" in name for name in names), 2)

    def test_a_quick_realtime_part_stands_beside_a_thread_that_only_sleeps(self):
        late = [figure for figure in self.measure("realtime")[0] if "ratio" in figure]
        self.assertEqual(len(late), 2 * len(loop.PERCENTILES))

    @unittest.skipUnless(GOOGLE_BENCHMARK.exists(), "skipped: libbenchmark-dev is missing")
    def test_a_quick_plant_part_compares_with_the_closed_form(self):
        ratios = [figure for figure in self.measure("plant")[0] if "ratio" in figure]
        self.assertEqual(len(ratios), 4)  # 1, 2, 10 and 100 vehicles
