"""runs.csv of a campaign as columns.

Numbers are arrays of doubles, texts are indices into a list of words, certificates are left out. A
campaign of 100,000 runs takes some 40 MB. Columns in the order of the file: `run`, the varied keys by
their paths, `outcome`, `reason`, the measures, `own_error` (if the user defines measures), `steps`,
`certificate`."""

import csv
import io
import re
from array import array
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sls.campaign.campaign import MOST_RUNS
from sls.campaign.campaign_file import MOST_BYTES
from sls.campaign.yaml_nodes import parse_yaml, read_bytes
from sls.input_error import InputError
from sls.strict_files import open_regular

OWN_ERROR = "own_error"
OUTCOMES = ("finished", "lost", "failed")
NUMBER = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?")


@dataclass(frozen=True)
class RunTable:
    file: Path
    keys: tuple[str, ...]  # paths of the varied keys
    measures: tuple[str, ...]  # column names
    run: np.ndarray  # (n,) run indices
    numbers: dict[str, np.ndarray]  # varied keys with numbers only, measures and steps, (n,)
    words: dict[str, tuple[list[str], np.ndarray]]  # other varied keys: values, and index of the value, (n,)
    outcome: np.ndarray  # (n,) index in OUTCOMES
    reasons: Counter  # number of runs by "OUTCOME: REASON", without the numbers in the reason
    draw: np.ndarray | None  # (n,) index of each run's draw; None if nothing is drawn: no statistics then

    def __len__(self) -> int:
        return len(self.run)

    def is_outcome(self, name: str) -> np.ndarray:
        return self.outcome == OUTCOMES.index(name)

    def count(self, name: str) -> int:
        return int(np.sum(self.is_outcome(name)))


def to_word(number: float) -> str:
    """A number among texts: the shortest text that reads back as it, a whole number without a point."""
    return repr(number).removesuffix(".0")


class Column:
    """The cells of a varied key: doubles as long as every cell is a number. After the first other cell
    all are words; a number is then the word that `to_word` gives."""

    def __init__(self) -> None:
        self.cells = array("d")
        self.texts: dict[str, int] | None = None
        self.places = array("l")

    def add(self, cell: str) -> None:
        if self.texts is None:
            try:
                self.cells.append(float(cell))
                return
            except ValueError:
                self.texts = {}
                for value in self.cells:
                    self.add(to_word(value))
        if NUMBER.fullmatch(cell):  # 5 and 5.0 are one value
            cell = to_word(float(cell))
        self.places.append(self.texts.setdefault(cell, len(self.texts)))


def read_rows(file: Path) -> Iterator[list[str]]:
    """Header and rows. Raises InputError."""
    try:
        with io.TextIOWrapper(open_regular(file), "utf-8", newline="") as lines:
            yield from csv.reader(lines)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise InputError(f"{file}: expected the table of a campaign, got: {reason}") from None


def split_header(file: Path, header: list[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the varied keys and of the measures. Raises InputError."""
    if (header[:1] != ["run"] or "outcome" not in header
            or header[header.index("outcome"):][:2] != ["outcome", "reason"]
            or header[-2:] != ["steps", "certificate"]):
        raise InputError(f"{file}:1: expected the columns run, …, outcome, reason, …, steps, "
                         f"certificate, got '{','.join(header)[:80]}'")
    middle = header.index("outcome")
    measures = header[middle + 2:-2]
    return tuple(header[1:middle]), tuple(measures[:-1] if measures[-1:] == [OWN_ERROR]
                                          else measures)


def read_runs(file: Path) -> RunTable:
    """Reads the table in one pass over the file. Raises InputError with file and line."""
    rows = read_rows(file)
    header = next(rows, [])
    keys, measures = split_header(file, header)
    run, outcome, steps = array("q"), array("b"), array("d")
    columns = [Column() for _ in keys]
    values = [array("d") for _ in measures]
    reasons: Counter = Counter()
    first_measure = len(keys) + 3
    for line, row in enumerate(rows, start=2):
        try:
            if len(row) != len(header):
                raise ValueError(f"{len(row)} fields")
            run.append(int(row[0]))
            for column, cell in zip(columns, row[1:]):
                column.add(cell)
            outcome.append(OUTCOMES.index(row[len(keys) + 1]))
            for numbers, cell in zip(values, row[first_measure:]):
                numbers.append(float(cell) if cell else np.nan)
            steps.append(float(row[-2] or "nan"))
        except (ValueError, OverflowError) as error:
            raise InputError(f"{file}:{line}: expected a run of {len(header)} fields, "
                             f"got: {error}") from None
        if row[len(keys) + 2]:
            reasons[f"{row[len(keys) + 1]}: {leave_out_numbers(row[len(keys) + 2])}"] += 1
        if header[-3] == OWN_ERROR and row[-3]:
            reasons[f"own measure: {leave_out_numbers(row[-3])}"] += 1
    numbers = {key: np.asarray(column.cells) for key, column in zip(keys, columns)
               if column.texts is None}
    numbers |= {name: np.asarray(cells) for name, cells in zip(measures, values)}
    numbers["steps"] = np.asarray(steps)
    words = {key: (list(column.texts), np.asarray(column.places))
             for key, column in zip(keys, columns) if column.texts is not None}
    points = count_points(file.with_name("campaign.yaml"))
    return RunTable(file, keys, measures, np.asarray(run), numbers, words, np.asarray(outcome),
                    reasons, np.asarray(run) // points if points else None)


def count_points(file: Path) -> int | None:
    """The runs of each draw of a campaign file: the product of its grids and lists. None if nothing is drawn,
    or if there is no campaign file. It was checked when the campaign was planned."""
    try:
        campaign = parse_yaml(read_bytes(file, "a campaign", MOST_BYTES), file).to_plain()
        points, is_drawn = 1, bool(campaign.get("seeds"))
        for varied in (campaign.get("vary") or {}).values():
            if grid := varied.get("grid"):
                points *= grid["values"] if isinstance(grid, dict) else grid[2]
            elif items := varied.get("list"):
                points *= len(items)
            elif "derived" not in varied:
                is_drawn = True
        is_drawn &= 0 < points <= MOST_RUNS
    except (ValueError, AttributeError, LookupError, TypeError):
        return None
    return points if is_drawn else None


def leave_out_numbers(reason: str) -> str:
    """Replaces numbers by "…": reasons that differ only in a time or a size then count as one. A number in
    a name, such as `figure_eight_2`, stays."""
    return re.sub(rf"(?<![\w.-]){NUMBER.pattern}(?![\w])", "…", reason)


def find_rows(file: Path, runs: Iterable[int]) -> dict[int, dict[str, str]]:
    """The rows of some runs, as text, by run index. This is a second pass over the file."""
    wanted = {str(run) for run in runs}
    rows = read_rows(file)
    header = next(rows, [])
    return {int(row[0]): dict(zip(header, row)) for row in rows if row and row[0] in wanted}
