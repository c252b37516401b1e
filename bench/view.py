"""The cost of sls_view during a flight."""

import base64
import contextlib
import os
import re
import signal
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from bench.loop import PERIOD_S, lasting
from bench.programs import Flight, MeasurementError, Programs, end_all
from bench.results import LESS, Figure, Rounds

VIEWERS = 3  # one of them is stopped after its first pose
LONGEST_WAIT_S = 30.0
BINARY = 2  # opcode of poses and rows; text is greeting and status


def read_frame(stream: BinaryIO) -> int:
    """Reads one frame of a server (RFC 6455, section 5.2). @return its opcode."""
    header = read_exactly(stream, 2)
    size = header[1]
    if size >= 126:
        size = int.from_bytes(read_exactly(stream, 2 if size == 126 else 8), "big")
    read_exactly(stream, size)
    return header[0] & 0x0F


def read_exactly(stream: BinaryIO, size: int) -> bytes:
    data = stream.read(size)
    if len(data) < size:
        raise EOFError
    return data


class Page:
    """The browser's end of a viewer. It imitates a browser on another machine: it empties the socket
    from time to time and decodes nothing after the first pose, so it costs nearly no time here."""

    def __init__(self, port: int):
        self.is_flight_shown = False
        self.socket = socket.create_connection(("127.0.0.1", port))
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall((f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: Upgrade\r\n"
                             f"Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n"
                             "Sec-WebSocket-Protocol: sls.view.1\r\n\r\n").encode())
        threading.Thread(target=self.receive, daemon=True).start()

    def receive(self) -> None:
        with contextlib.suppress(OSError, EOFError):
            stream = self.socket.makefile("rb")
            while stream.readline().strip():  # the answer to the upgrade
                pass
            while not self.is_flight_shown:
                self.is_flight_shown = read_frame(stream) == BINARY
            while self.socket.recv(1 << 20):
                time.sleep(0.05)

    def close(self) -> None:
        with contextlib.suppress(OSError):
            self.socket.shutdown(socket.SHUT_RDWR)
        self.socket.close()


class Viewer:
    def __init__(self, programs: Programs):
        self.log = programs.make_path("-view.log")
        self.process = programs.start(
            [str(programs.build / "bin/sls_view"), "--domain", str(programs.domain), "--qos",
             str(programs.qos("default")), "--port", "0"], self.log)
        self.page: Page | None = None

    def open_page(self) -> None:
        deadline = time.monotonic() + LONGEST_WAIT_S
        while not (found := re.search(r"page: http://.*:(\d+)/", self.log.read_text())):
            if time.monotonic() > deadline or self.process.poll() is not None:
                raise MeasurementError(f"sls_view: expected its address, got: {self.log.read_text()}")
            time.sleep(0.02)
        self.page = Page(int(found[1]))

    def wait_for_flight(self) -> None:
        """Waits until the page has received a pose."""
        deadline = time.monotonic() + LONGEST_WAIT_S
        while self.page and not self.page.is_flight_shown:
            if time.monotonic() > deadline:
                raise MeasurementError("sls_view: expected a flight on its page, got none")
            time.sleep(0.02)


@contextlib.contextmanager
def look_on(programs: Programs, count: int) -> Iterator[list[Viewer]]:
    viewers: list[Viewer] = []
    try:
        for _ in range(count):
            viewers.append(Viewer(programs))
        for viewer in viewers:
            viewer.open_page()
        yield viewers
    finally:
        for viewer in viewers:
            if viewer.page:
                viewer.page.close()
            with contextlib.suppress(ProcessLookupError):
                viewer.process.send_signal(signal.SIGCONT)
        end_all([viewer.process for viewer in viewers])


def read_processor_s(viewer: Viewer) -> float:
    """User and system time so far."""
    fields = Path(f"/proc/{viewer.process.pid}/stat").read_text().rpartition(") ")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def fly(programs: Programs, scenario: Path, viewers: list[Viewer]) -> Flight:
    def stop_first() -> None:
        if viewers:
            viewers[0].wait_for_flight()
            viewers[0].process.send_signal(signal.SIGSTOP)

    flight = programs.fly(scenario, server=("--period-s", PERIOD_S), during=stop_first)
    if flight.lost or not flight.manifest["complete"]:
        raise MeasurementError("the recording beside viewers is not complete")
    return flight


def measure_view(programs: Programs, rounds: int, is_quick: bool) -> list[Figure]:
    """Flights in lockstep, alternately with and without viewers."""
    figures = Rounds("view")
    scenario = programs.scenario("figure_eight", lasting(4 if is_quick else 240))
    for index in range(rounds):
        flights: dict[int, Flight] = {}
        for count in (0, VIEWERS) if index % 2 == 0 else (VIEWERS, 0):
            with look_on(programs, count) as viewers:
                flights[count] = fly(programs, scenario, viewers)
                processor_s = read_processor_s(viewers[-1]) if viewers else 0.0
            if viewers:
                figures.add("processor time of a viewer with a page", "µs/step",
                            processor_s * 1e6 / flights[count].steps, better=LESS)
        alone, seen = flights[0], flights[VIEWERS]
        if alone.manifest["certificate"] != seen.manifest["certificate"]:
            raise MeasurementError("expected the same certificate with viewers as without")
        figures.add("lockstep with three viewers, one stopped; same certificate, 0 rows lost", "steps/s",
                    seen.steps_per_s, "the same without viewers", alone.steps_per_s, goal=0.95,
                    is_goal_of_ratio=True)
    return figures.make_figures()
