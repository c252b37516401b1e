"""The study flown again gives the page that is committed. Takes minutes: `./sls test --slow`."""

import os
import subprocess
import unittest

import support

from sls import study


class StudyTest(support.FolderTest):
    def test_the_committed_page_is_what_the_command_writes(self):
        domain = self.enterContext(support.OwnDomain())
        done = subprocess.run(
            [support.ROOT / "sls", "study", "--out", "s", "--recordings", "r", "--domain", domain],
            cwd=self.folder, env={**os.environ, "SLS_BUILD": support.BUILD}, capture_output=True,
            text=True, timeout=1500)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertEqual((self.folder / "s/study.md").read_text(),
                         (study.ROOT / "docs/study.md").read_text())
        names = {path.name for path in (self.folder / "s/study").iterdir()}
        self.assertEqual(names, {path.name for path in (study.ROOT / "docs/study").iterdir()})


if __name__ == "__main__":
    unittest.main()
