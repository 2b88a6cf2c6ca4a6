"""The right hand of MyoSim's arm around a racket's grip: finger angles, and where the grip lies.

MyoSim (PyPI package myo-sim) builds its arm with `myo_sim.load_model("myoarm_r")`. Its hand has no
frame for a held cylinder (site S_grasp_r lies 48 mm off the metacarpals, beyond any grip), so one
follows from its bones: each finger is bent until its three joints lie on a circle around the grip.
The flexion at a joint is half the arc of the phalanx before it plus half the arc of the one after,
and the metacarpal is a tangent. The grip's axis is the line nearest to the four circles' centres.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform, RotationMatrix

from drake_racket import InputError
from drake_racket.limbs import joint_name, load_model, mujoco_package

HAND = "thirdmc_r"  # rigid with the other fingers' metacarpals and all carpals
# inferred: a 4 3/8 in grip (size 3) measures 111 mm around, and half a finger's thickness is 8 mm
GRIP_RADIUS = 0.111 / (2.0 * math.pi) + 0.008
_FINGERS = (2, 3, 4, 5)
_THUMB = ("firstmc_r", "proximal_thumb_r", "distal_thumb_r")


def fist(model: Any, radius: float = GRIP_RADIUS) -> dict[str, float]:
    """Angles (rad) of all 20 finger and thumb joints around a grip, for `locked`.

    Flexions stop at the end of their ranges. Spreads and the thumb, whose joints do not bend in one
    plane, stay at 0.

    Args:
        radius: from the grip's axis to the fingers' joints, m.

    Raises:
        InputError: not such an arm, or a radius below half of a phalanx.

    """
    compiled = load_model(model)
    angles: dict[str, float] = {}
    for finger in _FINGERS:
        arcs = [0.0]
        for bone in _bones(finger)[1:]:
            half = 0.5 * float(np.linalg.norm(compiled.body_pos[_body(compiled, bone)]))
            if not half < radius < math.inf:
                raise InputError("fist: radius", radius, f"finite, above {half:.4f} m")
            arcs.append(2.0 * math.asin(half / radius))
        for i, bone in enumerate(_bones(finger)):
            after = arcs[i + 1] if i + 1 < len(arcs) else 0.0
            for joint in _joints(compiled, bone):
                bends = "flexion" in joint_name(compiled, joint)
                angle = 0.5 * (arcs[i] + after) if bends else 0.0
                lowest, highest = compiled.jnt_range[joint]
                angles[joint_name(compiled, joint)] = min(max(angle, float(lowest)), float(highest))
    for bone in _THUMB:
        angles |= {joint_name(compiled, joint): 0.0 for joint in _joints(compiled, bone)}
    return angles


def grip_in_hand(model: Any, radius: float = GRIP_RADIUS) -> RigidTransform:
    """X_BH: the hand frame H in the body `HAND`, for `import_mujoco`.

    The origin is the middle of the four fingers' circles; x leaves the fist on the thumb's side; z
    is where the palm faces (the palm behind the handle, as in an eastern forehand grip). Turn H
    about x for another grip.

    Raises:
        InputError: as `fist`.

    """
    centres = finger_centres(model, radius)
    middle = centres.mean(axis=0)
    x = np.linalg.svd(centres - middle)[2][0]
    x *= np.sign(x @ (centres[0] - centres[-1]))  # from the little finger to the index
    palm = np.array([0.0, 0.0, -1.0])  # of the hand's bodies: fingers along -y bend towards -z
    z = palm - (palm @ x) * x
    z /= np.linalg.norm(z)
    return RigidTransform(RotationMatrix(np.column_stack([x, np.cross(z, x), z])), middle)


def finger_centres(model: Any, radius: float = GRIP_RADIUS) -> NDArray[np.float64]:
    """Centres (4 x 3, m, in `HAND`) of the circles through the joints of fingers 2 to 5 in a fist.

    Raises:
        InputError: as `fist`.

    """
    compiled = load_model(model)
    mujoco = mujoco_package()
    data = mujoco.MjData(compiled)
    data.qpos[:] = compiled.qpos0
    for name, angle in fist(compiled, radius).items():
        data.joint(name).qpos[0] = angle
    mujoco.mj_kinematics(compiled, data)
    hand = data.body(HAND)
    centres = []
    for finger in _FINGERS:
        first, second, third = (data.body(bone).xpos for bone in _bones(finger))
        centres.append(_circle_centre(first, second, third) - hand.xpos)
    result: NDArray[np.float64] = np.array(centres) @ hand.xmat.reshape(3, 3)
    return result


def _circle_centre(
    a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Of the circle through three points."""
    u, v = b - a, c - a
    w = np.cross(u, v)
    centre: NDArray[np.float64] = a + np.cross((u @ u) * v - (v @ v) * u, w) / (2.0 * (w @ w))
    return centre


def _bones(finger: int) -> tuple[str, str, str]:
    return f"{finger}proxph_r", f"midph{finger}_r", f"distph{finger}_r"


def _body(model: Any, name: str) -> int:
    try:
        return int(model.body(name).id)
    except KeyError:
        raise InputError("fist: model", name, "a model with the bodies of myoarm_r") from None


def _joints(model: Any, bone: str) -> range:
    body = _body(model, bone)
    first = int(model.body_jntadr[body])
    return range(first, first + int(model.body_jntnum[body]))
