"""The figures of flights. Each `plot_…` function draws one figure and returns it; `lay_out` adds title and legend;
`save` writes it.

Times are simulation time. Angles are drawn in degrees. Only `to_z_up` leaves frame W."""

import re
import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from sls.input_error import InputError
from sls.trajectory import Trajectory, calc_roll_pitch_yaw, find_spans

QUAD, LOAD, REFERENCE_COLOUR = re.findall(r"#\w{6}", Path(__file__).with_name("colours.css").read_text())
# For flights that are drawn together. Distinct for readers with any colour vision (Okabe and Ito).
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f7f7f", "#8c510a")
LINES = ("-", "--", ":", "-.")
# Wide and light: a curve that follows the reference well is visible in its middle.
REFERENCE = {"linewidth": 3.4, "alpha": 0.35, "zorder": 1.5, "solid_capstyle": "butt"}
WIDTH_IN = 8.6

STYLE = {
    "font.size": 9.5, "axes.titlesize": 10.5, "axes.labelsize": 9.5, "legend.fontsize": 9,
    "axes.spines.top": False, "axes.spines.right": False, "axes.edgecolor": "#666666",
    "axes.grid": True, "grid.color": "#dddddd", "grid.linewidth": 0.6, "lines.linewidth": 1.3,
    "legend.frameon": False, "svg.hashsalt": "sls", "path.simplify": True,
    "axes.axisbelow": True, "pdf.fonttype": 42,  # publishers refuse fonts of type 3
}
PAPER = {**STYLE, "font.size": 8, "axes.titlesize": 8, "axes.labelsize": 8, "legend.fontsize": 7.5,
         "lines.linewidth": 1.0}
# The files contain no date and no version of the program that wrote them.
METADATA = {"png": {"Software": None}, "svg": {"Date": None, "Creator": None},
            "pdf": {"CreationDate": None, "Creator": None, "Producer": None}}


# Most points of all vehicles together, and about the most of a line. More points would only make the file larger.
FLEET_POINTS, LINE_POINTS = 100_000, 40_000
MOST_DRAWN = 1e30  # axes compute with squares of the numbers, so that larger ones end in errors of matplotlib


def to_z_up(positions: np.ndarray) -> np.ndarray:
    """Positions with x forward, y to the left, z up. Only this function turns z up; y turns with it,
    because the frame must stay right-handed."""
    return positions * np.array([1.0, -1.0, -1.0])


def colour_of(index: int) -> str:
    return COLOURS[index % len(COLOURS)]


