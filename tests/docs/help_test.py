"""Every command of ./sls answers --help with its own text and exit code 0, and ./sls help lists it."""

import os
import re
import subprocess
import unittest

from places import BUILD, launch
from sls.launcher.commands import COMMANDS

LONGEST_HELP = 50  # lines, about one screen


def run(*arguments):
    return launch(*arguments, stdin=subprocess.DEVNULL, env={**os.environ, "COLUMNS": "80"})


class HelpTest(unittest.TestCase):
    def test_the_help_lists_every_command_on_a_screen(self):
        ended = run("help")
        self.assertEqual(ended.stderr, "")
        words = set(re.findall(r"[\w-]+", ended.stdout))
        self.assertEqual([command for command in COMMANDS if command not in words], [])
        self.assertLessEqual(ended.stdout.count("\n"), LONGEST_HELP)

    def test_every_command_answers_help_and_does_nothing(self):
        self.assertGreater(len(COMMANDS), 20)
        for command in COMMANDS:
            with self.subTest(command):
                ended = run(command, "--help")
                self.assertEqual(ended.stderr, "")
                # CLI11 leaves the word out since 2.5; run_main adds it, which these two programs of tests do not use.
                no_word = r"|(?m:^\S+ \[OPTIONS\])" if command in ("network-table", "chaos") else ""
                self.assertRegex(ended.stdout, f"(?i)usage: {no_word}")
                self.assertEqual([line for line in ended.stdout.splitlines() if len(line.rstrip()) > 80], [])
        self.assertTrue((BUILD / "bin").is_dir())

    def test_help_of_a_command_is_its_option_help(self):
        self.assertEqual(run("help", "run").stdout, run("run", "--help").stdout)
