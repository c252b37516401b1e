"""Copies parts of this checkout into the small checkouts of tests."""

import pathlib
import shutil

ROOT = pathlib.Path(__file__).resolve().parents[2]


def copy(name, root):
    (root / name).parent.mkdir(parents=True, exist_ok=True)
    if (ROOT / name).is_dir():
        shutil.copytree(ROOT / name, root / name, ignore=shutil.ignore_patterns("__pycache__"))
    else:
        shutil.copy(ROOT / name, root / name)
