"""One number that says how well a recorded flight went: `measure(Recording(DIR), "load_error_rms_m", vehicle_id=0)`.

The names are those of the columns of campaigns. _sls_core computes; definitions: common/model/README.md, "Measures".
This module chooses the rows: those of a stage or a window, up to the last one with an answer."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from sls.core import load_core
from sls.input_error import InputError
from sls.recordings import RecordedVehicle, Recording, align

if TYPE_CHECKING:
    from _sls_core import Vehicle

AXES = ("x", "y", "z")
NORM = 3
"""The component of a vector's length, after x, y and z."""
ROWS = ("stage", "window_s")


class NotFlown(InputError):
    """The recording has no rows of the stage or window, for example because the flight ended before."""


@dataclass(frozen=True)
class Measured:
    value: float
    """In `unit`. Infinite: not settled, or never lost."""
    unit: str
    """Empty for a share and a count."""
    step: int | None
    """The step at which the value was reached first, or from which on it holds; None if there is none."""
    time_s: float | None
    """Simulation time of that step."""


@dataclass(frozen=True)
class Rows:
    """The chosen rows of one vehicle."""

    recording: Recording
    vehicle: RecordedVehicle
    name: str
    """Of the measure, for errors."""
    rows: np.ndarray
    """Indices into the rows of state.csv."""
    place: str
    """Stage and window, for errors."""
    component: int
    """0, 1, 2 or NORM."""
    within_m: float | None
    for_s: float

    def fail(self, expected: str, got: object) -> InputError:
        return InputError(f"{self.recording.folder}: {self.name}: expected {expected}, got {got}")

    @property
    def time_s(self) -> np.ndarray:
        return self.vehicle.time_s[self.rows]

    @cached_property
    def model(self) -> "Vehicle":
        """Masses and rod of the vehicle."""
        scenario = load_core().Scenario(text=self.recording.scenario_text, folder=str(self.recording.folder))
        return scenario.vehicles[self.vehicle.vehicle_id]

    def having(self, values: np.ndarray, what: str) -> "Rows":
        """The rows in which `values`, a column of all rows, are there. Raises NotFlown if there are none."""
        rows = self.rows[np.isfinite(values[self.rows])]
        if not len(rows):
            raise NotFlown(f"{self.recording.folder}: {self.name}: expected steps{self.place} {what}, got none")
        return replace(self, rows=rows)

    def pick(self, value: Any, sample: int | None) -> Measured:
        """A measure whose worst row is the `sample`-th, or the last one if the load never settled."""
        row = None if sample is None else self.rows[-1 if math.isinf(value) else sample]
        return Measured(float(value), MEASURES[self.name].unit,
                        None if row is None else int(self.vehicle.state["step"][row]),
                        None if row is None else float(self.vehicle.time_s[row]))

    def pick_largest(self, values: np.ndarray) -> Measured:
        return self.pick(*load_core().find_largest(values))

    def calc_load_error(self) -> np.ndarray:
        return self.vehicle.trajectory.calc_error()[self.rows]

    def calc_quad_error(self) -> np.ndarray:
        """Position of the quadrotor minus the one with which the load follows its reference exactly, (n, 3), m."""
        steps = self.vehicle.state["step"][self.rows]
        acceleration = align(steps, self.vehicle.reference, ("ref_ax_m_s2", "ref_ay_m_s2", "ref_az_m_s2"))
        wanted = load_core().calc_quad_reference(self.vehicle.trajectory.p_WL_ref[self.rows], acceleration, self.model)
        return self.vehicle.quad_position[self.rows] - wanted


def answered(chosen: Rows) -> Rows:
    """The rows with a reference. Raises NotFlown if there are none."""
    return chosen.having(chosen.vehicle.trajectory.p_WL_ref[:, 0], "with a reference")


def measure_error(calc: Callable[[Rows], np.ndarray], statistic: str) -> Callable[[Rows], Measured]:
    def measure(chosen: Rows) -> Measured:
        chosen = answered(chosen)
        rms, largest, worst, end = load_core().calc_errors(calc(chosen))
        at = chosen.component
        if statistic == "end":
            return chosen.pick(end[at], -1)
        return chosen.pick((rms if statistic == "rms" else largest)[at], worst[at])
    return measure


def check_step(chosen: Rows) -> Rows:
    """The rows with a reference. Raises InputError unless they are a step to a constant target."""
    chosen = answered(chosen)
    flight = chosen.vehicle.trajectory
    reference = flight.p_WL_ref[chosen.rows]
    if not np.all(reference == reference[0]):
        raise chosen.fail("a constant reference, such as that of a stage hold or set_point", "one that moves")
    if any(stage.first == chosen.rows[0] and flight.time_s[stage.first] > stage.start_s for stage in flight.stages):
        raise chosen.fail("rows from the start of the stage on", f"none before {chosen.time_s[0]:g} s")
    return chosen


