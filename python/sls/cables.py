"""One load on cables from 1 to 16 vehicles, at one instant: accelerations, tensions, impacts.

    import sls
    system = sls.cables.System(vehicle_mass_kg=[0.5, 0.5], cable_length_m=[1, 1],
                               attachment_m=[[0.2, 0, 0], [-0.2, 0, 0]], load_mass_kg=0.3,
                               load_inertia_kg_m2=[[1e-4, 0, 0], [0, 4e-3, 0], [0, 0, 4e-3]])
    load = sls.cables.Load(position=[0, 0, 0], velocity=[0, 0, 0])
    vehicles = sls.cables.Vehicles(position=[[0.2, 0, -1], [-0.2, 0, -0.8]], velocity=[[0, 0, 0], [0, 0, 0]])
    system.accelerations(load, vehicles, forces=[[0, 0, -8], [0, 0, -5]]).tension_n

World axes have z down. Each vehicle is a point mass, each cable massless and inextensible. A cable is taut if the
distance from its vehicle to its point of the load is its length within `length_tolerance_m`, and it has to pull so that
this stays so: tensions are never negative. The plant `cables` computes with the same C++ code; equations:
sim_server/plants/cables/README.md."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sls.core import load_core
from sls.input_error import InputError

MOST_VEHICLES = 16


class Load(NamedTuple):
    """The motion of the load's centre of mass, and of its body axes; a point load does not turn."""

    position: ArrayLike
    """In world axes, m."""
    velocity: ArrayLike
    """m/s."""
    quaternion: ArrayLike = (1.0, 0.0, 0.0, 0.0)
    """(w, x, y, z); rotates vectors from the load into the world; of any length but 0."""
    rates: ArrayLike = (0.0, 0.0, 0.0)
    """Angular velocity in the load's axes, rad/s."""


class Vehicles(NamedTuple):
    position: ArrayLike
    """N × 3, in world axes, m."""
    velocity: ArrayLike
    """N × 3, m/s."""


class Accelerations(NamedTuple):
    load: np.ndarray
    """(3,), of the centre of mass in world axes, m/s²."""
    load_angular: np.ndarray
    """(3,), derivative of the body rates, in the load's axes, rad/s²; 0 of a point load."""
    vehicles: np.ndarray
    """N × 3, m/s²."""
    tension_n: np.ndarray
    """(N,), N, ≥ 0; 0 of a slack cable."""
    taut: np.ndarray
    """(N,), True of a cable that stays at its length."""


class Impact(NamedTuple):
    load_velocity: np.ndarray
    """(3,), after the impact, m/s."""
    load_rates: np.ndarray
    """(3,), after the impact, in the load's axes, rad/s."""
    vehicle_velocity: np.ndarray
    """N × 3, after the impact, m/s."""
    impulse_n_s: np.ndarray
    """(N,), of each cable, N·s, ≥ 0."""


