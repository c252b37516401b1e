"""One self-contained page about a campaign: report.html.

It uses only runs.csv, campaign.yaml and manifest.json. For this reason it can be made again in any
place of the folder, and equal files give equal bytes. Its size does not grow with the number of runs,
because pictures show bins or samples."""

import math
import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from sls.campaign import drawing
from sls.campaign.drawing import OUTCOME_COLOURS, Scale, format_number, format_share, name_unit
from sls.campaign.folder import read_manifest, read_text
from sls.campaign.pairs import (describe_changes, describe_interval, find_pairs, make_measure_rows,
                                make_outcome_rows)
from sls.campaign.run_table import OUTCOMES, RunTable, find_rows, read_runs
from sls.campaign.statistics import calc_medians, calc_quantiles, calc_share_interval
from sls.campaign.yaml_nodes import parse_yaml
from sls.input_error import InputError
from sls.report import escape, join_page, make_fact_list, make_plain_table, make_section

MOST_VALUES = 41  # a key with more values gets bins of equal width instead of one bin per value
BINS = 20
FEW = 8  # so many values are named each
MOST_WORDS = 12  # texts of a drawn key; keys with more are derived lists, whose pictures would be unreadable
MOST_PAIRS = 10  # drawn pairs of varied keys
MOST_LINES = 400  # lines in the picture of parallel coordinates
MOST_COLUMNS = 80  # drawn distributions
MOST_REASONS = 20
WORST = 10
SHARES = (0.05, 0.5, 0.95)
STYLE = """
svg { display: block; width: 100%; height: auto; margin: 0 auto 8px; }
.pair { display: grid; grid-template-columns: repeat(2, 1fr); gap: 8px 20px; }
.pair > * { min-width: 0; }
h3 { font-size: 14px; margin: 14px 0 4px; overflow-wrap: anywhere; }
code { font-size: 12.5px; }
.left td, .left th { text-align: left; }
.left td { white-space: normal; overflow-wrap: anywhere; min-width: 9em; }
.left td:first-child { width: 1%; min-width: 58px; }
.key { display: inline-block; width: 11px; height: 11px; }
@media screen and (max-width: 800px) { .pair { grid-template-columns: minmax(0, 1fr); } }
"""


@dataclass(frozen=True)
class Bins:
    """The classes of a varied key."""

    names: list[str]
    places: np.ndarray  # (n,) class of each run
    scale: Scale | None = None  # of numbers that the classes divide evenly, from end to end


def make_campaign_report(folder: Path) -> str:
    """The page as HTML. Raises InputError."""
    campaign_text = read_text(folder / "campaign.yaml")
    manifest = read_manifest(folder / "manifest.json")
    table = read_runs(folder / "runs.csv")
    name = manifest["campaign"]
    sections = [make_head(name, table)]
    if len(table):
        sections += [
            make_section("Outcomes", make_outcomes(table)),
            make_key_section(table),
            make_pair_section(table),
            *(make_paired_section(table, key) for key in table.keys),
            make_section("Measures", make_measures(table)),
            make_section("All together", make_parallel(table)),
            make_section("Worst runs", make_worst(table, manifest["file"])),
        ]
    sections += [make_section("Campaign", make_fact_list(flatten(manifest))),
                 "<section><details><summary>Campaign file</summary>"
                 f"<pre>{escape(campaign_text)}</pre></details></section>"]
    return join_page(name, sections, "campaign report", STYLE)


# --- classes of a varied key ----------------------------------------------------------------------


