"""A campaign: a base scenario, the keys that vary from run to run, the measures of each run.

This module holds values only. `campaign_file` reads them, `sampling` draws from them."""

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

MOST_RUNS = 10_000_000
DEFAULT_MEASURES = ("load_error_rms", "load_error_max", "settling", "overshoot", "tilt_max", "force_max", "time_of_loss")
MEASURES = (*DEFAULT_MEASURES, "load_error_end", "quad_error_rms", "quad_error_max", "quad_error_end", "attitude_max",
            "energy_max", "outcome")
DISTRIBUTIONS = ("uniform", "normal", "log_uniform")
# Suffixes that follow the measure's name in a column for the whole flight.
UNITS = ("", "_m", "_s", "_n", "_rad", "_j")


@dataclass(frozen=True)
class Varied:
    """A key of the scenario, or a helper variable, whose value varies from run to run.

    `grid` and `list` hold their `items`. `uniform`, `normal`, `log_uniform`, `sobol` and
    `latin_hypercube` hold a `distribution` of DISTRIBUTIONS with its two `parameters`: bounds, or
    mean and standard deviation; a normal distribution may be limited to the bounds `within`.
    `derived` holds `expressions`: an Expression, or a nested list of expressions.
    `seed` is a noise seed, drawn by counting up from `seed`."""

    path: str
    kind: str
    line: int
    items: tuple[Any, ...] = ()
    distribution: str = ""
    parameters: tuple[float, float] = (0.0, 0.0)
    seed: int = 0
    expressions: Any = None
    constants: tuple[tuple[str, float], ...] = ()  # of `derived`: names and numbers from the base file
    within: tuple[float, float] | None = None
    multiple_of: int | float | None = None  # values are rounded to a multiple of it

    @property
    def is_helper(self) -> bool:
        """True for a helper variable, such as `_speed`: it is in runs.csv, but not in the scenario."""
        return self.path.startswith("_")

    @property
    def is_crossed(self) -> bool:
        """True if each of its items is flown with each item of the other crossed keys."""
        return self.kind in ("grid", "list")

    @property
    def is_drawn(self) -> bool:
        """True if each draw has another value. The campaign file must then state the number of runs."""
        return self.kind not in ("grid", "list", "derived")


@dataclass(frozen=True)
class Keep:
    """The recordings that a campaign keeps: "none", "failed", "all" or "worst" (`count` runs with the
    largest values in the column `by`)."""

    kind: str = "none"
    count: int = 0
    by: str = ""
    line: int = field(default=0, compare=False)  # of `by`

    def find_column(self, columns: list[str]) -> str | None:
        """The column of `columns` that `by` names, with or without its unit: load_error_max means
        load_error_max_m."""
        return next((self.by + unit for unit in UNITS if self.by + unit in columns), None)


@dataclass(frozen=True)
class Certify:
    """The runs that get a certificate: "all", "none" or "some" (`count` runs, chosen by `seed`)."""

    kind: str = "all"
    count: int = 0
    seed: int = 0


@dataclass(frozen=True)
class OwnMeasure:
    """A Python function of the user: called with a flight, returns a number, or a dict with a
    number for each of `columns`."""

    file: Path
    function: str
    columns: tuple[str, ...]
    line: int


@dataclass(frozen=True)
class Campaign:
    """A campaign file, read and checked. `varied` holds everything that differs between runs; it ends
    with a member of kind "seed" for each of `seeds`."""

    file: Path
    text: str
    name: str
    base: Path
    base_text: str
    runs: int
    varied: tuple[Varied, ...]
    measures: tuple[str, ...]  # of MEASURES, without "outcome", which every run has
    own_measures: tuple[OwnMeasure, ...]
    keep: Keep
    certify: Certify
    seeds: tuple[str, ...]
    period_s: float | None
    sha256: str  # of this text, the base scenario's text and the files of own measures

    @property
    def points(self) -> int:
        """Number of combinations of all grids and lists; 1 without any. Run i flies draw i // points
        at point i % points."""
        return math.prod(len(varied.items) for varied in self.varied if varied.is_crossed)

    @property
    def draws(self) -> int:
        """Number of draws that `runs` runs need; the last draw may be incomplete."""
        return -(-self.runs // self.points)

    @property
    def paths(self) -> list[str]:
        """The paths of everything that varies, which are columns of runs.csv."""
        return [varied.path for varied in self.varied]

    @property
    def scenario_paths(self) -> list[str]:
        """The paths of everything that is set in the scenario: all except the helper variables."""
        return [varied.path for varied in self.varied if not varied.is_helper]

    def pick_scenario_values(self, values: list[Any]) -> list[Any]:
        """Picks the values of `scenario_paths` from `values`, which has one for each of `paths`."""
        return [value for varied, value in zip(self.varied, values) if not varied.is_helper]
