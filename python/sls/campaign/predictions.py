"""Linear predictions of the shipped campaigns, derived in docs/campaigns.md."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import linalg, signal

from sls.delay_formula import HorizontalChain, calc_stability_limit
from sls.scenario import ROOT, load_scenario
from sls.team_formula import Team, read_team

QUAD_MASS_KG, LOAD_MASS_KG, ROD_LENGTH_M, GRAVITY_M_S2 = 1.5, 0.2, 1.0, 9.8  # of every base
PERIOD_S = 0.004


def calc_lqr_gains(weight: float, order: int) -> list[float]:
    """LQR gains of a chain of integrators with Q = weight·I and R = 1, that of the position first."""
    a, b = np.eye(order, k=1), np.eye(order)[:, -1:]
    return (b.T @ linalg.solve_continuous_are(a, b, weight * np.eye(order), np.eye(1)))[0].tolist()


def calc_swing(load_mass_kg: float) -> float:
    """ω of the swing of the rod about hover, rad/s."""
    return float(np.sqrt((QUAD_MASS_KG + load_mass_kg) * GRAVITY_M_S2
                         / (QUAD_MASS_KG * ROD_LENGTH_M)))


def calc_mass_ratio(load_mass_kg: float, believed_kg: float = LOAD_MASS_KG) -> float:
    """r: the total mass divided by the total mass that the controller assumes."""
    return (QUAD_MASS_KG + load_mass_kg) / (QUAD_MASS_KG + believed_kg)


def make_chain(gains: Sequence[float], load_mass_kg: float,
               vertical: Sequence[float]) -> HorizontalChain:
    """The horizontal loop about a hover in which the load sags, because the controller assumes a load of
    0.2 kg: formula (1) of the page. `gains`: position, velocity, acceleration, jerk; `vertical`:
    position, velocity."""
    ratio = calc_mass_ratio(float(load_mass_kg))
    slope = vertical[1] * (ratio - 1.0)
    bend = (vertical[1]**2 - vertical[0]) * (1.0 - ratio)
    return HorizontalChain(gains[0] / ratio, gains[1] / ratio,
                           gains[2] - (gains[3] * slope + bend) / ratio,
                           gains[3] - 2.0 * slope / ratio, calc_swing(load_mass_kg))


def calc_delay_limit(gains: Sequence[float], load_mass_kg: float = LOAD_MASS_KG,
                     lag_s: float = 0.0, vertical: Sequence[float] = (0.0, 0.0)) -> float:
    """The delay above which small motions grow, s, minus half a period for the hold. If the assumed mass
    is right, `vertical` has no effect."""
    chain = make_chain(gains, load_mass_kg, vertical)
    return calc_stability_limit(chain, float(lag_s)) - PERIOD_S / 2


def calc_vertical_limit(vertical: Sequence[float]) -> float:
    """As `calc_delay_limit`, for the vertical loop: formula (2) of the page."""
    position, velocity = vertical
    w = np.sqrt((velocity**2 + np.sqrt(velocity**4 + 4.0 * position**2)) / 2.0)
    return float(np.arctan2(velocity * w, position) / w) - PERIOD_S / 2


def describe_range(values: Sequence[float]) -> str:
    low, high = f"{min(values):.3f} s", f"{max(values):.3f} s"
    return low if low == high else f"{low} to {high}"


def read_base_team(name: str) -> Team:
    return read_team(load_scenario(ROOT / f"config/campaigns/bases/{name}.yaml"))


def change_first(team: Team, **changes: float) -> Team:
    """The team with other numbers of vehicle 0: `mass_kg`, `length_m`."""
    return replace(team, **{name: np.array([value, *getattr(team, name)[1:]]) for name, value in changes.items()})


def calc_team_limit(team: Team) -> float:
    """The longest delay, in whole periods, of the forces of vehicle 0 with which small motions decay, s."""
    return PERIOD_S * team.find_delay_limit([vehicle == 0 for vehicle in range(team.count)], PERIOD_S)


def calc_rest_error(team: Team, load_mass_kg: float) -> float:
    """Largest error at rest of a cable's end, m. The law takes the vehicles' masses to be `believed_kg`, and the load's to
    be that of `team` where it is `load_mass_kg`."""
    extra = np.zeros((team.count, 3))
    extra[:, 2] = (team.mass_kg - team.believed_kg) * team.gravity_m_s2
    return float(np.linalg.norm(team.calc_sag(extra, load_mass_kg), axis=1).max())


def calc_pulse_peak(gains: Sequence[float], duration_s: float = 1.0) -> float:
    """Largest error of the load for a force of 1 N on the quadrotor over `duration_s`, m."""
    time_s = np.linspace(0.0, 30.0, 30001)
    system = signal.lti([GRAVITY_M_S2 / (QUAD_MASS_KG * ROD_LENGTH_M)],
                        [1.0, gains[3], gains[2], gains[1], gains[0]])
    force = (time_s < duration_s).astype(float)
    return float(np.max(np.abs(signal.lsim(system, force, time_s)[1])))
