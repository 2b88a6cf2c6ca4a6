"""Periods of the inertia bench's pendulums by other means than the bench's formulas.

*Energy integral.* One degree of freedom q with kinetic energy 1/2 M(q) q'^2 and potential energy
V(q), even about q = 0, let go at rest at q = a, takes a quarter period from a to 0:

    T = 4 int_0^a sqrt(M / (2 (V(a) - V(q)))) dq.

With q = a sin(s) the integrand is smooth at both ends, and Gauss-Legendre nodes meet neither.

*Physical pendulum:* M = I about the pivot, V = m g d (1 - cos q).

*Hinged pendulum.* Two bodies in a chain under a pivot at the swingweight axis, hinged at a spring k
a distance l below it. With small absolute angles p1, p2 from the vertical, the first body's centre
at c1 below the pivot and the second's c2 below the hinge:

    2 T = (I1 + m1 c1^2 + m2 l^2) p1'^2 + 2 m2 l c2 p1' p2' + (I2 + m2 c2^2) p2'^2
    2 V = g (m1 c1 + m2 l) p1^2 + g m2 c2 p2^2 + k (p2 - p1)^2.

Units: kg, m, s, kg m^2, N m/rad, rad.
"""

from collections.abc import Callable

import numpy as np
from scipy.linalg import eigh


def energy_period(
    inertia: Callable[[np.ndarray], np.ndarray],
    potential: Callable[[np.ndarray], np.ndarray],
    amplitude: float,
) -> float:
    nodes, weights = np.polynomial.legendre.leggauss(80)
    s = 0.25 * np.pi * (nodes + 1.0)
    q = amplitude * np.sin(s)
    fall = potential(np.array(amplitude)) - potential(q)
    speed = np.sqrt(2.0 * fall / inertia(q))
    return float(4.0 * 0.25 * np.pi * np.sum(weights * amplitude * np.cos(s) / speed))


def pendulum_period(I: float, m: float, d: float, g: float, amplitude: float) -> float:
    return energy_period(
        lambda q: np.full_like(q, I), lambda q: 2.0 * m * g * d * np.sin(0.5 * q) ** 2, amplitude
    )


def hinged_pendulum_period(
    I1: float, m1: float, c1: float, l: float, I2: float, m2: float, c2: float, k: float, g: float
) -> float:
    """Period (s) of the slow mode; a rigid pendulum's for large k."""
    mass = np.array([[I1 + m1 * c1**2 + m2 * l**2, m2 * l * c2], [m2 * l * c2, I2 + m2 * c2**2]])
    stiffness = np.array([[g * (m1 * c1 + m2 * l) + k, -k], [-k, g * m2 * c2 + k]])
    return float(2.0 * np.pi / np.sqrt(eigh(stiffness, mass, eigvals_only=True)[0]))
