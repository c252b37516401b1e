"""Sphinx: the index and the pages of the package `sls`. build.sh starts it."""

import os
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ["SLS_BUILD"])
sys.path[:0] = [str(ROOT / "python"), str(BUILD / "python")]

project = "sls"
version = release = os.environ["SLS_VERSION"]
html_title = "sls"
html_show_copyright = html_show_sphinx = html_copy_source = False
html_theme = "alabaster"
html_theme_options = {"description": "Distributed simulator for a multirotor with a slung load", "page_width": "1100px"}
html_sidebars = {"**": ["about.html", "navigation.html", "searchbox.html"]}
extensions = ["sphinx.ext.autodoc"]
suppress_warnings = ["ref.python"]  # a class in an annotation whose short name another module has, too
autodoc_default_options = {"members": True, "undoc-members": True, "show-inheritance": True}
autodoc_member_order = "bysource"
autodoc_mock_imports = ["dask", "distributed"]  # Debian's python3-distributed; flying needs neither


def convert_line(line):
    """`Code` as literal text; of the rest, what reStructuredText would take for a mark is escaped."""
    parts = re.split(r"(`[^`]+`)", line)
    return "".join(f"`{part}`" if re.fullmatch(r"`[^`]+`", part) else
                   re.sub(r"([\\*|`])|(?<=\w)(_)(?!\w)", r"\\\1\2", part) for part in parts)


def convert(lines):
    """Docstrings are plain text: `code` in backticks, examples after an empty line and indented by four spaces,
    `name: text` for arguments, whose further lines are indented. As reStructuredText."""
    converted, kind = [], "text"
    for index, line in enumerate(lines):
        is_indented, is_first = line.startswith("    "), index == 0 or not lines[index - 1].strip()
        if not line.strip():
            converted.append("")
        elif is_indented and (kind == "example" or is_first):
            converted += [line] if kind == "example" else ["::", "", line]
            kind = "example"
        elif is_indented:
            converted[-1] += f" {convert_line(line.strip())}"
        elif re.match(r"[a-z_]+(, [a-z_]+)*: ", line) and (is_first or kind == "argument"):
            converted.append(f"- {convert_line(line)}")
            kind = "argument"
        else:
            converted += ["", convert_line(line)] if kind == "argument" else [convert_line(line)]
            kind = "text"
    return converted


def convert_docstring(app, what, name, thing, options, lines):
    lines[:] = convert(lines)


def setup(app):
    app.connect("autodoc-process-docstring", convert_docstring)
