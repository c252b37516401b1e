"""Compares two campaigns: `./sls campaign compare A B`.

Both must have flown the same values of the same keys. The base scenario (another law, other gains),
the version and the machine may differ. Runs of the same index form pairs."""

import filecmp
from pathlib import Path
from typing import Any

import numpy as np

from sls.campaign.drawing import format_number
from sls.campaign.folder import read_manifest
from sls.campaign.pairs import Pairs, describe_changes, make_measure_rows, make_outcome_rows
from sls.campaign.report import flatten
from sls.campaign.run_table import OUTCOMES, RunTable, find_rows, read_runs, to_word
from sls.input_error import InputError

MOST_FACTS = 20
MOST_RUNS = 10


def compare(a: Path, b: Path) -> str:
    """The comparison as text. Raises InputError if a folder is not a campaign with results, or if the
    campaigns varied different keys or flew different values; the error names the first difference."""
    lines = [f"A: {a}", f"B: {b}", ""]
    lines += compare_manifests(read_manifest(a / "manifest.json"),
                               read_manifest(b / "manifest.json"))
    files = a / "runs.csv", b / "runs.csv"
    for file in files:
        if not file.is_file():
            raise InputError(f"{file}: expected the table of a campaign, got: no such file "
                             "(./sls campaign status says what is missing)")
    if filecmp.cmp(*files, shallow=False):
        count = len(read_runs(files[0]))
        return "\n".join([*lines, f"runs.csv: the same bytes, {count} runs", ""])
    tables = [read_runs(file) for file in files]
    check_keys(*tables)
    places = match_runs(*tables)
    check_values(*tables, *places)
    lines += describe_runs(*tables, len(places[0]))
    pairs = Pairs(*tables, *places, "A", "B")
    lines += ["", "outcomes", *make_text_table(make_outcome_rows(pairs)), f"  {describe_changes(pairs)}"]
    lines += compare_measures(pairs)
    lines += list_most_different(pairs)
    return "\n".join([*lines, ""])


def compare_manifests(a: dict[str, Any], b: dict[str, Any]) -> list[str]:
    facts_a, facts_b = dict(flatten(a)), dict(flatten(b))
    names = [*facts_a, *(name for name in facts_b if name not in facts_a)]
    different = [name for name in names if facts_a.get(name) != facts_b.get(name)]
    if not different:
        return ["manifest.json: the same facts", ""]
    lines = [f"manifest.json: {len(different)} facts differ"]
    lines += [f"  {name}: {facts_a.get(name, '–')} | {facts_b.get(name, '–')}"
              for name in different[:MOST_FACTS]]
    if len(different) > MOST_FACTS:
        lines.append(f"  and {len(different) - MOST_FACTS} more")
    return [*lines, ""]


# --- checks of equal keys and values --------------------------------------------------------------


def check_keys(a: RunTable, b: RunTable) -> None:
    for place in range(max(len(a.keys), len(b.keys))):
        keys = [table.keys[place] if place < len(table.keys) else "no such key"
                for table in (a, b)]
        if keys[0] != keys[1]:
            raise InputError(f"{b.file}: varied key {place + 1}: expected '{keys[0]}' as in "
                             f"{a.file}, got '{keys[1]}'")


def match_runs(a: RunTable, b: RunTable) -> tuple[np.ndarray, np.ndarray]:
    """Places in both tables of the runs that both have."""
    common, in_a, in_b = np.intersect1d(a.run, b.run, return_indices=True)
    if not len(common):
        raise InputError(f"{b.file}: expected runs that {a.file} has, too, got none")
    return in_a, in_b


