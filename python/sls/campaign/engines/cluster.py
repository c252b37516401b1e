"""What the engines for clusters have in common."""

import os
import time
from pathlib import Path

from sls.campaign.folder import CampaignFolder

FILES_LATE_S = 3.0  # a shared file system may show another machine's file late
EVERY_S = 0.5


def find_places() -> list[str]:
    """Folders that hold the package, the compiled module and what the user put on PYTHONPATH: with
    them another machine's Python finds the same modules."""
    import _sls_core
    import sls
    own = [Path(sls.__file__).parents[1], Path(_sls_core.__file__).parent]
    given = [Path(place) for place in os.environ.get("PYTHONPATH", "").split(os.pathsep) if place]
    return list(dict.fromkeys(str(place.resolve()) for place in [*own, *given]))


def find_missing(folder: CampaignFolder) -> list[int]:
    """Chunks that are missing for good, after the last worker has ended."""
    deadline = time.monotonic() + FILES_LATE_S
    while (missing := folder.missing()) and time.monotonic() < deadline:
        time.sleep(EVERY_S)
    return missing


def describe_rest(folder: CampaignFolder) -> str:
    """What there is when an engine gives up."""
    whole = len(folder.chunks) - len(folder.missing())
    return (f"{whole} of {len(folder.chunks)} chunks are in {folder.folder}; --resume flies the "
            "others")
