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


def find_joint_velocities(
    J: Vector,
    V_WC: Vector,
    *,
    weights: Vector | None = None,
    bounds: tuple[Vector, Vector] | None = None,
) -> JointVelocities:
    """Gives least squares of J v = V_WC; of its solutions the one with the least sum of (w v)^2.

    With bounds, of its solutions within them, if there are any; else that without them.

    Not a norm weighted by all masses: how the racket is held (welded, by a bushing) then does not
    change the arm's motion. Free components put no row into the system.

    Args:
        J: (6, n) V_WC in W per joint velocity: three rows of rotation, three of translation.
        V_WC: (6,) what is wanted; NaN is free.
        weights: (n,) w, above 0; 1 if None.
        bounds: (n,) lowest and highest joint velocities; -inf and inf where there are none.

    """
    asked = ~np.isnan(V_WC)
    w = np.ones(J.shape[1]) if weights is None else weights
    A, b = J[asked] / w, V_WC[asked]
    if len(b) == 0:
        return JointVelocities(np.zeros(J.shape[1]), b, J.shape[1], met=True)
    first, _, rank, _ = np.linalg.lstsq(A, b, rcond=RANK_TOLERANCE)
    # once more on what round-off left
    scaled: Vector = first + np.linalg.lstsq(A, b - A @ first, rcond=RANK_TOLERANCE)[0]
    if bounds is not None and not _inside(scaled, bounds[0] * w, bounds[1] * w):
        within = _bounded(A, scaled, int(rank), bounds[0] * w, bounds[1] * w)
        scaled = scaled if within is None else within
    residual: Vector = A @ scaled - b
    scale = max(1.0, float(np.abs(b).max()))
    met = bool(np.abs(residual).max() <= TOLERANCE * scale)
    return JointVelocities(scaled / w, residual, J.shape[1] - int(rank), met)


def _inside(x: Vector, low: Vector, high: Vector) -> bool:
    return bool(np.all((low <= x) & (x <= high)))


def _bounded(A: Vector, x: Vector, rank: int, low: Vector, high: Vector) -> Vector | None:
    """The least |x'|^2 with A x' = A x and low <= x' <= high; None if there is none.

    x is the least without bounds, so x' = x + N y with the null space N, and the least |y|^2 with
    G y >= h is what Lawson and Hanson's LDP finds by non-negative least squares (Solving Least
    Squares Problems, 1974, ch. 23). Joints at their bounds are then put there exactly.
    """
    from scipy.optimize import nnls  # slow to import, and rarely needed

    N = np.linalg.svd(A)[2][rank:].T
    rows = [(N, low - x), (-N, x - high)]
    G, h = (np.concatenate(parts) for parts in zip(*rows, strict=True))
    G, h = G[np.isfinite(h)], h[np.isfinite(h)]
    E = np.vstack([G.T, h])
    f = np.zeros(len(E))
    f[-1] = 1.0
    r = E @ nnls(E, f)[0] - f
    if np.linalg.norm(r) < 1e-9 or r[-1] == 0.0:
        return None
    found: Vector = x + N @ (-r[:-1] / r[-1])
    slack = 1e-9 * max(1.0, float(np.abs(found).max()))
    if not _inside(found, low - slack, high + slack):
        return None
    at = (found < low + slack) | (found > high - slack)
    fixed = np.where(found < low + slack, low, high)
    exact = np.where(at, fixed, found)
    left = A @ x - A @ exact
    exact[~at] += np.linalg.lstsq(A[:, ~at], left, rcond=RANK_TOLERANCE)[0]
    close = np.abs(A @ exact - A @ x).max() <= TOLERANCE * max(1.0, float(np.abs(A @ x).max()))
    return exact if close and _inside(exact, low, high) else np.clip(found, low, high)
