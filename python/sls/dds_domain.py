"""DDS domains for flights that no other program may disturb."""

import re
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from sls.errors import RunError


def take_name(lock: socket.socket, name: str) -> bool:
    try:
        lock.bind(f"\0{name}")
    except OSError:
        return False
    return True


@contextmanager
def own_domain(numbers: range = range(100, 161), use: str = "verify", patience_s: float = 0.0) -> Iterator[int]:
    """Context with a DDS domain among `numbers` that no other program with this `use` on this machine has, for which it
    waits. An abstract socket with the domain's number marks it as used; the socket disappears with its process.
    Afterwards it removes the domain's ports in shared memory, which killed processes leave behind. Their numbers end
    with those of UDP (common/bus/fastdds/host_id.hpp)."""
    deadline = time.monotonic() + patience_s
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as lock:
        while not (number := next((n for n in numbers if take_name(lock, f"sls-{use}-domain-{n}")), None)):
            if time.monotonic() >= deadline:
                raise RunError(f"expected a free DDS domain from {numbers[0]} to {numbers[-1]}, got none")
            time.sleep(0.1)
        try:
            yield number
        finally:
            # If /dev/shm is missing or read-only, the programs say so.
            for file in Path("/dev/shm").glob("*fast*_port*"):
                port = re.match(r"(?:sem\.)?fast(?:rtps|dds)_port(\d+)", file.name)
                if port and 0 <= (int(port[1]) & 0xFFFF) - 7400 - 250 * number < 250:
                    with suppress(OSError):
                        file.unlink()
