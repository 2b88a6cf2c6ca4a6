"""Puts a hand on the racket's grip, of one of three kinds.

    weld        the racket's grip frame G is fixed on the user's hand frame H
    torsional   G turns about H's origin against three torsional spring-dampers: translation is
                fixed, as in King, Kentel & Mitchell (2012), J. Biomech. 45:1048-1052
    compliant   three torsional and three translational spring-dampers

The spring-dampers are one `LinearBushingRollPitchYaw`: torques -k q - c qdot on roll, pitch and yaw
of G in H, and forces -K p - D pdot along its axes. At rest G lies on H. H may be fixed in the world
or sit on an arm.

"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BallRpyJoint, Frame, Joint, LinearBushingRollPitchYaw
from pydrake.systems.framework import Context

from drake_racket.io.errors import InputError
from drake_racket.io.schema import shown
from drake_racket.parameters.grip import GRIP_KINDS, GripStiffness, check_grip
from drake_racket.plant.racket import Racket


@dataclass(frozen=True, repr=False)
class Grip:
    """The Grip holds handles to a grip in a plant.

    Attributes:
        kind: one of GRIP_KINDS.
        hand_frame: H, on whatever holds the racket.
        racket_frame: G, on the racket; it lies on H at rest.
        bushing: its roll, pitch and yaw are those of G in H; None for a weld.
        joint: the weld or ball joint from H to G; None for a compliant grip.

    """

    plant: MultibodyPlant
    kind: str
    hand_frame: Frame
    racket_frame: Frame
    bushing: LinearBushingRollPitchYaw | None
    joint: Joint | None

    def __repr__(self) -> str:
        """Shows the kind and the two frames."""
        return shown(self, f"{self.kind}: {self.racket_frame.name()} on {self.hand_frame.name()}")

    def set_stiffness(self, root: Context, grip: GripStiffness) -> None:
        """Writes another grip into a Context: the plant's, or one of a Diagram that holds it.

        A weld has no stiffness: nothing to write. A GripLoad holds the constants by itself:
        `set_grip_load_parameters` copies them there.

        Raises:
            InputError: the grip is not valid.

        """
        check_grip(grip)
        if self.bushing is None:
            return
        torque_k, torque_c, force_k, force_c = _constants(grip, self.kind)
        context = self.plant.GetMyMutableContextFromRoot(root)
        self.bushing.SetTorqueStiffnessConstants(context, torque_k)
        self.bushing.SetTorqueDampingConstants(context, torque_c)
        self.bushing.SetForceStiffnessConstants(context, force_k)
        self.bushing.SetForceDampingConstants(context, force_c)


def _constants(grip: GripStiffness, kind: str) -> list[list[float]]:
    """Torque stiffness and damping, force stiffness and damping of the bushing."""
    forces = [list(grip.force_stiffness.value), list(grip.force_damping.value)]
    if kind == "torsional":  # the joint holds the point
        forces = [[0.0] * 3, [0.0] * 3]
    return [list(grip.torque_stiffness.value), list(grip.torque_damping.value), *forces]


def add_grip(
    plant: MultibodyPlant,
    racket: Racket,
    hand_frame: Frame,
    grip: GripStiffness,
    *,
    kind: str = "compliant",
    held_at: str = "grip",
) -> Grip:
    """Holds a racket that was added free at `hand_frame`. Before `Finalize`.

    A compliant grip only pulls the two frames together: put the racket where its grip frame lies on
    the hand frame (`plant.SetFreeBodyPose` of the handle) for a start without force. The other two
    make the racket part of the hand's tree.

    Args:
        kind: one of GRIP_KINDS.
        held_at: the racket's frame that lies in the hand: grip, butt, ...

    Raises:
        InputError: the plant is finalized, the grip or the kind is not valid, or the frame is
            unknown.

    """
    if plant.is_finalized():
        raise InputError("add_grip: plant", "finalized", "a plant before Finalize()")
    if kind not in GRIP_KINDS:
        raise InputError("add_grip: kind", kind, ", ".join(GRIP_KINDS))
    check_grip(grip)
    racket_frame = racket.frame(held_at)
    joint: Any = None
    bushing: Any = None
    if kind == "weld":
        joint = plant.WeldFrames(hand_frame, racket_frame)
    elif kind == "torsional":
        name = f"{plant.GetModelInstanceName(racket.model_instance)}_grip"
        joint = plant.AddJoint(BallRpyJoint(name, hand_frame, racket_frame))
    if kind != "weld":
        constants: list[Any] = _constants(grip, kind)
        bushing = plant.AddForceElement(
            LinearBushingRollPitchYaw(hand_frame, racket_frame, *constants)
        )
    return Grip(plant, kind, hand_frame, racket_frame, bushing, joint)
