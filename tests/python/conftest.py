"""For the tests that pytest runs: where the package and the programs are."""

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
    """Runs code in a Python of its own, with the package: the finished process."""
    def run(code, path=PYTHON_PATH, **options):
        return subprocess.run(["/usr/bin/python3", "-B", "-c", code], capture_output=True, text=True,
                              timeout=100, env={**os.environ, "PYTHONPATH": path}, **options)
    return run


@pytest.fixture
def fly_with_program(tmp_path):
    """Flies a scenario with the program `closed_loop`: the folder of its recording, and the finished
    process."""
    def fly(scenario, name="program"):
        # Beside the file that it is from: paths in it are relative to that.
        file = tmp_path / f"{name}.yaml"
        file.write_text(scenario.text)
        done = subprocess.run([BUILD / "bin/closed_loop", "--scenario", file, "--out",
                               tmp_path / name], capture_output=True, text=True, timeout=100)
        return tmp_path / name, done
    return fly
