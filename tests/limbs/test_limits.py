"""Joint limits: the law, its energy, its derivatives, and one joint's rebound in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.autodiffutils import ExtractGradient, InitializeAutoDiff
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BallRpyJoint, RevoluteJoint, SpatialInertia, UnitInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import Integrator
from scipy.optimize import brentq

from drake_racket.engines.drake.engine import configure_integrator
from drake_racket.io.errors import InputError
from drake_racket.laws.limits import limit_energies, limit_losses, limit_torques
from drake_racket.limbs.limb import Limb
from drake_racket.limbs.limits import add_joint_limits, limit_law
from drake_racket.limbs.upper_limb import add_upper_limb
from drake_racket.parameters.limb import JOINTS, load_upper_limb
from drake_racket.parameters.scenario import IntegratorSettings
from drake_racket.plant.compose import connect_forces
from studies.upper_limb.posture import set_posture

LOWER, UPPER, K, D = -0.5, 0.8, 120.0, 0.4
INERTIA = 0.09  # kg m^2, of the one-joint limb


def one_joint(step=0.0, *, limits=(LOWER, UPPER), joint=None):
    """A body of a given inertia on one joint about z, as an imported limb would be."""
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(step))
    body = plant.AddRigidBody("bar", SpatialInertia(1.0, [0, 0, 0], UnitInertia(1, 1, INERTIA)))
    if joint is None:
        joint = RevoluteJoint("hinge", plant.world_frame(), body.body_frame(), [0, 0, 1], *limits)
    else:
        joint = joint("ball", plant.world_frame(), body.body_frame())
    joint = plant.AddJoint(joint)
    limb = Limb(plant, (body.model_instance(),), body.body_frame(), (joint,))
    plant.Finalize()
    return builder, plant, limb


def rebound(v0, damping):
    """Peak angle beyond the limit and speed of return: v dv/ds = -(K/I) s (1 + D v).

    Its first integral: G(v) + K s^2 / (2 I) is constant, with dG/dv = v / (1 + D v).
    """
    if damping == 0.0:
        return v0 * np.sqrt(INERTIA / K), v0

    def potential(v):
        return v / damping - np.log1p(damping * v) / damping**2

    peak = np.sqrt(2 * INERTIA / K * potential(v0))
    back = brentq(lambda v: potential(-v) - potential(v0), 1e-9, 1 / damping - 1e-9)
    return peak, back


@pytest.mark.parametrize("damping", [0.0, D])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_joint_returns_from_its_limit_as_the_closed_form_says(damping, sign):
    builder, plant, limb = one_joint()
    system = add_joint_limits(builder, plant, limb, stiffness=K, damping=damping)
    connect_forces(builder, plant, [], generalized=[system.GetOutputPort("generalized_force")])
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    state = plant.GetMyMutableContextFromRoot(context)
    joint, end = limb.joints[0], UPPER if sign > 0 else LOWER
    v0 = 3.0
    joint.set_angle(state, end)
    joint.set_angular_rate(state, sign * v0)
    configure_integrator(simulator, IntegratorSettings(accuracy=1e-9, maximum_step=1e-3))
    simulator.Initialize()
    most = 0.0
    for t in np.arange(1e-3, 0.2, 1e-3):
        simulator.AdvanceTo(t)
        beyond = sign * (joint.get_angle(state) - end)
        most = max(most, beyond)
        if beyond < 0:
            break
    peak, back = rebound(v0, damping)
    assert most == pytest.approx(peak, rel=1e-3)  # it is sampled each ms
    assert -sign * joint.get_angular_rate(state) == pytest.approx(back, rel=1e-6)
    assert (back < 0.7 * v0) == (damping > 0)


numbers = {
    "q": st.floats(-2.0, 2.0),
    "v": st.floats(-20.0, 20.0),
    "k": st.floats(0.0, 500.0),
    "d": st.floats(0.0, 2.0),
}


@settings(max_examples=200, deadline=None)
@given(**numbers)
def test_law_resists_and_loses(q, v, k, d):
    args = [np.array([x]) for x in (q, v, LOWER, UPPER, k, d)]
    (torque,) = limit_torques(*args)
    (energy,) = limit_energies(args[0], *args[2:5])
    (loss,) = limit_losses(*args)
    if LOWER <= q <= UPPER:
        assert torque == energy == loss == 0.0
        return
    end = UPPER if q > UPPER else LOWER
    assert torque * (q - end) <= 0.0  # towards the range, whatever the speed
    assert energy == pytest.approx(0.5 * k * (q - end) ** 2)
    assert loss >= -1e-9
    # what goes in is stored or lost: -torque v = k (q - end) v + loss
    assert -torque * v == pytest.approx(k * (q - end) * v + loss, abs=1e-9)
    if v * (q - end) > 0:  # going further out: the printed law
        assert torque == pytest.approx(-k * (q - end) * (1 + d * abs(v)))


@pytest.mark.parametrize("v", [-5.0, 0.0, 5.0])
@pytest.mark.parametrize("end", [LOWER, UPPER])
def test_torque_is_continuous_at_the_ends(end, v):
    def torque(q):
        return limit_torques(*(np.array([x]) for x in (q, v, LOWER, UPPER, K, D)))[0]

    for small in (1e-3, 1e-6, 1e-9):
        jump = torque(end + small) - torque(end - small)
        assert abs(jump) <= 1.01 * K * (1 + D * abs(v)) * small


@pytest.fixture(scope="module")
def arm():
    """One upper limb with its limits, and a meter of what they lose."""
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    limb = add_upper_limb(plant)
    plant.Finalize()
    system = add_joint_limits(builder, plant, limb)
    connect_forces(builder, plant, [], generalized=[system.GetOutputPort("generalized_force")])
    meter = builder.AddSystem(Integrator(1))
    builder.Connect(system.GetOutputPort("power"), meter.get_input_port())
    return builder.Build(), plant, limb, system, meter


def test_shipped_numbers_by_joint(arm):
    _, _, _, system, _ = arm
    shipped = load_upper_limb()
    law = system.law
    np.testing.assert_array_equal(np.column_stack([law.lower, law.upper]), shipped.ranges())
    stiffness = [shipped.joint(name).limit_stiffness.value for name in JOINTS]
    np.testing.assert_array_equal(law.stiffness, stiffness)
    np.testing.assert_array_equal(law.damping, [shipped.limit_damping.value] * 7)


def test_energy_closes_in_a_run_into_the_limits(arm):
    """A hanging arm thrown into four of its limits: kinetic, potential, stored and lost."""
    diagram, plant, limb, system, meter = arm
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    state = plant.GetMyMutableContextFromRoot(context)
    set_posture(limb, state, np.array([0.3, 0.2, 0.5, 1.2, 0.8, 0.5, 0.1]))
    v = np.array([0.5, -0.5, 4.0, -6.0, 8.0, 9.0, 6.0])
    plant.SetVelocities(state, v)
    configure_integrator(simulator, IntegratorSettings(accuracy=1e-8, maximum_step=1e-3))
    simulator.Initialize()

    def energies():
        return np.array(
            [
                plant.CalcKineticEnergy(state),
                plant.CalcPotentialEnergy(state),
                system.GetOutputPort("energy").Eval(system.GetMyContextFromRoot(context))[0],
                meter.get_output_port().Eval(meter.GetMyContextFromRoot(context))[0],
            ]
        )

    start = energies()
    history, beyond = [start], np.zeros(7)
    for t in np.arange(0.01, 0.4, 0.01):
        simulator.AdvanceTo(t)
        history.append(energies())
        q = plant.GetPositions(state)
        beyond = np.maximum(beyond, np.maximum(system.law.lower - q, q - system.law.upper))
    history = np.array(history)
    assert np.count_nonzero(beyond > 0.01) >= 4
    assert np.max(history[:, 2]) > 0.05 * start[0]
    assert history[-1, 3] > 0.1 * start[0]
    np.testing.assert_allclose(history.sum(axis=1), start.sum(), atol=1e-6 * start[0])


def test_autodiff_of_the_torque_is_the_stiffness_and_damping(arm):
    _, _, _, system, _ = arm
    converted = system.ToAutoDiffXd()
    context = converted.CreateDefaultContext()
    law = system.law
    above = np.array([1, 0, 1, 0, 1, 0, 1], dtype=bool)
    s = 0.05 + 0.01 * np.arange(7)
    q = np.where(above, law.upper + s, law.lower - s)
    v = np.array([1.0, -2.0, -0.5, 0.3, 0.0, 1.5, 3.0])
    q[5] = 0.1  # one inside its range
    converted.GetInputPort("state").FixValue(context, InitializeAutoDiff(np.r_[q, v]).ravel())
    force = converted.GetOutputPort("generalized_force").Eval(context)
    gradient = ExtractGradient(force)
    out = np.where(above, v, -v)  # speed out of the range
    k, d = law.stiffness * (np.arange(7) != 5), law.damping
    np.testing.assert_allclose(gradient[:, :7], np.diag(-k * (1 + d * out)), atol=1e-10)
    np.testing.assert_allclose(gradient[:, 7:], np.diag(-k * s * d), atol=1e-10)


def test_ranges_are_parameters_of_the_context(arm):
    diagram, plant, limb, system, _ = arm
    root = diagram.CreateDefaultContext()
    set_posture(limb, plant.GetMyMutableContextFromRoot(root), np.full(7, 0.2))
    context = system.GetMyMutableContextFromRoot(root)
    port = system.GetOutputPort("generalized_force")
    assert not port.Eval(context).any()
    upper = context.get_mutable_numeric_parameter(system.UPPER)
    upper.SetFromVector(np.full(7, 0.1))
    np.testing.assert_allclose(port.Eval(context), -0.1 * system.law.stiffness)


def test_two_limbs_in_one_plant_reach_their_own_joints():
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    limbs = [add_upper_limb(plant, side=side, name=side) for side in ("right", "left")]
    plant.Finalize()
    systems = [add_joint_limits(builder, plant, b, name=f"limits_{i}") for i, b in enumerate(limbs)]
    ports = [system.GetOutputPort("generalized_force") for system in systems]
    connect_forces(builder, plant, [], generalized=ports)
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    state = plant.GetMyMutableContextFromRoot(root)
    set_posture(limbs[1], state, np.array([0, 0, 0, -0.1, 0, 0, 0.0]))
    force = plant.get_applied_generalized_force_input_port().Eval(state)
    expected = np.zeros(14)
    expected[limbs[1].velocity_indices()[3]] = 200.0 * 0.1
    np.testing.assert_allclose(force, expected, atol=1e-12)


def test_a_discrete_plant_holds_its_limits_itself():
    builder, plant, limb = one_joint(1e-3)
    with pytest.raises(InputError, match="continuous plant"):
        add_joint_limits(builder, plant, limb, stiffness=K, damping=D)
    simulator = Simulator(builder.Build())
    state = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    limb.joints[0].set_angular_rate(state, 5.0)
    simulator.AdvanceTo(0.5)
    assert limb.joints[0].get_angle(state) < UPPER + 0.05  # 2.5 rad without them


def test_bad_input_is_named():
    builder, plant, limb = one_joint()
    for options, text in (
        ({}, "joint hinge: got 'no stiffness and damping'"),
        ({"stiffness": K}, "joint hinge"),
        ({"stiffness": [K, K], "damping": D}, "stiffness: .*one number, or 1"),
        ({"stiffness": -1.0, "damping": D}, "stiffness: got -1.0"),
        ({"stiffness": K, "damping": float("nan")}, "damping: got nan"),
    ):
        with pytest.raises(InputError, match=text):
            add_joint_limits(builder, plant, limb, **options)
    with pytest.raises(InputError, match="not in the builder"):
        add_joint_limits(DiagramBuilder(), plant, limb, stiffness=K, damping=D)
    free = one_joint(limits=(-np.inf, np.inf))
    with pytest.raises(InputError, match="limb: got 'no limits'"):
        add_joint_limits(*free, stiffness=K, damping=D)
    ball = one_joint(joint=BallRpyJoint)
    with pytest.raises(InputError, match="joint ball: got '3 degrees of freedom'"):
        add_joint_limits(*ball, stiffness=K, damping=D)
    unfinished = MultibodyPlant(0.0)
    with pytest.raises(InputError, match="not finalized"):
        add_joint_limits(DiagramBuilder(), unfinished, add_upper_limb(unfinished))


def test_one_sided_range():
    _, _, limb = one_joint(limits=(-np.inf, UPPER))
    law = limit_law(limb, stiffness=K, damping=D)
    args = [law.lower, law.upper, law.stiffness, law.damping]
    torque = limit_torques(np.array([-9.0]), np.array([1.0]), *args)
    assert torque == 0.0
    assert limit_torques(np.array([UPPER + 0.1]), np.array([0.0]), *args) == pytest.approx(-0.1 * K)
