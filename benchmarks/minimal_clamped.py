"""A normal head-clamped impact as the barest compiled loop: the floor for `clamped_kernel`.

Twenty states, Runge-Kutta of order 4 with fixed steps, release by a straight line within the last
step; the laws written out. No sensitivities, no oblique impacts, no peaks, no second touch.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from drake_racket.laws.bed import grid_topology

FIRST, SECOND = grid_topology().ends


@numba.njit(cache=True, error_model="numpy")
def rates(y, p, k, slack, length2, kb, cb, m, ball, f):
    for i in range(9):
        f[i] = y[9 + i]
        f[9 + i] = 0.0
    for s in range(24):
        dz = y[FIRST[s]]
        if SECOND[s] >= 0:
            dz -= y[SECOND[s]]
        length = np.sqrt(dz * dz + length2[s])
        pull = (slack[s] + k[s] * length) * dz / (length * m)
        f[9 + FIRST[s]] -= pull
        if SECOND[s] >= 0:
            f[9 + SECOND[s]] += pull
    force = kb * (y[p] - y[18]) + cb * (y[9 + p] - y[19])
    f[9 + p] -= force / m
    f[18] = y[19]
    f[19] = force / ball


@numba.njit(parallel=True, cache=True, error_model="numpy")
def rebound_speeds(points, speeds, kb, cb, k, slack, length2, m, ball, h, out):
    for n in numba.prange(len(points)):
        p = points[n]
        y, x = np.zeros(20), np.empty(20)
        f = np.empty((4, 20))
        y[19] = -speeds[n]
        before = cb[n] * speeds[n]
        while True:
            v = y[19]
            rates(y, p, k, slack, length2, kb[n], cb[n], m, ball, f[0])
            for stage in range(1, 4):
                part = h if stage == 3 else 0.5 * h
                for i in range(20):
                    x[i] = y[i] + part * f[stage - 1, i]
                rates(x, p, k, slack, length2, kb[n], cb[n], m, ball, f[stage])
            for i in range(20):
                y[i] += h / 6.0 * (f[0, i] + 2.0 * f[1, i] + 2.0 * f[2, i] + f[3, i])
            after = kb[n] * (y[p] - y[18]) + cb[n] * (y[9 + p] - y[19])
            if after <= 0.0:
                share = before / (before - after)
                # the force falls to 0 in a straight line: the rest of the step is a triangle
                out[n] = v + 0.5 * before * share * h / ball
                break
            before = after


def rebounds(constants: NDArray, points, speeds, balls, mass: float, ball_mass: float, h: float):
    """Rebound speeds (m/s) of normal impacts; arguments as the kernel's, points 0-8."""
    out = np.zeros(len(points))
    k, slack, length2 = (constants[i].copy() for i in range(3))
    rebound_speeds(
        points, speeds, balls[:, 0].copy(), balls[:, 1].copy(), k, slack, length2, mass, ball_mass,
        h, out,
    )  # fmt: skip
    return out
