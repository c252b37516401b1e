"""Loads a Python file of the user: a measure of a campaign, or a law under test."""

import hashlib
import importlib.util
import sys
from pathlib import Path
from types import ModuleType

from sls.input_error import InputError


def load_user_module(file: Path, place: str) -> ModuleType:
    """Runs the file as a module of its own. Raises InputError, which begins with `place`, if it is no Python file, and
    whatever the file raises."""
    name = f"user_module_{file.stem}_{hashlib.sha256(bytes(file.resolve())).hexdigest()[:8]}"
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise InputError(f"{place}: expected a Python file")
    # As `import` does: dataclasses look for the module by its name to read annotations that are texts.
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
