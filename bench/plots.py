"""Pictures of what `./sls bench` measured, from its JSON."""

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402  (after the choice of the backend)

KINDS = ("png", "svg")


def draw_bars(figures: list[dict[str, Any]], axes: Any) -> None:
    """Medians with their spread, and a mark at each bound."""
    for place, figure in enumerate(figures):
        median = figure["median"]
        spread = [[median - figure["min"]], [figure["max"] - median]]
        axes.barh(place, median, xerr=spread, color="tab:blue", height=0.6, capsize=3)
        if "bound" in figure:
            axes.plot([figure["bound"]["median"]] * 2, [place - 0.4, place + 0.4], color="tab:red",
                      linewidth=2)
    axes.set_yticks(range(len(figures)), [figure["name"] for figure in figures])
    axes.invert_yaxis()
    axes.set_xlabel(figures[0]["unit"])
    axes.grid(axis="x", alpha=0.3)


def draw_part(figures: list[dict[str, Any]]) -> Any:
    """One panel for each unit; red: the bound."""
    units = list(dict.fromkeys(figure["unit"] for figure in figures))
    groups = [[figure for figure in figures if figure["unit"] == unit] for unit in units]
    picture, panels = pyplot.subplots(
        len(groups), 1, squeeze=False, layout="constrained",
        figsize=(9, sum(0.8 + 0.35 * len(group) for group in groups)),
        height_ratios=[1 + len(group) for group in groups])
    for group, axes in zip(groups, panels[:, 0]):
        draw_bars(group, axes)
        values = [figure["median"] for figure in group]
        if min(values) > 0 and max(values) > 50 * min(values):
            axes.set_xscale("log")
    return picture


def save_plots(result: dict[str, Any], folder: Path) -> list[Path]:
    """One picture for each part."""
    parts = list(dict.fromkeys(figure["part"] for figure in result["figures"]))
    files = []
    for part in parts:
        figures = [figure for figure in result["figures"] if figure["part"] == part]
        picture = draw_part(figures)
        has_bound = any("bound" in figure for figure in figures)
        picture.suptitle(f"{part} (red: bound)" if has_bound else part)
        for kind in KINDS:
            file = folder / f"{part}.{kind}"
            picture.savefig(file, dpi=120)
            files.append(file)
        pyplot.close(picture)
    return files
