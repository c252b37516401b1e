"""Types of the extension module. Users import the package sls, which documents each name."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from sls.errors import ConfigError as ConfigError, RunError as RunError

FAULTS: tuple[str, ...]

Vector = tuple[float, float, float]

class Vehicle:
    """Masses and rod of one vehicle of a scenario."""

    @property
    def quad_mass_kg(self) -> float: ...
    @property
    def load_mass_kg(self) -> float: ...
    @property
    def rod_length_m(self) -> float: ...
    @property
    def gravity_m_s2(self) -> float: ...

class Scenario:
    """All parameters of a flight. Made by sls.load_scenario."""

    def __init__(self, file: str | None = None, text: str = "", folder: str = "",
                 changes: Mapping[str, str] = ...) -> None: ...
    @property
    def text(self) -> str:
        """The scenario as YAML. A file with this text in `folder` gives the same scenario."""
    def to_text(self) -> str: ...
    @property
    def sha256(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def folder(self) -> str:
        """Paths in the scenario are relative to it."""
    @property
    def period_s(self) -> float:
        """Control period, s."""
    @property
    def step_s(self) -> float:
        """Integration step of the plant, s."""
    @property
    def law(self) -> str: ...
    @property
    def plant(self) -> str: ...
    @property
    def vehicle(self) -> Vehicle: ...
    @property
    def vehicles(self) -> tuple[Vehicle, ...]:
        """Every vehicle, by id."""
    @property
    def controller_model(self) -> Vehicle:
        """The vehicle parameters that the controller uses."""
    @property
    def force_limit_n(self) -> float: ...
    @property
    def stages(self) -> tuple[tuple[str, str, float | None, float | None], ...]:
        """The stages of the mission: (kind, name, for_s, lap_s) each."""

class Reference(tuple[Vector, ...]):
    """The desired motion of the load at one instant, as vectors in W."""

    @property
    def position(self) -> Vector:
        """m"""
    @property
    def velocity(self) -> Vector:
        """m/s"""
    @property
    def acceleration(self) -> Vector:
        """m/s²"""
    @property
    def jerk(self) -> Vector:
        """m/s³"""
    @property
    def snap(self) -> Vector:
        """m/s⁴"""

class Now(tuple[Any, ...]):
    """The inputs of a control law, for one vehicle at one step. Frame W, z down."""

    @property
    def step(self) -> int:
        """Number k of the control period, from 0."""
    @property
    def time_s(self) -> float: ...
    @property
    def period_s(self) -> float: ...
    @property
    def vehicle_id(self) -> int: ...
    @property
    def stage(self) -> int:
        """Index into the mission."""
    @property
    def stage_time_s(self) -> float: ...
    @property
    def quad_position(self) -> Vector:
        """m"""
    @property
    def quad_velocity(self) -> Vector:
        """m/s"""
    @property
    def load_position(self) -> Vector:
        """m"""
    @property
    def load_velocity(self) -> Vector:
        """m/s"""
    @property
    def alpha(self) -> float:
        """Angle of the rod about x, rad."""
    @property
    def beta(self) -> float:
        """Angle of the rod about y, rad."""
    @property
    def alpha_rate(self) -> float:
        """rad/s"""
    @property
    def beta_rate(self) -> float:
        """rad/s"""
    @property
    def attitude(self) -> tuple[float, float, float, float] | None:
        """Unit quaternion (w, x, y, z), body to W; None if the plant has no attitude."""
    @property
    def body_rates(self) -> Vector | None:
        """In the body frame, rad/s; None if the plant has no attitude."""
    @property
    def signals(self) -> tuple[float, ...]:
        """Signals of the plant, in the plant's order."""
    @property
    def reference(self) -> Reference: ...
    @property
    def memory(self) -> tuple[float, ...]:
        """The memory that the law returned at the step before; zeros at step 0."""

