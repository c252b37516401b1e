"""Modules of the package import each other without a circle. Imports within functions and for type checkers
count, too: they hide a circle, but do not untie it."""

import ast
from graphlib import TopologicalSorter

from places import ROOT, run_python

PACKAGE = ROOT / "python"


def list_modules():
    """The modules of the package by name, with their files."""
    files = sorted((PACKAGE / "sls").rglob("*.py"))
    return {".".join(file.relative_to(PACKAGE).with_suffix("").parts).removesuffix(".__init__"): file
            for file in files}


def find_imports(name, file, modules):
    """The modules of `modules` that `file` imports anywhere."""
    found = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}:{node.lineno}: expected an import by the full name"
            found |= {f"{node.module}.{alias.name}" if f"{node.module}.{alias.name}" in modules
                      else node.module for alias in node.names}
    return (found & modules.keys()) - {name}


def test_the_package_has_no_circle():
    modules = list_modules()
    assert "sls.campaign.folder" in modules
    TopologicalSorter({name: find_imports(name, file, modules) for name, file in modules.items()}).prepare()


def test_a_report_judges_its_arguments_before_it_loads_numpy():
    done = run_python("import sys\nfrom sls.__main__ import main\n"
                      "print(main(['report', 'none']), main(['report', '.', '--vehicle', 'x']), 'numpy' in sys.modules)")
    assert done.stdout == "2 2 False\n", done.stderr
