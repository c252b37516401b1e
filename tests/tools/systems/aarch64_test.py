"""./sls systems aarch64 refuses in a line, and leaves no process, mount or folder behind. The tree and the flights on
emulated ARM take 20 minutes: only the command makes them. Skipped without root."""

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
BUILD = Path(sys.argv.pop(1)).resolve() if len(sys.argv) > 1 else ROOT / "build"
sys.path.insert(0, str(ROOT / "tools/systems"))
import aarch64  # noqa: E402


class AArch64Test(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        (self.folder / "bin").mkdir()
        (self.folder / "tmp").mkdir()

    def fake_debootstrap(self, script):
        """Makes a debootstrap that runs `script` instead."""
        program = self.folder / "bin/debootstrap"
        program.write_text(f"#!/bin/sh\n{script}\n")
        program.chmod(0o755)

    def start(self, *arguments, build=BUILD):
        environment = {**os.environ, "TMPDIR": str(self.folder / "tmp"),
                       "PATH": f"{self.folder / 'bin'}:{os.environ['PATH']}"}
        return subprocess.Popen(["/usr/bin/python3", "-B", ROOT / "tools/systems/aarch64.py", "--build", build,
                                 *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                env=environment)

    def expect_error(self, started, code, pattern):
        _, said = started.communicate(timeout=60)
        self.assertEqual(started.returncode, code, said)
        self.assertRegex(said, rf"\Asls: error: {pattern}\n\Z")
        # The log of a command that failed stays, and the line names it.
        self.assertEqual([str(path) for path in (self.folder / "tmp").iterdir() if str(path) not in said], [])
        self.assertNotIn(str(self.folder), Path("/proc/mounts").read_text())

    def test_mistakes_are_refused_in_a_line(self):
        self.expect_error(self.start("nix"), 2, "SCENARIO: expected a name in config/scenarios, got 'nix'")
        self.expect_error(self.start(build=self.folder), 2,
                          f"{self.folder}: expected the programs of this machine, got none; run ./sls build")
        (self.folder / "other/tree").mkdir(parents=True)
        self.expect_error(self.start("--tree", str(self.folder / "other")), 1,
                          f"--tree: {self.folder}/other: expected a tree of this command, or an empty folder, got "
                          "other files")
        self.assertTrue((self.folder / "other/tree").is_dir())

    def test_a_step_that_fails_ends_with_its_last_line(self):
        self.fake_debootstrap("echo first; echo 'E: no mirror'; touch $3/half; exit 7")
        self.expect_error(self.start(), 1, r"debootstrap: expected exit code 0, got exit code 7: E: no mirror \(whole "
                                           r"log: .*/tmp/sls-aarch64-.*\.log\)")

    def test_a_signal_ends_the_step_and_removes_the_tree(self):
        mark = self.folder / "process"
        self.fake_debootstrap(f"touch $3/half; touch {mark}; exec sleep 1234.5")
        started = self.start()
        deadline = time.monotonic() + 60
        while not mark.exists() and time.monotonic() < deadline:
            time.sleep(0.01)
        self.assertTrue(mark.exists())
        started.send_signal(signal.SIGTERM)
        started.communicate(timeout=60)
        self.assertEqual(started.returncode, 143)
        self.assertEqual(list((self.folder / "tmp").iterdir()), [])
        sleeping = subprocess.run(["pgrep", "-f", "^sleep 1234.5$"], capture_output=True, text=True, check=False).stdout
        self.assertEqual(sleeping, "")

    def test_the_document_names_the_preset_and_its_folder(self):
        packages, build = aarch64.read_commands()
        presets = json.loads((ROOT / "CMakePresets.json").read_text())["configurePresets"]
        preset = next(one for one in presets if one["name"] == "aarch64")
        self.assertEqual(preset["binaryDir"], f"${{sourceDir}}/{aarch64.BUILD.name}")
        self.assertEqual(build, f"cmake --preset aarch64\nninja -C {aarch64.BUILD.name}\n")
        self.assertTrue(re.match(r"dpkg --add-architecture arm64\napt-get update\napt-get install ", packages))


if __name__ == "__main__":
    if os.geteuid() != 0:
        print("skipped: needs root")
        sys.exit(77)
    unittest.main(verbosity=2)
