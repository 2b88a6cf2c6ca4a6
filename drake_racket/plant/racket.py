"""Adds a racket to a plant: two bodies, two revolute joints, the bushing and nine string masses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    ForceElementIndex,
    Frame,
    Joint,
    LinearBushingRollPitchYaw,
    ModelInstanceIndex,
    RigidBody,
)
from pydrake.systems.framework import Context

from drake_racket.io.errors import InputError
from drake_racket.laws.strings import (
    SPRING_NAMES,
    rest_lengths,
    spring_formula,
)
from drake_racket.parameters.racket import RacketParameters
from drake_racket.plant.sdf import part_inertia, racket_sdf, string_inertia
from drake_racket.plant.systems.string_bed import StringBedModel, StringCoordinates

FRAMES = ("butt", "grip", "accelerometer", "throat", "gsc", "tip")


@dataclass(frozen=True)
class Racket:
    """Handles to a racket in a plant.

    Attributes:
        handle, head: the two bodies of the frame; R is the handle's body frame (origin at the
            butt), the head's body frame has its origin at the throat joint.
        in_plane, out_of_plane: the revolute joints about z and y.
        string_masses, string_joints: points 1-9 in order; empty if not strung.
        bushing: the two torsional spring-dampers (pitch is out of plane, yaw in plane).

    """

    plant: MultibodyPlant
    parameters: RacketParameters
    model_instance: ModelInstanceIndex
    handle: RigidBody
    head: RigidBody
    in_plane: Joint
    out_of_plane: Joint
    string_masses: tuple[RigidBody, ...]
    string_joints: tuple[Joint, ...]
    bushing: LinearBushingRollPitchYaw

    def frame(self, name: str) -> Frame:
        """One of the named frames: butt, grip, accelerometer, throat, gsc, tip.

        Raises:
            InputError: another name.

        """
        if name not in FRAMES:
            raise InputError("Racket.frame: name", name, ", ".join(FRAMES))
        return self.plant.GetFrameByName(name, self.model_instance)

    def bodies(self) -> list[RigidBody]:
        """All bodies of the racket, string masses and massless link included."""
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

    Args:
        name: the model instance's name; must be new in the plant.
        strung: with the nine string masses; False gives the bare frame of the modal tests.
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
    if parent is not None:
        plant.WeldFrames(parent, racket.frame(held_at), X_PF or RigidTransform())
    return racket


def find_racket(
    plant: MultibodyPlant, instance: ModelInstanceIndex, parameters: RacketParameters
) -> Racket:
    """Handles to a racket that the user's own parser has added (from sdf/, say).

    Raises:
        InputError: the model instance is not a racket of this package.

    """
    if not plant.HasBodyNamed("head", instance) or not plant.HasBodyNamed("handle", instance):
        raise InputError(
            "find_racket: instance", plant.GetModelInstanceName(instance), "a racket's model"
        )
    strung = plant.HasBodyNamed("string_1", instance)
    numbers = range(1, 10) if strung else range(0)
    head = plant.GetBodyByName("head", instance)
    return Racket(
        plant=plant,
        parameters=parameters,
        model_instance=instance,
        handle=plant.GetBodyByName("handle", instance),
        head=head,
        in_plane=plant.GetJointByName("in_plane", instance),
        out_of_plane=plant.GetJointByName("out_of_plane", instance),
        string_masses=tuple(plant.GetBodyByName(f"string_{i}", instance) for i in numbers),
        string_joints=tuple(plant.GetJointByName(f"string_joint_{i}", instance) for i in numbers),
        bushing=_bushing(plant, instance),
    )


def _bushing(plant: MultibodyPlant, instance: ModelInstanceIndex) -> LinearBushingRollPitchYaw:
    for index in range(plant.num_force_elements()):
        element = plant.get_force_element(ForceElementIndex(index))
        if isinstance(element, LinearBushingRollPitchYaw) and element.model_instance() == instance:
            return element
    raise InputError(
        "find_racket: instance", plant.GetModelInstanceName(instance), "a model with a bushing"
    )


def set_racket_inertia(racket: Racket, root: Context, parameters: RacketParameters) -> None:
    """Writes mass, centre of mass and moments of handle, head and string masses into a Context.

    The numbers are those that the SDF of `parameters` has. The massless link stays as it is.

    Args:
        root: the plant's Context, or that of a Diagram that holds the plant.

    """
    context = racket.plant.GetMyMutableContextFromRoot(root)
    for body, part in ((racket.handle, parameters.handle), (racket.head, parameters.head)):
        body.SetSpatialInertiaInBodyFrame(context, part_inertia(part).spatial())
    inertia = string_inertia(parameters).spatial()
    for body in racket.string_masses:
        body.SetSpatialInertiaInBodyFrame(context, inertia)


def string_bed_model(parameters: RacketParameters) -> StringBedModel:
    """The numbers of a parameter file's string-bed, for the StringBed system."""
    bed = parameters.string_bed
    formulas = [spring_formula(bed.springs.value[name]) for name in SPRING_NAMES]
    pairs = [pair for pair in formulas if pair is not None]
    return StringBedModel(
        stiffness=np.array(bed.stiffness.value),
        rim_factors=np.array(bed.rim_factors.value),
        stiffness_index=np.array([k for k, _ in pairs]),
        rim_factor_index=np.array([p for _, p in pairs]),
        initial_tension=bed.initial_tension.value,
        damping=bed.damping.value,
        lengths=rest_lengths(
            bed.spacing.value, bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value
        ),
    )


def string_coordinates(racket: Racket) -> StringCoordinates:
    """Where the string joints sit in the finalized plant's state."""
    plant = racket.plant
    return StringCoordinates(
        positions=np.array([j.position_start() for j in racket.string_joints]),
        velocities=np.array([j.velocity_start() for j in racket.string_joints]),
        num_positions=plant.num_positions(),
        num_velocities=plant.num_velocities(),
    )
