"""Gains of the shipped control laws."""

import math

from sls.core import load_core
from sls.errors import ConfigError


def lqr(horizontal: float, vertical: float) -> dict[str, dict[str, float]]:
    """The LQR gains that the law `qsf` gets from `controller.gains.lqr`: for chains of four (horizontal)
    and two (vertical) integrators, with Q = weight · I and R = 1.

    Returns `{"horizontal": {"position", "velocity", "acceleration", "jerk"}, "vertical":
    {"position", "velocity"}}`, in 1/s⁴, 1/s³, 1/s², 1/s and 1/s², 1/s: an argument for
    `load_scenario(…, controller__gains=…)`. Raises ConfigError if a weight is not positive or has
    no solution."""
    for axis, weight in (("horizontal", horizontal), ("vertical", vertical)):
        if not (weight > 0.0 and math.isfinite(weight)):
            raise ConfigError(f"lqr: {axis}: expected > 0, got {weight}")
    return load_core().lqr(float(horizontal), float(vertical))
