"""Runs the examples in Python like a user."""

import re

import pytest
import sls
from places import ROOT, launch


def run_example(name, *arguments, folder):
    return launch("python", ROOT / "examples/python" / name, *arguments, cwd=folder).stdout


def test_pid_flies_as_the_law_in_cpp(tmp_path):
    said = run_example("pid.py", folder=tmp_path)
    apart = re.search(r"at most (\S+) m from the law 'pid' in C\+\+", said)
    assert float(apart[1]) < 1e-12
    assert "8001 steps, finished" in said


def test_fly_and_plot_draws_what_it_flew(tmp_path):
    said = run_example("fly_and_plot.py", "--out", tmp_path, folder=tmp_path)
    rms = {mass: float(error) for mass, error in re.findall(r"(\S+) kg: .* rms (\S+) m", said)}
    assert list(rms) == ["0.1", "0.2", "0.3"]
    assert rms["0.2"] < min(rms["0.1"], rms["0.3"])  # the mass that the law uses
    assert (tmp_path / "masses.png").read_bytes().startswith(b"\x89PNG")


def test_compare_laws_leaves_recordings_that_verify(tmp_path):
    said = run_example("compare_laws.py", "--flights", 2, "--recordings", tmp_path, folder=tmp_path)
    mean = dict(re.findall(r"(\w+): mean (\S+),", said))
    assert float(mean["qsf"]) < float(mean["pid"])  # QSF follows the reference better
    for law in mean:
        assert sls.Recording(tmp_path / law).verify().is_ok


def test_the_readme_lists_every_example():
    listed = (ROOT / "python/README.md").read_text()
    for file in (ROOT / "examples/python").glob("*.py"):
        assert f"`{file.name}`" in listed, file.name


def test_the_launcher_starts_python_with_the_package(tmp_path):
    done = launch("python", "-c", "import sls; print(sls.fly('short'))", cwd=tmp_path)
    assert done.stdout == "<sls.Flight short: 501 steps, finished>\n", done.stderr


@pytest.mark.parametrize("code, exit_code", [("raise SystemExit(3)", 3), ("1/0", 1)])
def test_the_launcher_passes_the_exit_code_on(code, exit_code, tmp_path):
    launch("python", "-c", code, cwd=tmp_path, code=exit_code)
