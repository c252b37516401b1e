"""DDS domains for flights that no other program may disturb."""

import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from sls.errors import RunError

DOMAINS = range(100, 161)


@contextmanager
def own_domain() -> Iterator[int]:
    """Context with a DDS domain that no other campaign or check on this machine uses. An abstract socket with the
    domain's number marks it as used; the socket disappears with its process. Afterwards the domain's ports in shared
    memory are removed, which processes that were killed leave behind."""
    for number in DOMAINS:
        lock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            lock.bind(f"\0sls-verify-domain-{number}")
        except OSError:
            lock.close()
            continue
        try:
            yield number
        finally:
            for port in range(7400 + 250 * number, 7400 + 250 * (number + 1)):
                for name in (f"fastrtps_port{port}", f"fastdds_port{port}"):  # of Fast DDS 2 and 3
                    for file in (name, f"{name}_el", f"{name}_sl", f"sem.{name}_mutex"):
                        with suppress(OSError):  # none there, or read-only: the programs say what they need
                            Path("/dev/shm", file).unlink()
            lock.close()
        return
    raise RunError(f"expected a free DDS domain from {DOMAINS[0]} to {DOMAINS[-1]}, got none")
