"""Describes the joints of a racket's frame: where it bends, about what, and how stiffly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

AXES = ("x", "y", "z")

BENDING_AXES = {"in_plane": "z", "out_of_plane": "y"}
"""Plane of bending -> the axis it turns about; in the order of the joints from the butt."""


@dataclass(frozen=True)
class FrameJoint:
    """A frame joint is a revolute joint with a torsional spring-damper, tau = -k q - d q'.

    Attributes:
        name: of the joint.  axis: `x`, `y` or `z` of the racket.
        place: along the racket, m from the butt.
        stiffness: N m/rad.  damping: N m s/rad.

    """

    name: str
    axis: str
    place: float
    stiffness: float
    damping: float

    @property
    def axis_index(self) -> int:
        """Gives 0, 1, 2 for x, y, z: the joint's place among roll, pitch and yaw."""
        return AXES.index(self.axis)


def bushing_constants(joints: Sequence[FrameJoint]) -> tuple[list[float], list[float]]:
    """Gives torque stiffness (N m/rad) and damping (N m s/rad) in roll, pitch and yaw.

    0 without a joint.

    Roll, pitch and yaw are the joints' angles if the joints turn about z, then y, then x.
    """
    stiffness, damping = [0.0] * 3, [0.0] * 3
    for joint in joints:
        stiffness[joint.axis_index], damping[joint.axis_index] = joint.stiffness, joint.damping
    return stiffness, damping
