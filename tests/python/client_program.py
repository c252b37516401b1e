"""A client program, written like a user's: `client_program.py SCENARIO DOMAIN NAME STRENGTH LAW`."""

import sys
import time

import sls

LOOP_MASS = 1.5, 0.2, 1.0, 9.8  # quadrotor, load, rod, gravity of the shipped scenarios


def pid(now):
    """The equations of control_client/laws/pid, from positions instead of angles."""
    m, m_load, length, gravity = LOOP_MASS
    q = [(b - a) / length for a, b in zip(now.quad_position, now.load_position)]
    q_dot = [(b - a) / length for a, b in zip(now.quad_velocity, now.load_velocity)]
    ax, ay, az = (k_v * (k_p * (wanted - y) - y_dot) for k_p, k_v, wanted, y, y_dot in zip(
        (0.6, 0.6, 1.5), (1.5, 1.5, 3.0), now.reference.position, now.load_position,
        now.load_velocity))
    support = gravity - az
    force = [0.0, 0.0, -(m + m_load) * support]
    for i, a in enumerate((ax, ay)):
        slope = q[i] / q[2]
        slope_rate = (q_dot[i] - slope * q_dot[2]) / q[2]
        turn = 36.0 * (-a / support - slope) - 12.0 * slope_rate
        force[i] = -(m + m_load) * support * slope - m * length * turn
    return force


def broken(now):
    if now.step == 150:
        raise ValueError("no idea")
    return pid(now)


def sleepy(now):
    if now.step == 150:
        print("sleeps", flush=True)
        time.sleep(1000)
    return pid(now)


class Counting:
    """A law that integrates the error. The integral is in its memory, because a law has no other state."""

    memory_size = 2

    def __call__(self, now):
        x, y, z = pid(now)
        errors = [a - b for a, b in zip(now.reference.position, now.load_position)]
        memory = [sum_ + 0.01 * now.period_s * e for sum_, e in zip(now.memory, errors)]
        return (x + memory[0], y + memory[1], z), memory


LAWS = {"pid": pid, "broken": broken, "sleepy": sleepy, "counting": Counting()}


def main():
    scenario, domain, name, strength, law = sys.argv[1:]
    sls.Client(LAWS[law], scenario, domain=int(domain), name=name, strength=int(strength)).run()


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        print("interrupted", flush=True)
        sys.exit(130)
    except (sls.ConfigError, sls.RunError) as error:
        print(f"{type(error).__name__}: {error}", flush=True)
        sys.exit(2 if isinstance(error, sls.ConfigError) else 1)
