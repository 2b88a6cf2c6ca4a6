"""The SDF models as Drake's parser reads them, and racket and ball in a user's plant."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.parsing import PackageMap, Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import SpatialInertia

from drake_racket.io.errors import InputError
from drake_racket.io.shipped import add_to_package_map, sdf_directory
from drake_racket.limbs import shipped as shipped_sdf
from drake_racket.parameters.ball import load_ball
from drake_racket.parameters.racket import load_racket
from drake_racket.plant.ball import add_ball
from drake_racket.plant.racket import add_racket, find_racket

# Glynn, King & Mitchell (2011): mass, length, centre of mass from the end nearest the butt, moments
# about it: longitudinal (x), frontal (z), transverse (y); joint as read "by axis": stiffness and
# damping in plane (about z), out of plane (about y).
HANDLE = {
    "tour": (0.13350, 0.35600, 0.11365, 0.00004, 0.00173, 0.00172),
    "recreational": (0.10690, 0.35800, 0.19543, 0.00010, 0.00203, 0.00200),
}
HEAD = {
    "tour": (0.16050, 0.33000, 0.15032, 0.00137, 0.00465, 0.00331),
    "recreational": (0.13360, 0.33700, 0.18702, 0.00151, 0.00392, 0.00311),
}
JOINT = {"tour": (1650.0, 0.09, 910.0, 0.03), "recreational": (1800.0, 0.10, 1075.0, 0.04)}
GSC = {"tour": 0.155, "recreational": 0.151}
RACKETS = ("tour", "recreational")
SPACING = 0.0685


def parse(name: str) -> tuple[MultibodyPlant, list]:
    """A plant with one shipped model, parsed as a user would: strictly, by its package URL."""
    plant = MultibodyPlant(0.0)
    parser = Parser(plant)
    parser.SetStrictParsing()
    add_to_package_map(parser.package_map())
    return plant, parser.AddModels(url=f"package://drake_racket/{name}.sdf")


def parse_racket(racket: str):
    plant, (instance,) = parse(f"racket_{racket}")
    plant.Finalize()
    return plant, find_racket(plant, instance, load_racket(racket))


def inertia_about_com(body) -> np.ndarray:
    inertia = body.default_spatial_inertia()
    return inertia.Shift(inertia.get_com()).CalcRotationalInertia().CopyToFullMatrix3()


# --- the files ------------------------------------------------------------------------------------


def test_the_committed_files_are_what_the_writer_writes():
    models = shipped_sdf.shipped_models()
    committed = {path.name: path.read_bytes() for path in sdf_directory().glob("*.sdf")}
    assert {name: text.encode("utf-8") for name, text in models.items()} == committed


def test_the_writer_writes_those_files(tmp_path, monkeypatch):
    monkeypatch.setattr(shipped_sdf, "sdf_directory", lambda: tmp_path)
    shipped_sdf.write_shipped_models()
    written = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    expected = {name: text.encode() for name, text in shipped_sdf.shipped_models().items()}
    assert written == expected


def test_a_model_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    monkeypatch.setattr(shipped_sdf, "sdf_directory", lambda: tmp_path)
    monkeypatch.setattr(shipped_sdf, "shipped_models", lambda: {"a.sdf": "new\ud800"})
    (tmp_path / "a.sdf").write_text("old")
    with pytest.raises(UnicodeEncodeError):  # as good a failure as a full disk
        shipped_sdf.write_shipped_models()
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.sdf": "old"}


def test_package_map_by_function_twice_and_by_package_xml():
    package_map = PackageMap()
    add_to_package_map(package_map)
    add_to_package_map(package_map)  # a second call, by another module say, is no error
    by_file = PackageMap()
    by_file.AddPackageXml(str(sdf_directory() / "package.xml"))
    for found in (package_map, by_file):
        assert found.Contains("drake_racket")
        path = found.ResolveUrl("package://drake_racket/ball.sdf")
        assert path == str(sdf_directory() / "ball.sdf")


# --- what the parser makes of them ----------------------------------------------------------------


@pytest.mark.parametrize("racket", RACKETS)
@pytest.mark.parametrize("part", ["handle", "head"])
def test_bodies_of_the_frame_are_those_printed(racket, part):
    _, handles = parse_racket(racket)
    body = getattr(handles, part)
    mass, _, com, x, z, y = (HANDLE if part == "handle" else HEAD)[racket]
    inertia = body.default_spatial_inertia()
    assert body.name() == part
    assert inertia.get_mass() == pytest.approx(mass, abs=1e-12)
    assert inertia.get_com() == pytest.approx([com, 0.0, 0.0], abs=1e-12)
    assert inertia_about_com(body) == pytest.approx(np.diag([x, y, z]), abs=1e-12)


@pytest.mark.parametrize("racket", RACKETS)
def test_string_masses(racket):
    plant, handles = parse_racket(racket)
    assert len(handles.string_masses) == len(handles.string_joints) == 9
    context = plant.CreateDefaultContext()
    head = handles.head.body_frame()
    for i, body in enumerate(handles.string_masses):
        inertia = body.default_spatial_inertia()
        assert body.name() == f"string_{i + 1}"
        assert inertia.get_mass() == pytest.approx(0.0149 / 9.0, abs=1e-12)
        assert not np.any(inertia.get_com())
        assert not np.any(inertia_about_com(body))
        row, column = divmod(i, 3)
        place = plant.CalcRelativeTransform(context, head, body.body_frame())
        expected = [GSC[racket] + (1 - row) * SPACING, (1 - column) * SPACING, 0.0]
        assert place.translation() == pytest.approx(expected, abs=1e-15)
        assert place.rotation().IsExactlyIdentity()


@pytest.mark.parametrize("racket", RACKETS)
def test_the_link_between_the_joints_is_massless(racket):
    plant, handles = parse_racket(racket)
    body = plant.GetBodyByName("throat_link", handles.model_instance)
    inertia = body.default_spatial_inertia()
    # an inertia left out of the SDF would silently be 1 kg and 1 kg m^2
    assert inertia.get_mass() == 0.0
    assert not np.any(inertia.CopyToFullMatrix6())


def test_ball():
    plant, (instance,) = parse("ball")
    plant.Finalize()
    (index,) = plant.GetBodyIndices(instance)
    body = plant.get_body(index)
    inertia = body.default_spatial_inertia()
    assert inertia.get_mass() == pytest.approx(0.059, abs=1e-12)
    assert not np.any(inertia.get_com())
    shell = 2.0 / 3.0 * 0.059 * (0.0685 / 2.0) ** 2
    assert inertia_about_com(body) == pytest.approx(shell * np.eye(3), abs=1e-12)
    assert plant.num_actuators() == 0


@pytest.mark.parametrize("racket", RACKETS)
def test_total_mass_and_centre_of_mass(racket):
    plant, handles = parse_racket(racket)
    context = plant.CreateDefaultContext()
    m1, l1, c1, *_ = HANDLE[racket]
    m2, _, c2, *_ = HEAD[racket]
    total = m1 + m2 + 0.0149
    com = (m1 * c1 + m2 * (l1 + c2) + 0.0149 * (l1 + GSC[racket])) / total
    assert plant.CalcTotalMass(context) == pytest.approx(total, abs=1e-12)
    found = plant.CalcCenterOfMassPositionInWorld(context, [handles.model_instance])
    assert found == pytest.approx([com, 0.0, 0.0], abs=1e-12)


@pytest.mark.parametrize("racket", RACKETS)
def test_joints_turn_about_z_then_y(racket):
    plant, handles = parse_racket(racket)
    first, second = handles.in_plane, handles.out_of_plane
    assert [first.parent_body().name(), first.child_body().name()] == ["handle", "throat_link"]
    assert [second.parent_body().name(), second.child_body().name()] == ["throat_link", "head"]
    assert first.type_name() == second.type_name() == "revolute"
    assert list(first.revolute_axis()) == [0.0, 0.0, 1.0]
    assert list(second.revolute_axis()) == [0.0, 1.0, 0.0]
    for i, joint in enumerate(handles.string_joints):
        assert joint.name() == f"string_joint_{i + 1}"
        assert joint.type_name() == "prismatic"
        assert list(joint.translation_axis()) == [0.0, 0.0, 1.0]
        assert joint.parent_body().name() == "head"
        assert joint.child_body() is handles.string_masses[i]
        assert joint.default_damping() == 0.0
    # the order of the two rotations, seen from the head: first z, then y
    context = plant.CreateDefaultContext()
    first.set_angle(context, 0.3)
    second.set_angle(context, -0.2)
    pose = plant.CalcRelativeTransform(
        context, handles.handle.body_frame(), handles.head.body_frame()
    )
    expected = RotationMatrix.MakeZRotation(0.3) @ RotationMatrix.MakeYRotation(-0.2)
    assert pose.rotation().matrix() == pytest.approx(expected.matrix(), abs=1e-15)
    assert pose.translation() == pytest.approx([HANDLE[racket][1], 0.0, 0.0], abs=1e-15)


@pytest.mark.parametrize("racket", RACKETS)
def test_no_actuators_and_only_the_expected_coordinates(racket):
    plant, _ = parse_racket(racket)
    assert plant.num_actuators() == 0
    assert plant.num_velocities() == 6 + 2 + 9
    assert plant.num_positions() == 7 + 2 + 9


@pytest.mark.parametrize("racket", RACKETS)
def test_bushing(racket):
    plant, handles = parse_racket(racket)
    bushing = handles.bushing
    context = plant.CreateDefaultContext()
    k_z, c_z, k_y, c_y = JOINT[racket]
    assert list(bushing.GetTorqueStiffnessConstants(context)) == [0.0, k_y, k_z]
    assert list(bushing.GetTorqueDampingConstants(context)) == [0.0, c_y, c_z]
    assert not np.any(bushing.GetForceStiffnessConstants(context))
    assert not np.any(bushing.GetForceDampingConstants(context))
    assert bushing.frameA().name() == "throat_handle"
    assert bushing.frameC().name() == "throat"


@pytest.mark.parametrize("racket", RACKETS)
def test_bushing_is_the_two_joint_torques_alone(racket):
    """tau = -k theta - c theta_dot on each joint, at large angles too."""
    plant, handles = parse_racket(racket)
    context = plant.CreateDefaultContext()
    k_z, c_z, k_y, c_y = JOINT[racket]
    angles, rates = (0.4, -0.3), (2.0, 5.0)
    for joint, angle, rate in zip(
        (handles.in_plane, handles.out_of_plane), angles, rates, strict=True
    ):
        joint.set_angle(context, angle)
        joint.set_angular_rate(context, rate)
    # M vdot + C v - tau_g = tau_bushing: taking the bushing out changes M vdot by its forces
    plain = context.Clone()
    handles.bushing.SetTorqueStiffnessConstants(plain, [0.0, 0.0, 0.0])
    handles.bushing.SetTorqueDampingConstants(plain, [0.0, 0.0, 0.0])
    mass_matrix = plant.CalcMassMatrix(context)
    tau = mass_matrix @ (
        plant.EvalTimeDerivatives(context).get_generalized_velocity().CopyToVector()
        - plant.EvalTimeDerivatives(plain).get_generalized_velocity().CopyToVector()
    )
    expected = np.zeros(plant.num_velocities())
    expected[handles.in_plane.velocity_start()] = -k_z * angles[0] - c_z * rates[0]
    expected[handles.out_of_plane.velocity_start()] = -k_y * angles[1] - c_y * rates[1]
    assert tau == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize("racket", RACKETS)
def test_named_frames_are_at_their_places(racket):
    plant, handles = parse_racket(racket)
    context = plant.CreateDefaultContext()
    throat = HANDLE[racket][1]
    expected = {
        "butt": ("handle", 0.0),
        "grip": ("handle", 0.1016),
        "accelerometer": ("handle", throat / 2.0),
        "throat": ("head", throat),
        "gsc": ("head", throat + GSC[racket]),
        "tip": ("head", throat + HEAD[racket][1]),
    }
    for name, (body, x) in expected.items():
        frame = handles.frame(name)
        assert frame.body().name() == body
        place = plant.CalcRelativeTransform(context, handles.handle.body_frame(), frame)
        assert place.translation() == pytest.approx([x, 0.0, 0.0], abs=1e-15), name
        assert place.rotation().IsExactlyIdentity()
    # point 5 is the geometric string-bed centre
    assert handles.parameters.point(5) == pytest.approx((throat + GSC[racket], 0.0, 0.0), abs=1e-15)


@pytest.mark.parametrize("racket", RACKETS)
def test_the_file_and_add_racket_give_one_model(racket):
    plant, from_file = parse_racket(racket)
    other = MultibodyPlant(0.0)
    added = add_racket(other, load_racket(racket))
    other.Finalize()
    names = [b.name() for b in from_file.bodies()]
    assert [b.name() for b in added.bodies()] == names
    assert len(names) == 12
    for a, b in zip(from_file.bodies(), added.bodies(), strict=True):
        first, second = (x.default_spatial_inertia().CopyToFullMatrix6() for x in (a, b))
        assert np.array_equal(first, second)
    contexts = plant.CreateDefaultContext(), other.CreateDefaultContext()
    assert np.array_equal(plant.CalcMassMatrix(contexts[0]), other.CalcMassMatrix(contexts[1]))


# --- in a user's plant ----------------------------------------------------------------------------


def test_unstrung_racket_is_the_bare_frame():
    plant = MultibodyPlant(0.0)
    racket = add_racket(plant, load_racket("tour"), strung=False)
    plant.Finalize()
    assert racket.string_masses == ()
    assert racket.string_joints == ()
    assert [b.name() for b in racket.bodies()] == ["handle", "throat_link", "head"]
    total = HANDLE["tour"][0] + HEAD["tour"][0]
    assert plant.CalcTotalMass(plant.CreateDefaultContext()) == pytest.approx(total, abs=1e-12)
    assert find_racket(plant, racket.model_instance, racket.parameters).string_masses == ()


def test_two_rackets_and_two_balls_in_one_plant():
    plant = MultibodyPlant(0.0)
    rackets = [
        add_racket(plant, load_racket(racket), name=f"racket_of_{racket}") for racket in RACKETS
    ]
    balls = [add_ball(plant, load_ball(), name=f"ball_{i}") for i in range(2)]
    plant.Finalize()
    context = plant.CreateDefaultContext()
    for racket, name in zip(rackets, RACKETS, strict=True):
        mass = HANDLE[name][0] + HEAD[name][0] + 0.0149
        assert plant.CalcTotalMass(context, [racket.model_instance]) == pytest.approx(mass)
        # each finds its own bushing, not the first one in the plant
        k_z, _, k_y, _ = JOINT[name]
        stiffness = racket.bushing.GetTorqueStiffnessConstants(context)
        assert list(stiffness) == [0.0, k_y, k_z]
        again = find_racket(plant, racket.model_instance, racket.parameters)
        assert again.bushing is racket.bushing
        assert racket.frame("gsc").body() is racket.head
    assert balls[0].body.index() != balls[1].body.index()
    assert plant.num_velocities() == 2 * 17 + 2 * 6


@pytest.mark.parametrize("held_at", ["butt", "grip", "accelerometer", "throat", "gsc", "tip"])
def test_a_held_racket_hangs_where_it_is_held(held_at):
    plant = MultibodyPlant(0.0)
    pose = RigidTransform(RollPitchYaw(0.1, -0.4, 0.7), [1.0, 2.0, 3.0])
    racket = add_racket(
        plant, load_racket(), parent=plant.world_frame(), held_at=held_at, X_PF=pose
    )
    plant.Finalize()
    context = plant.CreateDefaultContext()
    found = racket.frame(held_at).CalcPoseInWorld(context)
    assert found.IsNearlyEqualTo(pose, 1e-14)
    assert plant.num_velocities() == 2 + 9


def test_a_finalized_plant_is_refused():
    plant = MultibodyPlant(0.0)
    plant.Finalize()
    with pytest.raises(InputError, match=r"^add_racket: plant: got 'finalized'; allowed: a plant"):
        add_racket(plant, load_racket())
    with pytest.raises(InputError, match=r"^add_ball: plant: got 'finalized'; allowed: a plant"):
        add_ball(plant, load_ball())


def test_taken_names_are_refused():
    plant = MultibodyPlant(0.0)
    add_racket(plant, load_racket())
    add_ball(plant, load_ball())
    with pytest.raises(InputError, match=r"^add_racket: name: got 'racket'; allowed: a name that"):
        add_racket(plant, load_racket())
    with pytest.raises(InputError, match=r"^add_ball: name: got 'ball'; allowed: a name that"):
        add_ball(plant, load_ball())
    # neither failed call has left a part behind
    assert plant.num_model_instances() == 4  # world, default, racket, ball


@pytest.mark.parametrize("name", ["", "my racket", "1st", "a::b", 'x"y', "<racket>", "schläger"])
def test_names_that_are_no_names_are_refused(name):
    plant = MultibodyPlant(0.0)
    for call in (
        lambda: add_racket(plant, load_racket(), name=name),
        lambda: add_ball(plant, load_ball(), name=name),
    ):
        with pytest.raises(InputError, match="letters, digits and _") as caught:
            call()
        assert str(caught.value).isprintable()


def test_unknown_frames_are_refused():
    plant = MultibodyPlant(0.0)
    with pytest.raises(
        InputError, match=r"^add_racket: held_at: got 'palm'; allowed: butt, grip, acc"
    ):
        add_racket(plant, load_racket(), parent=plant.world_frame(), held_at="palm")
    assert not plant.HasModelInstanceNamed("racket")


def test_find_racket_refuses_other_models():
    plant, (ball,) = parse("ball")
    with pytest.raises(InputError, match=r"^find_racket: instance: got 'ball'; allowed: a racket"):
        find_racket(plant, ball, load_racket())
    # the right links without a bushing are no racket either
    bare = '<sdf version="1.9"><model name="sticks"><link name="handle"/><link name="head">'
    parser = Parser(plant)
    (sticks,) = parser.AddModelsFromString(
        bare + '</link><joint name="in_plane" type="revolute"><parent>handle</parent>'
        '<child>head</child><axis><xyz>0 0 1</xyz></axis></joint><link name="more"/>'
        '<joint name="out_of_plane" type="revolute"><parent>head</parent><child>more</child>'
        "<axis><xyz>0 1 0</xyz></axis></joint></model></sdf>",
        "sdf",
    )
    with pytest.raises(InputError, match=r"got 'sticks'; allowed: a model with a bushing"):
        find_racket(plant, sticks, load_racket())


@pytest.mark.parametrize("body", ["head", "handle"])
def test_a_model_with_half_a_racket_is_none(body):
    plant = MultibodyPlant(0.0)
    instance = plant.AddModelInstance("half")
    plant.AddRigidBody(body, instance, SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    plant.Finalize()
    with pytest.raises(InputError, match="find_racket: instance: got 'half'"):
        find_racket(plant, instance, load_racket())
