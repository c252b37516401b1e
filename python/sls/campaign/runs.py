"""Rows of runs.csv. A row is one run, and depends only on the campaign and the run's index."""

import math
import re
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from sls.campaign.campaign import Campaign
from sls.campaign.sampling import is_certified, make_values
from sls.core import load_core
from sls.errors import ConfigError
from sls.scenario import to_yaml_value

if TYPE_CHECKING:
    from _sls_core import Runs
    from sls import Flight

BLOCK = 1000  # number of runs whose values are in memory at once
OwnCells = Callable[[str], list[str]]  # from a scenario's text to the cells of all own measures
Announce = Callable[[int], None]


class RefusedRun(Exception):
    """The scenario of a run is refused. The message is one line with the run's index."""


def make_runs(campaign: Campaign) -> "Runs":
    """The object that flies the runs. It flies the base scenario once. Raises sls.ConfigError."""
    from _sls_core import Runs
    from sls import Flight
    return Runs(str(campaign.base), campaign.scenario_paths, list(campaign.measures),
                campaign.period_s)


def list_own_columns(campaign: Campaign) -> list[str]:
    return [column for own in campaign.own_measures for column in own.columns]


def list_columns(campaign: Campaign, runs: "Runs") -> list[str]:
    """The columns of runs.csv."""
    own = list_own_columns(campaign)
    return ["run", *campaign.paths, "outcome", "reason", *runs.columns, *own,
            *(["own_error"] if own else []), "steps", "certificate"]


def to_cell(value: Any) -> str:
    """A varied value as YAML, as in the scenario. A printable text has no quotes."""
    is_plain = isinstance(value, str) and value.isprintable()
    return value if is_plain else to_yaml_value(value)


def to_number(value: float) -> str:
    """The shortest text that reads back as the same number; empty for NaN."""
    return "" if math.isnan(value) else repr(value)


def to_one_line(text: str) -> str:
    """Removes line breaks, and addresses in memory, which differ from process to process."""
    return re.sub(r"0x[0-9a-f]{6,}", "0x…", " ".join(text.split()))


def list_yaml_values(campaign: Campaign, values: list[Any]) -> list[str]:
    """Values of the varied keys of the scenario, as YAML."""
    return [to_yaml_value(value) for value in campaign.pick_scenario_values(values)]


def fly_run(campaign: Campaign, runs: "Runs", index: int, values: list[Any],
            own: OwnCells | None = None) -> list[str]:
    """Flies one run. Returns the cells of its row. Raises RefusedRun if its scenario is refused."""
    texts = list_yaml_values(campaign, values)
    try:
        outcome, reason, measures, certificate, steps = runs.fly(
            texts, is_certified(campaign, index))
        own_cells = own(runs.scenario_text(texts)) if own else []
    except ConfigError as error:
        raise RefusedRun(f"run {index}: {error}") from None
    return [str(index), *map(to_cell, values), outcome, to_one_line(reason), *map(to_number, measures),
            *own_cells, str(steps), certificate]


def fly_whole(campaign: Campaign, runs: "Runs", values: list[Any]) -> "Flight":
    """Flies one run and returns the flight with all columns. Raises ConfigError, RunError."""
    return fly_text(runs.scenario_text(list_yaml_values(campaign, values)), campaign)


def fly_text(scenario_text: str, campaign: Campaign) -> "Flight":
    """Flies a scenario whose paths are relative to the base scenario's folder."""
    import sls
    return sls.fly(load_core().Scenario(None, scenario_text, str(campaign.base.parent), {}))


def list_values(campaign: Campaign, first: int, last: int) -> Iterator[tuple[int, list[Any]]]:
    """Index and values of each run, in order, with at most BLOCK runs in memory."""
    for begin in range(first, last + 1, BLOCK):
        block = make_values(campaign, begin, min(begin + BLOCK - 1, last))
        yield from enumerate(block, begin)


def fly_range(campaign: Campaign, runs: "Runs", first: int, last: int,
              own: OwnCells | None = None,
              announce: Announce | None = None) -> Iterator[Sequence[str]]:
    """The cells of each run's row. `announce` is called with each index before the run is flown."""
    for index, values in list_values(campaign, first, last):
        if announce:
            announce(index)
        yield fly_run(campaign, runs, index, values, own)
