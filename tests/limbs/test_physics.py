"""A racket in a limb: limits that are known exactly, balances, mirror images, derivatives."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from pydrake.autodiffutils import AutoDiffXd
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.math import SpatialForce, SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import Integrator

import drake_racket as dr
from drake_racket.limbs.limits import add_joint_limits
from drake_racket.limbs.stroke import Stroke, apply_stroke, solve_stroke
from drake_racket.limbs.torques import add_joint_torques, initial_torques
from drake_racket.limbs.upper_limb import add_upper_limb
from drake_racket.parameters.grip import GRIP_KINDS, load_grip
from drake_racket.parameters.limb_settings import LimbSettings
from drake_racket.plant.grip import add_grip
from drake_racket.plant.systems.grip_load import set_grip_load_parameters

GRIP_OF = {"hand": "hand_medium"}  # the kinds that the default grip is not for
GUESS = {"shoulder_flexion": 50.0, "shoulder_abduction": 30.0, "elbow_flexion": 20.0}
POSTURE = Stroke(
    position=[0.45, 0.55, 1.0],
    face_closed_deg=5.0,
    face_azimuth_deg=0.0,
    tip_elevation_deg=0.0,
    tip_side="left",
    guess_deg=GUESS,
)
SWING = dataclasses.replace(
    POSTURE, speed=15.0, velocity_elevation_deg=20.0, angular_velocity=[0.0, 0.0, -15.0]
)
STILL_LIMB = LimbSettings(grip_rotation_deg=90.0, trunk_azimuth_deg=70.0, stroke=POSTURE)
SWINGING_LIMB = dataclasses.replace(STILL_LIMB, stroke=SWING)
STILL = dr.Scenario(support="limb", limb=STILL_LIMB, point=1, after=0.006, audit=False)
STROKE = dr.Scenario(
    support="limb", limb=SWINGING_LIMB, speed=15.0, after=0.006, gravity=[0.0, 0.0, -9.81]
)
EXACT_TOUCH = 1e-12
"""Context accuracy that isolates touch far below round-off's effect: for runs that must be equal,
which need equal steps too."""
FIXED = dr.IntegratorSettings(error_control=False, maximum_step=2.5e-5)
TIGHT = dr.IntegratorSettings(accuracy=2e-6, maximum_step=5e-5)


def advance(system: dr.ImpactDiagram, scenario: dr.Scenario, root, *, exact: bool = False):
    """Runs a Context to the end of the scenario, and returns it."""
    simulator = Simulator(system.diagram, root)
    discrete = scenario.time_step > 0.0
    dr.configure_integrator(simulator, scenario.integrator, discrete=discrete)
    if exact:
        simulator.get_mutable_context().SetAccuracy(EXACT_TOUCH)
    simulator.AdvanceTo(scenario.approach_time + scenario.after)
    return simulator.get_mutable_context()


def racket_motion(racket: dr.Racket, context) -> np.ndarray:
    """Rates of the throat joints and the nine strings (11,)."""
    joints = (racket.in_plane, racket.out_of_plane, *racket.string_joints)
    v = racket.plant.GetVelocities(context)
    return np.array([v[joint.velocity_start()] for joint in joints])


SLOW = pytest.mark.slow
KINDS = [pytest.param(kind, marks=SLOW if kind != "compliant" else []) for kind in GRIP_KINDS]
"""One kind by default, the others with -m slow."""


# --- a limb that cannot move is a clamp ---


@pytest.mark.parametrize("point", [1, 6])
def test_locked_limb_is_a_clamped_handle(point):
    """Drake locks joints on discrete plants: then nothing of the limb is left but its posture."""
    limb = dataclasses.replace(STROKE.limb, joint_torques="zero", stroke=POSTURE)
    held = dataclasses.replace(
        STILL, limb=limb, grip_kind="weld", point=point, incidence_deg=20.0, time_step=2e-5
    )
    clamped = dataclasses.replace(held, support="clamped_handle")
    ends = []
    for scenario in (held, clamped):
        system = dr.make_impact_diagram(scenario)
        root = system.create_context()
        context = system.plant.GetMyMutableContextFromRoot(root)
        if system.limb is not None:
            for joint in system.limb.limb.joints:
                joint.Lock(context)
        R_RW = system.impact.racket.handle.EvalPoseInWorld(context).rotation().inverse()
        context = system.plant.GetMyContextFromRoot(advance(system, scenario, root))
        ball = system.impact.ball.body.EvalSpatialVelocityInWorld(context).translational()
        ends.append(np.append(racket_motion(system.impact.racket, context), R_RW @ ball))
    assert np.abs(ends[1]).max() > 1.0
    assert ends[0] == pytest.approx(ends[1], abs=1e-8)


@pytest.mark.parametrize("rpy", [(0.3, -1.1, 2.0), (-2.5, 0.7, -0.4)])
def test_weld_to_a_hand_frame_anywhere_is_a_clamped_handle(rpy):
    """The composition by hand, on a frame that is turned and away from the origin."""
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
    X_WH = RigidTransform(RollPitchYaw(rpy), [0.4, -1.2, 0.9])
    hand = plant.AddFrame(FixedOffsetFrame("hand", plant.world_frame(), X_WH))
    racket = dr.add_racket(plant, dr.load_racket(), parent=hand)
    ball = dr.add_ball(plant, dr.load_ball())
    plant.Finalize()
    impact = dr.add_impact(builder, plant, racket, ball, point=7)
    diagram = builder.Build()
    clamped = dr.Scenario(support="clamped_handle", point=7, incidence_deg=30.0, after=0.006)
    system = dr.make_impact_diagram(dataclasses.replace(clamped, audit=False))
    ends = []
    for where, root, impact_ in (
        (diagram, diagram.CreateDefaultContext(), impact),
        (system.diagram, system.create_context(), system.impact),
    ):
        there = impact_.racket.plant
        context = there.GetMyMutableContextFromRoot(root)
        X_WR = impact_.racket.handle.EvalPoseInWorld(context)
        body, v_R = impact_.ball.body, clamped.ball_velocity()
        at = clamped.aim(racket.parameters) - clamped.approach_time * v_R
        there.SetFreeBodyPose(context, body, RigidTransform(X_WR @ at))
        velocity = SpatialVelocity(np.zeros(3), X_WR.rotation() @ v_R)
        there.SetFreeBodySpatialVelocity(context, body, velocity)
        simulator = Simulator(where, root)
        dr.configure_integrator(simulator, FIXED)
        simulator.get_mutable_context().SetAccuracy(EXACT_TOUCH)
        simulator.AdvanceTo(0.007)
        context = there.GetMyContextFromRoot(simulator.get_context())
        rebound = body.EvalSpatialVelocityInWorld(context).translational()
        motion = racket_motion(impact_.racket, context)
        ends.append(np.append(motion, X_WR.rotation().inverse() @ rebound))
    assert ends[0] == pytest.approx(ends[1], abs=1e-8)


# --- between free and rigid ---


def test_grip_goes_from_free_to_welded():
    """Hit at a corner: how far the grip turns in the hand falls with stiffness, to the weld's 0."""
    system = dr.make_impact_diagram(STILL)
    rebound, turned = {}, []

    def run(key, system, scenario, root):
        handle, ball = system.impact.racket.handle, system.impact.ball.body
        context = system.plant.GetMyContextFromRoot(root)
        R_RW = handle.EvalPoseInWorld(context).rotation().inverse()
        context = system.plant.GetMyContextFromRoot(advance(system, scenario, root))
        rebound[key] = R_RW @ ball.EvalSpatialVelocityInWorld(context).translational()
        return context

    grip = load_grip("normal")
    for factor in (0.0, 1e-2, 1.0, 30.0, 1000.0):
        root = system.create_context()
        system.grip.set_stiffness(root, grip.scaled(factor))
        set_grip_load_parameters(system.grip_load, system.grip, root)
        context = run(factor, system, STILL, root)
        X_HG = system.grip.racket_frame.CalcPose(context, system.grip.hand_frame)
        turned.append(X_HG.rotation().ToAngleAxis().angle())
    for key in ("weld", "free"):
        changes = {"grip_kind": "weld"} if key == "weld" else {"support": "free"}
        scenario = dataclasses.replace(STILL, **changes)
        other = dr.make_impact_diagram(scenario)
        run(key, other, scenario, other.create_context())
    assert np.all(np.diff(turned) < 0.0)
    assert turned[0] > 0.3 > 0.001 > turned[-1]
    # no grip at all is the free racket, exactly
    assert rebound[0.0] == pytest.approx(rebound["free"], abs=1e-8)

    def gap(a, b):
        return abs(rebound[a][2] - rebound[b][2])

    to_weld = [gap(f, "weld") for f in (0.0, 1.0, 30.0, 1000.0)]
    to_free = [gap(f, "free") for f in (1e-2, 1.0, 30.0)]
    assert np.all(np.diff(to_weld) < 0.0)
    assert np.all(np.diff(to_free) > 0.0)
    assert to_weld[-1] < 0.005 * to_weld[0]
    assert to_free[0] < 0.005 * to_weld[0]


