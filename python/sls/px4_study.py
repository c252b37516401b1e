"""The study's chapter on the published PX4 flight: its flights, pictures, tables and numbers. All flights of the study
are flown here, each in one process (`./sls run --in-process`)."""

import math
import os
import re
import subprocess
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from matplotlib.figure import Figure

from sls.delay_formula import (HorizontalChain, Lateness, calc_error_ratio,
                               calc_stability_limit)
from sls.figures import REFERENCE, REFERENCE_COLOUR, WIDTH_IN, colour_of, draw, make_stack, style_of
from sls.trajectory import Trajectory, calc_roll_pitch_yaw
from sls.errors import RunError
from sls.input_error import InputError
from sls.metrics import StageMetrics, calc_over, split_laps
from sls.recordings import Recording
from sls.scenario import ROOT, SHIPPED, load_scenario
from sls.tables import format_error, list_error_cells, make_markdown_table

@dataclass(frozen=True)
class Planned:
    """A flight of the shipped scenario `base`, with `changes` by key and, if given, another control period."""

    name: str
    base: str
    changes: Mapping[str, Any] = field(default_factory=dict)
    period_s: float | None = None


# --- changes of scenarios -------------------------------------------------------------------------

RIGHT_GAINS = {"controller.gains": {"lqr": {"horizontal": 10, "vertical": 5}}}
EXACT_THRUST = {"autopilot.thrust_map": "exact"}
SEEN_AT_ONCE = {"sensing": {}}
STEP_GENTLY = {"plant.initial": {"load_position_m": [0, 0, -0.5]},
               "mission": [{"set_point": {"position_m": [0.2, 0.2, -0.5]}, "for_s": 60}]}
STEP_AT_S, STEP_RAD = 2.0, 0.1
TIME_CONSTANT_SHARE = 1.0 - math.exp(-1.0)


def lag_first_order(lag_s: float) -> dict[str, Any]:
    return {"autopilot": {"model": "first_order", "lag_s": lag_s}}


def step_force(base: str, axis: int, sign: float) -> dict[str, Any]:
    """A step of the force on a load at rest. The command is frozen, because the controller must not
    react to the step."""
    vehicle = load_base(base)["vehicle"]
    weight = (vehicle["quad_mass_kg"] + vehicle["load_mass_kg"]) * vehicle["gravity_m_s2"]
    force = [0.0, 0.0, 0.0]
    force[axis] = sign * weight * math.tan(STEP_RAD)
    return {"faults": [{"freeze": {"on": "command", "from_s": 1.0}},
                       {"bias": {"on": "command", "force_n": force, "from_s": STEP_AT_S}}],
            "mission": [{"hold": {"position_m": [1, 2, -3]}, "for_s": STEP_AT_S + 1.2}]}


def load_base(name: str) -> dict[str, Any]:
    return yaml.safe_load((SHIPPED / f"{name}.yaml").read_text())


# --- flights --------------------------------------------------------------------------------------

INGREDIENTS = (
    ("px4_ideal", "4 ms, the force acts at once", "0.0005, 0.0008, 0.0001"),
    ("px4_hold", "period 20 ms", "0.001, 0.004, 0"),
    ("px4_stale", "delayed states, late command", "0.011, 0.037, 0.002"),
    ("px4_attitude", "rotors and attitude loop", "0.020, 0.074, 0"),
    ("px4_offset", "commanded z −0.6", "0, 0, 0.100"),
    ("px4_tilt_yaw", "tilt and yaw error", "0.109, 0.232, 0.001"),
    ("px4_published", "all but tilt and yaw error", "0.037, 0.156, 0.097"),
    ("px4_fitted", "all", "0.118, 0.285, 0.097"),
)
"""Scenario, its additions to the first one, and the rms errors x, y, z of a prototype, m."""

ATTITUDE_LAG_S = 0.154

