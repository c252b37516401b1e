"""Learns two gains of a cascaded controller: 256 loops fly a figure eight at once.

    ./sls python examples/python/learn.py

Random search: each generation draws position and velocity gains around the best so far, closer and
closer to it. A loop that loses its load counts as the worst. The C++ law then flies the best gains."""

import time

import numpy as np
import sls

LOOPS = 256
GENERATIONS = 5
FLIGHT_S = 8.0
START = {"position": 0.6, "velocity": 1.5}  # the scenario's own gains, 1/s


def load_scenario(**gains: float) -> "sls.Scenario":
    """The shipped figure eight of the law `pid`, on the plant in closed form, with these gains."""
    plant = {"model": "analytic", "step_s": 0.004, "initial": {"load_position_m": [0, 0, -0.5]}}
    horizontal = {"rod_angle": 36, "rod_rate": 12, **START, **gains}
    return sls.load_scenario("figure_eight_pid", changes={
        "plant": plant, "controller.gains.horizontal": horizontal,
        "mission.0.for_s": FLIGHT_S})


def calc_force(loop: sls.ClosedLoop, state: "sls.LoopState", wanted: np.ndarray,
               gains: np.ndarray) -> np.ndarray:
    """The equations of control_client/laws/pid for all loops: force (count, 3), N.

    wanted: desired position of the load (3,), m. gains: horizontal position and velocity gains
    (count, 2), 1/s.
    """
    k_p = np.column_stack([gains[:, 0], gains[:, 0], np.full(len(gains), 1.5)])
    k_v = np.column_stack([gains[:, 1], gains[:, 1], np.full(len(gains), 3.0)])
    q = (state.load_position - state.quad_position) / loop.rod_length_m
    q_dot = (state.load_velocity - state.quad_velocity) / loop.rod_length_m
    acceleration = k_v * (k_p * (wanted - state.load_position) - state.load_velocity)
    support = np.maximum(loop.gravity_m_s2 - acceleration[:, 2:], 0.1)
    slope = q[:, :2] / q[:, 2:]
    slope_rate = (q_dot[:, :2] - slope * q_dot[:, 2:]) / q[:, 2:]
    turn = 36 * (-acceleration[:, :2] / support - slope) - 12 * slope_rate
    total = loop.quad_mass_kg + loop.load_mass_kg
    return np.hstack([-total * support * slope - loop.quad_mass_kg * loop.rod_length_m * turn,
                      -total * support])


def fly(loop: sls.ClosedLoop, gains: np.ndarray) -> np.ndarray:
    """Root mean square of the load's distance from its reference (count,), m; infinite if the
    load was lost."""
    state = loop.reset()
    steps = round(FLIGHT_S / loop.period_s)
    wanted = loop.reference(np.arange(steps) * loop.period_s).position
    squares = np.zeros(len(loop))
    for k in range(steps):
        distances = ((state.load_position - wanted[k]) ** 2).sum(axis=1)
        squares += np.where(distances < 10.0, distances, np.inf)
        with np.errstate(all="ignore"):  # lost loops overflow
            state = loop.step(calc_force(loop, state, wanted[k], gains))
    return np.sqrt(np.where(loop.failed, np.inf, squares / steps))


def main() -> None:
    began = time.perf_counter()
    random = np.random.default_rng(1)
    loop = sls.ClosedLoop(load_scenario(), LOOPS)
    best = np.array([START["position"], START["velocity"]])
    for generation in range(GENERATIONS):
        spread = 0.6 * 0.6**generation
        gains = best * np.exp(random.normal(0.0, spread, (LOOPS, 2)))
        gains[0] = best
        errors = fly(loop, gains)
        if generation == 0:
            first = errors[0]
            print(f"start:        position {best[0]:.3f}, velocity {best[1]:.3f}: "
                  f"rms error {first:.3f} m")
        best = gains[errors.argmin()]
        print(f"generation {generation}: position {best[0]:.3f}, velocity {best[1]:.3f}: "
              f"rms error {errors.min():.3f} m, {np.isinf(errors).sum()} of {LOOPS} lost the load")
    print(f"{GENERATIONS * LOOPS} flights of {FLIGHT_S:g} s in {time.perf_counter() - began:.1f} s")

    flight = sls.fly(load_scenario(position=float(best[0]), velocity=float(best[1])))
    error = np.sqrt((flight.calc_load_error()**2).sum(axis=1).mean())
    print(f"the C++ law with these gains: rms error {error:.3f} m, "
          f"{first / error:.1f} times better than at the start")


if __name__ == "__main__":
    main()
