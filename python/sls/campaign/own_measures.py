"""Measures that the user defines: functions of a Python file, called with the flight of each run."""

import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from sls.campaign.campaign import Campaign, OwnMeasure
from sls.campaign.runs import OwnCells, fly_text, to_number, to_one_line
from sls.input_error import InputError
from sls.user_module import load_user_module

LONGEST_ERROR = 300


def load_function(own: OwnMeasure) -> Callable[..., Any]:
    """Loads the function of a measure. Raises InputError if its file cannot be run or has no such function."""
    place = f"{own.file}: {own.function}"
    try:
        module = load_user_module(own.file, place)
    except InputError:
        raise
    except Exception as error:
        raise InputError(f"{place}: expected a Python file that can be run, got: "
                         f"{describe(error, own.file)}") from None
    function = getattr(module, own.function, None)
    if not callable(function):
        raise InputError(f"{place}: expected a function of this name, got none")
    return function


def describe(error: Exception, file: Path) -> str:
    """Type and text of the error, and the last line of the user's file on the way to it, in one line."""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__)
             if frame.filename == str(file)]
    line = f" (line {lines[-1]})" if lines else ""
    return to_one_line(f"{type(error).__name__}: {error}"[:LONGEST_ERROR] + line)


def to_columns(own: OwnMeasure, result: Any) -> list[float]:
    """The result as numbers for the measure's columns. Raises TypeError or KeyError if it does not fit them."""
    if isinstance(result, dict):
        if set(result) != set(own.columns):
            raise KeyError(f"expected {', '.join(own.columns)}, got {', '.join(map(str, result))}")
        return [float(result[column]) for column in own.columns]
    if len(own.columns) != 1:
        raise TypeError(f"expected a dict with {', '.join(own.columns)}, got {result!r:.50}")
    return [float(result)]


def load_own_measures(campaign: Campaign) -> OwnCells | None:
    """The own measures of a campaign, loaded once in each process; None if it has none. Raises InputError."""
    measures = [(own, load_function(own)) for own in campaign.own_measures]

    def measure(scenario_text: str) -> list[str]:
        """Flies the scenario and calls each function with the flight. Returns the cells of their columns
        and a last cell with the errors. Columns of a function that raises are empty."""
        flight = fly_text(scenario_text, campaign)
        cells, errors = list[str](), list[str]()
        for own, function in measures:
            try:
                cells += map(to_number, to_columns(own, function(flight)))
            except Exception as error:
                cells += [""] * len(own.columns)
                errors.append(f"{own.function}: {describe(error, own.file)}")
        return [*cells, "; ".join(errors)]

    return measure if measures else None
