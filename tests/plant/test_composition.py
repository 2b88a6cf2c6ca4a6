"""Rackets and balls on the user's own plant and builder."""

from __future__ import annotations

import csv
import subprocess
import sys

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

import drake_racket as dr
from tests.conftest import ROOT

STUDIES = ROOT / "studies"


def plant_with(builder, *names, parameters=None):
    plant = builder.AddSystem(MultibodyPlant(0.0))
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
    rackets = [dr.add_racket(plant, parameters or dr.load_racket(), name=name) for name in names]
    balls = [dr.add_ball(plant, dr.load_ball(), name=f"ball_of_{name}") for name in names]
    plant.Finalize()
    return plant, rackets, balls


def test_two_rackets_in_one_plant_do_not_know_of_each_other():
    builder = DiagramBuilder()
    plant, rackets, balls = plant_with(builder, "mine", "yours")
    impacts = [
        dr.add_impact(builder, plant, r, b, point=5, connect=False)
        for r, b in zip(rackets, balls, strict=True)
    ]
    dr.connect_forces(builder, plant, impacts)
    simulator = Simulator(builder.Build())
    dr.configure_integrator(simulator, dr.IntegratorSettings(accuracy=1e-5))
    root = simulator.get_mutable_context()
    context = plant.GetMyMutableContextFromRoot(root)
    # the second racket stands elsewhere, turned, and is hit 0.4 ms later
    poses = [
        RigidTransform(),
        RigidTransform(RotationMatrix.MakeXRotation(1.0), [0.0, 2.0, 1.0]),
    ]
    for racket, ball, pose, gap in zip(rackets, balls, poses, (0.01, 0.02), strict=True):
        plant.SetFreeBodyPose(context, racket.handle, pose)
        at = np.add(racket.parameters.point(5), [0.0, 0.0, gap])
        plant.SetFreeBodyPose(context, ball.body, RigidTransform(pose @ at))
        velocity = pose.rotation() @ np.array([0.0, 0.0, -25.0])
        plant.SetFreeBodySpatialVelocity(context, ball.body, SpatialVelocity(np.zeros(3), velocity))
    simulator.AdvanceTo(0.007)
    speeds = [
        pose.rotation().inverse() @ b.body.EvalSpatialVelocityInWorld(context).translational()
        for b, pose in zip(balls, poses, strict=True)
    ]
    assert speeds[1] == pytest.approx(speeds[0], abs=1e-5)
    alone = dr.simulate(dr.Scenario(after=0.006), history=False).rebound_velocity
    assert speeds[0] == pytest.approx(alone, abs=1e-4)
    records = [impact.record(root) for impact in impacts]
    assert records[1].touch_time - records[0].touch_time == pytest.approx(0.01 / 25.0, abs=1e-8)


URDF = """
<robot name="arm">
  <link name="upper"><inertial><mass value="2"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="hand"><inertial><mass value="0.6"/>
    <inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="wrist" type="revolute"><parent link="upper"/><child link="hand"/>
    <origin xyz="0.5 0 0"/><axis xyz="0 1 0"/><limit effort="50" velocity="100"/></joint>
  <transmission type="SimpleTransmission"><joint name="wrist"/><actuator name="motor"/>
  </transmission>
</robot>
"""


