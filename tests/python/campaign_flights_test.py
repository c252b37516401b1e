"""Campaigns of real flights: measures of the user, kept recordings, and runs flown again by the three
programs over DDS. Each campaign with own measures has its own process, which imports their files once."""

import csv
import json
import math
import subprocess
import unittest
import unittest.mock

import sls
import yaml
from campaign_engine_support import CampaignTest
from own_domain import own_domain
from places import BUILD

BASE = sls.load_scenario("short", changes={
    "plant": {"model": "analytic", "step_s": 0.001, "initial": {"load_position_m": [0, 0, -0.5]}}, "sync.mode": "realtime",
    "mission": [{"set_point": {"position_m": [0.5, 0, -0.5]}, "for_s": 3}],
    "faults": [{"noise": {"on": "command", "force_n": [0.1, 0.1, 0.1], "seed": 0}},
               {"bias": {"on": "command", "force_n": [0.1, 0, 0]}}]}).text
# A push of 12 N loses the load, and the force limit of 5 N fails at once.
CAMPAIGN = """base: base.yaml
runs: 6
vary:
  faults.1.bias.force_n: { list: [[0.1, 0, 0], [0.5, 0, 0], [12, 0, 0]] }
  controller.force_limit_n: { list: [200, 5] }
seeds: [faults.0.noise.seed]
measure: [load_error_rms, load_error_max, force_max, outcome, time_of_loss]
"""
OWN = """import numpy as np

def work_j(flight):
    if flight.failure:
        raise ValueError(f"no work in a flight that failed: {flight.failure}")
    power = np.sum(flight.applied_force * flight.quad_velocity, axis=1)
    return {"work_j": float(np.sum(power) * 0.004), "steps_flown": len(flight)}

def end_x(flight):
    return flight.load_position[-1, 0]
"""


