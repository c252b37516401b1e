"""Small checkouts for tests: parts of this one, and stand-ins for programs of the machine."""

import os
import shutil

from folder_test import FolderTest
from places import ROOT


def copy(name, root):
    """Copies a file or folder of this checkout."""
    (root / name).parent.mkdir(parents=True, exist_ok=True)
    if (ROOT / name).is_dir():
        shutil.copytree(ROOT / name, root / name, ignore=shutil.ignore_patterns("__pycache__"))
    else:
        shutil.copy(ROOT / name, root / name)


class CheckoutTest(FolderTest):
    """A test with a small checkout `root` of `parts`. `calls` is the file in which stand-ins record their calls."""

    parts = ()

    def setUp(self):
        super().setUp()
        self.root, self.calls = self.folder / "checkout", self.folder / "calls"
        for name in ("sls", "python/sls/__init__.py", "python/sls/launcher", *self.parts):
            copy(name, self.root)
        self.environment = {name: value for name, value in os.environ.items() if name not in (
            "SLS_BUILD", "CMAKE_GENERATOR")} | {"PATH": f"{self.folder}/bin:{os.environ['PATH']}"}

    def stand_in(self, name, action):
        super().write(f"bin/{name}", f'#!/bin/sh\necho {name} "$*" >>{self.calls}\n{action}\n', 0o755)
