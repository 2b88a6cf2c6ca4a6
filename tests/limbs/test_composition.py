"""Any limb can hold the racket: files, functions, plants of the user's own; and what is refused."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, RevoluteJoint, SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.controllers import PidController
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

import drake_racket as dr
from drake_racket import cli
from drake_racket.limbs.limb import Limb
from drake_racket.limbs.limits import add_joint_limits
from drake_racket.limbs.models import add_limb_model, find_limb
from drake_racket.limbs.stroke import Stroke, apply_stroke, solve_stroke
from drake_racket.limbs.torques import add_joint_torques
from drake_racket.limbs.upper_limb import add_upper_limb
from drake_racket.parameters.grip import GRIP_KINDS, load_grip
from drake_racket.parameters.limb import JOINTS
from drake_racket.parameters.limb_settings import LimbSettings
from drake_racket.plant.grip import add_grip
from drake_racket.plant.systems.grip_load import add_grip_load


def _link(name: str) -> str:
    return (
        f'<link name="{name}"><inertial><origin xyz="0.15 0 0"/><mass value="1.5"/>'
        '<inertia ixx="0.002" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


def _joint(name: str, parent: str, child: str, axis: str, x: float) -> str:
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{x} 0 0"/><axis xyz="{axis}"/>'
        '<limit lower="-2" upper="2" effort="500" velocity="100"/></joint>'
    )


GRIP_OF = {"hand": "hand_medium"}  # the kinds that the default grip is not for
_ACTUATOR = '<transmission type="SimpleTransmission"><joint name="{0}"/><actuator name="m_{0}"/>'
LINKS = '<link name="trunk"/>' + _link("upper") + _link("lower") + '<link name="hand"/>'
TREE = (
    _joint("shoulder", "trunk", "upper", "0 0 1", 0.0)
    + _joint("elbow", "upper", "lower", "0 0 1", 0.3)
    + '<joint name="fix" type="fixed"><parent link="lower"/><child link="hand"/>'
    '<origin xyz="0.3 0 0" rpy="1.4 0 0"/></joint>'
)
MOTORS = "".join(_ACTUATOR.format(n) + "</transmission>" for n in ("shoulder", "elbow"))
PASSIVE = f'<robot name="arm">{LINKS}{TREE}</robot>'
ACTUATED = f'<robot name="arm">{LINKS}{TREE}{MOTORS}</robot>'
ROOTED = PASSIVE.replace(
    LINKS,
    LINKS + '<link name="world"/><joint name="root" type="fixed"><parent link="world"/>'
    '<child link="trunk"/><origin xyz="0 0 1.2"/></joint>',
)
LOOP = PASSIVE.replace("</robot>", _joint("strut", "trunk", "lower", "0 0 1", 0.0) + "</robot>")

SWING = Stroke(speed=8.0, velocity_azimuth_deg=-70.0, guess_deg={"elbow": 20.0, "shoulder": 10.0})
FILE_LIMB = LimbSettings(base="trunk", place=[0.0, 0.0, 1.2], joint_torques="hold", stroke=SWING)
CASE = dr.Scenario(
    support="limb", grip_kind="torsional", limb=FILE_LIMB, speed=20.0, after=0.005, audit=False
)


def with_limb(scenario: dr.Scenario, **changes) -> dr.Scenario:
    return dataclasses.replace(scenario, limb=dataclasses.replace(scenario.limb, **changes))


@pytest.fixture
def urdf(tmp_path):
    """Writes URDF text; returns the scenario with it."""

    def write(text: str = PASSIVE, name: str = "arm.urdf") -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


def add_my_limb(plant: MultibodyPlant) -> Limb:
    """The URDF's limb, as a function would add it."""
    Parser(plant).AddModelsFromString(PASSIVE, "urdf")
    trunk = plant.GetFrameByName("trunk")
    plant.WeldFrames(plant.world_frame(), trunk, RigidTransform([0.0, 0.0, 1.2]))
    return find_limb(plant, plant.GetFrameByName("hand"))


def rebound(scenario: dr.Scenario, **options) -> np.ndarray:
    """Velocity of the ball after the impact (3), and where the hand was at the start (3)."""
    system = dr.make_impact_diagram(scenario, **options)
    context = system.plant.GetMyContextFromRoot(system.create_context())
    hand = system.limb.limb.hand.CalcPoseInWorld(context).translation()
    result = dr.simulate(scenario, system, history=False)
    assert result.touches == 1
    assert result.contact_time is not None
    return np.append(result.rebound_velocity, hand)


