"""Reads a mechanism's numbers from a plant and its Context for whoever knows no Drake."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BodyIndex,
    ForceElementIndex,
    Frame,
    Joint,
    PrismaticSpring,
    RevoluteSpring,
    RigidBody,
)
from pydrake.systems.framework import Context

from drake_racket.engines.trajectory import (
    Bodies,
    FrameJointNumbers,
    JointRanges,
    JointSprings,
    LimbNumbers,
    Mechanism,
    Place,
    StringNumbers,
)
from drake_racket.limbs.limb import Limb
from drake_racket.limbs.striking import StrikingLimb
from drake_racket.limbs.stroke import coordinate_names
from drake_racket.plant.compose import Impact
from drake_racket.plant.grip import Grip

_SAME_PLACE = 1e-6  # m; joints nearer than this, at both ends of a run, are one landmark


@dataclass(frozen=True)
class Parts:
    """Holds handles to what takes part in an impact: as in `ImpactDiagram`, or a user's own."""

    impact: Impact
    meter: Any | None = None
    grip: Grip | None = None
    grip_load: Any | None = None
    limb: StrikingLimb | None = None

    @property
    def plant(self) -> MultibodyPlant:
        """Gives the plant that holds them."""
        return self.impact.racket.plant


def mechanism_of(
    parts: Parts, root: Context, ends: Sequence[NDArray[np.float64]] = ()
) -> Mechanism:
    """Reads the numbers of a mechanism.

    Args:
        parts: what takes part.
        root: the Context of the Diagram that holds them: masses and constants are its.
        ends: the plant's states [q; v] at the ends of a run: joints of the limb that are in one
            place in all of them are one landmark. None: no landmarks.

    """
    plant, impact = parts.plant, parts.impact
    context = plant.GetMyContextFromRoot(root)
    racket, ball = impact.racket, impact.ball
    assert ball is not None
    names = ["butt", "gsc", "tip", "accelerometer"]
    places = {name: _place(racket.frame(name)) for name in names}
    if parts.grip is not None:
        places["racket_grip"] = _place(parts.grip.racket_frame)
        places["hand"] = _place(parts.grip.hand_frame)
    landmarks, segments = _landmarks(parts, root, ends) if len(ends) else ({}, [])
    places |= {_key(name): _place(frame) for name, frame in landmarks.items()}
    return Mechanism(
        bodies=_bodies(plant, context),
        racket=tuple(int(body.index()) for body in racket.bodies()),
        handle=int(racket.handle.index()),
        ball=int(ball.body.index()),
        ball_position=ball.body.floating_positions_start() + 4,
        ball_velocity=plant.num_positions() + ball.body.floating_velocities_start_in_v() + 3,
        frame=_frame_joints(impact, context),
        strings=_strings(impact, root),
        places=places,
        num_positions=plant.num_positions(),
        gravity=np.array(plant.gravity_field().gravity_vector()),
        limb=None if parts.limb is None else _limb(parts.limb, plant, root),
        hand=_hand(parts.grip),
        landmarks=tuple(landmarks),
        segments=tuple(segments),
    )


def with_numbers_of(before: Mechanism, parts: Parts, root: Context) -> Mechanism:
    """Gives a mechanism that has no limb with the numbers of another Context of its plant."""
    plant, bed = parts.plant, parts.impact.string_bed
    context = plant.GetMyContextFromRoot(root)
    joints = parts.impact.racket.joint_constants(context)
    return dataclasses.replace(
        before,
        bodies=_bodies(plant, context),
        frame=dataclasses.replace(
            before.frame, stiffness=np.array([joint.stiffness for joint in joints])
        ),
        strings=dataclasses.replace(
            before.strings, constants=bed.spring_constants(bed.GetMyContextFromRoot(root))
        ),
    )


def _hand(grip: Grip | None) -> int | None:
    return None if grip is None or grip.body is None else int(grip.body.index())


def _key(landmark: str) -> str:
    return f"landmark {landmark}"


def _place(frame: Frame) -> Place:
    pose = frame.GetFixedPoseInBodyFrame()
    return Place(int(frame.body().index()), pose.rotation().matrix(), pose.translation())


def _bodies(plant: MultibodyPlant, context: Context) -> Bodies:
    count = plant.num_bodies()
    mass, com, moments = np.zeros(count), np.zeros((count, 3)), np.zeros((count, 3, 3))
    for i in range(1, count):  # the world has no mass of its own
        body = plant.get_body(BodyIndex(i))
        mass[i] = body.get_mass(context)
        if mass[i] > 0.0:
            inertia = body.CalcSpatialInertiaInBodyFrame(context)
            com[i] = inertia.get_com()
            moments[i] = inertia.CalcRotationalInertia().CopyToFullMatrix3()
    return Bodies(mass, com, moments)


def _frame_joints(impact: Impact, context: Context) -> FrameJointNumbers:
    racket = impact.racket
    joints = racket.frame_joints
    return FrameJointNumbers(
        names=tuple(joint.name() for joint in joints),
        planes=tuple(joint.plane for joint in racket.parameters.frame_joints()),
        position=_indices(joint.position_start() for joint in joints),
        velocity=_indices(joint.velocity_start() for joint in joints),
        stiffness=np.array([joint.stiffness for joint in racket.joint_constants(context)]),
    )


def _indices(numbers: Any) -> NDArray[np.int64]:
    return np.array(list(numbers), dtype=np.int64)