def make_bins(table: RunTable, key: str, most_values: int = MOST_VALUES) -> Bins:
    """A class for each value. Many values get classes of equal width, or of equal ratio in a wide range; these have a
    scale, as numbers of equal distance have."""
    if key in table.words:
        words, places = table.words[key]
        names = list(map(name_word, words))
        if len(words) <= most_values:
            return Bins(names, places)
        # Too many words to draw: those after the first ones form one class.
        return Bins([*names[:most_values - 1], "others"],
                    np.minimum(places, most_values - 1))
    values = table.numbers[key]
    unique, places = np.unique(values, return_inverse=True)
    low, high = float(unique[0]), float(unique[-1])
    if len(unique) <= most_values:
        half = (high - low) / 2 / max(1, len(unique) - 1)
        is_even = len(unique) > FEW and np.allclose(np.diff(unique), 2 * half)
        return Bins([format_number(value) for value in unique], places,
                    Scale(low - half, high + half, 0, 1) if is_even else None)
    is_log = drawing.deserves_log(unique)
    edges = (np.geomspace if is_log else np.linspace)(low, high, BINS + 1)
    places = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, BINS - 1)
    names = [f"{format_number(a)} to {format_number(b)}" for a, b in zip(edges, edges[1:])]
    return Bins(names, places, Scale(low, high, 0, 1, is_log))


def list_drawn_keys(table: RunTable) -> list[str]:
    """Varied keys that pictures show: those with several values, and at most MOST_WORDS texts; no seeds."""
    return [key for key in table.keys
            if not key.endswith(".seed")
            and (1 < len(table.words[key][0]) <= MOST_WORDS if key in table.words
                 else np.ptp(table.numbers[key]) > 0.0)]


def name_word(word: str) -> str:
    """A short name: of a map its first value, such as `qsf` of {law: "qsf", gains: …}; of other text its
    beginning."""
    if word.startswith("{"):
        try:
            first = next(iter(parse_yaml(word.encode(), Path()).read_map().values()), None)
        except InputError:
            first = None
        if first and not (first.is_map or first.is_list):
            word = first.node.value
    return word if len(word) <= 24 else f"{word[:23]}…"


def is_lost(table: RunTable) -> np.ndarray:
    """Runs that did not finish: lost or failed, (n,)."""
    return ~table.is_outcome("finished")


def find_main_measure(table: RunTable) -> str | None:
    """The measure in heat maps: the load error's rms, or its maximum, or else the first other measure."""
    for name in ("load_error_rms_m", "load_error_max_m"):
        if name in table.measures:
            return name
    others = [name for name in table.measures if name != "time_of_loss_s"]
    return others[0] if others else None


def find_values(table: RunTable, name: str) -> np.ndarray:
    """Values of a measure in the runs that finished. If these have none, as for the time of the loss,
    the values of all runs. NaN is left out."""
    values = table.numbers[name]
    finished = values[table.is_outcome("finished")]
    finished = finished[~np.isnan(finished)]
    return finished if len(finished) else values[~np.isnan(values)]


# --- the page's sections --------------------------------------------------------------------------


def make_head(name: str, table: RunTable) -> str:
    count = len(table)
    badges = "".join(
        f"<span class=\"badge {style}\">{table.count(outcome)} {outcome}</span>"
        for outcome, style in zip(OUTCOMES, ("good", "bad", "bad")) if table.count(outcome))
    varied = ", ".join(table.keys) or "nothing"
    return (f"<header><h1>{escape(name)}</h1><p class=\"sub\">{badges}{count} "
            f"{'run' if count == 1 else 'runs'}; varied: {escape(varied)}</p></header>\n")


def make_outcomes(table: RunTable) -> str:
    is_drawn = table.draw is not None
    rows = [[escape(outcome), str(table.count(outcome)), format_share(table.count(outcome) / len(table)),
             *([describe_interval(table.is_outcome(outcome), table.draw)] if is_drawn else [])] for outcome in OUTCOMES]
    page = make_plain_table(("outcome", "runs", "share", *(["95 % interval (Wilson)"] if is_drawn else [])), rows)
    if table.reasons:
        common = sorted(table.reasons.items(), key=lambda item: (-item[1], item[0]))
        page += "<h3>Reasons</h3>" + make_plain_table(
            ("runs", "reason (numbers left out)"),
            [[str(count), escape(reason)] for reason, count in common[:MOST_REASONS]],
            " class=\"left\"")
        if len(common) > MOST_REASONS:
            page += f"<p class=\"small\">{len(common) - MOST_REASONS} more are in runs.csv.</p>"
    return page


