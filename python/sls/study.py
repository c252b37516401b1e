"""The comparison of our flights with the published ones: the numbers and pictures of docs/study.md."""

import csv
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from sls import px4_study
from sls.figures import STYLE, draw, lay_out, make_stack, plot_path, plot_positions, save, set_log_scale, style_of
from sls.trajectory import Trajectory
from sls.metrics import calc_stage_metrics, split_laps
from sls.px4_study import Planned, RunFailed, measure, shift_to_published
from sls.tables import fill_page, format_error, list_error_cells, list_step_cells, make_markdown_table

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
DPI = 100


FLIGHTS = (
    Planned("figure_eight_1ms", "figure_eight", period_s=0.001),
    *(Planned(f"matlab_{name}", f"matlab_{name}", period_s=0.001)
      for name in ("setpoint_1", "setpoint_2", "setpoint_3", "figure_eight")),
    *(Planned(name, name) for name in (
        "figure_eight", "setpoints", "gazebo_legacy", "gazebo_correct_wiring", "gazebo_corrected", "integral_mass_error",
        "mass_error_without_integral", "rotor_drag", "rotor_drag_without_feed_forward")),
)

# Load position error on the second lap, m, from the logs of the published MATLAB, Gazebo and PX4
# flights of the same figure eight. The first row names the columns. The launcher reads this file, too.
PUBLISHED_LAP_2 = list(csv.reader((HERE / "published_lap_2.csv").read_text().splitlines()))


def fly_all(recordings: Path, say: Callable[[str], None]) -> None:
    """Flies everything on the page. Raises RunFailed."""
    px4_study.fly_all((*FLIGHTS, *px4_study.FLIGHTS), recordings, say)


# --- pictures -------------------------------------------------------------------------------------


def cut(flight: Trajectory, stage_name: str, lap: int, name: str) -> Trajectory:
    """One lap of a flight as a separate flight that starts at time 0."""
    stage = next(stage for stage in flight.stages if stage.name == stage_name)
    return flight.cut(split_laps(flight, stage)[lap - 1].rows, name)


def plot_error_sizes(flights: Sequence[Trajectory], title: str) -> Figure:
    """Absolute values of the load position errors over time, logarithmic."""
    figure, axes = make_stack(3, title, ("|x| (m)", "|y| (m)", "|z| (m)"), height=1.55)
    for axis in range(3):
        sizes = [np.abs(flight.calc_error()[:, axis]) for flight in flights]
        for index, (flight, size) in enumerate(zip(flights, sizes)):
            draw(axes[axis, 0], flight.time_s, np.where(size > 0, size, np.nan),
                 **style_of(index, flights), label=flight.name)
        set_log_scale(axes[axis, 0], sizes)
    return figure


def plot_height_error(flights: Sequence[Trajectory]) -> Figure:
    figure, axes = make_stack(1, "Height of the load above its set-point", ("height (mm)",),
                              height=2.4)
    for index, flight in enumerate(flights):
        draw(axes[0, 0], flight.time_s, -1000.0 * flight.calc_error()[:, 2],
             **style_of(index, flights), label=flight.name)
    axes[0, 0].axhline(0.0, color="#222222", linewidth=0.8)
    axes[0, 0].set_ylim(-8, 32)
    return figure


def plot_set_points(flights: Sequence[Trajectory]) -> Figure:
    """The steps of several legs, each as a share of its distance, with the band of ±2 %."""
    figure, axes = make_stack(3, "Load position as a share of the step; shaded: ±2 %",
                              ("x / step", "y / step", "z / step"), height=1.55)
    for index, flight in enumerate(flights):
        way = flight.p_WL_ref[0] - flight.p_WL[0]
        for axis in range(3):
            if abs(way[axis]) > 0.0:
                draw(axes[axis, 0], flight.time_s,
                     (flight.p_WL[:, axis] - flight.p_WL[0, axis]) / way[axis],
                     **style_of(index, flights), label=flight.name, linewidth=4.0 - 1.5 * index)
    for axis in range(3):
        axes[axis, 0].axhspan(0.98, 1.02, color="#222222", alpha=0.12, linewidth=0)
    return figure


def draw_pictures(flights: dict[str, Trajectory]) -> dict[str, Figure]:
    """All pictures except those of the chapter on PX4, by file name."""
    wirings = [cut(flights[name], "figure_eight", 2, label) for name, label in (
        ("gazebo_legacy", "published wiring"), ("gazebo_correct_wiring", "correct wiring"),
        ("gazebo_corrected", "and correct model"))]
    return {
        "figure_eight": plot_error_sizes(
            [replace(flights["figure_eight"], name="period 4 ms"),
             replace(flights["figure_eight_1ms"], name="period 1 ms")],
            "Figure eight from rest: size of the load position error"),
        "matlab_set_points": plot_set_points(
            [flights[f"matlab_setpoint_{leg}"] for leg in (1, 2, 3)]),
        "set_points": plot_positions([replace(flights["setpoints"], name="load")]),
        "gazebo_path": plot_path(wirings),
        "gazebo_errors": plot_error_sizes(
            wirings, "Figure eight of the Gazebo mission, second lap: size of the error"),
        "integral": plot_height_error(
            [replace(flights["integral_mass_error"], name="with integral"),
             replace(flights["mass_error_without_integral"], name="without")]),
        "rotor_drag": plot_error_sizes(
            [replace(flights["rotor_drag"], name="with feed-forward"),
             replace(flights["rotor_drag_without_feed_forward"], name="without")],
            "Figure eight with rotor drag and wind: size of the load position error"),
    }