def test_a_racket_welded_to_the_users_own_arm_with_controller():
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    (arm,) = Parser(plant).AddModelsFromString(URDF, "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("upper"))
    hand = plant.GetFrameByName("hand")
    racket = dr.add_racket(plant, dr.load_racket("recreational"), parent=hand, held_at="grip")
    ball = dr.add_ball(plant, dr.load_ball())
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
    plant.Finalize()
    torque = builder.AddSystem(ConstantVectorSource([1.0]))
    builder.Connect(torque.get_output_port(), plant.get_actuation_input_port(arm))
    impact = dr.add_impact(builder, plant, racket, ball)
    assert plant.num_actuators() == 1  # the racket brings none
    simulator = Simulator(builder.Build())
    dr.configure_integrator(simulator, dr.IntegratorSettings())
    root = simulator.get_mutable_context()
    context = plant.GetMyMutableContextFromRoot(root)
    gsc = racket.frame("gsc").CalcPoseInWorld(context).translation()
    plant.SetFreeBodyPose(context, ball.body, RigidTransform(np.add(gsc, [0.0, 0.0, 0.01])))
    velocity = SpatialVelocity([0.0, 0.0, 0.0], [0.0, 0.0, -30.0])
    plant.SetFreeBodySpatialVelocity(context, ball.body, velocity)
    simulator.AdvanceTo(0.01)
    rebound = ball.body.EvalSpatialVelocityInWorld(context).translational()
    assert impact.record(root).point == 5
    assert 5.0 < rebound[2] < 25.0
    assert abs(plant.GetJointByName("wrist").get_angular_rate(context)) > 1.0


def test_racket_without_a_ball_rings():
    """A plucked string-bed: add_impact with no ball adds the strings alone."""
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    racket = dr.add_racket(plant, dr.load_racket(), parent=plant.world_frame())
    plant.Finalize()
    impact = dr.add_impact(builder, plant, racket)
    assert impact.contact is None
    simulator = Simulator(builder.Build())
    dr.configure_integrator(simulator, dr.IntegratorSettings())
    root = simulator.get_mutable_context()
    context = plant.GetMyMutableContextFromRoot(root)
    racket.string_joints[4].set_translation(context, 0.005)
    simulator.AdvanceTo(0.001)
    assert racket.string_joints[0].get_translation(context) != 0.0
    with pytest.raises(dr.InputError, match="without a ball"):
        impact.record(root)


def test_shipped_sdf_through_the_users_parser():
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    parser = Parser(plant)
    dr.add_to_package_map(parser.package_map())
    (instance,) = parser.AddModelsFromUrl("package://drake_racket/racket_tour.sdf")
    plant.Finalize()
    racket = dr.find_racket(plant, instance, dr.load_racket())
    dr.add_impact(builder, plant, racket)
    builder.Build()


@pytest.mark.parametrize("finalized", [False, True])
def test_add_impact_before_or_after_finalize(finalized):
    """Two rackets, each with its impact, before anybody has called Finalize."""
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    rackets = [dr.add_racket(plant, dr.load_racket(), name=name) for name in ("left", "right")]
    balls = [dr.add_ball(plant, dr.load_ball(), name=f"{side}_ball") for side in ("left", "right")]
    if finalized:
        plant.Finalize()
    impacts = [
        dr.add_impact(builder, plant, racket, ball, connect=False)
        for racket, ball in zip(rackets, balls, strict=True)
    ]
    dr.connect_forces(builder, plant, impacts)
    diagram = builder.Build()
    assert diagram.CreateDefaultContext().num_continuous_states() == 2 * (2 * 9 + 2 * 2 + 2 * 13)


def test_wiring_mistakes_get_one_clear_line():
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    racket = dr.add_racket(plant, dr.load_racket())
    ball = dr.add_ball(plant, dr.load_ball())
    other = MultibodyPlant(0.0)
    strangers = dr.add_racket(other, dr.load_racket()), dr.add_ball(other, dr.load_ball())
    with pytest.raises(dr.InputError, match="a racket of another plant"):
        dr.add_impact(builder, plant, strangers[0], ball)
    with pytest.raises(dr.InputError, match="a ball of another plant"):
        dr.add_impact(builder, plant, racket, strangers[1])
    with pytest.raises(dr.InputError, match="not in the builder"):
        dr.add_impact(DiagramBuilder(), plant, racket, ball)
    with pytest.raises(dr.InputError, match="point"):
        dr.add_impact(builder, plant, racket, ball, point=10)
    with pytest.raises(dr.InputError, match="friction_reading"):
        dr.add_impact(builder, plant, racket, ball, friction_reading="sticky")
    assert not plant.is_finalized()  # refused: nothing changed
    assert len(builder.GetSystems()) == 1
    dr.add_impact(builder, plant, racket, ball)
    with pytest.raises(dr.InputError, match="connected already"):
        dr.add_impact(builder, plant, racket, ball, name="again")


def test_the_unstrung_racket_has_no_string_bed():
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    racket = dr.add_racket(plant, dr.load_racket(), strung=False)
    plant.Finalize()
    with pytest.raises(dr.InputError, match="unstrung"):
        dr.add_impact(builder, plant, racket)


def test_add_contact_takes_no_unstrung_racket():
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    racket = dr.add_racket(plant, dr.load_racket(), strung=False)
    ball = dr.add_ball(plant, dr.load_ball())
    with pytest.raises(dr.InputError, match="add_contact: racket"):
        dr.add_contact(builder, plant, racket, ball, name="contact")
    assert not plant.is_finalized()


def test_a_meter_of_one_s_own_counts_the_joint_s_damping():
    builder = DiagramBuilder()
    damped = dr.apply_overrides(dr.load_racket(), {"racket.string_bed.damping": 2.0})
    plant, [racket], [ball] = plant_with(builder, "mine", parameters=damped)
    impact = dr.add_impact(builder, plant, racket, ball, point=2)
    meter = dr.add_energy_meter(builder, plant, impact)
    simulator = Simulator(builder.Build())
    dr.configure_integrator(simulator, dr.IntegratorSettings())
    root = simulator.get_mutable_context()
    context = plant.GetMyMutableContextFromRoot(root)
    at = RigidTransform(np.add(racket.parameters.point(2), [0.0, 0.0, 0.005]))
    plant.SetFreeBodyPose(context, ball.body, at)
    velocity = SpatialVelocity(np.zeros(3), np.array([0.0, 0.0, -25.0]))
    plant.SetFreeBodySpatialVelocity(context, ball.body, velocity)
    before = dr.balance(impact, meter, root, held=False)
    simulator.AdvanceTo(0.02)
    after = dr.balance(impact, meter, root, held=False)
    assert after.lost_joint > 1e-3 * before.total()
    assert after.lost_strings > 1e-3 * before.total()
    assert after.total() == pytest.approx(before.total(), rel=1e-4)
    other = DiagramBuilder()
    strange, [lonely], _ = plant_with(other, "lonely")
    bare = dr.add_impact(other, strange, lonely)
    with pytest.raises(dr.InputError, match="add_energy_meter: impact"):
        dr.add_energy_meter(builder, plant, bare)
    with pytest.raises(dr.InputError, match="balance: impact"):
        dr.balance(bare, meter, root, held=False)


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"scheme": "nope"}, "integrator: scheme"),
        ({"maximum_step": 0.0, "error_control": False}, "integrator: maximum_step"),
        ({"accuracy": float("nan")}, "integrator: accuracy"),
    ],
)
def test_settings_of_one_s_own_simulator_are_checked(changes, match):
    builder = DiagramBuilder()
    plant_with(builder, "mine")
    simulator = Simulator(builder.Build())
    with pytest.raises(dr.InputError, match=match):
        dr.configure_integrator(simulator, dr.IntegratorSettings(**changes))