def _strings(impact: Impact, root: Context) -> StringNumbers:
    racket = impact.racket
    topology = racket.parameters.bed_topology()
    at, count = impact.string_bed.at, len(topology.points)
    return StringNumbers(
        points=topology.points,
        springs=topology.names,
        bodies=tuple(int(body.index()) for body in racket.string_masses),
        position=_indices(joint.position_start() for joint in racket.string_joints),
        velocity=_indices(joint.velocity_start() for joint in racket.string_joints),
        incidence=topology.incidence,
        constants=impact.string_bed.spring_constants(impact.string_bed.GetMyContextFromRoot(root)),
        arms=impact.string_bed.model.arms,
        folds=impact.string_bed.model.folds,
        arm_position=at.positions[count:],
        arm_velocity=at.velocities[count:],
    )


def _limb(striking: StrikingLimb, plant: MultibodyPlant, root: Context) -> LimbNumbers:
    limb = striking.limb
    names = coordinate_names(limb)
    sliding = [j.position_start() for j in limb.joints if j.type_name() == "prismatic"]
    places = limb.position_indices()
    bodies = [i for instance in limb.model_instances for i in plant.GetBodyIndices(instance)]
    ranges = None
    if striking.limits is not None:
        system, at = striking.limits, striking.limits.at
        context = system.GetMyContextFromRoot(root)
        numbers = [context.get_numeric_parameter(i).CopyToVector() for i in range(4)]
        first = plant.num_positions()
        ranges = JointRanges(at.positions, at.velocities - first, *numbers)
    return LimbNumbers(
        bodies=tuple(int(i) for i in bodies),
        massive=tuple(int(body.index()) for body in striking.bodies),
        coordinates=names,
        prismatic=tuple(n for n, place in zip(names, places, strict=True) if place in sliding),
        position=places,
        velocity=limb.velocity_indices(),
        springs=_joint_springs(limb, plant, plant.GetMyContextFromRoot(root)),
        ranges=ranges,
        notes=limb.notes,
    )


def _joint_springs(limb: Limb, plant: MultibodyPlant, context: Context) -> JointSprings:
    """Springs on the joints of the limb's models, and the rotors of their actuators."""
    ours = {joint.index() for joint in (*limb.joints, *limb.others())}
    rotors = [
        (actuator.joint().velocity_start(), float(actuator.calc_reflected_inertia(context)))
        for actuator in (plant.get_joint_actuator(i) for i in plant.GetJointActuatorIndices())
        if actuator.joint().index() in ours
    ]
    springs: list[tuple[Joint, float, float]] = []
    for i in range(plant.num_force_elements()):
        spring = plant.get_force_element(ForceElementIndex(i))
        if isinstance(spring, RevoluteSpring):
            numbers = spring.GetStiffness(context), spring.GetNominalAngle(context)
        elif isinstance(spring, PrismaticSpring):
            numbers = spring.stiffness(), spring.nominal_position()
        else:
            continue
        if spring.joint().index() in ours:
            springs.append((spring.joint(), *map(float, numbers)))
    return JointSprings(
        position=_indices(joint.position_start() for joint, _, _ in springs),
        stiffness=np.array([k for _, k, _ in springs]),
        nominal=np.array([nominal for _, _, nominal in springs]),
        rotor_velocity=_indices(start for start, _ in rotors),
        rotor_inertia=np.array([inertia for _, inertia in rotors]),
    )


def _landmarks(
    parts: Parts, root: Context, ends: Sequence[NDArray[np.float64]]
) -> tuple[dict[str, Frame], list[tuple[str, str]]]:
    """Places that a picture of hand and limb is drawn from, and the segments between them.

    From the trunk to the hand: each place of the limb's joints under the name of its first joint,
    then `hand`; `hand` alone for a hand without a limb. Joints in one place at all ends are one
    landmark; a segment joins each to its parent's.
    """
    if parts.limb is None:
        return ({} if parts.grip is None else {"hand": parts.grip.hand_frame}), []
    limb, plant = parts.limb.limb, parts.plant
    joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
    inward = {int(joint.child_body().index()): joint.parent_body() for joint in joints}
    frames = [joint.frame_on_child() for joint in limb.joints]
    scratch = plant.CreateDefaultContext()
    scratch.SetTimeStateAndParametersFrom(plant.GetMyContextFromRoot(root))
    at_ends = []
    for state in ends:
        plant.SetPositionsAndVelocities(scratch, state)
        at_ends.append([frame.CalcPoseInWorld(scratch).translation() for frame in frames])
    found: dict[str, Frame] = {}
    segments: list[tuple[str, str]] = []
    row_of: dict[str, int] = {}
    landmark_of: dict[int, str] = {}  # body -> landmark of the joint that carries it
    for row, joint in enumerate(limb.joints):
        parent = _carrier(landmark_of, inward, joint.parent_body())
        name = joint.name()
        if parent is not None and all(
            float(np.linalg.norm(p[row] - p[row_of[parent]])) < _SAME_PLACE for p in at_ends
        ):
            name = parent
        else:
            row_of[name] = row
            found[name] = frames[row]
            if parent is not None:
                segments.append((parent, name))
        landmark_of[int(joint.child_body().index())] = name
    parent = _carrier(landmark_of, inward, limb.hand.body())
    last = "hand" if "hand" not in found else "hand_frame"
    found[last] = limb.hand
    if parent is not None:
        segments.append((parent, last))
    return found, segments


def _carrier(
    landmark_of: dict[int, str], inward: dict[int, RigidBody], body: RigidBody
) -> str | None:
    """The landmark of the nearest joint of the limb between `body` and the world."""
    while int(body.index()) not in landmark_of:
        if int(body.index()) not in inward:
            return None
        body = inward[int(body.index())]
    return landmark_of[int(body.index())]
