"""The ready-made case: one racket, one ball, one support, built once and run many times."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, Diagram, DiagramBuilder

from drake_racket.ball import add_ball
from drake_racket.diagram import Impact, add_impact, contact_model, set_impact_parameters
from drake_racket.energy import add_energy_meter, set_meter_parameters
from drake_racket.errors import InputError
from drake_racket.grip import Grip
from drake_racket.grip_load import add_grip_load, set_grip_load_parameters
from drake_racket.parameters import BallParameters, RacketParameters
from drake_racket.scenario import Scenario, check_scenario
from drake_racket.supports import add_hand_held_racket, add_supported_racket

__all__ = ["ImpactDiagram", "make_impact_diagram"]

_IDENTITY = RigidTransform(Quaternion(1.0, 0.0, 0.0, 0.0), [0.0, 0.0, 0.0])


@dataclass(frozen=True)
class ImpactDiagram:
    """A built Diagram and the handles into it.

    The Diagram exports the outputs `contact_state`, `string_tensions` and `string_deflections`, and
    `hand_load` where a hand holds the racket (then there are `grip` and `grip_load`).
    Build one per topology (what `topology` returns) and take a new Context per case.
    """

    diagram: Diagram
    plant: MultibodyPlant
    impact: Impact
    meter: Any | None
    scenario: Scenario
    grip: Grip | None = None
    grip_load: Any | None = None

    def create_context(self, scenario: Scenario | None = None) -> Context:
        """A new Context with the parameters and the initial state of `scenario`.

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
        if self.grip is not None:
            self.grip.set_stiffness(root, scenario.load_grip())
            set_grip_load_parameters(self.grip_load, self.grip, root)
        if self.meter is not None:
            set_meter_parameters(self.meter, self.impact, root)
        self._set_initial_state(root, scenario, racket)
        return root

    def _racket_floats(self) -> bool:
        return self.scenario.support == "free" or (
            self.grip is not None and self.grip.kind == "compliant"
        )

    def _ball_parameters(self) -> BallParameters:
        assert self.impact.ball is not None
        return self.impact.ball.parameters

    def _set_initial_state(
        self, root: Context, scenario: Scenario, racket: RacketParameters
    ) -> None:
        plant, ball = self.plant, self.impact.ball
        assert ball is not None
        context = plant.GetMyMutableContextFromRoot(root)
        if self._racket_floats():
            plant.SetFreeBodyPose(context, self.impact.racket.handle, _IDENTITY)
        velocity = scenario.ball_velocity()
        start = scenario.aim(racket) - scenario.approach_time * velocity
        plant.SetFreeBodyPose(context, ball.body, RigidTransform(start))
        plant.SetFreeBodySpatialVelocity(context, ball.body, SpatialVelocity([0, 0, 0], velocity))


def topology(scenario: Scenario, racket: RacketParameters, ball: BallParameters) -> tuple[Any, ...]:
    """What a Diagram is built from and a Context cannot change; equal tuples share a Diagram."""
    bed = racket.string_bed
    return (
        scenario.support,
        scenario.grip_kind if scenario.support == "grip" else "",
        scenario.time_step,
        tuple(scenario.gravity),
        scenario.audit,
        *(dataclasses.astuple(p) for p in (racket.handle, racket.head, racket.landmarks)),
        *(q.value for q in (bed.gsc, bed.spacing, bed.mass)),
        (bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value),
        tuple(sorted(bed.springs.value.items())),
        (len(bed.stiffness.value), len(bed.rim_factors.value)),
        (ball.mass.value, ball.radius.value),
    )


def make_impact_diagram(scenario: Scenario | None = None) -> ImpactDiagram:
    """Builds the Diagram of a scenario (the default: tour racket, free, centre, 25 m/s).

    Raises:
        InputError: the scenario is not valid.

    """
    scenario = scenario or Scenario()
    check_scenario(scenario)
    builder = DiagramBuilder()
    plant = builder.AddNamedSystem("plant", MultibodyPlant(scenario.time_step))
    grip = None
    if scenario.support == "grip":
        racket, grip = add_hand_held_racket(
            plant, scenario.load_racket(), scenario.load_grip(), kind=scenario.grip_kind
        )
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
    )
    grip_load = add_grip_load(builder, plant, grip) if grip is not None else None
    meter = add_energy_meter(builder, plant, impact, grip_load) if scenario.audit else None
    assert impact.contact is not None
    builder.ExportOutput(impact.contact.GetOutputPort("contact_state"), "contact_state")
    builder.ExportOutput(impact.string_bed.GetOutputPort("tensions"), "string_tensions")
    builder.ExportOutput(impact.string_bed.GetOutputPort("deflections"), "string_deflections")
    if grip_load is not None:
        builder.ExportOutput(grip_load.GetOutputPort("hand_load"), "hand_load")
    return ImpactDiagram(builder.Build(), plant, impact, meter, scenario, grip, grip_load)
