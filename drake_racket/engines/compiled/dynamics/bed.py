"""Computes a string-bed's forces where the frame under it bends.

A frame of two stiff parts has its strings on one of them: `forces.string_forces`.
"""

from __future__ import annotations

import math
from typing import Any

from drake_racket.engines.compiled.dynamics import layout as at
from drake_racket.laws.compilation import compilable
from drake_racket.laws.strings import spring_law


@compilable
def bent_string_forces(
    leaves: Any,
    numbers: Any,
    ends: Any,
    springs: Any,
    rims: Any,
    arms: Any,
    folds: Any,
    sizes: Any,
    y: Any,
    nq: int,
    tau: Any,
) -> float:
    """Adds the strings' forces on point masses and a frame that bends; law: `laws.strings`.

    All in one loop: a call for each spring, with all these tables, would take twice as long.

    Returns:
        what is lost in the springs (W), the sum of c (dL/dt)^2.

    """
    for i in range(len(leaves)):
        tau[leaves[i, at.LEAF_V]] -= numbers[i, at.LEAF_DAMPING] * y[nq + leaves[i, at.LEAF_V]]
    arm, fold, lost = 0, 0, 0.0
    for s in range(ends.shape[1]):
        i, j = ends[0, s], ends[1, s]
        dz, rate = y[leaves[i, at.LEAF_Q]], y[nq + leaves[i, at.LEAF_V]]
        if j >= 0:
            dz -= y[leaves[j, at.LEAF_Q]]
            rate -= y[nq + leaves[j, at.LEAF_V]]
        first_arm, first_fold = arm, fold
        while arm < len(rims) and rims[arm, 0] == s:
            dz += arms[arm] * y[rims[arm, 1]]
            rate += arms[arm] * y[nq + rims[arm, 2]]
            arm += 1
        sag, flow = 0.0, 0.0  # q^T F q, q^T F q' of the frame under the spring
        while fold < len(folds) and folds[fold, 0] == s:
            part = sizes[fold] * y[folds[fold, 1]]
            sag += part * y[folds[fold, 3]]
            flow += part * y[nq + folds[fold, 4]]
            fold += 1
        length2, c = springs[2, s] - sag, springs[3, s]
        slope, tension = spring_law(dz, rate, springs[0, s], springs[1, s], length2, c)
        if fold > first_fold:
            shorter = 1.0 / math.sqrt(dz * dz + length2)
            flow *= shorter
            tension -= c * flow
            for k in range(first_fold, fold):
                tau[folds[k, 2]] += tension * shorter * sizes[k] * y[folds[k, 3]]
        pull = tension * slope
        tau[leaves[i, at.LEAF_V]] -= pull
        if j >= 0:
            tau[leaves[j, at.LEAF_V]] += pull
        for k in range(first_arm, arm):
            tau[rims[k, 2]] -= pull * arms[k]
        stretching = slope * rate - flow
        lost += c * stretching * stretching
    return lost
