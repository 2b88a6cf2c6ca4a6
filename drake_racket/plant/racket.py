"""Adds a racket to a plant: the bodies of its frame, their joints, and the string masses."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from dataclasses import dataclass

from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    ForceElementIndex,
    Frame,
    Joint,
    LinearBushingRollPitchYaw,
    ModelInstanceIndex,
    RevoluteSpring,
    RigidBody,
)
from pydrake.systems.framework import Context

from drake_racket.io.errors import InputError
from drake_racket.io.schema import shown
from drake_racket.parameters.frame import FrameJoint, bushing_constants
from drake_racket.parameters.racket import RacketParameters
from drake_racket.plant.sdf import racket_sdf, segment_inertia, string_inertia
from drake_racket.plant.shapes import show_racket

FRAMES = ("butt", "grip", "accelerometer", "throat", "gsc", "tip")

_STRING_MASS = re.compile(r"string_\d+$")


@dataclass(frozen=True, repr=False)
class Racket:
    """The Racket holds handles to a racket in a plant.

    Attributes:
        segments: the bodies of the frame, in the order of `RacketParameters.frame_segments`.
        handle, head: the first of them, and the one that holds the string-bed's centre and carries
            the string masses. R is the handle's body frame (origin at the butt), the head's body
            frame has its origin at the throat joint.
        frame_joints: the revolute joints of the frame, in the order of
            `RacketParameters.frame_joints`.
        string_masses, string_joints: the points in order; empty if not strung.
        bushing: torsional spring-dampers of two segments (pitch is out of plane, yaw in plane).
        springs: of more segments, one a joint; their dampers are the joints' own.

    """

    plant: MultibodyPlant
    parameters: RacketParameters
    model_instance: ModelInstanceIndex
    segments: tuple[RigidBody, ...]
    handle: RigidBody
    head: RigidBody
    frame_joints: tuple[Joint, ...]
    string_masses: tuple[RigidBody, ...]
    string_joints: tuple[Joint, ...]
    bushing: LinearBushingRollPitchYaw | None
    springs: tuple[RevoluteSpring, ...] = ()

    def __repr__(self) -> str:
        """Shows the model instance, the parameters' name and the string masses."""
        instance = self.plant.GetModelInstanceName(self.model_instance)
        strings = f"{len(self.string_masses)} string masses" if self.string_masses else "not strung"
        return shown(self, f"{instance}: {self.parameters.name}, {strings}")

    def frame(self, name: str) -> Frame:
        """Gives one of the named frames: butt, grip, accelerometer, throat, gsc, tip.

        Raises:
            InputError: another name.

        """
        if name not in FRAMES:
            raise InputError("Racket.frame: name", name, ", ".join(FRAMES))
        return self.plant.GetFrameByName(name, self.model_instance)

    @property
    def in_plane(self) -> Joint:
        """The joint of a frame of two segments about z is that of in-plane bending."""
        return self.frame_joint("in_plane")

    @property
    def out_of_plane(self) -> Joint:
        """The joint of a frame of two segments about y is that of out-of-plane bending."""
        return self.frame_joint("out_of_plane")

    def frame_joint(self, name: str) -> Joint:
        """Finds one of `frame_joints` by its name.

        Raises:
            InputError: another name.

        """
        by_name = {joint.name(): joint for joint in self.frame_joints}
        if name not in by_name:
            raise InputError("Racket.frame_joint: name", name, ", ".join(by_name))
        return by_name[name]

    def joints_of(self, plane: str) -> list[Joint]:
        """Lists the joints of one plane (`in_plane`, `out_of_plane`, `torsion`), from the butt."""
        pairs = zip(self.frame_joints, self.parameters.frame_joints(), strict=True)
        return [joint for joint, own in pairs if own.plane == plane]

    def joint_constants(self, context: Context | None = None) -> tuple[FrameJoint, ...]:
        """Reads the frame's joints with the stiffness and damping of a plant's Context.

        Without a Context they are those that the plant's model has.
        """
        own = self.parameters.frame_joints()
        pairs = (
            self._of_springs(context) if self.bushing is None else self._of_bushing(own, context)
        )
        return tuple(
            dataclasses.replace(joint, stiffness=float(stiffness), damping=float(damping))
            for joint, (stiffness, damping) in zip(own, pairs, strict=True)
        )

    def _of_bushing(
        self, joints: Sequence[FrameJoint], context: Context | None
    ) -> list[tuple[float, float]]:
        bushing = self.bushing
        assert bushing is not None
        if context is None:
            stiffness = bushing.torque_stiffness_constants()
            damping = bushing.torque_damping_constants()
        else:
            stiffness = bushing.GetTorqueStiffnessConstants(context)
            damping = bushing.GetTorqueDampingConstants(context)
        return [(stiffness[joint.axis_index], damping[joint.axis_index]) for joint in joints]

    def _of_springs(self, context: Context | None) -> list[tuple[float, float]]:
        pairs = zip(self.springs, self.frame_joints, strict=True)
        if context is None:
            return [(s.default_stiffness(), j.default_damping()) for s, j in pairs]
        return [(s.GetStiffness(context), j.GetDamping(context)) for s, j in pairs]

    def set_joint_constants(self, context: Context, joints: Sequence[FrameJoint]) -> None:
        """Writes the stiffness and damping of all the frame's joints into a plant's Context."""
        if self.bushing is not None:
            stiffness, damping = bushing_constants(joints)
            self.bushing.SetTorqueStiffnessConstants(context, stiffness)
            self.bushing.SetTorqueDampingConstants(context, damping)
            return
        for spring, joint, own in zip(self.springs, self.frame_joints, joints, strict=True):
            spring.SetStiffness(context, own.stiffness)
            joint.SetDamping(context, own.damping)

    def bodies(self) -> list[RigidBody]:
        """Lists all bodies of the racket, string masses and massless links included."""
        indices = self.plant.GetBodyIndices(self.model_instance)
        return [self.plant.get_body(i) for i in indices]


