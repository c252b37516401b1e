"""The folder of a campaign, shared by planner, workers and engines. README.md, "The folder"."""

import csv
import errno
import fcntl
import hashlib
import io
import json
import os
import re
import shutil
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from sls.campaign.campaign import MOST_RUNS, Campaign
from sls.campaign.engines import EngineError
from sls.campaign.machine import describe_machine, find_difference, host_name
from sls.campaign.used_files import refuse_changed_files
from sls.campaign.whole_files import WholeFile, is_left_over, write_whole
from sls.input_error import InputError
from sls.strict_files import MOST_BYTES, check_shape, read_json, read_limited

COLLECT_JOB = "collect job, "  # the lock's text begins so if a collect job holds it: slurm.py
COLLECT_S = 60.0              # --resume waits for it so long
MOST_CHUNKS = 500_000
MOST_ROW_BYTES = 10_000  # on average
RUNS = range(1, MOST_RUNS + 1)
PLAN = {"campaign": str, "sha256": str, "file": str, "base": str, "engine": str, "first": range(MOST_RUNS),
        "last": range(MOST_RUNS), "campaign_runs": RUNS, "chunk_runs": RUNS, "columns": [str], "machine": {"*": str},
        "allow_other_machines": bool, "used_files?": {"*": str}}
MANIFEST = {"campaign": str, "file": str, "runs?": RUNS, "outcomes?": {"*": RUNS},
            "own_errors?": {"*": {"runs": RUNS, "first": str}}}
OWN_FILES = {"lock", "campaign.yaml", "base.yaml", "chunks", "kept"}  # files that may exist before plan.json


@dataclass(frozen=True)
class Plan:
    """Decisions made before the first run: plan.json."""

    campaign: str        # name
    sha256: str
    file: str            # original path of the campaign file; paths of own measures are relative to it
    base: str            # original path of the base scenario
    engine: str
    first: int
    last: int            # inclusive
    campaign_runs: int   # number of runs of the whole campaign
    chunk_runs: int
    columns: list[str]   # of runs.csv
    machine: dict[str, str]
    allow_other_machines: bool
    used_files: dict[str, str] = field(default_factory=dict)  # used_files.py


class DamagedChunk(Exception):
    """A defect of a chunk's file; the chunk counts as not flown."""


@dataclass(frozen=True)
class Chunk:
    """A whole chunk: its rows, equal to those in runs.csv, and facts about its flights."""

    rows: bytes
    flown: dict[str, Any]  # host, machine, wall_s


