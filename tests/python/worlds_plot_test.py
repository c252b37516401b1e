"""The picture of `./sls worlds --plot`: each world of the table is in it once, where it belongs."""

import io
import os
import sys
from contextlib import redirect_stderr, redirect_stdout

import support

from sls import worlds_plot

ROWS = """seed,loss,delay_ms,faults,finished,duration_s,take_overs,late_steps,worst_error_m,failed
0,0,0,0,1,1.5,0,0,0.25,0
1,0.05,3,2,1,2.5,1,0,0.5,0
2,0.1,10.5,1,0,,0,0,,0
"""


class WorldsPlotTest(support.FolderTest):
    def make_program(self, script):
        """A stand-in for sls_worlds."""
        program = self.write("program", f"#!{sys.executable}\nimport sys, pathlib\n{script}", 0o755)
        os.environ["SLS_WORLDS"] = str(program)
        self.addCleanup(os.environ.pop, "SLS_WORLDS")

    def test_every_world_is_in_it_once(self):
        figure = worlds_plot.plot_worlds(worlds_plot.read_worlds(self.write("worlds.csv", ROWS)))
        for axes, values in zip(figure.axes, ([1.5, 2.5], [0.25, 0.5])):
            points = [xy for line in axes.lines if line.get_marker() == "." for xy in line.get_xydata().tolist()]
            finished = sorted(point for point in points if point[1] == point[1])
            self.assertEqual(finished, [[0, values[0]], [5, values[1]]])
            lost = [xy for line in axes.lines if line.get_marker() == "x" for xy in line.get_xydata().tolist()]
            self.assertEqual(lost, [[10, 1]])
        self.assertEqual(figure.axes[0].get_title(), "3 worlds, 2 with a finished flight (the others: ×)")

    def test_it_calls_the_program_and_keeps_its_exit_code(self):
        self.make_program("assert sys.argv[1:4] == ['--seeds', '0-2', '--table'], sys.argv\n"
                          f"pathlib.Path(sys.argv[4]).write_text({ROWS!r})\nsys.exit(1)\n")
        picture = self.folder / "worlds.svg"
        with redirect_stdout(io.StringIO()) as said:
            self.assertEqual(worlds_plot.main(["--seeds", "0-2", "--plot", str(picture)]), 1)
        self.assertEqual(said.getvalue(), f"{picture}\n")
        self.assertIn("<svg", picture.read_text())

    def test_a_search_that_ended_before_its_first_world_is_one_line(self):
        self.make_program(f"pathlib.Path(sys.argv[2]).write_text({ROWS.splitlines()[0]!r})\n")
        with redirect_stderr(io.StringIO()) as said:
            self.assertEqual(worlds_plot.main(["--plot", str(self.folder / "worlds.svg")]), 2)
        self.assertRegex(said.getvalue(), r"\Aworlds: error: .*worlds.csv: expected worlds, got none\n\Z")

    def test_another_format_is_refused_before_anything_flies(self):
        with redirect_stderr(io.StringIO()) as said:
            self.assertEqual(worlds_plot.main(["--plot", "worlds.gif"]), 2)
        self.assertEqual(said.getvalue(), "worlds: --plot: expected a file .png, .svg or .pdf, got 'worlds.gif'\n")