def add_racket(
    plant: MultibodyPlant,
    parameters: RacketParameters,
    *,
    name: str = "racket",
    strung: bool = True,
    parent: Frame | None = None,
    held_at: str = "grip",
    X_PF: RigidTransform | None = None,
) -> Racket:
    """Adds a racket to `plant`, before `Finalize`.

    A plant with a SceneGraph (`AddMultibodyPlantSceneGraph`) gets its shapes, too, to be seen in
    Meshcat or by a camera; they do not collide.

    Args:
        name: the model instance's name; must be new in the plant.
        strung: with the string masses; False gives the bare frame of the modal tests.
        parent: a frame P to weld the racket's frame F = `held_at` to; None leaves it free.
        held_at: the racket's frame that is welded: butt, grip, accelerometer, throat, gsc, tip.
        X_PF: pose of F in P; identity if None.

    Returns:
        The handles.

    Raises:
        InputError: the plant is finalized, the name is taken, or the frame is unknown.

    """
    if plant.is_finalized():
        raise InputError("add_racket: plant", "finalized", "a plant before Finalize()")
    if plant.HasModelInstanceNamed(name):
        raise InputError("add_racket: name", name, "a name that the plant does not have yet")
    if not (name.isascii() and name.isidentifier()):
        raise InputError("add_racket: name", name, "letters, digits and _ (not first a digit)")
    if held_at not in FRAMES:
        raise InputError("add_racket: held_at", held_at, ", ".join(FRAMES))
    parser = Parser(plant)
    parser.SetStrictParsing()
    (instance,) = parser.AddModelsFromString(racket_sdf(parameters, name, strung=strung), "sdf")
    racket = find_racket(plant, instance, parameters)
    show_racket(plant, racket.segments, racket.string_masses, parameters)
    if parent is not None:
        plant.WeldFrames(parent, racket.frame(held_at), X_PF or RigidTransform())
    return racket


