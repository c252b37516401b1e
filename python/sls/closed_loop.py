"""Many loops of one scenario at once: forces in, states out, as arrays. For learning and
optimisation.

    loop = sls.ClosedLoop("figure_eight.yaml", count=256)
    state = loop.reset()
    while not loop.failed.all():
        error = loop.reference().position - state.load_position
        state = loop.step(my_forces(state, error))       # (256, 3) float64

Vehicles on one load fly together; python/README.md has an example."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sls.core import load_core
from sls.errors import ConfigError
from sls.scenario import load_scenario

if TYPE_CHECKING:
    from _sls_core import Scenario

BLOCK = 32  # loops that a thread takes at once (closed_loop/batch.cpp)
WIDTHS = {"quad_position": 3, "load_position": 3, "quad_velocity": 3, "angles": 2,
          "angle_rates": 2, "attitude": 4, "body_rates": 3}
BOUNDS = {"angles": np.array([np.pi, np.pi / 2])}


@dataclass(frozen=True, eq=False)
class LoopState:
    """The states of all loops, a row for each, in frame W (x forward, y right, z down).

    Where several vehicles move together, what each vehicle has of its own has a second axis, of the
    vehicles by id: (count, vehicles, 3). The load's position is then that of the own cable's end.
    The arrays are read-only and change with each step: use `copy()` to keep values.
    """

    quad_position: NDArray[np.float64]  #: (count, 3), m
    quad_velocity: NDArray[np.float64]  #: (count, 3), m/s
    load_position: NDArray[np.float64]  #: (count, 3), m
    load_velocity: NDArray[np.float64]  #: (count, 3), m/s
    angles: NDArray[np.float64]  #: (count, 2), alpha and beta of the rod, rad
    angle_rates: NDArray[np.float64]  #: (count, 2), rad/s
    step: NDArray[np.uint64]  #: (count,), control periods since the loop's reset
    time_s: NDArray[np.float64]  #: (count,), the same in s
    failed: NDArray[np.bool_]  #: (count,), see `ClosedLoop.reason`
    #: (count, 4), unit quaternion w, x, y, z, body to W; None if the plant has no attitude
    attitude: NDArray[np.float64] | None = None
    body_rates: NDArray[np.float64] | None = None  #: (count, 3), in the body frame, rad/s; or None
    #: (count,) each: the plant's signals by name, such as `load_att_w`; empty if it has none
    signals: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class LoopReference:
    """The mission's reference at given times, in W: arrays of shape (…, 3)."""

    position: NDArray[np.float64]  #: m
    velocity: NDArray[np.float64]  #: m/s
    acceleration: NDArray[np.float64]  #: m/s²
    jerk: NDArray[np.float64]  #: m/s³
    snap: NDArray[np.float64]  #: m/s⁴


