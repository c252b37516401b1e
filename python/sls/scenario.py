"""Reads scenarios from files and replaces values in them."""

import json
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sls.campaign.yaml_nodes import parse_yaml
from sls.core import load_core, to_core
from sls.errors import ConfigError

if TYPE_CHECKING:
    from _sls_core import Scenario

HERE = Path(__file__).resolve().parent
ROOT = HERE if (HERE / "config").is_dir() else HERE.parents[1]
"""The folder with the folder `config`: that of the package if pip has installed it."""
SHIPPED = ROOT / "config/scenarios"


def find_scenario(path_or_name: str | os.PathLike[str]) -> Path:
    """The file of a scenario. A name means the file NAME.yaml in SHIPPED, as for `./sls run`."""
    text = os.fspath(path_or_name)
    is_path = not isinstance(path_or_name, str) or "/" in text or text.endswith(".yaml")
    if is_path or Path(text).is_file():
        return Path(text)
    return SHIPPED / f"{text}.yaml"


def load_scenario(path_or_name: str | os.PathLike[str], *,
                  changes: Mapping[str, object] | None = None, **keys: object) -> "Scenario":
    """Reads a scenario and replaces values in it.

    `changes` names keys by path: keys, and for lists indices from 0, separated by dots, such as
    `{"vehicle.load_mass_kg": 0.3, "faults.0.delay.by_s": 0.008}`. A keyword argument does the same,
    with two underscores for each dot: `vehicle__load_mass_kg=0.3`. Values are numbers, texts, bools,
    lists and maps, in the units of the file. A key that is not in the file is added. Without changes
    the scenario's text equals the file's, byte for byte.

    Raises ConfigError, with file, line and key, if the programs would refuse the scenario."""
    replaced: dict[str, str] = {}
    named = {key.replace("__", "."): value for key, value in keys.items()}
    for path, value in {**(changes or {}), **named}.items():
        try:
            replaced[path] = to_yaml_value(value)
        except (TypeError, ValueError) as error:
            raise ConfigError(f"{path_or_name}: {path}: {error}") from None
    return load_core().Scenario(file=to_core(find_scenario(path_or_name)), changes=replaced)


def read_keys(scenario: "Scenario") -> dict[str, Any]:
    """The keys and values of a scenario's file, as the programs read them: lists, maps, numbers, texts."""
    return parse_yaml(scenario.text.encode(), Path(scenario.name)).to_plain()


def to_yaml_value(value: object) -> str:
    """`value` as YAML in one line that reads back to the same bits. Texts are in quotes, lists and maps in brackets;
    numpy's numbers and arrays are treated like Python's.

    Raises TypeError for other types, ValueError for a number that is not finite."""
    if isinstance(value, (np.generic, np.ndarray)):
        value = value.tolist()
    if value is None:
        return "~"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ValueError(f"expected a finite number, got {value}")
        text = repr(value)
        # Readers of YAML 1.1, such as Python's, read 1e-07 as text and 1.0e-07 as a number.
        return text if "." in text or "e" not in text else text.replace("e", ".0e")
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).encode().decode()  # JSON is valid YAML
    if isinstance(value, Mapping):
        # Readers of YAML 1.1 read a plain `on` as true.
        keys = [key if str(key).isidentifier() and key not in ("on", "off", "yes", "no") else
                json.dumps(key, ensure_ascii=False) for key in value]
        return "{" + ", ".join(f"{key}: {to_yaml_value(item)}" for key, item in zip(keys, value.values())) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(to_yaml_value, value)) + "]"
    raise TypeError(f"expected a number, a text, a list or a map, got {type(value).__name__}")
