"""Flies one scenario with several masses of the load, prints the errors and draws them.

    ./sls python examples/python/fly_and_plot.py [--out DIR]"""

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # draws into files
import matplotlib.pyplot as plt
import numpy as np

import sls


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    options.add_argument("--out", type=Path, default=Path("."), help="where masses.png goes")
    out = options.parse_args().out

    figure, axes = plt.subplots(figsize=(7, 3.5), layout="constrained")
    for mass in (0.1, 0.2, 0.3):
        # The law uses this mass of the load. Without this line it would use each true mass.
        flight = sls.fly(sls.load_scenario("short", vehicle__load_mass_kg=mass,
                                           controller__model__load_mass_kg=0.2))
        error = np.linalg.norm(flight.calc_load_error(), axis=1)
        print(f"{mass} kg: {len(flight)} steps, rms {np.sqrt(np.mean(error**2)):.4f} m, "
              f"largest tilt {np.rad2deg(np.max(np.abs(flight.beta))):.1f} deg, "
              f"certificate {flight.certificate[:12]}")
        axes.plot(flight.time_s, error, label=f"{mass} kg")
    axes.set(xlabel="time (s)", ylabel="load position error (m)")
    axes.legend(title="load")
    figure.savefig(out / "masses.png")
    print(f"figure: {out / 'masses.png'}")


if __name__ == "__main__":
    main()
