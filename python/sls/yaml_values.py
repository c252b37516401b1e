"""Python's values as YAML, for scenarios."""

import json
import math
from collections.abc import Mapping

import numpy as np


def to_yaml(value: object) -> str:
    """`value` as YAML in one line. Numbers have enough digits to read back the same number; texts are in
    quotes, lists and maps in brackets; numpy's numbers and arrays are treated like Python's.

    Raises TypeError for other types, ValueError for a number that is not finite."""
    if isinstance(value, (np.generic, np.ndarray)):
        value = value.tolist()
    if value is None:
        return "~"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return repr(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ValueError(f"expected a finite number, got {value}")
        return repr(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {to_yaml(item)}" for key, item in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(to_yaml, value)) + "]"
    raise TypeError(f"expected a number, a text, a list or a map, got {type(value).__name__}")