class ClosedLoop:
    """`count` loops of a scenario, each with plant, faults and sensing as in a flight.

    A loop equals, bit for bit, the flight whose controller answers the same forces, for any number
    of loops and threads. The GIL is free while the loops move.

    A loop has one vehicle, or all of a plant that moves them together (`cables`).

    A loop fails if the server would refuse its force (not finite, or larger than `force_limit_n`),
    or if its plant cannot continue. It then keeps its state until its reset; no exception is raised.
    """

    period_s: float  #: control period: each force is held for this time
    force_limit_n: float  #: `controller.force_limit_n`
    quad_mass_kg: float | NDArray[np.float64]  #: (vehicles,) if several move together; so are the next two
    load_mass_kg: float | NDArray[np.float64]
    rod_length_m: float | NDArray[np.float64]
    gravity_m_s2: float

    def __init__(self, scenario: Scenario | str | os.PathLike[str], count: int = 1, *,
                 threads: int | None = None, seeds: ArrayLike | None = None, vehicle: int = 0):
        """Puts all loops at step 0 of `scenario` (from `sls.load_scenario`, or an argument of it).

        threads: number of threads for a step; None: limited by the processors and the work.
        seeds: whole numbers ≥ 0, one for each loop, added to each seed of the scenario's faults.
            None: zeros; loops with equal forces are then equal.
        vehicle: id in the scenario's fleet; every loop flies this vehicle. Vehicles that move together
            are flown together.
        Raises ConfigError, also if the scenario cannot be read.
        """
        self._count = to_whole("count", count, 1, 10_000_000)
        if threads is None:
            threads = min(len(os.sched_getaffinity(0)), -(-self._count // BLOCK))
        self._loops = load_core().Batch(to_scenario(scenario), self._count,
                                      to_whole("threads", threads, 1, 1024),
                                      to_whole("vehicle", vehicle, 0, 255), "python")
        for name, value in self._loops.constants.items():
            setattr(self, name, value)
        counters = self._loops.counters
        self._state = self._make_state(self._loops.measured, counters)
        self._truth = self._make_state(self._loops.truth, counters)
        self._seeds = np.zeros(self._count, np.uint64)
        if seeds is not None:
            self.reset(seeds=seeds)

    def _make_state(self, rows: dict[str, NDArray[np.float64]], counters: dict[str, Any]) -> LoopState:
        signals = rows.pop("signals", None)
        return LoopState(**rows, **counters, signals={
            name: signals[..., place] for place, name in enumerate(self._loops.signal_names)})

    def __len__(self) -> int:
        return self._count

    @property
    def state(self) -> LoopState:
        """The measured states: after sensors, estimator and faults of the scenario."""
        return self._state

    @property
    def truth(self) -> LoopState:
        """The true states of the plants. Equal to `state` if the scenario does not disturb the measured states."""
        return self._truth

    @property
    def failed(self) -> NDArray[np.bool_]:
        """(count,): true for each loop that has failed. Read-only; changes with each step."""
        return self._state.failed

    def reason(self, loop: int) -> str:
        """The reason why a loop has failed, in one line; empty if it has not failed."""
        return self._loops.failure(to_whole("loop", loop, 0, self._count - 1))

    def step(self, force: ArrayLike) -> LoopState:
        """Moves each loop over one control period, with its row of `force` held constant.

        force: (count, 3), a list or a C-contiguous array of float64, on the quadrotor in W, N; of vehicles
            that move together (count, vehicles, 3). Hovering needs −(quad_mass_kg + load_mass_kg) ×
            gravity_m_s2 along z. Rows of failed loops are ignored.
        Returns `state`. Raises ConfigError for another array.
        """
        if isinstance(force, (list, tuple)):
            try:
                force = np.array(force, np.float64)
            except (TypeError, ValueError):
                raise ConfigError(f"force: expected numbers of shape {self._state.quad_position.shape}, "
                                  f"got {force!r:.60}") from None
        self._loops.step(force)
        return self._state

    def law_force(self) -> NDArray[np.float64]:
        """The forces that the scenario's law answers to `state`, as `step` takes them, N: a new array.

        Under them a loop flies as the flight does. The law's memory and its stage of the mission advance
        by one answer per step: call it in every step, also to fly only some of the vehicles with it. It
        computes in one thread. A loop whose law reports an error code fails; its forces are 0. Raises
        ConfigError if the law cannot be made."""
        return self._loops.answer()

    def reset(self, indices: ArrayLike | None = None, *, seeds: ArrayLike | None = None,
              **initial: ArrayLike) -> LoopState:
        """Puts loops back to step 0.

        indices: whole numbers, or a mask (count,) such as `failed`; None: all.
        seeds: as in the constructor, for these n loops; None: unchanged. New seeds give new noise.
        initial: initial values, each of shape (n, k) or (k,) for all: quad_position or
            load_position (3, m), quad_velocity (3, m/s), angles and angle_rates (2, rad, rad/s);
            for plants with attitude also attitude (4, unit quaternion) and body_rates (3, rad/s).
            Other values are those of the scenario. Vehicles that move together begin as the scenario
            says with these values in `plant.initial`.
        Returns `state`. Raises ConfigError for values that the plant refuses; no loop changes then.
        """
        which = self._to_indices(indices)
        new_seeds = self._seeds[which] if seeds is None else _to_seeds(seeds, len(which))
        if "quad_position" in initial and "load_position" in initial:
            raise ConfigError("reset: expected quad_position or load_position, got both")
        values = {name: _to_rows(name, value, len(which)) for name, value in initial.items()}
        self._loops.reset(which.tolist(), new_seeds.tolist(), values)
        self._seeds[which] = new_seeds
        return self._state

    def reference(self, time_s: ArrayLike | None = None) -> LoopReference:
        """The mission's reference `time_s` (any shape, s) after step 0; None: the present time of
        each loop. Vehicles that move together have an axis of their own: (…, vehicles, 3).

        Stages follow each other by their time. A stage that ends by a condition has no known end:
        here it is the last stage.
        """
        times = np.ascontiguousarray(self._state.time_s if time_s is None else time_s, np.float64)
        derivatives = self._loops.calc_reference(times.reshape(-1))
        shape = times.shape + self._state.quad_position.shape[1:]
        return LoopReference(*(rows.reshape(shape) for rows in derivatives))

    def _to_indices(self, indices: ArrayLike | None) -> NDArray[np.int64]:
        if indices is None:
            return np.arange(self._count)
        which = np.atleast_1d(np.asarray(indices))
        if which.dtype == bool and which.shape == (self._count,):
            return np.flatnonzero(which)
        if which.size == 0:
            return np.zeros(0, np.int64)
        if which.ndim != 1 or which.dtype.kind not in "iu":
            raise ConfigError(f"indices: expected whole numbers or a mask of shape "
                              f"({self._count},), got {which.dtype} of shape {which.shape}")
        if which.min() < 0 or which.max() >= self._count:
            raise ConfigError(f"indices: expected from 0 to {self._count - 1}, got "
                              f"{which.min() if which.min() < 0 else which.max()}")
        return which.astype(np.int64)


def to_scenario(scenario: Scenario | str | os.PathLike[str]) -> Scenario:
    """The scenario itself, or the one that `sls.load_scenario` reads. Raises ConfigError."""
    if isinstance(scenario, (str, os.PathLike)):
        return load_scenario(scenario)
    if not isinstance(scenario, load_core().Scenario):
        raise ConfigError("scenario: expected one of sls.load_scenario, or the path of a file, got "
                          f"{type(scenario).__name__}")
    return scenario


def to_whole(name: str, value: int, least: int, most: int) -> int:
    """`value` as an int. Raises ConfigError unless it is a whole number from `least` to `most`."""
    if not isinstance(value, (int, np.integer)) or isinstance(value, bool) \
            or not least <= value <= most:
        raise ConfigError(f"{name}: expected a whole number from {least} to {most}, got {value!r}")
    return int(value)


def _to_seeds(seeds: ArrayLike, count: int) -> NDArray[np.uint64]:
    numbers = np.atleast_1d(np.asarray(seeds))
    if numbers.shape != (count,) or numbers.dtype.kind not in "iu" or (numbers < 0).any():
        raise ConfigError(f"seeds: expected {count} whole numbers >= 0, got "
                          f"{numbers.dtype} of shape {numbers.shape}"
                          + (f", the least {numbers.min()}" if numbers.size else ""))
    return numbers.astype(np.uint64)


def _to_rows(name: str, value: ArrayLike, count: int) -> NDArray[np.float64]:
    """`value` as an array (count, k), where k is the number of components of `name`."""
    if name not in WIDTHS:
        raise ConfigError(f"reset: {name}: expected one of {', '.join(WIDTHS)}")
    shape = (count, WIDTHS[name])
    try:
        numbers = np.asarray(value, np.float64)
    except (TypeError, ValueError):
        raise ConfigError(f"reset: {name}: expected numbers, got {value!r}") from None
    if numbers.shape not in (shape, shape[1:]):
        raise ConfigError(f"reset: {name}: expected numbers of shape {shape} or {shape[1:]}, got "
                          f"{numbers.shape}")
    rows = np.ascontiguousarray(np.broadcast_to(numbers, shape))
    if not np.isfinite(rows).all():
        raise ConfigError(f"reset: {name}: expected finite numbers, got "
                          f"{rows[~np.isfinite(rows)][0]}")
    if name in BOUNDS and (np.abs(rows) > BOUNDS[name]).any():
        row = rows[(np.abs(rows) > BOUNDS[name]).any(axis=1)][0]
        raise ConfigError(f"reset: {name}: expected alpha from -pi to pi and beta from -pi/2 to "
                          f"pi/2, got {row.tolist()}")
    if name == "attitude" and (np.abs(np.linalg.norm(rows, axis=1) - 1) > 1e-6).any():
        raise ConfigError("reset: attitude: expected unit quaternions w, x, y, z, got another "
                          "length")
    return rows
