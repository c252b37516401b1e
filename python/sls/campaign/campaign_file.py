"""Reads a campaign file strictly: keys and values that are unknown, missing, of the wrong type or
impossible are refused with file, line and key. config/campaigns/README.md describes the keys."""

import hashlib
import math
import re
from fractions import Fraction
from pathlib import Path
from typing import Any

from sls.campaign.campaign import (DEFAULT_MEASURES, DISTRIBUTIONS, MEASURES, MOST_RUNS, Campaign, Certify, Keep,
                                   OwnMeasure, Varied)
from sls.campaign.expressions import Expression, ExpressionError
from sls.campaign.portable_math import exp, log
from sls.campaign.sampling import list_expressions, order_derived, to_fraction
from sls.campaign.yaml_nodes import Place, fail, parse_yaml, read_bytes, to_printable

KEYS = ("name", "base", "runs", "vary", "seeds", "measure", "keep", "certify", "period_s")
SPREADS = ("sobol", "latin_hypercube")  # methods to spread draws; each takes any distribution
PYTHON_MEASURE = "{ python: FILE, function: NAME, columns: [NAME] }"
KINDS = ("grid", "list", *DISTRIBUTIONS, *SPREADS, "derived")
OPTIONS = {"grid": (), "list": (), "derived": ("multiple_of",)}  # all others: DRAW_OPTIONS
DRAW_OPTIONS = ("seed", "multiple_of", "within")
MOST_SEED = 2**63 - 1
MOST_ITEMS = 100_000  # in one grid or list
MOST_BYTES = 2**20
PATH = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]*(\.[A-Za-z0-9][A-Za-z0-9_-]*)*|_[A-Za-z0-9_]+")
NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}")
COLUMN = re.compile(r"[a-z][a-z0-9_]{0,63}")
FIXED_COLUMNS = ("run", "outcome", "reason", "steps", "certificate", "own_error")


def load_campaign(file: Path, *, base: Path | None = None,
                  folder: Path | None = None) -> Campaign:
    """Reads and checks a campaign file. Relative paths begin at `folder`, by default that of the file.
    `base` replaces the base scenario that the file names.

    Raises InputError `FILE:LINE: key: expected …, got …`."""
    file = Path(file)
    data = read_bytes(file, "a campaign", MOST_BYTES)
    return _Reader(parse_yaml(data, file), data, base, folder or file.parent).read()