# --- one limb, many ways to bring it ---


def test_file_directives_frame_and_limb_are_the_same_limb(urdf, tmp_path):
    path = urdf()
    expected = rebound(with_limb(CASE, model=str(path)))
    (tmp_path / "package.xml").write_text("<package><name>mine</name></package>")
    directives = tmp_path / "arm.dmd.yaml"
    directives.write_text(
        f"directives:\n- add_model: {{name: left, file: 'file://{path}'}}\n"
        "- add_weld: {parent: world, child: 'left::trunk', X_PC: {translation: [0, 0, 1.2]}}\n"
        "- add_frame: {name: held, X_PF: {base_frame: 'left::hand'}}\n"
    )
    ways = {
        "directives": rebound(with_limb(CASE, model=str(directives), base="", hand="left::held")),
        "rooted": rebound(
            with_limb(CASE, model=str(urdf(ROOTED, "rooted.urdf")), base="", place=[9.0, 0.0, 0.0])
        ),
        "limb": rebound(CASE, limb=add_my_limb),
        "frame": rebound(CASE, limb=lambda plant: add_my_limb(plant).hand),
    }
    assert abs(expected[2]) > 1.0
    for way, velocity in ways.items():
        assert velocity == pytest.approx(expected, abs=1e-8), way


@pytest.mark.parametrize("kind", GRIP_KINDS)
def test_actuators_take_the_same_torques_as_generalized_forces(urdf, kind):
    scenario = dataclasses.replace(
        CASE, grip_kind=kind, grip=GRIP_OF.get(kind, "normal"), gravity=[0.0, 0.0, -9.81]
    )
    without = with_limb(scenario, model=str(urdf(PASSIVE, "passive.urdf")))
    actuated = with_limb(scenario, model=str(urdf(ACTUATED, "actuated.urdf")))
    for case, actuators in ((without, 0), (actuated, 2)):
        system = dr.make_impact_diagram(case)
        assert len(system.limb.torques.actuators) == actuators
        torques = system.diagram.GetOutputPort("joint_torques").Eval(system.create_context())
        assert np.abs(torques).max() > 1.0
    assert rebound(actuated) == pytest.approx(rebound(without), abs=1e-9)


def test_torques_of_the_users_own(urdf):
    case = with_limb(CASE, model=str(urdf(ACTUATED)))
    held = dr.make_impact_diagram(case)
    start = held.create_context()
    torques = held.diagram.GetOutputPort("joint_torques").Eval(start)
    system = dr.make_impact_diagram(case, export_torques=True)
    ends = []
    for values in (torques, np.add(torques, [0.0, 200.0])):
        root = system.create_context()
        system.diagram.GetInputPort("joint_torques").FixValue(root, values)
        simulator = Simulator(system.diagram, root)
        dr.configure_integrator(simulator, case.integrator)
        simulator.AdvanceTo(case.approach_time + case.after)
        context = system.plant.GetMyContextFromRoot(simulator.get_context())
        v = system.plant.GetVelocities(context)
        ends.append(v[system.limb.limb.velocity_indices()].copy())
    same = dr.simulate(case, held).history.joint_velocity[-1].to_numpy()
    assert ends[0] == pytest.approx(same, abs=1e-9)
    assert ends[1][1] > same[1] + 0.5


def test_shipped_limb_both_sides_and_directives(tmp_path):
    stroke = Stroke(speed=8.0, guess_deg={"shoulder_flexion": 50.0, "elbow_flexion": 20.0})
    limb = LimbSettings(stroke=stroke, trunk_azimuth_deg=60.0, grip_rotation_deg=0.0)
    case = dataclasses.replace(CASE, limb=limb)
    right = rebound(case)
    directives = tmp_path / "shipped.dmd.yaml"
    directives.write_text(
        "directives:\n"
        "- add_model: {name: limb, file: 'package://drake_racket/upper_limb.sdf'}\n"
        "- add_weld: {parent: world, child: 'limb::shoulder', X_PC: {translation: [0, 0, 1.4],"
        " rotation: !Rpy {deg: [0, 0, 60]}}}\n"
    )
    # the same model from its file: the joints have the names of the shipped one, so its limits too
    system = dr.make_impact_diagram(with_limb(case, model=str(directives)))
    assert system.limb.limits is not None
    assert system.limb.limb.joint_names() == list(JOINTS)
    from_file = rebound(with_limb(case, model=str(directives)))
    assert from_file == pytest.approx(right, abs=1e-6)
    assert np.isfinite(rebound(with_limb(case, side="left"))).all()


