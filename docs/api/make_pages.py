"""Writes the sources of the pages: the index with every Markdown document, one page for each module of the package.

usage: make_pages.py PAGES OUT      PAGES: where the sources go; OUT: the folder of the finished pages
"""

import ast
import os
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "python/sls"
SKIPPED = ("build", "recordings", "node_modules", ".")  # how folders begin that are not the project's

TUPLES = ("Now", "Reference")  # named tuples of the extension module that call themselves sls.NAME

INDEX = """\
sls
===

Distributed simulator for a multirotor with a slung load. These pages are made from the sources by ``./sls docs``.

- `C and C++ headers <headers/index.html>`__: controllers, autopilots and plants of your own; the libraries.
- :doc:`python`: flights, laws, recordings, figures and campaigns from Python.

.. toctree::
   :hidden:

   python
   C and C++ headers <headers>

Documents
---------

"""

PYTHON = """\
The package sls
===============

Each name of ``import sls``, and where it is described:

{names}

Modules
-------

.. toctree::
   :maxdepth: 1

{modules}
"""


def underline(title):
    return f"{title}\n{'=' * len(title)}\n"


def list_documents():
    for folder, folders, names in os.walk(ROOT):
        folders[:] = sorted(name for name in folders if not name.startswith(SKIPPED))
        for name in sorted(names):
            path = Path(folder, name)
            if name.endswith(".md") and not name.endswith("_page.md") and ROOT / "docs/api" not in path.parents:
                yield path


def find_title(document):
    found = re.search(r"^# (.+)$", document.read_text(), re.MULTILINE)
    return re.sub(r"[`*\\<>]", "", found[1]) if found else document.name


def make_index(out):
    text = INDEX
    for document in list_documents():
        place = document.relative_to(ROOT)
        text += f"- `{place} <{os.path.relpath(document, out)}>`__: {find_title(document)}\n"
    return text


def list_modules():
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = ("sls", *path.relative_to(PACKAGE).with_suffix("").parts)
        if parts[-1] != "__main__" and parts != ("sls", "__init__"):
            yield ".".join(parts).removesuffix(".__init__")


def list_names():
    """(name, module) of everything that `import sls` offers."""
    tree = ast.parse((PACKAGE / "__init__.py").read_text())
    for node in tree.body:
        if isinstance(node, ast.Assign) and node.targets[0].id == "_PLACES":
            return ast.literal_eval(node.value).items()
    raise ValueError("python/sls/__init__.py: expected _PLACES, got none")


def find_place(name, module):
    """A link to where a name is described; without such a place Sphinx warns."""
    if module == f"sls.{name}":
        return f":doc:`sls.{name} <{module}>`"
    return f":any:`sls.{name}`" if name in TUPLES else f":any:`sls.{name} <{module}.{name}>`"


def main(pages, out):
    pages.mkdir(parents=True)
    (pages / "index.rst").write_text(make_index(out))
    modules = ["_sls_core", *list_modules()]
    names = "\n".join(f"- {find_place(name, module)}" for name, module in list_names())
    (pages / "python.rst").write_text(PYTHON.format(
        names=names, modules="\n".join(f"   {module}" for module in modules)))
    for module in modules:
        (pages / f"{module}.rst").write_text(f"{underline(module)}\n.. automodule:: {module}\n")
    with (pages / "_sls_core.rst").open("a") as page:
        for name in TUPLES:
            page.write(f"\n.. autoclass:: sls.{name}\n")
    # Doxygen's pages take the place of this one.
    (pages / "headers.rst").write_text(f"{underline('C and C++ headers')}\n"
                                       "`The headers <headers/index.html>`__\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]).resolve())