# --- the page -------------------------------------------------------------------------------------


def make_lap_row(flight: Trajectory, label: str) -> list[str]:
    return [label, *list_error_cells(measure(flight))[:5]]


LAP_HEADER = ("figure eight, second lap", *PUBLISHED_LAP_2[0][1:])
STEP_HEADER = ("flight", "settling x s", "y", "z", "overshoot x %", "y", "z",
               "steady-state error x m", "y", "z")


def make_lap_table(flights: dict[str, Trajectory]) -> str:
    published = [[f"published: {row[0]}", *row[1:]] for row in PUBLISHED_LAP_2[1:]]
    return make_markdown_table(LAP_HEADER, published + [make_lap_row(flight, label) for flight, label in (
        (flights["figure_eight"], "`figure_eight`, hold of 4 ms"),
        (flights["figure_eight_1ms"], "`figure_eight`, hold of 1 ms"),
        (flights["matlab_figure_eight"], "`matlab_figure_eight`, hold of 1 ms"),
        (flights["gazebo_legacy"], "`gazebo_legacy`: published wiring"),
        (shift_to_published(flights["gazebo_legacy"], "gazebo_legacy"), "`gazebo_legacy`, about z −0.5"),
        (flights["gazebo_correct_wiring"], "`gazebo_correct_wiring`: only the wiring corrected"),
        (flights["gazebo_corrected"], "`gazebo_corrected`: wiring and controller model corrected"))])


def make_step_table(flights: Sequence[Trajectory]) -> str:
    rows = []
    for flight in flights:
        for metrics in calc_stage_metrics(flight):
            place = f", stage {metrics.label.split()[0]}" if len(flight.stages) > 1 else ""
            rows.append([f"`{flight.name}`{place}", *list_step_cells(metrics)])
    return make_markdown_table(STEP_HEADER, rows)


def make_drag_table(flights: dict[str, Trajectory]) -> str:
    return make_markdown_table(LAP_HEADER, [
        make_lap_row(flights["rotor_drag"], "`rotor_drag`: with feed-forward"),
        make_lap_row(flights["rotor_drag_without_feed_forward"], "`rotor_drag_without_feed_forward`")])


def describe_gain(flights: dict[str, Trajectory], worse: str, better: str, axes: str,
                  digits: int) -> str:
    """Ratio of the rms errors of `worse` and `better` on the second lap: "118 (x) and 48 (y)"."""
    ratios = measure(flights[worse]).rms_m / measure(flights[better]).rms_m
    *most, last = [f"{ratio:.{digits}f} ({axis})" for ratio, axis in zip(ratios, axes)]
    return f"{', '.join(most)} and {last}"


PUBLISHED_PX4 = PUBLISHED_LAP_2[-1][1:]


def make_page(flights: dict[str, Trajectory], px4_values: dict[str, str]) -> str:
    """docs/study.md, with the numbers and tables filled in."""
    def describe_height(name: str, digits: int) -> str:
        metrics = calc_stage_metrics(flights[name])[0]
        return f"{abs(1000.0 * metrics.step.steady_state_error_m[2]):.{digits}f}"

    legs = [flights[f"matlab_setpoint_{leg}"] for leg in (1, 2, 3)]
    rod_error = measure(flights["gazebo_correct_wiring"]).rms_m[2]
    return fill_page(ROOT / "docs/study.md", px4_values | dict(
        count=str(len(FLIGHTS) + len(px4_study.FLIGHTS)),
        lap_table=make_lap_table(flights),
        hold=describe_gain(flights, "figure_eight", "figure_eight_1ms", "xyz", 2),
        wired=describe_gain(flights, "gazebo_legacy", "gazebo_correct_wiring", "xy", 0),
        corrected=describe_gain(flights, "gazebo_legacy", "gazebo_corrected", "xy", 0),
        rod_error=format_error(rod_error),
        set_point_table=make_step_table([*legs, flights["setpoints"]]),
        with_integral=describe_height("integral_mass_error", 2),
        without_integral=describe_height("mass_error_without_integral", 1),
        integral_table=make_step_table([flights["integral_mass_error"],
                                        flights["mass_error_without_integral"]]),
        drag=describe_gain(flights, "rotor_drag_without_feed_forward", "rotor_drag", "xyz", 0),
        drag_table=make_drag_table(flights)))


def write_study(recordings: Path, out: Path) -> Path:
    """Writes `out`/study.md and `out`/study/*.png from the flights in `recordings`."""
    flights = {name: flown.true for name, flown in px4_study.load_flights(FLIGHTS, recordings).items()}
    flown = px4_study.load_flights(px4_study.FLIGHTS, recordings)
    page = make_page(flights, px4_study.make_values(flown, recordings, PUBLISHED_PX4))
    (out / "study").mkdir(exist_ok=True)
    with matplotlib.rc_context(STYLE):
        figures = {**draw_pictures(flights),
                   **px4_study.draw_pictures(flown, [float(cell) for cell in PUBLISHED_PX4])}
        for name, figure in figures.items():
            lay_out(figure)
            save(figure, out / "study" / f"{name}.png", DPI)
    (out / "study.md").write_text(page)
    return out / "study.md"