# --- energy ---

AT_LIMITS = Stroke(
    speed=15.0,
    guess_deg={
        "shoulder_flexion": 40.0,
        "elbow_flexion": 0.0,
        "wrist_flexion": -70.0,
        "wrist_deviation": -30.0,
        "forearm_pronation": 80.0,
    },
)


def limited(kind: str, **changes) -> dr.Scenario:
    limb = dataclasses.replace(SWINGING_LIMB, stroke=AT_LIMITS, joint_torques="carry")
    return dataclasses.replace(
        STROKE,
        limb=limb,
        grip_kind=kind,
        grip=GRIP_OF.get(kind, "normal"),
        point=3,
        incidence_deg=20.0,
        approach_time=2e-4,
        after=0.005,
        **changes,
    )


@pytest.mark.parametrize("kind", KINDS)
def test_energy_closes_with_limits_torques_and_gravity(kind):
    system = dr.make_impact_diagram(limited(kind))
    usual = dr.simulate(limited(kind), system, history=False)
    assert usual.touches == 1
    assert usual.energy_error < 1e-4
    tight = dr.simulate(limited(kind, integrator=TIGHT), system, history=False)
    assert tight.energy_error < 1e-6
    # all of it took part
    end = tight.balance
    total = end.ball + end.rigid_motion
    assert end.lost_limb > 1e-3 * total
    assert abs(end.torque_work) > 1e-3 * total
    assert (abs(end.grip) > 1e-5 * total) == (kind != "weld")
    assert end.lost_friction > 1e-4 * total


