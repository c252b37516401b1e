"""Shared by the tests that pytest runs: places of the package and the programs."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ.get("SLS_BUILD", ROOT / "build"))
sys.path[:0] = [str(ROOT / "python"), str(BUILD / "python")]
PYTHON_PATH = os.pathsep.join(sys.path[:2])


@pytest.fixture
def run_python():
    """A function that runs code in another Python with the package. It returns the finished process."""
    def run(code, path=PYTHON_PATH, **options):
        return subprocess.run(["/usr/bin/python3", "-B", "-c", code], capture_output=True, text=True,
                              timeout=100, env={**os.environ, "PYTHONPATH": path}, **options)
    return run


@pytest.fixture
def fly_with_program(tmp_path):
    """A function that flies a scenario with the program `closed_loop`. It returns the folder of the
    recording and the finished process."""
    def fly(scenario, name="program"):
        # The file is in the folder to which paths in the scenario are relative.
        file = tmp_path / f"{name}.yaml"
        file.write_text(scenario.text)
        done = subprocess.run([BUILD / "bin/closed_loop", "--scenario", file, "--out",
                               tmp_path / name], capture_output=True, text=True, timeout=100)
        return tmp_path / name, done
    return fly