def style_of(index: int, flights: Sequence[Any], alone: str = LOAD) -> dict[str, Any]:
    """The style of flight `index`: a single one has the colour `alone`; several differ in colour and in line style."""
    if len(flights) == 1:
        return {"color": alone}
    return {"color": colour_of(index), "linestyle": LINES[(index + index // len(COLOURS)) % len(LINES)]}


def break_at_gaps(time_s: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Puts NaN where steps are missing, because no line may be drawn across the gap."""
    if len(time_s) < 3:
        return time_s, values
    spacing = np.diff(time_s)
    gaps = np.flatnonzero(spacing > 1.5 * np.median(spacing)) + 1
    if not len(gaps):
        return time_s, values
    return np.insert(time_s, gaps, np.nan), np.insert(values, gaps, np.nan, axis=0)


def break_at_jumps(positions: np.ndarray) -> np.ndarray:
    """Puts NaN where a reference jumps to the next set-point. A move of 10 cm in one row is a jump."""
    far = np.linalg.norm(np.diff(positions, axis=0), axis=1) > 0.1
    return np.insert(positions, np.flatnonzero(far) + 1, np.nan, axis=0)


def find_set_points(positions: np.ndarray) -> np.ndarray:
    """The positions at which a reference rests, each once."""
    stays = np.all(positions[1:] == positions[:-1], axis=1)
    begins = np.flatnonzero(np.diff(stays, prepend=False) & stays) + 1
    return np.unique(positions[begins], axis=0)


def find_rows(values: np.ndarray) -> np.ndarray:
    """The rows of `values` (n, k) that a line needs to look the same: of many equal spans the first row, those of the
    extremes of each column, and one without a value."""
    count, columns = values.shape
    size = -(-count * (2 * columns + 2) // LINE_POINTS)
    if size <= 2 * columns + 2:
        return np.arange(count)
    first = np.arange(0, count, size)
    rows = [first, [count - 1]]
    for column in values.T:
        spans = np.append(column, np.full(-count % size, column[-1])).reshape(-1, size)
        is_missing = np.isnan(spans)
        rows += [first + np.argmax(is_missing, axis=1), first + np.argmin(np.where(is_missing, np.inf, spans), axis=1),
                 first + np.argmax(np.where(is_missing, -np.inf, spans), axis=1)]
    return np.unique(np.minimum(np.concatenate(rows), count - 1))


def draw(axes: Axes, time_s: np.ndarray, values: np.ndarray, **style) -> None:
    time_s, values = break_at_gaps(time_s, values)
    rows = find_rows(values[:, np.newaxis])
    axes.plot(time_s[rows], values[rows], **style)


def mark_stages(all_axes: Sequence[Axes], flights: Sequence[Trajectory]) -> None:
    """Marks the start of each stage of the mission, if there is only one flight."""
    if len(flights) != 1 or not any(axes.lines for axes in all_axes):
        return
    flight = flights[0]
    for stage in flight.stages[1:]:
        for axes in all_axes:
            axes.axvline(flight.time_s[stage.first], color="#999999", linewidth=0.8,
                         linestyle=(0, (2, 3)), zorder=0.5)


def lay_out(figure: Figure, paper: float | None = None, panels: Sequence[int] = ()) -> None:
    """Adds the figure's label as title, and one legend of all axes; the figure grows by their height. `panels`: numbers
    of the axes that stay, row by row from 1; without any all stay. `paper`: the width in columns of a paper, of 3.5 in
    each; the title is left out. Raises InputError if a panel does not exist."""
    if panels:
        keep_panels(figure, panels)
    width = 3.66 * paper - 0.16 if paper else WIDTH_IN
    title = 0.0 if paper else 0.32
    found: dict[str, Any] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels()):
            found.setdefault(label, handle)
    letter = 0.6 * matplotlib.rcParams["legend.fontsize"] / 72
    labels = [textwrap.fill(label, int(width / letter) - 6) for label in found] if len(found) > 1 else []
    lines = [label.split("\n") for label in labels]
    columns = max(1, int(width / letter / (6 + max((len(line) for one in lines for line in one), default=0))))
    rows = -(-len(lines) // columns) * max(map(len, lines), default=0)
    height = figure.get_figheight() * (0.4 + 0.6 * width / WIDTH_IN) + title + 2.7 * letter * rows
    top = 1.0 - (title + 2.7 * letter * rows) / height
    figure.set_size_inches(width, height)
    if not paper:
        figure.text(0.01, 1.0 - 0.06 / height, figure.get_label(), va="top", fontsize=11.5, fontweight="bold")
    if labels:
        figure.legend(found.values(), labels, loc="upper left", bbox_to_anchor=(0.005, 1.0 - title / height),
                      ncol=columns, borderaxespad=0.2, handlelength=2.4, columnspacing=1.4)
    if figure.get_layout_engine() is None:
        figure.axes[0].set_position((0.06, 0.35 / height, 0.84, top - 0.35 / height))  # room for the labels
    else:
        figure.get_layout_engine().set(rect=(0.0, 0.0, 1.0, top))
        figure.align_ylabels()


def keep_panels(figure: Figure, numbers: Sequence[int]) -> None:
    """Removes the axes of other numbers, and closes the gaps."""
    every = figure.axes
    if not set(numbers) <= set(range(1, len(every) + 1)):
        raise InputError(f"--panels: expected panels of 1 to {len(every)} of '{figure.get_label()}', "
                         f"got {','.join(map(str, numbers))}")
    kept = [axes for number, axes in enumerate(every, 1) if number in numbers]
    if len(kept) == len(every):
        return
    place = {axes: (axes.get_subplotspec().rowspan.start, axes.get_subplotspec().colspan.start) for axes in kept}
    rows, columns = (sorted(set(starts)) for starts in zip(*place.values()))
    share = len(rows) / every[0].get_gridspec().nrows
    figure.set_figheight(0.55 + (figure.get_figheight() - 0.55) * share)
    grid = figure.add_gridspec(len(rows), len(columns))
    label = every[-1].get_xlabel()
    for axes in set(every) - set(kept):
        axes.remove()
    for axes, (row, column) in place.items():
        axes.set_subplotspec(grid[rows.index(row), columns.index(column)])
        if row == rows[-1]:
            axes.tick_params(labelbottom=True)
            axes.set_xlabel(axes.get_xlabel() or label)


def make_stack(rows: int, title: str, labels: Sequence[str], height: float = 1.75,
               columns: int = 1) -> tuple[Figure, np.ndarray]:
    """A figure with `rows` of axes that share one time axis. Returns figure and axes (rows, columns)."""
    figure = Figure(figsize=(WIDTH_IN, 0.55 + height * rows), layout="constrained", label=title)
    axes = figure.subplots(rows, columns, sharex=True, squeeze=False)
    for row, label in enumerate(labels):
        axes[row, 0].set_ylabel(label)
    for one in axes[-1]:
        one.set_xlabel("time (s)")
    for one in axes.flat:
        one.margins(x=0)
    return figure, axes


def list_references(flights: Sequence[Trajectory]) -> list[tuple[Trajectory, str, str]]:
    """The different references of `flights`: a flight with the reference, its label and its colour."""
    found: list[tuple[Trajectory, str, str]] = []
    for index, flight in enumerate(flights):
        if np.all(np.isnan(flight.p_WL_ref)) or any(is_same_reference(flight, other)
                                                    for other, _, _ in found):
            continue
        label = "reference" if not found else f"reference of {flight.name}"
        found.append((flight, label, colour_of(index) if found else REFERENCE_COLOUR))
    return found


def is_same_reference(a: Trajectory, b: Trajectory) -> bool:
    """True if the references differ by less than 1 cm, which no line shows, in 99 % of the instants of `a` at which
    both are known."""
    for axis in range(3):
        known = np.isfinite(b.p_WL_ref[:, axis])
        there = np.interp(a.time_s, b.time_s[known], b.p_WL_ref[known, axis])
        both = np.isfinite(a.p_WL_ref[:, axis]) & (a.time_s <= b.time_s[-1])
        if np.mean(np.abs(there - a.p_WL_ref[:, axis])[both] > 0.01) > 0.01:
            return False
    return True


def plot_positions(flights: Sequence[Trajectory]) -> Figure:
    figure, axes = make_stack(3, "Load position", ("x (m)", "y (m)", "z (m, down)"))
    for index, flight in enumerate(flights):
        for axis in range(3):
            draw(axes[axis, 0], flight.time_s, flight.p_WL[:, axis], **style_of(index, flights),
                 label="load" if len(flights) == 1 else flight.name, zorder=3)
            if len(flights) == 1:
                draw(axes[axis, 0], flight.time_s, flight.p_WQ[:, axis], color=QUAD,
                     linewidth=0.9, label="quadrotor")
    for flight, label, colour in list_references(flights):
        for axis in range(3):
            draw(axes[axis, 0], flight.time_s, flight.p_WL_ref[:, axis], color=colour,
                 label=label, **REFERENCE)
    axes[2, 0].invert_yaxis()
    mark_stages(axes[:, 0], flights)
    return figure


def plot_errors(flights: Sequence[Trajectory]) -> Figure:
    figure, axes = make_stack(3, "Load position error and its size", ("x (m)", "y (m)", "z (m)"), columns=2)
    for index, flight in enumerate(flights):
        error = flight.calc_error()
        if np.all(np.isnan(error)):
            continue
        for axis in range(3):
            style = {**style_of(index, flights), "label": flight.name}
            draw(axes[axis, 0], flight.time_s, error[:, axis], **style)
            size = np.abs(error[:, axis])
            draw(axes[axis, 1], flight.time_s, np.where(size > 0, size, np.nan), **style)
    for axis in range(3):
        set_log_scale(axes[axis, 1], [np.abs(flight.calc_error()[:, axis]) for flight in flights])
        axes[axis, 1].set_ylabel(f"|{'xyz'[axis]}| (m)")
    mark_stages(list(axes.flat), flights)
    return figure


def set_log_scale(axes: Axes, sizes: Sequence[np.ndarray]) -> None:
    """Sets a logarithmic scale from the decade of the 2nd percentile up, with at most 6 decades below the largest
    value's decade. The limit is necessary because errors that change their sign pass zero. Sizes that are all 0 have
    no such axis: a text says so."""
    values = np.concatenate(sizes)
    values = values[np.isfinite(values) & (values > 0)]
    if not len(values):
        axes.text(0.5, 0.5, "0 at every step", ha="center", va="center", transform=axes.transAxes)
        axes.set_yticks([])
        return
    axes.set_yscale("log")
    decade = np.floor(np.log10([np.percentile(values, 2), np.max(values)]))
    axes.set_ylim(10.0 ** max(decade[0], decade[1] - 6), 2.0 * np.max(values))


def plot_path(flights: Sequence[Trajectory]) -> Figure:
    figure = Figure(figsize=(WIDTH_IN, 5.4), label="Path of the load")
    axes = figure.add_subplot(projection="3d")
    drawn = []
    for index, flight in enumerate(flights):
        drawn.append(to_z_up(flight.p_WL[find_rows(flight.p_WL)]))
        style = style_of(index, flights)
        axes.plot(*drawn[-1].T, **style, label="load" if len(flights) == 1 else flight.name)
        axes.scatter(*drawn[-1][0], color=style["color"], s=18)
        if len(flights) == 1:
            drawn.append(to_z_up(flight.p_WQ[find_rows(flight.p_WQ)]))
            axes.plot(*drawn[-1].T, color=QUAD, linewidth=0.8, label="quadrotor")
    for flight, label, colour in list_references(flights):
        path = break_at_jumps(flight.p_WL_ref)
        drawn.append(to_z_up(path[find_rows(path)]))
        axes.plot(*drawn[-1].T, color=colour, label=label, **REFERENCE)
        axes.scatter(*find_set_points(to_z_up(flight.p_WL_ref)).T, color="#444444", marker="x", s=34,
                     linewidth=1.2)
    set_equal_scale(axes, np.concatenate(drawn))
    axes.set_xlabel("forward, x (m)", labelpad=8)
    axes.set_ylabel("left, −y (m)", labelpad=8)
    axes.set_zlabel("up, −z (m)", labelpad=6)
    axes.view_init(elev=24, azim=-58)
    return figure


def set_equal_scale(axes, points: np.ndarray) -> None:
    """Draws one metre equally long on each axis. No axis is shorter than a fourth of the longest."""
    low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    centre, extent = (low + high) / 2, np.maximum(high - low, 1e-3)
    extent = 1.08 * np.maximum(extent, 0.25 * np.max(extent))
    for axis, name in enumerate("xyz"):
        getattr(axes, f"set_{name}lim")(centre[axis] - extent[axis] / 2,
                                        centre[axis] + extent[axis] / 2)
        is_short = extent[axis] < 0.5 * np.max(extent)
        getattr(axes, f"{name}axis").set_major_locator(MaxNLocator(2 if is_short else 4))
        getattr(axes, f"{name}axis").set_pane_color((0.97, 0.97, 0.97, 1.0))
    is_tall = extent[2] > 0.7 * max(extent[0], extent[1])
    axes.set_box_aspect(extent, zoom=0.88 if is_tall else 1.05)


def draw_columns(all_axes: Sequence[Axes], flights: Sequence[Trajectory],
                 calc_columns: Callable[[Trajectory], np.ndarray], alone: str = QUAD) -> None:
    """Draws column i of each flight's `calc_columns` on axes i. Leaves out flights without such data."""
    for index, flight in enumerate(flights):
        columns = calc_columns(flight)
        if np.all(np.isnan(columns)):
            continue
        for axes, values in zip(all_axes, columns.T):
            draw(axes, flight.time_s, values, **style_of(index, flights, alone), label=flight.name)
    mark_stages(all_axes, flights)


def plot_angles(flights: Sequence[Trajectory]) -> Figure:
    title = "Cable angles" if flights[0].cable else "Rod angles"
    figure, axes = make_stack(2, title, ("α about x (°)", "β about y (°)"))
    draw_columns(axes[:, 0], flights,
                 lambda flight: np.degrees(np.column_stack([flight.alpha, flight.beta])), LOAD)
    return figure


def plot_forces(flights: Sequence[Trajectory]) -> Figure:
    figure, axes = make_stack(4, "Force on the quadrotor",
                              ("F x (N)", "F y (N)", "F z (N, down)", "|F| (N)"), height=1.45)
    axes[2, 0].invert_yaxis()
    draw_columns(axes[:, 0], flights, lambda flight: np.column_stack(
        [flight.f_Q_W, np.linalg.norm(flight.f_Q_W, axis=1)]))
    return figure


def plot_attitude(flights: Sequence[Trajectory]) -> Figure:
    """The commanded attitude of plants without attitude. For other plants `plot_body_attitude` draws
    the attitude and its set-point."""
    figure, axes = make_stack(2, "Commanded attitude", ("roll (°)", "pitch (°)"))
    if all(np.all(np.isnan(list_attitudes(flight)[0])) for flight in flights):
        draw_columns(axes[:, 0], flights, lambda flight: np.degrees(flight.calc_attitude()))
    return figure


def list_attitudes(flight: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Roll, pitch and yaw, (n, 3), rad, and their set-points. If the plant has no set-points, these are
    the angles that realise the force."""
    force = np.column_stack([flight.calc_attitude(), np.zeros(len(flight.time_s))])
    if flight.body is None:
        return np.full(force.shape, np.nan), force
    known = np.any(np.isfinite(flight.body.q_WB_set))
    return (calc_roll_pitch_yaw(flight.body.q_WB),
            calc_roll_pitch_yaw(flight.body.q_WB_set) if known else force)


def break_at_turns(angles: np.ndarray) -> np.ndarray:
    """Puts NaN where an angle (n, k) wraps from one end of its range to the other."""
    jumps = np.abs(np.diff(angles, axis=0, prepend=angles[:1])) > np.pi
    return np.where(jumps, np.nan, angles)


def widen(all_axes: Sequence[Axes], least: float) -> None:
    """Gives the axes a range of at least `least`. With less, rounding would look like motion."""
    for axes in all_axes:
        low, high = axes.get_ylim()
        if axes.lines and high - low < least:
            axes.set_ylim((low + high - least) / 2, (low + high + least) / 2)


def draw_beside(all_axes: Sequence[Axes], flights: Sequence[Trajectory],
                calc_both: Callable[[Trajectory], tuple[np.ndarray, np.ndarray] | None]) -> None:
    """Draws column i of both results of `calc_both` on axes i: the real values over their set-points.
    `calc_both` returns None for a flight without such data."""
    for index, flight in enumerate(flights):
        alone = len(flights) == 1
        real, asked = calc_both(flight) or (np.empty((0, 0)), np.empty((0, 0)))
        for values, label, style in (
                (asked, "set-point", {"color": REFERENCE_COLOUR if alone else colour_of(index),
                                      **REFERENCE}),
                (real, "", {**style_of(index, flights, QUAD), "zorder": 3})):
            name = label if alone else f"{flight.name} {label}".strip()
            for axes, column in zip(all_axes, values.T):
                if np.any(np.isfinite(column)):
                    draw(axes, flight.time_s, column, label=name or "real", **style)
    mark_stages(all_axes, flights)


def plot_body_attitude(flights: Sequence[Trajectory]) -> Figure:
    figure, axes = make_stack(3, "Attitude and its set-point", ("roll (°)", "pitch (°)", "yaw (°)"),
                              height=1.55)
    if any(np.any(np.isfinite(list_attitudes(flight)[0])) for flight in flights):
        draw_beside(axes[:, 0], flights, lambda flight: tuple(
            np.degrees(break_at_turns(angles)) for angles in list_attitudes(flight)))
        widen(axes[:, 0], 1.0)
    return figure


def plot_body_rates(flights: Sequence[Trajectory]) -> Figure:
    figure, axes = make_stack(3, "Body rates", ("about x (°/s)", "about y (°/s)", "about z (°/s)"),
                              height=1.55)
    draw_columns(axes[:, 0], flights, lambda flight: np.degrees(
        flight.body.w_WB_B if flight.body else np.full((len(flight.time_s), 3), np.nan)))
    widen(axes[:, 0], 1.0)
    return figure


def plot_rotors(flights: Sequence[Trajectory]) -> Figure:
    """Rotor speeds, one axes for each rotor: up to four below each other, more in two columns."""
    count = max(flight.body.rotor_speed.shape[1] if flight.body else 0 for flight in flights)
    columns = 1 if count <= 4 else 2
    rows = max(-(-count // columns), 1)
    figure, axes = make_stack(rows, "Rotor speeds and their set-points",
                              [""] * rows, height=1.3, columns=columns)
    for number, one in enumerate(axes.flat, 1):
        one.set_ylabel(f"{number} (rad/s)")
        one.set_visible(number <= count)
    draw_beside(list(axes.flat), flights, lambda flight: flight.body and (
        flight.body.rotor_speed, flight.body.rotor_speed_set))
    return figure


def plot_thrust(flights: Sequence[Trajectory]) -> Figure:
    figure, axes = make_stack(2, "Thrust of all rotors and the thrust asked for; force of the rod",
                              ("thrust (N)", "rod tension (N)"))
    draw_beside(axes[:, 0], flights, lambda flight: flight.body and (
        np.column_stack([flight.body.thrust, flight.body.rod_tension]),
        flight.body.thrust_set[:, np.newaxis]))
    return figure


def plot_cables(flights: Sequence[Trajectory]) -> Figure:
    """Tension and length of each cable, and when it is slack or cut."""
    flights = [flight for flight in flights if flight.cable]
    figure, axes = make_stack(3, "Cables", ("tension (N)", "length (m)", "cable"), height=1.55)
    if not flights:
        return figure
    for index, flight in enumerate(flights):
        style = style_of(index, flights)
        draw(axes[0, 0], flight.time_s, flight.cable.tension, label=flight.name, **style)
        draw(axes[1, 0], flight.time_s, flight.cable.length, label=flight.name, **style)
        apart = np.where(flight.cable.is_cut, np.nan, flight.cable.distance)
        draw(axes[1, 0], flight.time_s, apart, **style | REFERENCE)
        for holds, look in ((flight.cable.is_slack, {"color": style["color"]}),
                            (flight.cable.is_cut, {"facecolor": "#dddddd", "edgecolor": "#666666", "hatch": "///"})):
            spans = find_spans(flight.time_s, holds)
            axes[2, 0].broken_barh([(begin, end - begin) for begin, end in spans], (index - 0.35, 0.7), **look)
    axes[1, 0].set_title("wide and light: the distance of its ends", loc="left")
    axes[2, 0].set_title("coloured: slack; hatched: cut", loc="left")
    names = [flight.name for flight in flights] if len(flights) > 1 else [""]
    axes[2, 0].set(yticks=range(len(flights)), yticklabels=names, ylim=(len(flights) - 0.5, -0.5))
    mark_stages(axes[:2, 0], flights)
    return figure


def plot_load_attitude(flights: Sequence[Trajectory]) -> Figure:
    figure, axes = make_stack(3, "Attitude of the load", ("roll (°)", "pitch (°)", "yaw (°)"), height=1.55)
    rigid = [flight for flight in flights if flight.cable and np.any(flight.cable.q_WL[:, 1:])]
    draw_columns(axes[:, 0], rigid, lambda flight: np.degrees(break_at_turns(
        calc_roll_pitch_yaw(flight.cable.q_WL))), LOAD)
    widen(axes[:, 0], 1.0)
    return figure


def plot_fleet(flights: Sequence[Trajectory]) -> Figure:
    """All vehicles of a recording: the paths of the loads from above, x up, and the error of each. Of one load on
    cables: the paths of the vehicles and of its centre, and the errors of the cables' ends."""
    load = flights[0].cable
    figure = Figure(figsize=(WIDTH_IN, 4.3), layout="constrained",
                    label=f"{len(flights)} vehicles on one load" if load else f"Fleet of {len(flights)} vehicles")
    plan, distance = figure.subplots(1, 2)
    # Neither end is invisible on a dark or a light page.
    colours = matplotlib.colormaps["viridis"](np.linspace(0.3, 0.85, len(flights)))
    sizes = []
    rows = sum(len(flight.time_s) for flight in flights)
    every = slice(None, None, 1 + rows // FLEET_POINTS)
    for flight, colour in zip(flights, colours):
        path = flight.p_WQ if load else flight.p_WL
        plan.plot(*path[every, 1::-1].T, color=colour, linewidth=0.8)
        sizes.append(np.linalg.norm(flight.calc_error(), axis=1)[every])
        draw(distance, flight.time_s[every], sizes[-1], color=colour, linewidth=0.8)
        if len(flights) <= 64:
            plan.annotate(flight.name, path[0, 1::-1], fontsize=6.5, color="#444444",
                          ha="center", va="bottom", xytext=(0, 2), textcoords="offset points")
    plan.set(xlabel="y (m, right)", ylabel="x (m, forward)", aspect="equal")
    if load is not None:
        plan.plot(*load.p_WC[every, 1::-1].T, color=LOAD, linewidth=1.8)
    plan.set_title(f"{'vehicles and load' if load else 'loads'} from above; dark: low ids", loc="left")
    distance.set(xlabel="time (s)", ylabel="distance (m)")
    distance.margins(x=0)
    distance.set_title(f"{'cable ends' if load else 'loads'} to their references", loc="left")
    set_log_scale(distance, sizes)
    return figure


FIGURES: dict[str, Callable[[Sequence[Trajectory]], Figure]] = {
    "positions": plot_positions, "errors": plot_errors, "path": plot_path, "angles": plot_angles,
    "forces": plot_forces, "attitude": plot_attitude, "body_attitude": plot_body_attitude,
    "body_rates": plot_body_rates, "rotors": plot_rotors, "thrust": plot_thrust, "cables": plot_cables,
    "load_attitude": plot_load_attitude,
}


def leave_out_extremes(value: Any) -> Any:
    """A flight, or one of its parts, with NaN for numbers beyond MOST_DRAWN."""
    if is_dataclass(value) and not isinstance(value, type):
        return replace(value, **{field.name: leave_out_extremes(getattr(value, field.name)) for field in fields(value)})
    if isinstance(value, np.ndarray) and value.dtype.kind == "f" and np.any(is_beyond := np.abs(value) > MOST_DRAWN):
        return np.where(is_beyond, np.nan, value)
    return value


def make_figures(flights: Sequence[Trajectory], fleet: Sequence[Trajectory] = (), paper: float | None = None,
                 panels: Mapping[str, Sequence[int]] | None = None) -> dict[str, Figure]:
    """All figures for which these flights have data, by name. The overview of a `fleet` comes first. A flight of one
    state has no line to draw, and is left out. `panels`: the figures to draw, each with its panels; `paper` and panels
    as of `lay_out`. Raises InputError if there is no such figure or panel."""
    flights = [leave_out_extremes(flight) for flight in flights if len(flight.time_s) > 1]
    fleet = [leave_out_extremes(flight) for flight in fleet]
    plots: dict[str, Callable[[Sequence[Trajectory]], Figure]] = {}
    if flights:
        plots = FIGURES
        if len(fleet) > 1:
            name = "team" if fleet[0].cable else "fleet"
            plots = {name: lambda _: plot_fleet(fleet), **FIGURES, "cables": lambda _: plot_cables(fleet)}
    figures = {}
    with matplotlib.rc_context(PAPER if paper else STYLE):
        for name, plot in plots.items():
            if panels is None or name in panels:
                figure = plot(flights)
                if any(axes.lines for axes in figure.axes):
                    lay_out(figure, paper, panels[name] if panels else ())
                    figures[name] = figure
    if panels is not None and (missing := panels.keys() - figures.keys()):
        raise InputError(f"--panels: expected figures of these flights, some of {', '.join(plots)}, "
                         f"got '{min(missing)}'")
    return figures


def save(figure: Figure, path: Path, dpi: int = 150, style: Mapping[str, Any] = STYLE) -> None:
    """Writes `figure` to `path`, in the format of the file's suffix."""
    with matplotlib.rc_context(style):
        if layout := figure.get_layout_engine():  # once: the next file of this figure would do it again
            layout.execute(figure)
            figure.set_layout_engine(None)
        figure.savefig(path, dpi=dpi, metadata=METADATA[path.suffix[1:]], facecolor="white")