BOUGHT = (
    (Planned("fitted_exact_thrust", "px4_fitted", EXACT_THRUST), "exact thrust map"),
    (Planned("fitted_fresh", "px4_fitted", SEEN_AT_ONCE), "no delay of states and command"),
    (Planned("fitted_exact_fresh", "px4_fitted", EXACT_THRUST | SEEN_AT_ONCE), "both"),
    (Planned("published_exact_fresh", "px4_published", EXACT_THRUST | SEEN_AT_ONCE), "both, and no tilt and yaw error"),
    (Planned("fitted_right_gains", "px4_fitted", RIGHT_GAINS), "gains in the right order"),
    (Planned("fitted_exact_fresh_right_gains", "px4_fitted", EXACT_THRUST | SEEN_AT_ONCE | RIGHT_GAINS),
     "exact thrust map, no delays, gains in the right order"),
    (Planned("fitted_first_order", "px4_fitted", lag_first_order(ATTITUDE_LAG_S)),
     f"a lag of {ATTITUDE_LAG_S} s for rotors and attitude loop, exact thrust"),
)
"""Flights of px4_fitted with changes, each with a description."""

WITHOUT_LOSS = Planned("attitude_without_thrust_loss", "px4_attitude",
                       {"plant.rotor.thrust_loss_speed_m_s": 0})

DELAYS_S = (0.0, 0.04, 0.08, 0.12, 0.16, 0.2)
LAGS_S = (0.05, 0.1, ATTITUDE_LAG_S)
GAINS = (("reversed", {}), ("right", RIGHT_GAINS))
LATE = tuple((gains, Lateness(delay_s=delay_s),
              Planned(f"ideal_{gains}_delay_{1000 * delay_s:.0f}ms", "px4_ideal",
                      changes | {"faults": [{"delay": {"on": "command", "by_s": delay_s}}]}))
             for gains, changes in GAINS for delay_s in DELAYS_S) + tuple(
    (gains, Lateness(lag_s=lag_s),
     Planned(f"ideal_{gains}_lag_{1000 * lag_s:.0f}ms", "px4_ideal",
             changes | lag_first_order(lag_s)))
    for gains, changes in GAINS for lag_s in LAGS_S)
"""Gains, lateness of the force, and the flight."""

STEPS = (("roll", 0, Planned("attitude_step_roll", "px4_attitude", step_force("px4_attitude", 1, 1.0))),
         ("pitch", 1, Planned("attitude_step_pitch", "px4_attitude", step_force("px4_attitude", 0, -1.0))))
"""Name and index of the angle, and the flight. A force to the right gives roll, a force backwards pitch."""

MARGINS = tuple(
    (vehicle, gains, mission, Planned(f"margin_{vehicle}_{gains}{suffix}", vehicle, gain_changes | changes))
    for vehicle, mission, suffix, changes in (
        ("px4_ideal", "the eight", "", {}),
        ("px4_attitude", "the eight", "", {}),
        ("px4_attitude", "a step of 0.2 m", "_step", STEP_GENTLY),
        ("px4_fitted", "a step of 0.2 m", "_step", STEP_GENTLY))
    for gains, gain_changes in GAINS)
"""Vehicle, gains, mission in words, and the scenario whose delay margin is searched."""

FLIGHTS = (*(Planned(name, name) for name, _, _ in INGREDIENTS), *(flight for flight, _ in BOUGHT),
           WITHOUT_LOSS, *(flight for _, _, flight in LATE),
           *(flight for _, _, flight in STEPS))


class RunFailed(RunError):
    """A flight or a search for a delay margin failed; the message names it."""


def find_scenario(planned: Planned, recordings: Path) -> Path:
    """The scenario file: the shipped one, or, with changes, a new one below `recordings`."""
    if not planned.changes:
        return SHIPPED / f"{planned.base}.yaml"
    path = recordings / "scenarios" / f"{planned.name}.yaml"
    path.write_text(load_scenario(planned.base, changes={"name": planned.name, **planned.changes}).text)
    return path


def run_launcher(planned: Planned, arguments: Sequence[str]) -> str:
    """The output of `./sls`. Raises RunFailed."""
    done = subprocess.run([str(ROOT / "sls"), *arguments], check=False, capture_output=True,
                          text=True)
    if done.returncode != 0:
        raise RunFailed(f"study: expected {planned.name} to end well, got exit code "
                        f"{done.returncode} of ./sls {arguments[0]}: {done.stderr.strip()}")
    return done.stdout