# --- momentum: limb, racket and ball against the shoulder's reaction and gravity ---


class OutsideWrench(LeafSystem):
    """About the shoulder, in the world: its reaction on the limb, and gravity; torque and force."""

    def __init__(self, plant: MultibodyPlant, weld) -> None:
        LeafSystem.__init__(self)
        self.plant, self.weld = plant, weld
        self.place = [int(i) for i in plant.GetJointIndices()].index(int(weld.index()))
        self.scratch = plant.CreateDefaultContext()
        self.DeclareVectorInputPort("state", plant.num_multibody_states())
        self.DeclareAbstractInputPort("reactions", AbstractValue.Make([SpatialForce()]))
        self.DeclareVectorOutputPort("wrench", 6, self.calc)

    def DoCalcTimeDerivatives(self, context, derivatives) -> None: ...

    def calc(self, context, output) -> None:
        plant = self.plant
        plant.SetPositionsAndVelocities(self.scratch, self.get_input_port(0).Eval(context))
        X_WC = self.weld.frame_on_child().CalcPoseInWorld(self.scratch)
        reaction = self.get_input_port(1).Eval(context)[self.place]
        weight = plant.CalcTotalMass(self.scratch) * plant.gravity_field().gravity_vector()
        arm = plant.CalcCenterOfMassPositionInWorld(self.scratch) - X_WC.translation()
        R = X_WC.rotation().matrix()
        output.SetFromVector(
            np.append(
                R @ reaction.rotational() + np.cross(arm, weight),
                R @ reaction.translational() + weight,
            )
        )