def test_discrete_plant_gives_nearly_the_same(urdf):
    case = with_limb(CASE, model=str(urdf()))
    continuous = rebound(case)
    discrete = rebound(dataclasses.replace(case, time_step=1e-5))
    assert discrete == pytest.approx(continuous, abs=0.02)
    shipped = with_limb(case, model="upper_limb", stroke=Stroke(), base="")
    system = dr.make_impact_diagram(dataclasses.replace(shipped, time_step=1e-5))
    assert system.limb.limits is None  # Drake's own act


# --- by hand ---


def test_two_limbs_in_one_plant_do_not_know_of_each_other():
    """Each hit by a ball of its own, at the same time: as each alone, whatever the pose."""
    poses = {
        "me": RigidTransform([0.0, 0.0, 1.4]),
        "you": RigidTransform(RotationMatrix.MakeZRotation(3.0), [20.0, 1.0, 1.4]),
    }
    stroke = Stroke(guess_deg={"shoulder_flexion": 50.0, "elbow_flexion": 20.0})
    ends = {}
    for names in (("me",), ("me", "you")):
        builder = DiagramBuilder()
        plant = builder.AddSystem(MultibodyPlant(0.0))
        plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
        limbs, rackets, balls, grips = {}, {}, {}, {}
        for name in names:
            limbs[name] = add_upper_limb(plant, name=f"{name}_limb", X_PF=poses[name])
            rackets[name] = dr.add_racket(plant, dr.load_racket(), name=f"{name}_racket")
            grips[name] = add_grip(plant, rackets[name], limbs[name].hand, load_grip())
            balls[name] = dr.add_ball(plant, dr.load_ball(), name=f"{name}_ball")
        plant.Finalize()
        impacts, sources, loads = [], [], {}
        for name in names:
            impacts.append(
                dr.add_impact(builder, plant, rackets[name], balls[name], point=3, connect=False)
            )
            limits = add_joint_limits(builder, plant, limbs[name], name=f"{name}_limits")
            sources.append(limits.GetOutputPort("generalized_force"))
            loads[name] = add_grip_load(builder, plant, grips[name], name=f"{name}_load")
        dr.connect_forces(builder, plant, impacts, generalized=sources)
        simulator = Simulator(builder.Build())
        dr.configure_integrator(simulator, dr.IntegratorSettings(accuracy=1e-5))
        root = simulator.get_mutable_context()
        context = plant.GetMyMutableContextFromRoot(root)
        frames = {}
        for name in names:
            racket, ball = rackets[name], balls[name].body
            held, centre = racket.frame("grip"), racket.frame("gsc")
            state = solve_stroke(
                plant, limbs[name], centre, stroke, held_frame=held, context=context
            )
            apply_stroke(plant, context, limbs[name], racket, state)
            X_WC = frames[name] = centre.CalcPoseInWorld(context)
            at = X_WC @ np.array([0.05, -0.05, 0.02])
            plant.SetFreeBodyPose(context, ball, RigidTransform(at))
            velocity = SpatialVelocity(np.zeros(3), X_WC.rotation() @ np.array([0.0, 0.0, -25.0]))
            plant.SetFreeBodySpatialVelocity(context, ball, velocity)
        simulator.AdvanceTo(0.005)
        for name in names:
            R_CW = frames[name].rotation().inverse()
            load = loads[name].GetOutputPort("hand_load")
            ends[len(names), name] = np.concatenate(
                [
                    R_CW @ balls[name].body.EvalSpatialVelocityInWorld(context).translational(),
                    plant.GetVelocities(context)[limbs[name].velocity_indices()],
                    load.Eval(loads[name].GetMyContextFromRoot(root)),
                ]
            )
    alone = ends[1, "me"]
    assert abs(alone[2]) > 1.0
    for name in ("me", "you"):
        assert ends[2, name] == pytest.approx(alone, abs=1e-4 * np.abs(alone).max())


