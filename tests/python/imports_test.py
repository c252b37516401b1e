"""Modules of the package import each other without a circle. Imports within functions and for type checkers
count, too: they hide a circle, but do not untie it."""

import ast
import unittest

from places import ROOT

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


def find_circle(imports):
    """A path of modules that ends where it begins; empty if there is none."""
    done = set()

    def visit(name, path):
        if name in path:
            return [*path[path.index(name):], name]
        if name in done:
            return []
        for other in sorted(imports[name]):
            if circle := visit(other, [*path, name]):
                return circle
        done.add(name)
        return []

    return next((circle for name in imports if (circle := visit(name, []))), [])


class ImportsTest(unittest.TestCase):
    def test_a_circle_is_found(self):
        self.assertEqual(find_circle({"a": {"b"}, "b": {"c", "d"}, "c": set(), "d": {"b"}}), ["b", "d", "b"])
        self.assertEqual(find_circle({"a": {"b", "c"}, "b": {"c"}, "c": set()}), [])

    def test_the_package_has_no_circle(self):
        modules = list_modules()
        self.assertIn("sls.campaign.folder", modules)
        circle = find_circle({name: find_imports(name, file, modules) for name, file in modules.items()})
        self.assertEqual(circle, [], " imports ".join(circle))
