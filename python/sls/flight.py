"""Flights in this process."""

import os
from collections.abc import Sequence
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from sls.closed_loop import to_whole
from sls.columns import Columns
from sls.core import load_core
from sls.errors import RunError
from sls.scenario import load_scenario, read_keys
from sls.trajectory import Stage, Trajectory, find_stages, read_body, read_cable
from sls.vehicle_columns import VehicleColumns

if TYPE_CHECKING:
    from _sls_core import Now, Scenario

    from sls.recordings import Recording


class Law(Protocol):
    """A control law: it returns a force, (x, y, z) in W, N, for the measured values of a step.

    It keeps nothing between calls: equal `now` give equal answers. In the first 100 steps (in all
    steps with `check_purity`) each answer is computed twice; a law with two different answers is
    refused. It raises LawFault if it cannot compute a force."""

    def __call__(self, now: "Now") -> Sequence[float]:
        ...


class LawWithMemory(Protocol):
    """A control law with memory: it returns (force, memory). The next step has this memory as
    `now.memory`; step 0 has zeros. The other rules are those of Law."""

    memory_size: int
    """Number of memory values, 0 to 64."""

    def __call__(self, now: "Now") -> tuple[Sequence[float], Sequence[float]]:
        ...


class FlownVehicle(VehicleColumns):
    """One vehicle of a flight. Arrays have a row for each step, from step 0 to the end of the
    flight; frame W (x forward, y right, z down), SI units, radians. They are read-only views of the
    flight's memory and keep it alive; only text columns are copies."""

    def __init__(self, core: Any, index: int, scenario: "Scenario"):
        """The `index`-th vehicle of a _sls_core.FlightTable."""
        self._core = core
        self._index = index
        self.scenario = scenario
        self.vehicle_id: int = core.vehicle_ids[index]
        self._cells: np.ndarray = core.rows(index)

    @cached_property
    def _places(self) -> dict[tuple[str, str], int]:
        return {(table, name): place for table, name, place, _ in self._core.columns}

    def _make_columns(self, wanted: str) -> Columns:
        columns = {}
        for table, name, index, kind in self._core.columns:
            if table != wanted:
                continue
            cells = self._cells[:, index]
            if kind == "double":
                columns[name] = cells
            elif kind == "integer":
                columns[name] = cells.view(np.int64)
            else:
                texts = (load_core().FAULTS if kind == "fault"
                         else [stage[1] for stage in self.scenario.stages])
                columns[name] = partial(np.take, np.array(texts), cells.view(np.int64))
        return Columns(columns)

    @cached_property
    def state(self) -> Columns:
        """The columns of state.csv: the true state of quadrotor and load."""
        return self._make_columns("state")

    @cached_property
    def measured(self) -> Columns:
        """The columns of measured.csv: the measured state, which the controller receives. The columns
        of `state` if the two cannot differ."""
        if self._core.can_measurement_differ(self._index):
            return self._make_columns("measured")
        return self.state

    @cached_property
    def command(self) -> Columns:
        """The columns of command.csv except the controller's name and its compute time."""
        return self._make_columns("command")

    @cached_property
    def reference(self) -> Columns:
        """The columns of reference.csv: the desired motion of the load."""
        return self._make_columns("reference")

    def _view(self, table: str, first: str, size: int = 3) -> np.ndarray:
        index = self._places[table, first]
        return self._cells[:, index:index + size]

    @property
    def force(self) -> np.ndarray:
        """Force on the quadrotor that the controller answered, (steps, 3), N."""
        return self._view("command", "force_x_n")

    @property
    def reference_position(self) -> np.ndarray:
        """Desired position of the load, (steps, 3), m."""
        return self._view("reference", "ref_x_m")

    @cached_property
    def trajectory(self) -> Trajectory:
        """The trajectory, for figures and metrics."""
        return Trajectory(
            name=f"vehicle {self.vehicle_id}" if len(self.scenario.vehicles) > 1
            else self.scenario.name,
            time_s=self.time_s, p_WQ=self.quad_position, p_WL=self.load_position,
            p_WL_ref=self.reference_position, alpha=self.alpha, beta=self.beta,
            f_Q_W=self.force, stages=self._find_stages(), period_s=self.scenario.period_s,
            body=read_body(Columns({name: self.state[name] for name in self.state})),
            cable=read_cable(self.state, lambda: read_keys(self.scenario), self.vehicle_id))

    def _find_stages(self) -> tuple[Stage, ...]:
        plans = [(for_s, lap_s) for _, _, for_s, lap_s in self.scenario.stages]
        names = [name for _, name, _, _ in self.scenario.stages]
        return find_stages(self.reference["stage"].astype(float), self.time_s,
                           dict(enumerate(names)), dict(enumerate(plans)), {})