def check_values(a: RunTable, b: RunTable, in_a: np.ndarray, in_b: np.ndarray) -> None:
    first, first_key = len(in_a), ""
    for key in a.keys:
        values = [read_values(table, key)[places] for table, places in ((a, in_a), (b, in_b))]
        if values[0].dtype != values[1].dtype:
            # One column has text, the other only numbers: compare the numbers as text, in the form that
            # `read_runs` gives numbers in a column with text.
            values = [value if value.dtype == object
                      else np.array([to_word(float(number)) for number in value], dtype=object)
                      for value in values]
        different = np.flatnonzero(values[0] != values[1])
        if len(different) and different[0] < first:
            first, first_key = int(different[0]), key
    if first_key:
        run = int(a.run[in_a[first]])
        cells = [find_rows(table.file, [run])[run][first_key] for table in (a, b)]
        raise InputError(f"{b.file}: run {run}: {first_key}: expected {cells[0]} as in {a.file}, "
                         f"got {cells[1]}: campaigns of other values cannot be compared run by run")


def read_values(table: RunTable, key: str) -> np.ndarray:
    if key in table.numbers:
        return table.numbers[key]
    words, places = table.words[key]
    return np.array(words, dtype=object)[places]


# --- differences ----------------------------------------------------------------------------------


def describe_runs(a: RunTable, b: RunTable, common: int) -> list[str]:
    lines = [f"runs.csv: {common} runs in both"]
    for name, table in (("A", a), ("B", b)):
        if len(table) > common:
            lines.append(f"  {len(table) - common} runs only in {name}")
    only = [*(f"{name} (A)" for name in a.measures if name not in b.measures),
            *(f"{name} (B)" for name in b.measures if name not in a.measures)]
    if only:
        lines.append(f"  measured only in one: {', '.join(only)}")
    return lines


def compare_measures(pairs: Pairs) -> list[str]:
    rows = make_measure_rows(pairs)
    if len(rows) == 1:
        return []
    count = int(pairs.find_finished().sum())
    return ["", f"measures, of the {count} runs that finish in both", *make_text_table(rows)]


def list_most_different(pairs: Pairs) -> list[str]:
    """First the runs with another outcome, then the runs that differ most in one measure of both: the
    load error's rms or maximum, or else the first common measure."""
    a, b, in_a, in_b = pairs.a, pairs.b, pairs.in_a, pairs.in_b
    changed = np.flatnonzero(a.outcome[in_a] != b.outcome[in_b])[:MOST_RUNS]
    lines = []
    if len(changed):
        rows = [[str(a.run[in_a[pair]]), OUTCOMES[a.outcome[in_a[pair]]],
                 OUTCOMES[b.outcome[in_b[pair]]], describe_values(a, in_a[pair])]
                for pair in changed]
        lines += ["", f"runs with another outcome (the first {len(changed)})",
                  *make_text_table([["run", "A", "B", "values"], *rows])]
    names = [name for name in a.measures if name in b.measures]
    name = next((name for name in ("load_error_rms_m", "load_error_max_m") if name in names),
                names[0] if names else None)
    if name is not None:
        with np.errstate(invalid="ignore"):
            size = np.abs(b.numbers[name][in_b] - a.numbers[name][in_a])
        size[~pairs.find_finished() | ~np.isfinite(size)] = 0.0
        order = np.argsort(-size, kind="stable")[:MOST_RUNS]
        rows = [[str(a.run[in_a[pair]]), format_number(float(a.numbers[name][in_a[pair]])),
                 format_number(float(b.numbers[name][in_b[pair]])), describe_values(a, in_a[pair])]
                for pair in order if size[pair] > 0.0]
        if rows:
            lines += ["", f"runs that differ most in {name}",
                      *make_text_table([["run", "A", "B", "values"], *rows])]
    return lines


def describe_values(table: RunTable, place: int) -> str:
    cells = []
    for key in table.keys:
        value = read_values(table, key)[place]
        cells.append(f"{key} {value if isinstance(value, str) else format_number(float(value))}")
    return ", ".join(cells)


def make_text_table(rows: list[list[str]]) -> list[str]:
    """Pads the columns to equal width. The first and last are aligned to the left, the others to the right."""
    last = len(rows[0]) - 1
    widths = [max(len(row[place]) for row in rows) for place in range(last + 1)]
    lines = []
    for row in rows:
        cells = [cell.ljust(width) if place in (0, last) else cell.rjust(width)
                 for place, (cell, width) in enumerate(zip(row, widths))]
        lines.append(("  " + "  ".join(cells)).rstrip())
    return lines
