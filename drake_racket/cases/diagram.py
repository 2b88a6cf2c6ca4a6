"""Builds the ready-made case once, to run many times: one racket, one ball, one support."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, Diagram, DiagramBuilder

from drake_racket.cases.case import Case, resolve
from drake_racket.io.errors import InputError
from drake_racket.io.schema import shown
from drake_racket.laws.phases import ContactModel
from drake_racket.laws.surface import SurfaceModel
from drake_racket.limbs.limb import Limb
from drake_racket.limbs.models import LimbBuilder
from drake_racket.limbs.striking import (
    StrikingLimb,
    add_striking_limb,
    wire_striking_limb,
)
from drake_racket.limbs.torques import Muscles, add_muscles
from drake_racket.parameters.racket import RacketParameters
from drake_racket.parameters.scenario import Scenario
from drake_racket.plant.ball import add_ball, set_ball_inertia
from drake_racket.plant.compose import (
    Impact,
    add_impact,
    connect_forces,
    set_impact_parameters,
)
from drake_racket.plant.contacts import contact_model, element_model, surface_model
from drake_racket.plant.grip import Grip, add_grip
from drake_racket.plant.racket import add_racket, set_racket_inertia
from drake_racket.plant.supports import add_hand_held_racket, add_supported_racket
from drake_racket.plant.systems.energy_meter import add_energy_meter, set_meter_parameters
from drake_racket.plant.systems.grip_load import add_grip_load, set_grip_load_parameters
from drake_racket.plant.systems.step_probe import StepProbe

__all__ = ["ImpactDiagram", "make_impact_diagram"]

_IDENTITY = RigidTransform(Quaternion(1.0, 0.0, 0.0, 0.0), [0.0, 0.0, 0.0])


@dataclass(frozen=True, repr=False, eq=False)
class ImpactDiagram:
    """The ImpactDiagram holds a built Diagram and the handles into it.

    The Diagram exports the outputs `contact_state`, `string_tension` and `string_deflection`, and
    `hand_load` where a hand holds the racket (then there are `grip` and `grip_load`, and with a
    hand that has mass `wrist_load`); with a limb
    also `joint_torques`, as an output, or as an input if they are a user's (then there is `limb`).
    Build one per topology (`Case.topology`) and take a new Context per case.

    Attributes:
        diagram: to be simulated, or to become part of another.
        plant: with racket, ball and whatever holds the racket.
        impact: handles to string-bed and contact.
        meter: the EnergyMeter; None without an audit.
        case: that it was built for.
        grip: handles to the hand; None where no hand holds the racket.
        grip_load: the GripLoad; None likewise.
        limb: handles to the limb; None without one.
        probe: reads accelerations between steps, for histories.

    """

    diagram: Diagram
    plant: MultibodyPlant
    impact: Impact
    meter: Any | None
    case: Case
    grip: Grip | None = None
    grip_load: Any | None = None
    limb: StrikingLimb | None = None
    probe: Any | None = None
    wrist_load: Any | None = None

    def __repr__(self) -> str:
        """Shows the scenario that it was built for."""
        return shown(self, repr(self.scenario))

    @property
    def scenario(self) -> Scenario:
        """The scenario is the one that it was built for."""
        return self.case.scenario

    def create_context(self, scenario: Scenario | Case | None = None) -> Context:
        """Makes a Context with the parameters and the initial state of a scenario or case.

        Call it before the Diagram becomes part of another: then take the state over from here
        (`SetTimeStateAndParametersFrom`).

        Raises:
            InputError: the scenario is not valid, or needs another Diagram.

        """
        case = self.case if scenario is None else resolve(scenario)
        self._check_topology(case)
        root = self.diagram.CreateDefaultContext()
        self._write(root, case)
        return root

    def write_context(self, root: Context, case: Case) -> None:
        """Writes a case's parameters and initial state into a Context that was made here.

        Whatever a case can vary is written; what a simulation has left there is not undone.

        Raises:
            InputError: the case needs another Diagram.

        """
        self._check_topology(case)
        self._write(root, case)

    def _check_topology(self, case: Case) -> None:
        if case.topology != self.case.topology:
            raise InputError(
                "scenario",
                f"{case.scenario.racket}, {case.scenario.support}",
                "a scenario with the topology that this diagram was built for",
            )

    def _write(self, root: Context, case: Case) -> None:
        contact = _contact_model(case)
        set_impact_parameters(self.impact, root, case.racket, contact)
        set_racket_inertia(self.impact.racket, root, case.racket)
        assert self.impact.ball is not None
        set_ball_inertia(self.impact.ball, root, case.ball)
        if self.grip is not None:
            self.grip.set_stiffness(root, case.grip)
            set_grip_load_parameters(self.grip_load, self.grip, root)
            wrist = self.grip.wrist_side()
            if wrist is not None:
                set_grip_load_parameters(self.wrist_load, wrist, root)
        if self.meter is not None:
            set_meter_parameters(self.meter, self.impact, root)
        self._set_initial_state(root, case.scenario, case.racket, contact)

    def _set_initial_state(
        self,
        root: Context,
        scenario: Scenario,
        racket: RacketParameters,
        contact: ContactModel | SurfaceModel,
    ) -> None:
        plant, ball = self.plant, self.impact.ball
        assert ball is not None
        context = plant.GetMyMutableContextFromRoot(root)
        handle = self.impact.racket.handle
        if handle.is_floating_base_body():
            plant.SetFreeBodyPose(context, handle, _IDENTITY)
        if self.grip is not None:
            self.grip.rest(root)
        if self.limb is not None:
            assert self.grip is not None
            self.limb.set_state(root, self.impact.racket, self.grip, scenario.limb)
        X_WR = handle.EvalPoseInWorld(context)
        aim = X_WR.rotation() @ scenario.aim(racket)
        aim_velocity = handle.EvalSpatialVelocityInWorld(context).Shift(aim).translational()
        velocity = X_WR.rotation() @ scenario.ball_velocity()
        # the racket moves on while the ball comes
        start = X_WR.translation() + aim - scenario.approach_time * (velocity - aim_velocity)
        spin = X_WR.rotation() @ scenario.ball_spin()
        if isinstance(contact, SurfaceModel):  # its surface is aimed
            start = start + X_WR.rotation() @ np.array([0.0, 0.0, contact.surface[0]])
        plant.SetFreeBodyPose(context, ball.body, RigidTransform(start))
        plant.SetFreeBodySpatialVelocity(context, ball.body, SpatialVelocity(spin, velocity))


def _contact_model(case: Case) -> ContactModel | SurfaceModel:
    scenario = case.scenario
    if scenario.contact == "surface":
        return surface_model(case.racket, case.ball)
    if scenario.has_element():
        return element_model(case.racket, case.ball, scenario.point_number())
    return contact_model(
        case.racket,
        case.ball,
        scenario.point_number(),
        scenario.friction_reading,
        scenario.reaction_point,
    )


def _muscles(plant: MultibodyPlant, body: Limb, case: Case, builder: LimbBuilder | None) -> Muscles:
    """The muscles of the shipped limb; a caller's own has none that are known."""
    if builder is not None or case.limb is None:
        raise InputError(
            "limb.activation", case.scenario.limb.activation, "0 with a limb of the caller's"
        )
    return add_muscles(plant, body, case.limb)


