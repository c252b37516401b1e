"""The picture of `./sls worlds --plot`: duration and error of the flights over the loss of their links."""

import argparse
import csv
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sls.figures import METADATA, STYLE, WIDTH_IN, colour_of, save
from sls.input_error import InputError
from sls.launcher.place import escape_controls

# Upper ends of the delays that share a colour, ms; the last one has none.
DELAYS_MS = (1.0, 5.0, np.inf)
NAMES = ("delay ≤ 1 ms", "1 to 5 ms", "> 5 ms")


def read_worlds(path: Path) -> dict[str, np.ndarray]:
    """The columns of a file of `sls_worlds --table`, one row per world. Of a world without a finished flight, duration
    and error are NaN."""
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    if not rows:
        raise InputError(f"{path}: expected worlds, got none")
    return {name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0]}


def draw_worlds(axes: Axes, worlds: dict[str, np.ndarray], values: np.ndarray, label: str) -> None:
    """Draws one point per world over the loss of its links, and marks those without a finished flight at the top."""
    least = -np.inf
    for index, (most, name) in enumerate(zip(DELAYS_MS, NAMES)):
        chosen = (worlds["delay_ms"] > least) & (worlds["delay_ms"] <= most)
        axes.plot(100 * worlds["loss"][chosen], values[chosen], ".", color=colour_of(index), markersize=4, alpha=0.6,
                  label=name)
        lost = chosen & (worlds["finished"] == 0)
        axes.plot(100 * worlds["loss"][lost], np.ones(lost.sum()), "x", color=colour_of(index), markersize=4,
                  transform=axes.get_xaxis_transform(), clip_on=False)
        least = most
    axes.set_ylabel(label)


def plot_worlds(worlds: dict[str, np.ndarray]) -> Figure:
    figure = Figure(figsize=(WIDTH_IN, 5.6))
    figure.subplots_adjust(left=0.09, right=0.98, top=0.93, bottom=0.14, hspace=0.12)
    upper, lower = figure.subplots(2, 1, sharex=True)
    draw_worlds(upper, worlds, worlds["duration_s"], "simulated time of the flight (s)")
    draw_worlds(lower, worlds, worlds["worst_error_m"], "worst load error (m)")
    if np.nanmax(worlds["duration_s"], initial=1.0) > 0:
        upper.set_yscale("log")
    lower.set_xlabel("loss of the links (%)")
    finished = int((worlds["finished"] > 0).sum())
    total = len(worlds["finished"])
    upper.set_title(f"{total} worlds, {finished} with a finished flight (the others: ×)", pad=12)
    figure.legend(*upper.get_legend_handles_labels(), ncol=3, loc="lower center", markerscale=2)
    return figure


def main(words: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(prog="./sls worlds", add_help=False, allow_abbrev=False)
    parser.add_argument("--plot", type=Path, required=True)
    parser.add_argument("--table", type=Path)
    options, rest = parser.parse_known_args(words)
    if options.plot.suffix[1:] not in METADATA:
        print(f"worlds: --plot: expected a file .png, .svg or .pdf, got '{options.plot}'", file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory() as folder:
        table = options.table or Path(folder) / "worlds.csv"
        code = subprocess.run([os.environ["SLS_WORLDS"], *rest, "--table", table], check=False).returncode
        if not table.is_file():
            return code
        try:
            with matplotlib.rc_context(STYLE):
                save(plot_worlds(read_worlds(table)), options.plot)
        except (InputError, OSError) as error:
            print(f"worlds: error: {escape_controls(error)}", file=sys.stderr)
            return 2
    print(options.plot)
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