def test_a_builder_with_a_controller_of_its_own(urdf):
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
    limb = add_limb_model(plant, urdf(ACTUATED), "hand", base="trunk")
    racket = dr.add_racket(plant, dr.load_racket(), parent=limb.hand)
    ball = dr.add_ball(plant, dr.load_ball())
    plant.Finalize()
    (arm,) = {j.model_instance() for j in limb.joints}
    controller = builder.AddSystem(PidController([900.0] * 2, [0.0] * 2, [40.0] * 2))
    goal = builder.AddSystem(ConstantVectorSource([0.2, 0.3, 0.0, 0.0]))
    builder.Connect(plant.get_state_output_port(arm), controller.get_input_port_estimated_state())
    builder.Connect(goal.get_output_port(), controller.get_input_port_desired_state())
    builder.Connect(controller.get_output_port(), plant.get_actuation_input_port())
    impact = dr.add_impact(builder, plant, racket, ball)
    with pytest.raises(dr.InputError):  # the actuation is the controller's
        add_joint_torques(builder, plant, limb)
    simulator = Simulator(builder.Build())
    dr.configure_integrator(simulator, dr.IntegratorSettings())
    root = simulator.get_mutable_context()
    context = plant.GetMyMutableContextFromRoot(root)
    X_WC = racket.frame("gsc").CalcPoseInWorld(context)
    plant.SetFreeBodyPose(context, ball.body, RigidTransform(X_WC @ np.array([0.0, 0.0, 0.02])))
    velocity = SpatialVelocity(np.zeros(3), X_WC.rotation() @ np.array([0.0, 0.0, -20.0]))
    plant.SetFreeBodySpatialVelocity(context, ball.body, velocity)
    simulator.AdvanceTo(0.06)
    assert impact.record(root).touches == 1
    angles = plant.GetPositions(context)[limb.position_indices()]
    assert angles == pytest.approx([0.2, 0.3], abs=0.1)  # hit, and on its way


# --- what is refused ---


def check(error: dr.InputError, *fragments: str) -> None:
    text = str(error)
    assert "\n" not in text
    assert text.isprintable()
    assert "allowed" in text
    for fragment in fragments:
        assert fragment in text


FAR = Stroke(position=[5.0, 5.0, 5.0])
BROKEN = {
    "limb.urdf": "<robot",
    "limb.sdf": "<sdf",
    "empty.sdf": "",
    "bytes.urdf": "\x00\x01",
    "limb.dmd.yaml": "directives:\n- add_modl: {}\n",
    "brackets.dmd.yaml": "[[",
    "lost.dmd.yaml": "directives:\n- add_model: {name: x, file: 'package://drake_racket/no.sdf'}\n",
}
REFUSED = {
    "no such file": ({"model": "nowhere.urdf"}, ("limb: model", "nowhere.urdf", "can be read")),
    "no such kind": ({"model": "arm.obj"}, ("limb: model", "arm.obj", "upper_limb")),
    "no such hand": ({"hand": "fist"}, ("limb: hand", "fist", "lower")),
    "no such base": ({"base": "hips"}, ("limb: base", "hips", "trunk")),
    "hand on the base": ({"hand": "trunk"}, ("hand", "trunk", "joints carry")),
    "base held twice": ({"model": "rooted.urdf"}, ("limb: base", "trunk", "no joint")),
    "a loop": ({"model": "loop.urdf"}, ("lower", "elbow", "strut")),
    "out of reach": ({"stroke": FAR}, ("stroke: position", "reach")),
    "no such joint": ({"stroke": Stroke(guess_deg={"knee": 3.0})}, ("guess_deg.knee", "elbow")),
    "beyond a range": ({"stroke": Stroke(guess_deg={"elbow": 150.0})}, ("guess_deg.elbow",)),
    "too fast": (
        {"stroke": Stroke(speed=10.0, velocity_azimuth_deg=0.0, guess_deg={"elbow": 0.0})},
        ("stroke: speed",),
    ),
    "no such side": ({"side": "top"}, ("limb.side", "top", "left")),
    "no such torques": ({"joint_torques": "rigid"}, ("limb.joint_torques", "rigid", "carry")),
} | {name: ({"model": name}, ("limb: model", name)) for name in BROKEN}


