"""Reads files that others may have made: regular files only, of a limited size, with the expected keys and types."""

import json
import os
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

from sls.input_error import InputError

MOST_BYTES = 2_000_000  # of a manifest or plan; a thousand gaps take 120,000
COUNT = range(2**63)
NAMES = {bool: "true or false", str: "a text", float: "a finite number", dict: "a map", list: "a list"}


def open_regular(file: Path) -> BinaryIO:
    """Opens a regular file for reading. Raises OSError; also for a pipe, a socket or a device, because its reader
    could wait, or read, for ever."""
    descriptor = os.open(file, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    mode = os.fstat(descriptor).st_mode
    if stat.S_ISREG(mode):
        return os.fdopen(descriptor, "rb")
    os.close(descriptor)  # os.fdopen would refuse a folder and leave it open
    raise OSError(0, "a directory" if stat.S_ISDIR(mode) else "a pipe, socket or device")


def read_limited(file: Path, most: int = MOST_BYTES) -> bytes:
    """The bytes of a regular file. Raises OSError, also if there are more than `most`."""
    with open_regular(file) as stream:
        data = stream.read(most + 1)
    if len(data) > most:
        raise OSError(0, f"more than {most} bytes")
    return data


def read_json(file: Path, shape: Any = None) -> Any:
    """The JSON of a file. Raises OSError if it cannot be read, InputError if it is no JSON or not of this `shape`:
    a type; a range of whole numbers; [SHAPE], a list; a tuple, a list of so many; a map, whose keys that end with
    "?" may be absent; "*" is every key. Further keys may be there."""
    try:
        value = json.loads(read_limited(file).decode(), parse_constant=refuse_constant)
        json.dumps(value, ensure_ascii=False).encode()  # half of a surrogate pair could not be printed
    except (ValueError, RecursionError) as error:
        raise InputError(f"{file}: expected JSON, got: {error}") from None
    check_shape(file, value, shape)
    return value


def refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"the number {name}")


def check_shape(file: Path, value: Any, shape: Any, key: str = "") -> None:
    """Raises InputError unless the value has this shape, see `read_json`."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if isinstance(shape, Mapping) and isinstance(value, dict):
        for name, inner in (dict.fromkeys(value, shape["*"]) if "*" in shape else shape).items():
            if (own := name.removesuffix("?")) in value or own == name:
                check_shape(file, value.get(own), inner, f"{key}.{own}" if key else own)
    elif isinstance(shape, list) and isinstance(value, list):
        for place, item in enumerate(value):
            check_shape(file, item, shape[0], f"{key}[{place}]")
    elif isinstance(shape, tuple) and isinstance(value, list) and len(value) == len(shape):
        check_shape(file, value, [shape[0]], key)
    elif not (shape is None or isinstance(shape, type) and isinstance(value, shape) and shape is not float
              or shape is float and is_number and abs(value) < 1e9
              or isinstance(shape, range) and isinstance(value, int) and is_number and value in shape):
        expected = (f"a whole number from {shape[0]} to {shape[-1]}" if isinstance(shape, range) else
                    f"a list of {len(shape)}" if isinstance(shape, tuple) else
                    NAMES[shape if isinstance(shape, type) else type(shape)])
        raise InputError(f"{file}: {key + ': ' if key else ''}expected {expected}, got "
                         f"{json.dumps(value, default=str):.60}")
