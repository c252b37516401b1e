"""Pairs of runs: runs of two campaigns with equal index, or runs of one campaign that differ in only
one key. Tables show the differences of their outcomes and measures. Pairs of one draw, flown at several points,
are not independent: a statistic counts draws."""

from dataclasses import dataclass

import numpy as np

from sls.campaign.drawing import format_number
from sls.campaign.run_table import OUTCOMES, RunTable
from sls.campaign.statistics import calc_paired_difference, calc_quantiles, calc_share_interval, calc_sign_p

NONE = "–"  # of a statistic without draws


@dataclass(frozen=True)
class Pairs:
    """Pairs of a run in the table `a` and a run in `b`: the places `in_a` and `in_b`, (pairs,)."""

    a: RunTable
    b: RunTable
    in_a: np.ndarray
    in_b: np.ndarray
    name_a: str
    name_b: str

    @property
    def draw(self) -> np.ndarray | None:
        """The draw of each pair, (pairs,); None if nothing is drawn, or if the runs of pairs have others."""
        if self.a.draw is None or self.b.draw is None:
            return None
        draws = self.a.draw[self.in_a]
        return draws if np.array_equal(draws, self.b.draw[self.in_b]) else None

    def find_finished(self) -> np.ndarray:
        """True for each pair whose runs both finished."""
        return self.a.is_outcome("finished")[self.in_a] & self.b.is_outcome("finished")[self.in_b]


def describe_interval(is_counted: np.ndarray, draw: np.ndarray | None) -> str:
    """The interval of the share of `is_counted`, in percent."""
    if draw is None:
        return NONE
    low, high = calc_share_interval(is_counted, draw)
    return f"{100 * low:.2f} % to {100 * high:.2f} %"


def find_pairs(table: RunTable, key: str) -> Pairs | None:
    """Pairs of runs that differ only in `key`, named by its two values. None if the key has another number of values,
    or if fewer than half of the runs form pairs."""
    if key in table.words:
        names, side = table.words[key]
    else:
        values, side = np.unique(table.numbers[key], return_inverse=True)
        names = [format_number(value) for value in values]
    if len(names) != 2 or len(table.keys) < 2:
        return None
    group = np.zeros(len(table), dtype=np.int64)
    for other in table.keys:
        if other != key:
            values = table.words[other][1] if other in table.words else table.numbers[other]
            place = np.unique(values, return_inverse=True)[1]
            group = np.unique(group * (int(place.max()) + 1) + place, return_inverse=True)[1]
    firsts, seconds = (np.full(int(group.max()) + 1, -1) for _ in range(2))
    counts = [np.bincount(group[side == number], minlength=len(firsts)) for number in (0, 1)]
    firsts[group[side == 0]] = np.flatnonzero(side == 0)
    seconds[group[side == 1]] = np.flatnonzero(side == 1)
    whole = (counts[0] == 1) & (counts[1] == 1)
    if 4 * np.sum(whole) < len(table):
        return None
    order = np.argsort(firsts[whole], kind="stable")
    return Pairs(table, table, firsts[whole][order], seconds[whole][order], *names)


def count_changes(pairs: Pairs) -> np.ndarray:
    """Number of pairs with each outcome in `a` (rows) and in `b` (columns), in the order of OUTCOMES."""
    counts = np.zeros((len(OUTCOMES), len(OUTCOMES)), dtype=int)
    np.add.at(counts, (pairs.a.outcome[pairs.in_a], pairs.b.outcome[pairs.in_b]), 1)
    return counts


def make_outcome_rows(pairs: Pairs) -> list[list[str]]:
    """Header and rows of a table of `count_changes`."""
    counts, outcome, draw = count_changes(pairs), pairs.a.outcome[pairs.in_a], pairs.draw
    total = int(counts.sum())
    header = [f"{pairs.name_a} \\ {pairs.name_b}", *OUTCOMES, f"share of {pairs.name_a}", "95 % interval"]
    rows = [[name, *map(str, counts[place]), f"{100 * counts[place].sum() / total:.2f} %",
             describe_interval(outcome == place, draw)] for place, name in enumerate(OUTCOMES)]
    shares = [f"{100 * count / total:.2f} %" for count in counts.sum(axis=0)]
    return [header, *rows, [f"share of {pairs.name_b}", *shares, "", ""]]


def describe_changes(pairs: Pairs) -> str:
    """Numbers of changed outcomes and, with draws, McNemar's test."""
    change = (pairs.a.is_outcome("finished")[pairs.in_a].astype(int)
              - pairs.b.is_outcome("finished")[pairs.in_b].astype(int))
    text = (f"{np.sum(change > 0)} finish with {pairs.name_a} alone, {np.sum(change < 0)} with "
            f"{pairs.name_b} alone")
    if (draw := pairs.draw) is None:
        return text
    places = np.unique(draw, return_inverse=True)[1]
    changes = np.bincount(places, change)
    p = calc_sign_p(int(np.sum(changes > 0)), int(np.sum(changes < 0)))
    among = f" of {len(changes)} draws" if len(changes) < len(change) else ""
    return f"{text}: McNemar's exact p{among} = {p:.3g}"


def make_measure_rows(pairs: Pairs) -> list[list[str]]:
    """Header, and a row for each measure of both tables. Only pairs whose runs both finished count."""
    both, draw = pairs.find_finished(), pairs.draw
    draw = None if draw is None else draw[both]
    a, b = pairs.name_a, pairs.name_b
    rows = [["measure", "pairs" if draw is None else "draws", f"median {a}", f"median {b}",
             f"median {b} − {a}", "95 % interval", f"{b} less", f"{b} more", "p (sign test)"]]
    for name in pairs.a.measures:
        if name not in pairs.b.measures:
            continue
        values_a = pairs.a.numbers[name][pairs.in_a][both]
        values_b = pairs.b.numbers[name][pairs.in_b][both]
        paired = calc_paired_difference(values_a, values_b, draw)
        if paired.count:
            medians = [calc_quantiles(values, (0.5,))[0] for values in (values_a, values_b)]
            rows.append([name, str(paired.count), *map(format_number, medians),
                         format_number(paired.median),
                         f"{format_number(paired.low)} to {format_number(paired.high)}"
                         if draw is not None else NONE, str(paired.smaller), str(paired.larger),
                         f"{paired.p:.3g}" if draw is not None else NONE])
    return rows
