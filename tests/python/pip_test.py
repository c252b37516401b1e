"""pip install ./python, in a virtual environment and without an index, and the package's names and classes there."""

import json
import os
import subprocess

import pytest
from own_domain import own_domain
from places import ROOT


@pytest.fixture(scope="module")
def python(tmp_path_factory):
    """The Python of a virtual environment in which pip has installed the package."""
    folder = tmp_path_factory.mktemp("pip")
    made = subprocess.run(["/usr/bin/python3", "-m", "venv", "--system-site-packages", folder / "venv"],
                          capture_output=True, text=True)
    if made.returncode:
        pytest.skip("this machine has no module venv (apt-get install python3-venv)")
    python = folder / "venv/bin/python"
    done = subprocess.run([python, "-m", "pip", "install", "--no-index", "--no-build-isolation",
                           ROOT / "python"], capture_output=True, text=True, cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    return python


def start(*command, **more):
    """Runs a command without the checkout's package and build in its environment."""
    environment = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "SLS_BUILD")}
    return subprocess.run(command, capture_output=True, text=True, env=environment, timeout=100, **more)


def run(python, code):
    done = start(python, "-c", code, cwd=python.parents[2])
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_a_flight_by_name_is_that_of_the_checkout(python):
    import sls
    said = run(python, "import sls; print(sls.__file__, sls.fly('short').certificate)").split()
    assert said == [str(python.parents[1] / f"lib/{said[0].split('/lib/')[1].split('/')[0]}/site-packages/sls/__init__.py"),
                    sls.fly("short").certificate]


def test_the_command_flies_over_dds_and_lists_what_there_is(python, tmp_path):
    command = python.parent / "sls"
    assert "figure_eight" in start(command, "list").stdout
    with own_domain() as domain:
        done = start(command, "run", "short", "--out", tmp_path / "flight", "--domain", str(domain), "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    import sls
    assert json.loads(done.stdout)["certificate"] == sls.fly("short").certificate
    done = start(command, "report", tmp_path / "flight")
    assert done.returncode == 0 and (tmp_path / "flight/report.html").exists(), done.stderr
    done = start(command, "build")
    assert (done.returncode, done.stderr) == (
        2, "sls: error: build: needs the source tree; this sls is installed without it\n")


def test_pytest_has_the_plug_in(python, tmp_path):
    # -B: else pytest leaves files of its own beside the plug-in, which pip does not remove.
    for options in ((), ("-p", "sls.pytest_plugin")):
        done = start(python, "-B", "-m", "pytest", "--markers", *options, cwd=tmp_path)
        assert "@pytest.mark.sls(check" in done.stdout


def test_a_campaign_by_name_flies_and_every_file_is_removed(python, tmp_path):
    run(python, "import sys; from sls.campaign import cli; sys.exit(cli.main("
                f"['gains', '--runs', '0-1', '--workers', '1', '--out', '{tmp_path}/out']))")
    assert len((tmp_path / "out/runs.csv").read_text().splitlines()) == 3
    files = python.parents[1].rglob("site-packages/*sls*")
    assert len(list(files)) == 3  # package, module, dist-info
    assert (python.parent / "sls").exists()
    subprocess.run([python, "-m", "pip", "uninstall", "-y", "sls"], check=True, capture_output=True)
    assert not [*python.parents[1].rglob("site-packages/*sls*"), *python.parents[1].rglob("bin/sls")]
