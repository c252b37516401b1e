"""Flies a campaign in processes of this machine.

Each process is `sls.campaign.worker --serve`: it reads the number of a chunk from a pipe and answers
when the chunk is in the folder. The pipe of a killed process closes; another process then flies its
chunk. If this process is killed, the kernel ends its worker processes."""

import json
import os
import selectors
import signal
import subprocess
import sys
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from sls.campaign.engines import EngineError, EngineOptions
from sls.campaign.folder import CampaignFolder
from sls.campaign.progress import Progress
from sls.input_error import InputError

CHUNK_S = 0.5       # work in a chunk, s: a killed process loses little, and the time between chunks is small
MOST_TRIES = 3      # tries of a chunk whose process ends without an answer
END_WITHIN_S = 5.0  # time limit between SIGTERM and SIGKILL for a worker process


@dataclass
class Worker:
    """One process, with the chunk and the run that it flies."""

    process: subprocess.Popen[bytes]
    chunk: int | None = None
    run: int | None = None  # the last run that it announced
    is_ready: bool = False
    unread: bytes = b""

    def give(self, chunk: int, announce: bool) -> None:
        self.chunk, self.run = chunk, None
        assert self.process.stdin
        with suppress(BrokenPipeError):  # the process has ended: `run` finds this by the end of its stdout
            self.process.stdin.write(b"%d%s\n" % (chunk, b" announce" if announce else b""))
            self.process.stdin.flush()

    def describe_end(self) -> str:
        code = self.process.wait()
        if code < 0:
            return f"was ended by {signal.Signals(-code).name}"
        return f"ended with exit code {code}"


@dataclass
class Work:
    """The chunks that are not flown yet, or were given up."""

    waiting: deque[int]
    tries: dict[int, int] = field(default_factory=dict)
    failed_starts: int = 0  # without a successful start between them
    given_up: list[str] = field(default_factory=list)


def start_worker(folder: CampaignFolder) -> Worker:
    # The worker gets its own session: Ctrl-C reaches only this process, which ends its workers.
    command = ["setpriv", "--pdeathsig", "TERM", "--", sys.executable, "-BP", "-m",
               "sls.campaign.worker", str(folder.folder.resolve()), "--serve"]
    one_thread = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                               start_new_session=True,
                               env={**os.environ, **one_thread, "PYTHONPATH": find_path()})
    return Worker(process)


def find_path() -> str:
    """PYTHONPATH with which another process finds the same modules."""
    return os.pathsep.join(str(Path(place).resolve()) for place in sys.path if place)


@contextmanager
def started(workers: list[Worker], folder: CampaignFolder) -> Iterator[None]:
    """When the context ends, ends every process of `workers` and removes the chunks that they did not finish."""
    try:
        yield
    finally:
        for worker in workers:
            worker.process.terminate()
        for worker in workers:
            try:
                worker.process.wait(END_WITHIN_S)
            except subprocess.TimeoutExpired:
                worker.process.kill()
                worker.process.wait()
            close(worker)
        folder.remove_leftovers()


def run(folder: CampaignFolder, options: EngineOptions) -> None:
    """Flies the missing chunks. Raises InputError if a run or the campaign is refused, EngineError if a
    chunk cannot be written or ended its process MOST_TRIES times."""
    work = Work(deque(folder.missing()))
    workers = list[Worker]()
    with started(workers, folder), selectors.DefaultSelector() as selector, \
            Progress(folder, len(work.waiting), options.progress) as progress:
        def add_worker() -> None:
            worker = start_worker(folder)
            workers.append(worker)
            selector.register(worker.process.stdout, selectors.EVENT_READ, worker)

        for _ in range(min(options.workers or len(os.sched_getaffinity(0)), len(work.waiting))):
            add_worker()
        while workers:
            for key, _ in selector.select(progress.until_next_s()):
                worker = key.data
                data = os.read(key.fd, 65536)
                if data:
                    for line in take_lines(worker, data):
                        hear(worker, json.loads(line), work, progress)
                    continue
                selector.unregister(key.fileobj)
                workers.remove(worker)
                close(worker)
                if note_end(worker, work, folder):
                    add_worker()
            progress.draw()
            # A process ends when its stdin is closed: at the end of the campaign, when no chunk is waiting or flying.
            for worker in workers:
                if worker.is_ready and worker.chunk is None and not worker.process.stdin.closed:
                    if work.waiting:
                        chunk = work.waiting.popleft()
                        worker.give(chunk, announce=chunk in work.tries)
                    elif not any(other.chunk is not None for other in workers):
                        worker.process.stdin.close()
    if work.given_up:
        raise EngineError("; ".join(work.given_up))


def take_lines(worker: Worker, data: bytes) -> list[bytes]:
    *lines, worker.unread = (worker.unread + data).split(b"\n")
    return lines


def hear(worker: Worker, message: dict, work: Work, progress: Progress) -> None:
    if "error" in message:
        raise (InputError if message["code"] == 2 else EngineError)(message["error"])
    if "ready" in message:
        worker.is_ready = True
        work.failed_starts = 0
    elif "run" in message:
        worker.run = message["run"]
    else:
        progress.add(message["chunk"])
        work.tries.pop(message["chunk"], None)
        worker.chunk = worker.run = None


def close(worker: Worker) -> None:
    worker.process.stdout.close()
    with suppress(BrokenPipeError):
        worker.process.stdin.close()


def note_end(worker: Worker, work: Work, folder: CampaignFolder) -> bool:
    """Handles the end of a worker process; True if a new process must replace it. Its chunk waits again.
    After MOST_TRIES it is given up, and the campaign fails when all others are flown."""
    end = worker.describe_end()
    chunk = worker.chunk
    if not worker.is_ready:
        work.failed_starts += 1
        if work.failed_starts >= MOST_TRIES:
            raise EngineError(f"local: a worker process {end} before its first run; tried "
                              f"{MOST_TRIES} times")
    if chunk is None:
        return bool(work.waiting)
    work.tries[chunk] = work.tries.get(chunk, 0) + 1
    if work.tries[chunk] < MOST_TRIES:
        work.waiting.append(chunk)
    else:
        first, last = folder.find_chunk(chunk)
        where = f"in run {worker.run}" if worker.run is not None else f"in runs {first}-{last}"
        work.given_up.append(f"{folder.chunk_file(chunk)}: a worker process {end} {where}; tried "
                             f"{MOST_TRIES} times, the other chunks are flown")
    return bool(work.waiting)
