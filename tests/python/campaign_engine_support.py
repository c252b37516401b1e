"""Shared by the tests of a campaign's folder and engine: a small campaign, and the command line, in this process or in
one of its own. `FAKE` is the folder of a replacement for the extension module."""

import contextlib
import io
import os
import pathlib
import subprocess
import sys
import time
from unittest import mock

import support
from places import ROOT

HERE = pathlib.Path(__file__).resolve().parent
FAKE = HERE / "fake_core"
BASE = """name: base
vehicle: { quad_mass_kg: 1.5, load_mass_kg: 0.2, rod_length_m: 1.0, gravity_m_s2: 9.8 }
faults:
  - noise: { on: command, force_n: [0.05, 0.05, 0.05], seed: 0 }
mission:
  - set_point: { position_m: [0.5, 0, -2] }
    for_s: 2
"""
CAMPAIGN = """base: base.yaml
runs: {runs}
vary:
  vehicle.load_mass_kg: {{ uniform: [0.1, 0.4], seed: 3 }}
seeds: [faults.0.noise.seed]
measure: [load_error_rms, load_error_max, outcome]
"""


class CampaignTest(support.FolderTest):
    core = FAKE  # subclasses may use the folder of the build

    def write_campaign(self, runs=40, extra="", name="campaign.yaml"):
        self.write("base.yaml", BASE)
        return self.write(name, CAMPAIGN.format(runs=runs) + extra)

    def fly_whole(self, runs=40):
        """Flies the campaign in one go, into the folder `whole`."""
        self.write_campaign(runs)
        self.fly("campaign.yaml", "--out", "whole")

    def environment(self, **more):
        path = os.pathsep.join([str(self.core), str(ROOT / "python")])
        return {**os.environ, "PYTHONPATH": path, **more}

    def start(self, *arguments, fake="", **options):
        """Starts the command line in a separate process, in the test's folder."""
        command = [sys.executable, "-BP", "-m", "sls.campaign", *map(str, arguments)]
        return subprocess.Popen(command, cwd=self.folder, env=self.environment(SLS_FAKE=fake),
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)

    def fly(self, *arguments, fake="", code=0):
        """Runs the command line with one worker in this process, which imports its packages once. Returns stdout and
        stderr; the exit code must be `code`."""
        from sls.campaign.cli import main
        words = [str(argument) for argument in arguments]
        if "--out" in words and "--workers" not in words:
            words += ["--workers", "1"]
        with (contextlib.chdir(self.folder), io.StringIO() as said, contextlib.redirect_stdout(said),
              contextlib.redirect_stderr(said), mock.patch.dict(os.environ, self.environment(SLS_FAKE=fake))):
            ended = main(words)
            self.assertEqual(ended, code, said.getvalue())
            return said.getvalue()

    def fly_apart(self, *arguments, fake="", code=0):
        """The same in a process of its own."""
        process = self.start(*arguments, fake=fake)
        out, said = process.communicate(timeout=240)
        self.assertEqual(process.returncode, code, said)
        return out + said

    def expect_line(self, said, *parts):
        """Checks that `said` is one line with an error that contains `parts`."""
        self.assertEqual(said.count("\n"), 1, said)
        self.assertTrue(said.startswith("sls: error: "), said)
        for part in parts:
            self.assertIn(str(part), said)

    def wait_until(self, is_true, process=None):
        deadline = time.monotonic() + 120
        while not is_true():
            if time.monotonic() > deadline or process and process.poll() is not None:
                self.fail("expected a condition, got a process that ended or 120 s without it")
            time.sleep(0.01)

    def list_workers(self, process):
        """Ids of the running processes that `process` has started."""
        text = pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text()
        return [int(child) for child in text.split()]

    def count_chunks(self, out):
        return len(list((self.folder / out / "chunks").glob("chunk-*.csv")))

    def read_table(self, out):
        return (self.folder / out / "runs.csv").read_bytes()
