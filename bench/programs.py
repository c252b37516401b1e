"""Starts the programs, waits for them with deadlines and ends all of them."""

import contextlib
import json
import os
import re
import signal
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sls.errors import RunError

ROOT = Path(__file__).resolve().parents[1]
LONGEST_S = 600.0  # of one flight; callgrind takes minutes
DOMAINS = range(61, 81, 2)  # and the one after each; tests use the domains below 61


@dataclass
class Flight:
    """Result of a run of the three programs."""

    steps: int
    steps_per_s: float
    label: str  # timing, as the server prints it
    processor_s: dict[str, float]  # user and system time of each program, start and end included
    manifest: dict[str, Any]

    @property
    def processor_us(self) -> dict[str, float]:
        """Processor time of each program per step."""
        return {name: time * 1e6 / self.steps for name, time in self.processor_s.items()}


START = ["setpriv", "--pdeathsig", "TERM", "--"]
# The limit ends it after ten minutes of processor time, in case no program does.
COUNTING = ["sh", "-c", "ulimit -t 600; while :; do n=$((n + 1)); done"]


class Programs:
    def __init__(self, build: Path, domain: int, scratch: Path):
        self.build = build
        self.domain = domain
        self.scratch = scratch
        self.count = 0

    def make_path(self, suffix: str) -> Path:
        self.count += 1
        return self.scratch / f"{self.count}{suffix}"

    def figure_eight(self, seconds: float = 32, *, is_recorded: bool = True, plant: str = "pendulum: ideal") -> Path:
        """A changed copy of the shipped scenario."""
        text = (ROOT / "config/scenarios/figure_eight.yaml").read_text().replace("for_s: 32", f"for_s: {seconds:g}")
        text = text.replace("pendulum: ideal", plant).replace("recorders: 1", f"recorders: {is_recorded:d}")
        path = self.make_path(".yaml")
        path.write_text(text)
        return path

    # --- one program ------------------------------------------------------------------------------

    def start(self, command: list[str], log: Path, may_spin: bool = True) -> subprocess.Popen[bytes]:
        """The kernel ends the process if this program is killed."""
        environment = {name: value for name, value in os.environ.items() if name != "SLS_SPIN"}
        if not may_spin:
            environment["SLS_SPIN"] = "off"
        with log.open("wb") as output:
            return subprocess.Popen([*START, *command], stdout=output, stderr=subprocess.STDOUT,
                                    stdin=subprocess.DEVNULL, env=environment)

    def run(self, *words: str | Path) -> str:
        """Runs a program, which must end with exit code 0. Returns its stdout."""
        command = [str(word) for word in words]
        try:
            done = subprocess.run([*START, *command], capture_output=True, text=True,
                                  timeout=LONGEST_S, check=False)
        except subprocess.TimeoutExpired:
            raise RunError(f"{' '.join(command)}: expected an end within {LONGEST_S:.0f} s") from None
        if done.returncode != 0:
            raise RunError(f"{' '.join(command)}: ended with {done.returncode}: "
                           f"{done.stderr.strip() or done.stdout.strip()}")
        return done.stdout

    def run_probe(self, subcommand: str, *words: str | Path) -> str:
        """What sls_bench_probe prints."""
        return self.run(self.build / "bin/sls_bench_probe", subcommand, *words)

    @contextlib.contextmanager
    def busy_loops(self, count: int) -> Iterator[list[subprocess.Popen[bytes]]]:
        """Processes that only count, until the context ends."""
        loops: list[subprocess.Popen[bytes]] = []
        try:
            for _ in range(count):
                loops.append(self.start(COUNTING, self.make_path("-count.log")))
            yield loops
        finally:
            end_all(loops)

    # --- the three programs -----------------------------------------------------------------------

    def make_commands(self, scenario: Path, recording: Path | None, *common: str, server: tuple[str, ...] = (),
                      domain: int | None = None) -> dict[str, list[str]]:
        """The commands of server, client and, with a `recording`, recorder. `common` are options of all of them."""
        common = ("--domain", str(self.domain if domain is None else domain), *common)
        flown = [*common, "--scenario", str(scenario)]
        words = {"sim_server": [*flown, *server], "control_client": flown}
        if recording:
            words["recorder"] = [*common, "--out", str(recording)]
        return {name: [str(self.build / "bin" / name), *flags] for name, flags in words.items()}

    def run_together(self, commands: dict[str, list[str]], *, during: Callable[[], None] | None = None,
                     may_spin: bool = True) -> tuple[dict[str, float], dict[str, str]]:
        """Starts the commands together, calls `during`, and waits until all have ended well. Returns the processor time
        of each, s, and what it printed."""
        logs = {name: self.make_path(f"-{name}.log") for name in commands}
        processes: dict[str, subprocess.Popen[bytes]] = {}
        processor_s = {}
        try:
            for name, command in commands.items():
                processes[name] = self.start(["timeout", f"{LONGEST_S:.0f}", *command], logs[name], may_spin)
            if during:
                during()
            for name, process in processes.items():
                _, status, usage = os.wait4(process.pid, 0)
                process.returncode = os.waitstatus_to_exitcode(status)
                processor_s[name] = usage.ru_utime + usage.ru_stime
        finally:
            end_all(list(processes.values()))
        said = {name: log.read_text() for name, log in logs.items()}
        for name, process in processes.items():
            if process.returncode != 0:
                raise RunError(f"{name} ended with {process.returncode}: {said[name].strip()}")
        return processor_s, said

    def fly(self, scenario: Path, *, qos: str = "default", is_recorded: bool = True,
            server: tuple[str, ...] = (), during: Callable[[], None] | None = None,
            may_spin: bool = True) -> Flight:
        """Flies `scenario` and calls `during` in the flight. Without `may_spin`, the threads of server
        and client that wait for an answer block at once."""
        recording = self.make_path("") if is_recorded else None
        commands = self.make_commands(scenario, recording, "--qos", str(ROOT / f"config/qos/{qos}.xml"), server=server)
        processor_s, said = self.run_together(commands, during=during, may_spin=may_spin)
        found = re.search(r"finished: (\d+) steps, .*, (\d+) steps/s, \d+ resent, (.*)", said["sim_server"])
        if not found:
            raise RunError(f"sim_server: expected a last line with steps/s, got: {said['sim_server']}")
        manifest = json.loads((recording / "manifest.json").read_text()) if recording else {}
        return Flight(int(found[1]), float(found[2]), found[3].strip(), processor_s, manifest)


def end_all(processes: list[subprocess.Popen[bytes]]) -> None:
    for process in processes:
        if process.poll() is None:
            process.send_signal(signal.SIGTERM)
    for process in processes:
        try:
            process.wait(timeout=30)  # longer than a blocked program takes to end itself
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