def make_share_picture(table: RunTable, key: str) -> str:
    bins = make_bins(table, key)
    totals = np.bincount(bins.places, minlength=len(bins.names))
    counts = np.bincount(bins.places[is_lost(table)], minlength=len(bins.names))
    rows = []
    for place, (name, count, total) in enumerate(zip(bins.names, counts, totals)):
        if total:
            low = high = count / total
            title = f"{name}: {count} of {total}"
            if table.draw is not None:
                here = bins.places == place
                low, high = calc_share_interval(is_lost(table)[here], table.draw[here])
                title += f", {100 * low:.1f} % to {100 * high:.1f} %"
            rows.append((place, count / total, low, high, title))
    return f"<div>{drawing.draw_shares(rows, bins.names, bins.scale, name_unit(key))}</div>"


def make_key_section(table: RunTable) -> str:
    keys = list_drawn_keys(table)
    if not keys or not np.any(is_lost(table)):
        return ""
    pictures = "".join(make_share_picture(table, key) for key in keys)
    return make_section(
        "Share lost along each varied key",
        f"<div class=\"pair\">{pictures}</div><p class=\"small\">Over all values of the other "
        "keys; runs that failed count as lost."
        f"{' Lines: 95 % interval (Wilson).' if table.draw is not None else ''}</p>")


def make_heat_maps(table: RunTable, x: str, y: str, measure: str | None) -> str:
    """Heat maps of the share lost, and of the median of `measure`, in the classes of two keys."""
    columns, rows = make_bins(table, x), make_bins(table, y)
    shape = (len(rows.names), len(columns.names))
    place = rows.places * shape[1] + columns.places
    counts = np.array([np.bincount(place[table.is_outcome(outcome)], minlength=shape[0] * shape[1])
                       for outcome in OUTCOMES]).reshape(len(OUTCOMES), *shape)
    total, lost = counts.sum(axis=0), counts[1:].sum(axis=0)
    told = [[", ".join(f"{count} {outcome}" for count, outcome in zip(counts[:, row, column], OUTCOMES) if count)
             for column in range(shape[1])] for row in range(shape[0])]
    classes = told, (columns.names, rows.names), (columns.scale, rows.scale), (name_unit(x), name_unit(y))
    pictures = ""
    if np.any(lost):
        share = np.where(total > 0, lost / np.maximum(total, 1), np.nan)
        pictures += f"<div>{drawing.draw_heat(share, *classes, 'Share lost', 'share lost or failed', True)}</div>"
    if measure is not None:
        medians = calc_class_medians(table, measure, place, shape)
        if np.any(np.isfinite(medians)):
            picture = drawing.draw_heat(medians, *classes, "Median of the finished runs", name_unit(measure))
            pictures += f"<div>{picture}</div>"
    return pictures


def calc_class_medians(table: RunTable, measure: str, place: np.ndarray,
                       shape: tuple[int, int]) -> np.ndarray:
    """Median of `measure` in each class over the runs that finished; NaN if none did."""
    values = table.numbers[measure]
    use = table.is_outcome("finished") & np.isfinite(values)
    medians = np.full(shape, np.nan)
    medians.flat[np.unique(place[use])] = calc_medians(values[use], place[use])
    return medians