def find_racket(
    plant: MultibodyPlant, instance: ModelInstanceIndex, parameters: RacketParameters
) -> Racket:
    """Finds the handles to a racket that the user's own parser has added (from sdf/, say).

    Raises:
        InputError: the model instance is not a racket of this package.

    """
    if not plant.HasBodyNamed("head", instance) or not plant.HasBodyNamed("handle", instance):
        raise InputError(
            "find_racket: instance", plant.GetModelInstanceName(instance), "a racket's model"
        )
    numbers = parameters.bed_topology().points if plant.HasBodyNamed("string_1", instance) else ()
    bodies = [plant.get_body(i).name() for i in plant.GetBodyIndices(instance)]
    if {f"string_{i}" for i in numbers} != {name for name in bodies if _STRING_MASS.match(name)}:
        raise InputError(
            "find_racket: instance",
            plant.GetModelInstanceName(instance),
            f"a model with {len(numbers)} string masses, as its parameters have",
        )
    segments = [segment.name for segment in parameters.frame_segments()]
    joints = [joint.name for joint in parameters.frame_joints()]
    missing = [name for name in segments if not plant.HasBodyNamed(name, instance)]
    missing += [name for name in joints if not plant.HasJointNamed(name, instance)]
    if missing:
        raise InputError(
            "find_racket: instance",
            plant.GetModelInstanceName(instance),
            f"a model with a frame of {len(segments)} segments, as its parameters have"
            f" (it has no {missing[0]})",
        )
    frame_joints = tuple(plant.GetJointByName(name, instance) for name in joints)
    return Racket(
        plant=plant,
        parameters=parameters,
        model_instance=instance,
        segments=tuple(plant.GetBodyByName(name, instance) for name in segments),
        handle=plant.GetBodyByName("handle", instance),
        head=plant.GetBodyByName("head", instance),
        frame_joints=frame_joints,
        string_masses=tuple(plant.GetBodyByName(f"string_{i}", instance) for i in numbers),
        string_joints=tuple(plant.GetJointByName(f"string_joint_{i}", instance) for i in numbers),
        bushing=_bushing(plant, instance) if len(segments) == 2 else None,
        springs=_springs(plant, frame_joints) if len(segments) > 2 else (),
    )


def _springs(plant: MultibodyPlant, joints: Sequence[Joint]) -> tuple[RevoluteSpring, ...]:
    """The springs on the frame's joints, in order."""
    found = {}
    for index in range(plant.num_force_elements()):
        element = plant.get_force_element(ForceElementIndex(index))
        if isinstance(element, RevoluteSpring):
            found[element.joint().index()] = element
    return tuple(found[joint.index()] for joint in joints)


def _bushing(plant: MultibodyPlant, instance: ModelInstanceIndex) -> LinearBushingRollPitchYaw:
    for index in range(plant.num_force_elements()):
        element = plant.get_force_element(ForceElementIndex(index))
        if isinstance(element, LinearBushingRollPitchYaw) and element.model_instance() == instance:
            return element
    raise InputError(
        "find_racket: instance", plant.GetModelInstanceName(instance), "a model with a bushing"
    )


def set_racket_inertia(racket: Racket, root: Context, parameters: RacketParameters) -> None:
    """Writes mass, centre of mass and moments of segments and string masses into a Context.

    The numbers are those that the SDF of `parameters` has. Massless links stay as they are.

    Args:
        root: the plant's Context, or that of a Diagram that holds the plant.

    """
    context = racket.plant.GetMyMutableContextFromRoot(root)
    for body, segment in zip(racket.segments, parameters.frame_segments(), strict=True):
        body.SetSpatialInertiaInBodyFrame(context, segment_inertia(segment).spatial())
    inertia = string_inertia(parameters).spatial()
    for body in racket.string_masses:
        body.SetSpatialInertiaInBodyFrame(context, inertia)
