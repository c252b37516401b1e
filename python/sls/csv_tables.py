"""Reads tables of numbers as numpy arrays. Errors name file and line."""

import csv
import io
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from sls.core import load_core, to_core
from sls.errors import ConfigError
from sls.input_error import InputError
from sls.strict_files import open_regular, read_limited

TEXT_COLUMNS = {"stage_name", "fault", "controller"}
INTEGER_COLUMNS = {"vehicle_id", "step", "stage"}
MOST_LINE = 200_000
WHOLE, FRACTION, TEXT = (re.compile(pattern, re.DOTALL) for pattern in ("[0-9]{1,18}", r"[-+0-9.einfa]{1,30}", ".*"))
STATUS = dict.fromkeys(("phase", "reason", "controller", "timing", "problem"), TEXT) | dict.fromkeys(
    ("real_time_factor", "round_trip_p50_us", "round_trip_p99_us"), FRACTION)  # the other columns are whole numbers


@dataclass(frozen=True)
class Text:
    """The whole lines of a file."""

    path: Path
    lines: list[str]
    rest: str
    """Text after the last line end. In a recording this is a row whose writer was killed."""


def read_text(path: Path, most: int = 500_000_000) -> Text:
    """Reads the text file `path` of at most `most` bytes. Raises InputError if it cannot be read as text."""
    try:
        text = read_limited(path, most).decode()
    except OSError as error:
        raise InputError(f"{path}: expected a file, got: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: expected text, got byte {error.object[error.start]:#04x} at "
                         f"{error.start}") from None
    lines = text.split("\n")
    rest = lines.pop()
    return Text(path, lines, rest)


def parse_rows(text: Text, columns: Sequence[str], first_line: int,
               delimiter: str | None = ",") -> np.ndarray:
    """The lines from `first_line` (counted from 1) on, as a structured array with a field per column.

    Raises InputError if a row has another number of columns, or if a field is not a number."""
    kinds = np.dtype([(name, "f8") for name in columns])
    lines = text.lines[first_line - 1:]
    if not lines:
        return np.empty(0, kinds)
    try:
        return np.loadtxt(lines, dtype=kinds, delimiter=delimiter, comments=None, ndmin=1)
    except ValueError as error:
        raise find_bad_row(text, columns, first_line, delimiter) or InputError(
            f"{text.path}: expected rows of {len(columns)} columns, got: {error}") from None


def find_bad_row(text: Text, columns: Sequence[str], first_line: int,
                 delimiter: str | None) -> InputError | None:
    """An error that describes the first row that numpy could not parse."""
    for number, line in enumerate(text.lines[first_line - 1:], first_line):
        fields = line.split() if delimiter is None else next(csv.reader([line]), [])
        if fields and len(fields) != len(columns):
            return InputError(f"{text.path}:{number}: expected {len(columns)} columns, "
                              f"got {len(fields)}")
        for name, field in zip(columns, fields):
            if not is_number(field):
                return InputError(f"{text.path}:{number}: {name}: expected a number, got '{field}'")
    return None


def is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def read_header(path: Path) -> tuple[str, bool]:
    """The first line of a file, and whether its last line was cut off. Raises InputError."""
    try:
        with open_regular(path) as file:
            header = file.readline(MOST_LINE).decode(errors="replace")
            file.seek(-1 if header else 0, os.SEEK_END)
            return header, file.read() not in (b"\n", b"")
    except OSError as error:
        raise InputError(f"{path}: expected a file, got: {error.strerror}") from None


def read_table(path: Path, required: Sequence[str], wanted: str = ".*") -> dict[str, np.ndarray]:
    """The columns of a CSV file with a header whose names match `wanted`. Numbers are float64, those of INTEGER_COLUMNS
    int64. The header must have the columns `required`. Raises InputError."""
    header, _ = read_header(path)
    if not header.endswith("\n"):
        raise InputError(f"{path}:1: expected a header, got an empty file")
    names = header[:-1].split(",")
    for name in required:
        if name not in names:
            raise InputError(f"{path}:1: expected a column '{name}', got '{header[:60].rstrip()}'")
    try:
        read = {name for name in names if re.fullmatch(wanted, name)}
        columns = load_core().read_table(to_core(path), header[:-1], TEXT_COLUMNS, read)
    except ConfigError as error:
        raise InputError(str(error)) from None
    table = {name: column for name, column in zip(names, columns) if name in read}
    for name, column in table.items():
        if name in INTEGER_COLUMNS and not np.all(is_whole := (np.abs(column) < 2**53) & (column % 1 == 0)):
            raise InputError(f"{path}: {name}: expected whole numbers, got {column[np.argmin(is_whole)]:g}")
    return {name: to_array(name, column) for name, column in table.items()}


def to_array(name: str, column: Any) -> np.ndarray:
    if name in TEXT_COLUMNS:
        texts, indices = column
        return np.array(texts, dtype=np.str_)[indices]
    return column.astype(np.int64) if name in INTEGER_COLUMNS else column


def read_records(path: Path) -> Iterator[dict[str, str]]:
    """The rows of a status.csv, without one that is cut off. Raises InputError."""
    try:
        with io.TextIOWrapper(open_regular(path), "utf-8", newline="\n") as stream:
            lines = iter(partial(stream.readline, MOST_LINE), "")
            reader = csv.DictReader(line for line in lines if line.endswith("\n") or len(line) == MOST_LINE)
            for row in reader:
                for name in {"phase", "reason", "step", *row}:
                    text = row.get(name)
                    kind = STATUS.get(name, WHOLE)
                    if not isinstance(text, str) or not kind.fullmatch(text):
                        expected = "a text" if kind is TEXT else "a number"
                        raise InputError(f"{path}:{reader.line_num}: {name}: expected {expected}, got {text!r:.60}")
                yield row
    except OSError as error:
        raise InputError(f"{path}: expected a file, got: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: expected rows of text, got: {error}") from None
