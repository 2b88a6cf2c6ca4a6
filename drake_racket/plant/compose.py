"""Wires rackets, balls and their impacts into a Diagram.

By hand, on the user's own plant and builder::

    racket = add_racket(plant, load_racket("tour"), parent=hand_frame)
    ball = add_ball(plant, load_ball())
    impact = add_impact(builder, plant, racket, ball)

`add_impact` may come before or after `plant.Finalize()`. Drake declares the plant's ports there, so
that a plant which is not finalized yet is finalized by it: everything else must be on it by then.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.multibody.plant import ExternallyAppliedSpatialForceMultiplexer, MultibodyPlant
from pydrake.systems.framework import Context, DiagramBuilder, OutputPort
from pydrake.systems.primitives import Adder

from drake_racket.io.errors import InputError
from drake_racket.io.schema import shown
from drake_racket.laws.contact import FRICTION_READINGS, REACTION_POINTS
from drake_racket.laws.phases import (
    ContactBodies,
    ContactModel,
    ContactRecord,
    contact_record,
)
from drake_racket.laws.surface import SurfaceModel
from drake_racket.parameters.racket import RacketParameters
from drake_racket.plant.ball import Ball
from drake_racket.plant.contacts import (
    check_contact,
    contact_model,
    element_model,
    surface_bodies,
    surface_model,
)
from drake_racket.plant.racket import Racket
from drake_racket.plant.string_bed import string_bed_model, string_coordinates
from drake_racket.plant.systems.ball_contact import BallContact
from drake_racket.plant.systems.string_bed import StringBed
from drake_racket.plant.systems.surface_contact import SurfaceContact


@dataclass(frozen=True, repr=False)
class Impact:
    """The Impact holds handles to the systems of one racket and one ball.

    Attributes:
        string_bed: the StringBed system.
        contact: the BallContact or SurfaceContact; None for a racket without a ball.

    """

    racket: Racket
    ball: Ball | None
    string_bed: Any
    contact: Any | None

    def __repr__(self) -> str:
        """Shows the racket and the ball."""
        return shown(self, f"{self.racket!r}, {self.ball or 'no ball'}")

    def generalized_force_port(self) -> OutputPort:
        """Gives the forces of the strings, for the plant's applied_generalized_force."""
        return self.string_bed.GetOutputPort("generalized_force")

    def spatial_force_port(self) -> OutputPort | None:
        """Gives the contact's forces, for applied_spatial_force; None without a ball."""
        return None if self.contact is None else self.contact.GetOutputPort("spatial_forces")

    def record(self, root: Context) -> ContactRecord:
        """Reads what the contact has latched: phase, point, speed, kb, cb, times.

        Args:
            root: the Context of the Diagram that holds this impact.

        Raises:
            InputError: the impact has no ball.

        """
        if self.contact is None:
            raise InputError("Impact.record", "an impact without a ball", "an impact with a ball")
        context = self.contact.GetMyContextFromRoot(root)
        return contact_record(context.get_discrete_state_vector().CopyToVector())


def add_impact(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    racket: Racket,
    ball: Ball | None = None,
    *,
    point: int = 0,
    friction_reading: str = "velocity",
    reaction_point: str = "ball",
    contact: str = "paper",
    name: str | None = None,
    connect: bool = True,
) -> Impact:
    """Adds the string-bed of `racket`, and its contact with `ball`, to `builder`.

    Call it once per racket; a second ball on the same racket needs no second string-bed: see
    `add_contact`. Finalizes the plant if that has not been done: models can be added to it, and its
    gravity be set, only before.

    Args:
        point: number of the string-bed point that the ball meets, or 0 for the nearest at touch.
        friction_reading: `velocity`, `displacement` or `element` (see `laws.contact`); with the
            last one the contact is a SurfaceContact.
        reaction_point: where the reaction to the contact force acts on the head: `ball`, at the
            ball (action and reaction along one line), or `string_mass`, as the source has it.
        contact: `paper`, a point without spin on one string mass, or `surface`, a ball with radius
            and spin anywhere on the bed (`laws.surface`), for which the three above have no say.
        name: prefix of the two systems' names; the racket's model name if None.
        connect: wire the forces to the plant's input ports. With several rackets, or other sources
            of force on the same ports, pass False and call `connect_forces` once.

    Raises:
        InputError: the plant is not in the builder, racket or ball is not on the plant, the racket
            is not strung, or a choice is unknown. Nothing is changed then.

    """
    _check_plant(builder, plant, "add_impact", racket, ball)
    _check_choices(racket, point, friction_reading, reaction_point)
    if ball is not None:
        check_contact(contact, ball, "add_impact: contact", friction_reading)
    _finalize(plant)
    name = name or plant.GetModelInstanceName(racket.model_instance)
    string_bed = builder.AddNamedSystem(
        f"{name}_string_bed",
        StringBed(string_bed_model(racket.parameters), string_coordinates(racket)),
    )
    builder.Connect(plant.get_state_output_port(), string_bed.GetInputPort("state"))
    system = None
    if ball is not None:
        system = add_contact(
            builder,
            plant,
            racket,
            ball,
            point=point,
            friction_reading=friction_reading,
            reaction_point=reaction_point,
            contact=contact,
            name=f"{name}_{plant.GetModelInstanceName(ball.model_instance)}_contact",
        )
    impact = Impact(racket, ball, string_bed, system)
    if connect:
        connect_forces(builder, plant, [impact])
    return impact


