"""Finds degrees of freedom without inertia, which no engine can accelerate, before a run."""

from __future__ import annotations

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context

from drake_racket.io.errors import InputError
from drake_racket.limbs.limb import Limb

LEAST_SHARE = 1e-10
"""An eigenvalue of the mass matrix, scaled to a diagonal of ones, below which a direction counts
as massless. Two joints in line give 0; the shipped limb has 1e-3 or more in a stroke."""


def check_inertia(plant: MultibodyPlant, context: Context, limb: Limb, key: str = "limb") -> None:
    """Refuses a state in which the mass matrix is singular, and names the joints.

    Point masses on an axis, links without mass at the end of a chain, three axes in one plane.

    Raises:
        InputError: naming the joints that move nothing, and what to do.

    """
    singular = massless_freedoms(plant, context)
    if singular:
        names = ", ".join(singular)
        plural = "joints" if len(singular) > 1 else "joint"
        ours = {joint.name() for joint in (*limb.joints, *limb.others())}
        lock = ", ".join(name for name in singular if name in ours)
        raise InputError(
            f"{key}: {plural} {names}",
            "no inertia to accelerate in this posture",
            "mass and moments on what moves, another posture"
            + (f", or locked: [{lock}]" if lock else " or grip_kind"),
        )


def massless_freedoms(plant: MultibodyPlant, context: Context) -> list[str]:
    """Gives the names of the velocities along which the plant has no inertia; empty if it has."""
    M = plant.CalcMassMatrix(context)
    diagonal = np.diag(M).copy()
    scale = np.where(diagonal > 0.0, diagonal, 1.0)
    S = M / np.sqrt(np.outer(scale, scale))
    values, vectors = np.linalg.eigh(S)
    names = plant.GetVelocityNames(add_model_instance_prefix=False, always_add_suffix=False)
    found: dict[str, None] = {}
    for value, vector in zip(values, vectors.T, strict=True):
        if value < LEAST_SHARE:
            size = np.abs(vector)
            found |= dict.fromkeys(names[i] for i in np.flatnonzero(size > 0.3 * size.max()))
    return list(found)