class Flight(FlownVehicle):
    """A flight. Its columns are those of its first vehicle; `vehicles` has all of them."""

    def __init__(self, core: Any, scenario: "Scenario"):
        super().__init__(core, 0, scenario)
        self._others = tuple(FlownVehicle(core, index, scenario)
                             for index in range(1, len(core.vehicle_ids)))

    @property
    def vehicles(self) -> tuple[FlownVehicle, ...]:
        """All vehicles, by id; the first one is the flight itself."""
        return (self, *self._others)  # made on each call: a kept cycle of references would keep the memory

    @property
    def failure(self) -> str:
        """The reason why the flight failed, in one line; empty if every mission was finished."""
        return self._core.failure

    @property
    def is_finished(self) -> bool:
        """True if every vehicle has finished its mission."""
        return not self.failure

    @property
    def last_step(self) -> int:
        """The last step that has an answer of the controller."""
        return self._core.last_step

    @property
    def certificate(self) -> str:
        """Hash of the flight, 64 lower-case hex digits: equal to that of a recording of the same flight
        by the three programs. Computed on first use."""
        return self._core.certificate

    def save(self, folder: str | os.PathLike[str], *, force: bool = False) -> "Recording":
        """Writes the recording that `./sls run --in-process` would write, into a new or empty folder.
        With `force` it replaces a recording in the folder.

        Raises ConfigError if the folder cannot be used, OSError if the disk fails."""
        from sls.recordings import Recording
        if not self._core.save(os.fspath(folder), force) and self.is_finished:
            raise RunError(f"{os.fspath(folder)}: the recording is not complete")
        return Recording(Path(folder))

    def __len__(self) -> int:
        """Number of steps with an answer of the controller."""
        return len(self._cells)

    def __repr__(self) -> str:
        end = "finished" if self.is_finished else f"failed: {self.failure}"
        return f"<sls.Flight {self.scenario.name}: {len(self)} steps, {end}>"


def fly(scenario: "Scenario | str | os.PathLike[str]",
        controller: Law | LawWithMemory | dict[int, Law | LawWithMemory] | None = None, *,
        vehicle: int | None = None, check_purity: bool = False) -> Flight:
    """Flies a scenario in this process, bit for bit as the three programs do in lockstep.

    `scenario` may also be an argument of load_scenario. `controller` replaces the scenario's law; a
    dict by vehicle id replaces that of these vehicles alone. Without `vehicle` the whole fleet flies,
    otherwise only this vehicle. `check_purity` computes each answer twice. Ctrl-C ends the flight with
    KeyboardInterrupt. Other Python threads can run during the flight.

    A mission that fails raises no exception: `failure` of the flight has the reason. Raises
    ConfigError if the scenario cannot be flown, RunError if the control law is broken."""
    if isinstance(scenario, (str, os.PathLike)):
        scenario = load_scenario(scenario)
    if isinstance(controller, dict):
        for key in controller:
            to_whole("controller: a vehicle id", key, 0, len(scenario.vehicles) - 1)
    return Flight(load_core().fly(scenario, controller, vehicle, check_purity), scenario)