def pick_of_step(chosen: Rows, values: Any, samples: Any) -> Measured:
    if math.isnan(values[chosen.component]):
        raise chosen.fail("a stage that begins at least 0.01 m from its target", "a smaller distance")
    return chosen.pick(values[chosen.component], samples[chosen.component])


def measure_settling(chosen: Rows) -> Measured:
    if chosen.within_m is None:
        chosen = check_step(chosen)
        if math.isfinite(chosen.for_s):
            raise chosen.fail("within_m beside for_s", "for_s alone")
        return pick_of_step(chosen, *load_core().calc_steps(chosen.time_s, chosen.calc_load_error())[:2])
    chosen = answered(chosen)
    return chosen.pick(*load_core().calc_settling(chosen.time_s, chosen.calc_load_error(), chosen.component,
                                                  chosen.within_m, chosen.for_s))


def measure_overshoot(chosen: Rows) -> Measured:
    chosen = check_step(chosen)
    return pick_of_step(chosen, *load_core().calc_steps(chosen.time_s, chosen.calc_load_error())[2:])


def measure_force(chosen: Rows) -> Measured:
    force = chosen.vehicle.trajectory.f_Q_W
    chosen = chosen.having(force[:, 0], "with an answer")
    _, largest, worst, _ = load_core().calc_errors(force[chosen.rows])
    return chosen.pick(largest[chosen.component], worst[chosen.component])


def measure_tilt(chosen: Rows) -> Measured:
    vehicle = chosen.vehicle
    rod = vehicle.load_position[chosen.rows] - vehicle.quad_position[chosen.rows]
    return chosen.pick_largest(load_core().calc_rod_tilt(rod))


def measure_attitude(chosen: Rows) -> Measured:
    attitude = chosen.vehicle.attitude
    if attitude is None:
        raise chosen.fail("a plant with an attitude", "a recording without the columns att_w to att_z")
    return chosen.pick_largest(load_core().calc_body_tilt(attitude[chosen.rows]))


def measure_energy(chosen: Rows) -> Measured:
    of = chosen.vehicle
    return chosen.pick_largest(load_core().calc_energy(
        *(values[chosen.rows] for values in (of.quad_position, of.quad_velocity, of.load_position, of.load_velocity)),
        chosen.model))


def measure_saturation(chosen: Rows) -> Measured:
    body = chosen.vehicle.trajectory.body
    plant = chosen.recording.scenario.get("plant", {})
    if body is None or not body.rotor_speed_set.shape[1] or "rotors" not in plant:
        raise chosen.fail("the plant multirotor", "a recording without rotors and their limits")
    least, most = (np.array([rotor.get(key, plant["rotor"].get(key, 0)) for rotor in plant["rotors"]], dtype=float)
                   for key in ("min_speed_rad_s", "max_speed_rad_s"))
    asked = body.rotor_speed_set[chosen.rows]
    return pick_share(chosen, np.any((asked <= least) | (asked >= most), axis=1), len(chosen.rows))


def pick_share(chosen: Rows, is_hit: np.ndarray, whole: float) -> Measured:
    """The number of hits over `whole`, and the first of them."""
    hits = np.flatnonzero(is_hit)
    return chosen.pick(len(hits) / whole, hits[0] if len(hits) else None)


def find_late(chosen: Rows) -> np.ndarray:
    """True for each row of state.csv without an answer in time: the last force or the fail-safe force acts."""
    command = chosen.vehicle.command
    late = command["step"][np.isin(command["fault"], ("held", "fail_safe"))]
    return np.isin(chosen.vehicle.state["step"], late)


def measure_late_steps(chosen: Rows) -> Measured:
    return pick_share(chosen, find_late(chosen)[chosen.rows], 1)


def measure_answer_age(chosen: Rows) -> Measured:
    steps, is_late = chosen.vehicle.state["step"], find_late(chosen)
    answered_step = np.maximum.accumulate(np.where(is_late, steps[0] - 1, steps))
    period_ms = 1e3 * chosen.recording.manifest["period_s"]
    return chosen.pick_largest((steps - answered_step)[chosen.rows] * period_ms)


def measure_loss(chosen: Rows) -> Measured:
    outcome = chosen.recording.manifest["outcome"]
    if outcome == "finished":
        return chosen.pick(math.inf, None)
    if outcome != "failed":
        raise chosen.fail("a flight that finished or failed", f"outcome {outcome}")
    return chosen.pick(chosen.time_s[-1], -1)


@dataclass(frozen=True)
class MeasureKind:
    name: str
    unit: str
    options: tuple[str, ...]
    """Keyword arguments of `measure` that it takes."""
    description: str
    """One line."""
    calc: Callable[[Rows], Measured]


