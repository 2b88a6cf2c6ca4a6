"""Puts a hand on the racket's grip, of one of four kinds.

    weld        the racket's grip frame G is fixed on the user's hand frame H
    torsional   G turns about H's origin against three torsional spring-dampers: translation is
                fixed, as in King, Kentel & Mitchell (2012), J. Biomech. 45:1048-1052
    compliant   three torsional and three translational spring-dampers
    hand        the same between racket and a hand that has mass, and as many between that hand and
                what carries it; on a limb, whose own hand has mass, the first alone

The spring-dampers are one `LinearBushingRollPitchYaw`: torques -k q - c qdot on roll, pitch and yaw
of G in H, and forces -K p - D pdot along its axes. At rest G lies on H. H may be fixed in the world
or sit on an arm.

"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BallRpyJoint,
    FixedOffsetFrame,
    Frame,
    Joint,
    LinearBushingRollPitchYaw,
    RigidBody,
    RotationalInertia,
    SpatialInertia,
)
from pydrake.systems.framework import Context

from drake_racket.io.errors import InputError
from drake_racket.io.schema import shown
from drake_racket.parameters.grip import (
    GRIP_KINDS,
    HANDS,
    GripStiffness,
    HandBody,
    check_grip,
)
from drake_racket.plant.racket import Racket


@dataclass(frozen=True, repr=False)
class Grip:
    """The Grip holds handles to a grip in a plant.

    Attributes:
        kind: one of GRIP_KINDS.
        hand_frame: H, on whatever holds the racket: with a hand that has mass, on that.
        racket_frame: G, on the racket; it lies on H at rest.
        bushing: its roll, pitch and yaw are those of G in H; None for a weld.
        joint: the weld or ball joint from H to G; None for a compliant grip.
        body: the hand that has mass; None without one.
        carrier: the frame that H lies on at rest, on what carries that hand.
        wrist: the bushing from `carrier` to H.

    """

    plant: MultibodyPlant
    kind: str
    hand_frame: Frame
    racket_frame: Frame
    bushing: LinearBushingRollPitchYaw | None
    joint: Joint | None
    body: RigidBody | None = None
    carrier: Frame | None = None
    wrist: LinearBushingRollPitchYaw | None = None

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
        context = self.plant.GetMyMutableContextFromRoot(root)
        _set(self.bushing, context, _constants(grip, self.kind))
        if self.body is not None and self.wrist is not None:
            hand = _hand_of(grip)
            self.body.SetSpatialInertiaInBodyFrame(context, _inertia(hand))
            _set(self.wrist, context, _wrist_constants(hand))

    def wrist_side(self) -> Grip | None:
        """Gives the spring-dampers of the wrist's side as a grip; None without a hand's mass."""
        if self.wrist is None or self.carrier is None:
            return None
        return Grip(self.plant, "compliant", self.carrier, self.hand_frame, self.wrist, None)

    def rest(self, root: Context) -> None:
        """Puts a hand that has mass where it strains nothing: on its carrier, at rest."""
        if self.body is None or self.carrier is None:
            return
        context = self.plant.GetMyMutableContextFromRoot(root)
        self.plant.SetFreeBodyPose(context, self.body, self.carrier.CalcPoseInWorld(context))
        self.plant.SetFreeBodySpatialVelocity(
            context, self.body, self.carrier.CalcSpatialVelocityInWorld(context)
        )


def _constants(grip: GripStiffness, kind: str) -> list[list[float]]:
    """Torque stiffness and damping, force stiffness and damping of the bushing."""
    forces = [list(grip.force_stiffness.value), list(grip.force_damping.value)]
    if kind == "torsional":  # the joint holds the point
        forces = [[0.0] * 3, [0.0] * 3]
    return [list(grip.torque_stiffness.value), list(grip.torque_damping.value), *forces]


def _set(bushing: LinearBushingRollPitchYaw, context: Context, numbers: list[list[float]]) -> None:
    torque_k, torque_c, force_k, force_c = numbers
    bushing.SetTorqueStiffnessConstants(context, torque_k)
    bushing.SetTorqueDampingConstants(context, torque_c)
    bushing.SetForceStiffnessConstants(context, force_k)
    bushing.SetForceDampingConstants(context, force_c)


def _hand_of(grip: GripStiffness) -> HandBody:
    if grip.hand is None:
        raise InputError("grip", grip.name, f"a grip whose hand has mass: {', '.join(HANDS)}")
    return grip.hand


def _wrist_constants(hand: HandBody) -> list[list[float]]:
    names = ("torque_stiffness", "torque_damping", "force_stiffness", "force_damping")
    return [list(getattr(hand, f"wrist_{name}").value) for name in names]


def _inertia(hand: HandBody) -> SpatialInertia:
    moments = RotationalInertia(*hand.moments.value)
    return SpatialInertia.MakeFromCentralInertia(hand.mass.value, [0.0, 0.0, 0.0], moments)


def add_grip(
    plant: MultibodyPlant,
    racket: Racket,
    hand_frame: Frame,
    grip: GripStiffness,
    *,
    kind: str = "compliant",
    held_at: str = "grip",
    carrier_is_hand: bool = False,
) -> Grip:
    """Holds a racket that was added free at `hand_frame`. Before `Finalize`.

    A compliant grip only pulls the two frames together: put the racket where its grip frame lies on
    the hand frame (`plant.SetFreeBodyPose` of the handle) for a start without force. The other two
    make the racket part of the hand's tree.

    Args:
        kind: one of GRIP_KINDS.
        held_at: the racket's frame that lies in the hand: grip, butt, ... With kind `hand` it is
            the hand's place on the handle instead.
        carrier_is_hand: `hand_frame` is on a hand that has mass of its own, a limb's: kind `hand`
            then adds none.

    Raises:
        InputError: the plant is finalized, the grip or the kind is not valid, or the frame is
            unknown.

    """
    if plant.is_finalized():
        raise InputError("add_grip: plant", "finalized", "a plant before Finalize()")
    if kind not in GRIP_KINDS:
        raise InputError("add_grip: kind", kind, ", ".join(GRIP_KINDS))
    check_grip(grip)
    if kind == "hand":
        return _add_hand(plant, racket, hand_frame, grip, carrier_is_hand)
    racket_frame = racket.frame(held_at)
    joint: Any = None
    bushing: Any = None
    if kind == "weld":
        joint = plant.WeldFrames(hand_frame, racket_frame)
    elif kind == "torsional":
        name = f"{plant.GetModelInstanceName(racket.model_instance)}_grip"
        joint = plant.AddJoint(BallRpyJoint(name, hand_frame, racket_frame))
    if kind != "weld":
        bushing = _bushing(plant, hand_frame, racket_frame, _constants(grip, kind))
    return Grip(plant, kind, hand_frame, racket_frame, bushing, joint)


def _add_hand(
    plant: MultibodyPlant,
    racket: Racket,
    carrier: Frame,
    grip: GripStiffness,
    carrier_is_hand: bool,
) -> Grip:
    """A palm on the racket; a hand that has mass and its wrist behind it, if `carrier` is none."""
    hand, kind = _hand_of(grip), "hand"
    if carrier_is_hand:
        held = racket.frame("grip")
        bushing = _bushing(plant, carrier, held, _constants(grip, kind))
        return Grip(plant, kind, carrier, held, bushing, None)
    name = f"{plant.GetModelInstanceName(racket.model_instance)}_hand"
    place = RigidTransform([hand.place.value, 0.0, 0.0])
    held = plant.AddFrame(FixedOffsetFrame(f"{name}_place", racket.handle.body_frame(), place))
    instance = plant.AddModelInstance(name)
    body = plant.AddRigidBody(name, instance, _inertia(hand))
    frame = body.body_frame()
    bushing = _bushing(plant, frame, held, _constants(grip, kind))
    wrist = _bushing(plant, carrier, frame, _wrist_constants(hand))
    return Grip(plant, kind, frame, held, bushing, None, body, carrier, wrist)


def _bushing(plant: MultibodyPlant, a: Frame, c: Frame, numbers: list[list[float]]) -> Any:
    constants: list[Any] = numbers
    return plant.AddForceElement(LinearBushingRollPitchYaw(a, c, *constants))
