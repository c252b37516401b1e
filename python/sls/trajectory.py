"""A flight in the form that figures and metrics use, for all sources of flights.

Frame W everywhere: x forward, y right, z down; SI units, radians. Arrays have a row per instant;
values that a source does not hold are NaN."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from sls.columns import Columns


@dataclass(frozen=True)
class Stage:
    """The rows [first, end) in which one stage of the mission was flown."""

    index: int
    name: str
    first: int
    end: int
    start_s: float
    """Start of the stage. It is before the first row if the recorder joined later."""
    duration_s: float = math.inf
    """Planned duration of a timed stage."""
    lap_s: float | None = None
    """Duration of a lap of a figure eight."""

    @property
    def rows(self) -> slice:
        return slice(self.first, self.end)


@dataclass(frozen=True)
class Body:
    """Motion of a plant with attitude and rotors, and its set-points."""

    q_WB: np.ndarray
    """Attitude, (n, 4), w x y z."""
    q_WB_set: np.ndarray
    """Its set-point, (n, 4)."""
    w_WB_B: np.ndarray
    """Body rates, (n, 3), rad/s."""
    rotor_speed: np.ndarray
    """(n, rotors), rad/s."""
    rotor_speed_set: np.ndarray
    """Set-points, (n, rotors), rad/s."""
    thrust: np.ndarray
    """Thrust of all rotors, (n,), N."""
    thrust_set: np.ndarray
    """Set-point of the thrust, (n,), N."""
    rod_tension: np.ndarray
    """Of the rod or of the own cable, (n,), N."""


@dataclass(frozen=True)
class Cable:
    """The cable of a vehicle, and the load that this vehicle carries alone or with others."""

    tension: np.ndarray
    """(n,), N; NaN before the first step."""
    length: np.ndarray
    """(n,), m."""
    distance: np.ndarray
    """Distance of its ends, (n,), m."""
    is_slack: np.ndarray
    """(n,), neither taut nor cut."""
    is_cut: np.ndarray
    """(n,)"""
    q_WL: np.ndarray
    """Attitude of the load, (n, 4), w x y z."""
    p_WC: np.ndarray
    """Centre of mass of the load, (n, 3), m."""


@dataclass(frozen=True)
class Trajectory:
    name: str
    time_s: np.ndarray
    """(n,), rising."""
    p_WQ: np.ndarray
    """Quadrotor position, (n, 3), m."""
    p_WL: np.ndarray
    """Load position, (n, 3), m."""
    p_WL_ref: np.ndarray
    """Desired position of the load, (n, 3), m."""
    alpha: np.ndarray
    """Rod angle about x, (n,), rad."""
    beta: np.ndarray
    """Rod angle about y, (n,), rad."""
    f_Q_W: np.ndarray
    """Force on the quadrotor that the controller answers, (n, 3), N."""
    stages: tuple[Stage, ...] = ()
    period_s: float = math.nan
    """Control period; NaN: not known."""
    notes: tuple[str, ...] = ()
    """Missing parts, a line each."""
    body: Body | None = None
    """None if the source has no attitude and no rotors."""
    cable: Cable | None = None
    """None for a rod."""

    def cut(self, rows: np.ndarray, name: str) -> "Trajectory":
        """These rows as a flight of its own, which starts at time 0, without stages, body and cable."""
        columns = {key: getattr(self, key)[rows] for key in ("p_WQ", "p_WL", "p_WL_ref", "alpha", "beta", "f_Q_W")}
        return replace(self, name=name, time_s=self.time_s[rows] - self.time_s[rows[0]], stages=(), body=None,
                       cable=None, **columns)

    def calc_error(self) -> np.ndarray:
        """Load position error, (n, 3), m."""
        return self.p_WL - self.p_WL_ref

    def calc_attitude(self) -> np.ndarray:
        """Roll and pitch, (n, 2), rad, that realise the force: F = -|F| R(roll, pitch, 0) e3."""
        f_x, f_y, f_z = self.f_Q_W.T
        thrust = np.linalg.norm(self.f_Q_W, axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.column_stack([np.arcsin(f_y / thrust), np.arctan2(-f_x, -f_z)])


def calc_roll_pitch_yaw(q_WB: np.ndarray) -> np.ndarray:
    """Angles (n, 3), rad, of unit quaternions (n, 4): R = Rz(yaw) Ry(pitch) Rx(roll)."""
    w, x, y, z = q_WB.T
    return np.column_stack([np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
                            np.arcsin(np.clip(2 * (w * y - x * z), -1, 1)),
                            np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))])


def calc_rod(alpha: np.ndarray, beta: np.ndarray) -> np.ndarray:
    """Unit vectors from quadrotor to load, (n, 3)."""
    return np.column_stack([np.sin(beta), -np.sin(alpha) * np.cos(beta),
                            np.cos(alpha) * np.cos(beta)])


def read_body(state: Columns) -> Body | None:
    """Takes the body from the columns of a plant with attitude or rotors; None if there are no such columns.
    At step 0 the set-points are NaN, because the autopilot has not run yet."""
    def columns(*names: str) -> np.ndarray:
        if names and set(names) <= set(state):
            return state.take(names)
        return np.full((len(state["step"]), len(names)), np.nan)

    def asked(*names: str) -> np.ndarray:
        values = columns(*names)
        values[state["step"] <= 0] = np.nan
        return values

    rotors = 0
    while f"rotor_{rotors + 1}_rad_s" in state:
        rotors += 1
    numbers = range(1, rotors + 1)
    body = Body(
        q_WB=columns("att_w", "att_x", "att_y", "att_z"),
        q_WB_set=asked("att_set_w", "att_set_x", "att_set_y", "att_set_z"),
        w_WB_B=columns("rate_x_rad_s", "rate_y_rad_s", "rate_z_rad_s"),
        rotor_speed=columns(*(f"rotor_{n}_rad_s" for n in numbers)),
        rotor_speed_set=columns(*(f"rotor_{n}_set_rad_s" for n in numbers)),
        thrust=columns("thrust_n")[:, 0],
        thrust_set=asked("thrust_set_n")[:, 0],
        rod_tension=columns("cable_tension_n" if rotors and "cable_tension_n" in state else "rod_tension_n")[:, 0])
    is_known = any(np.any(np.isfinite(getattr(body, field.name))) for field in fields(body))
    return body if is_known else None


def read_cable(state: Columns, read_scenario: Callable[[], Mapping[str, Any]], vehicle_id: int) -> Cable | None:
    """Reads the cable from the columns of the plant `cables`; None if there are no such columns. The scenario tells
    where it ends in the load."""
    if "cable_tension_n" not in state:
        return None
    cables = read_scenario()["plant"].get("cables") or []
    own = cables[vehicle_id] if vehicle_id < len(cables) else {}
    attachment = np.array(own.get("attachment_m", [0, 0, 0]), float)
    is_cut = np.asarray(state["cable_released"] if "cable_released" in state else 0 * state["cable_taut"]) != 0
    end = state.stack(("load_x_m", "load_y_m", "load_z_m"))
    q = state.stack(("load_att_w", "load_att_x", "load_att_y", "load_att_z"))
    twice = 2 * np.cross(q[:, 1:], attachment)
    turned = attachment + q[:, :1] * twice + np.cross(q[:, 1:], twice)
    return Cable(
        tension=np.where(state["step"] > 0, state["cable_tension_n"], np.nan),
        length=state["cable_length_m"],
        distance=np.linalg.norm(end - state.stack(("quad_x_m", "quad_y_m", "quad_z_m")), axis=1),
        is_slack=(state["cable_taut"] == 0) & ~is_cut, is_cut=is_cut, q_WL=q, p_WC=end - turned)


def find_spans(time_s: np.ndarray, holds: np.ndarray) -> list[tuple[float, float]]:
    """Begin and end, s, of each span of rows in which `holds` (n,) is true."""
    edges = np.flatnonzero(np.diff(holds.astype(int), prepend=0, append=0))
    return [(float(time_s[first]), float(time_s[min(end, len(time_s) - 1)]))
            for first, end in zip(edges[::2], edges[1::2])]


def find_stages(stage: np.ndarray, time_s: np.ndarray, names: Mapping[int, str],
                plans: Mapping[int, tuple[float | None, float | None]],
                starts_s: Mapping[int, float]) -> tuple[Stage, ...]:
    """Divides rows into stages. `stage` (n,): index of the stage of each row; rows with NaN belong to
    the stage before. By index of the stage: `names`; `plans` (duration and lap, s); `starts_s` of the
    stages that start before their first row."""
    known = np.flatnonzero(np.isfinite(stage))
    if not len(known):
        return ()
    begins = known[np.flatnonzero(np.diff(stage[known], prepend=-1.0))]
    stages = []
    for first, end in zip(begins, [*begins[1:], len(stage)]):
        index = int(stage[first])
        duration_s, lap_s = plans.get(index, (None, None))
        stages.append(Stage(
            index=index, name=names[index], first=int(first), end=int(end),
            start_s=starts_s.get(index, float(time_s[first])),
            duration_s=math.inf if duration_s is None else float(duration_s),
            lap_s=None if lap_s is None else float(lap_s)))
    return tuple(stages)
