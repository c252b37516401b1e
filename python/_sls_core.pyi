"""Types of the extension module. Users import the package sls, which documents each name."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from sls.errors import ConfigError as ConfigError, RunError as RunError

FAULTS: tuple[str, ...]

Vector = tuple[float, float, float]

class Vehicle:
    """Masses and rod of one vehicle of a scenario."""

    quad_mass_kg: float
    load_mass_kg: float
    rod_length_m: float
    gravity_m_s2: float

class Scenario:
    """All parameters of a flight. Made by sls.load_scenario."""

    def __init__(self, file: str | None = None, text: str = "", folder: str = "",
                 changes: Mapping[str, str] = ...) -> None: ...
    text: str  # YAML: a file with this text in `folder` gives the same scenario
    sha256: str
    name: str
    folder: str  # paths in the scenario are relative to it
    period_s: float  # control period, s
    step_s: float  # integration step of the plant, s
    law: str
    plant: str
    vehicle: Vehicle
    vehicles: tuple[Vehicle, ...]  # every vehicle, by id
    controller_model: Vehicle  # the vehicle parameters that the controller uses
    force_limit_n: float
    stages: tuple[tuple[str, str, float | None, float | None], ...]  # of the mission: (kind, name, for_s, lap_s)

class Reference(NamedTuple):
    """The desired motion of the load at one instant, as vectors in W."""

    position: Vector  # m
    velocity: Vector  # m/s
    acceleration: Vector  # m/s²
    jerk: Vector  # m/s³
    snap: Vector  # m/s⁴

class Now(NamedTuple):
    """The inputs of a control law, for one vehicle at one step. Frame W, z down."""

    step: int  # number k of the control period, from 0
    time_s: float
    period_s: float
    vehicle_id: int
    stage: int  # index into the mission
    stage_time_s: float
    quad_position: Vector  # m
    quad_velocity: Vector  # m/s
    load_position: Vector  # m
    load_velocity: Vector  # m/s
    alpha: float  # angle of the rod about x, rad
    beta: float  # angle of the rod about y, rad
    alpha_rate: float  # rad/s
    beta_rate: float  # rad/s
    attitude: tuple[float, float, float, float] | None  # w x y z, body to W; None if the plant has no attitude
    body_rates: Vector | None  # in the body frame, rad/s; None if the plant has no attitude
    signals: tuple[float, ...]  # signals of the plant, in the plant's order
    reference: Reference
    memory: tuple[float, ...]  # the memory that the law returned at the step before; zeros at step 0

class FlightTable:
    vehicle_ids: list[int]
    failure: str
    last_step: int
    columns: list[tuple[str, str, int, str]]
    certificate: str
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
    truth: dict[str, np.ndarray]
    measured: dict[str, np.ndarray]
    counters: dict[str, np.ndarray]
    constants: dict[str, Any]
    signal_names: list[str]

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
                 vehicles: str, follow: bool, qos: str, domain: int, log_level: str, patience_s: float) -> None: ...
    def run(self) -> None: ...
    def stop(self) -> None: ...

def fly(scenario: Scenario,
        controller: Callable[[Now], Any] | Mapping[int, Callable[[Now], Any]] | None = None,
        vehicle: int | None = None, check_purity: bool = False) -> FlightTable: ...
def inspect_recording(folder: str) -> tuple[int, str, list[str]]: ...
def compare_recordings(a: str, b: str) -> tuple[str | None, list[str]]: ...
def read_table(path: str, header: str, text: set[str], wanted: set[str] | None = None) -> list[Any]: ...
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
