"""Starts the programs, waits for them with deadlines and leaves none behind."""

import json
import os
import re
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench.machine import read_memory_kb

ROOT = Path(__file__).resolve().parents[1]
LONGEST_S = 300.0  # of one flight


class MeasurementError(Exception):
    """A program did not do what was to be measured."""


@dataclass
class Flight:
    """What came of a run of the three programs."""

    steps: int
    steps_per_s: float
    label: str  # timing, as the server says it
    wall_s: float  # from starting the programs to the end of all
    server_memory_kb: int  # resident, the largest seen
    recording: Path | None
    manifest: dict[str, Any]

    @property
    def lost(self) -> int:
        """Samples that the recording lacks."""
        gaps = self.manifest.get("missing", [])
        return (sum(gap["to"] - gap["from"] + 1 for gap in gaps)
                + self.manifest.get("refused_samples", 0))


START = ["setpriv", "--pdeathsig", "TERM", "--"]


@dataclass(frozen=True)
class Placement:
    """Processors of server and client, and of the recorder; empty: the system chooses."""

    name: str = "placed by the system"
    loop: str = ""
    recorder: str = ""


def pin(processors: str) -> list[str]:
    return ["taskset", "--cpu-list", processors] if processors else []


def find_placements() -> list[Placement]:
    """That of the system and, with two processors or more, that of `./sls run`."""
    first, *others = sorted(os.sched_getaffinity(0))
    if not others:
        return [Placement()]
    return [Placement("server and client on one processor", str(first), ",".join(map(str, others))),
            Placement()]


class Programs:
    def __init__(self, build: Path, domain: int, scratch: Path):
        self.build = build
        self.domain = domain
        self.scratch = scratch
        self.probe_program = build / "bin/sls_bench_probe"
        self.count = 0

    def make_path(self, suffix: str) -> Path:
        self.count += 1
        return self.scratch / f"{self.count}{suffix}"

    def scenario(self, name: str, change: Callable[[str], str] = lambda text: text) -> Path:
        """A shipped scenario, changed."""
        text = change((ROOT / "config/scenarios" / f"{name}.yaml").read_text())
        path = self.make_path(".yaml")
        path.write_text(text)
        return path

    def qos(self, name: str | Path) -> Path:
        return name if isinstance(name, Path) else ROOT / "config/qos" / f"{name}.xml"

    # --- one program ------------------------------------------------------------------------------

    def start(self, command: list[str], log: Path, processors: str = "") -> subprocess.Popen[bytes]:
        """The kernel ends it should we be killed."""
        with log.open("wb") as output:
            return subprocess.Popen([*START, *pin(processors), *command], stdout=output,
                                    stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL)

    def run(self, *words: str | Path, processors: str = "") -> str:
        """stdout of a program that must end well."""
        command = [str(word) for word in words]
        try:
            done = subprocess.run([*START, *pin(processors), *command],
                                  capture_output=True, text=True, timeout=LONGEST_S, check=False)
        except subprocess.TimeoutExpired:
            raise MeasurementError(f"{' '.join(command)}: expected an end within {LONGEST_S:.0f} s"
                                   ) from None
        if done.returncode != 0:
            raise MeasurementError(f"{' '.join(command)}: ended with {done.returncode}: "
                                   f"{done.stderr.strip() or done.stdout.strip()}")
        return done.stdout

    def probe(self, subcommand: str, *words: str | Path, processors: str = "") -> Any:
        """The JSON that bench's own program prints."""
        return json.loads(self.run(self.probe_program, subcommand, *words, processors=processors))

    # --- the three programs -----------------------------------------------------------------------

    def fly(self, scenario: Path, *, qos: str | Path = "default", is_recorded: bool = True,
            server: tuple[str, ...] = (), during: Callable[[], None] | None = None,
            placement: Placement = Placement()) -> Flight:
        """Flies `scenario`; `during` is called while it flies."""
        common = ["--domain", str(self.domain), "--qos", str(self.qos(qos))]
        programs = {name: str(self.build / "bin" / name)
                    for name in ("recorder", "sim_server", "control_client")}
        recording = self.make_path("") if is_recorded else None
        commands = {"sim_server": [*common, "--scenario", str(scenario), *server],
                    "control_client": [*common, "--scenario", str(scenario)]}
        if recording:
            commands["recorder"] = [*common, "--out", str(recording)]
        logs = {name: self.make_path(f"-{name}.log") for name in commands}
        began = time.monotonic()
        processes = {}
        try:
            for name, flags in commands.items():
                processors = placement.recorder if name == "recorder" else placement.loop
                processes[name] = self.start([programs[name], *flags], logs[name], processors)
            memory = MemoryWatch(processes["sim_server"].pid)  # setpriv becomes the program
            if during:
                during()
            for name, process in processes.items():
                code = process.wait(timeout=max(LONGEST_S - (time.monotonic() - began), 1))
                if code != 0:
                    raise MeasurementError(f"{name} ended with {code}: {logs[name].read_text().strip()}")
        except subprocess.TimeoutExpired as error:
            program = next(word for word in error.cmd if word.startswith(str(self.build)))
            raise MeasurementError(f"{program}: expected an end within {LONGEST_S:.0f} s") from None
        finally:
            end_all(list(processes.values()))
        said = logs["sim_server"].read_text()
        found = re.search(r"finished: (\d+) steps, .*, (\d+) steps/s, \d+ resent, (.*)", said)
        if not found:
            raise MeasurementError(f"sim_server: expected a last line with steps/s, got: {said}")
        manifest = json.loads((recording / "manifest.json").read_text()) if recording else {}
        return Flight(int(found[1]), float(found[2]), found[3].strip(),
                      time.monotonic() - began, memory.stop(), recording, manifest)


class MemoryWatch:
    """The largest resident memory of a process, looked at ten times a second."""

    def __init__(self, process_id: int):
        self.largest = 0
        self.over = threading.Event()

        def watch() -> None:
            while not self.over.wait(0.1):
                self.largest = max(self.largest, read_memory_kb(process_id))

        self.thread = threading.Thread(target=watch, daemon=True)
        self.thread.start()

    def stop(self) -> int:
        self.over.set()
        self.thread.join()
        return self.largest


def end_all(processes: list[subprocess.Popen[bytes]]) -> None:
    for process in processes:
        if process.poll() is None:
            process.send_signal(signal.SIGTERM)
    for process in processes:
        try:
            process.wait(timeout=30)  # longer than a program that hangs is patient with itself
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def make_scratch() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="sls-bench-", dir=os.environ.get("TMPDIR"))