class FlightsTest(CampaignTest):
    core = BUILD / "python"

    def write_campaign(self, extra=""):
        self.write("base.yaml", BASE)
        return self.write("campaign.yaml", CAMPAIGN + extra)

    def read_rows(self, out):
        with open(self.folder / out / "runs.csv", newline="") as file:
            return list(csv.DictReader(file))

    def fly_row(self, row):
        """Flies the run of `row` with the package, without a campaign."""
        paths = ("faults.1.bias.force_n", "controller.force_limit_n", "faults.0.noise.seed")
        return sls.fly(sls.load_scenario(self.folder / "base.yaml", changes={
            path: yaml.safe_load(row[path]) for path in paths}))

    def open_out(self):
        from sls.campaign.folder import CampaignFolder
        return CampaignFolder(self.folder / "out")

    def change_certificates(self, folder):
        for number, _, _ in folder.chunks:
            rows = [[*cells[:-1], "0" * 64] for cells in folder.read_chunk(number)]
            folder.chunk_file(number).unlink()
            folder.write_chunk(number, rows)

    def test_rows_are_what_the_package_flies(self):
        self.write_campaign()
        self.fly("campaign.yaml", "--out", "one", "--workers", 1)
        self.fly("campaign.yaml", "--out", "two", "--workers", 2, "--chunk-runs", 1)
        self.assertEqual(self.read_table("one"), self.read_table("two"))
        rows = self.read_rows("one")
        self.assertEqual([row["outcome"] for row in rows],
                         ["finished", "failed", "finished", "failed", "lost", "failed"])
        for row in rows:
            flight = self.fly_row(row)
            self.assertEqual(row["certificate"], flight.certificate)
            self.assertEqual(int(row["steps"]), len(flight))
            self.assertEqual(flight.is_finished, row["outcome"] != "failed")
            if row["outcome"] == "finished":
                size = (flight.calc_load_error()**2).sum(axis=1)
                self.assertAlmostEqual(float(row["load_error_rms_m"]), math.sqrt(size.mean()),
                                       delta=1e-12)
                self.assertAlmostEqual(float(row["load_error_max_m"]), math.sqrt(size.max()),
                                       delta=1e-12)

    def test_an_own_measure_that_raises_marks_its_run_alone(self):
        self.write("own.py", OWN)
        self.write_campaign()
        text = (self.folder / "campaign.yaml").read_text().replace("time_of_loss]", """time_of_loss,
  { python: own.py, function: work_j, columns: [work_j, steps_flown] },
  { python: own.py, function: end_x, columns: [end_x_m] }]""")
        self.write("campaign.yaml", text)
        self.fly_apart("campaign.yaml", "--out", "out")
        for row in self.read_rows("out"):
            flight = self.fly_row(row)
            self.assertEqual(float(row["end_x_m"]), flight.load_position[-1, 0])
            if row["outcome"] == "failed":
                self.assertEqual(row["work_j"], "")
                self.assertRegex(row["own_error"], r"work_j: ValueError: no work in a flight that "
                                                   r"failed: .*\(line 5\)$")
            else:
                self.assertEqual(row["own_error"], "")
                self.assertEqual(float(row["steps_flown"]), len(flight))
        before = self.read_table("out")
        self.write("own.py", OWN + "\n# changed\n")
        said = self.fly_apart("campaign.yaml", "--out", "out", "--resume", code=2)
        self.expect_line(said, "out: expected a folder of campaign", "sha256")
        self.assertEqual(self.read_table("out"), before)

    def write_measure(self, text):
        """A campaign of one own measure, `f`, of a file with this text."""
        self.write("own.py", text)
        self.write_campaign()
        self.write("campaign.yaml", (self.folder / "campaign.yaml").read_text().replace(
            "time_of_loss]", "{ python: own.py, function: f, columns: [f] }]"))

    def test_an_own_measure_that_raises_in_every_run_is_an_error_that_names_its_line(self):
        self.write_measure("import math\nimport statistics\n\ndef f(flight):\n"
                           "    return statistics.mean([])\n")
        said = self.fly_apart("campaign.yaml", "--out", "out", code=1)
        self.assertIn("out: measure f: expected a value of at least one run, got an error in each of 6, "
                      "first: StatisticsError: mean requires at least one data point (line 5)",
                      said.splitlines()[-1])
        self.assertEqual(len(self.read_rows("out")), 6)
        self.fly_apart("campaign.yaml", "--out", "out", "--resume", "--allow-broken-measures")
        self.write_measure("def f(flight):\n    return 1 / (len(flight) > 10)\n")  # some runs fail at once
        self.fly_apart("campaign.yaml", "--out", "some")

    def test_a_changed_module_of_an_own_measure_is_refused(self):
        self.write_measure("import pathlib, sys\nsys.path.append(str(pathlib.Path(__file__).parent))\n"
                           "def f(flight):\n    import helper\n    return helper.VALUE\n")
        helper = self.write("helper.py", "VALUE = 1\n")
        self.fly_apart("campaign.yaml", "--out", "out")
        plan = json.loads((self.folder / "out/plan.json").read_text())
        self.assertEqual(sorted(plan["used_files"]), ["helper.py", "own.py"])
        helper.write_text("VALUE = 2\n")
        said = self.fly_apart("campaign.yaml", "--out", "out", "--resume", code=2)
        self.expect_line(said, "helper.py: expected the file with which the campaign was begun")

    def test_own_measures_may_have_dataclasses_with_annotations_as_texts(self):
        self.write_measure("from __future__ import annotations\nfrom dataclasses import dataclass\n"
                           "@dataclass\nclass Sum:\n    value: float = 3.0\n\n"
                           "def f(flight):\n    return Sum().value\n")
        self.fly_apart("campaign.yaml", "--out", "out")
        self.assertEqual({row["f"] for row in self.read_rows("out")}, {"3.0"})

    def test_an_own_measure_that_cannot_be_loaded_is_refused_before_anything_flies(self):
        self.write_measure("import nothing_of_this_name\n")
        said = self.fly_apart("campaign.yaml", "--out", "out", code=2)
        self.expect_line(said, "own.py: f: expected a Python file that can be run",
                         "nothing_of_this_name")
        self.assertFalse((self.folder / "out").exists())

    def test_recordings_are_kept_with_the_certificates_of_their_rows(self):
        for keep, expected in (("failed", [1, 3, 4, 5]), ("all", [0, 1, 2, 3, 4, 5]),
                               ("{ worst: 2, by: load_error_max }", None), ("none", [])):
            with self.subTest(keep):
                self.write_campaign(f"keep: {keep}\n")
                out = f"out-{keep.strip('{ ')[:5]}"
                self.fly("campaign.yaml", "--out", out)
                rows = self.read_rows(out)
                if expected is None:
                    worst = sorted(rows, key=lambda row: -float(row["load_error_max_m"] or "-inf"))
                    expected = sorted(int(row["run"]) for row in worst[:2])
                folders = sorted((self.folder / out).glob("kept/*"))
                self.assertEqual([folder.name for folder in folders],
                                 [f"run-{run:06d}" for run in expected])
                for run, folder in zip(expected, folders):
                    manifest = json.loads((folder / "manifest.json").read_text())
                    self.assertEqual(manifest["certificate"], rows[run]["certificate"])
                    self.assertTrue((folder / "state.csv").exists())
        (self.folder / "out-all/kept/run-000002/manifest.json").write_text("{}")
        self.write_campaign("keep: all\n")
        self.fly("campaign.yaml", "--out", "out-all", "--resume")
        self.assertEqual(json.loads((self.folder / "out-all/kept/run-000002/manifest.json")
                                    .read_text())["certificate"], rows[2]["certificate"])

    def test_a_kept_run_that_another_machine_flew_may_have_another_certificate(self):
        self.write_campaign("keep: { worst: 1, by: load_error_max }\n")
        self.fly("campaign.yaml", "--out", "out", "--allow-other-machines")
        folder = self.open_out()
        kept = folder.manifest["kept"]
        self.assertNotIn("other_certificates", kept)
        self.change_certificates(folder)  # as of a machine with another C library
        self.fly("campaign.yaml", "--out", "out", "--resume")
        self.assertEqual(folder.manifest["kept"], {**kept, "other_certificates": kept["runs"]})

    def test_the_rest_of_a_recording_of_a_killed_process_is_removed(self):
        from sls.campaign.whole_files import name_temporary
        self.write_campaign("keep: all\n")
        self.fly("campaign.yaml", "--out", "out")
        ended = subprocess.Popen(["true"])
        ended.wait()
        kept = self.folder / "out/kept/run-000003"
        with unittest.mock.patch("os.getpid", return_value=ended.pid):
            left = name_temporary(kept)
        kept.rename(left)
        self.fly("campaign.yaml", "--out", "out", "--resume")
        self.assertTrue(kept.exists())
        self.assertFalse(left.exists())

    def test_runs_flown_over_dds_have_the_same_certificates(self):
        self.write_campaign("certify: { some: 3, seed: 1 }\n")  # other runs get a certificate in the verification
        with own_domain() as domain:
            said = self.fly("campaign.yaml", "--out", "out", "--verify", 4, "--domain", domain)
            self.assertIn("verify: 4 of 4 runs have the same certificate when flown over DDS", said)
            verified = json.loads((self.folder / "out/manifest.json").read_text())["verified"]
            self.assertEqual(len(set(verified["runs"])), 4)
            # Wrong certificates in the table are found.
            self.change_certificates(self.open_out())
            said = self.fly("campaign.yaml", "--out", "out", "--resume", "--verify", 1, "--domain",
                            domain, code=1)
            self.assertRegex(said, rf"verify: run \d: expected certificate {'0' * 64}, got [0-9a-f]{{64}}")
            self.assertIn("verify: 0 of 1 runs have the same certificate", said)
