"""Writes files atomically: a file is complete, or it does not exist."""

import hashlib
import os
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from sls.campaign.engines import EngineError
from sls.campaign.machine import host_name

DAY_S = 86400.0


def name_temporary(file: Path) -> Path:
    """The temporary name of a file. It is in the same folder, because a rename must stay in one file
    system. No other process in any container on any machine uses this name."""
    return file.with_name(f".{file.name}.{name_place()}.{os.getpid()}.tmp")


@cache
def name_place() -> str:
    """The host's name, and a hash of where process numbers are unique: in one PID namespace of one boot.
    Containers may have the same host name and the same process numbers."""
    try:
        place = Path("/proc/sys/kernel/random/boot_id").read_text() + os.readlink("/proc/self/ns/pid")
    except OSError:  # without /proc
        place = uuid.uuid4().hex
    return f"{host_name()}.{hashlib.sha256(place.encode()).hexdigest()[:8]}"


def is_left_over(temporary: Path) -> bool:
    """True if the process of this place that wrote the file has ended. A file of another place is left
    over if it is older than a day. Raises FileNotFoundError."""
    name, process = temporary.name.removesuffix(".tmp").rsplit(".", 1)
    if name.endswith(f".{name_place()}") and process.isdecimal():
        return not Path(f"/proc/{process}").exists()
    return time.time() - temporary.stat().st_mtime > DAY_S


def sync_folder(folder: Path) -> None:
    """Syncs `folder`: a rename in it then survives a power failure."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextmanager
def explained(file: Path) -> Iterator[None]:
    """Raises EngineError, which names `file`, in place of an OSError."""
    try:
        yield
    except OSError as error:
        raise EngineError(f"{file}: expected to write it, got: {error.strerror}") from None


class WholeFile:
    """Writes `file` piece by piece under a temporary name; `finish` renames it. Without `finish` the
    temporary file is removed. Raises EngineError, which names the file, if it cannot be written."""

    def __init__(self, file: Path):
        self.file = file
        self.temporary = name_temporary(file)

    def __enter__(self) -> "WholeFile":
        with explained(self.file):
            self.stream = open(self.temporary, "wb")
        return self

    def write(self, data: bytes) -> None:
        with explained(self.file):
            self.stream.write(data)

    def sync(self) -> None:
        """Writes the data to the disk, still under the temporary name."""
        with explained(self.file):
            self.stream.flush()
            os.fsync(self.stream.fileno())

    def finish(self) -> None:
        """Gives the file its name. Replaces a file with this name."""
        self.sync()
        with explained(self.file):
            os.replace(self.temporary, self.file)
            sync_folder(self.file.parent)

    def finish_new(self) -> bool:
        """As `finish`, but returns False and changes nothing if a file with this name exists."""
        self.sync()
        try:
            os.link(self.temporary, self.file)
        except FileExistsError:
            return False
        except OSError:  # a file system without hard links
            if self.file.exists():
                return False
            self.finish()
            return True
        with explained(self.file):
            sync_folder(self.file.parent)
        return True

    def __exit__(self, *_: object) -> None:
        with suppress(OSError):  # the disk is full: `write` or `sync` has already raised the error
            self.stream.close()
        self.temporary.unlink(missing_ok=True)


def write_whole(file: Path, data: bytes) -> None:
    with WholeFile(file) as writing:
        writing.write(data)
        writing.finish()
