"""Files that are there whole or not at all."""

import os
import time
from pathlib import Path

from sls.campaign.engines import EngineError
from sls.campaign.machine import host_name

DAY_S = 86400.0


def name_temporary(file: Path) -> Path:
    """In the same folder, so that the rename stays in one file system; no other process of any
    machine has the same."""
    return file.with_name(f".{file.name}.{host_name()}.{os.getpid()}.tmp")


def is_left_over(temporary: Path) -> bool:
    """Whether its process is gone, where it was one of this machine; else by age. Raises
    FileNotFoundError."""
    name, process = temporary.name.removesuffix(".tmp").rsplit(".", 1)
    if name.endswith(f".{host_name()}") and process.isdecimal():
        return not Path(f"/proc/{process}").exists()
    return time.time() - temporary.stat().st_mtime > DAY_S


def sync_folder(folder: Path) -> None:
    """Makes a rename in `folder` last through a power cut."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


class WholeFile:
    """Writes `file` piece by piece under a temporary name; `finish` renames it. Without `finish`
    nothing is left. Raises EngineError, which names the file, where the disk is full."""

    def __init__(self, file: Path):
        self.file = file
        self.temporary = name_temporary(file)

    def __enter__(self) -> "WholeFile":
        try:
            self.stream = open(self.temporary, "wb")
        except OSError as error:
            raise self._explain(error) from None
        return self

    def write(self, data: bytes) -> None:
        try:
            self.stream.write(data)
        except OSError as error:
            raise self._explain(error) from None

    def sync(self) -> None:
        """The data are on the disk, still under the temporary name."""
        try:
            self.stream.flush()
            os.fsync(self.stream.fileno())
        except OSError as error:
            raise self._explain(error) from None

    def finish(self) -> None:
        """Replaces what is there under the file's name."""
        self.sync()
        try:
            os.replace(self.temporary, self.file)
            sync_folder(self.file.parent)
        except OSError as error:
            raise self._explain(error) from None

    def finish_new(self) -> bool:
        """False, and nothing changed, where there is such a file."""
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
        try:
            sync_folder(self.file.parent)
        except OSError as error:
            raise self._explain(error) from None
        return True

    def _explain(self, error: OSError) -> EngineError:
        return EngineError(f"{self.file}: expected to write it, got: {error.strerror}")

    def __exit__(self, *_: object) -> None:
        try:
            self.stream.close()
        except OSError:  # the rest of the buffer does not fit, either; said already
            pass
        self.temporary.unlink(missing_ok=True)


def write_whole(file: Path, data: bytes) -> None:
    with WholeFile(file) as writing:
        writing.write(data)
        writing.finish()
