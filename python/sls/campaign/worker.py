"""Flies chunks of a campaign's folder: `./sls campaign-worker DIR --chunks A-B`, which Slurm also
starts, the processes of the local engine, and `fly_chunk` for Dask."""

import argparse
import json
import os
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TextIO

from sls.campaign.arguments import Parser, parse_range
from sls.campaign.engines import EngineError
from sls.campaign.folder import CampaignFolder, DamagedChunk
from sls.campaign.kept import is_kept, keep_run
from sls.campaign.own_measures import load_own_measures
from sls.campaign.runs import Announce, RefusedRun, fly_range, make_runs
from sls.errors import ConfigError, RunError
from sls.input_error import InputError
from sls.launcher.place import escape_controls


MISTAKES = (ConfigError, RefusedRun, ImportError)  # the user must repair them
FAILURES = (EngineError, RunError, OSError)


def to_exit_code(error: Exception) -> int:
    return 2 if isinstance(error, MISTAKES) else 1


class ChunkFlyer:
    """The data that a process needs for the chunks of one folder, made once. Raises ConfigError if the
    campaign cannot be flown here, for example on a machine of another kind."""

    def __init__(self, folder: Path):
        self.folder = CampaignFolder(folder)
        self.folder.refuse_other_machine(self.folder.plan)
        self.campaign = self.folder.campaign
        self.runs = make_runs(self.campaign)
        self.own = load_own_measures(self.campaign)

    def fly(self, number: int, announce: Announce | None = None) -> dict[str, int | float]:
        """Flies a chunk unless the folder has it whole. `runs` of the result is the number of flown runs.
        Raises EngineError, RefusedRun."""
        first, last = self.folder.find_chunk(number)
        begin = time.monotonic()
        try:
            self.folder.read_whole_chunk(number)
            return {"chunk": number, "runs": 0, "wall_s": 0.0}
        except DamagedChunk:
            pass
        rows = []
        for cells in fly_range(self.campaign, self.runs, first, last, self.own, announce):
            row = dict(zip(self.folder.plan.columns, cells))
            if is_kept(self.campaign, row):
                keep_run(self.folder, self.campaign, self.runs, row)
            rows.append(cells)
        wall_s = time.monotonic() - begin
        self.folder.write_chunk(number, rows, wall_s)
        return {"chunk": number, "runs": len(rows), "wall_s": wall_s}


_flyers: dict[tuple[str, str], ChunkFlyer] = {}
_one_at_a_time = threading.Lock()  # a Dask worker may have several threads


def fly_chunk(folder: str, number: int) -> dict[str, int | float]:
    """Flies one chunk and writes it whole. Does nothing if the folder has it whole. Raises ConfigError,
    EngineError."""
    with _one_at_a_time:
        place = str(Path(folder).resolve())
        key = place, CampaignFolder(place).plan.sha256
        if key not in _flyers:
            _flyers.clear()
            _flyers[key] = ChunkFlyer(Path(place))
        flyer = _flyers[key]
        flyer.folder.forget_plan()  # plan.json may have changed, for example allow_other_machines
        try:
            return flyer.fly(number)
        except RefusedRun as error:
            raise InputError(str(error)) from None


def serve(folder: Path) -> int:
    """A process of the local engine. It reads lines `CHUNK` or `CHUNK announce` from stdin, and answers one
    line of JSON for each on stdout. With `announce` it also writes a line before each run; if a run ends
    the process, the engine has its index from this line. It ends when stdin is closed, and returns its exit
    code."""
    def answer(message: dict[str, int | float | str]) -> None:
        print(json.dumps(message), file=answers, flush=True)

    numbers, answers = take_pipes()
    try:
        flyer = ChunkFlyer(folder)
        answer({"ready": os.getpid()})
        for line in numbers:
            number, *announce = line.split()
            answer(flyer.fly(int(number), (lambda run: answer({"run": run})) if announce else None))
        return 0
    except (*MISTAKES, *FAILURES) as error:
        answer({"error": str(error), "code": to_exit_code(error)})
        return to_exit_code(error)


def take_pipes() -> tuple[TextIO, TextIO]:
    """stdin and stdout under descriptors that no own measure and no library knows. Their own output on stdout
    goes to stderr; they read an empty stdin."""
    pipes = os.fdopen(os.dup(0)), os.fdopen(os.dup(1), "w")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    os.dup2(2, 1)
    return pipes


def fly_listed(options: argparse.Namespace) -> None:
    first, last = options.chunks
    flyer = ChunkFlyer(options.folder)
    for number in range(first, last + 1):
        done = flyer.fly(number)
        print(f"campaign-worker: chunk {number}: {done['runs']} runs in {done['wall_s']:.3f} s",
              file=sys.stderr)


def main(arguments: Sequence[str]) -> int:
    """Runs the command and returns the exit code."""
    parser = Parser(prog="./sls campaign-worker",
                    description="Flies chunks of a campaign. Slurm starts it.")
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder of the campaign")
    which = parser.add_mutually_exclusive_group(required=True)
    which.add_argument("--chunks", type=parse_range, metavar="A-B", help="fly chunks A to B")
    which.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    try:
        options = parser.parse_args(arguments)
        if options.serve:
            return serve(options.folder)
        fly_listed(options)
        return 0
    except (*MISTAKES, *FAILURES) as error:
        print(f"campaign-worker: error: {escape_controls(error)}", file=sys.stderr)
        return to_exit_code(error)
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
