"""Figures, their bounds and their ratios, as a table and as JSON. This module measures nothing."""

import math
import statistics
from dataclasses import dataclass, field
from typing import Any

LESS = "less"  # a smaller value is better
MORE = "more"


@dataclass
class Figure:
    """One figure, measured once in each round, and its bound, measured in the same rounds.

    `bounds` has one value for each of `values`, or none if there is no bound; both in `unit`.
    `goal` is the goal of the ratio if `is_goal_of_ratio`, else of the figure. `parts` exist for a
    figure in steps/s or µs: the parts of a step, in µs; in each round their sum is the step.
    """

    part: str
    name: str
    unit: str
    values: list[float]
    bound_name: str = ""
    bounds: list[float] = field(default_factory=list)
    better: str = MORE
    goal: float | None = None
    is_goal_of_ratio: bool = False
    parts: dict[str, list[float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.values:
            raise ValueError(f"{self.part}, {self.name}: expected a value, got none")
        if self.bounds and len(self.bounds) != len(self.values):
            raise ValueError(f"{self.part}, {self.name}: expected {len(self.values)} bounds, "
                             f"got {len(self.bounds)}")
        if any(value <= 0 for value in self.bounds) or (self.bounds and min(self.values) <= 0):
            raise ValueError(f"{self.part}, {self.name}: expected numbers > 0 for a ratio")
        for times in zip(self.step_times, *self.parts.values()) if self.parts else ():
            if not math.isclose(times[0], sum(times[1:]), rel_tol=1e-9):
                raise ValueError(f"{self.part}, {self.name}: expected parts of {times[0]} µs, "
                                 f"got {sum(times[1:])} µs")

    @property
    def median(self) -> float:
        return statistics.median(self.values)

    @property
    def step_times(self) -> list[float]:
        """Time of a step in each round, µs."""
        return [1e6 / value if self.unit == "steps/s" else value for value in self.values]

    @property
    def ratios(self) -> list[float]:
        """Ratio in each round: 1 at the bound, less if the figure is worse than its bound."""
        if self.better == MORE:
            return [value / bound for value, bound in zip(self.values, self.bounds)]
        return [bound / value for value, bound in zip(self.values, self.bounds)]

    @property
    def is_goal_reached(self) -> bool | None:
        if self.goal is None:
            return None
        reached = statistics.median(self.ratios) if self.is_goal_of_ratio else self.median
        is_least = self.better == MORE or self.is_goal_of_ratio
        return reached >= self.goal if is_least else reached <= self.goal

    def to_json(self) -> dict[str, Any]:
        json: dict[str, Any] = {"part": self.part, "name": self.name, "unit": self.unit,
                                "better": self.better, **summarize(self.values)}
        if self.bounds:
            json["bound"] = {"name": self.bound_name, **summarize(self.bounds)}
            json["ratio"] = summarize(self.ratios)
        if self.parts:
            json["parts_us"] = {name: summarize(values) for name, values in self.parts.items()}
        if self.goal is not None:
            json["goal"] = {"of": "ratio" if self.is_goal_of_ratio else "figure",
                            "value": self.goal, "reached": self.is_goal_reached}
        return json


class Rounds:
    """Collects the figures of a part: each is added once in every round."""

    def __init__(self, part: str):
        self.part = part
        self.added: dict[tuple[str, str, str], dict[str, Any]] = {}

    def add(self, name: str, unit: str, value: float, bound_name: str = "", bound: float | None = None,
            parts: dict[str, float] | None = None, **options: Any) -> None:
        """`options` are those of Figure."""
        figure = self.added.setdefault((name, unit, bound_name), {
            "values": [], "bounds": [], "parts": {}, **options})
        figure["values"].append(value)
        if bound is not None:
            figure["bounds"].append(bound)
        for part, time in (parts or {}).items():
            figure["parts"].setdefault(part, []).append(time)

    def make_figures(self) -> list[Figure]:
        return [Figure(self.part, name, unit, bound_name=bound_name, **figure)
                for (name, unit, bound_name), figure in self.added.items()]


def summarize(values: list[float]) -> dict[str, Any]:
    return {"median": statistics.median(values), "min": min(values), "max": max(values),
            "rounds": list(values)}


def format_number(value: float) -> str:
    """Three digits, or a whole number from 100 on."""
    if value == 0:
        return "0"
    if abs(value) >= 100:
        return f"{value:,.0f}"
    return f"{value:.3g}"


def format_spread(values: list[float]) -> str:
    median = format_number(statistics.median(values))
    if len(values) == 1:
        return median
    return f"{median} ({format_number(min(values))} … {format_number(max(values))})"


def format_ratio(ratio: float) -> str:
    return f"{ratio:.2f}" if ratio >= 0.1 else f"{ratio:.2g}"


HEADER = ("figure", "unit", "median (min … max)", "bound", "ratio", "goal")


def make_rows(figures: list[Figure]) -> list[tuple[str, ...]]:
    rows = []
    for figure in figures:
        bound = format_spread(figure.bounds) if figure.bounds else ""
        ratio = format_ratio(statistics.median(figure.ratios)) if figure.bounds else ""
        goal = ""
        if figure.goal is not None:
            relation = "≤" if figure.better == LESS and not figure.is_goal_of_ratio else "≥"
            goal = (f"{relation} {format_number(figure.goal)}"
                    f"{' of its bound' if figure.is_goal_of_ratio else ''}: "
                    f"{'reached' if figure.is_goal_reached else 'missed'}")
        rows.append((figure.name, figure.unit, format_spread(figure.values), bound, ratio, goal))
    return rows


def format_lines(rows: list[tuple[str, ...]], left: tuple[int, ...]) -> list[str]:
    """Columns as wide as necessary; those of `left` are aligned left."""
    widths = [max(map(len, column)) for column in zip(*rows)]
    return ["  " + "  ".join(
        cell.ljust(width) if index in left else cell.rjust(width)
        for index, (cell, width) in enumerate(zip(row, widths))).rstrip() for row in rows]


def format_parts(figures: list[Figure]) -> list[str]:
    """A line for each figure that has parts."""
    figures = [figure for figure in figures if figure.parts]
    if not figures:
        return []
    names = list(dict.fromkeys(name for figure in figures for name in figure.parts))
    rows = [("where a step goes, µs", "step", *names)]
    for figure in figures:
        columns = [figure.step_times, *(figure.parts.get(name) for name in names)]
        rows.append((f"{figure.part}: {figure.name}",
                     *(format_number(statistics.median(values)) if values else ""
                       for values in columns)))
    return ["", *format_lines(rows, left=(0,))]


def format_table(figures: list[Figure]) -> str:
    """One line for each figure. The lines of a part form a group with a heading and the names of its
    bounds. At the end: the parts of the steps."""
    header, *lines = format_lines([HEADER, *make_rows(figures)], left=(0, 1, 5))
    text = [header]
    part = ""
    for figure, line in zip(figures, lines):
        if figure.part != part:
            part = figure.part
            text.append(part)
            bounds = dict.fromkeys(other.bound_name for other in figures
                                   if other.part == part and other.bounds)
            text += [f"  bound: {name}" for name in bounds]
        text.append(line)
    return "\n".join(text + format_parts(figures))
