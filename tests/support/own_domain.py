"""A DDS domain for one test; own_domain.hpp is the same in C++."""

import pathlib
import re
import socket
import time

DOMAINS = range(1, 61)
LONGEST_WAIT_S = 240.0


class OwnDomain:
    """A DDS domain that no other test uses meanwhile. Its lock is a name in the abstract socket namespace, which the
    kernel releases with the process."""

    def __enter__(self):
        deadline = time.monotonic() + LONGEST_WAIT_S
        while time.monotonic() < deadline:
            for self.number in DOMAINS:
                self.lock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
                try:
                    self.lock.bind(f"\0sls-test-domain-{self.number}")
                    return str(self.number)
                except OSError:
                    self.lock.close()
            time.sleep(0.1)
        raise RuntimeError(f"no free DDS domain among {DOMAINS[0]} to {DOMAINS[-1]}")

    def __exit__(self, *_):
        # The shared-memory ports of a domain outlive processes that were killed.
        for file in pathlib.Path("/dev/shm").iterdir():
            port = re.match(r"(?:sem\.)?fast(?:rtps|dds)_port(\d+)", file.name)
            if port and 0 <= (int(port[1]) & 0xFFFF) - 7400 - 250 * self.number < 250:
                file.unlink(missing_ok=True)
        self.lock.close()
