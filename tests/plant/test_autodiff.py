"""Derivatives of the rebound velocity by AutoDiff through a whole impact, against differences."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.autodiffutils import AutoDiffXd
from pydrake.systems.analysis import Simulator, Simulator_

from drake_racket import BallContact, Scenario, StringBed, make_impact_diagram

STEP = 2e-5
# off centre and oblique, so that friction and both bending stiffnesses matter
SCENARIO = Scenario(
    point=4, incidence_deg=40, azimuth_deg=60, speed=28, approach_time=0.0, audit=False
)
NAMES = ("kb", "cb", "T0", "k1", "k2", "k3", "k4", "mu", "kf_in_plane", "kf_out_of_plane")


def set_parameters(system, diagram, root, values) -> None:
    """Writes the ten parameters, floats or AutoDiffXd, into a Context of `diagram`."""
    kb, cb, t0, *rest = values
    k, (mu, kf_z, kf_y) = rest[:4], rest[4:]
    contact = diagram.GetSubsystemByName(system.impact.contact.get_name())
    bed = diagram.GetSubsystemByName(system.impact.string_bed.get_name())
    plant = diagram.GetSubsystemByName("plant")
    contact_context = contact.GetMyMutableContextFromRoot(root)
    ball = contact_context.get_mutable_numeric_parameter(BallContact.BALL)
    ball[2], ball[4] = kb, cb
    contact_context.get_mutable_numeric_parameter(BallContact.FRICTION)[3] = mu
    bed_context = bed.GetMyMutableContextFromRoot(root)
    bed_context.get_mutable_numeric_parameter(StringBed.INITIAL_TENSION)[0] = t0
    bed_context.get_mutable_numeric_parameter(StringBed.STIFFNESS).SetFromVector(np.array(k))
    bushing = next(
        element
        for element in map(plant.get_force_element, map(_index, range(plant.num_force_elements())))
        if "LinearBushing" in type(element).__name__
    )
    zero = 0.0 * kf_z
    bushing.SetTorqueStiffnessConstants(
        plant.GetMyMutableContextFromRoot(root), np.array([zero, kf_y, kf_z])
    )


def _index(i):
    from pydrake.multibody.tree import ForceElementIndex

    return ForceElementIndex(i)


def defaults(system) -> list[float]:
    p, ball = system.impact.racket.parameters, system.impact.ball.parameters
    return [
        ball.stiffness_low.value,
        ball.damping_low.value,
        p.string_bed.initial_tension.value,
        *p.string_bed.stiffness.value,
        p.friction_coefficients()[3],
        p.throat_joint.in_plane()[0],
        p.throat_joint.out_of_plane()[0],
    ]


def rebound(system, diagram, simulator_type, root, values):
    set_parameters(system, diagram, root, values)
    simulator = simulator_type(diagram, root)
    root = simulator.get_mutable_context()
    root.SetAccuracy(1e-6)
    integrator = simulator.get_mutable_integrator()
    integrator.set_maximum_step_size(STEP)
    integrator.request_initial_step_size_target(STEP)
    integrator.set_fixed_step_mode(True)
    simulator.AdvanceTo(0.0045)
    plant = diagram.GetSubsystemByName("plant")
    ball = plant.GetBodyByName("ball")
    assert system.impact.contact is not None
    context = plant.GetMyContextFromRoot(root)
    return ball.EvalSpatialVelocityInWorld(context).translational()


@pytest.fixture(scope="module")
def exact():
    """The Diagram, its parameters, and the derivatives of the rebound by them."""
    system = make_impact_diagram(SCENARIO)
    values = defaults(system)
    diagram = system.diagram.ToAutoDiffXd()
    root = diagram.CreateDefaultContext()
    root.SetTimeStateAndParametersFrom(system.create_context(SCENARIO))
    unit = np.eye(len(values))
    seeded = [AutoDiffXd(v, row) for v, row in zip(values, unit, strict=True)]
    velocity = rebound(system, diagram, Simulator_[AutoDiffXd], root, seeded)
    return system, values, np.array([v.derivatives() for v in velocity])


# one of each part by default: ball, friction, strings, frame
BY_DEFAULT = ("cb", "mu", "T0", "kf_out_of_plane")


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=[] if n in BY_DEFAULT else [pytest.mark.slow]) for n in NAMES],
)
def test_derivatives_equal_central_differences(exact, name):
    system, values, derivatives = exact
    i = NAMES.index(name)
    h = 1e-4 * values[i]
    plus, minus = (
        rebound(
            system,
            system.diagram,
            Simulator,
            system.create_context(SCENARIO),
            [v + sign * h * (j == i) for j, v in enumerate(values)],
        )
        for sign in (1.0, -1.0)
    )
    difference = (plus - minus) / (2.0 * h)
    scale = np.max(np.abs(difference))
    assert scale * values[i] > 1e-6  # the case is sensitive to it
    assert derivatives[:, i] == pytest.approx(difference, abs=1e-5 * scale)
