"""Adds the shipped upper limb to a plant: seven joints from the shoulder to the fist.

Axes, zero posture and signs of the joints: see `upper_limb_sdf`. Masses: `parameters.limb`.

A continuous plant ignores the limits of joints: `joint_limits` has torques for them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex

from drake_racket.io.errors import InputError
from drake_racket.limbs.limb import Limb
from drake_racket.limbs.upper_limb_sdf import SIDES, upper_limb_sdf
from drake_racket.parameters.limb import (
    JOINTS,
    UpperLimbParameters,
    check_upper_limb,
    load_upper_limb,
)

GRIP_ROTATIONS: Mapping[str, float] = MappingProxyType(
    {
        "continental_forehand": -0.25 * math.pi,
        "eastern_forehand": 0.0,
        "semi_western_forehand": 0.25 * math.pi,
        "western_forehand": 0.5 * math.pi,
        "eastern_backhand": 0.5 * math.pi,
        "continental_backhand": 0.75 * math.pi,
    }
)
"""Each grip and stroke has a `grip_rotation` (rad). The eight bevels of a handle are 45 deg apart.

With the frame on edge, the index finger's knuckle lies on bevel 1 (top: eastern backhand),
2 (continental), 3 (side: eastern forehand), 4 (semi-western) or 5 (western). A one-handed
backhand is hit with the other face, half a turn away: the eastern backhand and the western
forehand hit with the same face. The angles are those of the bevels; a real hand's are inferred.
"""


def add_upper_limb(
    plant: MultibodyPlant,
    parameters: UpperLimbParameters | None = None,
    *,
    side: str = "right",
    name: str = "upper_limb",
    parent: Frame | None = None,
    X_PF: RigidTransform | None = None,
    grip_rotation: float = 0.0,
) -> Limb:
    """Adds an upper limb to `plant`, before `Finalize`, welded at its shoulder.

    Each joint has an actuator: the plant's actuation input port of the limb's model instance takes
    the seven torques (N m) in the joints' order. An unconnected port means no torque.

    Args:
        parameters: of `load_upper_limb`, which are the default.
        side: right or left.
        name: the model instance's name; must be new in the plant.
        parent: the frame P of the trunk that holds the limb; the world's if None.
        X_PF: pose of the shoulder frame F (x forward, y to the left, z up) in P; identity if None.
        grip_rotation: how the racket is turned in the fist about its axis (rad), see
            `GRIP_ROTATIONS` and `upper_limb_sdf.hand_rotation`; 0 is an eastern forehand.

    Returns:
        The handles; `hand` is where the racket's grip frame lies.

    Raises:
        InputError: the plant is finalized, the name is taken, the side is unknown, or the
            parameters or the angle do not fit.

    """
    if plant.is_finalized():
        raise InputError("add_upper_limb: plant", "finalized", "a plant before Finalize()")
    if side not in SIDES:
        raise InputError("add_upper_limb: side", side, ", ".join(SIDES))
    if not (name.isascii() and name.isidentifier()):
        raise InputError("add_upper_limb: name", name, "letters, digits and _ (not first a digit)")
    if plant.HasModelInstanceNamed(name):
        raise InputError("add_upper_limb: name", name, "a name that the plant does not have yet")
    if not math.isfinite(grip_rotation):
        raise InputError("add_upper_limb: grip_rotation", grip_rotation, "a finite angle (rad)")
    if parameters is None:
        parameters = load_upper_limb()
    else:
        check_upper_limb(parameters)
    parser = Parser(plant)
    parser.SetStrictParsing()
    text = upper_limb_sdf(parameters, name, side=side, grip_rotation=grip_rotation)
    (instance,) = parser.AddModelsFromString(text, "sdf")
    plant.WeldFrames(
        plant.world_frame() if parent is None else parent,
        plant.GetFrameByName("shoulder", instance),
        X_PF or RigidTransform(),
    )
    return find_upper_limb(plant, instance)


def find_upper_limb(plant: MultibodyPlant, instance: ModelInstanceIndex) -> Limb:
    """Gives handles to an upper limb that the user's own parser has added (from sdf/, say).

    Raises:
        InputError: the model instance is not an upper limb of this package.

    """
    named = all(plant.HasJointNamed(joint, instance) for joint in JOINTS)
    if not (named and plant.HasFrameNamed("hand", instance)):
        raise InputError(
            "find_upper_limb: instance",
            plant.GetModelInstanceName(instance),
            "a model with a frame named hand and the joints " + ", ".join(JOINTS),
        )
    return Limb(
        plant=plant,
        model_instances=(instance,),
        hand=plant.GetFrameByName("hand", instance),
        joints=tuple(plant.GetJointByName(joint, instance) for joint in JOINTS),
    )