@pytest.mark.parametrize("kind", KINDS)
def test_momentum_is_the_impulse_of_the_shoulder_and_gravity(kind):
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    X_WS = RigidTransform(RollPitchYaw(0.1, -0.2, 1.2), [0.0, 0.0, 1.4])
    limb = add_upper_limb(plant, X_PF=X_WS, grip_rotation=math.pi / 2.0)
    racket = dr.add_racket(plant, dr.load_racket("recreational"))
    grip = load_grip("hand_tight" if kind == "hand" else "tight")
    add_grip(plant, racket, limb.hand, grip, kind=kind, carrier_is_hand=True)
    ball = dr.add_ball(plant, dr.load_ball())
    plant.Finalize()
    impact = dr.add_impact(builder, plant, racket, ball, point=4, connect=False)
    limits = add_joint_limits(builder, plant, limb)
    torques = add_joint_torques(builder, plant, limb)
    force = limits.GetOutputPort("generalized_force")
    dr.connect_forces(builder, plant, [impact], generalized=[force])
    frame = plant.GetFrameByName("shoulder", limb.model_instances[0])
    joints = [plant.get_joint(i) for i in plant.GetJointIndices()]
    (weld,) = [j for j in joints if j.child_body().index() == frame.body().index()]
    outside = builder.AddSystem(OutsideWrench(plant, weld))
    builder.Connect(plant.get_state_output_port(), outside.get_input_port(0))
    builder.Connect(plant.get_reaction_forces_output_port(), outside.get_input_port(1))
    impulse = builder.AddSystem(Integrator(6))
    builder.Connect(outside.get_output_port(), impulse.get_input_port())
    simulator = Simulator(builder.Build())
    dr.configure_integrator(simulator, TIGHT)
    root = simulator.get_mutable_context()
    context = plant.GetMyMutableContextFromRoot(root)
    held = racket.frame("grip") if kind in ("compliant", "hand") else None
    state = solve_stroke(plant, limb, racket.frame("gsc"), AT_LIMITS, held_frame=held)
    apply_stroke(plant, context, limb, racket, state)
    torques.set(root, initial_torques("carry", plant, context, limb, racket))
    X_WC = racket.frame("gsc").CalcPoseInWorld(context)
    plant.SetFreeBodyPose(context, ball.body, RigidTransform(X_WC @ np.array([0.0, 0.06, 0.01])))
    velocity = SpatialVelocity(np.zeros(3), X_WC.rotation() @ np.array([5.0, 3.0, -25.0]))
    plant.SetFreeBodySpatialVelocity(context, ball.body, velocity)

    def momentum():
        about = X_WS.translation()
        return plant.CalcSpatialMomentumInWorldAboutPoint(context, about).get_coeffs()

    before = momentum()
    simulator.AdvanceTo(0.005)
    change = momentum() - before
    given = impulse.get_output_port().Eval(impulse.GetMyContextFromRoot(root))
    assert impact.record(root).touches >= 1
    for part in (slice(0, 3), slice(3, 6)):
        assert np.linalg.norm(change[part]) > 0.1
        assert change[part] == pytest.approx(given[part], abs=1e-6 * np.linalg.norm(before[part]))


# --- left and right ---

SWAPPED = [2, 1, 0, 5, 4, 3, 8, 7, 6]  # string-bed points of the mirror image, from 0


