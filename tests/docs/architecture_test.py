"""Diagrams are drawn from the sources beside them, and files and functions that docs/architecture.md and the
diagrams name exist."""

import importlib.util
import os
import pathlib
import re
import unittest

import yaml

from places import ROOT
from sls.launcher.commands import COMMANDS

DIAGRAMS = ROOT / "docs/diagrams"
PAGES = ("README.md", "docs/architecture.md", "docs/design.md")
CODE = (".cpp", ".hpp", ".h", ".py", ".ts")
FOLDERS = ("bench", "closed_loop", "common", "control_client", "python", "recorder", "sim_server", "tests", "tools")


def load_make():
    spec = importlib.util.spec_from_file_location("make", DIAGRAMS / "make.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def read(name):
    return (ROOT / name).read_text()


def read_code():
    """The whole text of the code."""
    texts = []
    for top in FOLDERS:
        for folder, folders, names in os.walk(ROOT / top):
            folders[:] = [name for name in folders if name != "node_modules"]
            texts += [pathlib.Path(folder, name).read_text() for name in names if name.endswith(CODE)]
    return "\n".join(texts)


class ArchitectureTest(unittest.TestCase):
    maxDiff = None
    make = load_make()

    def test_the_readme_of_the_contract_has_each_topic_with_its_type_and_profiles(self):
        code = read("common/bus/topics.hpp")
        topics = dict(zip(re.findall(r'"(sls/\w+)"', code), re.findall(r"struct Topic<(\w+)> .*Flow::k(\w+)>", code)))
        self.assertEqual(len(topics), len(re.findall(r"struct Topic<\w+> :", code)))
        for topic, (message, flow) in topics.items():
            profiles = f"`sls_{flow.lower()}_writer` → `sls_{flow.lower()}_reader`"
            self.assertRegex(read("idl/README.md"), rf"(?m)^\| `{topic}` \| `{message}` \|.* {profiles}")

    def test_every_diagram_is_drawn_from_the_source_beside_it(self):
        sources = self.make.list_sources()
        self.assertGreater(len(sources), 4)
        self.assertEqual({path.stem for path in DIAGRAMS.glob("*.svg")}, {path.stem for path in sources})
        for source in sources:
            last = source.with_suffix(".svg").read_text().splitlines()[-1]
            self.assertEqual(last, self.make.calc_mark(source), "run docs/diagrams/make.py")

    def test_the_layers_are_those_of_the_include_rules(self):
        self.assertEqual((DIAGRAMS / "layers.dot").read_text(), self.make.draw_layers(), "run docs/diagrams/make.py")

    def test_every_diagram_is_shown(self):
        shown = {name for page in PAGES for name in re.findall(r"diagrams/(\w+)\.svg", read(page))}
        self.assertEqual(shown, {path.stem for path in DIAGRAMS.glob("*.svg")})

    def test_files_that_the_architecture_names_exist(self):
        pages = read("docs/architecture.md") + "".join(path.read_text() for path in self.make.list_sources())
        names = re.findall(r"\b(?:%s)/[\w./]+" % "|".join(FOLDERS), pages)
        missing = [name for name in names if not (ROOT / name.rstrip(".")).exists()]
        self.assertEqual(missing, [])
        self.assertGreater(len(names), 40)

    def test_functions_that_the_architecture_names_exist(self):
        pages = read("docs/architecture.md") + "".join(path.read_text() for path in self.make.list_sources())
        code = read_code()
        kinds, words = set(re.findall(r"\b(?:class|struct) (\w+)", code)), set(re.findall(r"\w+", code))
        names = sorted(set(re.findall(r"\b([A-Z]\w+)::(\w+)", pages)))
        missing = [f"{kind}::{name}" for kind, name in names if kind not in kinds or name not in words]
        self.assertEqual(missing, [])
        self.assertGreater(len(names), 20)

    def test_the_design_has_its_sections_and_an_example_that_is_tested(self):
        design = read("docs/design.md")
        self.assertEqual(re.findall(r"^## (\d+)\. ", design, re.MULTILINE), [str(number) for number in range(1, 14)])
        example = re.search(r"^    name: figure_eight\n(?:    .+\n)+", design, re.MULTILINE)[0]
        tested = read("tests/common/config/scenario_test.cpp")
        self.assertIn(re.sub(r"^    ", "", example, flags=re.MULTILINE), tested)

    def test_the_readme_is_short_and_its_picture_small(self):
        self.assertLessEqual(len(read("README.md").splitlines()), 150)
        self.assertLess((ROOT / "docs/pictures/live.png").stat().st_size, 300_000)

    def test_the_files_that_a_forge_reads_are_right(self):
        [version] = re.findall(r"^project\(sls VERSION ([\d.]+)", read("CMakeLists.txt"), re.MULTILINE)
        citation = yaml.safe_load(read("CITATION.cff"))
        self.assertEqual((citation["cff-version"], citation["type"], citation["version"], citation["license"]),
                         ("1.2.0", "software", version, "Apache-2.0"))
        self.assertTrue(citation["authors"] and citation["title"] and citation["message"])
        jobs = yaml.safe_load(read(".github/workflows/ci.yml"))["jobs"]
        self.assertEqual({jobs["ubuntu"]["runs-on"], jobs["debian"]["container"]["image"]},
                         {"ubuntu-24.04", "debian:${{ matrix.version }}"})
        self.assertEqual([job["steps"][-1]["run"] for job in jobs.values()], ["bash .ci/run"] * 2)
        forms = {path.stem: yaml.safe_load(path.read_text()) for path in (ROOT / ".github/ISSUE_TEMPLATE").iterdir()}
        self.assertTrue(all(form["name"] and form["description"] and form["body"] for form in forms.values()))
        self.assertIn("./sls doctor", str(forms["fault"]))

    def test_the_commands_of_the_readme_exist(self):
        commands = re.findall(r"\./sls ([a-z][\w-]*)", read("README.md"))
        known = list(COMMANDS)
        self.assertEqual([name for name in commands if name not in known], [])
        self.assertIn("./sls test", read("README.md"))
