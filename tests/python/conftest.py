"""Shared by the tests of the package."""

import subprocess

import pytest
from places import BUILD


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