@pytest.mark.parametrize("kind", KINDS)
def test_left_limb_is_the_mirror_image(kind):
    """Equal joint values on the left: ball, strings, hand load are mirrored about y = 0."""
    right = dataclasses.replace(
        STROKE,
        grip_kind=kind,
        grip=GRIP_OF.get(kind, "normal"),
        point=1,
        after=0.005,
        audit=False,
        integrator=TIGHT,
    )
    limb = dataclasses.replace(
        right.limb,
        side="left",
        trunk_azimuth_deg=-70.0,
        stroke=dataclasses.replace(
            SWING,
            position=[0.45, -0.55, 1.0],
            tip_side="right",
            angular_velocity=[0.0, 0.0, 15.0],
        ),
    )
    left = dataclasses.replace(right, limb=limb, point=3)
    first = dr.make_impact_diagram(right)
    state = first.limb.set_state(
        first.diagram.CreateDefaultContext(), first.impact.racket, first.grip, right.limb
    )
    ends = []
    for scenario, y in ((right, 1.0), (left, -1.0)):
        mirror = np.array([1.0, y, 1.0])
        system = dr.make_impact_diagram(scenario)
        root = system.create_context()
        plant, racket, ball = system.plant, system.impact.racket, system.impact.ball.body
        context = plant.GetMyMutableContextFromRoot(root)
        solved = plant.GetVelocities(context)[system.limb.limb.velocity_indices()]
        assert solved == pytest.approx(state.v, abs=1e-6)  # the stroke's solution is mirrored too
        # ... to the optimizer's tolerance; from here on the very same joint values
        apply_stroke(plant, context, system.limb.limb, racket, state)
        torques = initial_torques("hold", plant, context, system.limb.limb, racket)
        system.limb.torques.set(root, torques)
        gsc = racket.frame("gsc").CalcPoseInWorld(context)
        at = gsc @ np.array([0.07, y * 0.06, 0.015])
        velocity = gsc.rotation() @ np.array([4.0, y * 2.0, -15.0])
        plant.SetFreeBodyPose(context, ball, RigidTransform(at))
        plant.SetFreeBodySpatialVelocity(context, ball, SpatialVelocity(np.zeros(3), velocity))
        # in contact, where the hand feels it, and after it
        during = dataclasses.replace(scenario, after=0.0025)
        load = system.diagram.GetOutputPort("hand_load")
        root = advance(system, during, root, exact=True)
        felt = load.Eval(root).copy()
        root = advance(system, scenario, root, exact=True)
        end = plant.GetMyContextFromRoot(root)
        v = plant.GetVelocities(end)
        strings = np.array([v[j.velocity_start()] for j in racket.string_joints])
        throat = np.array([v[j.velocity_start()] for j in (racket.in_plane, racket.out_of_plane)])
        rigid = racket.handle.EvalSpatialVelocityInWorld(end)
        ends.append(
            {
                "torque": torques,
                "ball": mirror * ball.EvalSpatialVelocityInWorld(end).translational(),
                "joints": v[system.limb.limb.velocity_indices()],
                "strings": strings if y > 0.0 else strings[SWAPPED],
                "throat": throat * [y, 1.0],
                "handle": mirror * rigid.translational(),
                "handle turning": y * mirror * rigid.rotational(),
                "hand torque": y * mirror * felt[:3],
                "hand force": mirror * felt[3:],
            }
        )
    for name, value in ends[0].items():
        scale = max(1.0, np.abs(value).max())
        assert ends[1][name] == pytest.approx(value, rel=0.0, abs=1e-9 * scale), name
    assert abs(ends[0]["throat"][0]) > 1e-3
    assert abs(ends[0]["hand force"][1]) > 1.0


# --- torques at the start ---


@pytest.mark.parametrize("kind", GRIP_KINDS)
def test_hold_and_zero_at_the_start(kind):
    system = dr.make_impact_diagram(
        dataclasses.replace(STROKE, grip_kind=kind, grip=GRIP_OF.get(kind, "normal"))
    )
    limb = system.limb.limb
    for choice in ("zero", "hold"):
        settings = dataclasses.replace(STROKE.limb, joint_torques=choice)
        root = system.create_context(
            dataclasses.replace(
                STROKE, grip_kind=kind, grip=GRIP_OF.get(kind, "normal"), limb=settings
            )
        )
        torques = system.diagram.GetOutputPort("joint_torques").Eval(root)
        context = system.plant.GetMyContextFromRoot(root)
        vdot = system.plant.EvalTimeDerivatives(context).get_generalized_velocity().CopyToVector()
        largest = np.abs(vdot[limb.velocity_indices()]).max()
        if choice == "zero":
            assert not torques.any()
            assert largest > 10.0
        else:
            assert np.abs(torques).max() > 1.0
            assert largest < 1e-8