def make_pair_section(table: RunTable) -> str:
    """Heat maps of each pair of keys that take more than one value."""
    pairs = list(combinations(list_drawn_keys(table), 2))[:MOST_PAIRS]
    if not pairs:
        return ""
    measure = find_main_measure(table)
    pictures = "".join(make_heat_maps(table, x, y, measure) for x, y in pairs)
    return make_section(
        "Pairs of varied keys",
        f"<div class=\"pair\">{pictures}</div><p class=\"small\"><span class=\"key\" style=\"background:"
        f"{drawing.MISSING_COLOUR}\"></span> no run. <span class=\"key\" style=\"background:"
        f"{drawing.UNFINISHED_COLOUR}\"></span> no run finished: each was lost or failed. Keys of many values are "
        f"counted in {BINS} classes.</p>")


def make_paired_section(table: RunTable, key: str) -> str:
    """Compares runs that differ only in `key`, if this key has two values."""
    found = find_pairs(table, key)
    if found is None:
        return ""
    a, b = name_word(found.name_a), name_word(found.name_b)
    pairs = replace(found, name_a=a, name_b=b)
    outcomes = [[escape(cell) for cell in row] for row in make_outcome_rows(pairs)]
    measures = [[escape(cell) for cell in row] for row in make_measure_rows(pairs)]
    page = (make_plain_table(outcomes[0], outcomes[1:])
            + f"<p class=\"small\">{len(pairs.in_a)} pairs of runs that differ in {escape(key)} alone. "
            f"{escape(describe_changes(pairs))}.</p>")
    if len(measures) > 1:
        page += ("<h3>Measures, of the "
                 f"{int(pairs.find_finished().sum())} pairs that finish with "
                 f"both</h3>{make_plain_table(measures[0], measures[1:])}")
    return make_section(f"{escape(key)}: {escape(a)} against {escape(b)}", page)


def make_measures(table: RunTable) -> str:
    if not table.measures:
        return "<p>Nothing was measured but the outcome.</p>"
    rows, main, stages = [], "", ""
    for name in table.measures:
        values = find_values(table, name)
        missing = len(table) - len(values)
        quantiles = calc_quantiles(values, SHARES)
        ends = (np.min(values), np.max(values)) if len(values) else (np.nan, np.nan)
        rows.append([escape(name), *map(format_number, (ends[0], *quantiles, ends[1])),
                     str(len(values)), str(missing)])
    for name in table.measures[:MOST_COLUMNS]:
        values = find_values(table, name)
        finite = values[np.isfinite(values)]
        if len(finite):
            beyond = len(values) - len(finite)
            note = (f"<p class=\"small\">{beyond} infinite values are not drawn.</p>"
                    if beyond else "")
            picture = (f"<h3>{escape(name)}</h3>{drawing.draw_distribution(finite, name_unit(name))}{note}")
            if name.startswith("stage_"):
                stages += picture
            else:
                main += picture
    page = make_plain_table(("measure", "least", "5 %", "median", "95 %", "largest", "runs",
                             "without"), rows)
    page += ("<p class=\"small\">Of the runs that finished; a measure that none of them has, such "
             "as the time of the loss, of the others. Without: runs that are not counted. Right: "
             "share of the runs with at most this value.</p>")
    if stages:
        main += f"<details><summary>Per stage</summary>{stages}</details>"
    return page + main


def choose_sample(table: RunTable) -> np.ndarray:
    """Places of at most MOST_LINES runs, evenly spaced. Half of them are lost runs, if there are
    enough runs of both kinds."""
    lost, finished = np.flatnonzero(is_lost(table)), np.flatnonzero(~is_lost(table))
    half = MOST_LINES // 2
    take_lost = min(len(lost), max(half, MOST_LINES - len(finished)))
    take_finished = min(len(finished), MOST_LINES - take_lost)
    chosen = [group[np.linspace(0, len(group) - 1, take).round().astype(int)]
              for group, take in ((finished, take_finished), (lost, take_lost)) if take]
    return np.concatenate(chosen)


