"""Computes a string-bed's forces where the frame under it bends, and what any bed loses.

A frame of two stiff parts has its strings on one of them: `forces.string_forces`.
"""

from __future__ import annotations

import math
from typing import Any

from drake_racket.engines.compiled.dynamics import layout as at
from drake_racket.laws.compilation import compilable
from drake_racket.laws.strings import spring_law


@compilable
def spring_state(model: Any, s: int, arm: int, fold: int, y: Any, nq: int) -> Any:
    """Gives height (m) and rate (m/s) of spring s, q^T F q and q^T F q' of the frame under it.

    Args:
        arm, fold: where the rows of spring s begin in the tables of the rim's arms and folds.

    Returns:
        also where the rows of the next spring begin.

    """
    leaves, ends = model[at.LEAF_ROWS], model[at.SPRING_ENDS]
    i, j = ends[0, s], ends[1, s]
    dz, rate = y[leaves[i, at.LEAF_Q]], y[nq + leaves[i, at.LEAF_V]]
    if j >= 0:
        dz -= y[leaves[j, at.LEAF_Q]]
        rate -= y[nq + leaves[j, at.LEAF_V]]
    rims, arms = model[at.RIM_ROWS], model[at.RIM_ARMS]
    while arm < len(rims) and rims[arm, 0] == s:
        dz += arms[arm] * y[rims[arm, 1]]
        rate += arms[arm] * y[nq + rims[arm, 2]]
        arm += 1
    rows, sizes = model[at.FOLD_ROWS], model[at.FOLD_SIZES]
    sag, flow = 0.0, 0.0
    while fold < len(rows) and rows[fold, 0] == s:
        first = sizes[fold] * y[rows[fold, 1]]
        sag += first * y[rows[fold, 3]]
        flow += first * y[nq + rows[fold, 4]]
        fold += 1
    return dz, rate, sag, flow, arm, fold


@compilable
def bent_string_forces(model: Any, y: Any, nq: int, tau: Any) -> None:
    """Adds the strings' forces on point masses and a frame that bends; law: `laws.strings`."""
    ints, numbers = model[at.LEAF_ROWS], model[at.LEAF_NUMBERS]
    for i in range(len(ints)):
        tau[ints[i, at.LEAF_V]] -= numbers[i, at.LEAF_DAMPING] * y[nq + ints[i, at.LEAF_V]]
    ends, springs = model[at.SPRING_ENDS], model[at.SPRING_NUMBERS]
    rims, arms = model[at.RIM_ROWS], model[at.RIM_ARMS]
    rows, sizes = model[at.FOLD_ROWS], model[at.FOLD_SIZES]
    arm, fold = 0, 0
    for s in range(ends.shape[1]):
        dz, rate, sag, flow, next_arm, next_fold = spring_state(model, s, arm, fold, y, nq)
        length2, c = springs[2, s] - sag, springs[3, s]
        slope, tension = spring_law(dz, rate, springs[0, s], springs[1, s], length2, c)
        if next_fold > fold:
            length = math.sqrt(dz * dz + length2)
            tension -= c * flow / length
            for k in range(fold, next_fold):
                tau[rows[k, 2]] += tension / length * sizes[k] * y[rows[k, 3]]
        pull = tension * slope
        tau[ints[ends[0, s], at.LEAF_V]] -= pull
        if ends[1, s] >= 0:
            tau[ints[ends[1, s], at.LEAF_V]] += pull
        for k in range(arm, next_arm):
            tau[rims[k, 2]] -= pull * arms[k]
        arm, fold = next_arm, next_fold


@compilable
def lost_in_strings(model: Any, y: Any, nq: int) -> Any:
    """Gives the sum of c (dL/dt)^2 (W)."""
    ends, springs = model[at.SPRING_ENDS], model[at.SPRING_NUMBERS]
    lost, arm, fold = 0.0, 0, 0
    for s in range(ends.shape[1]):
        dz, rate, sag, flow, arm, fold = spring_state(model, s, arm, fold, y, nq)
        length2 = springs[2, s] - sag
        slope, _ = spring_law(dz, rate, springs[0, s], springs[1, s], length2, springs[3, s])
        stretching = slope * rate - flow / math.sqrt(dz * dz + length2)
        lost += springs[3, s] * stretching * stretching
    return lost
