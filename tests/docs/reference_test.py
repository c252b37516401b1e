"""docs/reference equals the help texts of the built programs; the man pages are well formed."""

import re
import subprocess
import unittest

import yaml
from folder_test import FolderTest
from places import BUILD, ROOT


def run_reference(*arguments):
    return subprocess.run(["/usr/bin/python3", "-B", ROOT / "tools/reference", "--build", BUILD, *arguments],
                          capture_output=True, text=True, timeout=300)


def lint(page):
    return subprocess.run(["mandoc", "-T", "lint", "-W", "warning", page], capture_output=True, text=True).stdout


class Reference(unittest.TestCase):
    def test_is_what_the_programs_say(self):
        help_text = subprocess.run([BUILD / "bin/sim_server", "--help"], capture_output=True, text=True).stdout
        if "in [0 - 232]=0" not in help_text:
            self.skipTest("this CLI11 formats help in another way; the reference is made with that of Debian 12")
        done = run_reference("--check")
        self.assertEqual(done.returncode, 0, f"renew docs/reference with: ./sls reference\n{done.stdout}{done.stderr}")

    def test_names_every_key_of_the_shipped_scenarios(self):
        page = (ROOT / "docs/reference/scenario.md").read_text(encoding="utf-8")
        cells = re.findall(r"^\| (`.*?) \|", page, re.MULTILINE)
        named = {path for cell in cells for path in re.findall("`(.*?)`", cell)}

        def list_paths(node, path=""):
            if isinstance(node, dict):
                for key, value in node.items():
                    below = f"{path}.{key}" if path else key
                    yield below
                    yield from list_paths(value, below)
            elif isinstance(node, list):
                for value in node:
                    yield from list_paths(value, path + "[i]") if isinstance(value, dict) else ()

        for file in sorted((ROOT / "config/scenarios").glob("*.yaml")):
            for path in list_paths(yaml.load(file.read_text(encoding="utf-8"), yaml.BaseLoader)):
                self.assertIn(path, named, file.name)


class ManPages(FolderTest):
    def test_are_well_formed(self):
        done = run_reference("--man", self.folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        pages = sorted(self.folder.iterdir())
        names = [page.name for page in pages]
        self.assertIn("sls.1", names)
        self.assertIn("sim_server.1", names)
        for page in pages:
            self.assertEqual(lint(page), "", page.name)