def make_parallel(table: RunTable) -> str:
    sample = choose_sample(table)
    axes: list[tuple[str, np.ndarray, Sequence[str] | None]] = []
    for key in list_drawn_keys(table)[:8]:
        if key in table.words:
            bins = make_bins(table, key, 12)
            axes.append((key, bins.places[sample].astype(float), bins.names))
        else:
            axes.append((name_unit(key), table.numbers[key][sample], None))
    axes.append(("outcome", table.outcome[sample].astype(float), OUTCOMES))
    shown = [name for name in table.measures if not name.startswith("stage_")
             and not name.endswith(("_x_m", "_y_m", "_z_m"))]
    axes += [(name_unit(name), table.numbers[name][sample], None) for name in (shown or table.measures)[:6]]
    colours = [OUTCOME_COLOURS[OUTCOMES[place]] for place in table.outcome[sample]]
    return (f"<div class=\"scroll\">{drawing.draw_parallel(axes, colours)}</div>"
            f"<p class=\"small\">One line per run: {len(sample)} of {len(table)} runs, evenly "
            "chosen among those that finished (blue) and those that did not (orange: lost, grey: "
            "failed).</p>")


def list_worst(table: RunTable) -> list[tuple[str, np.ndarray]]:
    """Groups of the worst runs, by title and places in the table: failed, lost earliest, and finished
    with the largest errors."""
    groups = [("Failed", np.flatnonzero(table.is_outcome("failed"))[:WORST])]
    lost = np.flatnonzero(table.is_outcome("lost"))
    moment = table.numbers.get("time_of_loss_s", table.numbers["steps"])[lost]
    groups.append(("Lost, the earliest first", lost[np.argsort(moment, kind="stable")][:WORST]))
    finished = np.flatnonzero(table.is_outcome("finished"))
    measure = ("load_error_max_m" if "load_error_max_m" in table.measures
               else find_main_measure(table))
    if measure is not None:
        values = table.numbers[measure][finished]
        order = np.argsort(-values, kind="stable")
        order = order[~np.isnan(values[order])]
        groups.append((f"Finished, the largest {measure} first", finished[order][:WORST]))
    return [(title, places) for title, places in groups if len(places)]


def make_command(file: str, run: int) -> str:
    return f"./sls campaign {shlex.quote(file)} --runs {run}-{run} --out /tmp/run-{run}"


def make_worst(table: RunTable, file: str) -> str:
    groups = list_worst(table)
    rows_of = find_rows(table.file, (int(table.run[place]) for _, places in groups
                                     for place in places))
    page = ""
    for title, places in groups:
        rows = []
        for place in places:
            run = int(table.run[place])
            row = rows_of[run]
            values = ", ".join(f"{key} {shorten(row[key])}" for key in table.keys)
            measured = row["reason"] or ", ".join(
                f"{name} {format_number(float(table.numbers[name][place]))}"
                for name in ("load_error_rms_m", "load_error_max_m", "tilt_max_rad", "force_max_n")
                if name in table.measures)
            rows.append([str(run), escape(values), escape(measured),
                         f"<code>{escape(make_command(file, run))}</code>"])
        page += f"<h3>{escape(title)}</h3>" + make_plain_table(
            ("run", "values", "what happened", "fly it again"), rows, " class=\"left\"")
    return page + ("<p class=\"small\">To keep its recording, set <code>keep: all</code> in a copy "
                   "of the campaign file.</p>")


def shorten(cell: str) -> str:
    """A number with four digits, or the first 40 characters of a text."""
    try:
        return format_number(float(cell))
    except ValueError:
        return cell if len(cell) <= 40 else f"{cell[:39]}…"


def flatten(value: Any, place: str = "") -> list[tuple[str, str]]:
    """Path and text of each value in the manifest, in its order. Long texts are cut."""
    if isinstance(value, dict):
        return [leaf for key, item in value.items()
                for leaf in flatten(item, f"{place}.{key}" if place else str(key))]
    if isinstance(value, float) and math.isfinite(value):
        return [(place, f"{value:g}")]
    text = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
    return [(place, text if len(text) <= 160 else f"{text[:159]}…")]