def add_contact(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    racket: Racket,
    ball: Ball,
    *,
    point: int = 0,
    friction_reading: str = "velocity",
    reaction_point: str = "ball",
    contact: str = "paper",
    name: str,
) -> Any:
    """Adds one contact and connects its inputs; returns the system. As `add_impact`."""
    _check_plant(builder, plant, "add_contact", racket, ball)
    _check_choices(racket, point, friction_reading, reaction_point)
    check_contact(contact, ball, "add_contact: contact", friction_reading)
    _finalize(plant)
    if contact == "surface" or friction_reading == "element":
        own = surface_model(racket.parameters, ball.parameters)
        if contact == "paper":
            own = element_model(racket.parameters, ball.parameters, point)
        system = builder.AddNamedSystem(
            name, SurfaceContact(own, surface_bodies(racket, ball), plant)
        )
        builder.Connect(plant.get_state_output_port(), system.GetInputPort("state"))
        return system
    model = contact_model(
        racket.parameters, ball.parameters, point, friction_reading, reaction_point
    )
    bodies = ContactBodies(
        ball=int(ball.body.index()),
        strings=tuple(int(b.index()) for b in racket.string_masses),
    )
    system = builder.AddNamedSystem(name, BallContact(model, bodies, plant))
    builder.Connect(plant.get_state_output_port(), system.GetInputPort("state"))
    return system


def connect_forces(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    impacts: Sequence[Impact],
    *,
    generalized: Sequence[OutputPort] = (),
    spatial: Sequence[OutputPort] = (),
) -> None:
    """Connects the forces of all impacts, and of the user's own sources, to the plant.

    The plant has one input port for each kind of force; several sources are summed (Drake's Adder)
    or listed together (Drake's ExternallyAppliedSpatialForceMultiplexer).

    Raises:
        InputError: one of the two input ports is connected already.

    """
    vectors = [i.generalized_force_port() for i in impacts] + list(generalized)
    ports = [i.spatial_force_port() for i in impacts]
    lists = [p for p in ports if p is not None] + list(spatial)
    for sources, target, key in (
        (vectors, plant.get_applied_generalized_force_input_port(), "generalized"),
        (lists, plant.get_applied_spatial_force_input_port(), "spatial"),
    ):
        if not sources:
            continue
        if builder.IsConnectedOrExported(target):
            raise InputError(
                f"connect_forces: the plant's applied_{key}_force port",
                "connected already",
                "one call of connect_forces with all sources (add_impact(..., connect=False))",
            )
        if len(sources) == 1:
            builder.Connect(sources[0], target)
            continue
        junction: Any = (
            Adder(len(sources), plant.num_velocities())
            if key == "generalized"
            else ExternallyAppliedSpatialForceMultiplexer(len(sources))
        )
        builder.AddSystem(junction)
        for i, source in enumerate(sources):
            builder.Connect(source, junction.get_input_port(i))
        builder.Connect(junction.get_output_port(), target)


def set_impact_parameters(
    impact: Impact,
    root: Context,
    racket: RacketParameters,
    contact: ContactModel | SurfaceModel | None,
) -> None:
    """Writes the parameters of another racket file, ball or choice into a Diagram's Context.

    Varies what does not change the topology: spring constants, T0, damping, rest lengths, ball,
    friction, point, readings, and the frame's spring-dampers. Masses and moments are set by
    `racket.set_racket_inertia` and `ball.set_ball_inertia`. Geometry and spring assignment belong
    to the plant and its systems: build a Diagram for each.

    Args:
        root: the Context of the Diagram that holds `impact`.

    """
    bed, springs = impact.string_bed, string_bed_model(racket)
    context = bed.GetMyMutableContextFromRoot(root)
    for index, values in (
        (bed.STIFFNESS, springs.stiffness),
        (bed.RIM_FACTORS, springs.rim_factors),
        (bed.INITIAL_TENSION, [springs.initial_tension]),
        (bed.DAMPING, [springs.damping]),
        (bed.LENGTHS, springs.lengths),
    ):
        context.get_mutable_numeric_parameter(index).SetFromVector(np.asarray(values))
    if contact is not None and impact.contact is not None:
        context = impact.contact.GetMyMutableContextFromRoot(root)
        groups: list[Any] = [contact.ball, contact.friction]
        if isinstance(contact, SurfaceModel):
            groups.append(contact.surface)
        else:
            choices = [contact.point, contact.by_displacement, contact.reaction_at_ball]
            groups += [contact.scales, choices]
        for index, group in enumerate(groups):
            context.get_mutable_numeric_parameter(index).SetFromVector(
                np.asarray(group, dtype=float)
            )
    context = impact.racket.plant.GetMyMutableContextFromRoot(root)
    impact.racket.set_joint_constants(context, racket.frame_joints())


def _check_plant(
    builder: DiagramBuilder, plant: MultibodyPlant, key: str, racket: Racket, ball: Ball | None
) -> None:
    if not any(system is plant for system in builder.GetSystems()):
        raise InputError(f"{key}: plant", "not in the builder", "a plant that the builder holds")
    for name, part in (("racket", racket), ("ball", ball)):
        if part is not None and part.plant is not plant:
            raise InputError(f"{key}: {name}", f"a {name} of another plant", "one of this plant")
    if not racket.string_joints:
        raise InputError(f"{key}: racket", "an unstrung racket", "a strung racket")


def _check_choices(racket: Racket, point: int, friction_reading: str, reaction_point: str) -> None:
    most = len(racket.string_masses)
    if point not in range(most + 1):
        raise InputError("point", point, f"1 to {most}, or 0 for the nearest at touch")
    if friction_reading not in FRICTION_READINGS:
        raise InputError("friction_reading", friction_reading, ", ".join(FRICTION_READINGS))
    if reaction_point not in REACTION_POINTS:
        raise InputError("reaction_point", reaction_point, ", ".join(REACTION_POINTS))


def _finalize(plant: MultibodyPlant) -> None:
    """Drake declares a plant's ports in Finalize; nothing can be wired to it before."""
    if not plant.is_finalized():
        plant.Finalize()