def make_errors(body: str, calc: Callable[[Rows], np.ndarray], reference: str) -> list[MeasureKind]:
    texts = {"rms": "root mean square of the", "max": "largest", "end": "last"}
    return [MeasureKind(f"{body}_error_{statistic}_m", "m", ("axis", *ROWS),
                        f"{text} distance of the {name} from {reference}", measure_error(calc, statistic))
            for name in [{"load": "load", "quad": "quadrotor"}[body]] for statistic, text in texts.items()]


MEASURES = {kind.name: kind for kind in (
    *make_errors("load", Rows.calc_load_error, "its reference"),
    *make_errors("quad", Rows.calc_quad_error, "its place above a load that follows the reference exactly"),
    MeasureKind("settling_s", "s", ("axis", *ROWS, "within_m", "for_s"),
                "time until the load stays within within_m of its reference, for for_s or to the end; "
                "without within_m: within 2 % of the step of a stage with a constant reference", measure_settling),
    MeasureKind("overshoot", "", ("axis", *ROWS),
                "largest distance of the load beyond its target, as a share of the step", measure_overshoot),
    MeasureKind("tilt_max_rad", "rad", ROWS, "largest angle of the rod from straight down", measure_tilt),
    MeasureKind("attitude_max_rad", "rad", ROWS, "largest angle of the body's z axis from straight down",
                measure_attitude),
    MeasureKind("force_max_n", "N", ("axis", *ROWS), "largest force answered", measure_force),
    MeasureKind("energy_max_j", "J", ROWS,
                "largest kinetic plus potential energy of quadrotor and load as points, 0 at rest at z = 0",
                measure_energy),
    MeasureKind("rotor_saturation", "", ROWS, "share of the steps with the set-point of a rotor at a limit",
                measure_saturation),
    MeasureKind("late_steps", "", ROWS, "number of steps without an answer in time", measure_late_steps),
    MeasureKind("answer_age_max_ms", "ms", ROWS, "largest age of the state that the acting answer is for",
                measure_answer_age),
    MeasureKind("time_of_loss_s", "s", (), "time of the last answered step of a flight that failed; infinite if it "
                "finished", measure_loss))}


def measure(recording: Recording, name: str, *, vehicle_id: int, stage: int | None = None,
            window_s: tuple[float, float] | None = None, axis: str | None = None, **options: float) -> Measured:
    """The measure `name` of one vehicle. `stage` is an index into the mission, `window_s` a span of simulation time,
    ends included; without them the whole flight counts. Without `axis` a vector's length counts.

    Raises InputError, of one line, if the recording has no such measure; NotFlown if it has no such rows."""
    place = f"{recording.folder}: {name}"
    if name not in MEASURES:
        raise InputError(f"{recording.folder}: expected a measure, one of {', '.join(MEASURES)}; got {name!r}")
    given = {"stage": stage, "window_s": window_s, "axis": axis, **options}
    for option in (option for option, value in given.items() if value is not None):
        if option not in MEASURES[name].options:
            raise InputError(f"{place}: expected {' or '.join(MEASURES[name].options) or 'no option'}, got {option}")
    if axis is not None and axis not in AXES:
        raise InputError(f"{place}: axis: expected x, y or z, got {axis!r}")
    vehicle = recording.vehicle(vehicle_id)
    rows = find_rows(vehicle, stage, window_s)
    of = "" if stage is None else f" of stage {stage}"
    of += "" if window_s is None else f" in {window_s[0]:g} s to {window_s[1]:g} s"
    if not len(rows):
        raise NotFlown(f"{place}: expected steps{of}, got none in the answered steps of the flight, "
                       f"{vehicle.time_s[0]:g} s to {vehicle.time_s[-1]:g} s")
    return MEASURES[name].calc(Rows(recording, vehicle, name, rows, of, NORM if axis is None else AXES.index(axis),
                                    options.get("within_m"), options.get("for_s", math.inf)))


def find_rows(vehicle: RecordedVehicle, stage: int | None, window_s: tuple[float, float] | None) -> np.ndarray:
    """Indices into the rows of state.csv, up to the last one with an answer."""
    flight = vehicle.trajectory
    known = np.flatnonzero(np.isfinite(flight.p_WL_ref[:, 0]))
    is_chosen = np.arange(len(flight.time_s)) <= (known[-1] if len(known) else -1)
    if stage is not None:
        is_of_stage = np.zeros_like(is_chosen)
        for flown in flight.stages:
            is_of_stage[flown.rows] |= flown.index == stage
        is_chosen &= is_of_stage
    if window_s is not None:
        slack_s = 1e-6 * flight.period_s  # k × period is rounded
        is_chosen &= (flight.time_s >= window_s[0] - slack_s) & (flight.time_s <= window_s[1] + slack_s)
    return np.flatnonzero(is_chosen)
