"""Ties and rates: mimic joints, loops that constraints close, limits of joint rates."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import MultibodyForces

from drake_racket import InputError, Stroke, find_limb, make_impact_diagram, simulate
from drake_racket.limbs.files.ties import read_mimics
from drake_racket.limbs.limb import Tie
from drake_racket.limbs.stroke_velocity import find_joint_velocities
from tests.limbs.arms import HEAD, TRUNK, arm, joint, link, robot, striking

MIMIC = '<mimic joint="{}" multiplier="{}" offset="{}"/>'


def jaws(more: str) -> list[str]:
    return [
        link("jaw_a", 0.1, com="0 0 0"),
        link("jaw_b", 0.1, com="0 0 0"),
        joint("a", "right_hand", "jaw_a", kind="prismatic", at="0.02 0.01 0"),
        joint("b", "right_hand", "jaw_b", kind="prismatic", at="0.02 -0.01 0", more=more),
    ]


@pytest.fixture
def model(tmp_path):
    def write(*parts: str, name: str = "arm.urdf"):
        (tmp_path / name).write_text(robot(*parts))
        return tmp_path / name

    return write


def test_tied_fingers_are_locked_on_a_continuous_plant(model):
    path = model(*TRUNK, *arm("right", -0.2), *jaws(MIMIC.format("a", -1.0, 0.03)))
    case = striking(path, "right_hand", initial_deg={"a": 0.01})
    system = make_impact_diagram(case)
    result = simulate(case, system)
    assert "locked where they start: a, b" in " ".join(result.warnings)
    assert system.limb.limb.others() == ()
    assert system.plant.num_constraints() == 0
    context = system.plant.GetMyContextFromRoot(system.create_context())
    frames = [system.plant.GetFrameByName(f"jaw_{x}") for x in "ab"]
    hand = system.plant.GetFrameByName("right_hand")
    y = [frame.CalcPose(context, hand).translation()[1] for frame in frames]
    np.testing.assert_allclose(y, [0.01 + 0.01, -0.01 + 0.02], atol=1e-15)
    assert result.energy_error < 1e-5


def test_a_tied_joint_of_the_chain_is_refused_before_the_build(model):
    tied = [p.replace("</joint>", MIMIC.format("waist", 0.5, 0.1) + "</joint>")
            if 'name="right_elbow"' in p else p for p in arm("right", -0.2)]  # fmt: skip
    with pytest.raises(
        InputError, match=r"right_elbow.*tied to waist.*time_step above 0"
    ) as caught:
        make_impact_diagram(striking(model(*TRUNK, *tied), "right_hand"))
    assert "\n" not in str(caught.value)


def test_a_locked_joint_locks_what_follows_it(model):
    tied = [p.replace("</joint>", MIMIC.format("waist", 0.5, 0.1) + "</joint>")
            if 'name="right_elbow"' in p else p for p in arm("right", -0.2)]  # fmt: skip
    case = striking(
        model(*TRUNK, *tied), "right_hand", locked=("right_elbow",), initial_deg={"waist": 0.0}
    )
    system = make_impact_diagram(case)
    assert system.limb.limb.joint_names() == ["right_shoulder"]


@pytest.mark.parametrize(
    "of", [("right_elbow", "right_shoulder"), ("right_shoulder", "right_elbow"), ("neck", "waist")]
)
def test_a_discrete_plant_follows_its_ties(model, of):
    """Posture, rates and holding torques of a mimic joint are those of the joint it follows."""
    follower, leader = of
    slides = [
        link("p1", 1.0),
        link("p2", 1.0),
        joint("x", "chest", "p1", kind="prismatic", axis="1 0 0", at="0 0 0"),
        joint("y", "p1", "p2", kind="prismatic", axis="0 1 0", at="0 -0.2 0.3"),
    ]
    tie = MIMIC.format(leader, -0.6, 0.2) + "</joint>"
    parts = [
        part.replace("</joint>", tie) if f'name="{follower}"' in part else part
        for part in (*arm("right", 0.0), *HEAD)
    ]
    parts = [
        part.replace('link="chest"', 'link="p2"') if "right_shoulder" in part else part
        for part in parts
    ]
    parts = [*slides, *parts]
    stroke = Stroke(speed=3.0, velocity_elevation_deg=90.0, rate_limits=False)
    case = striking(
        model(*TRUNK, *parts), "right_hand", time_step=5e-5, joint_torques="hold", stroke=stroke,
        gravity=(0.0, 0.0, -9.81),
    )  # fmt: skip
    system = make_impact_diagram(case)
    plant = system.plant
    context = plant.GetMyContextFromRoot(system.create_context())
    q = {n: plant.GetJointByName(n).get_angle(context) for n in of}
    v = {n: plant.GetJointByName(n).get_angular_rate(context) for n in of}
    assert q[follower] == pytest.approx(-0.6 * q[leader] + 0.2, abs=1e-9)
    assert v[follower] == pytest.approx(-0.6 * v[leader], abs=1e-9)
    speed = system.impact.racket.frame("gsc").CalcSpatialVelocityInWorld(context).translational()
    np.testing.assert_allclose(speed, [0.0, 0.0, 3.0], atol=1e-9)
    result = simulate(case, system)
    end = result.history
    names = list(end.joint.values)
    if follower in names:
        last = {n: float(end.joint_position.sel(joint=n)[-1]) for n in of}
        assert last[follower] == pytest.approx(-0.6 * last[leader] + 0.2, abs=2e-4)
    assert result.energy_error < 0.02  # as without the tie: a step of 5e-5 s


def test_held_torques_go_through_the_tie(model):
    """Static balance: what hold asks for keeps a tied arm where it is under gravity."""
    tied = [p.replace("</joint>", MIMIC.format("right_shoulder", 1.0, 0.0) + "</joint>")
            if 'name="right_elbow"' in p else p for p in arm("right", -0.2)]  # fmt: skip
    case = striking(
        model(*TRUNK, *tied), "right_hand", time_step=1e-4, joint_torques="carry",
        gravity=(0.0, 0.0, -9.81), stroke=Stroke(speed=0.0), after=1e-4, speed=0.5,
    )  # fmt: skip
    system = make_impact_diagram(case)
    root = system.create_context()
    values = system.diagram.GetOutputPort("joint_torques").Eval(root)
    torques = dict(zip(system.limb.limb.joint_names(), values, strict=True))
    assert torques["right_elbow"] == 0.0
    plant = system.plant
    context = plant.GetMyContextFromRoot(root)
    forces = MultibodyForces(plant)
    plant.CalcForceElementsContribution(context, forces)
    whole = plant.CalcInverseDynamics(context, np.zeros(plant.num_velocities()), forces)
    at = [plant.GetJointByName(n).velocity_start() for n in ("right_shoulder", "right_elbow")]
    assert torques["right_shoulder"] == pytest.approx(whole[at[0]] + whole[at[1]])


@pytest.mark.parametrize(
    ("kind", "leader"), [("fixed", "waist"), ("prismatic", "nobody"), ("prismatic", "right_grip")]
)
def test_elements_without_effect_are_passed_over(model, kind, leader):
    """As real files have them, with blanks and lost transmissions; Drake would stop at each."""
    finger = joint(
        "f", "right_hand", "finger", kind=kind, at="0 0 0.02", more=MIMIC.format(leader, 1.0, 0.0)
    )
    lost = '<transmission name="t"><type>simple</type><joint name="gone"/></transmission>'
    finger = finger.replace("joint=", "joint = ").replace("multiplier=", "multiplier =  ")
    path = model(*TRUNK, *arm("right", -0.2), link("finger", 0.1), finger, lost)
    result = simulate(striking(path, "right_hand"), history=False)
    assert "gone" in " ".join(result.warnings)
    assert "without effect, passed over: f" in " ".join(result.warnings)


LOOP = (
    '<drake:ball_constraint><drake:ball_constraint_body_A name="{}"/>'
    '<drake:ball_constraint_body_B name="{}"/><drake:ball_constraint_p_AP value="0 0 0"/>'
    '<drake:ball_constraint_p_BQ value="0 0 0"/></drake:ball_constraint>'
)


def test_a_loop_is_refused_where_the_plant_cannot_hold_it(model):
    path = model(*TRUNK, *arm("right", -0.2), *HEAD, LOOP.format("right_fore", "head"))
    with pytest.raises(InputError, match=r"ball constraint between right_fore, head.*time_step"):
        make_impact_diagram(striking(path, "right_hand"))
    with pytest.raises(InputError, match="closes a loop with the chain"):
        make_impact_diagram(striking(path, "right_hand", time_step=1e-4))


def test_a_loop_off_the_chain_is_a_discrete_plants_own(model):
    path = model(*TRUNK, *arm("right", -0.2), *arm("left", 0.2), LOOP.format("left_fore", "chest"))
    system = make_impact_diagram(striking(path, "right_hand", time_step=1e-4))
    assert system.plant.num_constraints() == 1


SDF = """<sdf version="1.9"><model name="m"><link name="pelvis"/>
<link name="upper"><pose>0 0 0.3 0 0 0</pose>{inertia}</link>
<link name="fore"><pose>0.3 0 0.3 0 0 0</pose>{inertia}</link>
<joint name="shoulder" type="revolute"><parent>pelvis</parent><child>upper</child>
<axis><xyz>0 1 0</xyz></axis></joint>
<joint name="elbow" type="revolute"><parent>upper</parent><child>fore</child>
<axis><xyz>0 1 0</xyz>{axis}</axis></joint>
<frame name="hand" attached_to="fore"><pose>0.3 0 0 0 0 0</pose></frame>{more}</model></sdf>"""
INERTIA = (
    "<inertial><pose>0.15 0 0 0 0 0</pose><mass>2</mass><inertia><ixx>0.01</ixx><iyy>0.02</iyy>"
    "<izz>0.02</izz></inertia></inertial>"
)
AXIS_MIMIC = (
    '<mimic joint="shoulder"><multiplier>-1.5</multiplier><offset>0.2</offset>'
    "<reference>0.1</reference></mimic>"
)


def tied_bodies(kind: str, more: str = "") -> str:
    tag = f"drake:{kind}_constraint"
    ends = f"<{tag}_body_A>pelvis</{tag}_body_A><{tag}_body_B>fore</{tag}_body_B>"
    places = f"<{tag}_p_AP>0 0 0</{tag}_p_AP><{tag}_p_BQ>0 0 0</{tag}_p_BQ>"
    numbers = "".join(f"<{tag}_{name}>{x}</{tag}_{name}>" for name, x in (
        ("distance", 0.4), ("stiffness", 1e5), ("damping", 10.0)))  # fmt: skip
    return f"<{tag}>{ends}{places}{numbers if kind == 'distance' else ''}</{tag}>{more}"


@pytest.mark.parametrize("kind", ["ball", "distance"])
@pytest.mark.parametrize("axis", ["", AXIS_MIMIC])
@pytest.mark.parametrize("time_step", [0.0, 1e-4])
def test_a_loop_of_an_sdf_is_refused(tmp_path, kind, axis, time_step):
    """Also beside a mimic joint, whose own constraint must not be taken for it."""
    path = tmp_path / "arm.sdf"
    path.write_text(SDF.format(inertia=INERTIA, axis=axis, more=tied_bodies(kind)))
    allowed = "closes a loop with the chain" if time_step else "continuous plant has no constr"
    told = f"{kind} constraint between pelvis, fore.*{allowed}|Unsupported SDFormat element"
    with pytest.raises(InputError, match=told):  # Drake 1.51 does not know all of them
        make_impact_diagram(striking(path, "hand", time_step=time_step))


@pytest.mark.parametrize("time_step", [0.0, 1e-4])
def test_a_constraint_of_a_urdf_that_drake_passes_over_is_refused(model, time_step):
    rod = LOOP.replace("ball", "weld").format("left_fore", "chest")
    path = model(*TRUNK, *arm("right", -0.2), *arm("left", 0.2), rod)
    allowed = "that this version of Drake reads" if time_step else "time_step above 0"
    told = f"weld constraint between left_fore, chest.*{allowed}"
    with pytest.raises(InputError, match=told):
        make_impact_diagram(striking(path, "right_hand", time_step=time_step))


def test_sdfs_own_mimic_holds_which_drake_passes_over(tmp_path):
    path = tmp_path / "arm.sdf"
    path.write_text(SDF.format(inertia=INERTIA, axis=AXIS_MIMIC, more=""))
    with pytest.raises(InputError, match=r"elbow.*tied to shoulder.*time_step above 0"):
        make_impact_diagram(striking(path, "hand"))
    case = striking(path, "hand", time_step=2e-5, stroke=Stroke(), after=0.003)
    end = simulate(case).history.isel(time=-1)
    q = {name: float(end.joint_position.sel(joint=name)) for name in ("shoulder", "elbow")}
    assert q["elbow"] == pytest.approx(-1.5 * (q["shoulder"] - 0.1) + 0.2, abs=1e-5)


@pytest.mark.parametrize("kind", ["coupler", "distance", "ball", "weld"])
@pytest.mark.parametrize("time_step", [0.0, 1e-4])
def test_constraints_of_a_users_plant_are_not_passed_over(kind, time_step):
    def mine(plant):
        Parser(plant).AddModelsFromString(
            robot(*TRUNK, *arm("right", -0.2), *arm("left", 0.2)), "urdf"
        )
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("pelvis"))
        a, b = (plant.GetBodyByName(f"{side}_fore") for side in ("right", "left"))
        here = np.zeros(3)
        if kind == "coupler":
            joints = (plant.GetJointByName(name) for name in ("right_elbow", "waist"))
            plant.AddCouplerConstraint(*joints, 1.0)
        elif kind == "distance":
            plant.AddDistanceConstraint(a, here, b, here, 0.4)
        elif kind == "ball":
            plant.AddBallConstraint(a, here, b, here)
        else:
            plant.AddWeldConstraint(a, RigidTransform(), b, RigidTransform())
        return plant.GetFrameByName("right_hand")

    case = dataclasses.replace(striking("unused", "hand"), time_step=time_step)
    with pytest.raises(InputError, match=r"1 constraints.*ties="):
        make_impact_diagram(case, limb=mine)


# --- rates ----------------------------------------------------------------------------------------


def test_rates_within_limits_are_found_where_they_exist():
    """Three joints in line, one direction asked for: the least squares that the limits allow."""
    J = np.zeros((6, 3))
    J[5] = [3.0, 2.0, 1.0]
    wanted = np.array([np.nan] * 5 + [10.0])
    free = find_joint_velocities(J, wanted)
    np.testing.assert_allclose(free.v, np.array([3.0, 2.0, 1.0]) * 10.0 / 14.0)
    limits = np.full(3, -1.0), np.array([1.0, np.inf, 4.0])
    found = find_joint_velocities(J, wanted, bounds=limits)
    # v1 at 1; of 7 = 2 v2 + v3 the least is (2.8, 1.4)
    np.testing.assert_allclose(found.v, [1.0, 2.8, 1.4], rtol=1e-12)
    assert found.met
    tight = np.full(3, -1.0), np.full(3, 1.0)
    np.testing.assert_array_equal(find_joint_velocities(J, wanted, bounds=tight).v, free.v)


@pytest.mark.parametrize("seed", range(20))
def test_bounded_rates_against_a_general_solver(seed):
    from scipy.optimize import minimize

    random = np.random.default_rng(seed)
    J = random.normal(size=(6, 8))
    truth = random.uniform(-1.0, 1.0, 8)
    weights = random.uniform(0.5, 3.0, 8)
    wanted = J @ truth
    wanted[3:] = np.nan
    bounds = -np.ones(8), np.ones(8)
    found = find_joint_velocities(J, wanted, weights=weights, bounds=bounds)
    assert found.met
    assert np.abs(found.v).max() <= 1.0
    best = minimize(
        lambda v: np.sum((weights * v) ** 2), truth, jac=lambda v: 2.0 * weights**2 * v,
        constraints={"type": "eq", "fun": lambda v: (J @ v - wanted)[:3], "jac": lambda v: J[:3]},
        bounds=[(-1.0, 1.0)] * 8, method="SLSQP", options={"ftol": 1e-14, "maxiter": 500},
    )  # fmt: skip
    assert np.sum((weights * found.v) ** 2) <= best.fun * (1.0 + 1e-6)


def slow(limit: str):
    return [
        p.replace('velocity="40"', f'velocity="{limit}"') for p in (*TRUNK, *arm("right", -0.2))
    ]


@pytest.mark.parametrize("limit", ["0", "0.0", "1e-6"])
def test_a_placeholder_is_no_rate_limit(model, limit):
    result = simulate(striking(model(*slow(limit)), "right_hand"), history=False)
    assert "taken as unknown: waist, right_shoulder, right_elbow" in " ".join(result.warnings)


def test_rate_limits_hold_until_they_are_switched_off(model):
    path = model(*slow("0.5"))
    with pytest.raises(InputError, match=r"no rates within the joints' ranges.*rate_limits: false"):
        make_impact_diagram(striking(path, "right_hand")).create_context()
    stroke = Stroke(speed=4.0, velocity_elevation_deg=90.0, rate_limits=False)
    assert simulate(striking(path, "right_hand", stroke=stroke)).energy_error < 1e-5


def test_a_trunk_with_a_second_arm_turns_less(model):
    """Rates in inverse proportion to what they move: w^2 = 31 / 23.5 at the waist."""
    waist = [p.replace('axis xyz="0 0 1"', 'axis xyz="0 1 0"') for p in TRUNK]
    level = [part.replace('xyz="0 -0.2 0.3"', 'xyz="0 -0.2 0"') for part in arm("right", -0.2)]
    both = model(*waist, *level, *arm("left", 0.2), *HEAD)
    one = model(*waist, *level, name="one.urdf")
    rates = []
    for path in (both, one):
        system = make_impact_diagram(striking(path, "right_hand"))
        context = system.plant.GetMyContextFromRoot(system.create_context())
        rates.append([system.plant.GetJointByName(n).get_angular_rate(context)
                      for n in ("waist", "right_elbow")])  # fmt: skip
    (waist_both, elbow_both), (waist_one, elbow_one) = rates
    share = (waist_both / elbow_both) / (waist_one / elbow_one)
    assert share == pytest.approx(23.5 / 31.0, rel=1e-6)


def test_find_limb_takes_ties():
    plant = MultibodyPlant(1e-4)
    Parser(plant).AddModelsFromString(robot(*TRUNK, *arm("right", -0.2), *HEAD), "urdf")
    neck, waist = plant.GetJointByName("neck"), plant.GetJointByName("waist")
    limb = find_limb(plant, plant.GetFrameByName("right_hand"), ties=[Tie(waist, neck, 2.0, 0.5)])
    (tie,) = limb.ties  # turned round: the chain leads
    assert (tie.leader.name(), tie.follower.name()) == ("waist", "neck")
    assert (tie.ratio, tie.offset) == (0.5, -0.25)


def test_mimic_joints_of_an_sdf(tmp_path):
    """follower = multiplier (leader - reference) + offset."""
    inertial = (
        "<inertial><mass>1</mass><inertia><ixx>.01</ixx><iyy>.01</iyy><izz>.01</izz>"
        "<ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial>"
    )

    def part(name: str, parent: str, axis: str, mimic: str = "") -> str:
        return (
            f"<link name='{name}'><pose relative_to='{parent}'>0.3 0 0 0 0 0</pose>"
            f"{inertial}</link>"
            f"<joint name='to_{name}' type='revolute'><parent>{parent}</parent>"
            f"<child>{name}</child><axis><xyz>{axis}</xyz>{mimic}</axis></joint>"
        )

    mimic = (
        "<mimic joint='to_a'><multiplier>2</multiplier><offset>0.1</offset>"
        "<reference>0.05</reference></mimic>"
    )
    (tmp_path / "arm.sdf").write_text(
        "<sdf version='1.11'><model name='arm'><link name='pelvis'/>"
        + part("hand", "pelvis", "0 1 0")
        + part("a", "hand", "0 0 1")
        + part("b", "hand", "0 0 1", mimic)
        + "</model></sdf>"
    )
    case = striking(tmp_path / "arm.sdf", "hand", initial_deg={"to_a": 20.0})
    system = make_impact_diagram(case)
    assert "to_a, to_b" in " ".join(system.limb.limb.notes)
    context = system.plant.CreateDefaultContext()
    (models,) = system.limb.limb.model_instances
    hand, b = (system.plant.GetFrameByName(name, models) for name in ("hand", "b"))
    yaw = b.CalcRotationMatrix(context, hand).ToRollPitchYaw().yaw_angle()
    assert yaw == pytest.approx(2.0 * (np.radians(20.0) - 0.05) + 0.1)


def test_what_a_mimic_element_leaves_out(tmp_path):
    """A multiplier of 1 and an offset of 0."""
    (tmp_path / "r.urdf").write_text(robot(joint("f", "a", "b", more='<mimic joint="l"/>')))
    (mimic,) = read_mimics(tmp_path / "r.urdf")
    assert (mimic.follower, mimic.leader, mimic.ratio, mimic.offset) == ("f", "l", 1.0, 0.0)
