"""The Drake engine's arrays against Drake itself, sample by sample."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    PrismaticJoint,
    PrismaticSpring,
    RevoluteJoint,
    RevoluteSpring,
    SpatialInertia,
)
from pydrake.systems.analysis import Simulator

from drake_racket import (
    IntegratorSettings,
    LimbSettings,
    Scenario,
    balance,
    make_impact_diagram,
    resolve,
    run_drake,
    simulate,
)
from drake_racket.engines.drake.leapfrog import brought_to_time
from drake_racket.engines.drake.mechanism import _joint_springs
from drake_racket.laws.contact import CONTACT
from drake_racket.laws.phases import DISCRETE_SIZE, PHASE, SEEN, WEIGHT
from drake_racket.laws.totals import TOTALS
from drake_racket.results import kinematics
from drake_racket.results.energy import Momenta, rigid_motion

CASES = {
    "free": Scenario(point="4", incidence_deg=30.0, after=0.006),
    "clamped": Scenario(support="clamped_handle", after=0.006),
    "hand": Scenario(support="grip", point="7", after=0.006),
    "limb": Scenario(support="limb", point="6", after=0.005, gravity=(0.0, 0.0, -9.81)),
    "torsional": Scenario(support="limb", grip_kind="torsional", limb=LimbSettings(), after=0.005),
    "discrete": Scenario(time_step=2e-5, after=0.004),
}


@pytest.fixture(scope="module", params=CASES)
def ran(request):
    """A case, its Diagram, the trajectory, and numbers of some samples with touch and release."""
    case = resolve(CASES[request.param])
    system = make_impact_diagram(case)
    trajectory = run_drake(case, system)
    phase = trajectory.record[:, PHASE]
    events = np.flatnonzero(np.diff(phase))
    samples = sorted({0, len(trajectory) - 1, len(trajectory) // 3, *events, *(events + 1)})
    return case, system, trajectory, samples


def context_at(system, trajectory, sample, case):
    root = system.create_context(case)
    root.SetTime(float(trajectory.time[sample]))
    context = system.plant.GetMyMutableContextFromRoot(root)
    system.plant.SetPositionsAndVelocities(context, trajectory.state[sample])
    contact = system.impact.contact
    contact.GetMyMutableContextFromRoot(root).SetDiscreteState(trajectory.record[sample])
    return root, context


def test_motion_is_that_of_the_plant(ran):
    case, system, trajectory, samples = ran
    plant, motion = system.plant, trajectory.motion
    assert motion.samples.tolist() == list(range(len(trajectory)))
    massless = trajectory.mechanism.bodies.mass == 0.0
    for sample in samples:
        _, context = context_at(system, trajectory, sample, case)
        poses = plant.get_body_poses_output_port().Eval(context)
        speeds = plant.get_body_spatial_velocities_output_port().Eval(context)
        for i in np.flatnonzero(~massless):
            np.testing.assert_allclose(
                motion.poses[sample, i], poses[i].GetAsMatrix34(), rtol=0, atol=1e-14
            )
            np.testing.assert_allclose(
                motion.velocities[sample, i], speeds[i].get_coeffs(), rtol=1e-12, atol=1e-12
            )


def test_accelerations_are_those_after_the_events(ran):
    case, system, trajectory, samples = ran
    found = trajectory.motion.sensor_acceleration
    if case.scenario.time_step > 0.0:
        assert np.isnan(found).all()
        return
    for sample in samples:
        _, context = context_at(system, trajectory, sample, case)
        expected = system.impact.racket.handle.EvalSpatialAccelerationInWorld(context).get_coeffs()
        scale = np.max(np.abs(expected)) + 1.0
        np.testing.assert_allclose(found[sample], expected, rtol=0, atol=1e-9 * scale)


def test_frames_move_as_the_plants_do(ran):
    case, system, trajectory, samples = ran
    racket, motion, places = system.impact.racket, trajectory.motion, trajectory.mechanism.places
    felt = kinematics.sensor_accelerations(motion, places["accelerometer"])
    for sample in samples:
        _, context = context_at(system, trajectory, sample, case)
        for name in ("butt", "gsc", "tip"):
            frame = racket.frame(name)
            place = kinematics.positions(motion, places[name])[sample]
            speed = kinematics.velocities(motion, places[name])[sample]
            moving = frame.CalcSpatialVelocityInWorld(context).translational()
            pose = frame.CalcPoseInWorld(context)
            np.testing.assert_allclose(place, pose.translation(), rtol=0, atol=1e-13)
            np.testing.assert_allclose(speed, moving, rtol=1e-12, atol=1e-12)
        if case.scenario.time_step == 0.0:
            frame = racket.frame("accelerometer")
            in_world = frame.CalcSpatialAccelerationInWorld(context).translational()
            turned = racket.handle.EvalPoseInWorld(context).rotation().matrix().T @ in_world
            scale = np.max(np.abs(turned)) + 1.0
            np.testing.assert_allclose(felt[sample], turned, rtol=0, atol=1e-9 * scale)


def test_contact_and_hand_are_those_of_the_ports(ran):
    case, system, trajectory, samples = ran
    if case.scenario.time_step > 0.0:
        return  # its outputs look forward to the update of the instant
    for sample in samples:
        root, _ = context_at(system, trajectory, sample, case)
        contact = system.impact.contact
        expected = contact.GetOutputPort("contact_state").Eval(contact.GetMyContextFromRoot(root))
        np.testing.assert_array_equal(trajectory.contact[sample], expected)
        if system.grip_load is not None:
            load = system.grip_load
            port = load.GetOutputPort("hand_load").Eval(load.GetMyContextFromRoot(root))
            scale = np.max(np.abs(port)) + 1.0
            np.testing.assert_allclose(
                trajectory.motion.hand_load[sample], port, rtol=0, atol=1e-9 * scale
            )


def test_momentum_and_rigid_motion_are_drakes(ran):
    case, system, trajectory, samples = ran
    plant, racket = system.plant, system.impact.racket
    moving = Momenta.of(trajectory.mechanism, trajectory.motion)
    bodies = list(trajectory.mechanism.racket)
    rigid = rigid_motion(moving, bodies)
    for sample in samples:
        _, context = context_at(system, trajectory, sample, case)
        expected = plant.CalcSpatialMomentumInWorldAboutPoint(
            context, [racket.model_instance], np.zeros(3)
        )
        linear, angular = (
            np.sum(x[sample, bodies], axis=0) for x in (moving.linear, moving.angular)
        )
        np.testing.assert_allclose(linear, expected.translational(), rtol=0, atol=1e-12)
        np.testing.assert_allclose(angular, expected.rotational(), rtol=0, atol=1e-12)
        com = plant.CalcCenterOfMassPositionInWorld(context, [racket.model_instance])
        np.testing.assert_allclose(moving.centre_of_mass(bodies)[sample], com, rtol=0, atol=1e-14)
        inertia = plant.CalcSpatialInertia(
            context, plant.world_frame(), plant.GetBodyIndices(racket.model_instance)
        )
        about = inertia.Shift(com).CalcRotationalInertia().CopyToFullMatrix3()
        spin = plant.CalcSpatialMomentumInWorldAboutPoint(context, [racket.model_instance], com)
        w = np.linalg.solve(about, spin.rotational())
        mass = sum(body.default_mass() for body in racket.bodies())
        energy = 0.5 * (linear @ linear / mass + spin.rotational() @ w)
        assert rigid.kinetic_energy[sample] == pytest.approx(energy, rel=1e-9, abs=1e-12)
        np.testing.assert_allclose(rigid.angular_velocity[sample], w, rtol=1e-9, atol=1e-9)


def test_kinetic_energy_is_drakes(ran):
    case, system, trajectory, samples = ran
    moving = Momenta.of(trajectory.mechanism, trajectory.motion)
    everything = moving.kinetic_energy(range(len(trajectory.mechanism.bodies)))
    for sample in samples:
        _, context = context_at(system, trajectory, sample, case)
        expected = system.plant.EvalKineticEnergy(context)  # rotors included: there are none
        assert everything[sample] == pytest.approx(expected, rel=1e-12)


def test_the_ends_alone_are_those_of_the_whole_run(ran):
    case, system, trajectory, _ = ran
    if case.scenario.support not in ("free", "limb"):
        return  # each run costs a second, and these two have it all
    ends = run_drake(case, system, every_sample=False)
    assert ends.motion.samples.tolist() == [0, len(trajectory) - 1]
    for name in ("time", "state", "record", "totals"):
        np.testing.assert_array_equal(getattr(ends, name), getattr(trajectory, name))
    apart = np.isnan(ends.contact)
    assert not apart[trajectory.record[:, PHASE] == CONTACT].any()
    assert not apart[:, [0, 4, 5, 6]].any()  # the phase and the forces
    assert apart[1, 2] == (case.scenario.time_step == 0.0)  # a gap that nobody asked for
    np.testing.assert_array_equal(ends.contact, np.where(apart, np.nan, trajectory.contact))
    for name in ("poses", "velocities"):
        whole = getattr(trajectory.motion, name)
        np.testing.assert_allclose(
            getattr(ends.motion, name), whole[[0, -1]], rtol=1e-13, atol=1e-13
        )


def test_a_history_changes_nothing_else():
    scenario = Scenario(point="4", incidence_deg=20.0, after=0.006)
    with_history, without = simulate(scenario), simulate(scenario, history=False)
    one, other = with_history.to_json(), without.to_json()
    later = ("energy_error", "momentum_error", "angular_momentum_error", "peak_handle_acceleration")
    for name in set(one) - set(later) - {"balance"}:
        assert one[name] == other[name], name
    for name, value in one["balance"].items():
        assert other["balance"][name] == pytest.approx(value, rel=1e-12, abs=1e-15)


def test_touch_and_release_are_samples():
    trajectory = run_drake(*[(c := resolve(CASES["free"])), make_impact_diagram(c)])
    phase = trajectory.record[:, PHASE]
    inside = np.flatnonzero(phase == CONTACT)
    record = trajectory.record[-1]
    assert trajectory.time[inside[0]] == pytest.approx(0.001, abs=1e-9)
    assert trajectory.contact[inside[0], 4] > 100.0  # cb v: the force jumps
    assert dataclasses.replace(trajectory, steps=1).steps == 1
    assert record[PHASE] != CONTACT


def test_a_leapfrog_brought_to_time_is_of_second_order():
    """An oscillator of 1 rad/s: energies of q and v as they stand are off by h/2 of their power."""

    def open_by(h):
        q, v = [0.8], [0.6 + 0.5 * h * 0.8]
        for _ in range(round(2.0 / h)):
            v.append(v[-1] - h * q[-1])
            q.append(q[-1] + h * v[-1])
        # a sample between two steps has the state of the second, and no contact
        q, v = (np.array([x[0], *x])[:, None] for x in (q, v))
        record, totals = np.zeros((len(q), DISCRETE_SIZE)), np.zeros((len(q), TOTALS))
        there, _ = brought_to_time(q, v, record, totals, given=False)
        assert there.shape == (len(q) - 1, 1)
        assert there[0] == there[1]
        energy = 0.5 * (there**2 + q[:-1] ** 2)
        return np.max(np.abs(energy - 0.5))

    assert open_by(1e-2) < 2e-5
    assert open_by(2e-2) == pytest.approx(4.0 * open_by(1e-2), rel=0.05)


def test_what_a_discrete_step_loses_is_there_half_of_it_in():
    record, totals = np.zeros((4, DISCRETE_SIZE)), np.zeros((4, TOTALS))
    record[:, SEEN] = 0.0
    record[1:, PHASE], record[1:, WEIGHT] = CONTACT, [1.25, 1.0, 1.0]
    totals[:, 0] = totals[:, 3] = totals[:, 6] = [0.0, 10.0, 30.0, 60.0]
    q = np.arange(4.0)[:, None]
    v, lost = brought_to_time(q, 2.0 * q, record, totals, given=False)
    np.testing.assert_allclose(lost[:, 0], [6.0, 20.0, 45.0])  # (1.25 - 0.5) / 1.25 of the first
    np.testing.assert_allclose(lost[:, 3], lost[:, 0])
    np.testing.assert_allclose(lost[:, 6], [0.0, 10.0, 30.0])  # a damper's own: the midpoint rule
    np.testing.assert_allclose(v[:, 0], [1.2, 3.0, 5.0])
    v, _ = brought_to_time(q, 2.0 * q, record, totals)
    np.testing.assert_allclose(v[:, 0], [0.0, 3.0, 5.0])


def test_a_sample_between_two_steps_is_that_of_the_step():
    record, totals = np.zeros((4, DISCRETE_SIZE)), np.zeros((4, TOTALS))
    record[:, SEEN] = 0.0
    q = np.arange(4.0)[:, None]
    totals[:, 0] = [0.0, 10.0, 30.0, 60.0]
    v, lost = brought_to_time(q, 2.0 * q, record, totals, given=False)
    twice = np.array([0, 1, 1, 2, 3])
    there, more = brought_to_time(
        q[twice], 2.0 * q[twice], record[twice], totals[twice], given=False
    )
    np.testing.assert_allclose(there, v[twice[:-1]])
    np.testing.assert_allclose(more, lost[twice[:-1]])


@pytest.mark.parametrize(("when", "closes"), [(3e-3, 3e-4), (3.01e-3, 3e-3)])
def test_the_balance_of_ones_own_discrete_run(when, closes):
    """In contact, at a step of the plant and between two."""
    case = resolve(Scenario(support="clamped_head", time_step=2e-5))
    system = make_impact_diagram(case)
    simulator = Simulator(system.diagram, system.create_context(case))
    root = simulator.get_mutable_context()
    before = balance(system.impact, system.meter, root, held=True)
    simulator.AdvanceTo(when)
    after = balance(system.impact, system.meter, root, held=True)
    assert after.contact > 1.0
    assert after.total() == pytest.approx(before.total(), rel=closes)
    contact = system.impact.contact
    own = contact.GetMyContextFromRoot(root)
    record = own.get_discrete_state_vector().CopyToVector()
    ahead = not np.array_equal(contact.latched(own), record, equal_nan=True)
    assert ahead == (when == 3e-3)  # outputs look forward where an update is due, and only there


def test_springs_and_rotors_are_those_of_the_limbs_joints():
    """Turning and sliding ones; another model's in the same plant are not its."""
    plant = MultibodyPlant(0.0)
    joints = []
    for i, kind in enumerate((RevoluteJoint, PrismaticJoint, RevoluteJoint)):
        inertia = SpatialInertia.SolidSphereWithMass(1.0, 0.1)
        body = plant.AddRigidBody(f"b{i}", inertia)
        joint = kind(f"j{i}", plant.world_frame(), body.body_frame(), np.array([0.0, 0.0, 1.0]))
        joints.append(plant.AddJoint(joint))
        rotor = plant.AddJointActuator(f"a{i}", joints[-1])
        rotor.set_default_rotor_inertia(0.01 * (i + 1))
        rotor.set_default_gear_ratio(10.0)
    plant.AddForceElement(RevoluteSpring(joints[0], 0.1, 30.0))
    plant.AddForceElement(PrismaticSpring(joints[1], 0.2, 40.0))
    plant.AddForceElement(RevoluteSpring(joints[2], 0.3, 50.0))
    plant.Finalize()
    limb = SimpleNamespace(joints=(joints[0],), others=lambda: (joints[1],))
    found = _joint_springs(limb, plant, plant.CreateDefaultContext())
    assert found.position.tolist() == [joint.position_start() for joint in joints[:2]]
    assert found.stiffness.tolist() == [30.0, 40.0]
    assert found.nominal.tolist() == [0.1, 0.2]
    assert found.rotor_velocity.tolist() == [joint.velocity_start() for joint in joints[:2]]
    assert found.rotor_inertia == pytest.approx([1.0, 2.0])


def test_progress_is_told_from_the_start_on_every_hundred_steps():
    told = []
    steps = IntegratorSettings(maximum_step=1e-6, error_control=False)
    base = Scenario(
        support="clamped_head", approach_time=0.0, after=2.5e-4, audit=False, integrator=steps
    )
    case = resolve(base)
    run_drake(case, make_impact_diagram(case), progress=told.append)
    assert [now.done for now in told] == pytest.approx([0.0, 0.1, 0.2], abs=1e-6)
    assert {now.total for now in told} == {0.25}
