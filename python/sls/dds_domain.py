"""DDS domains for flights that no other program may disturb."""

import re
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from sls.errors import RunError

DOMAINS = range(100, 161)


@contextmanager
def own_domain() -> Iterator[int]:
    """Context with a DDS domain that no other campaign or check on this machine uses. An abstract socket with the
    domain's number marks it as used; the socket disappears with its process. Afterwards it removes the domain's ports
    in shared memory, which killed processes leave behind. Their numbers end with those of UDP
    (common/bus/fastdds/host_id.hpp)."""
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
            # If /dev/shm is missing or read-only, the programs say so.
            for file in Path("/dev/shm").glob("*fast*_port*"):
                port = re.match(r"(?:sem\.)?fast(?:rtps|dds)_port(\d+)", file.name)
                if port and 0 <= (int(port[1]) & 0xFFFF) - 7400 - 250 * number < 250:
                    with suppress(OSError):
                        file.unlink()
            lock.close()
        return
    raise RunError(f"expected a free DDS domain from {DOMAINS[0]} to {DOMAINS[-1]}, got none")
