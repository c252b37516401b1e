"""Reads tables of numbers as numpy arrays. Errors name file and line."""

import csv
import io
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sls.input_error import InputError

# Numpy types of the columns that hold text. The controller's name is cut, because it is not shown.
TEXT_COLUMNS = {"stage_name": "U32", "fault": "U16", "controller": "U1"}


@dataclass(frozen=True)
class Text:
    """The whole lines of a file."""

    path: Path
    lines: list[str]
    rest: str
    """Text after the last line end. In a recording this is a row whose writer was killed."""


def read_text(path: Path) -> Text:
    """Reads the text file `path`. Raises InputError if it cannot be read as text."""
    try:
        text = path.read_bytes().decode()
    except OSError as error:
        raise InputError(f"{path}: expected a file, got: {os.strerror(error.errno)}") from None
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
    kinds = np.dtype([(name, TEXT_COLUMNS.get(name, "f8")) for name in columns])
    lines = text.lines[first_line - 1:]
    if not lines:
        return np.empty(0, kinds)
    try:
        return np.loadtxt(lines, dtype=kinds, delimiter=delimiter, quotechar='"', comments=None,
                          ndmin=1)
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
            if name not in TEXT_COLUMNS and not is_number(field):
                return InputError(f"{text.path}:{number}: {name}: expected a number, got '{field}'")
    return None


def is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def read_table(path: Path, required: Sequence[str]) -> tuple[np.ndarray, bool]:
    """The rows of a CSV file with a header, and whether its last row was cut off. The header must have
    the columns `required`. Raises InputError."""
    text = read_text(path)
    if not text.lines:
        raise InputError(f"{path}:1: expected a header, got an empty file")
    columns = text.lines[0].split(",")
    for name in required:
        if name not in columns:
            raise InputError(f"{path}:1: expected a column '{name}', got '{text.lines[0][:60]}'")
    return parse_rows(text, columns, 2), bool(text.rest)


def read_records(path: Path) -> list[dict[str, str]]:
    """The rows of a small CSV file. Its fields may be any text. Raises InputError."""
    text = read_text(path)
    return list(csv.DictReader(io.StringIO("\n".join(text.lines))))


def stack(table: np.ndarray, names: Sequence[str]) -> np.ndarray:
    """The columns `names` side by side, (n, len(names))."""
    return np.column_stack([table[name] for name in names])
