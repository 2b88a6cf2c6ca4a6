"""The ready-made case: one racket, one ball, one support, built once and run many times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, Diagram, DiagramBuilder

from drake_racket.io.errors import InputError
from drake_racket.limbs.models import LimbBuilder
from drake_racket.limbs.striking import (
    StrikingLimb,
    add_striking_limb,
    wire_striking_limb,
)
from drake_racket.parameters.ball import BallParameters
from drake_racket.parameters.racket import RacketParameters
from drake_racket.parameters.scenario import Scenario, check_scenario
from drake_racket.plant.ball import add_ball, set_ball_inertia
from drake_racket.plant.compose import (
    Impact,
    add_impact,
    connect_forces,
    contact_model,
    set_impact_parameters,
)
from drake_racket.plant.grip import Grip, add_grip
from drake_racket.plant.racket import add_racket, set_racket_inertia
from drake_racket.plant.supports import add_hand_held_racket, add_supported_racket
from drake_racket.plant.systems.energy_meter import add_energy_meter, set_meter_parameters
from drake_racket.plant.systems.grip_load import add_grip_load, set_grip_load_parameters

__all__ = ["ImpactDiagram", "make_impact_diagram"]

_IDENTITY = RigidTransform(Quaternion(1.0, 0.0, 0.0, 0.0), [0.0, 0.0, 0.0])


@dataclass(frozen=True)
class ImpactDiagram:
    """A built Diagram and the handles into it.

    The Diagram exports the outputs `contact_state`, `string_tensions` and `string_deflections`, and
    `hand_load` where a hand holds the racket (then there are `grip` and `grip_load`); with a limb
    also `joint_torques`, as an output, or as an input if they are a user's (then there is `limb`).
    Build one per topology (what `topology` returns) and take a new Context per case.
    """

    diagram: Diagram
    plant: MultibodyPlant
    impact: Impact
    meter: Any | None
    scenario: Scenario
    grip: Grip | None = None
    grip_load: Any | None = None
    limb: StrikingLimb | None = None

    def create_context(self, scenario: Scenario | None = None) -> Context:
        """A new Context with the parameters and the initial state of `scenario`.

        Call it before the Diagram becomes part of another: then take the state over from here
        (`SetTimeStateAndParametersFrom`).

        Raises:
            InputError: the scenario is not valid, or needs another Diagram.

        """
        scenario = scenario or self.scenario
        check_scenario(scenario)
        racket, ball = scenario.load_racket(), scenario.load_ball()
        built = topology(self.scenario, self.impact.racket.parameters, self._ball_parameters())
        if topology(scenario, racket, ball) != built:
            raise InputError(
                "scenario",
                f"{scenario.racket}, {scenario.support}",
                "a scenario with the topology that this diagram was built for",
            )
        root = self.diagram.CreateDefaultContext()
        contact = contact_model(
            racket,
            ball,
            scenario.point_number(),
            scenario.friction_reading,
            scenario.reaction_point,
        )
        set_impact_parameters(self.impact, root, racket, contact)
        set_racket_inertia(self.impact.racket, root, racket)
        assert self.impact.ball is not None
        set_ball_inertia(self.impact.ball, root, ball)
        if self.grip is not None:
            self.grip.set_stiffness(root, scenario.load_grip())
            set_grip_load_parameters(self.grip_load, self.grip, root)
        if self.meter is not None:
            set_meter_parameters(self.meter, self.impact, root)
        self._set_initial_state(root, scenario, racket)
        return root

    def _ball_parameters(self) -> BallParameters:
        assert self.impact.ball is not None
        return self.impact.ball.parameters

    def _set_initial_state(
        self, root: Context, scenario: Scenario, racket: RacketParameters
    ) -> None:
        plant, ball = self.plant, self.impact.ball
        assert ball is not None
        context = plant.GetMyMutableContextFromRoot(root)
        handle = self.impact.racket.handle
        if handle.is_floating_base_body():
            plant.SetFreeBodyPose(context, handle, _IDENTITY)
        if self.limb is not None:
            assert self.grip is not None
            self.limb.set_state(root, self.impact.racket, self.grip, scenario.limb)
        X_WR = handle.EvalPoseInWorld(context)
        aim = X_WR.rotation() @ scenario.aim(racket)
        aim_velocity = handle.EvalSpatialVelocityInWorld(context).Shift(aim).translational()
        velocity = X_WR.rotation() @ scenario.ball_velocity()
        # the racket moves on while the ball comes
        start = X_WR.translation() + aim - scenario.approach_time * (velocity - aim_velocity)
        plant.SetFreeBodyPose(context, ball.body, RigidTransform(start))
        plant.SetFreeBodySpatialVelocity(context, ball.body, SpatialVelocity([0, 0, 0], velocity))


def topology(scenario: Scenario, racket: RacketParameters, ball: BallParameters) -> tuple[Any, ...]:
    """What a Diagram is built from and a Context cannot change; equal tuples share a Diagram.

    Of racket and ball: places and lengths, which are the Diagram's frames and what pictures are
    drawn from, and which spring takes which constant. All else of racket, ball and grip is in the
    Context (`create_context`).
    """
    bed = racket.string_bed
    lengths = (
        racket.handle.length,  # the throat joint
        racket.head.length,  # the frame `tip`
        racket.landmarks.grip,
        racket.landmarks.accelerometer,
        bed.gsc,
        bed.spacing,
        bed.rim_semi_axis_x,  # within which the contact looks for a touch
        bed.rim_semi_axis_y,
        ball.radius,
    )
    return (
        scenario.support,
        scenario.grip_kind if scenario.support in ("grip", "limb") else "",
        scenario.limb.topology() if scenario.support == "limb" else (),
        scenario.time_step,
        tuple(scenario.gravity),
        scenario.audit,
        tuple(quantity.value for quantity in lengths),
        tuple(sorted(bed.springs.value.items())),
        (len(bed.stiffness.value), len(bed.rim_factors.value)),
    )


def make_impact_diagram(
    scenario: Scenario | None = None,
    *,
    limb: LimbBuilder | None = None,
    export_torques: bool = False,
) -> ImpactDiagram:
    """Builds the Diagram of a scenario (the default: tour racket, free, centre, 25 m/s).

    Args:
        limb: with support `limb`, a function that adds a limb of the caller's to the plant and
            returns it, or its hand frame; the scenario's `limb.model` is then not looked at.
        export_torques: the limb's joint torques come from the Diagram's input `joint_torques`; the
            plant's state is its output `state`. Such a Diagram is part of the caller's own, with
            the caller's Simulator.

    Raises:
        InputError: the scenario is not valid.

    """
    scenario = scenario or Scenario()
    check_scenario(scenario)
    builder = DiagramBuilder()
    plant = builder.AddNamedSystem("plant", MultibodyPlant(scenario.time_step))
    grip = None
    body = None
    if scenario.support == "grip":
        racket, grip = add_hand_held_racket(
            plant, scenario.load_racket(), scenario.load_grip(), kind=scenario.grip_kind
        )
    elif scenario.support == "limb":
        body = add_striking_limb(plant, scenario.limb, limb)
        racket = add_racket(plant, scenario.load_racket())
        grip = add_grip(plant, racket, body.hand, scenario.load_grip(), kind=scenario.grip_kind)
    else:
        racket = add_supported_racket(plant, scenario.load_racket(), scenario.support)
    ball = add_ball(plant, scenario.load_ball())
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
        )
    others = striking.generalized_force_ports() if striking is not None else []
    connect_forces(builder, plant, [impact], generalized=others)
    grip_load = add_grip_load(builder, plant, grip) if grip is not None else None
    meter = add_energy_meter(builder, plant, impact, grip_load) if scenario.audit else None
    assert impact.contact is not None
    builder.ExportOutput(impact.contact.GetOutputPort("contact_state"), "contact_state")
    builder.ExportOutput(impact.string_bed.GetOutputPort("tensions"), "string_tensions")
    builder.ExportOutput(impact.string_bed.GetOutputPort("deflections"), "string_deflections")
    if grip_load is not None:
        builder.ExportOutput(grip_load.GetOutputPort("hand_load"), "hand_load")
    if export_torques:
        builder.ExportOutput(plant.get_state_output_port(), "state")
    if striking is not None and striking.torques.source is not None:
        builder.ExportOutput(striking.torques.source.get_output_port(), "joint_torques")
    return ImpactDiagram(builder.Build(), plant, impact, meter, scenario, grip, grip_load, striking)