class FlightTable:
    @property
    def vehicle_ids(self) -> list[int]: ...
    @property
    def failure(self) -> str: ...
    @property
    def last_step(self) -> int: ...
    @property
    def columns(self) -> list[tuple[str, str, int, str]]: ...
    @property
    def certificate(self) -> str: ...
    def can_measurement_differ(self, index: int) -> bool: ...
    def rows(self, index: int) -> np.ndarray: ...
    def save(self, folder: str, force: bool) -> bool: ...

class Batch:
    def __init__(self, scenario: Scenario, count: int, threads: int, vehicle: int,
                 name: str) -> None: ...
    def step(self, force: np.ndarray) -> None: ...
    def answer(self) -> np.ndarray: ...
    def reset(self, which: list[int], seeds: list[int],
              values: Mapping[str, np.ndarray]) -> None: ...
    def calc_reference(self, times: np.ndarray) -> tuple[np.ndarray, ...]: ...
    def failure(self, loop: int) -> str: ...
    @property
    def truth(self) -> dict[str, np.ndarray]: ...
    @property
    def measured(self) -> dict[str, np.ndarray]: ...
    @property
    def counters(self) -> dict[str, np.ndarray]: ...
    @property
    def constants(self) -> dict[str, Any]: ...
    @property
    def signal_names(self) -> list[str]: ...

class Cables:
    def __init__(self, vehicle_mass: np.ndarray, length: np.ndarray, attachment: np.ndarray,
                 load_mass: float, inertia: np.ndarray | None, gravity: float, restitution: float,
                 tolerance: float) -> None: ...
    def accelerations(self, load: np.ndarray, p_WQ: np.ndarray, v_WQ: np.ndarray,
                      f_Q_W: np.ndarray, length_rate: np.ndarray,
                      length_acceleration: np.ndarray) -> tuple[np.ndarray, ...]: ...
    def impact(self, load: np.ndarray, p_WQ: np.ndarray, v_WQ: np.ndarray,
               length_rate: np.ndarray) -> tuple[np.ndarray, ...]: ...

class Client:
    def __init__(self, law: Callable[[Now], Any], scenario: Scenario, name: str, strength: int,
                 vehicles: str, follow: bool, qos: str, domain: int, log_level: str) -> None: ...
    def run(self) -> None: ...
    def stop(self) -> None: ...

def fly(scenario: Scenario,
        controller: Callable[[Now], Any] | Mapping[int, Callable[[Now], Any]] | None = None,
        vehicle: int | None = None, check_purity: bool = False) -> FlightTable: ...
def inspect_recording(folder: str) -> tuple[int, str, list[str]]: ...
def compare_recordings(a: str, b: str) -> tuple[str | None, list[str]]: ...
def read_table(path: str, header: str, text: set[str]) -> list[Any]: ...
def calc_errors(errors: np.ndarray) -> tuple[list[float], list[float], list[int], list[float]]:
    """Of x, y, z and the norm: rms, largest size, its row, last size."""
def calc_steps(time_s: np.ndarray, errors: np.ndarray) -> tuple[list[float], list[int], list[float], list[int]]:
    """Of x, y, z and the norm: settling time (s), its row, overshoot (share), its row."""
def calc_settling(time_s: np.ndarray, errors: np.ndarray, component: int, within_m: float,
                  hold_s: float) -> tuple[float, int]: ...
def calc_steady_state_error(time_s: np.ndarray, errors: np.ndarray) -> np.ndarray: ...
def find_largest(numbers: np.ndarray) -> tuple[float, int]: ...
def calc_quad_reference(position: np.ndarray, acceleration: np.ndarray, vehicle: Vehicle) -> np.ndarray: ...
def calc_energy(p_WQ: np.ndarray, v_WQ: np.ndarray, p_WL: np.ndarray, v_WL: np.ndarray,
                vehicle: Vehicle) -> np.ndarray: ...
def calc_rod_tilt(p_QL_W: np.ndarray) -> np.ndarray: ...
def calc_body_tilt(wxyz: np.ndarray) -> np.ndarray: ...
def lqr(horizontal: float, vertical: float) -> dict[str, dict[str, float]]: ...