class System:
    """The constants of a group. All arguments are given by name; each may be a list or an array.

    Raises InputError, one line with argument, expectation and value, if one is impossible."""

    def __init__(self, *, vehicle_mass_kg: ArrayLike, cable_length_m: ArrayLike, attachment_m: ArrayLike,
                 load_mass_kg: float, load_inertia_kg_m2: ArrayLike | None = None, gravity_m_s2: float = 9.8,
                 restitution: float = 0.0, length_tolerance_m: float = 1e-9) -> None:
        """N masses and lengths; N × 3 attachments in the load's axes, from its centre of mass; the 3 × 3 inertia of
        the load about it (None: a point load, whose attachments must be 0). `restitution` is the share of the speed
        with which ends that were stopped by their cable come back, 0 to 1."""
        mass = _to_array("vehicle_mass_kg", vehicle_mass_kg, (None,), least=1)
        self.count = len(mass)
        """Number of vehicles, N."""
        if not 1 <= self.count <= MOST_VEHICLES:
            raise InputError(f"vehicle_mass_kg: expected 1 to {MOST_VEHICLES} vehicles, got {self.count}")
        length = _to_array("cable_length_m", cable_length_m, (self.count,), least=1)
        attachment = _to_array("attachment_m", attachment_m, (self.count, 3), least=2)
        load_mass = _to_array("load_mass_kg", load_mass_kg, ())
        tolerance = _to_array("length_tolerance_m", length_tolerance_m, ())
        for name, values in (("vehicle_mass_kg", mass), ("cable_length_m", length), ("load_mass_kg", load_mass),
                             ("length_tolerance_m", tolerance)):
            if not np.all(values > 0):
                raise InputError(f"{name}: expected > 0, got {np.min(values):g}")
        gravity = float(_to_array("gravity_m_s2", gravity_m_s2, ()))
        if not 0 <= float(_to_array("restitution", restitution, ())) <= 1:
            raise InputError(f"restitution: expected 0 to 1, got {restitution}")
        inertia = None
        if load_inertia_kg_m2 is not None:
            inertia = _to_array("load_inertia_kg_m2", load_inertia_kg_m2, (3, 3))
        elif np.any(attachment):
            raise InputError("attachment_m: expected 0 for a load without load_inertia_kg_m2, which is a point; got "
                             f"{np.max(np.abs(attachment))}")
        self._core = load_core().Cables(mass, length, attachment, float(load_mass), inertia, gravity,
                                        float(restitution), float(tolerance))

    def accelerations(self, load: Any, vehicles: Any, forces: ArrayLike, *, length_rate_m_s: ArrayLike = 0.0,
                      length_acceleration_m_s2: ArrayLike = 0.0) -> Accelerations:
        """Accelerations under the `forces` on the vehicles (N × 3, N, world axes, without gravity).

        `load` is a Load, a tuple in its order or a mapping with its names; `vehicles` likewise. A cable at its length
        whose ends approach, by more than `length_tolerance_m` a second, leaves it and is slack. If they move apart,
        call `impact` first: here such a cable counts as one that just keeps its length. A winch changes the lengths by
        `length_rate_m_s` and `length_acceleration_m_s2`, of each cable or of all."""
        return Accelerations(*map(np.asarray, self._core.accelerations(
            *self._to_motion(load, vehicles), _to_array("forces", forces, (self.count, 3)),
            self._to_each("length_rate_m_s", length_rate_m_s),
            self._to_each("length_acceleration_m_s2", length_acceleration_m_s2))))

    def impact(self, load: Any, vehicles: Any, *, length_rate_m_s: ArrayLike = 0.0) -> Impact:
        """Velocities after all cables at their length have stopped what moved apart, together, with the least
        impulses: a cable pulls or its ends approach. Velocities stay if nothing moved apart. Ends move apart if they do
        so faster than their cable lengthens by `length_rate_m_s`."""
        return Impact(*map(np.asarray, self._core.impact(
            *self._to_motion(load, vehicles), self._to_each("length_rate_m_s", length_rate_m_s))))

    def _to_each(self, name: str, values: ArrayLike) -> np.ndarray:
        if np.ndim(values) == 0:
            return np.full(self.count, float(_to_array(name, values, ())))
        return _to_array(name, values, (self.count,))

    def _to_motion(self, load: Any, vehicles: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        position, velocity, quaternion, rates = _to_tuple("load", load, Load)
        turn = _to_array("load.quaternion", quaternion, (4,))
        if not np.any(turn):
            raise InputError("load.quaternion: expected a length > 0, got 0")
        turn /= np.max(np.abs(turn))  # else its square could overflow
        numbers = np.concatenate([
            _to_array("load.position", position, (3,)), _to_array("load.velocity", velocity, (3,)),
            turn / np.linalg.norm(turn), _to_array("load.rates", rates, (3,))])
        places, speeds = _to_tuple("vehicles", vehicles, Vehicles)
        shape = (self.count, 3)
        return (numbers, _to_array("vehicles.position", places, shape),
                _to_array("vehicles.velocity", speeds, shape))


def _to_tuple(name: str, given: Any, kind: Any) -> Any:
    try:
        return kind(**given) if isinstance(given, Mapping) else kind(*given)
    except TypeError:
        got = ", ".join(map(str, given)) if isinstance(given, Mapping) else (
            f"{len(given)} values" if isinstance(given, Sequence | np.ndarray) else repr(given))
        raise InputError(f"{name}: expected {', '.join(kind._fields)}, got {got}") from None


def _to_array(name: str, values: Any, shape: tuple[int | None, ...], least: int = 0) -> np.ndarray:
    """`values` with at least `least` dimensions."""
    try:
        array = np.array(values, dtype=float, ndmin=least)
    except (TypeError, ValueError):
        raise InputError(f"{name}: expected numbers, got {values!r}".replace("\n", " ")) from None
    if len(array.shape) != len(shape) or any(n not in (None, m) for n, m in zip(shape, array.shape, strict=True)):
        wanted = " × ".join("N" if n is None else str(n) for n in shape) or "a number"
        raise InputError(f"{name}: expected {wanted}, got {' × '.join(map(str, array.shape)) or 'a number'}")
    if not np.all(np.isfinite(array)):
        raise InputError(f"{name}: expected finite numbers, got {array[~np.isfinite(array)].flat[0]}")
    return array
