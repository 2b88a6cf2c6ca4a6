"""Takes one step of a model through time, with an estimate of its error.

Out of contact: Dormand and Prince's Runge-Kutta pair of order 5 (J. Comput. Appl. Math. 6:19-26,
1980). In contact: ARK4(3)6L[2]SA of Kennedy and Carpenter (Appl. Numer. Math. 44:139-181, 2003), an
additive pair of order 4, whose implicit part is friction as `friction` splits it off.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drake_racket.laws.compilation import compilable

DP_A = np.array(
    (
        (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        (1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0),
        (3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0),
        (44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0),
        (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0),
        (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0),
        (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
    )
)
DP_ERROR = np.array((71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40))
ARK_E = np.array(
    (
        (0.0, 0.0, 0.0, 0.0, 0.0),
        (1 / 2, 0.0, 0.0, 0.0, 0.0),
        (13861 / 62500, 6889 / 62500, 0.0, 0.0, 0.0),
        (
            -116923316275 / 2393684061468,
            -2731218467317 / 15368042101831,
            9408046702089 / 11113171139209,
            0.0,
            0.0,
        ),
        (
            -451086348788 / 2902428689909,
            -2682348792572 / 7519795681897,
            12662868775082 / 11960479115383,
            3355817975965 / 11060851509271,
            0.0,
        ),
        (
            647845179188 / 3216320057751,
            73281519250 / 8382639484533,
            552539513391 / 3454668386233,
            3354512671639 / 8306763924573,
            4040 / 17871,
        ),
    )
)
ARK_I = np.array(
    (
        (0.0, 0.0, 0.0, 0.0, 0.0),
        (1 / 4, 0.0, 0.0, 0.0, 0.0),
        (8611 / 62500, -1743 / 31250, 0.0, 0.0, 0.0),
        (5012029 / 34652500, -654441 / 2922500, 174375 / 388108, 0.0, 0.0),
        (
            15267082809 / 155376265600,
            -71443401 / 120774400,
            730878875 / 902184768,
            2285395 / 8070912,
            0.0,
        ),
        (82889 / 524892, 0.0, 15625 / 83664, 69875 / 102672, -2260 / 8211),
    )
)
ARK_GAMMA = 0.25
ARK_C = np.array((0.0, 1 / 2, 83 / 250, 31 / 50, 17 / 20, 1.0))
ARK_B = np.array((82889 / 524892, 0.0, 15625 / 83664, 69875 / 102672, -2260 / 8211, 1 / 4))
ARK_ERROR = ARK_B - np.array(
    (
        4586570599 / 29645900160,
        0.0,
        178811875 / 945068544,
        814220225 / 1159782912,
        -3700637 / 11593932,
        61727 / 225920,
    )
)


@compilable
def combine(y: Any, h: float, k: Any, weights: Any, count: int, new: Any) -> None:
    """Writes y + h sum of weights times slopes (rows of k) into `new`.

    Row by row: so the processor's vectors take it.
    """
    for i in range(len(y)):
        new[i] = weights[0] * k[0, i]
    for j in range(1, count):
        weight = weights[j]
        for i in range(len(y)):
            new[i] += weight * k[j, i]
    for i in range(len(y)):
        new[i] = y[i] + h * new[i]


@compilable
def error_of(h: float, k: Any, weights: Any, count: int, scale: Any) -> float:
    """Gives the size of h sum of weights times slopes, each number in units of 1 / scale."""
    square = 0.0
    for i in range(len(scale)):
        total = 0.0
        for j in range(count):
            total += weights[j] * k[j, i]
        total *= h * scale[i]
        square += total * total
    return float(np.sqrt(square))


@compilable
def along(rows: Any, v: Any) -> Any:
    """Gives V v, two numbers."""
    s0, s1 = 0.0, 0.0
    for i in range(len(v)):
        s0 += rows[0, i] * v[i]
        s1 += rows[1, i] * v[i]
    return s0, s1


@compilable
def add_columns(v: Any, columns: Any, g0: float, g1: float) -> None:
    """Adds U g to v."""
    for i in range(len(v)):
        v[i] += columns[0, i] * g0 + columns[1, i] * g1


@compilable
def damped_error_of(
    h: float,
    k: Any,
    weights: Any,
    scale: Any,
    start: int,
    rows: Any,
    columns: Any,
    inner: Any,
    a: float,
    b: float,
    d: float,
    gamma: float,
    e: Any,
) -> float:
    """Gives `error_of` of an additive step, with what friction damps at once taken off.

    The estimate e of the velocities becomes (1 - h gamma U G V)^-1 e, as Shampine has it for stiff
    equations (in Hairer & Wanner, Solving Ordinary Differential Equations II, section IV.8).

    Args:
        start: where the velocities begin.  a, b, d: G, symmetric.  e: (states,) work.

    """
    for i in range(len(scale)):
        total = 0.0
        for j in range(6):
            total += weights[j] * k[j, i]
        e[i] = h * total
    nv = rows.shape[1]
    v = e[start : start + nv]
    g = h * gamma
    m00, m01 = (
        1.0 - g * (inner[0, 0] * a + inner[0, 1] * b),
        -g * (inner[0, 0] * b + inner[0, 1] * d),
    )
    m10, m11 = (
        -g * (inner[1, 0] * a + inner[1, 1] * b),
        1.0 - g * (inner[1, 0] * b + inner[1, 1] * d),
    )
    determinant = m00 * m11 - m01 * m10
    for _ in range(2):
        s0, s1 = along(rows, v)
        x0, x1 = (m11 * s0 - m01 * s1) / determinant, (m00 * s1 - m10 * s0) / determinant
        add_columns(v, columns, g * (a * x0 + b * x1), g * (b * x0 + d * x1))
    square = 0.0
    for i in range(len(scale)):
        square += (e[i] * scale[i]) ** 2
    return float(np.sqrt(square))
