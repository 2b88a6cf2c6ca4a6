"""The arm is the chain from the trunk to the hand: everything else in a model is not."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RevoluteJoint, SpatialInertia, UnitInertia

from drake_racket import InputError, add_limb_model, find_limb, make_impact_diagram, simulate
from drake_racket.limbs.chain import chain_shares
from drake_racket.limbs.inertia import massless_freedoms
from tests.limbs.arms import HEAD, HUMANOID, TRUNK, arm, joint, link, robot, striking


@pytest.fixture
def humanoid(tmp_path):
    path = tmp_path / "humanoid.urdf"
    path.write_text(HUMANOID)
    return path


@pytest.mark.parametrize("side", ["right", "left"])
def test_each_hand_has_its_own_chain(humanoid, side):
    plant = MultibodyPlant(0.0)
    limb = add_limb_model(plant, str(humanoid), f"{side}_hand", base="pelvis")
    assert limb.joint_names() == ["waist", f"{side}_shoulder", f"{side}_elbow"]
    other = {"right": "left", "left": "right"}[side]
    assert {j.name() for j in limb.others()} == {f"{other}_shoulder", f"{other}_elbow", "neck"}


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_the_order_of_branches_does_not_matter(tmp_path, order):
    parts = [arm("right", -0.2), arm("left", 0.2), HEAD]
    text = robot(*TRUNK, *(p for i in order for p in parts[i]))
    (tmp_path / "r.urdf").write_text(text)
    limb = add_limb_model(MultibodyPlant(0.0), tmp_path / "r.urdf", "left_hand", base="pelvis")
    assert limb.joint_names() == ["waist", "left_shoulder", "left_elbow"]


def test_a_joint_may_be_drawn_from_the_hand_to_the_trunk():
    plant = MultibodyPlant(0.0)
    box = SpatialInertia.SolidBoxWithMass(3.0, 0.6, 0.1, 0.1)
    upper, fore = plant.AddRigidBody("upper", box), plant.AddRigidBody("fore", box)
    plant.AddJoint(RevoluteJoint("elbow", fore.body_frame(), upper.body_frame(), [0, 1, 0]))
    plant.AddJoint(RevoluteJoint("shoulder", plant.world_frame(), upper.body_frame(), [0, 1, 0]))
    before = find_limb(plant, fore.body_frame())
    assert before.joint_names() == ["shoulder", "elbow"]
    plant.Finalize()
    assert find_limb(plant, fore.body_frame()) == before


def test_a_ring_is_no_arm():
    plant = MultibodyPlant(0.0)
    bodies = [plant.AddRigidBody(n, SpatialInertia.SolidBoxWithMass(1, 1, 1, 1)) for n in "abc"]
    for i in range(3):
        frames = bodies[i].body_frame(), bodies[(i + 1) % 3].body_frame()
        plant.AddJoint(RevoluteJoint(f"j{i}", *frames, [0, 1, 0]))
    with pytest.raises(InputError, match="ring"):
        find_limb(plant, bodies[0].body_frame())


def test_shares_of_mass():
    """The waist moves 20 + 4 + 2 x 3.5 kg, of which 23.5 kg are on the chain."""
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(HUMANOID, "urdf")
    limb = find_limb(plant, plant.GetFrameByName("left_hand"))
    shares = chain_shares(limb)
    assert shares["waist"] == pytest.approx(31.0 / 23.5)
    assert (shares["left_shoulder"], shares["left_elbow"]) == (1.0, 1.0)


@pytest.mark.parametrize(
    "grip", ["weld", "compliant", pytest.param("torsional", marks=pytest.mark.slow)]
)
def test_energy_counts_the_joints_off_the_chain(humanoid, grip):
    """The neck loses energy in its damper, and the left arm swings."""
    scenario = striking(
        humanoid, "right_hand", grip_kind=grip, gravity=(0.0, 0.0, -9.81), after=0.006
    )
    result = simulate(scenario)
    assert result.energy_error < 1e-5
    assert list(result.history.joint.values) == ["waist", "right_shoulder", "right_elbow"]


def test_locks_and_places_of_other_joints(humanoid):
    scenario = striking(
        humanoid,
        "right_hand",
        locked=("neck", "left_elbow"),
        initial_deg={"neck": 20.0, "left_shoulder": -30.0},
    )
    system = make_impact_diagram(scenario)
    plant = system.plant
    assert plant.GetJointByName("neck").num_velocities() == 0
    assert [j.name() for j in system.limb.limb.others()] == ["left_shoulder"]
    context = plant.GetMyContextFromRoot(system.create_context())
    shoulder = plant.GetJointByName("left_shoulder")
    assert np.degrees(shoulder.get_angle(context)) == pytest.approx(-30.0)
    (models,) = system.limb.limb.model_instances
    head, chest = (plant.GetFrameByName(name, models) for name in ("head", "chest"))
    R = head.CalcRotationMatrix(context, chest)
    assert np.degrees(R.ToRollPitchYaw().pitch_angle()) == pytest.approx(20.0)
    assert simulate(scenario, system).energy_error < 1e-5


def test_a_locked_arm_hits_as_one_whose_file_has_it_fixed(tmp_path, humanoid):
    fixed = HUMANOID.replace(
        '<joint name="neck" type="revolute">', '<joint name="neck" type="fixed">'
    )
    (tmp_path / "fixed.urdf").write_text(fixed)
    found = [
        simulate(striking(path, "right_hand", locked=locked), history=False).rebound_velocity
        for path, locked in ((humanoid, ("neck",)), (tmp_path / "fixed.urdf", ()))
    ]
    np.testing.assert_allclose(*found, rtol=1e-12)


def test_others_stands_for_all_of_them(humanoid):
    system = make_impact_diagram(striking(humanoid, "right_hand", locked=("others",)))
    assert system.limb.limb.others() == ()


def test_a_default_outside_the_range_is_clipped(tmp_path):
    text = HUMANOID.replace('lower="-2" upper="2"', 'lower="0.3" upper="2"')
    (tmp_path / "r.urdf").write_text(text)
    plant = MultibodyPlant(0.0)
    limb = add_limb_model(plant, tmp_path / "r.urdf", "right_hand", base="pelvis")
    assert {j.default_positions()[0] for j in limb.others()} == {0.3}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"locked": ("nek",)}, ("locked", "nek", "neck")),
        ({"initial_deg": {"neck": 500.0}}, ("initial_deg.neck", "-114.592 to 114.592 degrees")),
        ({"initial_deg": {"tail": 1.0}}, ("initial_deg.tail", "waist")),
        ({"locked": ("waist", "right_shoulder", "right_elbow")}, ("locked", "stays free")),
    ],
)
def test_refusals(humanoid, changes, words):
    with pytest.raises(InputError) as caught:
        make_impact_diagram(striking(humanoid, "right_hand", **changes))
    assert all(word in str(caught.value) for word in words), str(caught.value)


POINT = [
    link("skull", 3.0, com="0 0 0", moment=0.0),
    joint("nod", "chest", "skull", at="0 0 0.5"),
]
BARE_END = [
    link("lamp", 0.0),
    joint("tilt", "chest", "lamp", kind="prismatic", at="0 0 0.5"),
]
IN_LINE = [
    link("one", 0.0),
    link("two", 1.0),
    joint("first", "chest", "one", at="0 0 0.5"),
    joint("second", "one", "two", at="0 0 0"),
]


@pytest.mark.parametrize(
    ("branch", "names"),
    [(POINT, ("nod",)), (BARE_END, ("tilt",)), (IN_LINE, ("first", "second"))],
    ids=["point mass on its axis", "massless end", "two axes in line"],
)
def test_a_freedom_without_inertia_is_named_and_can_be_locked(tmp_path, branch, names):
    (tmp_path / "r.urdf").write_text(robot(*TRUNK, *arm("right", -0.2), *branch))
    with pytest.raises(InputError) as caught:
        simulate(striking(tmp_path / "r.urdf", "right_hand"))
    assert f"locked: [{', '.join(names)}]" in str(caught.value)
    locked = simulate(striking(tmp_path / "r.urdf", "right_hand", locked=names))
    assert locked.energy_error < 1e-5


def test_only_joints_of_the_limb_are_said_to_be_locked(tmp_path):
    """A massless hand that turns about the grip's own axis: the racket's joint is ours."""
    spin = joint("spin", "right_hand", "tip", axis="1 0 0", at="0 0 0")
    text = robot(*TRUNK, *arm("right", -0.2), link("tip", 0.0), spin)
    (tmp_path / "r.urdf").write_text(text)
    with pytest.raises(InputError) as caught:
        simulate(striking(tmp_path / "r.urdf", "tip", grip_kind="torsional"))
    assert "joints spin, racket_grip" in str(caught.value)
    assert str(caught.value).endswith("or locked: [spin]")


def in_line(share: float, scale: float = 1.0) -> MultibodyPlant:
    """Two joints about one axis; the link between has `share` of the outer one's moment."""
    plant = MultibodyPlant(0.0)
    outer = 0.1 * scale
    bodies = [
        plant.AddRigidBody(name, SpatialInertia(1.0, np.zeros(3), UnitInertia(I, I, I)))
        for name, I in (("link", outer * share), ("end", outer))
    ]
    frames = [plant.world_frame(), *(body.body_frame() for body in bodies)]
    for i, name in enumerate(("one", "two")):
        plant.AddJoint(RevoluteJoint(name, frames[i], frames[i + 1], [0, 0, 1]))
    plant.Finalize()
    return plant


