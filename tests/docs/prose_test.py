"""Spelling (codespell), and words to avoid (words_to_avoid.txt).

`prose_test.py FILE…` lists the words to change in these files."""

import fnmatch
import pathlib
import re
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDER = pathlib.Path(__file__).resolve().parent
# Texts of other authors, data, and the list itself.
SKIPPED = ["LICENSE", "*.png", "*.csv", "*package-lock.json", "tests/fuzz/corpus/*", "tests/docs/*", "*.svg"]
# A space in a phrase matches a gap, or a line's end with the marks of comment and string around it.
GAP = r'(?:[ \t]+|[ \t]*"?[ \t]*\n[ \t]*(?:///?<?|[#*"])?[ \t]*)'
TEST_NAME = re.compile(r"\bTEST\w*\(\w+,\s*(\w+)\)|\bdef test_(\w+)")


def git(*arguments):
    """The output of git, or None if there is no repository."""
    command = ["git", "-c", "safe.directory=*", "-C", ROOT, *arguments]
    try:
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return None


def find_part(phrase):
    """The longest text outside groups, which each match contains: it is found faster than an expression."""
    return max(re.findall(r"[a-z']+", re.sub(r"\((?:[^()]|\([^()]*\))*\)|\\.|\w\?", "|", phrase)) + [""], key=len)


def load_phrases(text):
    """(expression, replacement, part) of each line of the list."""
    for line in text.splitlines():
        if line and not line.startswith("#"):
            words, replacement = line.split("->")
            phrase = rf"(?<![\w.'])(?:{words})(?![\w'])".replace(" ", GAP)
            yield re.compile(phrase, re.IGNORECASE), replacement, find_part(words)


PHRASES = list(load_phrases((FOLDER / "words_to_avoid.txt").read_text()))


def find_phrases(text):
    """(offset, found text, replacement) of each phrase to avoid."""
    lower = text.lower()
    for phrase, replacement, part in PHRASES:
        for found in phrase.finditer(text) if part in lower else ():
            yield found.start(), " ".join(found[0].split()), replacement


def find_defects(text):
    """'LINE: WORDS, expected REPLACEMENT' in `text` and in its names of tests."""
    defects = list(find_phrases(text))
    for name in TEST_NAME.finditer(text):
        words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|_", " ", name[1] or name[2]).capitalize()
        defects += [(name.start(), found, better) for _, found, better in find_phrases(words)]
    for offset, found, better in sorted(defects):
        yield f"{text.count(chr(10), 0, offset) + 1}: '{found}', expected: {better}"


def matches(path, patterns):
    return any(fnmatch.fnmatch(path, pattern) for pattern in patterns)


def list_files(listing):
    """Files of the repository, also those not added yet. Ignored files are left out."""
    return [path for path in sorted(set(listing.split("\0"))) if path and (ROOT / path).is_file()]


def find_file_defects(paths):
    for path in paths:
        yield from (f"{path}:{defect}" for defect in find_defects((ROOT / path).read_text(errors="replace")))


class ProseTest(unittest.TestCase):
    maxDiff = None

    def list_files(self):
        listing = git("ls-files", "-z", "--cached", "--others", "--exclude-standard")
        if listing is None:
            self.skipTest("no git repository")
        return list_files(listing)

    def test_every_word_is_spelt_right(self):
        command = ["codespell", "--config", FOLDER / "codespell.cfg", "--quiet-level", "35", *self.list_files()]
        spelling = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
        self.assertEqual(spelling.stdout + spelling.stderr, "")

    def test_no_file_has_words_to_avoid(self):
        paths = [path for path in self.list_files() if not matches(path, SKIPPED)]
        self.assertGreater(len(paths), 1000)
        defects = list(find_file_defects(paths))
        self.assertEqual(defects, [], "\n" + "\n".join(defects))

    def test_a_phrase_over_the_end_of_a_line_and_in_the_name_of_a_test_is_found(self):
        for text in ("/// The server, none\n/// but it", '"kept for "\n    "want of an answer"', "# for want\n# of time",
                     "TEST(Server, HasNoneBut) {}", "def test_whoever_is_late(self):", "// Who is late, is out."):
            self.assertEqual(len(list(find_defects(text))), 1, text)

    def test_plain_text_passes(self):
        for text in ("/// Who flies?", "The file is shown.", "struct Sheathe {};", "#!/bin/sh"):
            self.assertEqual(list(find_defects(text)), [], text)


if __name__ == "__main__":
    named = [name for name in sys.argv[1:] if pathlib.Path(name).is_file()]
    if named:
        print(*find_file_defects(named), sep="\n")
    else:
        unittest.main(argv=sys.argv[:1])
