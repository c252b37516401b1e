"""Every command of ./sls answers --help with its own text and exit code 0, and ./sls help lists it."""

import os
import pathlib
import re
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else ROOT / "build"
sys.path.insert(0, str(ROOT / "python"))
from sls.launcher.commands import COMMANDS  # noqa: E402
LONGEST_HELP = 50  # lines, about one screen


def run(*arguments):
    return subprocess.run([ROOT / "sls", *arguments], capture_output=True, text=True, timeout=60,
                          stdin=subprocess.DEVNULL, env={**os.environ, "SLS_BUILD": str(BUILD), "COLUMNS": "80"})


class HelpTest(unittest.TestCase):
    def test_the_help_lists_every_command_on_a_screen(self):
        ended = run("help")
        self.assertEqual((ended.returncode, ended.stderr), (0, ""))
        words = set(re.findall(r"[\w-]+", ended.stdout))
        self.assertEqual([command for command in COMMANDS if command not in words], [])
        self.assertLessEqual(ended.stdout.count("\n"), LONGEST_HELP)

    def test_every_command_answers_help_and_does_nothing(self):
        self.assertGreater(len(COMMANDS), 20)
        for command in COMMANDS:
            with self.subTest(command):
                ended = run(command, "--help")
                self.assertEqual((ended.returncode, ended.stderr), (0, ""))
                self.assertRegex(ended.stdout, "(?i)usage: ")
                self.assertEqual([line for line in ended.stdout.splitlines() if len(line) > 80], [])
        self.assertTrue((BUILD / "bin").is_dir())

    def test_help_of_a_command_is_its_option_help(self):
        self.assertEqual(run("help", "run").stdout, run("run", "--help").stdout)

    def test_an_unknown_command_is_one_line_and_bad_usage(self):
        ended = run("frobnicate")
        self.assertEqual((ended.returncode, ended.stdout), (2, ""))
        self.assertEqual(ended.stderr, "sls: error: unknown command 'frobnicate' (see ./sls help)\n")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
