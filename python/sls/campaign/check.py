"""Refuses a campaign before it flies if the scenario of one of its runs is impossible: an unknown
key, a wrong type, a value out of range."""

import difflib
import re
from typing import Any, Protocol

from sls.campaign.campaign import Campaign
from sls.campaign.sampling import make_values
from sls.campaign.yaml_nodes import fail
from sls.scenario import to_yaml_value

MOST_LOOKED_AT = 100_000  # runs whose values are compared to find the extreme values
MOST_SEARCHED = 20_000    # runs that are checked one by one to find the first that fails
BLOCK = 1000              # number of these runs whose values are in memory at once
MOST_LISTED = 100         # checked values of a key that does not hold numbers


class Checker(Protocol):
    """The part of `_sls_core.Runs` that this module needs."""

    def check(self, values: list[str]) -> None:
        """Raises ValueError if the scenario reader refuses the scenario with these values."""


def check_campaign(campaign: Campaign, runs: Checker) -> None:
    """Checks run 0 and, for each varied key, the runs with its smallest and its largest value among the
    first 100,000 runs. For a key that does not hold numbers it checks a run with each value. If a run
    fails, it searches the first run of the campaign that fails.

    Raises InputError `FILE:LINE: vary.PATH: run I: …`."""
    for run in _list_extreme_runs(campaign):
        if message := _check_run(campaign, runs, make_values(campaign, run, run)[0]):
            _fail(campaign, *(_find_first(campaign, runs, run) or (run, message)))


def check_keep(campaign: Campaign, measured: list[str]) -> None:
    """Raises InputError `FILE:LINE: keep.by: …` unless `keep.by` is one of the columns `measured`."""
    keep = campaign.keep
    if keep.kind == "worst" and keep.find_column(measured) is None:
        nearest = difflib.get_close_matches(keep.by, measured, n=3, cutoff=0.3)
        fail(campaign.file, keep.line, "keep.by", "expected a measured column"
             + (f", such as {', '.join(nearest)}" if nearest else "") + f", got {keep.by}")


def _find_first(campaign: Campaign, runs: Checker, end: int) -> tuple[int, str] | None:
    """The first run before `end` that fails, and its message."""
    for first in range(0, min(end, MOST_SEARCHED), BLOCK):
        block = make_values(campaign, first, min(first + BLOCK, end) - 1)
        for run, values in enumerate(block, first):
            if message := _check_run(campaign, runs, values):
                return run, message
    return None


def _check_run(campaign: Campaign, runs: Checker, values: list[Any]) -> str:
    """The error in the scenario of a run with these values; empty if there is none."""
    try:
        runs.check([to_yaml_value(value) for value in campaign.pick_scenario_values(values)])
    except ValueError as error:
        return str(error)
    return ""


def _list_extreme_runs(campaign: Campaign) -> list[int]:
    chosen = {0}
    columns = zip(*make_values(campaign, 0, min(campaign.runs, MOST_LOOKED_AT) - 1))
    for varied, column in zip(campaign.varied, columns):
        if varied.is_helper:
            continue
        if all(_is_number(value) for value in column):
            chosen |= {column.index(min(column)), column.index(max(column))}
        elif all(isinstance(value, list) and len(value) == len(column[0])
                 and all(map(_is_number, value)) for value in column):
            for part in zip(*column):
                chosen |= {part.index(min(part)), part.index(max(part))}
        else:
            first_runs: dict[str, int] = {}
            for run, value in enumerate(column):
                first_runs.setdefault(to_yaml_value(value), run)
            chosen |= set(list(first_runs.values())[:MOST_LISTED])
    return sorted(chosen)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _fail(campaign: Campaign, run: int, message: str) -> None:
    """Raises the scenario reader's message `FILE:LINE: KEY: …` with the place of the campaign's key."""
    found = re.fullmatch(r"(.*?:\d+|[^:]*): ([^:\s]+): (.*)", message, re.DOTALL)
    key, text = (_to_path(found[2]), found[3]) if found else ("", message)
    for varied in campaign.varied:
        path = varied.path
        if not varied.is_helper and key and (
                key == path or key.startswith(path + ".") or path.startswith(key + ".")):
            place = "seeds" if varied.kind == "seed" else "vary"
            # The message may be about a key that contains the varied key or is part of it; it is then named, too.
            detail = "" if key == path else f"{found[2]}: "
            fail(campaign.file, varied.line, f"{place}.{path}", f"run {run}: {detail}{text}")
    fail(campaign.file, 0, "vary", f"run {run}: {message}")


def _to_path(key: str) -> str:
    """Converts `faults[0].delay` to `faults.0.delay`."""
    return re.sub(r"\[(\d+)\]", r".\1", key)
