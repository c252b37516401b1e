"""The values of each run. They depend only on the campaign and the run's index.

The values of run i do not change if other runs are flown, if chunks are different, or if other keys
are varied. The numbers come from Philox, a counter-based generator: it gives the i-th number of a
stream without those before it. A stream is identified by seed and path.

They do not depend on the machine either. Of numpy's generators the raw words alone are promised to stay
(NEP 19); they become numbers with exact operations, which are then transformed one at a time by
`portable_math`. Functions of numpy over an array round differently at the array's end and with other
processors."""

import hashlib
import warnings
from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np

from sls.campaign.campaign import Campaign, Varied
from sls.campaign.expressions import Expression, ExpressionError
from sls.campaign.portable_math import calc_normal_cdf, calc_normal_quantile, exp, log
from sls.input_error import InputError

SOBOL_BITS = 30
# The sum of a stratum's number (below 2^24) and a jitter with so many bits is exact.
JITTER_BITS = 28


def make_values(campaign: Campaign, first: int, last: int) -> list[list[Any]]:
    """The values of runs `first` to `last` inclusive, for each run in the order of
    `campaign.varied`.

    Raises InputError, which names the run, if a derived value is not a number."""
    if not 0 <= first <= last < campaign.runs:
        raise InputError(f"{campaign.file}: expected runs within 0 to {campaign.runs - 1}, got "
                         f"{first} to {last}")
    points = campaign.points
    first_draw, last_draw = first // points, last // points
    columns: dict[str, list[Any]] = {}
    stride = points  # the last crossed key changes with every run
    for varied in campaign.varied:
        if varied.is_crossed:
            stride //= len(varied.items)
            columns[varied.path] = [varied.items[run // stride % len(varied.items)]
                                    for run in range(first, last + 1)]
        elif varied.is_drawn:
            drawn = _draw(campaign, varied, first_draw, last_draw)
            columns[varied.path] = [drawn[run // points - first_draw]
                                    for run in range(first, last + 1)]
    for varied in order_derived(campaign.varied):
        columns[varied.path] = _derive(campaign, varied, columns, first, last)
    return [list(row) for row in zip(*(columns[path] for path in campaign.paths), strict=True)]


def choose_runs(runs: int, count: int, seed: int, purpose: str = "certify") -> list[int]:
    """Chooses `count` of the runs 0 to `runs` - 1 by `seed`: ascending, without repetition. Another
    `purpose` gives another choice."""
    return sorted(_make_permutation(_make_key(purpose, seed, ""), runs)[:count].tolist())


def is_certified(campaign: Campaign, run: int) -> bool:
    """True if this run gets a certificate."""
    certify = campaign.certify
    if certify.kind != "some":
        return certify.kind == "all"
    return run in _choose_certified(campaign.runs, certify.count, certify.seed)


@lru_cache(maxsize=4)
def _choose_certified(runs: int, count: int, seed: int) -> frozenset[int]:
    return frozenset(choose_runs(runs, count, seed))


# --- Streams of random bits ----------------------------------------------------------------------

def _make_key(purpose: str, seed: int, path: str) -> tuple[int, int]:
    """The key of a stream, 128 bits. Streams with equal seed and path differ if their purpose differs."""
    digest = hashlib.sha256(f"sls campaign 1\0{purpose}\0{seed}\0{path}".encode()).digest()
    return int.from_bytes(digest[:8], "little"), int.from_bytes(digest[8:16], "little")


def _draw_words(key: tuple[int, int], first: int, count: int) -> np.ndarray:
    """`count` words of the stream from word `first` on, 64 bits each. Each value of the generator's
    counter gives four words."""
    generator = np.random.Philox(key=np.array(key, dtype=np.uint64), counter=first // 4)
    return generator.random_raw(first % 4 + count)[first % 4:]


def _draw_unit(key: tuple[int, int], first: int, count: int) -> np.ndarray:
    """Numbers in (0, 1) without both ends: the middles of 2^52 equal intervals."""
    return ((_draw_words(key, first, count) >> np.uint64(12)) + 0.5) * 2.0**-52


@lru_cache(maxsize=32)
def _make_permutation(key: tuple[int, int], size: int) -> np.ndarray:
    """A permutation of 0 … size - 1."""
    order = np.argsort(_draw_words(key, 0, size), kind="stable").astype(np.int32)
    order.setflags(write=False)
    return order


# --- Drawn values ----------------------------------------------------------------------------

def _draw(campaign: Campaign, varied: Varied, first: int, last: int) -> list[Any]:
    """The values of draws `first` to `last`."""
    count = last - first + 1
    if varied.kind == "seed":
        return [varied.seed + draw for draw in range(first, last + 1)]
    if varied.kind == "sobol":
        unit = _draw_sobol(campaign, varied, first, count)
    elif varied.kind == "latin_hypercube":
        unit = _draw_latin(varied, first, count, campaign.draws)
    else:
        unit = _draw_unit(_make_key("unit", varied.seed, varied.path), first, count)
    return [_round(varied, _transform(varied, u)) for u in unit.tolist()]


def _draw_latin(varied: Varied, first: int, count: int, draws: int) -> np.ndarray:
    """Divides (0, 1) into as many equal intervals as there are draws; each draw lies in another one."""
    strata = _make_permutation(_make_key("strata", varied.seed, varied.path), draws)
    words = _draw_words(_make_key("jitter", varied.seed, varied.path), first, count)
    jitter = ((words >> np.uint64(64 - JITTER_BITS)) + 0.5) * 2.0**-JITTER_BITS
    return (strata[first:first + count] + jitter) / draws


def _draw_sobol(campaign: Campaign, varied: Varied, first: int, count: int) -> np.ndarray:
    """One coordinate of Sobol's sequence with a digital shift: the same bits are flipped in all points,
    which keeps the balance of the sequence. All sobol keys with one seed are coordinates of one sequence."""
    try:
        from scipy.stats import qmc
    except ImportError:
        raise InputError(f"{campaign.file}:{varied.line}: vary.{varied.path}.sobol: expected scipy "
                         "(apt-get install python3-scipy), got none") from None
    same = [other.path for other in campaign.varied
            if other.kind == "sobol" and other.seed == varied.seed]
    coordinate = same.index(varied.path)
    sequence = qmc.Sobol(coordinate + 1, scramble=False, bits=SOBOL_BITS)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # warnings that the number of points is not a power of 2
        if first:
            sequence.fast_forward(first)
        points = sequence.random(count)[:, coordinate]
    shift = _draw_words(_make_key("shift", varied.seed, varied.path), 0, 1)[0] >> np.uint64(
        64 - SOBOL_BITS)
    digits = (points * 2.0**SOBOL_BITS).astype(np.uint64) ^ shift
    return (digits + 0.5) * 2.0**-SOBOL_BITS


def _transform(varied: Varied, u: float) -> float:
    """Transforms a number in (0, 1) by the distribution's inverse cumulative distribution function."""
    a, b = varied.parameters
    if varied.distribution == "normal":
        if varied.within is None:
            return a + b * calc_normal_quantile(u)
        low, high = varied.within
        return min(max(a + b * _cut_normal((low - a) / b, (high - a) / b, u), low), high)
    if varied.distribution == "log_uniform":
        value = exp(log(a) + u * (log(b) - log(a)))
    else:
        value = a + u * (b - a)
    return min(max(value, a), b)


def _cut_normal(low: float, high: float, u: float) -> float:
    """Inverse, at `u`, of the standard normal distribution limited to `low` … `high`."""
    if low > 0:  # the lower tail is more exact: a double can hold 1e-19, but 1 - 1e-19 is rounded to 1
        return -_cut_normal(-high, -low, 1 - u)
    below, above = calc_normal_cdf(low), calc_normal_cdf(high)
    probability = below + u * (above - below)
    # If both bounds are far out, the probability may round to 0 or 1. The caller then applies its bounds.
    return calc_normal_quantile(min(max(probability, 1e-300), 1 - 2.0**-53))


def _round(varied: Varied, value: float) -> int | float:
    """Rounds to the nearest multiple of `multiple_of`, if the campaign has it."""
    unit = varied.multiple_of
    if unit is None:
        return value
    exact = round(Fraction(value) / to_fraction(unit)) * to_fraction(unit)
    return int(exact) if isinstance(unit, int) else float(exact)


def to_fraction(number: int | float) -> Fraction:
    """The exact value of the decimal number as written: 1/10 for 0.1."""
    return Fraction(repr(number))


# --- Derived values --------------------------------------------------------------------------

def list_expressions(varied: Varied) -> list[Expression]:
    """All expressions of a derived value, also those in lists."""
    def flatten(part: Any) -> list[Expression]:
        return [part] if isinstance(part, Expression) else [
            expression for item in part for expression in flatten(item)]
    return flatten(varied.expressions) if varied.kind == "derived" else []


def order_derived(varied: Sequence[Varied]) -> list[Varied]:
    """The derived values in an order in which each comes after those that it uses.

    Raises ExpressionError, which names the cycle, if there is a cycle."""
    derived = {member.path: member for member in varied if member.kind == "derived"}
    ordered: dict[str, Varied] = {}

    def visit(path: str, on_the_way: list[str]) -> None:
        if path in on_the_way:
            cycle = [*on_the_way[on_the_way.index(path):], path]
            raise ExpressionError("expected no cycle, got " + " -> ".join(cycle))
        if path in ordered or path not in derived:
            return
        for expression in list_expressions(derived[path]):
            for name in expression.names:
                visit(name, [*on_the_way, path])
        ordered[path] = derived[path]

    for path in derived:
        visit(path, [])
    return list(ordered.values())


def _derive(campaign: Campaign, varied: Varied, columns: dict[str, list[Any]], first: int,
            last: int) -> list[Any]:
    def evaluate(part: Any, values: dict[str, Any]) -> Any:
        if isinstance(part, Expression):
            return _round(varied, part.evaluate(values))
        return [evaluate(item, values) for item in part]

    constants = dict(varied.constants)
    names = {name for expression in list_expressions(varied) for name in expression.names}
    names -= constants.keys()
    result = []
    for row in range(last - first + 1):
        values = constants | {name: columns[name][row] for name in names}
        try:
            result.append(evaluate(varied.expressions, values))
        except ExpressionError as error:
            raise InputError(f"{campaign.file}:{varied.line}: vary.{varied.path}: run "
                             f"{first + row}: {error}") from None
    return result
