"""Stability of the QSF law with a late and lagging force, near hover. The equations are derived in
docs/study.md, "The linear formula"; s is the Laplace variable, 1/s."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class HorizontalChain:
    """Gains of the horizontal chain of integrators, and the swing frequency of the vehicle."""

    position: float
    velocity: float
    acceleration: float
    jerk: float
    swing_rad_s: float
    """Ω, with Ω² = (1 + m_L/m) g/L."""

    def calc_feedback(self, s: complex) -> complex:
        """K(s)."""
        return self.position + self.velocity * s + self.acceleration * s**2 + self.jerk * s**3


@dataclass(frozen=True)
class Lateness:
    """A delay of the force, followed by a lag of first order."""

    delay_s: float = 0.0
    lag_s: float = 0.0

    def calc_transfer(self, s: complex) -> complex:
        """H(s)."""
        return np.exp(-s * self.delay_s) / (1.0 + self.lag_s * s)


def calc_error_ratio(chain: HorizontalChain, late: Lateness, s: complex) -> complex:
    """(y_r − y) / y_r of the load."""
    transfer, swing_2 = late.calc_transfer(s), chain.swing_rad_s**2
    lost = 1.0 - transfer
    return (lost * s**2 * (s**2 + swing_2)
            / (s**4 + swing_2 * s**2 * lost + transfer * chain.calc_feedback(s)))


def calc_stability_limit(chain: HorizontalChain, lag_s: float) -> float:
    """Smallest delay T, in s, with a root of the denominator on the imaginary axis. The loop is assumed
    to be stable without delay. At such a root e^(−sT) = −(1 + τ s) s² (s² + Ω²) / (K − Ω² s²): the
    magnitudes of both sides give the frequency, the angles give the delay."""
    swing_2, x = chain.swing_rad_s**2, np.poly1d([1.0, 0.0])  # x = w², s = i w
    right = (1.0 + lag_s**2 * x) * x**2 * (x - swing_2)**2
    left = ((chain.position - (chain.acceleration - swing_2) * x)**2
            + x * (chain.velocity - chain.jerk * x)**2)
    delays = []
    for root in (right - left).roots:
        if abs(root.imag) < 1e-9 * abs(root) and root.real > 0.0:
            s = 1j * np.sqrt(root.real)
            turn = (-(1.0 + lag_s * s) * s**2 * (s**2 + swing_2)
                    / (chain.calc_feedback(s) - swing_2 * s**2))
            delays.append((-np.angle(turn) % (2.0 * np.pi)) / s.imag)
    return float(min(delays))
