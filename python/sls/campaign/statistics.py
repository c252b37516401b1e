"""The statistics of a campaign: shares, distributions and paired differences. README.md, "Statistics".

Intervals come from formulas, not from random numbers: the same runs give the same page."""

from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

LEVEL = 0.95


def calc_wilson_interval(count: float, total: float, level: float = LEVEL) -> tuple[float, float]:
    """Low and high end of the interval of the share `count`/`total`, formula 1; (0, 1) without runs."""
    if not 0 <= count <= total:
        raise ValueError(f"count: expected from 0 to {total}, got {count}")
    if total == 0:
        return 0.0, 1.0
    z_2 = NormalDist().inv_cdf((1.0 + level) / 2.0) ** 2
    share = count / total
    centre = share + z_2 / (2 * total)
    spread = (z_2 * (share * (1.0 - share) / total + z_2 / (4.0 * total**2))) ** 0.5
    # The ends 0 and 1 are set exactly, because rounding must not leave the range.
    low = 0.0 if count == 0 else (centre - spread) / (1.0 + z_2 / total)
    high = 1.0 if count == total else (centre + spread) / (1.0 + z_2 / total)
    return low, high


def calc_share_interval(is_counted: np.ndarray, draw: np.ndarray,
                        level: float = LEVEL) -> tuple[float, float]:
    """The interval of the share of `is_counted` (n,) for runs of the draws `draw` (n,): formula 1 if each run
    has its own draw, else formula 2; (0, 1) for one draw of several runs."""
    total, count = len(draw), int(np.sum(is_counted))
    places = np.unique(draw, return_inverse=True)[1]
    runs = np.bincount(places)
    draws = len(runs)
    if draws == total:
        return calc_wilson_interval(count, total, level)
    if draws == 1:
        return 0.0, 1.0
    from scipy.stats import t as student  # half a second, which most campaigns do not need
    share = count / total
    variance = float(np.sum((np.bincount(places, is_counted) - share * runs) ** 2)) / total**2
    upper = (1.0 + level) / 2.0
    factor = (NormalDist().inv_cdf(upper) / student.ppf(upper, draws - 1)) ** 2
    effective = min(total, share * (1.0 - share) / variance * factor) if variance > 0.0 else draws
    return calc_wilson_interval(share * effective, effective, level)


def calc_quantiles(values: np.ndarray, shares: tuple[float, ...]) -> np.ndarray:
    """Quantiles (3), one per share; NaN without values. NaN is left out, infinite values are not."""
    values = np.sort(values[~np.isnan(values)])
    if not len(values):
        return np.full(len(shares), np.nan)
    ranks = np.asarray(shares, dtype=float) * (len(values) - 1)
    low = np.floor(ranks).astype(int)
    high = np.minimum(low + 1, len(values) - 1)
    part = ranks - low
    with np.errstate(invalid="ignore"):  # infinity minus infinity
        between = values[low] + part * (values[high] - values[low])
    return np.where((part == 0.0) | (values[low] == values[high]), values[low], between)


@dataclass(frozen=True)
class PairedDifference:
    """Statistics of b − a, draw by draw, where both are defined."""

    count: int  # of draws
    median: float
    low: float  # low end of the median's interval (4); −inf if there are too few draws for an interval
    high: float
    smaller: int  # number of draws with b < a
    larger: int
    p: float  # of the sign test (5)


def calc_sign_p(one: int, other: int) -> float:
    """p of formulas 5 and 6, if one sign occurs `one` times and the other `other` times; 1 if neither occurs."""
    from scipy.stats import binom
    return float(min(1.0, 2.0 * binom.cdf(min(one, other), one + other, 0.5)))


def calc_paired_difference(a: np.ndarray, b: np.ndarray, draw: np.ndarray | None = None,
                           level: float = LEVEL) -> PairedDifference:
    """Statistics of arrays of equal length; without `draw` each pair counts as a draw. Pairs with a NaN or with
    two equal infinities are left out."""
    with np.errstate(invalid="ignore"):
        differences = np.asarray(b, dtype=float) - np.asarray(a, dtype=float)
    is_defined = ~np.isnan(differences)
    differences = differences[is_defined]
    if draw is not None:
        differences = calc_medians(differences, draw[is_defined])
    differences = np.sort(differences)
    count = len(differences)
    if not count:
        return PairedDifference(0, np.nan, -np.inf, np.inf, 0, 0, 1.0)
    smaller, larger = int(np.sum(differences < 0)), int(np.sum(differences > 0))
    rank = find_interval_rank(count, level)
    low, high = ((differences[rank - 1], differences[count - rank]) if rank
                 else (-np.inf, np.inf))
    return PairedDifference(count, float(calc_quantiles(differences, (0.5,))[0]), float(low),
                            float(high), smaller, larger, calc_sign_p(smaller, larger))


def calc_medians(values: np.ndarray, group: np.ndarray) -> np.ndarray:
    """The median of `values`, without NaN, in each group."""
    order = np.lexsort((values, group))
    values = values[order]
    first, size = np.unique(group[order], return_index=True, return_counts=True)[1:]
    low, high = values[first + (size - 1) // 2], values[first + size // 2]
    return np.where(low == high, low, low / 2 + high / 2)


def find_interval_rank(count: int, level: float = LEVEL) -> int:
    """k of formula 4; 0 if even the smallest and largest difference do not reach this level."""
    from scipy.stats import binom
    tail = (1.0 - level) / 2.0
    # ppf gives the smallest j with P(B ≤ j) ≥ tail. It follows that P(B < j) = P(B ≤ j − 1) < tail.
    rank = int(binom.ppf(tail, count, 0.5))
    while rank > 0 and binom.cdf(rank - 1, count, 0.5) > tail:
        rank -= 1
    return rank