def fly_all(flights: Sequence[Planned], recordings: Path, say: Callable[[str], None]) -> None:
    """Flies `flights` and searches the margins, on all processors. The programs must be built: `./sls study` builds
    them and sets SLS_BUILD. Raises RunFailed."""
    def fly(planned: Planned) -> None:
        say(f"study: flying {planned.name} in process")
        period = ["--period-s", str(planned.period_s)] if planned.period_s else []
        run_launcher(planned, ["run", str(find_scenario(planned, recordings)), "--in-process", *period,
                               "--out", str(recordings / planned.name), "--force"])

    def find_margin(planned: Planned) -> None:
        say(f"study: looking for the delay margin of {planned.name}")
        table = run_launcher(planned, ["delay-margin", str(find_scenario(planned, recordings))])
        (recordings / f"scenarios/{planned.name}.txt").write_text(table)

    (recordings / "scenarios").mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        jobs = [*(pool.submit(find_margin, planned) for _, _, _, planned in MARGINS),
                *(pool.submit(fly, planned) for planned in flights)]
        for job in jobs:
            job.result()


@dataclass(frozen=True)
class Flown:
    """A flight with its true positions, and with the measured positions that the controller received."""

    true: Trajectory
    seen: Trajectory


def load_flights(flights: Sequence[Planned], recordings: Path) -> dict[str, Flown]:
    flown = {}
    for planned in flights:
        recording = Recording(recordings / planned.name)
        if not recording.manifest["complete"]:
            raise InputError(f"{recording.folder}: expected a complete recording, got one that "
                             f"ends '{recording.manifest['outcome']}'")
        if recording.manifest["period_s"] != (planned.period_s or recording.manifest["period_s"]):
            raise InputError(f"{recording.folder}: expected a period of {planned.period_s} s, "
                             f"got {recording.manifest['period_s']} s")
        flown[planned.name] = Flown(recording.load_flight(0, planned.name),
                                    recording.load_seen(0, planned.name))
    return flown


@dataclass(frozen=True)
class Margin:
    holds_s: float
    loses_s: float
    lost_at_s: float
    """Time of the loss with the delay `loses_s`."""
    worst_error_m: float
    """Largest error without added delay."""


def load_margin(planned: Planned, recordings: Path) -> Margin:
    path = recordings / f"scenarios/{planned.name}.txt"
    text = path.read_text() if path.exists() else ""
    # Columns: delay, periods, worst error, rms error, outcome.
    rows = {fields[0]: fields for line in text.splitlines()[1:-1] if (fields := line.split())}
    found = re.search(r"^holds with (\S+) s, loses the load with (\S+) s$", text, re.MULTILINE)
    if not found or found[2] not in rows or "0" not in rows:
        raise InputError(f"{path}: expected the table of ./sls delay-margin with a load that is "
                         f"lost, got another text")
    return Margin(float(found[1]), float(found[2]), lost_at_s=float(rows[found[2]][-2]),
                  worst_error_m=float(rows["0"][2]))


# --- numbers --------------------------------------------------------------------------------------

PUBLISHED_Z_M = -0.5


def find_eight(base: str) -> dict[str, Any]:
    return next(stage["figure_eight"] for stage in load_base(base)["mission"]
                if "figure_eight" in stage)


def shift_to_published(flight: Trajectory, base: str) -> Trajectory:
    """The flight with its reference shifted to the figure eight at z −0.5, to which the published errors
    refer."""
    shift = np.array([0.0, 0.0, PUBLISHED_Z_M - find_eight(base)["offset_m"][2]])
    return replace(flight, p_WL_ref=flight.p_WL_ref + shift)


def measure(flight: Trajectory) -> StageMetrics:
    """Metrics of the second lap."""
    stage = next(stage for stage in flight.stages if stage.lap_s is not None)
    return calc_over(flight, split_laps(flight, stage)[1].rows, "")


def make_chain(gains: str) -> HorizontalChain:
    """The horizontal chain of px4_ideal. `gains`: "reversed", or in the right order."""
    scenario = load_base("px4_ideal")
    vehicle, listed = scenario["vehicle"], scenario["controller"]["gains"]["horizontal"]
    values = [listed[name] for name in ("position", "velocity", "acceleration", "jerk")]
    swing_2 = ((1.0 + vehicle["load_mass_kg"] / vehicle["quad_mass_kg"])
               * vehicle["gravity_m_s2"] / vehicle["rod_length_m"])
    return HorizontalChain(*(values if gains == "reversed" else values[::-1]),
                           swing_rad_s=math.sqrt(swing_2))


