"""Hosts for tests: network namespaces on a bridge, each with its own host name.

The machine's network does not change, because the bridge is in a namespace, too. Every process, also
the launcher, runs on one of the hosts."""

import os
import shutil
import subprocess
from pathlib import Path

from processes import kill

OURS = "sls-test-"  # prefix, shared with tests/network: both remove namespaces that killed tests left behind


class Obstacle(Exception):
    """The reason why this machine cannot run these hosts or the cluster."""


def run(*command: str) -> str:
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise Obstacle(f"{' '.join(command)}: {(done.stderr or done.stdout).strip()}")
    return done.stdout


def need_programs(package: str, *programs: str) -> None:
    """Raises Obstacle if one of `programs` is not installed."""
    for program in programs:
        if not shutil.which(program):
            raise Obstacle(f"{program} is missing (apt-get install {package})")


def remove_what_killed_tests_left() -> None:
    for namespace in Path("/run/netns").glob(f"{OURS}*"):
        process = namespace.name.removeprefix(OURS).partition("-")[0]
        if process.isdecimal() and not Path(f"/proc/{process}").exists():
            remove_namespace(namespace.name)


def list_processes(namespace: str) -> list[int]:
    done = subprocess.run(["ip", "netns", "pids", namespace], capture_output=True, text=True)
    return [int(process) for process in done.stdout.split()]


def remove_namespace(namespace: str) -> None:
    """Removes a namespace and kills the processes in it."""
    for process in list_processes(namespace):
        kill(process)
    subprocess.run(["ip", "netns", "delete", namespace], capture_output=True)


class TestHosts:
    """`with TestHosts("head", "n1") as hosts`: the hosts are removed at its end. Raises Obstacle."""

    __test__ = False  # pytest must not collect this class
    _count = 0

    def __init__(self, *names: str):
        if os.geteuid() != 0:
            raise Obstacle("network namespaces need root")
        need_programs("iproute2 util-linux", "ip", "unshare", "hostname")
        TestHosts._count += 1
        self.prefix = f"{OURS}{os.getpid()}-c{TestHosts._count}-"
        self.address = {name: f"10.78.0.{number}" for number, name in enumerate(names, 1)}

    def __enter__(self) -> "TestHosts":
        remove_what_killed_tests_left()
        try:
            switch = self.prefix + "switch"
            run("ip", "netns", "add", switch)
            run("ip", "-n", switch, "link", "add", "br0", "type", "bridge")
            run("ip", "-n", switch, "link", "set", "br0", "up")
            for name, address in self.address.items():
                host = self.prefix + name
                run("ip", "netns", "add", host)
                run("ip", "-n", switch, "link", "add", name, "type", "veth", "peer", "name", "eth0",
                    "netns", host)
                run("ip", "-n", switch, "link", "set", name, "master", "br0", "up")
                run("ip", "-n", host, "link", "set", "lo", "up")
                run("ip", "-n", host, "address", "add", f"{address}/24", "dev", "eth0")
                run("ip", "-n", host, "link", "set", "eth0", "up")
        except Obstacle:
            self.remove()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.remove()

    def remove(self) -> None:
        for name in [*self.address, "switch"]:
            remove_namespace(self.prefix + name)

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
        return ["ip", "netns", "exec", self.prefix + host, "unshare", "--uts", "sh", "-c",
                'hostname "$0" && exec "$@"', host, *command]
