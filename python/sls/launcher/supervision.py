"""Runs the programs of a flight: passes signals on, ends all when one fails, and never waits forever.

Signals are blocked and taken one by one, so none is lost between two steps of the launcher."""

import math
import signal
import subprocess
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from sls.launcher.place import say

STOP = {signal.SIGINT: (130, signal.SIGINT), signal.SIGTERM: (143, signal.SIGTERM),
        signal.SIGHUP: (143, signal.SIGTERM)}
# Programs give up 20 s after a stop signal. One that writes its files may need much longer.
USUAL_PATIENCE_S, WRITERS_PATIENCE_S = 30.0, 600.0
# Programs of a flight end together, except those that write files.
OVERRUN_S = 60.0
CAUSES = {signal.SIGBUS: ": is /dev/shm full? (./sls doctor, docs/networks.md)",
          signal.SIGABRT: ": an assertion of a library, mostly of Fast DDS: see the lines above",
          signal.SIGKILL: ": killed, perhaps because memory ran out"}


class Program:  # no dataclass: its module takes longer to load than all of ours
    def __init__(self, name: str, process: "subprocess.Popen[bytes]", patience_s: float) -> None:
        self.name = name
        self.process = process
        self.patience_s = patience_s  # from the stop signal to SIGKILL
        self.deadline = math.inf
        self.is_asked = False  # to end, before the others


class Supervisor:
    """Use it in a `with` statement. Afterwards no program that it started runs."""

    def __init__(self, say: Callable[[str], None] = say, overrun_s: float = OVERRUN_S) -> None:
        self._say = say
        self._overrun_s = overrun_s
        self._running: list[Program] = []
        self._beside: Program | None = None
        self._first = ""  # of the programs that ended well
        self._result = self._interrupted = 0
        self._is_stopped = False
        self.codes: dict[str, int] = {}  # of the programs that have ended, in this order
        self.expendable: set[str] = set()  # programs whose end changes nothing

    def __enter__(self) -> "Supervisor":
        self._mask = signal.pthread_sigmask(signal.SIG_BLOCK, {*STOP, signal.SIGCHLD})
        return self

    def __exit__(self, *_: object) -> None:
        self._stop(signal.SIGTERM)
        self.wait_all()
        if self._beside:
            self._beside.process.terminate()
            try:
                self._beside.process.wait(USUAL_PATIENCE_S)
            except subprocess.TimeoutExpired:
                self._beside.process.kill()
                self._beside.process.wait()
        signal.pthread_sigmask(signal.SIG_SETMASK, self._mask)

    def start(self, name: str, command: Sequence[str | Path], patience_s: float = USUAL_PATIENCE_S,
              **more: Any) -> int:
        """Returns the process id. `more`: arguments of subprocess.Popen."""
        self._running.append(self._spawn(name, command, patience_s, **more))
        return self._running[-1].process.pid

    def start_beside(self, name: str, command: Sequence[str | Path]) -> None:
        """Starts a program that is no part of the flight: its end and its exit code change nothing."""
        self._beside = self._spawn(name, command, USUAL_PATIENCE_S)

    def wait_all(self, watch: Callable[[], None] | None = None) -> int:
        """Waits for all programs; returns the exit code of the run. Meanwhile calls `watch` 50 times a second.

        When one fails, the others cannot finish the run: they get SIGTERM, close their files and end."""
        while self._running:
            left_s = min(program.deadline for program in self._running) - time.monotonic()
            most_s = 0.02 if watch else 3600.0
            received = signal.sigtimedwait({*STOP, signal.SIGCHLD}, min(max(left_s, 0.0), most_s))
            if received is not None and received.si_signo in STOP:
                self._interrupted, passed_on = STOP[signal.Signals(received.si_signo)]
                self._stop(passed_on)
            self._reap()
            self._end_late()
            if watch:
                watch()
        return self._interrupted or self._result

    def send(self, name: str, number: signal.Signals, patience_s: float = math.inf) -> None:
        """Sends a signal to a program if it runs. With `patience_s` it is killed if it still runs so much later."""
        for program in self._running:
            if program.name == name:
                program.process.send_signal(number)
                if math.isfinite(patience_s):
                    program.deadline, program.is_asked = time.monotonic() + patience_s, True

    def end_all(self) -> None:
        """Ends the run: it has failed."""
        self._result = self._result or 1
        if not self._is_stopped:
            self._stop(signal.SIGTERM)

    def is_running(self, name: str) -> bool:
        return any(program.name == name for program in self._running)

    def _spawn(self, name: str, command: Sequence[str | Path], patience_s: float, **more: Any) -> Program:
        # If the launcher is killed, the kernel ends the program.
        return Program(name, subprocess.Popen(
            ["setpriv", "--pdeathsig", "TERM", "--", *command],
            preexec_fn=lambda: signal.pthread_sigmask(signal.SIG_SETMASK, self._mask), **more), patience_s)

    def _reap(self) -> None:
        ended = [program for program in self._running if program.process.poll() is not None]
        self._running = [program for program in self._running if program not in ended]
        for program in ended:
            self._judge(program.name, program.process.returncode)
        if self._beside and not self._is_stopped and self._beside.process.poll() is not None:
            self._say(f"{self._beside.name} ended with {self._beside.process.returncode}: the flight goes on")
            self._beside = None

    def _judge(self, name: str, code: int) -> None:
        self.codes[name] = code
        if name in self.expendable:
            return
        if code == 0 and not self._first:
            self._first = name
            for program in self._running:
                if program.patience_s < WRITERS_PATIENCE_S and not self._is_stopped:
                    program.deadline = time.monotonic() + self._overrun_s
        if code == 0 or self._result != 0:
            return
        self._result = 2 if code == 2 else 1
        if not self._is_stopped and (self._running or code < 0):
            number = signal.Signals(-code) if code < 0 else None
            cause = f" ({number.name}{CAUSES.get(number, '')})" if number else ""
            self._say(f"{name} ended with {code if code > 0 else 128 - code}{cause}"
                      + (": ending the others" if self._running else ""))
        self._stop(signal.SIGTERM)

    def _stop(self, number: int) -> None:
        for program in self._running:
            program.process.send_signal(number)
            if not self._is_stopped:
                program.deadline = time.monotonic() + program.patience_s
        self._is_stopped = True

    def _end_late(self) -> None:
        late = [program for program in self._running if program.deadline <= time.monotonic()]
        if late and not self._is_stopped and not all(program.is_asked for program in late):
            self._say(f"{self._first} ended, but {', '.join(program.name for program in late)} did not within "
                      f"{self._overrun_s:g} s: ending the others")
            self._result = 1
            self._stop(signal.SIGTERM)
            return
        for program in late:
            self._say(f"{program.name} did not end {program.patience_s:g} s after the stop signal: killed")
            program.process.kill()
            program.deadline = math.inf