def calc_hold(late: Lateness) -> float:
    """Delay that the hold of the force adds in px4_ideal, s: half a control period. With a lag of first
    order it is half a plant step shorter, because the plant uses the lag's value at the end of a step
    for the whole step."""
    scenario = load_base("px4_ideal")
    early_s = scenario["plant"]["step_s"] if late.lag_s else 0.0
    return (scenario["sync"]["period_s"] - early_s) / 2.0


def calc_formula_rms(gains: str, late: Lateness) -> np.ndarray:
    """rms errors in x and y on the figure eight, by the linear formula, m."""
    eight = find_eight("px4_ideal")
    late = replace(late, delay_s=late.delay_s + calc_hold(late))
    base = 2.0j * math.pi / eight["period_s"]
    return np.array([eight["amplitude_m"][axis] / math.sqrt(2.0)
                     * abs(calc_error_ratio(make_chain(gains), late, (axis + 1) * base))
                     for axis in (0, 1)])


@dataclass(frozen=True)
class StepResponse:
    time_s: np.ndarray
    """Time since the step."""
    share: np.ndarray
    """Angle as a share of its set-point."""
    rise_s: float
    """Time at which the angle first reaches 63 % of its set-point."""


def measure_step(flight: Trajectory, angle: int) -> StepResponse:
    time_s = flight.time_s - STEP_AT_S
    share = (calc_roll_pitch_yaw(flight.body.q_WB)[:, angle]
             / calc_roll_pitch_yaw(flight.body.q_WB_set)[-1, angle])
    after = int(np.flatnonzero(share >= TIME_CONSTANT_SHARE)[0])
    rise_s = np.interp(TIME_CONSTANT_SHARE, share[after - 1:after + 1], time_s[after - 1:after + 1])
    return StepResponse(time_s, share, float(rise_s))


# --- pictures -------------------------------------------------------------------------------------


def cut_eight(flight: Trajectory, name: str) -> Trajectory:
    """Both laps as a separate flight that starts at time 0."""
    stage = next(stage for stage in flight.stages if stage.lap_s is not None)
    return flight.cut(np.arange(stage.first, stage.end), name)


def plot_plan(flights: Sequence[Trajectory]) -> Figure:
    """The paths of the loads from above, one picture for each lap."""
    figure = Figure(figsize=(WIDTH_IN, 4.7), layout="constrained", 
                    label="The load from above, as the controller saw it")
    laps = figure.subplots(1, 2, sharex=True, sharey=True)
    lap_s = find_eight("px4_fitted")["period_s"]
    for number, axes in enumerate(laps, 1):
        for index, flight in enumerate(flights):
            rows = (flight.time_s >= (number - 1) * lap_s) & (flight.time_s <= number * lap_s)
            if index == 0:
                axes.plot(*flight.p_WL_ref[rows, 1::-1].T, color=REFERENCE_COLOUR,
                          label="reference", **REFERENCE)
            axes.plot(*flight.p_WL[rows, 1::-1].T, **style_of(index, flights), label=flight.name)
        axes.set(xlabel="y (m, right)", aspect="equal")
        axes.text(0.97, 0.95, f"lap {number}", ha="right", transform=axes.transAxes)
    laps[0].set_ylabel("x (m, forward)")
    return figure


def plot_lap_errors(flights: Sequence[Trajectory], published: Sequence[float]) -> Figure:
    """Errors over both laps; on the second lap also the published rms (shaded) and largest errors."""
    figure, axes = make_stack(3, "Load position error, as the controller saw it",
                              ("x (m)", "y (m)", "z (m, about −0.5)"))
    for axis in range(3):
        for index, flight in enumerate(flights):
            draw(axes[axis, 0], flight.time_s, flight.calc_error()[:, axis],
                 **style_of(index, flights), label=flight.name)
        rms = published[axis]
        axes[axis, 0].fill_between([16.0, 32.0], -rms, rms, color="#222222", alpha=0.12,
                                   linewidth=0, label="published flight: ± rms")
        for sign in (-1.0, 1.0) if axis < 2 else ():
            axes[axis, 0].plot([16.0, 32.0], [sign * published[3 + axis]] * 2, color="#222222",
                               linewidth=1.0, linestyle=(0, (1, 2)),
                               label="± largest" if sign > 0 else None)
        axes[axis, 0].axvline(16.0, color="#999999", linewidth=0.8, linestyle=(0, (2, 3)))
        axes[axis, 0].set_ylim((-0.25, 0.35) if axis == 2 else (-0.8, 0.8))
    return figure


