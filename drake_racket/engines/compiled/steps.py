"""Takes one step of a model through time, with an estimate of its error.

Out of contact: Dormand and Prince's Runge-Kutta pair of order 5 (J. Comput. Appl. Math. 6:19-26,
1980). In contact: ARK4(3)6L[2]SA of Kennedy and Carpenter (Appl. Numer. Math. 44:139-181, 2003), an
additive pair of order 4, whose implicit part is friction's linear part A = U G V (`friction`), frozen
over the step. The order holds whatever A is; with rank two, a stage costs two dot products.
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
DP_ERROR = np.array(
    (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)
)
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
    """Writes y + h sum of weights times slopes (rows of k) into `new`."""
    for i in range(len(y)):
        total = 0.0
        for j in range(count):
            total += weights[j] * k[j, i]
        new[i] = y[i] + h * total


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
def solve_stage(v: Any, base: Any, h: float, rows: Any, columns: Any, inner: Any, gain: Any) -> Any:
    """Solves (1 - h A)(v - base) = r in place for the velocities v = base + r of a stage.

    With A = U G V and E = V U (`inner`): V x = (1 - h E G)^-1 V r, x = r + h U G V x.

    Returns:
        G V x, the slope along the two columns of U.

    """
    s0, s1 = 0.0, 0.0
    for i in range(len(v)):
        x = v[i] - base[i]
        s0 += rows[0, i] * x
        s1 += rows[1, i] * x
    a = 1.0 - h * (inner[0, 0] * gain[0, 0] + inner[0, 1] * gain[1, 0])
    b = -h * (inner[0, 0] * gain[0, 1] + inner[0, 1] * gain[1, 1])
    c = -h * (inner[1, 0] * gain[0, 0] + inner[1, 1] * gain[1, 0])
    d = 1.0 - h * (inner[1, 0] * gain[0, 1] + inner[1, 1] * gain[1, 1])
    determinant = a * d - b * c
    x0, x1 = (d * s0 - b * s1) / determinant, (a * s1 - c * s0) / determinant
    g0, g1 = gain[0, 0] * x0 + gain[0, 1] * x1, gain[1, 0] * x0 + gain[1, 1] * x1
    for i in range(len(v)):
        v[i] += h * (columns[0, i] * g0 + columns[1, i] * g1)
    return g0, g1


@compilable
def add_columns(v: Any, columns: Any, g0: float, g1: float) -> None:
    """Adds U g to v."""
    for i in range(len(v)):
        v[i] += columns[0, i] * g0 + columns[1, i] * g1
