"""Hosts for tests, each with its own host name. Every process, also the launcher, runs on one of the hosts."""

import os
import shutil
import subprocess

from processes import kill
from sls.check.hosts import Network
from sls.errors import RunError as Obstacle  # why this machine cannot run these hosts or the cluster


def need_programs(package: str, *programs: str) -> None:
    """Raises Obstacle if one of `programs` is not installed."""
    for program in programs:
        if not shutil.which(program):
            raise Obstacle(f"{program} is missing (apt-get install {package})")


def list_processes(namespace: str) -> list[int]:
    done = subprocess.run(["ip", "netns", "pids", namespace], capture_output=True, text=True)
    return [int(process) for process in done.stdout.split()]


class TestHosts(Network):
    """`with TestHosts("head", "n1") as hosts`: the hosts are removed at its end. Raises Obstacle."""

    __test__ = False  # pytest must not collect this class

    def __init__(self, *names: str):
        if os.geteuid() != 0:
            raise Obstacle("network namespaces need root")
        need_programs("iproute2 util-linux", "ip", "unshare", "hostname")
        super().__init__("sls-test", *names)  # tests/network removes what killed tests left of these, too

    def remove(self, namespace: str) -> None:
        """Also kills the processes in it."""
        for process in list_processes(namespace):
            kill(process)
        super().remove(namespace)

    def processes(self, host: str) -> list[int]:
        """Ids of all processes on a host, daemons included."""
        return list_processes(self.prefix + host)

    def lose_power(self, host: str) -> None:
        """Kills all processes on a host at once."""
        for process in self.processes(host):
            kill(process)

    def on(self, host: str, *command: str) -> list[str]:
        """The command that runs `command` on a host. Each program of its prefix replaces itself by the
        next one: the process id does not change."""
        return [*super().on(host), "unshare", "--uts", "sh", "-c", 'hostname "$0" && exec "$@"', host, *command]
