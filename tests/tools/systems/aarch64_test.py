"""The steps of ./sls systems aarch64 without its tree: the flight over DDS, with a client of this machine, and what is
read of docs/arm.md. The tree and emulated ARM take half an hour: only the command makes them. Needs root and
namespaces."""

import json
import os
import re
import subprocess
import sys
import time
import unittest
from unittest import mock

from folder_test import FolderTest
from places import BUILD, ROOT

sys.path.insert(0, str(ROOT / "tools/systems"))
import aarch64  # noqa: E402
import results  # noqa: E402
import tree  # noqa: E402

HAS_NETWORKS = os.geteuid() == 0 and subprocess.run(
    tree.isolate("unshare", "--net", "ip", "link", "set", "lo", "up"), check=False).returncode == 0


@unittest.skipUnless(HAS_NETWORKS, "needs root, namespaces and ip")
class FlightTest(FolderTest):
    def setUp(self):
        super().setUp()
        self.root = self.folder / "checkout"
        self.root.mkdir()
        (self.root / "build").symlink_to(BUILD)
        (self.root / "config").symlink_to(ROOT / "config")
        self.system = tree.Tree("aarch64", self.folder, time.monotonic() + 300)
        self.column = results.Column("aarch64")

    def fly(self, *client):
        with mock.patch.object(aarch64, "ROOT", self.root):
            aarch64.fly_over_dds(self.system, "short", client, self.column)
        return self.column.rows["over DDS: short"]

    def test_a_flight_over_dds_has_the_certificate_of_the_flight_in_process(self):
        variables = {"SLS_DOMAIN": "77", "ROS_DISCOVERY_SERVER": "127.0.0.1:1",
                     "FASTRTPS_DEFAULT_PROFILES_FILE": "/none", "FASTDDS_DEFAULT_PROFILES_FILE": "/none"}
        with mock.patch.dict(os.environ, variables):
            said = self.fly(BUILD / "bin/control_client")
        self.assertRegex(said, r"^exit 0, 0 min \d+ s, [0-9a-f]{8}$", self.system.log("dds-short").read_text())
        self.assertTrue(self.column.is_good)
        manifest = json.loads((self.folder / "aarch64/recordings/short/dds/manifest.json").read_text())
        self.assertTrue(manifest["certificate"].startswith(said[-8:]))

    def test_another_flight_is_a_defect_with_both_certificates(self):
        (self.root / "build").unlink()
        (self.root / "build/bin").mkdir(parents=True)
        for program in "recorder", "sim_server":
            (self.root / "build/bin" / program).symlink_to(BUILD / "bin" / program)
        other = self.root / "build/bin/closed_loop"
        other.write_text(f"#!/bin/sh\nshift 2\nexec {BUILD}/bin/closed_loop --scenario config/scenarios/setpoints.yaml"
                         " \"$@\"\n")
        other.chmod(0o755)
        self.assertRegex(self.fly(BUILD / "bin/control_client"),
                         r", ([0-9a-f]{8}) and missing: \[\], expected (?!\1)[0-9a-f]{8} and nothing missing$")
        self.assertFalse(self.column.is_good)

    def test_a_client_that_fails_ends_the_flight_and_its_processes(self):
        self.assertRegex(self.fly("false"), "^exit 1, 0 min ")
        self.assertFalse(self.column.is_good)
        left = subprocess.run(["pgrep", "-fa", str(self.folder)], capture_output=True, text=True, check=False).stdout
        self.assertEqual(left, "")


class DocumentTest(unittest.TestCase):
    def test_the_document_names_the_preset_and_its_folder(self):
        packages, build = aarch64.read_commands()
        presets = json.loads((ROOT / "CMakePresets.json").read_text())["configurePresets"]
        preset = next(one for one in presets if one["name"] == "aarch64")
        self.assertEqual(preset["binaryDir"], f"${{sourceDir}}/{aarch64.BUILD}")
        self.assertEqual(build, f"cmake --preset aarch64\nninja -C {aarch64.BUILD}\n")
        self.assertTrue(re.match("echo .*\ndpkg --add-architecture arm64\napt-get update\napt-get install -y ", packages))

    def test_fused_instructions_are_found(self):
        lines = ["  1:\t1f420820 \tfmadd\td0, d1, d2, d2", "\tfnmsub\td0, d1, d2, d3", "\tfmls\tv0.2d, v1.2d, v2.2d",
                 "\tfmla\tv0.2d, v1.2d, v2.d[0]", "\tfmul\td0, d1, d2", "\tfadd\td0, d1, d2", "\tbl\t<fmadd_all>"]
        found = subprocess.run(["grep", "-cE", aarch64.FUSED], input="\n".join(lines), capture_output=True, text=True,
                               check=True).stdout
        self.assertEqual(found, "4\n")
