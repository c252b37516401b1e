"""Starts the processes of a test, ends them by their ids, and waits for conditions with a deadline."""

import os
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

EVERY_S = 0.05


def wait_until(condition: Callable[[], object], limit_s: float, what: str) -> None:
    """Waits for a condition. Raises AssertionError, which names `what`, after `limit_s`."""
    deadline = time.monotonic() + limit_s
    while not condition():
        if time.monotonic() > deadline:
            raise AssertionError(f"expected within {limit_s} s: {what}")
        time.sleep(EVERY_S)


def kill(process: int) -> None:
    try:
        os.kill(process, signal.SIGKILL)
    except ProcessLookupError:
        pass


class Processes:
    """Processes that are ended in the reverse order of their start."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.started: dict[str, subprocess.Popen] = {}

    def start(self, name: str, command: list[str], **environment: str) -> subprocess.Popen:
        """Starts a process. Its output goes to the file NAME.txt in the folder."""
        with open(self.folder / f"{name}.txt", "ab") as output:
            self.started[name] = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=output, stderr=output,
                env={**os.environ, **environment}, start_new_session=True)
        return self.started[name]

    def output(self, name: str) -> str:
        file = self.folder / f"{name}.txt"
        return file.read_text(errors="replace") if file.exists() else ""

    def end(self, name: str, limit_s: float = 5.0) -> None:
        process = self.started.pop(name)
        process.terminate()
        try:
            process.wait(limit_s)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def kill(self, name: str) -> None:
        process = self.started.pop(name)
        process.kill()
        process.wait()

    def end_all(self) -> None:
        for name in reversed(list(self.started)):
            self.end(name)
