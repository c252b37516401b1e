"""Your own control law: the equations of control_client/laws/pid/README.md in plain floats.

    ./sls python examples/python/pid.py [SCENARIO]

It flies this law and the same law in C++, and prints the largest distance between the flights."""

import sys
import time
from math import cos, isfinite, sin

import numpy as np

import sls

INTEGRAL_LIMIT = 20.0  # m·s, of each axis


class Pid:
    """A cascade: the position error gives a desired velocity, its error a desired acceleration, and that
    a desired slope of the rod. The gains are (position, velocity, integral, rod_angle, rod_rate); the
    vertical axis has no rod gains."""

    memory_size = 3
    """The integral of the position error, x, y, z, m·s."""

    def __init__(self, vehicle: "sls.Vehicle",
                 horizontal: tuple[float, ...] = (0.6, 1.5, 0.0, 36.0, 12.0),
                 vertical: tuple[float, ...] = (1.5, 3.0, 0.0)):
        self.numbers = (vehicle.quad_mass_kg, vehicle.load_mass_kg, vehicle.rod_length_m,
                        vehicle.gravity_m_s2, *horizontal, *vertical)

    def __call__(self, now: "sls.Now"):
        (m, m_load, length, gravity, k_p, k_v, k_i, k_angle, k_rate,
         k_p_z, k_v_z, k_i_z) = self.numbers
        sin_a, cos_a = sin(now.alpha), cos(now.alpha)
        sin_b, cos_b = sin(now.beta), cos(now.beta)
        if cos_a < 1e-3 or cos_b < 1e-3:
            raise sls.LawFault("rod_level")
        alpha_rate, beta_rate = now.alpha_rate, now.beta_rate
        # The rod's direction and its rate.
        n_x, n_y, n_z = sin_b, -sin_a * cos_b, cos_a * cos_b
        rate_x = cos_b * beta_rate
        rate_y = -cos_a * cos_b * alpha_rate + sin_a * sin_b * beta_rate
        rate_z = -sin_a * cos_b * alpha_rate - cos_a * sin_b * beta_rate

        # (1): position error and velocity of the load, by the controller's own model.
        x, y, z = now.quad_position
        v_x, v_y, v_z = now.quad_velocity
        ref_x, ref_y, ref_z = now.reference.position
        error_x = ref_x - x - length * n_x
        error_y = ref_y - y - length * n_y
        error_z = ref_z - z - length * n_z
        v_x += length * rate_x
        v_y += length * rate_y
        v_z += length * rate_z

        # (2) and (3): the desired acceleration.
        sum_x, sum_y, sum_z = now.memory
        a_x = k_v * (k_p * error_x - v_x) + k_i * sum_x
        a_y = k_v * (k_p * error_y - v_y) + k_i * sum_y
        a_z = k_v_z * (k_p_z * error_z - v_z) + k_i_z * sum_z
        support = gravity - a_z
        if not isfinite(support):
            raise sls.LawFault("not_finite")
        if support < 1e-3 * gravity:
            raise sls.LawFault("free_fall")

        # (4): the slope of the rod and its desired acceleration.
        w_x, w_y = n_x / n_z, n_y / n_z
        slope_x = k_angle * (-a_x / support - w_x) - k_rate * (rate_x - w_x * rate_z) / n_z
        slope_y = k_angle * (-a_y / support - w_y) - k_rate * (rate_y - w_y * rate_z) / n_z

        # (5): the force carries both bodies along the rod and turns it.
        lift = (m + m_load) * support
        force = (-lift * w_x - m * length * slope_x, -lift * w_y - m * length * slope_y, -lift)
        period = now.period_s
        memory = (limit(sum_x + period * error_x), limit(sum_y + period * error_y),
                  limit(sum_z + period * error_z))
        return force, memory


def limit(integral: float) -> float:
    return min(max(integral, -INTEGRAL_LIMIT), INTEGRAL_LIMIT)


def main() -> None:
    scenario = sls.load_scenario(sys.argv[1] if len(sys.argv) > 1 else "figure_eight_pid")
    built_in = sls.fly(scenario)
    began = time.perf_counter()
    flight = sls.fly(scenario, Pid(scenario.controller_model))
    wall_s = time.perf_counter() - began
    print(f"{flight}: {len(flight) / wall_s:,.0f} steps/s")
    for stage in flight.metrics[:1]:
        print(f"  {stage.label}: load error rms {np.linalg.norm(stage.rms_m):.4f} m")
    if scenario.law == "pid" and len(built_in) == len(flight):
        apart = np.max(np.abs(flight.load_position - built_in.load_position))
        print(f"  at most {apart:.1e} m from the law 'pid' in C++")


if __name__ == "__main__":
    main()
