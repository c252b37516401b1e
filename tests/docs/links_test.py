"""Every relative link of every Markdown document leads to a file or folder that exists. If the link names a heading,
the heading exists, too."""

import os
import re
import subprocess
import unittest
from pathlib import Path
from urllib.parse import unquote

from places import ROOT

SKIPPED = ("build", "recordings", "campaigns-", "node_modules", ".")  # prefixes of folders outside the project

FENCED = re.compile(r"^( *)(```|~~~).*?^ *\2[^\n]*$", re.MULTILINE | re.DOTALL)
CODE = re.compile(r"(`+)(?!`).+?(?<!`)\1(?!`)", re.DOTALL)
INDENTED = re.compile(r"(?:\A|(?<=\n\n))(?: {4}[^\n]*\n+)+")
LINK = re.compile(r"\]\(\s*<?([^()\s>]+(?:\([^()\s]*\))?)>?(?:\s+\"[^\"]*\")?\s*\)")
DEFINITION = re.compile(r"^ {0,3}\[[^\]]+\]:\s*<?(\S+?)>?(?:\s|$)", re.MULTILINE)
TAG = re.compile(r"<(?:img|a|source)\b[^>]*?\b(?:src|href)=\"([^\"]+)\"")
HEADING = re.compile(r"^ {0,3}#{1,6}\s+(.+?)\s*#*\s*$|^(?=\S)([^\n]+)\n(?:=+|-+)\s*$", re.MULTILINE)
ID = re.compile(r"<[^>]+\b(?:id|name)=\"([^\"]+)\"")
EXTERNAL = re.compile(r"[a-z][a-z0-9+.-]*:", re.IGNORECASE)


def is_document(name):
    return name.endswith(".md") and not name.endswith("_page.md")  # the templates of documents in docs/


def find_documents():
    found = []
    for folder, folders, names in os.walk(ROOT):
        folders[:] = sorted(name for name in folders if not name.startswith(SKIPPED))
        found += [Path(folder, name) for name in sorted(names) if is_document(name)]
    return found


def without_fences(text):
    return FENCED.sub("", text)


def list_links(text):
    """Targets of the links and pictures of a document. Code is left out."""
    prose = CODE.sub("`code`", INDENTED.sub("\n", without_fences(text)))
    return [found[1] for kind in (LINK, DEFINITION, TAG) for found in kind.finditer(prose)]


def to_anchor(heading):
    """The anchor that GitHub and Forgejo make of a heading: lower case, no punctuation, hyphens for spaces."""
    shown = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "")
    return re.sub(r"[^\w\- ]", "", shown.strip().lower()).replace(" ", "-")


def list_anchors(text):
    anchors, seen = set(ID.findall(text)), {}
    for found in HEADING.finditer(without_fences(text)):
        anchor = to_anchor(found[1] or found[2])
        count = seen[anchor] = seen.get(anchor, -1) + 1
        anchors.add(f"{anchor}-{count}" if count else anchor)
    return anchors


def find_defects(document, text):
    """The broken links of a document, each with the reason."""
    for link in list_links(text):
        if EXTERNAL.match(link):
            continue
        path, _, anchor = unquote(link).partition("#")
        target = (ROOT / path.lstrip("/") if path.startswith("/") else document.parent / path) if path else document
        if not target.exists():
            yield f"{link}: no such file"
        elif not target.resolve().is_relative_to(ROOT):
            yield f"{link}: outside of the repository"
        elif anchor and target.suffix == ".md":
            if anchor not in list_anchors(text if target == document else target.read_text()):
                yield f"{link}: no such heading"


class LinksTest(unittest.TestCase):
    maxDiff = None

    def test_every_link_leads_to_a_file_and_a_heading(self):
        links, defects = 0, []
        for document in find_documents():
            text = document.read_text()
            links += len(list_links(text))
            defects += [f"{document.relative_to(ROOT)}: {defect}" for defect in find_defects(document, text)]
        self.assertEqual(defects, [])
        self.assertGreater(links, 50)  # the search itself works

    def test_no_link_leads_to_what_git_ignores(self):
        targets = set()
        for document in find_documents():
            for link in list_links(document.read_text()):
                path = unquote(link).partition("#")[0]
                if path and not EXTERNAL.match(link):
                    targets.add(os.path.normpath(document.parent / path))
        try:
            ignored = subprocess.run(["git", "-C", ROOT, "check-ignore", "--stdin"], input="\n".join(sorted(targets)),
                                     capture_output=True, text=True, check=False)
        except FileNotFoundError:
            self.skipTest("git is missing")
        if ignored.returncode > 1:
            self.skipTest("not a checkout of git")
        self.assertEqual(ignored.stdout, "")

    def test_a_broken_link_is_noticed(self):
        document = ROOT / "README.md"
        for text in ("[x](no-such-file.md)", "![x](no.png)", "[x]: nowhere/", "[x](README.md#no-such)", "[x](#no)",
                     "[![x](no.svg)](README.md)", '<img src="no.png">', "[x](../../etc)"):
            self.assertEqual(len(list(find_defects(document, text))), 1, text)
        for text in ("`[x](no.md)`", "```\n[x](no.md)\n```", "[x](https://example.org/no)", "a\n\n    [x](no.md)\n",
                     "# A `b` (c), d\n[x](#a-b-c-d)", "## A\n## A\n[x](#a-1)", "[x](/docs)"):
            self.assertEqual(list(find_defects(document, text)), [], text)
