"""Bending frequencies of two rigid bodies hinged at a torsional spring, in closed form.

Planar small motion. Body 1 (handle) reaches from the butt to the joint at ``l1``; its centre of
mass lies ``d1 = l1 - c1`` before the joint. The centre of mass of body 2 (head) lies ``d2 = c2``
beyond the joint. With the joint's transverse displacement y and the two rotations p1, p2,

    y_1 = y - d1 p1,    y_2 = y + d2 p2.

*Free-free.* Linear momentum is zero in the bending mode, so the kinetic energy of the two centres
of mass is that of their relative motion y_2 - y_1 = d1 p1 + d2 p2 with the reduced mass
mu = m1 m2 / (m1 + m2):

    2 T = A p1'^2 + 2 C p1' p2' + B p2'^2,
    A = I1 + mu d1^2,   B = I2 + mu d2^2,   C = mu d1 d2.

Angular momentum about the common centre of mass, the derivative of T along a rigid rotation
p1 = p2, is also zero: (A + C) p1' + (B + C) p2' = 0. With the joint angle q = p2 - p1,

    p1' = -(B + C) q' / D,   p2' = (A + C) q' / D,   D = A + B + 2 C,

and substitution leaves 2 T = J q'^2 with the reduced inertia

    J = (A B - C^2) / D.

The spring has 2 V = k q^2, hence f = sqrt(k / J) / (2 pi).

*Handle clamped.* Only the head turns, about the joint: J = I2 + m2 c2^2.

Units: kg, m, kg m^2, N m/rad, Hz.
"""

from math import pi, sqrt


def reduced_inertia(
    m1: float, l1: float, c1: float, I1: float, m2: float, c2: float, I2: float
) -> float:
    """Inertia J (kg m^2) that the joint angle of the free two-body racket sees."""
    d1 = l1 - c1
    mu = m1 * m2 / (m1 + m2)
    a = I1 + mu * d1 * d1
    b = I2 + mu * c2 * c2
    c = mu * d1 * c2
    # A B - C^2, expanded so that nothing cancels.
    determinant = I1 * I2 + mu * (I1 * c2 * c2 + I2 * d1 * d1)
    return determinant / (a + b + 2.0 * c)


def free_free_frequency(
    m1: float, l1: float, c1: float, I1: float, m2: float, c2: float, I2: float, k: float
) -> float:
    """Fundamental bending frequency (Hz) of the free racket.

    m1, l1, c1, I1: handle mass, length, centre of mass from the butt, inertia about it.
    m2, c2, I2: head mass, centre of mass from the joint, inertia about it.
    k: stiffness of the joint (N m/rad). Inertias are about the axis of the joint.
    """
    return sqrt(k / reduced_inertia(m1, l1, c1, I1, m2, c2, I2)) / (2.0 * pi)


def handle_clamped_frequency(m2: float, c2: float, I2: float, k: float) -> float:
    """Frequency (Hz) of the head on the joint's spring with the handle held still."""
    return sqrt(k / (I2 + m2 * c2 * c2)) / (2.0 * pi)
