"""Says how a part's mass may lie along it: densities m'(x) with what is known of the part.

A part (handle or head) is known by its mass, its centre of mass and its moments. Two families of
densities m'(x) of that mass and centre span what is possible:

    A   maximum entropy, m' = exp(a + b x + c x^2): the smoothest that has the part's moment as well
    B   an exponential handle, m' = exp(a + b x), and a head whose mass lies on the rim's ellipse,
        weighed by exp(b x); their moments come out as they do

and a number `density` from 0 (A) to 1 (B) mixes them, m' = (1 - density) A + density B.

Lengths in m, masses in kg, moments in kg m^2.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

Array = NDArray[np.float64]
Density = Callable[[float, float], tuple[Array, Array]]
"""Gives places and masses of points that stand for the density between two places: sums over them
are integrals, to rounding."""

_POINTS = 48  # of Gauss and Legendre, an interval: more change no digit


@functools.cache
def _gauss() -> tuple[Array, Array]:
    nodes, weights = legendre.leggauss(_POINTS)
    return nodes, weights


def _between(start: float, end: float) -> tuple[Array, Array]:
    """Places and weights of an integral from start to end."""
    nodes, weights = _gauss()
    half = 0.5 * (end - start)
    return 0.5 * (start + end) + half * nodes, half * weights


def _tilted(
    place: Array, weight: Array, powers: int, wanted: Sequence[float], length: float
) -> Array:
    """Coefficients (powers,) of the exponential in u = x/length - 1/2 with the wanted means of u.

    Newton's method on the logarithm of the sum of the weights, which is convex: its gradient is the
    means, its curvature their covariance.
    """
    u = place / length - 0.5
    basis = np.stack([u ** (n + 1) for n in range(powers)])
    target, found = np.array(wanted), np.zeros(powers)

    def means(coefficients: Array) -> tuple[float, Array, Array]:
        exponent = coefficients @ basis
        top = float(np.max(exponent))
        share = weight * np.exp(exponent - top)
        total = float(np.sum(share))
        share = share / total
        return float(np.log(total)) + top, basis @ share, share

    value, mean, share = means(found)
    for _ in range(200):
        step = np.linalg.solve((basis * share) @ basis.T - np.outer(mean, mean), target - mean)
        size = 1.0
        while True:
            new = found + size * step
            trial, mean, share = means(new)
            if trial - new @ target <= value - found @ target + 1e-12 or size < 1e-6:
                break
            size *= 0.5
        found, value = new, trial
        if np.max(np.abs(size * step)) < 1e-14 * (1.0 + np.max(np.abs(found))):
            break
    return found


def smooth_density(mass: float, length: float, com: float, second: float | None) -> Density:
    """Gives the maximum-entropy density of a part, from its end nearest the butt.

    Args:
        second: integral of (x - com)^2 dm (kg m^2), or None where it is free: an exponential then.

    """
    place, weight = _between(0.0, length)
    centre = com / length - 0.5
    wanted = [centre]
    if second is not None:
        wanted.append(second / (mass * length * length) + centre * centre)
    found = _tilted(place, weight, len(wanted), wanted, length)

    def exponential(x: Array) -> Array:
        u = x / length - 0.5
        total: Array = np.exp(sum(a * u ** (n + 1) for n, a in enumerate(found)))
        return total

    scale = mass / float(weight @ exponential(place))

    def density(start: float, end: float) -> tuple[Array, Array]:
        x, w = _between(start, end)
        return x, scale * w * exponential(x)

    return density


def hoop_density(
    mass: float, length: float, com: float, hoop: tuple[float, float, float]
) -> Density:
    """Gives the density of a head whose mass lies on its rim, from the throat joint.

    Args:
        hoop: place of the ellipse's centre, and its semi-axes along and across the racket (m).

    """
    centre, a, b = hoop

    def on_rim(start: float, end: float) -> tuple[Array, Array]:
        ends = [float(np.arccos(np.clip((x - centre) / a, -1.0, 1.0))) for x in (end, start)]
        t, w = _between(*ends)
        return centre + a * np.cos(t), w * np.hypot(a * np.sin(t), b * np.cos(t))

    place, weight = on_rim(0.0, length)
    (tilt,) = _tilted(place, weight, 1, [com / length - 0.5], length)
    scale = mass / float(weight @ np.exp(tilt * (place / length - 0.5)))

    def density(start: float, end: float) -> tuple[Array, Array]:
        x, w = on_rim(start, end)
        return x, scale * w * np.exp(tilt * (x / length - 0.5))

    return density


def mixed(first: Density, second: Density, share: float) -> Density:
    """Gives the density (1 - share) first + share second."""
    if share == 0.0:
        return first

    def density(start: float, end: float) -> tuple[Array, Array]:
        (x, m), (y, n) = first(start, end), second(start, end)
        return np.concatenate([x, y]), np.concatenate([(1.0 - share) * m, share * n])

    return density
