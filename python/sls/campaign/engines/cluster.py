"""Functions that the engines for clusters share."""

import os
import time
from contextlib import suppress
from pathlib import Path

from sls.campaign.folder import CampaignFolder
from sls.campaign.whole_files import name_temporary

# A shared file system may show another machine's file late: NFS keeps what it knows of a folder for up to
# 60 s (acdirmax).
FILES_LATE_S = 70.0
RETRY_AFTER_S = 3.0  # before chunks are submitted again, which costs little if they are there by then
EVERY_S = 0.5


def find_places() -> list[str]:
    """Folders of the package, of the compiled module and of the user's PYTHONPATH. With these folders
    Python finds the same modules on another machine."""
    import _sls_core
    import sls
    own = [Path(sls.__file__).parents[1], Path(_sls_core.__file__).parent]
    given = [Path(place) for place in os.environ.get("PYTHONPATH", "").split(os.pathsep) if place]
    return list(dict.fromkeys(str(place.resolve()) for place in [*own, *given]))


def find_missing(folder: CampaignFolder, is_last_try: bool = True) -> list[int]:
    """Chunks that are still missing FILES_LATE_S after the last worker has ended, or RETRY_AFTER_S if they
    will be tried again."""
    deadline = time.monotonic() + (FILES_LATE_S if is_last_try else RETRY_AFTER_S)
    while (missing := folder.missing()) and time.monotonic() < deadline:
        change_folder(folder)
        time.sleep(EVERY_S)
    return missing


def change_folder(folder: CampaignFolder) -> None:
    """Creates and removes a file: NFS then asks the server again for the files of this folder."""
    file = name_temporary(folder.chunk_file(0).with_name("change"))
    with suppress(OSError):
        file.touch()
        file.unlink()


def describe_rest(folder: CampaignFolder) -> str:
    """Describes the state of the folder, for the message of an engine that gives up."""
    whole = len(folder.chunks) - len(folder.missing())
    return (f"{whole} of {len(folder.chunks)} chunks are in {folder.folder}; --resume flies the "
            "others")