def test_carry_bears_the_weight_of_the_racket():
    """At rest, carry less hold is the static load of each racket body's weight on the joints."""
    at_rest = dataclasses.replace(STROKE, limb=STILL_LIMB)
    system = dr.make_impact_diagram(at_rest)
    plant, limb = system.plant, system.limb.limb
    torques = {}
    for choice in ("hold", "carry"):
        settings = dataclasses.replace(STILL_LIMB, joint_torques=choice)
        root = system.create_context(dataclasses.replace(at_rest, limb=settings))
        torques[choice] = system.diagram.GetOutputPort("joint_torques").Eval(root)
    context = plant.GetMyContextFromRoot(root)
    racket = [system.impact.racket.model_instance]
    weight = plant.CalcTotalMass(context, racket) * np.array(at_rest.gravity)
    com = plant.CalcCenterOfMassPositionInWorld(context, racket)
    load = []
    for joint in limb.joints:  # virtual work of one rad about each axis
        frame = joint.frame_on_parent()
        axis = frame.CalcPoseInWorld(context).rotation() @ joint.revolute_axis()
        arm = com - frame.CalcPoseInWorld(context).translation()
        load.append(axis @ np.cross(arm, weight))
    assert np.abs(load).max() > 1.0
    assert torques["carry"] - torques["hold"] == pytest.approx(-np.array(load), abs=1e-9)


# --- derivatives ---


def test_autodiff_of_the_whole_diagram():
    """d v'/d (stiffness of a limit) and d v'/d (elbow angle), against differences."""
    scenario = limited("compliant")
    system = dr.make_impact_diagram(scenario)
    root = system.create_context()
    limits = system.limb.limits
    name = limits.get_name()
    elbow = system.limb.limb.position_indices()[3]
    q = system.plant.GetPositions(system.plant.GetMyContextFromRoot(root)).copy()
    q[elbow] = -0.02  # beyond the end of its range
    stiffness = limits.GetMyContextFromRoot(root).get_numeric_parameter(2).CopyToVector()[3]

    def vdot(diagram, values):
        context = diagram.CreateDefaultContext()
        context.SetTimeStateAndParametersFrom(root)
        plant, limits = (diagram.GetSubsystemByName(n) for n in ("plant", name))
        numbers = limits.GetMyMutableContextFromRoot(context).get_mutable_numeric_parameter(2)
        numbers[3] = values[0]
        positions = [type(values[1])(float(x)) for x in q]
        positions[elbow] = values[1]
        own = plant.GetMyMutableContextFromRoot(context)
        plant.SetPositions(own, np.array(positions))
        derivatives = plant.EvalTimeDerivatives(own).get_generalized_velocity()
        return derivatives.CopyToVector()

    point = [stiffness, q[elbow]]
    seeds = [AutoDiffXd(x, row) for x, row in zip(point, np.eye(2), strict=True)]
    moving = vdot(system.diagram.ToAutoDiffXd(), seeds)  # the ball's have no derivatives: 0
    exact = np.array([x.derivatives() if len(x.derivatives()) else np.zeros(2) for x in moving])
    for i, h in ((0, 1.0), (1, 1e-6)):
        step = h * np.eye(2)[i]
        ends = [vdot(system.diagram, [float(x) for x in point + s * step]) for s in (1.0, -1.0)]
        difference = (ends[0] - ends[1]) / (2.0 * h)
        scale = np.abs(difference).max()
        assert scale > 1e-4
        assert exact[:, i] == pytest.approx(difference, abs=1e-6 * scale)
