"""The table of certificates over processors names every difference that must not be."""

import os
import re
import subprocess
import sys
import unittest
import unittest.mock
from pathlib import Path

from folder_test import FolderTest
from places import BUILD, ROOT

sys.path.insert(0, str(ROOT / "tools/systems"))
import certificates  # noqa: E402

HERE = certificates.Processor("here", BUILD / "bin")
OTHER = certificates.Processor("other", BUILD / "bin")
ARM = certificates.Processor("arm", BUILD / "bin", is_arm=True)


def make_flight(certificate, error="", x=0.0):
    return certificates.Flight(certificate, error, [[0.0, 0.0, 0.0], [x, 0.0, 0.0]])


class JudgeTest(unittest.TestCase):
    def test_equal_certificates_are_no_defect(self):
        for plant in "slung_load", "analytic":
            judged = certificates.judge({HERE: make_flight("a" * 64), ARM: make_flight("a" * 64)}, plant)
            self.assertEqual(judged, ({"here": "a" * 8, "arm": "a" * 8}, [], False))

    def test_another_certificate_is_a_defect_with_both(self):
        for processor in OTHER, ARM:
            _, defects, is_fused = certificates.judge({HERE: make_flight("a" * 64), processor: make_flight("b" * 64)},
                                                      "analytic")
            self.assertEqual(defects, [f"{processor.name}: expected certificate aaaaaaaa…, got bbbbbbbb…"])
            self.assertFalse(is_fused)

    def test_only_arm_may_differ_with_simbody_and_the_table_has_the_length(self):
        first = make_flight("a" * 64)
        for plant in "slung_load", "multirotor":
            cells, defects, is_fused = certificates.judge({HERE: first, ARM: make_flight("b" * 64, x=-3e-13)}, plant)
            self.assertEqual((cells["arm"], defects, is_fused), ("3.0e-13 m", [], True))
            self.assertEqual(len(certificates.judge({HERE: first, OTHER: make_flight("b" * 64)}, plant)[1]), 1)

    def test_a_flight_that_fails_is_a_defect(self):
        cells, defects, _ = certificates.judge({HERE: make_flight("a" * 64), ARM: make_flight("", "exit code 1: no")},
                                               "slung_load")
        self.assertEqual((cells["arm"], defects), ("failed", ["arm: exit code 1: no"]))


class EmulatorTest(FolderTest):
    def test_the_tree_s_emulator_comes_first_whatever_its_name(self):
        with unittest.mock.patch.dict(os.environ, {"PATH": f"{self.folder}/usr/bin"}):
            tree = self.folder / "tree"
            for folder in self.folder, tree:
                (folder / "usr/bin").mkdir(parents=True)
            self.assertIsNone(certificates.find_emulator("aarch64", tree))
            for program in self.folder / "usr/bin/qemu-aarch64-static", tree / "usr/bin/qemu-aarch64":
                program.touch(mode=0o755)
                self.assertEqual(certificates.find_emulator("aarch64", tree), str(program))


class FlightTest(FolderTest):
    def test_the_analytic_variant_flies_the_same_way_within_a_nanometre(self):
        scenarios = certificates.list_scenarios(["short", "multirotor_geometric"], self.folder)
        self.assertEqual({name: plant for name, (_, plant) in scenarios.items()},
                         {"multirotor_geometric": "multirotor", "short": "slung_load",
                          "short-analytic": "analytic"})
        flown, variant = (certificates.fly(HERE, scenarios[name][0], True) for name in ("short", "short-analytic"))
        self.assertEqual((flown.error, variant.error), ("", ""))
        self.assertGreater(len(flown.load), 100)
        self.assertLess(certificates.calc_difference(variant, flown), 1e-9)

    def test_every_variant_is_a_scenario(self):
        for name, (file, plant) in certificates.list_scenarios([], self.folder).items():
            checked = subprocess.run([BUILD / "bin/sim_server", "--check", "--scenario", file], timeout=60,
                                     capture_output=True, text=True, check=False)
            self.assertIn(plant, ("analytic", "cables", "multirotor", "slung_load"))
            self.assertEqual(checked.returncode, 0, f"{name}: {checked.stderr}")

    def test_a_program_that_fails_gives_its_last_line(self):
        flight = certificates.fly(HERE, Path("/none.yaml"), False)
        self.assertEqual(flight.certificate, "")
        self.assertRegex(flight.error, r"^exit code 2: closed_loop: error: /none\.yaml: .+$")


class ProgramTest(unittest.TestCase):
    def run_program(self, *arguments):
        return subprocess.run(["/usr/bin/python3", "-B", ROOT / "tools/systems/certificates.py", "--build", BUILD,
                               *arguments], timeout=300, capture_output=True, text=True, check=False,
                              env={**os.environ, "PATH": "/none"})  # without emulators

    def test_mistakes_are_refused_in_a_line(self):
        for arguments, said in ((["nix"], "SCENARIO: expected a name in config/scenarios, got 'nix'"),
                                (["--arm-build", "/none"], "/none: expected a build with bin/closed_loop, got none")):
            ended = self.run_program(*arguments)
            self.assertEqual((ended.returncode, ended.stdout, ended.stderr),
                             (2, "", f"certificates.py: error: {said}\n"))

    def test_masked_features_give_the_same_certificate(self):
        ended = self.run_program("short", "multirotor_geometric")
        self.assertEqual(ended.returncode, 0, ended.stdout + ended.stderr)
        rows = [re.findall(r"\b[0-9a-f]{8}\b", line) for line in ended.stdout.splitlines()]
        self.assertEqual([(len(row), len(set(row))) for row in rows if row], [(3, 1)] * 3, ended.stdout)
