"""Engines fly the missing chunks of a campaign's folder. Each is a module of this folder with

    def run(folder: CampaignFolder, options: EngineOptions) -> None

that returns when every chunk is in the folder, raises EngineError if a chunk cannot be flown, and
leaves a folder that can be resumed when it is interrupted. It may have `CHUNK_S`, the seconds of
work in a chunk, and `describe_status(folder) -> list[str]`, lines for `./sls campaign status`."""

from dataclasses import dataclass
from importlib import import_module
from types import ModuleType

from sls.errors import RunError
from sls.input_error import InputError

ENGINES = ("local", "slurm", "dask")


class EngineError(RunError):
    """The reason why the campaign cannot finish, in one line. Flown runs are kept for `--resume`."""


@dataclass(frozen=True)
class EngineOptions:
    workers: int | None = None     # None: one for each core
    sbatch: str = ""               # options of the site, for Slurm
    scheduler: str = ""            # address, for Dask
    chunk_runs: int | None = None  # None: chosen by the measured time of a run
    progress: bool = False         # draw a bar on stderr


def load_engine(name: str) -> ModuleType:
    """The module of an engine. Raises InputError if there is no engine `name`."""
    if name not in ENGINES:
        raise InputError(f"--on: expected one of {', '.join(ENGINES)}, got '{name}'")
    return import_module(f"sls.campaign.engines.{name}")