class _Reader:
    """Reads one file once."""

    def __init__(self, root: Place, data: bytes, base: Path | None, folder: Path):
        self.root, self.data, self.folder = root, data, folder
        self.values = root.read_map("a campaign (a map)", KEYS)
        self.base = base or self._read_path(root.require(self.values, "base", "a scenario file"))
        self.base_data = read_bytes(self.base, "a scenario", MOST_BYTES)
        self.base_root = parse_yaml(self.base_data, self.base)

    def read(self) -> Campaign:
        vary = self.values.get("vary")
        varied = self._read_vary(vary) if vary else []
        seeds = self._read_seeds([member.path for member in varied])
        if not varied and not seeds:
            (vary or self.root.at("vary", self.root.node)).fail(
                "expected at least one key that varies, got none")
        varied += seeds
        runs = self._read_runs(varied)
        for member in seeds:
            if member.seed + runs > MOST_SEED:
                fail(self.root.file, member.line, f"seeds.{member.path}",
                     f"expected a seed that can count up {runs} times, got {member.seed}")
        measures, own_measures = self._read_measures()
        return Campaign(
            file=self.root.file, text=self.data.decode(), name=self._read_name(), base=self.base,
            base_text=self.base_data.decode(), runs=runs, varied=tuple(varied),
            measures=measures, own_measures=own_measures,
            keep=self._read_keep(), certify=self._read_certify(runs),
            seeds=tuple(member.path for member in seeds), period_s=self._read_period(),
            sha256=self._calc_hash(own_measures))

    def _read_path(self, place: Place) -> Path:
        return self.folder / place.read_text("the path of a file")

    def _read_name(self) -> str:
        if "name" not in self.values:
            return self.root.file.stem
        place = self.values["name"]
        name = str(place.find_scalar() if place.find_scalar() is not None else "")
        if not NAME.fullmatch(name):
            place.fail_expected("1 to 64 of A-Z a-z 0-9 _ . -, not beginning with . or -")
        return name

    def _read_period(self) -> float | None:
        if "period_s" not in self.values:
            return None
        place = self.values["period_s"]
        period_s = place.read_number("a time in s")
        if not period_s > 0:
            place.fail_expected("> 0")
        return float(period_s)

    def _calc_hash(self, own_measures: tuple[OwnMeasure, ...]) -> str:
        parts = [self.data, self.base_data]
        for own in own_measures:
            parts.append(read_bytes(own.file, "a Python file", MOST_BYTES))
        digest = hashlib.sha256(b"sls campaign 1")
        for part in parts:
            digest.update(len(part).to_bytes(8, "little") + part)
        return digest.hexdigest()

    # --- runs ------------------------------------------------------------------------------------

    def _read_runs(self, varied: list[Varied]) -> int:
        sizes = [len(member.items) for member in varied if member.is_crossed]
        points = math.prod(sizes)
        if points > MOST_RUNS:
            self.values["vary"].fail(
                f"expected at most {MOST_RUNS} combinations of grids and lists, got {points} ("
                + " x ".join(map(str, sizes)) + ")")
        if not any(member.is_drawn for member in varied):
            if "runs" in self.values:
                self.values["runs"].fail(
                    f"expected no such key: grids and lists alone make {points} runs; got "
                    f"{self.values['runs'].brief}")
            return points
        place = self.root.require(self.values, "runs", "how many runs the campaign has")
        runs = place.read_whole(1, MOST_RUNS)
        if runs < points:
            place.fail(f"expected at least {points}, each combination of grids and lists once, got "
                       f"{runs}")
        return runs

    # --- vary ------------------------------------------------------------------------------------

    def _read_vary(self, place: Place) -> list[Varied]:
        values = place.read_map("a map of scenario keys")
        varied = []
        for path, value in values.items():
            if not PATH.fullmatch(path):
                value.fail("expected a key of the scenario, such as vehicle.load_mass_kg or "
                           f"faults.0.delay.by_s, or a name that begins with _; got "
                           f"'{to_printable(path)}'")
            for other in varied:
                if path.startswith(other.path + ".") or other.path.startswith(path + "."):
                    value.fail(f"expected keys that do not hold each other, got {other.path} on "
                               f"line {other.line} too")
            varied.append(self._read_varied(path, value))
        return self._resolve_names(varied, values)

    def _read_varied(self, path: str, place: Place) -> Varied:
        values = place.read_map("a map such as { uniform: [1, 2], seed: 1 }",
                                (*KINDS, *DRAW_OPTIONS))
        kind = place.find_one(values, KINDS)
        for key in values:
            if key != kind and key not in OPTIONS.get(kind, DRAW_OPTIONS):
                values[key].fail(f"expected no such key beside {kind}, got {values[key].brief}")
        key = {"path": path, "line": place.line, "kind": kind}
        if kind == "grid":
            return Varied(**key, items=_read_grid(values[kind]))
        if kind == "list":
            return Varied(**key, items=_read_list(values[kind]))
        multiple_of = None
        if "multiple_of" in values:
            multiple_of = values["multiple_of"].read_number()
            if not multiple_of > 0:
                values["multiple_of"].fail_expected("> 0")
        if kind == "derived":
            return Varied(**key, expressions=_read_expressions(values[kind]),
                          multiple_of=multiple_of)
        distribution, parameters = _read_distribution(kind, values[kind])
        seed = values["seed"].read_whole(0, MOST_SEED) if "seed" in values else 0
        within = None
        if "within" in values:
            if distribution != "normal":
                values["within"].fail(f"expected no such key beside {distribution}, got "
                                      f"{values['within'].brief}")
            within = _read_bounds(values["within"])
        return Varied(**key, distribution=distribution, parameters=parameters, seed=seed,
                      multiple_of=multiple_of, within=within)

    def _resolve_names(self, varied: list[Varied], places: dict[str, Place]) -> list[Varied]:
        """Adds the numbers of the base scenario that derived values name, as their `constants`."""
        members = {member.path: member for member in varied}
        resolved = []
        for member in varied:
            constants: dict[str, float] = {}
            place = places[member.path]
            for expression in list_expressions(member):
                for name in expression.names:
                    if name in members:
                        self._check_is_number(members[name], name, place)
                    else:
                        constants[name] = self._read_base_number(name, expression, place)
            resolved.append(Varied(**{**vars(member), "constants": tuple(constants.items())}))
        try:
            order_derived(resolved)
        except ExpressionError as error:
            cycle = str(error).split("got ")[1].split(" -> ")[0]
            places[cycle].fail(str(error))
        return resolved

    def _check_is_number(self, member: Varied, name: str, place: Place) -> None:
        for item in member.items:
            if isinstance(item, bool) or not isinstance(item, int | float):
                place.fail(f"expected numbers of {name}, got a list with {_to_brief(item)}")
        if isinstance(member.expressions, list):
            place.fail(f"expected a number of {name}, got a list of {len(member.expressions)}")

    def _read_base_number(self, name: str, expression: Expression, place: Place) -> float:
        found = None if name.startswith("_") else self.base_root.find(name)
        value = found.find_scalar() if found else None
        if isinstance(value, bool) or not isinstance(value, int | float):
            place.fail(f"unknown name '{to_printable(name)}' in "
                       f"'{to_printable(expression.text)}'; expected a key under vary, or one that "
                       f"stands with a number in {self.base.name}")
        return float(value)

    # --- seeds -----------------------------------------------------------------------------------

    def _read_seeds(self, paths: list[str]) -> list[Varied]:
        if "seeds" not in self.values:
            return []
        place = self.values["seeds"]
        if not place.is_list:
            place.fail_expected("a list of keys, such as [faults.0.noise.seed]")
        seeds: list[Varied] = []
        for item in place.list_items():
            path = item.read_text("a key such as faults.0.noise.seed")
            if not PATH.fullmatch(path) or path.startswith("_"):
                item.fail_expected("a key such as faults.0.noise.seed")
            if path in paths:
                item.fail(f"expected a key that is not under vary too, got {path}")
            if any(seed.path == path for seed in seeds):
                item.fail(f"expected each key once, got {path} twice")
            found = self.base_root.find(path)
            start = found.read_whole(0, MOST_SEED) if found else 0
            seeds.append(Varied(path, "seed", item.line, seed=start))
        return seeds

    # --- measure, keep, certify ------------------------------------------------------------------

    def _read_measures(self) -> tuple[tuple[str, ...], tuple[OwnMeasure, ...]]:
        if "measure" not in self.values:
            return DEFAULT_MEASURES, ()
        place = self.values["measure"]
        names: list[str] = []
        own_measures: list[OwnMeasure] = []
        for item in place.read_list("a list of measures"):
            if item.is_map:
                own_measures.append(self._read_own_measure(item, own_measures))
                continue
            name = item.read_text("a measure, or a map with python, function and columns")
            if name not in MEASURES:
                item.fail_expected(f"one of {', '.join(MEASURES)} or {PYTHON_MEASURE}")
            if name in names:
                item.fail(f"expected each measure once, got {name} twice")
            names.append(name)
        return tuple(name for name in names if name != "outcome"), tuple(own_measures)

    def _read_own_measure(self, place: Place, others: list[OwnMeasure]) -> OwnMeasure:
        values = place.read_map(known=("python", "function", "columns"))
        file_place = place.require(values, "python", "a Python file")
        file = self._read_path(file_place)
        if not file.is_file():
            file_place.fail_expected("a Python file")
        function_place = place.require(values, "function", "the name of a function")
        function = function_place.read_text("the name of a function")
        if not function.isidentifier():
            function_place.fail_expected("the name of a function")
        columns: list[str] = []
        taken = {column for other in others for column in other.columns}
        expected = "a list of columns of runs.csv"
        for item in place.require(values, "columns", expected).read_list(expected):
            column = item.read_text("a column of a-z 0-9 _")
            if not COLUMN.fullmatch(column):
                item.fail_expected("1 to 64 of a-z 0-9 _, beginning with a letter")
            is_ours = column in FIXED_COLUMNS or column.startswith(("stage_", *MEASURES))
            if is_ours or column in taken:
                item.fail(f"expected a column that no other measure has, got {column}")
            taken.add(column)
            columns.append(column)
        return OwnMeasure(file, function, tuple(columns), place.line)

    def _read_keep(self) -> Keep:
        if "keep" not in self.values:
            return Keep()
        place = self.values["keep"]
        if not place.is_map:
            kind = place.find_scalar()
            if kind not in ("none", "failed", "all"):
                place.fail_expected("none, failed, all or { worst: N, by: COLUMN }")
            return Keep(kind)
        values = place.read_map(known=("worst", "by"))
        count = place.require(values, "worst", "how many runs").read_whole(1, MOST_RUNS)
        by_place = place.require(values, "by", "a measure")
        return Keep("worst", count, by_place.read_text("a measure"), by_place.line)

    def _read_certify(self, runs: int) -> Certify:
        if "certify" not in self.values:
            return Certify()
        place = self.values["certify"]
        seed = 0
        if place.is_map:
            values = place.read_map(known=("some", "seed"))
            if "seed" in values:
                seed = values["seed"].read_whole(0, MOST_SEED)
            place = place.require(values, "some", "how many runs")
        elif place.find_scalar() in ("all", "none"):
            return Certify(place.find_scalar())
        elif not isinstance(place.find_scalar(), int) or isinstance(place.find_scalar(), bool):
            place.fail_expected("all, none, a number of runs or { some: N, seed: S }")
        return Certify("some", place.read_whole(1, runs), seed)


