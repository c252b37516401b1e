"""Every citation in comments, scenarios and documents exists: sections of docs/design.md, equations and
headings of a README. A citation may continue on the next line."""

import functools
import os
import pathlib
import re
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SUFFIXES = {".cpp", ".hpp", ".c", ".h", ".idl", ".py", ".sh", ".yaml", ".xml", ".md", ".def"}
SKIPPED = ("build", "node_modules", "recordings", ".")  # prefixes of folders that are not part of the project

# 'design, section 7', 'design 6 ("Commands", "Standby")', 'design section 6, Identity'
DESIGN = re.compile(
    r"\b[Dd]esign(?:\.md)?,?(?: sections?)? (\d{1,2}(?:(?:, | and )\d{1,2})*)\b"
    r"(?: \(([^)]+)\)|, ([A-Z]\w+))?")
# 'README.md, eqs. (1)–(9)', 'common/model/README.md, eq. (1)', 'Eq. (5)'
EQUATION = re.compile(r"(?:([\w./]*README\.md), )?\b[Ee]qs?\. \((\d+)\)(?:(–| and )\((\d+)\))?")
# 'README.md, "Waiting"'
HEADING = re.compile(r'([\w./]*README\.md), "([^"]+)"')


def flatten(text):
    """Replaces each line end, with the comment mark after it, by one space."""
    return re.sub(r"[ \t]*\n[ \t]*(?:///?<?|#|\*)?[ \t]*", " ", text)


@functools.cache
def read_files():
    """(path, flat text) of every file that may have citations."""
    found = []
    for folder, folders, names in os.walk(ROOT):
        folders[:] = sorted(name for name in folders if not name.startswith(SKIPPED))
        for path in (pathlib.Path(folder, name) for name in sorted(names)):
            if path.suffix in SUFFIXES and path != pathlib.Path(__file__).resolve():
                found.append((path, flatten(path.read_text(errors="replace"))))
    return found


def split_sections(design):
    """Text of each numbered section, by its number."""
    parts = re.split(r"^## (\d+)\. ", design, flags=re.MULTILINE)
    return dict(zip(map(int, parts[1::2]), parts[2::2]))


def find_design_defects(text, sections):
    """Citations in `text` that `sections` do not have."""
    for found in DESIGN.finditer(text):
        names = [found[3]] if found[3] else re.split(", ", (found[2] or "").replace('"', ""))
        for number in map(int, re.findall(r"\d+", found[1])):
            if number not in sections:
                yield f"'{found[0]}': no section {number}"
                continue
            for name in filter(None, names):
                if name.lower() not in sections[number].lower():
                    yield f"'{found[0]}': nothing about '{name}' in section {number}"


def find_readme(path, cited):
    """The README that a file means: in its folder, or by its path from the root."""
    return ROOT / cited if "/" in cited else path.parent / "README.md"


def find_readme_defects(path, text):
    is_test = ROOT / "tests" in path.parents  # its "Eq. (1)" belongs to a README that its text names
    for found in EQUATION.finditer(text):
        if is_test and not found[1]:
            continue
        readme = find_readme(path, found[1] or "")
        if not readme.is_file():
            yield f"'{found[0]}': no {readme.relative_to(ROOT)}"
            continue
        first, last = int(found[2]), int(found[4] or found[2])
        numbers = range(first, last + 1) if found[3] == "–" else {first, last}
        equations = set(map(int, re.findall(r"^ {4,}\((\d+)\) ", readme.read_text(), re.MULTILINE)))
        for number in sorted(set(numbers) - equations):
            yield f"'{found[0]}': no equation ({number}) in {readme.relative_to(ROOT)}"
    for found in HEADING.finditer(text):
        readme = find_readme(path, found[1])
        heading = rf"^(?:#+ .*|\*\*)\b{re.escape(found[2])}\b"
        if not readme.is_file() or not re.search(heading, readme.read_text(), re.M | re.I):
            yield f"'{found[0]}': no such heading"


class CitationsTest(unittest.TestCase):
    maxDiff = None

    def test_the_design_has_the_sections_1_to_13(self):
        sections = split_sections((ROOT / "docs/design.md").read_text())
        self.assertEqual(list(sections), list(range(1, 14)))

    def test_every_citation_of_the_design_finds_its_section(self):
        sections = split_sections((ROOT / "docs/design.md").read_text())
        cited, defects = 0, []
        for path, text in read_files():
            cited += len(DESIGN.findall(text))
            found = find_design_defects(text, sections)
            defects += [f"{path.relative_to(ROOT)}: {defect}" for defect in found]
        self.assertEqual(defects, [])
        self.assertGreater(cited, 25)  # the search itself works

    def test_every_citation_of_a_readme_finds_its_equation_or_heading(self):
        cited, defects = 0, []
        for path, text in read_files():
            if path.suffix == ".md":
                continue
            cited += len(EQUATION.findall(text)) + len(HEADING.findall(text))
            found = find_readme_defects(path, text)
            defects += [f"{path.relative_to(ROOT)}: {defect}" for defect in found]
        self.assertEqual(defects, [])
        self.assertGreater(cited, 40)

    def test_the_example_of_the_design_is_the_one_that_is_tested(self):
        design = (ROOT / "docs/design.md").read_text()
        example = re.search(r"^    name: figure_eight\n(?:    .+\n)+", design, re.MULTILINE)[0]
        tested = (ROOT / "tests/common/config/scenario_test.cpp").read_text()
        self.assertIn(re.sub(r"^    ", "", example, flags=re.MULTILINE), tested)

    def test_a_citation_of_nothing_is_noticed(self):
        sections = {6: 'About "Commands".'}
        for text in ("project\n// design, section 14", "design 6 (\"Commands\", \"Tea\")",
                     "design, sections 6 and 16", "design section 6, Tea"):
            self.assertEqual(len(list(find_design_defects(flatten(text), sections))), 1, text)
        law = ROOT / "control_client/laws/qsf/qsf_law.cpp"
        for text in ("Eq. (99)", "README.md, eqs. (1)–(17)", "nowhere/README.md, eq. (1)",
                     'README.md, "Tea"'):
            self.assertTrue(list(find_readme_defects(law, text)), text)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
