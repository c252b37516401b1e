"""A flight as figures and metrics see it, whatever file it comes from.

Frame W everywhere: x forward, y right, z down; SI units, radians. Arrays have a row per instant;
what a source does not hold is NaN."""

import math
from dataclasses import dataclass, fields

import numpy as np


@dataclass(frozen=True)
class Stage:
    """The rows [first, end) in which one stage of the mission was flown."""

    index: int
    name: str
    first: int
    end: int
    start_s: float
    """When the stage began: before its first row where the recorder joined later."""
    duration_s: float = math.inf
    """As planned, of a timed stage."""
    lap_s: float | None = None
    """Duration of a lap, of a figure eight."""

    @property
    def rows(self) -> slice:
        return slice(self.first, self.end)


@dataclass(frozen=True)
class Body:
    """What a plant with attitude and rotors does, beside what it was asked for."""

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
    """Of all rotors, (n,), N."""
    thrust_set: np.ndarray
    """Thrust asked for, (n,), N."""
    rod_tension: np.ndarray
    """(n,), N."""

    def take(self, rows: np.ndarray) -> "Body":
        return Body(**{field.name: getattr(self, field.name)[rows] for field in fields(self)})


@dataclass(frozen=True)
class Flight:
    name: str
    time_s: np.ndarray
    """(n,), rising."""
    p_WQ: np.ndarray
    """Quadrotor position, (n, 3), m."""
    p_WL: np.ndarray
    """Load position, (n, 3), m."""
    p_WL_ref: np.ndarray
    """Where the load should be, (n, 3), m."""
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
    """What is missing, a line each."""
    body: Body | None = None
    """None: the source knows a point mass alone."""

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
