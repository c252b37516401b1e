"""Imports the extension module. The error has one line that tells how to build it."""

import os
from types import ModuleType

from sls.input_error import InputError


def load_core() -> ModuleType:
    """The module _sls_core. Raises ImportError if it is not built."""
    try:
        import _sls_core
    except ModuleNotFoundError as error:
        if error.name != "_sls_core":
            raise
        raise ImportError("expected the module _sls_core: run ./sls python or ./sls build",
                          name="_sls_core") from None
    return _sls_core


def to_core(path: str | os.PathLike[str]) -> str:
    """The path as the extension module takes it: UTF-8, whatever the encoding of the locale. Raises InputError."""
    try:
        return os.fsencode(path).decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: expected a path in UTF-8, got byte {error.object[error.start]:#04x} in it") from None