def plot_steps(flown: dict[str, Flown]) -> Figure:
    figure, axes = make_stack(1, f"Attitude after a step of {STEP_RAD} rad, as a share of it",
                              ("angle / step",), height=2.8)
    time_s = np.linspace(0.0, 1.0, 401)
    draw(axes[0, 0], time_s, 1.0 - np.exp(-time_s / ATTITUDE_LAG_S), color=REFERENCE_COLOUR,
         label=f"lag of first order, {ATTITUDE_LAG_S} s", **REFERENCE)
    for index, (name, angle, planned) in enumerate(STEPS):
        step = measure_step(flown[planned.name].true, angle)
        rows = (step.time_s > -0.1) & (step.time_s < 1.0)
        draw(axes[0, 0], step.time_s[rows], step.share[rows], **style_of(index, STEPS), label=name)
        axes[0, 0].plot([step.rise_s], [TIME_CONSTANT_SHARE], "o", color=colour_of(index))
    axes[0, 0].axhline(TIME_CONSTANT_SHARE, color="#999999", linewidth=0.8)
    axes[0, 0].set_xlabel("time since the step (s)")
    return figure


def plot_formula(flown: dict[str, Flown]) -> Figure:
    """The results of the formula as curves, those of the flights as points."""
    figure = Figure(figsize=(WIDTH_IN, 3.4), layout="constrained",
                    label="Error of the second lap: linear formula (lines), flights (points)")
    axes = figure.subplots(1, 2, sharey=True)
    for one, key, label in ((axes[0], "delay_s", "delay of the force (s)"),
                            (axes[1], "lag_s", "lag of the force (s)")):
        grid = np.linspace(0.0, 0.21 if key == "delay_s" else 0.17, 60)
        for index, (gains, _) in enumerate(GAINS):
            curve = np.array([calc_formula_rms(gains, Lateness(**{key: late})) for late in grid])
            points = [(getattr(late, key), measure(flown[planned.name].true).rms_m)
                      for name, late, planned in LATE
                      if name == gains and (getattr(late, key) or late == Lateness())]
            for axis, style in ((0, "--"), (1, "-")):
                one.plot(grid, curve[:, axis], style, color=colour_of(index),
                         label=f"{gains} gains, {'xy'[axis]}")
                one.plot([late for late, _ in points], [rms[axis] for _, rms in points], "o",
                         color=colour_of(index), markersize=4.5)
        one.set(xlabel=label, xlim=(0.0, grid[-1]), ylim=(0.0, None))
    axes[0].set_ylabel("rms (m)")
    return figure


def draw_pictures(flown: dict[str, Flown], published: Sequence[float]) -> dict[str, Figure]:
    """All pictures of this chapter, by file name."""
    laps = [cut_eight(shift_to_published(flown[name].seen, name), name)
            for name in ("px4_fitted", "px4_published")]
    return {"px4_plan": plot_plan([cut_eight(flown[name].seen, name)
                                   for name in ("px4_fitted", "px4_published")]),
            "px4_errors": plot_lap_errors(laps, published), "px4_step": plot_steps(flown),
            "px4_formula": plot_formula(flown)}


# --- tables and numbers of the page ---------------------------------------------------------------

ERROR_HEADER = ("rms x", "rms y", "rms z", "max x", "max y", "max z")


def make_ingredient_table(flown: dict[str, Flown], published: Sequence[str],
                          pick: Callable[[Flown], Trajectory]) -> str:
    rows = [[f"`{name}`: {adds}",
             *list_error_cells(measure(shift_to_published(pick(flown[name]), name))), prototype]
            for name, adds, prototype in INGREDIENTS]
    return make_markdown_table(("second lap, z about −0.5", *ERROR_HEADER, "prototype's rms"),
                               [["published: PX4 SITL", *published, "–", "–"], *rows])


