"""codespell finds no misspelt word in the files of the repository."""

import subprocess
import unittest

from places import ROOT


class SpellingTest(unittest.TestCase):
    maxDiff = None

    def test_every_word_is_spelt_right(self):
        git = ["git", "-c", "safe.directory=*", "-C", ROOT, "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
        try:
            listing = subprocess.run(git, check=True, capture_output=True, text=True).stdout
        except (OSError, subprocess.CalledProcessError):
            self.skipTest("no git repository")
        paths = [path for path in sorted(set(listing.split("\0"))) if path and (ROOT / path).is_file()]
        self.assertGreater(len(paths), 1000)
        command = ["codespell", "--config", ROOT / "tests/docs/codespell.cfg", "--quiet-level", "35", *paths]
        spelling = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
        self.assertEqual(spelling.stdout + spelling.stderr, "")
