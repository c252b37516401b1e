"""Tables of runs as maps, and their figures."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from sls.campaign.run_table import RunTable
from sls.campaign.statistics import calc_wilson_interval

CLASS_COLOURS = ("#d7e6f4", "#f6c78f", "#d55e00", "#7f7f7f")
CLASS_NAMES = ("finishes, small motions decay", "finishes, small motions grow", "lost", "failed")


def to_map(table: RunTable, name: str, shape: tuple[int, ...]) -> np.ndarray:
    """A column as an array with the shape of the grids. The campaign must vary only grids."""
    values = table.outcome if name == "outcome" else table.numbers[name]
    return values.reshape(shape)


def list_values(table: RunTable, *keys: str) -> list[np.ndarray]:
    return [np.unique(table.numbers[key]) for key in keys]


def calc_share(table: RunTable, chosen: np.ndarray) -> tuple[float, float, float]:
    """Share of the chosen runs that did not finish, and its interval."""
    count, total = int(np.sum(table.outcome[chosen] != 0)), int(np.sum(chosen))
    return count / max(total, 1), *calc_wilson_interval(count, total)


def draw_share(axes: Axes, table: RunTable, key: str, edges: np.ndarray, chosen: np.ndarray,
               colour: str, label: str) -> None:
    """Draws the share of runs that did not finish in classes of `key`, with Wilson's intervals."""
    values = table.numbers[key]
    places, shares = [], []
    for low, high in zip(edges, edges[1:]):
        inside = chosen & (values >= low) & (values < high)
        if np.any(inside):
            places.append((low + high) / 2)
            shares.append(calc_share(table, inside))
    middle, low, high = np.array(shares).T
    axes.fill_between(places, low, high, color=colour, alpha=0.2, linewidth=0)
    axes.plot(places, middle, color=colour, marker="o", markersize=3.5, label=label)


def make_figure(columns: int, title: str, width: float = 9.0,
                height: float = 3.9) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(width, height), layout="constrained")
    figure.suptitle(title, x=0.01, ha="left", fontsize=11.5, fontweight="bold")
    return figure, list(figure.subplots(1, columns, squeeze=False)[0])


def draw_classes(axes: Axes, x: np.ndarray, y: np.ndarray, classes: np.ndarray) -> None:
    """Draws a map of classes (CLASS_NAMES) over x (columns) and y (rows)."""
    axes.pcolormesh(x, y, classes, cmap=ListedColormap(CLASS_COLOURS), vmin=-0.5, vmax=3.5,
                    shading="nearest", edgecolors="none", rasterized=True)
    axes.grid(False)
