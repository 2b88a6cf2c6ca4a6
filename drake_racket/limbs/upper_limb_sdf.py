"""Writes the SDF of the shipped upper limb, right or left, from its parameters.

The files sdf/upper_limb.sdf (right) and sdf/upper_limb_left.sdf are this module's output.

Shoulder frame S: fixed to the trunk at the shoulder's centre; x forward, y to the left, z up, for
both sides. With all joints at zero the arm hangs straight down (along -z), the palm faces the
thigh and the thumb points forward, and the frames of all links are parallel to S.

The left limb is the right one's mirror image about the x-z plane: equal joint positions give
mirrored postures. Positive rotations are about the axes below, in each joint's parent link:

    joint               towards                right axis   left axis
    shoulder_abduction  arm out to its side      -x           +x
    shoulder_flexion    arm forward              -y           -y
    shoulder_rotation   internal                 +z           -z
    elbow_flexion       hand to the shoulder     -y           -y
    forearm_pronation   palm back                +z           -z
    wrist_flexion       hand to its palm         +x           -x
    wrist_deviation     hand to its thumb        -y           -y

Abduction comes first, so that the arm held out sideways (cocking, contact) is regular: there
shoulder_flexion moves it forward in the horizontal plane. The three shoulder axes fail to span
space only where the arm points straight forward or backward (shoulder_flexion at +-90 deg).
"""

from __future__ import annotations

import numpy as np
from pydrake.math import RollPitchYaw, RotationMatrix

from drake_racket.parameters.limb import (
    JOINTS,
    UpperLimbParameters,
    load_upper_limb,
)

SIDES = ("right", "left")
_CHAIN = (
    "shoulder",
    "shoulder_abducted",
    "shoulder_flexed",
    "upper_arm",
    "elbow_flexed",
    "forearm",
    "wrist_flexed",
    "fist",
)
"""The links that the seven joints connect."""
_RIGHT_AXES = ((-1, 0, 0), (0, -1, 0), (0, 0, 1), (0, -1, 0), (0, 0, 1), (1, 0, 0), (0, -1, 0))
_OPEN = '<?xml version="1.0"?>\n<sdf version="1.9">\n'


def upper_limb_sdf(
    limb: UpperLimbParameters,
    name: str | None = None,
    *,
    side: str = "right",
    grip_rotation: float = 0.0,
) -> str:
    """Gives SDF text of one upper limb.

    Links: `shoulder` (massless; weld it to the trunk), `upper_arm`, `forearm`, `fist`, each with
    its origin at its proximal joint, and four massless ones between joints in one place. Frames:
    `elbow`, `wrist`, `knuckle` (distal ends of the segments) and `hand` (see `hand_rotation`).
    """
    mirror = 1.0 if side == "right" else -1.0
    at = {
        "elbow_flexed": ("upper_arm", limb.upper_arm.length.value),
        "wrist_flexed": ("forearm", limb.forearm.length.value),
    }
    inertias = {
        "upper_arm": _inertial(limb, "upper_arm", neutral=False),
        "forearm": _inertial(limb, "forearm", neutral=True),
        "fist": _inertial(limb, "hand", neutral=True),
    }
    lines = [f'  <model name="{name or limb.name}">']
    parent = None
    for link in _CHAIN:
        where, distance = at.get(link, (parent, 0.0))
        lines += _link(link, where, distance, inertias.get(link, _massless()))
        parent = link
    for i, joint in enumerate(JOINTS):
        x, y, z = _RIGHT_AXES[i]
        axis = (mirror * x, y, mirror * z)  # an axis of rotation is a pseudovector
        lines += _joint(limb, joint, _CHAIN[i], _CHAIN[i + 1], axis)
    lines += _frame("elbow", "upper_arm", (0.0, 0.0, -limb.upper_arm.length.value))
    lines += _frame("wrist", "forearm", (0.0, 0.0, -limb.forearm.length.value))
    lines += _frame("knuckle", "fist", (0.0, 0.0, -limb.hand.length.value))
    grip = (0.0, mirror * limb.grip.palmar.value, -limb.grip.distal.value)
    rotation = hand_rotation(limb, side, grip_rotation)
    lines += _frame("hand", "fist", grip, tuple(RollPitchYaw(rotation).vector()))
    return _OPEN + "\n".join([*lines, "  </model>", "</sdf>", ""])