# --- Values of one varied key --------------------------------------------------------------------

def _read_grid(place: Place) -> tuple[int | float, ...]:
    """Evenly spaced numbers, each rounded once from the exact decimal."""
    is_log = False
    if place.is_map:
        values = place.read_map(known=("from", "to", "values", "log"))
        parts = [place.require(values, key, "a number") for key in ("from", "to", "values")]
        if "log" in values:
            is_log = values["log"].find_scalar()
            if not isinstance(is_log, bool):
                values["log"].fail_expected("true or false")
    else:
        parts = place.read_list("[from, to, how many values] or { from, to, values }", 3)
    start, end = parts[0].read_number(), parts[1].read_number()
    count = parts[2].read_whole(1, MOST_ITEMS)
    if count == 1 and start != end:
        parts[2].fail(f"expected at least 2 values from {start} to {end}, got 1")
    if count > 1 and start == end:
        parts[1].fail(f"expected another end than {start}, got {end}")
    if is_log:
        if not (start > 0 and end > 0):
            place.fail(f"expected ends > 0 of a logarithmic grid, got {start} and {end}")
        ratio = log(end / start)
        inner = [start * exp(ratio * i / (count - 1)) for i in range(1, count - 1)]
        return (float(start), *inner, float(end))[:count]
    first, last = to_fraction(start), to_fraction(end)
    exact = [first + (last - first) * Fraction(i, max(count - 1, 1)) for i in range(count)]
    are_whole = isinstance(start, int) and isinstance(end, int) and all(
        number.denominator == 1 for number in exact)
    return tuple(int(number) if are_whole else float(number) for number in exact)


