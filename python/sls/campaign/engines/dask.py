"""Flies a campaign on the workers of a Dask scheduler. See README.md beside this file."""

import logging
import queue
import re
import sys
import time
import uuid
from contextlib import suppress
from typing import Any

from sls.campaign.engines import EngineError, EngineOptions
from sls.campaign.engines.cluster import describe_rest, find_missing, find_places
from sls.campaign.folder import CampaignFolder
from sls.campaign.progress import Progress
from sls.input_error import InputError
from sls.launcher.place import say

CHUNK_S = 5.0            # work in a chunk, s
MOST_TRIES = 3           # tries of a chunk after errors that may be temporary
CONNECT_S = 10.0
WITHOUT_WORKERS_S = 60.0
EVERY_S = 0.5
START = "start one with `dask-scheduler`, and on each machine `dask-worker ADDRESS --nthreads 1`"


def make_task() -> Any:
    """The function that flies a chunk on a worker. Newer versions of Dask send a function by its
    name, also to the scheduler, which need not have the package. A function within a function has no
    such name and is sent as code."""
    def fly(places: list[str], folder: str, number: int) -> dict[str, Any]:
        """Runs on a worker. The package may not be on the worker's path.
        Python searches `places` after the worker's own PYTHONPATH. An error that the user must repair
        returns as "error"; an exception means an error that may be temporary."""
        import platform
        import sys
        for place in places:
            if place not in sys.path:
                sys.path.append(place)
        try:
            from sls.campaign.worker import fly_chunk
            from sls.errors import ConfigError
        except ImportError as error:
            return {"error": f"machine {platform.node()}: {error}; its dask-worker needs this "
                             "Python, and PYTHONPATH with python/ and BUILD/python of this "
                             "version", "code": 1}
        try:
            return {**fly_chunk(folder, number), "host": platform.node()}
        except ConfigError as error:
            return {"error": str(error), "code": 2}

    return fly


def connect(address: str) -> Any:
    """Connects a client. Raises InputError if `address` is not valid, EngineError if Dask is not
    installed or no scheduler answers."""
    try:
        import cloudpickle
        from distributed import Client
    except ImportError as error:
        raise EngineError(f"dask: Python module '{error.name}' is missing: apt-get install "
                          "python3-distributed") from None
    if not re.fullmatch(r"(\w+://)?[^\s/]+:\d+", address):
        raise InputError("--scheduler: expected the address of a Dask scheduler, such as "
                         f"tcp://HOST:8786, got "
                         f"{repr(address) if address else 'none'}; {START}")
    cloudpickle.register_pickle_by_value(sys.modules[__name__])
    # Dask logs many lines about errors that this engine reports in one line.
    logging.disable(logging.CRITICAL)
    try:
        return Client(address, timeout=CONNECT_S, set_as_default=False, name="sls-campaign")
    except (OSError, ValueError) as error:
        text = " ".join(str(error).split())
        raise EngineError(f"dask: no scheduler at {address} ({text}); {START}") from None


def check(options: EngineOptions) -> None:
    """Raises InputError or EngineError if this process cannot submit tasks."""
    connect(options.scheduler).close()


class Flight:
    """The chunks that are submitted."""

    def __init__(self, client: Any, folder: CampaignFolder):
        self.client = client
        self.folder = folder
        self.place = str(folder.folder.resolve())
        self.places = find_places()
        # The keys must differ from those of other launchers: for equal keys the scheduler returns the same result.
        self.prefix = f"sls-{folder.plan.sha256[:16]}-{uuid.uuid4().hex[:8]}"
        self.ended: queue.Queue[tuple[int, Any]] = queue.Queue()
        self.futures = dict[int, Any]()
        self.tries = dict[int, int]()
        self.given_up = list[str]()

    def submit(self, number: int) -> None:
        tries = self.tries[number] = self.tries.get(number, 0) + 1
        future = self.client.submit(make_task(), self.places, self.place, number, pure=False,
                                    key=f"{self.prefix}-{number:06d}-{tries}")
        self.futures[number] = future
        future.add_done_callback(lambda done: self.ended.put((number, done)))

    def hear(self, number: int, future: Any) -> bool:
        """Handles a task that has ended; True if its chunk is flown. A chunk that failed is submitted
        again. After MOST_TRIES it is given up, and the campaign fails when all others are flown.
        Raises InputError, EngineError."""
        if future is not self.futures.get(number):
            return False
        del self.futures[number]
        if future.status == "finished":
            answer = future.result()
            if "error" not in answer:
                return True
            raise (InputError if answer["code"] == 2 else EngineError)(f"dask: {answer['error']}")
        if future.status == "cancelled":
            raise SchedulerLost
        error = future.exception()
        if self.tries[number] < MOST_TRIES and type(error).__name__ != "KilledWorker":
            self.submit(number)
        else:
            first, last = self.folder.find_chunk(number)
            self.given_up.append(f"dask: runs {first}-{last}: {describe(error)}; the other chunks "
                                 "are flown")
        return False


class SchedulerLost(Exception):
    pass


def describe(error: BaseException) -> str:
    """The error in one line. Dask raises KilledWorker when several workers were killed with a chunk."""
    if type(error).__name__ == "KilledWorker":
        worker = getattr(getattr(error, "last_worker", None), "address", "unknown")
        return f"the workers that flew them were killed again and again, the last one at {worker}"
    return " ".join(f"{type(error).__name__}: {error}".split())


def wait(flight: Flight, progress: Progress) -> None:
    """Waits until every submitted chunk is flown or given up. Raises InputError, EngineError,
    SchedulerLost."""
    without_since = None
    while flight.futures:
        try:
            number, future = flight.ended.get(timeout=EVERY_S)
            if flight.hear(number, future):
                progress.add(number)
        except queue.Empty:
            if flight.client.status not in ("running", "connecting"):
                raise SchedulerLost from None
            without_since = watch_workers(flight.client, without_since)
        progress.draw()


def watch_workers(client: Any, without_since: float | None) -> float | None:
    """The time since which there is no worker; None if there are workers. Raises EngineError after
    WITHOUT_WORKERS_S without workers."""
    # The client holds the scheduler's last answer; it sends a request every 2 s.
    if client.scheduler_info().get("workers"):
        return None
    now = time.monotonic()
    if without_since is None:
        say("dask: waiting for workers: dask-worker ADDRESS --nthreads 1")
        return now
    if now - without_since > WITHOUT_WORKERS_S:
        raise EngineError(f"dask: no worker for {WITHOUT_WORKERS_S:.0f} s; what is flown stays, "
                          "--resume flies the others")
    return without_since


def run(folder: CampaignFolder, options: EngineOptions) -> None:
    """Flies the missing chunks. Ctrl-C withdraws the chunks that no worker has begun. Raises InputError,
    EngineError."""
    client = connect(options.scheduler)
    try:
        missing = folder.missing()
        flight = Flight(client, folder)
        with Progress(folder, len(missing), options.progress) as progress:
            for number in missing:
                flight.submit(number)
            wait(flight, progress)
    except SchedulerLost:
        raise EngineError(f"dask: the scheduler {options.scheduler} is lost; "
                          f"{describe_rest(folder)}") from None
    finally:
        with suppress(Exception):  # the scheduler is lost; else it drops the client's futures
            client.close(timeout=2)
    if flight.given_up:
        raise EngineError("; ".join(flight.given_up))
    if missing := find_missing(folder):
        raise EngineError(f"{folder.chunk_file(missing[0])}: flown by a worker, but not there: "
                          "expected a file system that the workers share")
