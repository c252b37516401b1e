"""Hosts made of network namespaces, one for each program, on one switch. Needs root, `ip` and `nft`."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Self

from sls.check.faults import Fault
from sls.errors import RunError
from sls.input_error import InputError

NAMES = ("server", "controller", "recorder")
RULE = ("nft 'add table bridge wire; add chain bridge wire f {{ type filter hook forward priority 0; }}; "
        "add rule bridge wire f {} counter drop'")


class Network:
    """Hosts, each with loopback and one interface, `eth0`. The switch is the bridge `br0` in a namespace of its own. Use
    it in a `with` statement. The machine's own network is not touched."""

    def __init__(self, prefix: str, *names: str) -> None:
        self._kind = prefix
        self.prefix = f"{prefix}-{os.getpid()}-"
        self.address = {name: f"10.77.0.{number}" for number, name in enumerate(names, 1)}

    def __enter__(self) -> Self:
        for path in Path("/run/netns").glob(f"{self._kind}-*"):  # of processes that were killed
            if not Path("/proc", path.name.split("-")[2]).exists():
                self.remove(path.name)
        try:
            self.make()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        for host in (*self.address, "switch"):
            self.remove(self.prefix + host)

    def remove(self, namespace: str) -> None:
        subprocess.run(["ip", "netns", "delete", namespace], check=False, capture_output=True)

    def make(self) -> None:
        """Raises RunError."""
        run(f"ip netns add {self.prefix}switch")
        self.run("switch", "ip link add br0 type bridge && ip link set br0 up")
        for host, address in self.address.items():
            run(f"ip netns add {self.prefix}{host}")
            self.run("switch", f"ip link add {host} type veth peer name eth0 netns {self.prefix}{host} && "
                               f"ip link set {host} master br0 up")
            self.run(host, f"ip link set lo up && ip address add {address}/24 dev eth0 && ip link set eth0 up")

    def on(self, host: str) -> list[str]:
        """The words before a command that runs on this host."""
        return ["ip", "netns", "exec", self.prefix + host]

    def run(self, host: str, command: str) -> None:
        run(f"ip netns exec {self.prefix}{host} sh -c '" + command.replace("'", "'\\''") + "'")


class Hosts(Network):
    """The hosts of a flight, with faults."""

    def __init__(self, faults: tuple[Fault, ...]) -> None:
        path = os.environ["PATH"] + ":/usr/sbin"
        missing = [tool for tool in ("ip", "nft", "tc") if not shutil.which(tool, path=path)]
        if os.geteuid() != 0 or missing:
            raise InputError("placement hosts: expected root and the programs ip, nft and tc, got "
                             + ("another user" if os.geteuid() else "no " + ", ".join(missing)))
        super().__init__("sls-check", *NAMES)
        self._values = {fault.word: fault.value for fault in faults}
        self._wire: subprocess.Popen[str] | None = None

    def __exit__(self, *_: object) -> None:
        if self._wire:
            self._wire.terminate()
            self._wire.communicate()
        super().__exit__()

    def cut(self) -> None:
        """Nothing passes between hosts until `heal`."""
        self.run("switch", "nft flush ruleset && " + RULE.format(""))

    def heal(self) -> None:
        self.run("switch", "nft flush ruleset")
        if loss := self._values.get("loss"):
            share = round(float(loss) * 1000)
            self.run("switch", RULE.format(f"ether type ip numgen random mod 1000 < {share}"))

    def make(self) -> None:
        super().make()
        if rate := self._values.get("bandwidth_mbit"):
            limit = f"root tbf burst 4kb latency 50ms rate {round(float(rate) * 1000)}kbit"
            for host in NAMES:
                self.run("switch", f"tc qdisc add dev {host} {limit}")
                self.run(host, f"tc qdisc add dev eth0 {limit}")
        delay_ms, jitter_ms = (float(self._values.get(word, 0)) for word in ("delay_ms", "jitter_ms"))
        if delay_ms or jitter_ms:
            self._delay(delay_ms, jitter_ms)
        self.heal()

    def _delay(self, delay_ms: float, jitter_ms: float) -> None:
        """Puts a wire with delay between the controller and the switch."""
        self.run("switch", "ip link set controller nomaster && ip link add wire type veth peer name port && "
                           "ip link set wire up && ip link set port master br0 up")
        wire = Path(__file__).with_name("wire.py")
        command = [*self.on("switch"), sys.executable, "-BP", wire, "controller", "wire", str(delay_ms), str(jitter_ms)]
        self._wire = subprocess.Popen(command, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        assert self._wire.stdout
        if (line := self._wire.stdout.readline()) != "ready\n":
            got = (line + self._wire.stdout.read()).strip().rpartition("\n")[2]
            raise RunError(f"placement hosts: expected a wire with delay, got: {got}")


def run(command: str) -> None:
    """Raises RunError with the command's output."""
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False,
                          env={**os.environ, "PATH": os.environ["PATH"] + ":/usr/sbin:/sbin"})
    if done.returncode != 0:
        raise RunError(f"placement hosts: {' '.join((done.stderr or done.stdout).split())} (of: {command})")