class CampaignFolder:
    def __init__(self, folder: str | Path):
        self.folder = Path(folder)
        self._lock: int | None = None

    # --- the plan ---------------------------------------------------------------------------------

    @cached_property
    def plan(self) -> Plan:
        """The plan of the folder. Raises InputError if there is none."""
        file = self.folder / "plan.json"
        try:
            plan = Plan(**read_json(file, PLAN))
        except FileNotFoundError:
            raise InputError(f"{self.folder}: expected the folder of a campaign, got one without "
                             "plan.json") from None
        except OSError as error:
            raise InputError(f"{file}: expected to read it, got: {error.strerror}") from None
        except TypeError as error:
            raise InputError(f"{file}: expected the plan of a campaign, got: {error}") from None
        if not plan.first <= plan.last < plan.campaign_runs:
            raise InputError(f"{file}: first, last: expected runs from 0 to {plan.campaign_runs - 1}, got "
                             f"{plan.first} to {plan.last}")
        if "outcome" not in plan.columns:
            raise InputError(f"{file}: columns: expected 'outcome' among them, got {','.join(plan.columns):.80}")
        if (plan.last - plan.first) // plan.chunk_runs >= MOST_CHUNKS:
            raise InputError(f"{file}: chunk_runs: expected at most {MOST_CHUNKS} chunks, got more")
        return plan

    @cached_property
    def campaign(self) -> Campaign:
        """The campaign at the time of planning, from copies of its file and base. Edits of the originals
        have no effect. Raises InputError if a copy or an own measure has changed."""
        from sls.campaign.campaign_file import load_campaign
        # The original base is preferred, because paths of libraries in it are relative to its folder.
        base, copy = Path(self.plan.base), self.folder / "base.yaml"
        try:
            is_same = read_limited(base) == read_limited(copy)
        except OSError:
            is_same = False
        campaign = load_campaign(self.folder / "campaign.yaml", base=base if is_same else copy,
                                 folder=Path(self.plan.file).parent)
        refuse_changed_files(self.plan.used_files, Path(self.plan.file).parent)
        if campaign.sha256 != self.plan.sha256:
            raise InputError(f"{self.folder}: expected the campaign that it was begun with (sha256 "
                             f"{self.plan.sha256}), got sha256 {campaign.sha256}: campaign.yaml, "
                             "base.yaml or an own measure was changed")
        return campaign

    def create(self, campaign: Campaign, engine: str, chunk_runs: int, first: int, last: int,
               resume: bool, columns: Sequence[str], used_files: dict[str, str],
               allow_other_machines: bool = False) -> None:
        """Begins the folder. With `resume` it checks that the folder belongs to this campaign, and keeps
        its chunks. Holds the lock until `close`. Raises InputError if the folder is not one of this
        campaign, is in use, or was begun on a machine of another kind."""
        self.refuse_foreign(campaign, resume)
        self.make_folders()
        self.take_lock(patience_s=COLLECT_S if resume else 0.0)
        self.refuse_foreign(campaign, resume)  # another process may have begun it meanwhile
        if (self.folder / "plan.json").exists():
            self.take_up(campaign, engine, first, last, list(columns), allow_other_machines)
            return
        self.forget_plan()
        write_whole(self.folder / "campaign.yaml", campaign.text.encode())
        write_whole(self.folder / "base.yaml", campaign.base_text.encode())
        self.write_plan(Plan(
            campaign=campaign.name, sha256=campaign.sha256, file=str(campaign.file.resolve()),
            base=str(campaign.base.resolve()), engine=engine, first=first, last=last,
            campaign_runs=campaign.runs,
            chunk_runs=chunk_runs, columns=list(columns), machine=describe_machine(),
            allow_other_machines=allow_other_machines, used_files=used_files))

    def take_up(self, campaign: Campaign, engine: str, first: int, last: int, columns: list[str],
                allow_other_machines: bool) -> None:
        """Resumes the plan in the folder."""
        plan = self.plan
        if (plan.first, plan.last) != (first, last):
            raise InputError(f"--runs: expected {plan.first}-{plan.last}, with which {self.folder} "
                             f"was begun, got {first}-{last}")
        if plan.columns != columns:
            raise InputError(f"{self.folder}: expected the columns {','.join(columns)} of this "
                             f"version, got {','.join(plan.columns)}")
        plan = replace(plan, engine=engine, file=str(campaign.file.resolve()),
                       base=str(campaign.base.resolve()),
                       allow_other_machines=plan.allow_other_machines or allow_other_machines)
        self.refuse_other_machine(plan)
        refuse_changed_files(plan.used_files, Path(plan.file).parent)
        self.write_plan(plan)
        self.remove_leftovers()

    def forget_plan(self) -> None:
        """Makes the next use of `plan` read plan.json again."""
        self.__dict__.pop("plan", None)

    def write_plan(self, plan: Plan) -> None:
        write_whole(self.folder / "plan.json",
                    (json.dumps(asdict(plan), indent=1, sort_keys=True) + "\n").encode())
        self.__dict__["plan"] = plan

    def refuse_foreign(self, campaign: Campaign, resume: bool) -> None:
        """Raises InputError unless the folder is new or empty, or `resume` continues this campaign."""
        if (self.folder / "plan.json").exists():
            if self.plan.sha256 != campaign.sha256:
                raise InputError(
                    f"{self.folder}: expected a folder of campaign '{campaign.name}' (sha256 "
                    f"{campaign.sha256}), got one of '{self.plan.campaign}' (sha256 "
                    f"{self.plan.sha256})")
            if not resume:
                raise InputError(f"{self.folder}: expected a new folder, got one where this "
                                 "campaign was begun; --resume flies what is missing")
            return
        try:
            foreign = sorted(entry.name for entry in self.folder.iterdir()
                             if entry.name not in OWN_FILES and not entry.name.endswith(".tmp"))
        except FileNotFoundError:
            return
        except OSError as error:
            raise InputError(f"{self.folder}: expected a folder, got: {error.strerror}") from None
        if foreign:
            raise InputError(f"{self.folder}: expected a new or empty folder, got one that holds "
                             f"'{foreign[0]}'")

    def refuse_other_machine(self, plan: Plan) -> None:
        """Raises InputError if rows of this machine could differ from those of the plan's machine."""
        difference = find_difference(plan.machine, describe_machine())
        if difference and not plan.allow_other_machines:
            raise InputError(f"{self.folder}: machine {host_name()}: {difference}; equal "
                             "bits are promised only for machines like the one that began the "
                             "campaign (--resume --allow-other-machines flies on and names them)")

    def make_folders(self) -> None:
        try:
            for folder in (self.folder, self.folder / "chunks"):
                folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{self.folder}: expected a folder to write in (--out DIR names one), got: "
                             f"{error.strerror}") from None

    def remove_leftovers(self) -> None:
        """Removes temporary files of killed processes: those of a process of this machine that has ended,
        and those of other machines that were not written for a day."""
        for folder in (self.folder, self.folder / "chunks", self.folder / "kept"):
            for file in folder.glob(".*.tmp"):
                with suppress(OSError):  # it is gone already, or the disk fails: the next write says so
                    if is_left_over(file):
                        shutil.rmtree(file) if file.is_dir() else file.unlink()

    # --- the lock ---------------------------------------------------------------------------------

    def take_lock(self, owner: str = "", patience_s: float = 0.0) -> None:
        """Locks the folder, because only one process may plan and collect. The kernel frees the lock when
        that process ends. `owner` says to others what this process is. Raises InputError if another
        process holds it, a collect job for longer than `patience_s`: it ends soon."""
        if self._lock is not None:
            return
        file = self.folder / "lock"
        try:
            lock = os.open(file, os.O_RDWR | os.O_CREAT, 0o666)
        except OSError as error:
            raise InputError(f"{file}: expected to write it, got: {error.strerror}") from None
        give_up = time.monotonic() + patience_s
        while True:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except OSError as error:
                holder = os.pread(lock, 200, 0).decode(errors="replace").strip()
                is_held = error.errno in (errno.EWOULDBLOCK, errno.EACCES)
                if is_held and holder.startswith(COLLECT_JOB) and time.monotonic() < give_up:
                    time.sleep(0.1)
                    continue
                os.close(lock)
                if not is_held:
                    raise InputError(f"{file}: expected to lock it, got: {error.strerror}") from None
                raise InputError(f"{self.folder}: expected a folder that no other campaign uses, got "
                                 f"one in use by {holder or 'another process'}") from None
        try:
            os.ftruncate(lock, 0)
            os.pwrite(lock, f"{owner}process {os.getpid()} on {host_name()}\n".encode(), 0)
        except OSError:  # the disk is full: the lock holds without this text
            pass
        self._lock = lock

    def close(self) -> None:
        """Frees the lock."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    # --- chunks -----------------------------------------------------------------------------------

    @property
    def chunks(self) -> list[tuple[int, int, int]]:
        """Number, first and last run (inclusive) of each chunk."""
        plan = self.plan
        return [(number, begin, min(begin + plan.chunk_runs - 1, plan.last))
                for number, begin in enumerate(range(plan.first, plan.last + 1, plan.chunk_runs))]

    def find_chunk(self, number: int) -> tuple[int, int]:
        """First and last run of a chunk. Raises InputError if there is no chunk `number`."""
        plan = self.plan
        count = -(-(plan.last - plan.first + 1) // plan.chunk_runs)
        if not 0 <= number < count:
            raise InputError(f"{self.folder}: expected a chunk from 0 to {count - 1}, got {number}")
        first = plan.first + number * plan.chunk_runs
        return first, min(first + plan.chunk_runs - 1, plan.last)

    def chunk_file(self, number: int) -> Path:
        return self.folder / "chunks" / f"chunk-{number:06d}.csv"

    @cached_property
    def header(self) -> bytes:
        return to_line(self.plan.columns)

    def write_chunk(self, number: int, rows: Iterable[Sequence[str]], wall_s: float = 0.0) -> None:
        """Writes a chunk whole. A whole chunk with the same rows stays unchanged. Raises EngineError if the
        chunk cannot be written, or if there is one with other rows."""
        first, last = self.find_chunk(number)
        table = b"".join(map(to_line, rows))
        flown = {"host": host_name(), "machine": describe_machine(), "wall_s": round(wall_s, 6)}
        body = self.header + table + (
            f"# campaign {self.plan.sha256} runs {first}-{last}\n"
            f"# flown {json.dumps(flown, sort_keys=True)}\n").encode()
        text = body + f"# sha256 {hashlib.sha256(body).hexdigest()}\n".encode()
        file = self.chunk_file(number)
        self.parse_chunk(number, text)  # finds mistakes of the caller
        with WholeFile(file) as writing:
            writing.write(text)
            if writing.finish_new():
                return
            try:
                there = self.read_whole_chunk(number)
            except DamagedChunk:
                writing.finish()
                return
            if there.rows != table:
                raise EngineError(
                    f"{file}: expected the rows that machine {there.flown.get('host')} wrote, got "
                    f"others on machine {host_name()}, first of run "
                    f"{first + find_first_difference(there.rows, table)}")

    def read_whole_chunk(self, number: int) -> Chunk:
        """Reads a chunk. Raises DamagedChunk with the defect, also if there is no file."""
        try:
            text = read_limited(self.chunk_file(number), MOST_BYTES + MOST_ROW_BYTES * self.plan.chunk_runs)
        except FileNotFoundError:
            raise DamagedChunk("missing") from None
        except OSError as error:
            raise DamagedChunk(f"cannot be read: {error.strerror}") from None
        return self.parse_chunk(number, text)

    def parse_chunk(self, number: int, text: bytes) -> Chunk:
        body, mark, checksum = text.rpartition(b"# sha256 ")
        if not mark or checksum != hashlib.sha256(body).hexdigest().encode() + b"\n":
            raise DamagedChunk("checksum does not fit")
        table, mark, rest = body.rpartition(b"# campaign ")
        first, last = self.find_chunk(number)
        campaign, _, flown = rest.partition(b"\n# flown ")
        if not mark or campaign != f"{self.plan.sha256} runs {first}-{last}".encode():
            raise DamagedChunk("of another campaign or other runs")
        if not table.startswith(self.header):
            raise DamagedChunk("other columns")
        rows = table[len(self.header):]
        if re.findall(rb"^(\d+),", rows, re.MULTILINE) != [
                b"%d" % index for index in range(first, last + 1)] or not rows.endswith(b"\n"):
            raise DamagedChunk("rows are missing")
        try:
            flown = json.loads(flown)
            check_shape(self.chunk_file(number), flown, {"host": str, "machine": {"*": str}, "wall_s": float})
        except (ValueError, RecursionError):
            raise DamagedChunk("facts about its flights are damaged") from None
        return Chunk(rows, flown)

    def read_chunk(self, number: int) -> list[list[str]]:
        """The cells of the chunk's rows. Raises DamagedChunk."""
        return list(csv.reader(io.StringIO(self.read_whole_chunk(number).rows.decode())))

    def check_chunks(self) -> Iterator[tuple[int, str]]:
        """Number and defect of every chunk: "" if it is whole, "missing" if it has no file."""
        for number, _, _ in self.chunks:
            try:
                self.read_whole_chunk(number)
                yield number, ""
            except DamagedChunk as defect:
                yield number, str(defect)

    def missing(self) -> list[int]:
        """Numbers of the chunks that must be flown, because they have no file or are damaged."""
        return [number for number, defect in self.check_chunks() if defect]

    # --- the table --------------------------------------------------------------------------------

    def read_rows(self) -> Iterator[dict[str, str]]:
        """The rows of every whole chunk, in order."""
        for number, _, _ in self.chunks:
            try:
                for cells in self.read_chunk(number):
                    yield dict(zip(self.plan.columns, cells))
            except DamagedChunk:
                continue

    def read_row(self, index: int) -> dict[str, str]:
        """The row of run `index`. Raises DamagedChunk."""
        number = (index - self.plan.first) // self.plan.chunk_runs
        cells = self.read_chunk(number)[index - self.find_chunk(number)[0]]
        return dict(zip(self.plan.columns, cells))

    @property
    def manifest(self) -> dict[str, Any]:
        """The manifest in the folder. Raises InputError if there is none."""
        return read_manifest(self.folder / "manifest.json")

    def write_manifest(self, manifest: dict[str, Any]) -> None:
        write_whole(self.folder / "manifest.json", (json.dumps(manifest, indent=1) + "\n").encode())


def read_text(file: Path) -> str:
    """The text of a file of a campaign. Raises InputError."""
    try:
        return read_limited(file).decode()
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "bytes that are no text"
        raise InputError(f"{file}: expected a file of a campaign, got: {reason}") from None


def read_manifest(file: Path) -> dict[str, Any]:
    """The manifest of a campaign. Raises InputError."""
    try:
        return read_json(file, MANIFEST)
    except OSError as error:
        raise InputError(f"{file}: expected a file of a campaign, got: {error.strerror}") from None


def to_line(cells: Sequence[str]) -> bytes:
    """A row of CSV. Fields with a comma or a quote are quoted; the line ends with one line feed."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue().encode()


def find_first_difference(rows: bytes, others: bytes) -> int:
    """Index, from 0, of the first line that differs."""
    pairs = zip(rows.splitlines(), others.splitlines())
    return next((number for number, (one, other) in enumerate(pairs) if one != other), 0)


@contextmanager
def opened(folder: str | Path) -> Iterator[CampaignFolder]:
    """Context with a folder, whose lock is freed at its end."""
    campaign_folder = CampaignFolder(folder)
    try:
        yield campaign_folder
    finally:
        campaign_folder.close()
