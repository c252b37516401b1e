"""Stability of a group under the law `cooperative` whose forces act late, for small motions about rest. The plant is
linearised through sls.cables, the law by hand from the equations of control_client/laws/cooperative/README.md. Arrays
have a row for each vehicle; world z is down."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy import linalg

from sls import cables
from sls.scenario import read_keys

if TYPE_CHECKING:
    from _sls_core import Scenario

GAINS = {"position": 4.0, "velocity": 4.0, "attitude": 9.0, "rates": 6.0, "cable_angle": 225.0, "cable_rate": 30.0}
STEP = 1e-5  # of central differences
MOST_PERIODS = 250


@dataclass(frozen=True, eq=False)
class Team:
    """A rigid load and its vehicles. The law knows all of it, but takes the vehicles' masses as `believed_kg`. The team
    rests level, also if these differ."""

    mass_kg: np.ndarray
    believed_kg: np.ndarray
    length_m: np.ndarray
    attachment_m: np.ndarray
    load_mass_kg: float
    inertia_kg_m2: np.ndarray  # 3 × 3
    spread_rad: float
    gravity_m_s2: float
    gains: dict[str, float]

    @property
    def count(self) -> int:
        return len(self.mass_kg)

    # --- rest -------------------------------------------------------------------------------------

    @cached_property
    def arms(self) -> np.ndarray:
        """σ of (6) in the law's README."""
        return self.attachment_m - self.attachment_m.mean(axis=0)

    @cached_property
    def spread_inverse(self) -> np.ndarray:
        """S⁻¹ of (6)."""
        return np.linalg.inv(sum(arm @ arm * np.eye(3) - np.outer(arm, arm) for arm in self.arms))

    @cached_property
    def weight(self) -> np.ndarray:
        """F of (2) at rest, N."""
        return np.array([0.0, 0.0, -self.load_mass_kg * self.gravity_m_s2])

    @cached_property
    def pulls(self) -> np.ndarray:
        """μ at rest, N: (6) and (7)."""
        level = self.arms * [1.0, 1.0, 0.0]
        outwards = (-self.weight[2] / self.count * np.tan(self.spread_rad)
                    * level / np.linalg.norm(level, axis=1).max())
        turn = self.spread_inverse @ np.cross(self.arms, outwards).sum(axis=0)
        return self._share(self.weight, np.zeros(3)) + outwards - np.cross(turn, self.arms)

    @cached_property
    def hover(self) -> np.ndarray:
        """Forces on the vehicles at rest, N."""
        return self.pulls - np.outer(self.mass_kg, [0.0, 0.0, self.gravity_m_s2])

    @cached_property
    def directions(self) -> np.ndarray:
        """n at rest, from vehicle to load."""
        return -self.pulls / np.linalg.norm(self.pulls, axis=1)[:, None]

    @cached_property
    def tangents(self) -> np.ndarray:
        """Two unit vectors across each cable, count × 3 × 2."""
        return np.array([linalg.null_space(n[None]) for n in self.directions])

    def _share(self, force: np.ndarray, moment: np.ndarray) -> np.ndarray:
        """ν of (6) without h, of all cables."""
        middle = self.attachment_m.mean(axis=0)
        return force / self.count + np.cross(self.spread_inverse @ (moment - np.cross(middle, force)), self.arms)

    # --- small motions ----------------------------------------------------------------------------
    # The state is position of the load, its rotation vector, two angles of each cable along `tangents`; then their
    # rates. The input is the force on each vehicle.

    @property
    def size(self) -> int:
        """Degrees of freedom."""
        return 6 + 2 * self.count

    def calc_plant(self) -> tuple[np.ndarray, np.ndarray]:
        """A and B of ẋ = A x + B u, by central differences."""
        rest, hover = np.zeros(2 * self.size), self.hover
        A, B = (np.zeros((2 * self.size, n)) for n in (2 * self.size, 3 * self.count))
        for column, step in enumerate(STEP * np.eye(2 * self.size)):
            A[:, column] = (self._calc_rates(rest + step, hover) - self._calc_rates(rest - step, hover)) / (2 * STEP)
        for column, step in enumerate(STEP * np.eye(3 * self.count).reshape(-1, self.count, 3)):
            B[:, column] = (self._calc_rates(rest, hover + step) - self._calc_rates(rest, hover - step)) / (2 * STEP)
        return A, B

    def _calc_rates(self, x: np.ndarray, forces: np.ndarray) -> np.ndarray:
        half, n = x[:self.size], self.directions + self._across(x[6:self.size])
        position, turn, velocity, rates = half[:3], half[3:6], x[self.size:][:3], x[self.size:][3:6]
        n /= np.linalg.norm(n, axis=1)[:, None]
        n_dot = self._across(x[self.size + 6:])
        R = linalg.expm(np.cross(np.eye(3), turn))
        quaternion = np.concatenate([[1.0], np.tan(np.linalg.norm(turn) / 2) * turn / (np.linalg.norm(turn) or 1.0)])
        length = self.length_m[:, None]
        ends = self.attachment_m @ R.T
        end_rates = np.cross(rates, self.attachment_m) @ R.T
        found = self._system.accelerations(
            (position, velocity, quaternion, rates),
            (position + ends - length * n, velocity + end_rates - length * n_dot), forces)
        bend = np.cross(found.load_angular, self.attachment_m) + np.cross(rates, np.cross(rates, self.attachment_m))
        n_ddot = (found.load + bend @ R.T - found.vehicles) / length
        return np.concatenate([x[self.size:], found.load, found.load_angular,
                               np.einsum("nki,nk->ni", self.tangents, n_ddot).ravel()])

    @cached_property
    def _system(self) -> cables.System:
        return cables.System(vehicle_mass_kg=self.mass_kg, cable_length_m=self.length_m,
                             attachment_m=self.attachment_m, load_mass_kg=self.load_mass_kg,
                             load_inertia_kg_m2=self.inertia_kg_m2, gravity_m_s2=self.gravity_m_s2)

    def _across(self, angles: np.ndarray) -> np.ndarray:
        return np.einsum("nki,ni->nk", self.tangents, angles.reshape(self.count, 2))

    def calc_law(self) -> np.ndarray:
        """K of u = K x: (2) to (12) to first order."""
        return np.column_stack([self._calc_forces(x).ravel() for x in np.eye(2 * self.size)])

    def _calc_forces(self, x: np.ndarray) -> np.ndarray:
        k = self.gains
        e, turn, n, e_1, turn_1, n_1 = (part for half in np.split(x, 2)
                                        for part in (half[:3], half[3:6], self._across(half[6:])))
        e_2 = -k["velocity"] * e_1 - k["position"] * e
        e_3 = -k["velocity"] * e_2 - k["position"] * e_1
        e_4 = -k["velocity"] * e_3 - k["position"] * e_2
        turn_2 = -k["rates"] * turn_1 - k["attitude"] * turn
        turn_3 = -k["rates"] * turn_2 - k["attitude"] * turn_1
        turn_4 = -k["rates"] * turn_3 - k["attitude"] * turn_2
        tension = np.linalg.norm(self.pulls, axis=1)[:, None]

        def calc_pull(e_n: np.ndarray, turn_n: np.ndarray, turn_n2: np.ndarray) -> np.ndarray:
            """Change of μ, or of a derivative of it, for those of acceleration, turn and angular acceleration."""
            force = self.load_mass_kg * e_n - np.cross(turn_n, self.weight)  # in the load
            return np.cross(turn_n, self.pulls) + self._share(force, self.inertia_kg_m2 @ turn_n2)

        def calc_direction(pull: np.ndarray) -> np.ndarray:
            along = np.sum(self.directions * pull, axis=1)[:, None] * self.directions
            return -(pull - along) / tension

        pull = calc_pull(e_2, turn, turn_2)
        d = calc_direction(pull)
        d_1 = calc_direction(calc_pull(e_3, turn_1, turn_3))
        d_2 = calc_direction(calc_pull(e_4, turn_2, turn_4))
        n_2 = d_2 - k["cable_angle"] * (n - d) - k["cable_rate"] * (n_1 - d_1)
        moved = e_2 + np.cross(turn_2, self.attachment_m) - self.length_m[:, None] * n_2
        along = np.sum(self.directions * pull, axis=1)[:, None] * self.directions
        return self.believed_kg[:, None] * moved - tension * n + along

    def calc_sag(self, forces: np.ndarray, load_mass_kg: float | None = None) -> np.ndarray:
        """Displacement at rest of each cable's end, m, by constant forces on the vehicles, N, and by another mass of the
        load than the law takes it to have."""
        A, B, K = self._linear
        loaded = replace(self, load_mass_kg=load_mass_kg or self.load_mass_kg)
        x = np.linalg.solve(A + B @ K, -loaded._calc_rates(np.zeros(2 * self.size), self.hover + forces))
        return x[:3] + np.cross(x[3:6], self.attachment_m)

    # --- late forces ------------------------------------------------------------------------------

    @cached_property
    def _linear(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return (*self.calc_plant(), self.calc_law())

    def calc_growth(self, late_periods: Sequence[int], period_s: float) -> float:
        """Factor of the slowest decaying motion in a control period, if each vehicle's force, held for a period, acts
        so many periods late. Above 1 small motions grow."""
        A, B, K = self._linear
        block = linalg.expm(period_s * np.block([[A, B], [np.zeros((B.shape[1], len(A) + B.shape[1]))]]))
        moved, pushed = block[:len(A), :len(A)], block[:len(A), len(A):]
        # The state, then the forces of each vehicle that are on their way, the newest first.
        whole = np.zeros((len(A) + 3 * sum(late_periods),) * 2)
        whole[:len(A), :len(A)] = moved
        at = len(A)
        for vehicle, late in enumerate(late_periods):
            axes = slice(3 * vehicle, 3 * vehicle + 3)
            if late == 0:
                whole[:len(A), :len(A)] += pushed[:, axes] @ K[axes]
                continue
            end = at + 3 * late
            whole[at:at + 3, :len(A)] = K[axes]
            whole[at + 3:end, at:end - 3] = np.eye(3 * late - 3)
            whole[:len(A), end - 3:end] = pushed[:, axes]
            at = end
        return float(np.abs(np.linalg.eigvals(whole)).max())

    def find_delay_limit(self, late: Sequence[bool], period_s: float) -> int:
        """The most periods that the forces of the `late` vehicles may act late before small motions grow."""
        for periods in range(MOST_PERIODS):
            if self.calc_growth([periods * is_late for is_late in late], period_s) >= 1.0:
                return periods - 1
        return MOST_PERIODS


def read_team(scenario: "Scenario") -> Team:
    """The group of a scenario with plant `cables` and law `cooperative`. Products of inertia, rotor drag and another
    belief of the law are left out."""
    keys = read_keys(scenario)
    vehicles, plant, law = scenario.vehicles, keys["plant"], keys["controller"]
    mass_kg = np.array([vehicle.quad_mass_kg for vehicle in vehicles])
    return Team(mass_kg=mass_kg, believed_kg=mass_kg,
                length_m=np.array([vehicle.rod_length_m for vehicle in vehicles]),
                attachment_m=np.array([cable["attachment_m"] for cable in plant["cables"]], float),
                load_mass_kg=sum(vehicle.load_mass_kg for vehicle in vehicles),
                inertia_kg_m2=np.diag(plant["load_inertia_kg_m2"]).astype(float),
                spread_rad=law.get("spread_rad", 0.0), gravity_m_s2=vehicles[0].gravity_m_s2,
                gains=law.get("gains", GAINS))
