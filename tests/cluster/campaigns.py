"""A short campaign whose runs a test can hold, and `./sls campaign` on a test host."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from hosts import TestHosts
from places import ROOT
from processes import wait_until

PATH = os.environ["PYTHONPATH"]
LIMIT_S = 60.0

CAMPAIGN = """\
base: base.yaml
runs: 60
vary:
  vehicle.load_mass_kg: { uniform: [0.15, 0.25], seed: 1 }
measure:
  - load_error_rms
  - load_error_max
  - { python: gate.py, function: gate, columns: [gate] }
"""

# A measure that waits while the file `hold` exists. It is always 0: held runs give the same table.
GATE = """\
import platform
import time
from pathlib import Path

HERE = Path(__file__).parent


def gate(flight):
    hold, deadline = HERE / "hold", time.monotonic() + 60
    if platform.node() == "head":  # the launcher tries a run
        return 0.0
    if hold.exists():
        (HERE / f"flying-{platform.node()}").touch()
    while hold.exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    return 0.0
"""

# As `./sls campaign`, with changes of constants of the engines, such as shorter time limits.
LAUNCH = """\
import importlib, sys
for change in sys.argv[1].split():
    name, value = change.split("=")
    module, _, constant = name.rpartition(".")
    setattr(importlib.import_module("sls.campaign.engines." + module), constant, eval(value))
from sls.campaign.cli import main
sys.exit(main(sys.argv[2:]))
"""


class TestCampaign:
    """The campaign in `folder`, flown by a launcher on the test host `head`."""

    __test__ = False  # pytest must not collect this class

    def __init__(self, hosts: TestHosts, folder: Path):
        self.hosts = hosts
        self.folder = folder
        self.file = folder / "short.yaml"
        self.file.write_text(CAMPAIGN)
        (folder / "gate.py").write_text(GATE)
        shutil.copy(ROOT / "config/scenarios/short.yaml", folder / "base.yaml")
        self.hold_file = folder / "hold"

    def start(self, *arguments: str, changes: str = "", **environment: str) -> "Launched":
        command = [sys.executable, "-BP", "-c", LAUNCH, changes, *arguments]
        return Launched(subprocess.Popen(
            self.hosts.on("head", *command), stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            text=True, cwd=self.folder,
            env={**os.environ, **environment}))

    def fly(self, out: str, *arguments: str, changes: str = "", **environment: str) -> "Launched":
        return self.start(self.file.name, "--out", out, "--chunk-runs", "10", *arguments,
                          changes=changes, **environment)

    def table(self, out: str) -> bytes:
        return (self.folder / out / "runs.csv").read_bytes()

    def machines(self, out: str) -> set[str]:
        """The hosts that flew chunks, from the files of the chunks."""
        return {host for file in (self.folder / out / "chunks").glob("chunk-*.csv")
                for host in self.hosts.address if f'"host": "{host}"' in file.read_text()}

    def hold(self) -> None:
        """Makes the runs wait from now on."""
        for file in self.folder.glob("flying-*"):
            file.unlink()
        self.hold_file.touch()

    def wait_until_held(self, *hosts: str) -> None:
        for host in hosts:
            wait_until((self.folder / f"flying-{host}").exists, LIMIT_S, f"a run waits on {host}")

    def release(self) -> None:
        self.hold_file.unlink(missing_ok=True)


class Launched:
    """A launcher process."""

    def __init__(self, process: subprocess.Popen):
        self.process = process
        self.output = ""

    def is_running(self) -> bool:
        return self.process.poll() is None

    def expect(self, code: int, *texts: str) -> str:
        """Waits for the launcher's end. Raises AssertionError with its output if the exit code differs,
        if a text is missing, or if an error has more than one line."""
        try:
            self.output, _ = self.process.communicate(timeout=LIMIT_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.output, _ = self.process.communicate()
        assert self.process.returncode == code, self.output
        for text in texts:
            assert text in self.output, self.output
        if code in (1, 2):
            assert "Traceback" not in self.output, self.output
            assert self.output.splitlines()[-1].startswith("sls: error: "), self.output
        return self.output
