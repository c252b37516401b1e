"""Pairs of runs: runs of two campaigns with equal index, or runs of one campaign that differ in only
one key. Tables show the differences of their outcomes and measures."""

import numpy as np

from sls.campaign.drawing import format_number
from sls.campaign.run_table import OUTCOMES, RunTable
from sls.campaign.statistics import (calc_mcnemar_p, calc_paired_difference, calc_quantiles,
                                     calc_wilson_interval)

Places = np.ndarray  # places of runs in their table, (pairs,)


def describe_interval(count: int, total: int) -> str:
    """Wilson's interval, in percent."""
    low, high = calc_wilson_interval(count, total)
    return f"{100 * low:.2f} % to {100 * high:.2f} %"


def find_pairs(table: RunTable, key: str) -> tuple[list[str], Places, Places] | None:
    """Pairs of runs that differ only in `key`, which must have exactly two values. Returns the values as
    text, the runs with the first value and those with the second. None if the key has another number of
    values, or if fewer than half of the runs form pairs."""
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
    return list(names), firsts[whole][order], seconds[whole][order]


def count_changes(a: RunTable, b: RunTable, in_a: Places, in_b: Places) -> np.ndarray:
    """Number of pairs with each outcome in `a` (rows) and in `b` (columns), in the order of OUTCOMES."""
    counts = np.zeros((len(OUTCOMES), len(OUTCOMES)), dtype=int)
    np.add.at(counts, (a.outcome[in_a], b.outcome[in_b]), 1)
    return counts


def make_outcome_rows(counts: np.ndarray, name_a: str, name_b: str) -> list[list[str]]:
    """Header and rows of a table of `count_changes`."""
    total = int(counts.sum())
    header = [f"{name_a} \\ {name_b}", *OUTCOMES, f"share of {name_a}", "95 % interval"]
    rows = [[name, *map(str, counts[place]), f"{100 * counts[place].sum() / total:.2f} %",
             describe_interval(int(counts[place].sum()), total)]
            for place, name in enumerate(OUTCOMES)]
    shares = [f"{100 * count / total:.2f} %" for count in counts.sum(axis=0)]
    return [header, *rows, [f"share of {name_b}", *shares, "", ""]]


def describe_changes(counts: np.ndarray, name_a: str, name_b: str) -> str:
    only_a, only_b = int(counts[0, 1:].sum()), int(counts[1:, 0].sum())
    return (f"{only_a} finish with {name_a} alone, {only_b} with {name_b} alone: "
            f"McNemar's exact p = {calc_mcnemar_p(only_a, only_b):.3g}")


def find_finished(a: RunTable, b: RunTable, in_a: Places, in_b: Places) -> np.ndarray:
    """True for each pair whose runs both finished."""
    return a.is_outcome("finished")[in_a] & b.is_outcome("finished")[in_b]


def make_measure_rows(a: RunTable, b: RunTable, in_a: Places, in_b: Places, name_a: str,
                      name_b: str) -> list[list[str]]:
    """Header, and a row for each measure of both tables. Only pairs whose runs both finished count."""
    both = find_finished(a, b, in_a, in_b)
    rows = [["measure", "pairs", f"median {name_a}", f"median {name_b}",
             f"median {name_b} − {name_a}", "95 % interval", f"{name_b} less", f"{name_b} more",
             "p (sign test)"]]
    for name in a.measures:
        if name not in b.measures:
            continue
        values_a, values_b = a.numbers[name][in_a][both], b.numbers[name][in_b][both]
        paired = calc_paired_difference(values_a, values_b)
        if paired.count:
            medians = [calc_quantiles(values, (0.5,))[0] for values in (values_a, values_b)]
            rows.append([name, str(paired.count), *map(format_number, medians),
                         format_number(paired.median),
                         f"{format_number(paired.low)} to {format_number(paired.high)}",
                         str(paired.smaller), str(paired.larger), f"{paired.p:.3g}"])
    return rows
