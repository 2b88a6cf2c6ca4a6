"""The compiled engine's rates of what users compose: two rackets, an imported arm."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RevoluteJoint, SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, MatrixGain, Sine

import drake_racket as dr
from drake_racket import (
    InputError,
    Scenario,
    add_ball,
    add_impact,
    add_racket,
    load_ball,
    load_racket,
    make_impact_diagram,
)
from drake_racket.engines.compiled.engine import CompiledImpact
from drake_racket.engines.compiled.extract.model import Wiring, extract
from drake_racket.plant.compose import connect_forces
from tests.engines.compiled.helpers import rates_at
from tests.engines.compiled.random_trees import random_state
from tests.engines.compiled.test_accelerations import record_at


@pytest.fixture(scope="module")
def pair():
    """Two rackets of two kinds in one plant, one welded by its butt, with a ball for each."""
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    impacts = []
    tour = add_racket(plant, load_racket("tour"), name="tour")
    welded = add_racket(
        plant,
        load_racket("recreational", "high"),
        name="recreational",
        parent=plant.world_frame(),
        held_at="butt",
        X_PF=RigidTransform([0.3, 0.2, 1.0]),
    )
    balls = [add_ball(plant, load_ball(), name=f"ball_{i}") for i in range(2)]
    for racket, ball in zip((tour, welded), balls, strict=True):
        impacts.append(add_impact(builder, plant, racket, ball, point=0, connect=False))
    connect_forces(builder, plant, impacts)
    return plant, impacts, builder.Build()


@pytest.mark.parametrize("touching", [(0, 0), (1, 0), (0, 1), (1, 1)])
def test_two_rackets_in_one_plant(pair, touching):
    plant, impacts, diagram = pair
    root = diagram.CreateDefaultContext()
    context = plant.GetMyMutableContextFromRoot(root)
    model = extract(plant, root, Wiring(impacts))
    rng = np.random.default_rng(sum(touching) + 1)
    for _ in range(20):
        state = random_state(plant, rng, 0.02)
        state[plant.num_positions() :] *= 100.0
        records = []
        for on, impact in zip(touching, impacts, strict=True):
            own = impact.contact.GetMyMutableContextFromRoot(root)
            record = record_at(rng, 9, rng.integers(0, 2), rng.integers(0, 2))
            record[0] = float(on)
            own.SetDiscreteState(record)
            records.append(record)
        plant.SetPositionsAndVelocities(context, state)
        normal = []
        for impact in impacts:
            own = impact.contact.GetMyContextFromRoot(root)
            normal.append(impact.contact.GetOutputPort("contact_state").Eval(own)[4])
        if any(on and force == 0.0 for on, force in zip(touching, normal, strict=True)):
            continue  # past the release, where a step of the compiled engine looks further
        expected = diagram.EvalTimeDerivatives(root).CopyToVector()
        found = rates_at(model, model.floats, state, np.array(records))
        scale = np.max(np.abs(expected))
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * scale)


@pytest.mark.slow
def test_an_arm_of_mujocos():
    pytest.importorskip("myo_sim")
    from drake_racket import LimbSettings, Stroke
    from drake_racket.limbs import import_mujoco
    from studies.myosim_arm.__main__ import MODEL, POSTURE, load_arm
    from studies.myosim_arm.hand import HAND, fist, grip_in_hand

    model = load_arm()
    X_BH = grip_in_hand(model)
    settings = {"root": "clavicle_r", "hand": HAND, "locked": fist(model), "X_BH": X_BH}

    def arm(plant):
        return import_mujoco(plant, model, name=MODEL, **settings).limb

    limb = LimbSettings(joint_torques="hold", stroke=Stroke(guess_deg=POSTURE))
    scenario = Scenario(support="limb", limb=limb)
    system = make_impact_diagram(scenario, limb=arm)
    compiled = CompiledImpact(system)
    start = compiled.start(system.case)
    rng = np.random.default_rng(3)
    n = system.plant.num_multibody_states()
    root = system.create_context()
    context = system.plant.GetMyMutableContextFromRoot(root)
    for _ in range(100):
        state = start.y[:n].copy()
        state[system.plant.num_positions() :] += rng.normal(size=system.plant.num_velocities())
        system.plant.SetPositionsAndVelocities(context, state)
        expected = system.diagram.EvalTimeDerivatives(root).CopyToVector()[:n]
        found = rates_at(compiled.model, start.floats, state)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.max(np.abs(expected)))


def swing(plant, root, impacts):
    """Both balls on their way to the rackets."""
    context = plant.GetMyMutableContextFromRoot(root)
    for impact, place, speed in zip(
        impacts, ([0.511, 0.0, 0.02], [0.3 + 0.5, 0.22, 1.0 + 0.02]), (25.0, 18.0), strict=True
    ):
        plant.SetFreeBodyPose(context, impact.ball.body, RigidTransform(place))
        plant.SetFreeBodySpatialVelocity(
            context, impact.ball.body, SpatialVelocity([0, 0, 0], [0.0, 1.0, -speed])
        )


def test_a_diagram_of_ones_own_runs_as_in_drake(pair):
    plant, impacts, diagram = pair
    compiled = dr.CompiledDiagram(diagram, plant, impacts)
    root = diagram.CreateDefaultContext()
    swing(plant, root, impacts)
    first = compiled.advance(root, 0.003)
    second = compiled.advance(root, 0.008)
    assert first.time[-1] == second.time[0] == 0.003
    simulator = Simulator(diagram)
    expected = simulator.get_mutable_context()
    swing(plant, expected, impacts)
    dr.configure_integrator(simulator, dr.IntegratorSettings(accuracy=1e-6))
    simulator.AdvanceTo(0.008)
    found = plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(root))
    wanted = plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(expected))
    np.testing.assert_allclose(found, wanted, rtol=0, atol=2e-4)
    assert root.get_time() == 0.008
    for impact in impacts:
        ours, theirs = impact.record(root), impact.record(expected)
        assert (ours.point, ours.touches, ours.phase) == (theirs.point, 1, theirs.phase)
        assert ours.touch_time == pytest.approx(theirs.touch_time, abs=1e-8)
        assert ours.release_time == pytest.approx(theirs.release_time, abs=1e-6)
    with pytest.raises(InputError, match=r"end: got 0\.008; allowed: after the time"):
        compiled.advance(root, 0.008)


def arm_with(source):
    """A hinged arm with a racket, and a source of force on its joint."""
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    arm = plant.AddRigidBody("arm", SpatialInertia.SolidCylinderWithMass(3.0, 0.04, 0.6, [1, 0, 0]))
    joint = plant.AddJoint(
        RevoluteJoint("shoulder", plant.world_frame(), arm.body_frame(), [0, 1, 0])
    )
    motor = plant.AddJointActuator("motor", joint)
    racket = add_racket(plant, load_racket("tour"), parent=arm.body_frame())
    ball = add_ball(plant, load_ball())
    impact = add_impact(builder, plant, racket, ball)
    builder.AddSystem(source)
    gain = builder.AddSystem(MatrixGain(np.array([[2.0]])))
    builder.Connect(source.get_output_port(0), gain.get_input_port())
    builder.Connect(gain.get_output_port(), plant.get_actuation_input_port())
    return plant, impact, builder.Build(), motor


def test_a_constant_torque_acts_and_a_controller_is_refused():
    plant, impact, diagram, _ = arm_with(ConstantVectorSource([3.5]))
    compiled = dr.CompiledDiagram(diagram, plant, [impact])
    root = diagram.CreateDefaultContext()
    run = compiled.advance(root, 0.02)
    simulator = Simulator(diagram)
    dr.configure_integrator(simulator, dr.IntegratorSettings(accuracy=1e-6))
    simulator.AdvanceTo(0.02)
    own = plant.GetMyContextFromRoot(simulator.get_context())
    wanted = plant.GetPositionsAndVelocities(own)
    np.testing.assert_allclose(run.state[-1], wanted, rtol=0, atol=2e-4)
    assert abs(wanted[plant.num_positions()]) > 0.01
    controller = Sine(1.0, 1.0, 0.0, 1)
    controller.set_name("controller")
    plant, impact, diagram, _ = arm_with(controller)
    with pytest.raises(InputError, match="controller on actuation: got 'Sine'"):
        dr.CompiledDiagram(diagram, plant, [impact])


def two_balls(pair, arrival):
    """One ball touches at 0.2 ms, the other at `arrival`; the records of both after 8 ms."""
    plant, impacts, diagram = pair
    root = diagram.CreateDefaultContext()
    context = plant.GetMyMutableContextFromRoot(root)
    places = [0.511, 0.0, 0.005], [0.3 + 0.509, 0.2, 1.0 + 10.0 * arrival]
    for impact, place, speed in zip(impacts, places, (25.0, 10.0), strict=True):
        plant.SetFreeBodyPose(context, impact.ball.body, RigidTransform(place))
        velocity = SpatialVelocity([0, 0, 0], [0.0, 0.0, -speed])
        plant.SetFreeBodySpatialVelocity(context, impact.ball.body, velocity)
    settings = dr.IntegratorSettings(maximum_step=2e-4, error_control=False)
    dr.CompiledDiagram(diagram, plant, impacts).advance(root, 0.008, settings)
    return [impact.record(root) for impact in impacts]


def test_two_events_within_one_step(pair):
    """A ball arrives as the other leaves: whichever is first ends the step, none is lost."""
    release = two_balls(pair, 0.02)[0].release_time
    for arrival in release + np.linspace(-4e-5, 4e-5, 41):
        first, second = two_balls(pair, arrival)
        assert (first.touches, second.touches) == (1, 1), arrival - release
        assert first.release_time == pytest.approx(release, abs=2e-6)
        assert second.touch_time == pytest.approx(arrival, abs=1e-5)