@pytest.mark.parametrize("scale", [1.0, 1e-6, 1e6])
@pytest.mark.parametrize(
    ("share", "found"), [(1.0, []), (2e-9, []), (1e-11, ["one", "two"]), (0.0, ["one", "two"])]
)
def test_how_near_to_massless_counts(share, found, scale):
    """The scaled mass matrix has an eigenvalue of share / 2: below 1e-10 it counts, in any unit."""
    plant = in_line(share, scale)
    assert massless_freedoms(plant, plant.CreateDefaultContext()) == found


def test_a_joint_beside_massless_ones_is_not_named():
    plant = MultibodyPlant(0.0)
    heavy = SpatialInertia.SolidBoxWithMass(3.0, 0.6, 0.1, 0.1)
    light = SpatialInertia(1.0, np.zeros(3), UnitInertia(0.0, 0.0, 0.0))
    arm_body, tip = plant.AddRigidBody("arm", heavy), plant.AddRigidBody("tip", light)
    plant.AddJoint(RevoluteJoint("fine", plant.world_frame(), arm_body.body_frame(), [0, 1, 0]))
    plant.AddJoint(RevoluteJoint("spin", arm_body.body_frame(), tip.body_frame(), [0, 1, 0]))
    plant.Finalize()
    assert massless_freedoms(plant, plant.CreateDefaultContext()) == ["spin"]
