"""Joint torques: what holds a limb, where the torques go, and that a Context varies them."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_racket.io.errors import InputError
from drake_racket.limbs.stroke import apply_stroke
from drake_racket.limbs.torques import (
    add_joint_torques,
    carry_torques,
    hold_torques,
    initial_torques,
)
from drake_racket.plant.compose import add_impact, connect_forces
from tests.limbs.test_stroke import ARM_7, CASES, FULL, STROKE, make_case, solve

GRAVITIES = [[0.0, 0.0, -9.81], [0.0, 0.0, 0.0], [3.0, -2.0, 1.0]]
SWING = dataclasses.replace(STROKE, **FULL)


def built(case, *, export: bool = False, strings: bool = False):
    """A Diagram with the case's plant and its joint torques, connected."""
    builder = DiagramBuilder()
    builder.AddSystem(case.plant)
    torques = add_joint_torques(builder, case.plant, case.limb, export=export)
    impacts = [add_impact(builder, case.plant, case.racket, connect=False)] if strings else []
    port = torques.generalized_force_port()
    sources = [] if port is None else [port]
    connect_forces(builder, case.plant, impacts, generalized=sources)
    return builder.Build(), torques


def accelerations(diagram, case, root) -> np.ndarray:
    """v' of the limb's joints by Drake's forward dynamics."""
    whole = case.plant.EvalTimeDerivatives(case.plant.GetMyContextFromRoot(root))
    v_dot = whole.get_generalized_velocity().CopyToVector()
    return v_dot[case.limb.velocity_indices()]


@pytest.mark.parametrize("gravity", GRAVITIES, ids=["down", "none", "oblique"])
@pytest.mark.parametrize(
    ("hold", "options"),
    [("weld", {}), ("weld", {"effort": 1e5}), ("grip", {"damping": 0.3}), ("ball", {})],
    ids=["weld", "weld-actuated", "grip-damped", "ball"],
)
def test_hold_gives_no_joint_acceleration(hold, options, gravity):
    case = make_case(ARM_7, hold, gravity=gravity, **options)
    diagram, torques = built(case, strings=True)
    assert bool(torques.actuators) == bool(options.get("effort"))
    root = diagram.CreateDefaultContext()
    context = case.plant.GetMyMutableContextFromRoot(root)
    apply_stroke(case.plant, context, case.limb, case.racket, solve(case, SWING))
    without = np.abs(accelerations(diagram, case, root)).max()
    tau = initial_torques("hold", case.plant, context, case.limb, case.racket)
    torques.set(root, tau)
    assert np.abs(accelerations(diagram, case, root)).max() < 1e-9 * max(1.0, without)
    assert without > 1.0


def test_hold_counts_damping_and_any_state():
    """Also with the racket bent, strained in the grip and loose: what acts is what counts."""
    case = make_case(ARM_7, "grip", gravity=GRAVITIES[0], damping=0.4)
    diagram, torques = built(case)
    root = diagram.CreateDefaultContext()
    context = case.plant.GetMyMutableContextFromRoot(root)
    apply_stroke(case.plant, context, case.limb, case.racket, solve(case, SWING))
    q, v = case.plant.GetPositions(context), case.plant.GetVelocities(context)
    for joint in (case.racket.in_plane, case.racket.out_of_plane):
        q[joint.position_start()], v[joint.velocity_start()] = 0.01, 2.0
    case.plant.SetPositions(context, q)
    case.plant.SetVelocities(context, v * 1.01)
    torques.set(root, hold_torques(case.plant, context, case.limb))
    assert np.abs(accelerations(diagram, case, root)).max() < 1e-7


@pytest.mark.parametrize("gravity", GRAVITIES, ids=["down", "none", "oblique"])
def test_carry_is_the_same_for_a_welded_and_a_gripped_racket(gravity):
    """The load of the racket comes from two independent routes: in the tree, and as a wrench."""
    found = []
    state = solve(CASES[7, "weld"], SWING)
    for hold in ("weld", "grip", "ball"):
        case = make_case(ARM_7, hold, gravity=gravity)
        context = case.plant.CreateDefaultContext()
        apply_stroke(case.plant, context, case.limb, case.racket, state)
        found.append(carry_torques(case.plant, context, case.limb, case.racket))
    np.testing.assert_allclose(found[1], found[0], rtol=0, atol=1e-8)
    np.testing.assert_allclose(found[2], found[0], rtol=0, atol=1e-8)


def test_carry_is_the_static_moment_of_the_weights():
    """At rest: the moment of every weight about each joint's axis, by hand."""
    case = make_case(ARM_7, "grip", gravity=GRAVITIES[0])
    context = case.plant.CreateDefaultContext()
    state = solve(case, dataclasses.replace(STROKE, speed=0.0))
    apply_stroke(case.plant, context, case.limb, case.racket, state)
    plant, weights = case.plant, []
    links = [joint.child_body() for joint in case.limb.joints]
    for depth, body in [*enumerate(links), *((len(links), b) for b in case.racket.bodies())]:
        mass = body.get_mass(context)
        if mass > 0.0:
            com = body.CalcCenterOfMassInBodyFrame(context)
            place = plant.EvalBodyPoseInWorld(context, body) @ com
            weights.append((depth, place, np.array([0.0, 0.0, -9.81 * mass])))
    expected = []
    for number, (joint, row) in enumerate(zip(case.limb.joints, ARM_7, strict=True)):
        X = joint.frame_on_child().CalcPoseInWorld(context)
        axis = X.rotation() @ np.array([float(c) for c in row[1].split()])
        moment = sum(np.cross(p - X.translation(), f) for d, p, f in weights if d >= number)
        expected.append(-axis @ moment)
    tau = carry_torques(plant, context, case.limb, case.racket)
    np.testing.assert_allclose(tau, expected, rtol=0, atol=1e-9)
    assert not initial_torques("zero", plant, context, case.limb, case.racket).any()


