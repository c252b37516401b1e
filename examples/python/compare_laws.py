"""Two control laws on the same figure eight, under the same gusts of measurement noise.

    ./sls python examples/python/compare_laws.py [--recordings DIR]"""

import argparse
from pathlib import Path

import numpy as np

import sls

LAWS = {
    "qsf": {"controller.law": "qsf", "controller.gains": sls.lqr(10, 5)},
    "pid": {"controller.law": "pid", "controller.gains": {
        "horizontal": {"position": 0.6, "velocity": 1.5, "rod_angle": 36, "rod_rate": 12},
        "vertical": {"position": 1.5, "velocity": 3.0}}},
}


def make_noise(seed: int) -> list[dict[str, object]]:
    """Standard deviations: 1 cm of every position, 1 cm/s of every velocity."""
    return [{"noise": {"on": "state", "position_m": [0.01] * 3, "velocity_m_s": [0.01] * 3,
                       "seed": seed}}]


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    options.add_argument("--recordings", type=Path, metavar="DIR",
                         help="save the last flight of each law in DIR/LAW: ./sls plot, ./sls report")
    options.add_argument("--flights", type=int, default=5, help="of each law (default: 5)")
    chosen = options.parse_args()

    print("load position error on the second lap, rms (m)")
    for name, changes in LAWS.items():
        errors = []
        for seed in range(1, chosen.flights + 1):  # the same noise for both laws
            flight = sls.fly(sls.load_scenario("figure_eight", changes=changes,
                                               faults=make_noise(seed)))
            lap = flight.time_s >= 16.0
            errors.append(np.sqrt(np.mean(np.sum(flight.calc_load_error()[lap]**2, axis=1))))
        print(f"  {name}: mean {np.mean(errors):.4f}, largest {np.max(errors):.4f}")
        if chosen.recordings:
            recording = flight.save(chosen.recordings / name, force=True)
            print(f"    {recording.folder}: certificate {recording.certificate[:12]}")


if __name__ == "__main__":
    main()