def hand_rotation(limb: UpperLimbParameters, side: str, grip_rotation: float) -> RotationMatrix:
    """Gives the rotation R_FH of the hand frame H in the fist's link F.

    x, from butt to tip, leaves the fist on the thumb's side, inclined to the fingers by
    `grip.inclination`. z is the normal of the strings on the side the ball comes from: out of the
    palm at a `grip_rotation` of 0 (eastern forehand), turned about x towards the fingers by
    `grip_rotation`. Equal values are mirrored grips on the two sides; so is the racket, since its
    x and z are mirrored and it is symmetric along y.
    """
    mirror = 1.0 if side == "right" else -1.0
    thumb, palm, fingers = np.eye(3)[0], mirror * np.eye(3)[1], -np.eye(3)[2]
    a, g = limb.grip.inclination.value, grip_rotation
    x = np.cos(a) * thumb + np.sin(a) * fingers
    z = np.cos(g) * palm + np.sin(g) * (np.cos(a) * fingers - np.sin(a) * thumb)
    return RotationMatrix(np.column_stack([x, np.cross(z, x), z]))


def _inertial(limb: UpperLimbParameters, segment: str, *, neutral: bool) -> list[str]:
    """Every element of the inertia is written: a missing one would silently become 1 kg m^2.

    In the anatomical position the sagittal axis is x and the transverse one y. The forearm and
    the hand are at zero midway between pronation and supination (`neutral`), a quarter turn away.
    """
    sagittal, transverse, along = limb.moments(segment)
    ixx, iyy = (transverse, sagittal) if neutral else (sagittal, transverse)
    return _inertia(limb.mass(segment), -limb.com(segment), ixx, iyy, along)


def _massless() -> list[str]:
    return _inertia(0.0, 0.0, 0.0, 0.0, 0.0)


def _inertia(mass: float, z: float, ixx: float, iyy: float, izz: float) -> list[str]:
    return [
        "      <inertial>",
        f"        <pose>0 0 {z!r} 0 0 0</pose>",
        f"        <mass>{mass!r}</mass>",
        f"        <inertia><ixx>{ixx!r}</ixx><iyy>{iyy!r}</iyy><izz>{izz!r}</izz>"
        "<ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia>",
        "      </inertial>",
    ]


def _link(name: str, parent: str | None, distance: float, inertial: list[str]) -> list[str]:
    pose = f'      <pose relative_to="{parent}">0 0 {0.0 - distance!r} 0 0 0</pose>'
    return [
        f'    <link name="{name}">',
        *([pose] if parent else []),
        *inertial,
        "    </link>",
    ]


def _joint(
    limb: UpperLimbParameters,
    name: str,
    parent: str,
    child: str,
    axis: tuple[float, float, float],
) -> list[str]:
    """No effort limit is written, so that Drake adds an actuator."""
    joint = limb.joint(name)
    xyz = " ".join(f"{c + 0.0:g}" for c in axis)  # writes -0 as 0
    return [
        f'    <joint name="{name}" type="revolute">',
        f"      <parent>{parent}</parent>",
        f"      <child>{child}</child>",
        f"      <axis><xyz>{xyz}</xyz>",
        f"        <limit><lower>{joint.lower.value!r}</lower><upper>{joint.upper.value!r}</upper>"
        "</limit>",
        f"        <dynamics><damping>{joint.damping.value!r}</damping></dynamics>",
        "      </axis>",
        "    </joint>",
    ]


def _frame(
    name: str,
    link: str,
    place: tuple[float, float, float],
    rpy: tuple[float, ...] = (0.0, 0.0, 0.0),
) -> list[str]:
    pose = " ".join(f"{float(c)!r}" for c in (*place, *rpy))
    return [
        f'    <frame name="{name}" attached_to="{link}">',
        f'      <pose relative_to="{link}">{pose}</pose>',
        "    </frame>",
    ]


def shipped_limb_models() -> dict[str, str]:
    """Gives the file name -> text of the limbs under sdf/."""
    limb = load_upper_limb()
    return {
        "upper_limb.sdf": upper_limb_sdf(limb, "upper_limb"),
        "upper_limb_left.sdf": upper_limb_sdf(limb, "upper_limb_left", side="left"),
    }