@settings(max_examples=8, deadline=None)
@given(st.lists(st.floats(-50.0, 50.0), min_size=7, max_size=7))
def test_torques_act_on_their_own_joints(values):
    """M (v'(tau) - v'(0)) has tau at the limb's joints and nothing elsewhere."""
    case, diagram, torques = ACTUATION_CASES[0]
    other, other_diagram, other_torques = ACTUATION_CASES[1]
    results = []
    for c, d, t in ((case, diagram, torques), (other, other_diagram, other_torques)):
        root = d.CreateDefaultContext()
        context = c.plant.GetMyMutableContextFromRoot(root)
        apply_stroke(c.plant, context, c.limb, c.racket, STATE)
        before = c.plant.EvalTimeDerivatives(context).get_generalized_velocity().CopyToVector()
        t.set(root, np.array(values))
        after = c.plant.EvalTimeDerivatives(context).get_generalized_velocity().CopyToVector()
        force = c.plant.CalcMassMatrix(context) @ (after - before)
        expected = np.zeros(c.plant.num_velocities())
        expected[c.limb.velocity_indices()] = values
        np.testing.assert_allclose(force, expected, rtol=0, atol=1e-8)
        results.append(after)
    np.testing.assert_allclose(results[0], results[1], rtol=1e-10, atol=1e-8)


def _actuation_case(**options):
    case = make_case(ARM_7, **options)
    return (case, *built(case))


ACTUATION_CASES = [_actuation_case(), _actuation_case(effort=500.0)]
STATE = solve(CASES[7, "weld"], STROKE)


def test_one_diagram_serves_many_cases():
    case, diagram, torques = ACTUATION_CASES[0]
    first, second = diagram.CreateDefaultContext(), diagram.CreateDefaultContext()
    torques.set(first, np.arange(7.0))
    port = torques.generalized_force_port()
    assert port is not None
    for root, expected in ((first, np.arange(7.0)), (second, np.zeros(7))):
        context = torques.selector.GetMyContextFromRoot(root)
        force = port.Eval(context)[case.limb.velocity_indices()]
        np.testing.assert_array_equal(force, expected)


@pytest.mark.parametrize("effort", [0.0, 1e5])
def test_a_users_system_drives_the_exported_input(effort):
    case = make_case(ARM_7, effort=effort)
    diagram, torques = built(case, export=True)
    assert torques.source is None
    outer = DiagramBuilder()
    outer.AddSystem(diagram)
    source = outer.AddSystem(ConstantVectorSource(np.zeros(7)))
    outer.Connect(source.get_output_port(), diagram.GetInputPort("joint_torques"))
    whole = outer.Build()
    root = whole.CreateDefaultContext()
    context = case.plant.GetMyMutableContextFromRoot(root)
    apply_stroke(case.plant, context, case.limb, case.racket, STATE)
    tau = hold_torques(case.plant, context, case.limb)
    value = source.get_mutable_source_value(source.GetMyMutableContextFromRoot(root))
    value.SetFromVector(tau)
    assert np.abs(accelerations(whole, case, root)).max() < 1e-8
    with pytest.raises(InputError, match="exported"):
        torques.set(root, tau)


def test_bad_torques_are_refused():
    case, diagram, torques = ACTUATION_CASES[0]
    root = diagram.CreateDefaultContext()
    for bad in (np.zeros(6), np.full(7, math.nan), np.zeros((7, 1))):
        with pytest.raises(InputError, match="7 finite numbers"):
            torques.set(root, bad)
    context = case.plant.GetMyContextFromRoot(root)
    with pytest.raises(InputError, match="zero, hold, carry"):
        initial_torques("relax", case.plant, context, case.limb, case.racket)
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    with pytest.raises(InputError, match="not finalized"):
        add_joint_torques(builder, plant, case.limb)


def test_torques_beyond_an_actuators_limit_are_refused():
    """Drake would cut them off without a word."""
    case = make_case(ARM_7, effort=100.0)
    diagram, torques = built(case)
    root = diagram.CreateDefaultContext()
    torques.set(root, np.full(7, -100.0))
    with pytest.raises(InputError, match=r"elbow.*101.*-100 to 100"):
        torques.set(root, np.array([0.0, 0.0, 0.0, 101.0, 0.0, 0.0, 0.0]))


def test_an_actuation_port_in_use_is_refused():
    case = make_case(ARM_7, effort=100.0)
    builder = DiagramBuilder()
    builder.AddSystem(case.plant)
    builder.ExportInput(case.plant.get_actuation_input_port())
    with pytest.raises(InputError, match="connected already"):
        add_joint_torques(builder, case.plant, case.limb)