def test_first_impact_study(tmp_path):
    out = tmp_path / "study"
    done = subprocess.run(
        [sys.executable, str(STUDIES / "first_impact.py"), "--out", str(out)],
        capture_output=True,
        text=True,
        check=True,
        cwd=tmp_path,
    )
    rebound = dr.simulate(dr.Scenario(after=0.006), history=False).rebound_velocity[2]
    assert f"rebound {rebound:.2f} m/s" in done.stdout
    table = np.loadtxt(out / "contact.csv", delimiter=",", skiprows=1)
    assert table[:, 2].max() == pytest.approx(885.0, rel=0.01)


@pytest.mark.slow
def test_reaction_point_study(tmp_path):
    out = tmp_path / "study"
    command = [sys.executable, str(STUDIES / "reaction_point.py"), "--out", str(out)]
    done = subprocess.run(
        [*command, "--points", "4"], capture_output=True, text=True, check=True, cwd=tmp_path
    )
    assert done.stdout.count("point 4") == 2  # normal and oblique
    with (out / "reaction_point.csv").open(newline="") as file:
        _, oblique = csv.DictReader(file)
    assert float(oblique["angular momentum error at ball"]) < 1e-6
    assert float(oblique["angular momentum error at string mass"]) > 1e-3


@pytest.mark.slow
def test_first_impact_as_a_page(tmp_path):
    """The page has the bodies' shapes, and an animation of the paths that they have."""
    out = tmp_path / "out"
    command = [sys.executable, str(STUDIES / "first_impact.py"), "--page", "--out", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    assert "apparent restitution 0.409" in done.stdout
    page = (out / "impact.html").read_text()
    assert page.count("base64") > 100  # shapes and animation are messages inside
