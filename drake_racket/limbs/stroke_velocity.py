"""Finds the joint velocities that move a frame of the racket as a user wants it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_racket.parameters.stroke import Vector

RANK_TOLERANCE = 1e-8
"""Singular values below this share of the largest count as zero: a direction in which the limb
cannot move is refused rather than met with joint rates of 1e8 times the speed asked for."""

TOLERANCE = 1e-10
"""Largest error of an accepted velocity, as a share of the largest component asked for (or of
1 m/s, 1 rad/s)."""


@dataclass(frozen=True)
class JointVelocities:
    """Says what the solve ends with.

    Attributes:
        v: (n,) joint velocities.
        residual: J v minus what was asked for, in the order of V_WC, components asked for only.
        freedom: degrees of freedom that the velocity leaves to the limb.
        met: the residual is within `TOLERANCE`.

    """

    v: Vector
    residual: Vector
    freedom: int
    met: bool


def find_joint_velocities(J: Vector, V_WC: Vector) -> JointVelocities:
    """Gives least squares of J v = V_WC, and of its solutions the one with the least sum of v^2.

    The plain norm, not one weighted by masses: how the racket is held (welded, by a bushing) then
    does not change the arm's motion. Free components put no row into the system.

    Args:
        J: (6, n) V_WC in W per joint velocity: three rows of rotation, three of translation.
        V_WC: (6,) what is wanted; NaN is free.

    """
    asked = ~np.isnan(V_WC)
    A, b = J[asked], V_WC[asked]
    if len(b) == 0:
        return JointVelocities(np.zeros(J.shape[1]), b, J.shape[1], met=True)
    first, _, rank, _ = np.linalg.lstsq(A, b, rcond=RANK_TOLERANCE)
    # once more on what round-off left
    v: Vector = first + np.linalg.lstsq(A, b - A @ first, rcond=RANK_TOLERANCE)[0]
    residual: Vector = A @ v - b
    scale = max(1.0, float(np.abs(b).max()))
    met = bool(np.abs(residual).max() <= TOLERANCE * scale)
    return JointVelocities(v, residual, J.shape[1] - int(rank), met)