def _read_list(place: Place) -> tuple[Any, ...]:
    items = place.read_list("a list of values")
    if len(items) > MOST_ITEMS:
        place.fail_expected(f"at most {MOST_ITEMS} values")
    return tuple(item.read_value() for item in items)


def _read_bounds(place: Place) -> tuple[float, float]:
    least, most = (float(item.read_number()) for item in place.read_list("[least, most]", 2))
    if not least < most:
        place.fail(f"expected the lower bound first, got [{least!r}, {most!r}]")
    return least, most


def _read_distribution(kind: str, place: Place) -> tuple[str, tuple[float, float]]:
    """The distribution's name and its two parameters. `sobol` and `latin_hypercube` take bounds, or a
    map with one distribution."""
    if kind in SPREADS and place.is_map:
        values = place.read_map(known=DISTRIBUTIONS)
        if len(values) != 1:
            place.fail(f"expected exactly one of {', '.join(DISTRIBUTIONS)}, got {len(values)}")
        (kind, place), = values.items()
    elif kind in SPREADS:
        kind = "uniform"
    if kind == "normal":
        mean, deviation = (float(item.read_number()) for item in place.read_list("[mean, standard deviation]", 2))
        if not deviation > 0:
            place.list_items()[1].fail_expected("> 0")
        return kind, (mean, deviation)
    bounds = _read_bounds(place)
    if kind == "log_uniform" and not bounds[0] > 0:
        place.list_items()[0].fail_expected("> 0")
    return kind, bounds


def _read_expressions(place: Place) -> Any:
    if place.is_list:
        return [_read_expressions(item) for item in place.read_list("an expression, or a list of them")]
    value = place.find_scalar()
    if value is None or isinstance(value, bool):
        place.fail_expected("an expression such as \"vehicle.load_mass_kg * 1.1\"")
    try:
        return Expression(str(place.node.value))
    except ExpressionError as error:
        place.fail(str(error))


def _to_brief(value: Any) -> str:
    return f"'{to_printable(value)}'" if isinstance(value, str) else to_printable(str(value))
