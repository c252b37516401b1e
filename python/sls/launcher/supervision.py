"""Runs the programs of a flight: passes signals on, ends all when one fails, and never waits for ever.

Signals are blocked and taken one by one, so none is lost between two steps of the launcher."""

import os
import signal
import subprocess
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from sls.launcher.place import Failure, say

STOP = {signal.SIGINT: (130, signal.SIGINT), signal.SIGTERM: (143, signal.SIGTERM),
        signal.SIGHUP: (143, signal.SIGTERM)}
# Programs give up 20 s after a stop signal. One that writes its files may need much longer.
USUAL_PATIENCE_S, WRITERS_PATIENCE_S = 30.0, 600.0
# Programs of a flight end together, except those that write files.
OVERRUN_S = 60.0
CAUSES = {signal.SIGBUS: ": is /dev/shm full? (./sls doctor, docs/networks.md)",
          signal.SIGKILL: ": killed, perhaps because memory ran out"}


@dataclass
class Program:
    name: str
    process: "subprocess.Popen[bytes]"
    patience_s: float  # from the stop signal to SIGKILL
    is_killed: bool = False


class Supervisor:
    """Use it in a `with` statement. Afterwards no program that it started runs."""

    def __init__(self, say: Callable[[str], None] = say, overrun_s: float = OVERRUN_S) -> None:
        self._say = say
        self._overrun_s = overrun_s
        self._first_end: tuple[float, str] | None = None  # of a program that ended well
        self._running: list[Program] = []
        self._beside: Program | None = None
        self._interrupted = 0
        self._stopped_at: float | None = None

    def __enter__(self) -> "Supervisor":
        self._mask = signal.pthread_sigmask(signal.SIG_BLOCK, {*STOP, signal.SIGCHLD})
        return self

    def __exit__(self, *_: object) -> None:
        self._stop(signal.SIGTERM)
        self.wait_all()
        self.end_beside()
        signal.pthread_sigmask(signal.SIG_SETMASK, self._mask)

    def start(self, name: str, command: Sequence[str | Path],
              patience_s: float = USUAL_PATIENCE_S) -> None:
        self._running.append(Program(name, self._spawn(command), patience_s))

    def start_beside(self, name: str, command: Sequence[str | Path]) -> None:
        """Starts a program that is no part of the flight: its end and its exit code change nothing."""
        self._beside = Program(name, self._spawn(command), USUAL_PATIENCE_S)

    def end_beside(self) -> None:
        if self._beside:
            self._beside.process.terminate()
            try:
                self._beside.process.wait(USUAL_PATIENCE_S)
            except subprocess.TimeoutExpired:
                self._beside.process.kill()
                self._beside.process.wait()
            self._beside = None

    def wait_all(self) -> int:
        """Waits for all programs; returns the exit code of the run.

        When one fails, the others cannot finish the run: they get SIGTERM, close their files and end."""
        result = 0
        while self._running:
            received = signal.sigtimedwait({*STOP, signal.SIGCHLD}, self._calc_seconds_left())
            if received is not None and received.si_signo in STOP:
                code, passed_on = STOP[signal.Signals(received.si_signo)]
                self._interrupted = code
                self._stop(passed_on)
            result = self._end_late(self._reap(result))
        return self._interrupted or result

    def _spawn(self, command: Sequence[str | Path]) -> "subprocess.Popen[bytes]":
        # If the launcher is killed, the kernel ends the program.
        return subprocess.Popen(["setpriv", "--pdeathsig", "TERM", "--", *command],
                                preexec_fn=lambda: signal.pthread_sigmask(signal.SIG_SETMASK, self._mask))

    def _reap(self, result: int) -> int:
        ended = [program for program in self._running if program.process.poll() is not None]
        self._running = [program for program in self._running if program not in ended]
        for program in ended:
            code = program.process.returncode
            code = code if code >= 0 else 128 - code
            if code == 0:
                self._first_end = self._first_end or (time.monotonic(), program.name)
            if code == 0 or result != 0:
                continue
            result = 2 if code == 2 else 1
            if self._stopped_at is None:
                others = ": ending the others" if self._running else ""
                if program.process.returncode < 0:
                    number = signal.Signals(-program.process.returncode)
                    self._say(f"{program.name} ended with {code} ({number.name}{CAUSES.get(number, '')}){others}")
                elif others:
                    self._say(f"{program.name} ended with {code}{others}")
            self._stop(signal.SIGTERM)
        if self._beside and self._stopped_at is None and self._beside.process.poll() is not None:
            self._say(f"{self._beside.name} ended with {self._beside.process.returncode}: the flight goes on")
            self._beside = None
        return result

    def _stop(self, number: int) -> None:
        for program in self._running:
            program.process.send_signal(number)
        if self._stopped_at is None:
            self._stopped_at = time.monotonic()

    def _list_deadlines(self) -> list[tuple[float, Program]]:
        """When which program is killed, or, before a stop signal, is asked to end."""
        if self._stopped_at is not None:
            return [(self._stopped_at + program.patience_s, program) for program in self._running
                    if not program.is_killed]
        if self._first_end is None:
            return []
        return [(self._first_end[0] + self._overrun_s, program) for program in self._running
                if program.patience_s < WRITERS_PATIENCE_S]

    def _calc_seconds_left(self) -> float:
        """Until the next deadline; sigtimedwait takes no infinity."""
        next_one = min((when for when, _ in self._list_deadlines()), default=time.monotonic() + 3600.0)
        return max(next_one - time.monotonic(), 0.0)

    def _end_late(self, result: int) -> int:
        late = [program for when, program in self._list_deadlines() if when <= time.monotonic()]
        if late and self._stopped_at is None and self._first_end is not None:
            self._say(f"{self._first_end[1]} ended, but {', '.join(program.name for program in late)} did not "
                      f"within {self._overrun_s:g} s: ending the others")
            self._stop(signal.SIGTERM)
            return result or 1
        for program in late:
            self._say(f"{program.name} did not end {program.patience_s:g} s after the stop signal: killed")
            program.process.kill()
            program.is_killed = True
        return result