def make_impact_diagram(
    scenario: Scenario | Case | None = None,
    *,
    limb: LimbBuilder | None = None,
    export_torques: bool = False,
) -> ImpactDiagram:
    """Builds the Diagram of a scenario (the default: tour racket, free, centre, 25 m/s).

    Build one per topology and vary cases by its Contexts, as `simulate` does by itself: Drake 1.51
    never frees a system in Python, so a loop that builds one per case grows by 0.6 MB each.

    Args:
        limb: with support `limb`, a function that adds a limb of the caller's to the plant and
            returns it, or its hand frame; the scenario's `limb.model` is then not looked at.
        export_torques: the limb's joint torques come from the Diagram's input `joint_torques`; the
            plant's state is its output `state`. Such a Diagram is part of the caller's own, with
            the caller's Simulator.

    Raises:
        InputError: the scenario is not valid.

    """
    case = resolve(scenario or Scenario())
    scenario = case.scenario
    builder = DiagramBuilder()
    plant = builder.AddNamedSystem("plant", MultibodyPlant(scenario.time_step))
    grip = None
    body = muscles = None
    if scenario.support == "grip":
        racket, grip = add_hand_held_racket(plant, case.racket, case.grip, kind=scenario.grip_kind)
    elif scenario.support == "limb":
        body = add_striking_limb(plant, scenario.limb, limb, case.limb)
        if scenario.limb.activation > 0.0:
            muscles = _muscles(plant, body, case, limb)
        racket = add_racket(plant, case.racket)
        grip = add_grip(
            plant, racket, body.hand, case.grip, kind=scenario.grip_kind, carrier_is_hand=True
        )
    else:
        racket = add_supported_racket(plant, case.racket, scenario.support)
    ball = add_ball(plant, case.ball, contact=scenario.contact)
    plant.mutable_gravity_field().set_gravity_vector(scenario.gravity)
    plant.Finalize()
    impact = add_impact(
        builder,
        plant,
        racket,
        ball,
        point=scenario.point_number(),
        friction_reading=scenario.friction_reading,
        reaction_point=scenario.reaction_point,
        contact=scenario.contact,
        connect=False,
    )
    striking = None
    if body is not None:
        striking = wire_striking_limb(
            builder,
            plant,
            body,
            scenario.limb,
            audit=scenario.audit,
            export_torques=export_torques,
            shipped=case.limb,
            muscles=muscles,
        )
    others = striking.generalized_force_ports() if striking is not None else []
    connect_forces(builder, plant, [impact], generalized=others)
    grip_load = add_grip_load(builder, plant, grip) if grip is not None else None
    wrist = None if grip is None else grip.wrist_side()
    wrist_load = None
    if wrist is not None:
        wrist_load = add_grip_load(builder, plant, wrist, name="wrist_load")
    meter = None
    if scenario.audit:
        loads = [load for load in (grip_load, wrist_load) if load is not None]
        meter = add_energy_meter(builder, plant, impact, loads)
    probe = builder.AddNamedSystem("step_probe", StepProbe())
    assert impact.contact is not None
    builder.ExportOutput(impact.contact.GetOutputPort("contact_state"), "contact_state")
    builder.ExportOutput(impact.string_bed.GetOutputPort("string_tension"), "string_tension")
    deflection = impact.string_bed.GetOutputPort("string_deflection")
    builder.ExportOutput(deflection, "string_deflection")
    if grip_load is not None:
        builder.ExportOutput(grip_load.GetOutputPort("hand_load"), "hand_load")
    if export_torques:
        builder.ExportOutput(plant.get_state_output_port(), "state")
    if striking is not None and striking.torques.source is not None:
        builder.ExportOutput(striking.torques.source.get_output_port(), "joint_torques")
    return ImpactDiagram(
        builder.Build(), plant, impact, meter, case, grip, grip_load, striking, probe, wrist_load
    )
