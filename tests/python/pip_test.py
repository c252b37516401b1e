"""pip install ./python, in a virtual environment and without an index, and the package's names and classes there."""

import os
import subprocess

import conftest
import pytest


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
                           conftest.ROOT / "python"], capture_output=True, text=True, cwd=folder,
                          env={**os.environ, "SLS_BUILD": str(conftest.BUILD)})
    assert done.returncode == 0, done.stdout + done.stderr
    return python


def run(python, code):
    environment = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "SLS_BUILD")}
    done = subprocess.run([python, "-c", code], capture_output=True, text=True, env=environment,
                          cwd=python.parents[2], timeout=100)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_a_flight_by_name_is_that_of_the_checkout(python):
    import sls
    said = run(python, "import sls; print(sls.__file__, sls.fly('short').certificate)").split()
    assert said == [str(python.parents[1] / f"lib/{said[0].split('/lib/')[1].split('/')[0]}/site-packages/sls/__init__.py"),
                    sls.fly("short").certificate]


def test_a_campaign_by_name_flies_and_every_file_is_removed(python, tmp_path):
    run(python, "import sys; from sls.campaign import cli; sys.exit(cli.main("
                f"['gains', '--runs', '0-1', '--workers', '1', '--out', '{tmp_path}/out']))")
    assert len((tmp_path / "out/runs.csv").read_text().splitlines()) == 3
    files = python.parents[1].rglob("site-packages/*sls*")
    assert len(list(files)) == 3  # package, module, dist-info
    subprocess.run([python, "-m", "pip", "uninstall", "-y", "sls"], check=True, capture_output=True)
    assert not list(python.parents[1].rglob("site-packages/*sls*"))
