"""Flies a check on one placement: starts the programs, injects the faults and names the program that failed."""

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sls.check.check_file import DEFAULT_READY_S, Check, Participant
from sls.check.faults import Fault, check_able
from sls.check.hosts import Hosts
from sls.check.python_law import STEPS
from sls.dds_domain import own_domain
from sls.launcher.place import BUILD, ROOT, STRAY_VARIABLES
from sls.launcher.supervision import WRITERS_PATIENCE_S, Supervisor

PROFILES = {"shm": "default", "udp": "udp", "hosts": "lan"}
HOST_OF = {"sim_server": "server", "recorder": "recorder", "controller": "controller", "standby": "controller"}
CONTROLLERS = ("controller", "standby")
OVERRUN_S = 20.0  # time in which the other programs must end after the first
STOP_S = 10.0     # time in which a process under test must end after its stop signal
# Without an engine or image `docker run` ends with this code; its first line says why, its last one is a hint.
ENGINES, ENGINE_FAILED = ("docker", "podman"), 125
WORLDS = 10       # of one flight of the placement `worlds`
LOOPBACK = ("<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"lo\" multicast=\"true\"/></Interfaces>"
            "</General></Domain></CycloneDDS>")


@dataclass
class Flown:
    folder: Path
    problem: str = ""  # with a program, in one line
    is_unusable: bool = False  # the problem says nothing about the controller
    is_whole: bool = False  # the recording can be judged
    wall_s: float = 0.0

    @property
    def recording(self) -> Path:
        return self.folder / "recording"

    @property
    def logs(self) -> dict[str, Path]:
        return {file.stem: file for file in sorted(self.folder.glob("*.log"))}

    def read_manifest(self) -> dict[str, Any]:
        try:
            return json.loads((self.recording / "manifest.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}


def fly(check: Check, placement: str, faults: tuple[Fault, ...], folder: Path, number: int) -> Flown:
    """`number` counts repeats, from 0. Raises InputError for what cannot be flown, KeyboardInterrupt if a signal has
    ended the flight."""
    check_able(faults, placement)
    folder.mkdir(parents=True, exist_ok=True)
    flown = Flown(folder)
    begin = time.monotonic()
    scenario = check.scenario_file
    if check.scenario.text != scenario.read_text(encoding="utf-8"):  # with a library in it
        scenario = folder / "scenario.yaml"
        scenario.write_text(check.scenario.text, encoding="utf-8")
    with ExitStack() as stack:
        if any(fault.word == "busy" for fault in faults):
            stack.enter_context(Busy())
        if placement in ("in-process", "worlds"):
            name = "controller" if check.controller else "closed_loop"
            words = [BUILD / "bin/closed_loop", f"--scenario={scenario}", f"--out={flown.recording}", "--force"]
            if check.controller and check.controller.kind == "python":
                words = [*PYTHON_LAW, "closed_loop", check.controller.words[0], scenario, flown.recording]
            Programs(check, flown, (), None, name).run({name: words})
            if placement == "worlds" and not flown.problem:
                fly_worlds(check, flown, scenario, faults, number)
        else:
            hosts = stack.enter_context(Hosts(faults)) if placement == "hosts" else None
            domain = stack.enter_context(own_domain())
            programs = list_programs(check, placement, faults, flown, scenario, domain)
            Programs(check, flown, faults, hosts).run(programs)
    flown.wall_s = time.monotonic() - begin
    return flown


PYTHON_LAW = (sys.executable, "-BP", "-m", "sls.check.python_law")


def list_programs(check: Check, placement: str, faults: tuple[Fault, ...], flown: Flown, scenario: Path,
                  domain: int) -> dict[str, list[Any]]:
    qos = ROOT / f"config/qos/{PROFILES[placement]}.xml"
    network = [f"--qos={qos}", f"--domain={domain}"]
    programs: dict[str, list[Any]] = {
        "recorder": [BUILD / "bin/recorder", f"--out={flown.recording}", "--force", *network],
        "sim_server": [BUILD / "bin/sim_server", f"--scenario={scenario}", *network]}
    has_standby = any(fault.word == "kill" for fault in faults)
    for strength, name in ((1, "controller"), (0, "standby")):
        if name == "controller" or has_standby:
            programs[name] = make_controller(check.controller, name, strength, scenario, qos, domain, network)
    return programs


def make_controller(own: Participant | None, name: str, strength: int, scenario: Path, qos: Path, domain: int,
                    network: list[str]) -> list[Any]:
    if own and own.kind == "python":
        return [*PYTHON_LAW, "client", own.words[0], scenario, qos, str(domain), name, str(strength)]
    if own and own.kind == "command":
        values = {"domain": str(domain), "scenario": str(scenario.resolve()), "qos": str(qos), "name": name,
                  "strength": str(strength)}
        words = list(own.words)
        for key, value in values.items():
            words = [word.replace(f"{{{key}}}", value) for word in words]
        return words
    return [BUILD / "bin/control_client", f"--scenario={scenario}", *network, f"--strength={strength}",
            f"--name={name}"]


class Busy:
    """A busy loop for every processor."""

    def __enter__(self) -> None:
        command = ["setpriv", "--pdeathsig", "KILL", "--", sys.executable, "-S", "-c", "while 1: 0"]
        self._loops = [subprocess.Popen(command) for _ in os.sched_getaffinity(0)]

    def __exit__(self, *_: object) -> None:
        for loop in self._loops:
            loop.kill()
            loop.wait()


class Programs:
    """The programs of one flight, watched."""

    def __init__(self, check: Check, flown: Flown, faults: tuple[Fault, ...], hosts: Hosts | None,
                 flyer: str = "sim_server") -> None:
        """`flyer`: the program whose steps are watched. Another one than the server has the law in it."""
        self._check = check
        self._flyer = flyer
        self._own = check.controller
        self._is_command = bool(self._own and self._own.kind == "command")
        self._flown = flown
        self._hosts = hosts
        self._waiting = [fault for fault in faults if fault.word in ("kill", "stop_s", "partition_s")]
        self._later: list[tuple[float, Any]] = []  # times and the calls that end a fault
        self._begin = self._grown = time.monotonic()
        self._step: int | None = None
        self._is_ready = not (self._own and self._own.ready)
        self._is_asked_to_stop = False
        self._groups: list[int] = []  # of processes under test, which may start further ones

    def run(self, programs: dict[str, list[Any]]) -> None:
        with Supervisor(say=lambda _: None, overrun_s=OVERRUN_S) as self._programs:
            for name, words in programs.items():
                self._start(name, words)
            code = self._programs.wait_all(self._watch)
        for group in self._groups:
            with suppress(ProcessLookupError):
                os.killpg(group, signal.SIGKILL)
        if code in (130, 143):
            raise KeyboardInterrupt
        self._conclude()

    def _start(self, name: str, words: list[Any]) -> None:
        more: dict[str, Any] = {}
        is_own = name in CONTROLLERS and self._own
        if is_own and self._is_command:
            more = {"cwd": self._own.folder, "process_group": 0}
        env = {name: value for name, value in os.environ.items() if name not in STRAY_VARIABLES}
        if not self._hosts:
            env.setdefault("CYCLONEDDS_URI", LOOPBACK)
        if is_own:
            env.update(self._own.env)
        if self._hosts:
            words = [*self._hosts.on(HOST_OF[name]), *words]
        patience = [WRITERS_PATIENCE_S] if name in ("recorder", "closed_loop") else []
        with (self._flown.folder / f"{name}.log").open("wb") as log:
            process = self._programs.start(name, words, *patience, stdout=log, stderr=subprocess.STDOUT,
                                           stdin=subprocess.DEVNULL, env=env, **more)
        self._groups += [process] if more else []

    def _fail(self, problem: str) -> None:
        self._flown.problem = self._flown.problem or problem
        self._programs.end_all()

    # --- while it flies ---------------------------------------------------------------------------

    def _watch(self) -> None:
        now = time.monotonic()
        for item in [item for item in self._later if item[0] <= now]:
            self._later.remove(item)
            self._grown = now
            item[1]()
        if now - self._begin > self._check.limit_s:
            return self._fail(f"expected a flight of at most {self._check.limit_s:g} s, got a longer one "
                              f"(at step {self._find_step() or 0})")
        self._watch_ready(now)
        self._watch_steps(now)
        is_over = "sim_server" in self._programs.codes
        if is_over and not self._is_asked_to_stop and self._is_command:
            self._is_asked_to_stop = True
            for name in CONTROLLERS:
                self._programs.send(name, self._own.stop, STOP_S)
        elif not is_over and self._programs.codes.get("controller") == 0 and not self._later:
            self._later.append((now + STOP_S, self._fail_early))

    def _fail_early(self) -> None:
        if self._programs.is_running("sim_server"):
            self._fail(f"controller: {describe_code(0)} at step {self._find_step() or 0}, before the flight was over"
                       f"{self._quote('controller', 0)}")

    def _watch_ready(self, now: float) -> None:
        if self._is_ready or not self._own:
            return
        self._is_ready = self._own.ready in self._read_log("controller")
        if not self._is_ready and now - self._begin > self._own.ready_s:
            self._fail(f"controller: expected '{self._own.ready}' in its output within {self._own.ready_s:g} s, got "
                       f"{self._read_line('controller') or 'nothing'}")

    def _watch_steps(self, now: float) -> None:
        """Faults begin with the first recorded steps; a controller that hangs stops them."""
        step = self._find_step()
        if step != self._step:
            self._step, self._grown = step, now
            for fault in self._waiting:
                self._begin_fault(fault, now)
            self._waiting = []
        if self._later or not self._programs.is_running(self._flyer):
            return
        own, is_in_process = self._own, self._flyer != "sim_server"
        if step is None and not is_in_process:
            return  # the server says which participant does not come
        is_loading = step is None and own and own.kind == "python"
        patience_s = DEFAULT_READY_S if not own else own.ready_s if is_loading else own.silent_s
        if now - self._grown <= patience_s:
            return
        name = self._flyer if is_in_process else "controller"
        after, said = "" if step is None else f" after step {step}", self._read_line(name)
        self._fail(f"{name}: expected an answer within {patience_s:g} s, got none{after}" + (said and f": {said}"))
        if self._is_command:  # it may have to end what it has started, such as a container
            self._programs.send(name, own.stop, STOP_S)
        else:
            self._programs.send(name, signal.SIGKILL)  # a law that hangs ignores other signals

    def _begin_fault(self, fault: Fault, now: float) -> None:
        if fault.word == "kill":
            self._programs.expendable.add("controller")
            self._programs.send("controller", signal.SIGKILL)
        elif fault.word == "stop_s":
            self._programs.send("controller", signal.SIGSTOP)
            self._later.append((now + float(fault.value), lambda: self._programs.send("controller", signal.SIGCONT)))
        elif self._hosts:
            self._hosts.cut()
            self._later.append((now + float(fault.value), self._hosts.heal))

    def _find_step(self) -> int | None:
        """The last step that is recorded, or that a Python law in one process has answered."""
        with suppress(OSError):
            count = int.from_bytes((self._flown.folder / STEPS).read_bytes(), sys.byteorder)
            return count - 1 if count else None
        with suppress(OSError, IndexError, ValueError), (self._flown.recording / "state.csv").open("rb") as file:
            file.seek(max(0, file.seek(0, os.SEEK_END) - 8000))
            return int(file.read().split(b"\n")[-2].split(b",")[1])
        return None

    # --- afterwards -------------------------------------------------------------------------------

    def _conclude(self) -> None:
        """Names the program that failed, if the recording alone does not say it."""
        codes = {name: code for name, code in self._programs.codes.items() if name not in self._programs.expendable}
        self._flown.is_unusable = self._is_engine_failure(codes.get("controller", 0)) or any(
            code == -signal.SIGBUS or code == 2 and not (self._is_command and name in CONTROLLERS)
            for name, code in codes.items())
        manifest = self._flown.read_manifest()
        outcome, reason = manifest.get("outcome"), str(manifest.get("reason"))
        if not self._flown.problem:
            self._flown.problem = self._find_late_end(codes) or self._find_early_end(codes, outcome, reason)
        if self._waiting and not self._flown.problem and outcome == "finished":
            self._flown.problem = (f"--under {self._waiting[0]}: expected a flight of more than 0.3 s, got one that "
                                   "was over before the fault began")
        self._flown.is_whole = outcome == "finished" or outcome == "failed" and not self._flown.problem
        if not self._flown.is_whole and (obstacle := find_obstacle(self._flown.folder, self._flyer == "sim_server")):
            self._flown.problem, self._flown.is_unusable = obstacle, True

    def _find_late_end(self, codes: dict[str, int]) -> str:
        """A process under test that was asked to stop after the flight, and did not."""
        own = self._own
        if own and self._is_asked_to_stop and own.stop != signal.SIGKILL and -signal.SIGKILL in codes.values():
            return f"controller: expected an end within {STOP_S:g} s after {own.stop.name}, got none: killed"
        return ""

    def _find_early_end(self, codes: dict[str, int], outcome: str | None, reason: str) -> str:
        step = f"at step {self._find_step() or 0}"
        if outcome == "finished":
            for name in CONTROLLERS:
                code = codes.get(name, 0)
                if code and not (self._is_asked_to_stop and (code < 0 or code > 128)):
                    return f"{name}: {describe_code(code)} after the flight{self._quote(name, code)}"
            return ""
        if outcome == "failed":  # the reason says it all, unless a controller ended first
            is_gone = re.search("interrupted by|not ready within|no answer", reason)
            blamed = next((name for name in list(codes)[:1] if is_gone and name in CONTROLLERS), "")
        else:
            blamed = next((name for name, code in codes.items() if code or name in CONTROLLERS), "sim_server")
        code = codes.get(blamed, 0)
        self._flown.is_unusable |= bool(blamed) and self._is_ours(blamed, code, outcome)
        return blamed and (f"{blamed}: {describe_code(code)} {step}, before the flight was over"
                           f"{self._quote(blamed, code)}")

    def _is_ours(self, blamed: str, code: int, outcome: str | None) -> bool:
        """Whether the end of this program says nothing about the controller: one without a law in it, or one of ours
        that ended before the recorder heard of the run."""
        if blamed in CONTROLLERS:
            return code in (1, 126, 127) and outcome is None and self._flyer == "sim_server" and not self._is_command
        return blamed != "closed_loop" or code > 0 or not self._check.scenario.law.endswith(".so")

    def _read_log(self, name: str) -> str:
        try:
            return (self._flown.folder / f"{name}.log").read_text(encoding="utf-8", errors="replace")
        except OSError:
            return ""

    def _read_line(self, name: str, index: int = -1) -> str:
        return (self._read_log(name).strip().splitlines() or [""])[index][:200]

    def _is_engine_failure(self, code: int) -> bool:
        return self._is_command and code == ENGINE_FAILED and Path(self._own.words[0]).name in ENGINES

    def _quote(self, name: str, code: int) -> str:
        line = self._read_line(name, 0 if self._is_engine_failure(code) else -1)
        return f": {line}" if line else ", without a word"


def find_obstacle(folder: Path, uses_shared_memory: bool) -> str:
    """Why no flight can be recorded here, or no program can start; else empty."""
    for place in (folder, Path("/dev/shm"))[:1 + uses_shared_memory]:
        try:
            with tempfile.TemporaryFile(dir=place, buffering=0) as file:
                os.posix_fallocate(file.fileno(), 0, 2**20)
        except OSError as error:
            return f"{place}: expected room for a flight, got: {error.strerror}"
    return ""


def describe_code(code: int) -> str:
    number = -code if code < 0 else code - 128
    try:
        return f"ended by {signal.Signals(number).name}"
    except ValueError:
        return f"ended with {code}"


# --- worlds ---------------------------------------------------------------------------------------


def fly_worlds(check: Check, flown: Flown, scenario: Path, faults: tuple[Fault, ...], number: int) -> None:
    """Flies WORLDS simulated worlds of their own seeds. Their properties say that each complete recording has the
    certificate of the flight in one process, which is judged."""
    file, table = flown.folder / "faults.yaml", flown.folder / "worlds.csv"
    link, events = {"delay_ms": "0.1"}, list[str]()
    for fault in faults:
        if fault.word == "partition_s":
            events.append(f"{{ kind: partition, for_s: {fault.value}, at_s: 2 }}")
        elif fault.word == "kill":
            events += ["{ kind: kill, program: controller, restart_s: 1, step: 100 }"]
        elif fault.word == "stop_s":
            events.append(f"{{ kind: stop, program: controller, for_s: {fault.value}, step: 100 }}")
        else:
            link[fault.word] = str(fault.value)
    text = "link: { " + ", ".join(f"{key}: {value}" for key, value in link.items()) + " }\n"
    file.write_text(text + "".join(["faults:\n", *(f"  - {event}\n" for event in events)] if events else []))
    first = number * WORLDS
    words = [BUILD / "bin/sls_worlds", f"--scenario={scenario}", f"--faults={file}", f"--table={table}",
             f"--seeds={first}-{first + WORLDS - 1}", "--jobs=1"]
    programs = Programs(check, flown, (), None)
    programs.run({"worlds": words})
    log = (flown.folder / "worlds.log").read_text(encoding="utf-8", errors="replace").splitlines()
    found = [line for line in log if line.startswith("seed ")]
    rows = table.read_text().splitlines()[1:] if table.exists() else []
    unfinished = [row.split(",")[0] for row in rows if row.split(",")[4] != "1"]
    if found or len(rows) != WORLDS:
        at = log.index(found[0]) if found else -2
        flown.problem = f"worlds: {' '.join(log[at:at + 2]) if log else 'ended without a word'}"
        flown.is_unusable |= not found
    elif unfinished:
        flown.problem = f"worlds: expected finished flights, got none in the world of seed {unfinished[0]}"
