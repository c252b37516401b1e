"""Engines fly the missing chunks of a campaign's folder. Each is a module of this folder with

    def run(folder: CampaignFolder, options: EngineOptions) -> None

that returns when every chunk is there, raises EngineError if that cannot be reached, and leaves
a resumable folder when it is interrupted. It may have `CHUNK_S`, the seconds of work that a chunk
should hold, and `describe_status(folder) -> list[str]`, lines for `./sls campaign status`."""

from dataclasses import dataclass
from importlib import import_module
from types import ModuleType

from sls.errors import RunError
from sls.input_error import InputError

ENGINES = ("local", "slurm", "dask")


class EngineError(RunError):
    """Why the campaign cannot finish, in one line. Flown runs stay; `--resume` continues."""


@dataclass(frozen=True)
class EngineOptions:
    workers: int | None = None     # None: as many as there are cores
    sbatch: str = ""               # options of the site, for Slurm
    scheduler: str = ""            # address, for Dask
    chunk_runs: int | None = None  # None: by the time that a run takes
    progress: bool = False         # draw a bar on stderr


def load_engine(name: str) -> ModuleType:
    """Raises InputError for a name that is none."""
    if name not in ENGINES:
        raise InputError(f"--on: expected one of {', '.join(ENGINES)}, got '{name}'")
    return import_module(f"sls.campaign.engines.{name}")
