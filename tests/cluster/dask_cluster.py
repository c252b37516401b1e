"""A real Dask cluster from Debian's packages: the scheduler on the test host `head`, a worker on each
of the other hosts."""

import re
import sys
from pathlib import Path

from hosts import Obstacle, TestHosts
from processes import Processes, wait_until

START_S = 30.0
WORKERS = ("n1", "n2")
PORT = 8786


class DaskCluster:
    """Raises Obstacle."""

    def __init__(self, hosts: TestHosts, folder: Path):
        try:
            import distributed
        except ImportError:
            raise Obstacle("distributed is missing (apt-get install python3-distributed)") from None
        assert distributed
        self.hosts = hosts
        self.folder = folder
        self.address = f"tcp://{hosts.address['head']}:{PORT}"
        self.processes = Processes(folder)

    def start_all(self) -> None:
        self.start_scheduler()
        for worker in WORKERS:
            self.start_worker(worker)
        for worker in WORKERS:
            self.wait_for(worker, r"Registered to:")

    def end_jobs(self) -> None:
        """They end with their campaign."""

    def start_scheduler(self) -> None:
        self.start("scheduler", "head", "dask_scheduler", "--host", self.hosts.address["head"],
                   "--port", str(PORT))
        self.wait_for("scheduler", r"Scheduler at:")

    def start_worker(self, name: str) -> None:
        # The worker gets no PYTHONPATH: it must find the package by the places in its task. No nanny,
        # because a nanny starts a killed worker again.
        self.start(name, name, "dask_worker", self.address, "--nthreads", "1", "--no-nanny",
                   "--host", self.hosts.address[name], "--local-directory",
                   str(self.folder / f"of-{name}"), "--memory-limit", "0")

    def start(self, name: str, host: str, module: str, *options: str) -> None:
        self.processes.start(name, self.hosts.on(
            host, sys.executable, "-B", "-m", f"distributed.cli.{module}", "--no-dashboard",
            *options), PYTHONPATH="")

    def wait_for(self, name: str, line: str) -> None:
        wait_until(lambda: re.search(line, self.processes.output(name)), START_S,
                   f"{name} says '{line}'")