@pytest.fixture
def refused_case(tmp_path, monkeypatch):
    """Stands in a directory with the files; makes a scenario of changes to the limb's settings."""
    monkeypatch.chdir(tmp_path)
    files = BROKEN | {"arm.urdf": PASSIVE, "rooted.urdf": ROOTED, "loop.urdf": LOOP}
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return lambda changes: with_limb(CASE, **({"model": "arm.urdf"} | changes))


@pytest.mark.parametrize("name", REFUSED)
def test_refused_in_python(name, refused_case):
    changes, fragments = REFUSED[name]
    with pytest.raises(dr.InputError) as caught:
        dr.simulate(refused_case(changes), history=False)
    check(caught.value, *fragments)


@pytest.mark.parametrize("name", REFUSED)
def test_refused_by_the_command_line(name, refused_case, tmp_path, monkeypatch, capsys):
    """Status 2, one line on standard error, and nothing is written."""
    changes, fragments = REFUSED[name]
    text = yaml.safe_dump(dataclasses.asdict(refused_case(changes)))
    (tmp_path / "scenario.yaml").write_text(text, encoding="utf-8")
    before = sorted(tmp_path.iterdir())
    monkeypatch.setattr(sys, "argv", ["drake-racket", "impact", "scenario.yaml", "--out", "out"])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    captured = capsys.readouterr()
    assert stopped.value.code == 2
    assert captured.out == ""
    lines = captured.err.splitlines()
    assert len(lines) == 1
    for fragment in fragments:
        assert fragment in lines[0]
    assert sorted(tmp_path.iterdir()) == before


GRIP = """name: bad
title: bad
force_stiffness: {value: [1.0, -1.0, 1.0], unit: N/m, status: inferred, source: a test}
force_damping: {value: [1.0, 1.0, 1.0], unit: N*s/m, status: inferred, source: a test}
torque_stiffness: {value: [1.0, 1.0, 1.0], unit: N*m/rad, status: inferred, source: a test}
torque_damping: {value: [1.0, 1.0, 1.0], unit: N*m*s/rad, status: inferred, source: a test}
notes: []
"""


def test_negative_grip_stiffness(refused_case, tmp_path):
    (tmp_path / "grip.yaml").write_text(GRIP, encoding="utf-8")
    scenario = dataclasses.replace(refused_case({}), grip="grip.yaml")
    with pytest.raises(dr.InputError) as caught:
        dr.make_impact_diagram(scenario)
    check(caught.value, "force_stiffness", "-1")


@pytest.mark.parametrize("returned", [None, 3, "hand"], ids=repr)
def test_functions_that_return_no_limb(returned):
    with pytest.raises(dr.InputError) as caught:
        dr.make_impact_diagram(CASE, limb=lambda plant: returned)
    check(caught.value, "limb", "Frame")


def test_a_frame_that_no_joint_carries():
    def post(plant):
        return plant.AddFrame(FixedOffsetFrame("post", plant.world_frame(), RigidTransform()))

    with pytest.raises(dr.InputError) as caught:
        dr.make_impact_diagram(CASE, limb=post)
    check(caught.value, "post", "joints carry")


def test_after_finalize(urdf):
    plant = MultibodyPlant(0.0)
    path = urdf()
    plant.Finalize()
    with pytest.raises(dr.InputError) as caught:
        add_limb_model(plant, path, "hand")
    check(caught.value, "finalized")


@pytest.mark.parametrize("floating", [False, True])
def test_find_limb_before_and_after_finalize_is_the_same(floating):
    """A floating base gets a joint from Finalize; that is none of the limb's."""
    plant = MultibodyPlant(0.0)
    box = SpatialInertia.SolidBoxWithMass(3.0, 0.6, 0.1, 0.1)
    trunk = plant.AddRigidBody("trunk", box)
    arm = plant.AddRigidBody("arm", box)
    plant.AddJoint(RevoluteJoint("shoulder", trunk.body_frame(), arm.body_frame(), [0, 1, 0]))
    if not floating:
        plant.WeldFrames(plant.world_frame(), trunk.body_frame())
    before = find_limb(plant, arm.body_frame())
    assert before.joint_names() == ["shoulder"]
    plant.Finalize()
    assert find_limb(plant, arm.body_frame()) == before