def make_bought_table(flown: dict[str, Flown]) -> str:
    listed = [("px4_fitted", "`px4_fitted`"),
              ("px4_published", "no tilt and yaw error (`px4_published`)"), *((planned.name, text) for planned, text in BOUGHT)]
    return make_markdown_table(
        ("`px4_fitted` with … (second lap, true, z as commanded)", *ERROR_HEADER),
        [[text, *list_error_cells(measure(flown[name].true))] for name, text in listed])


def make_formula_table(flown: dict[str, Flown]) -> str:
    rows = []
    for gains, late, planned in LATE:
        flight, formula = measure(flown[planned.name].true).rms_m, calc_formula_rms(gains, late)
        rows.append([gains, f"{late.delay_s:g}", f"{late.lag_s:g}", format_error(flight[0]),
                     format_error(formula[0]), format_error(flight[1]), format_error(formula[1])])
    return make_markdown_table(("gains", "delay s", "lag s", "rms x flown", "formula",
                                "rms y flown", "formula"), rows)


def calc_worst_share(flown: dict[str, Flown]) -> float:
    """Largest difference between formula and flight, as a share."""
    return max(float(np.max(np.abs(calc_formula_rms(gains, late)
                                   / measure(flown[planned.name].true).rms_m[:2] - 1.0)))
               for gains, late, planned in LATE)


def make_margin_table(recordings: Path) -> str:
    rows = []
    for vehicle, gains, mission, planned in MARGINS:
        margin = load_margin(planned, recordings)
        rows.append([f"`{vehicle}`", mission, gains, f"{margin.holds_s:g}",
                     f"{margin.loses_s:g}", f"{margin.lost_at_s:.1f}",
                     format_error(margin.worst_error_m)])
    return make_markdown_table(("vehicle", "mission", "gains", "holds with s", "loses with s",
                                "lost at s", "largest error with no added delay, m"), rows)


def make_values(flown: dict[str, Flown], recordings: Path,
                published: Sequence[str]) -> dict[str, str]:
    """The values of this chapter by the names of their markers."""
    def describe_limit(gains: str, lag_s: float) -> str:
        late = Lateness(lag_s=lag_s)
        return f"{calc_stability_limit(make_chain(gains), lag_s) - calc_hold(late):.3f}"

    measured = measure(shift_to_published(flown["px4_fitted"].seen, "px4_fitted"))
    gaps = [abs(ours - float(theirs)) for ours, theirs in zip(
        [*measured.rms_m, *measured.max_m[:2]], published)]
    lossy, lossless = (measure(flown[name].true).rms_m[2]
                       for name in ("px4_attitude", WITHOUT_LOSS.name))
    force = flown["px4_published"].true.f_Q_W
    tilt = np.degrees(np.arccos(-force[:, 2] / np.linalg.norm(force, axis=1)))
    rises = [measure_step(flown[planned.name].true, angle).rise_s for _, angle, planned in STEPS]
    values = {
        "px4_seen_table": make_ingredient_table(flown, published, lambda one: one.seen),
        "px4_true_table": make_ingredient_table(flown, published, lambda one: one.true),
        "px4_rms_gap": f"{1000.0 * max(gaps[:3]):.0f}",
        "px4_max_gap": f"{1000.0 * max(gaps[3:]):.0f}",
        "px4_tilt": f"{np.nanmax(tilt):.0f}",
        "px4_loss": format_error(lossy), "px4_no_loss": format_error(lossless),
        "px4_rise_roll": f"{rises[0]:.3f}", "px4_rise_pitch": f"{rises[1]:.3f}",
        "px4_formula_table": make_formula_table(flown),
        "px4_worst_share": f"{100.0 * calc_worst_share(flown):.1f}",
        "px4_margin_table": make_margin_table(recordings),
        "px4_bought_table": make_bought_table(flown),
    }
    for gains, _ in GAINS:
        values[f"px4_limit_{gains}"] = describe_limit(gains, 0.0)
        values[f"px4_limit_{gains}_lag"] = describe_limit(gains, ATTITUDE_LAG_S)
    return values
