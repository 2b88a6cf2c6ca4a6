"""Files of limbs: where things are, what Drake says, and arms of MuJoCo and OpenSim by key."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.systems.framework import DiagramBuilder

from drake_racket import InputError, Stroke, add_limb_model, find_limb, resolve, simulate
from drake_racket.sweep import make_sweep, run_sweep
from tests.limbs.arms import TRUNK, arm, joint, link, robot, striking

ARM = robot(*TRUNK, *arm("right", -0.2))
DIRECTIVES = """directives:
- add_model: {{name: arm, file: {file}}}
- add_weld: {{parent: world, child: arm::pelvis}}
- add_frame: {{name: grip, X_PF: {{base_frame: arm::right_hand}}}}
"""


def load(path, hand="right_hand", **changes):
    return add_limb_model(MultibodyPlant(0.0), path, hand, **changes)


@pytest.mark.parametrize("written", ["arm.urdf", "file:arm.urdf", "models/../arm.urdf", "{whole}"])
def test_directives_find_files_beside_them(tmp_path, monkeypatch, written):
    (tmp_path / "models").mkdir()
    (tmp_path / "arm.urdf").write_text(ARM)
    file = written.format(whole=(tmp_path / "arm.urdf").as_uri())
    (tmp_path / "arm.dmd.yaml").write_text(DIRECTIVES.format(file=file))
    monkeypatch.chdir("/")
    assert load(tmp_path / "arm.dmd.yaml", "grip").joint_names()[-1] == "right_elbow"


def test_directives_within_directives(tmp_path):
    (tmp_path / "arm.urdf").write_text(ARM)
    (tmp_path / "inner.dmd.yaml").write_text(DIRECTIVES.format(file="arm.urdf"))
    (tmp_path / "outer.dmd.yaml").write_text(
        "directives:\n- add_directives: {file: inner.dmd.yaml}\n"
    )
    assert load(str(tmp_path / "outer.dmd.yaml"), "grip").joint_names()[0] == "waist"


def test_mimic_joints_behind_directives_are_seen(tmp_path):
    tied = joint("extra", "right_hand", "finger", more='<mimic joint="waist"/>')
    text = robot(*TRUNK, *arm("right", -0.2), link("finger", 0.1), tied)
    (tmp_path / "arm.urdf").write_text(text)
    (tmp_path / "arm.dmd.yaml").write_text(DIRECTIVES.format(file="arm.urdf"))
    with pytest.raises(InputError, match=r"joint extra: got 'tied to waist"):
        load(tmp_path / "arm.dmd.yaml", "grip")


@pytest.mark.parametrize("name", ["ARM.URDF", "Arm.Urdf"])
def test_suffixes_in_capitals(tmp_path, name):
    (tmp_path / name).write_text(ARM)
    assert load(tmp_path / name).joint_names()[0] == "waist"


def test_packages(tmp_path):
    """By key, or found above the file by its folder or its package.xml."""
    (tmp_path / "away").mkdir()
    (tmp_path / "away" / "arm.urdf").write_text(ARM)
    text = DIRECTIVES.format(file="package://mine/arm.urdf")
    (tmp_path / "arm.dmd.yaml").write_text(text)
    with pytest.raises(InputError, match=r"packages: \{mine: FOLDER\}") as caught:
        load(tmp_path / "arm.dmd.yaml", "grip")
    assert "\n" not in str(caught.value)
    limb = load(tmp_path / "arm.dmd.yaml", "grip", packages={"mine": str(tmp_path / "away")})
    assert limb.joint_names()[0] == "waist"
    with pytest.raises(InputError, match=r"packages\.mine"):
        load(tmp_path / "arm.dmd.yaml", "grip", packages={"mine": tmp_path / "nowhere"})
    inside = tmp_path / "some_checkout" / "config"
    inside.mkdir(parents=True)
    (inside.parent / "package.xml").write_text("<package><name>mine</name></package>")
    (inside.parent / "arm.urdf").write_text(ARM)
    (inside / "arm.dmd.yaml").write_text(text)
    assert load(inside / "arm.dmd.yaml", "grip").joint_names()[0] == "waist"


def test_a_package_in_a_scenario(tmp_path):
    (tmp_path / "arm.urdf").write_text(ARM)
    (tmp_path / "arm.dmd.yaml").write_text(DIRECTIVES.format(file="package://mine/arm.urdf"))
    case = striking(tmp_path / "arm.dmd.yaml", "grip", base="", packages={"mine": str(tmp_path)})
    assert simulate(case, history=False).touches == 1


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (ARM[:-9], ("well-formed XML",)),
        (
            ARM.replace('child link="right_fore"', 'child link="nowhere"'),
            ("right_elbow", "nowhere"),
        ),
        (ARM.replace("</robot>", link("chest") + "</robot>"), ("two", "chest")),
        (ARM.replace('lower="-2"', 'lower="low"'), ("a model that Drake can parse",)),
    ],
)
def test_drakes_messages_in_words(tmp_path, text, words):
    (tmp_path / "arm.urdf").write_text(text)
    with pytest.raises(InputError) as caught:
        load(tmp_path / "arm.urdf")
    message = str(caught.value)
    assert all(word in message for word in ("limb: model", "arm.urdf", *words)), message
    assert "\n" not in message


def test_meshes_beside_the_file_are_seen(tmp_path):
    """In a plant that has a SceneGraph: relative to the file, as Drake has it."""
    (tmp_path / "part.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n")
    shape = '<visual><geometry><mesh filename="part.obj"/></geometry></visual>'
    text = ARM.replace('<link name="right_fore">', f'<link name="right_fore">{shape}')
    (tmp_path / "arm.urdf").write_text(text)
    plant, scene = AddMultibodyPlantSceneGraph(DiagramBuilder(), 0.0)
    limb = add_limb_model(plant, tmp_path / "arm.urdf", "right_hand", base="pelvis")
    assert scene.model_inspector().num_geometries() == 1
    assert limb.notes == ()


def test_drakes_warnings_are_one_note(tmp_path, caplog):
    """Not a line on the console for each element."""
    odd = '<dynamics damping="0.1" friction="0.2"/>'
    text = ARM.replace("</joint>", odd + "</joint>").replace(
        "</robot>", "<transmission><type>odd</type><joint name='waist'/></transmission></robot>"
    )
    (tmp_path / "arm.urdf").write_text(text)
    limb = load(tmp_path / "arm.urdf")
    (note,) = limb.notes
    assert note.startswith("Drake warns of arm.urdf: ")
    assert "3 x A joint has specified a non-zero value for the 'friction'" in note
    assert not caplog.records


def test_folders_and_names_that_are_not_ascii(tmp_path):
    place = tmp_path / "Schläger 世界"
    place.mkdir()
    (place / "Arm Ü.urdf").write_text(ARM, encoding="utf-8")
    (place / "arm.dmd.yaml").write_text(DIRECTIVES.format(file="Arm Ü.urdf"), encoding="utf-8")
    assert load(place / "arm.dmd.yaml", "grip").joint_names()[0] == "waist"


# --- MuJoCo by key --------------------------------------------------------------------------------

MUJOCO = """<mujoco>
  <option gravity="0 0 -3">{flags}</option>
  <worldbody><body name="post" pos="0 0 1">
    <geom type="box" size=".1 .1 .1" mass="5"/>
    <body name="upper" pos="0 0 .2">
      <joint name="shoulder" axis="0 1 0" range="-90 90" damping="0.3" stiffness="20"/>
      <geom type="capsule" fromto="0 0 0 .3 0 0" size=".03" mass="2"/>
      <body name="fore" pos=".3 0 0">
        <joint name="elbow" axis="0 0 1" range="-10 120"/>
        <geom type="capsule" fromto="0 0 0 .3 0 0" size=".03" mass="1"/>
        <site name="palm" pos=".3 0 0"/>
        <body name="thumb" pos=".3 0 .05"><joint name="thumb" axis="1 0 0"/>
          <geom type="sphere" size=".03" pos="0 0.03 0" mass=".1"/></body>
      </body>
    </body>
    <body name="lid" pos="0 0 .4"><joint name="lid" axis="1 0 0" range="5 50"/>
      <geom type="box" size=".1 .1 .1" pos="0 .2 0" mass="1"/></body>
  </body></worldbody>
  {more}
  <keyframe><key name="ready" qpos="0.2 0.5 0 0.3"/></keyframe>
</mujoco>"""


@pytest.fixture
def mjcf(tmp_path):
    pytest.importorskip("mujoco")

    def write(flags="", more="", name="arm.xml"):
        (tmp_path / name).write_text(MUJOCO.format(flags=flags, more=more))
        return tmp_path / name

    return write


def slow(path, hand="palm", **changes):
    stroke = Stroke(speed=1.0, velocity_elevation_deg=90.0)
    return striking(path, hand, **({"base": "", "stroke": stroke} | changes))


@pytest.mark.parametrize(
    "grip", ["weld", *(pytest.param(g, marks=pytest.mark.slow) for g in ("torsional", "compliant"))]
)
def test_a_mujoco_arm_by_key(mjcf, grip):
    result = simulate(slow(mjcf(), grip_kind=grip))
    assert list(result.history.joint.values) == ["shoulder", "elbow"]
    assert result.energy_error < 1e-5


def test_its_place_is_the_bases(mjcf):
    plant = MultibodyPlant(0.0)
    limb = add_limb_model(plant, mjcf(), "palm", base="upper", X_WB=RigidTransform([1.0, 2.0, 3.0]))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    place = plant.GetFrameByName("upper").CalcPoseInWorld(context).translation()
    np.testing.assert_allclose(place, [1.0, 2.0, 3.0], atol=1e-15)
    assert {j.name() for j in limb.others()} == {"thumb"}


def test_a_mujoco_arm_in_a_sweep_and_its_lock(mjcf):
    base = dataclasses.replace(slow(mjcf(), locked=("lid",)), audit=False, after=0.009)
    dataset = run_sweep(
        make_sweep(base, {"speed": {"values": [18.0, 22.0], "unit": "m/s"}}, ["restitution"])
    )
    assert np.isfinite(dataset.restitution).all()


def test_a_keyframe_is_where_joints_start(mjcf):
    plant = MultibodyPlant(0.0)
    limb = add_limb_model(plant, mjcf(), "palm", keyframe="ready")
    at = {j.name(): j.default_positions()[0] for j in (*limb.joints, *limb.others())}
    assert at == pytest.approx({"shoulder": 0.2, "elbow": 0.5, "thumb": 0.0, "lid": 0.3})
    with pytest.raises(InputError, match=r"keyframe.*ready"):
        add_limb_model(MultibodyPlant(0.0), mjcf(), "palm", keyframe="away")
    with pytest.raises(InputError, match=r"keyframe.*MuJoCo"):
        add_limb_model(MultibodyPlant(0.0), "no.urdf", "palm", keyframe="ready")


@pytest.mark.parametrize(
    ("flag", "what"), [("limit", "limits"), ("damper", "damping"), ("spring", "stiffness")]
)
def test_option_flags_count(mjcf, flag, what):
    from drake_racket.limbs import import_mujoco

    found = []
    for flags in ("", f'<flag {flag}="disable"/>'):
        arm = import_mujoco(MultibodyPlant(0.0), mjcf(flags), root="upper", hand="palm")
        found.append(getattr(arm.tree.joints()[0], what))
    assert found[0]
    assert not found[1]
    assert arm.left_out.names("switched off by the model") == (flag,)


def test_gravity_of_a_model(mjcf):
    from drake_racket.limbs import import_mujoco

    for flags, z in (("", -3.0), ('<flag gravity="disable"/>', 0.0)):
        arm = import_mujoco(MultibodyPlant(0.0), mjcf(flags), hand="palm")
        np.testing.assert_array_equal(arm.gravity, [0.0, 0.0, z])


def test_a_mujoco_joint_starts_within_its_range(mjcf):
    with pytest.raises(InputError, match=r"initial_deg.elbow.*allowed: the joint's range"):
        load(mjcf(), "palm", initial_deg={"elbow": 400.0})
    limb = load(mjcf(), "palm", initial_deg={"thumb": 400.0})  # which has no range
    (thumb,) = [joint for joint in limb.others() if joint.name() == "thumb"]
    assert thumb.default_positions()[0] == pytest.approx(np.radians(400.0))


TIE = "<equality>{}</equality>"


def test_equalities_count_or_are_refused(mjcf):
    connect = TIE.format('<connect body1="fore" body2="lid" anchor="0 0 0"/>')
    with pytest.raises(InputError, match=r"it ties fore and lid.*lock.*elbow") as caught:
        load(mjcf(more=connect), "palm")
    assert "\n" not in str(caught.value)
    off = '<flag equality="disable"/>'
    assert load(mjcf(off, connect), "palm").joint_names() == ["shoulder", "elbow"]
    inactive = connect.replace("anchor", 'active="false" anchor')
    assert load(mjcf(more=inactive), "palm").joint_names() == ["shoulder", "elbow"]
    fixed = TIE.format('<weld body1="post" body2="world"/>')
    assert load(mjcf(more=fixed), "palm").joint_names() == ["shoulder", "elbow"]
    tied = TIE.format('<joint joint1="thumb" joint2="elbow" polycoef="0.1 0.5 0 0 0"/>')
    limb = load(mjcf(more=tied), "palm")
    assert "joint couplings, tied joint is locked: thumb" in limb.notes
    assert {j.name() for j in limb.others()} == {"lid"}


TENDONS = (
    '<tendon><fixed name="cord"><joint joint="shoulder" coef="1"/><joint joint="elbow" coef="1"/>'
    '</fixed><fixed name="string"><joint joint="lid" coef="1"/></fixed></tendon>'
)


@pytest.mark.parametrize(
    ("tie", "told"),
    [
        ('<weld body1="fore" body2="post"/>', r"ties fore and post.*elbow, shoulder"),
        ('<connect body1="lid" body2="upper" anchor="0 0 0"/>', r"ties lid and upper.*lid"),
        ('<tendon tendon1="cord"/>', r"ties tendon cord.*elbow, shoulder"),
        ('<tendon tendon1="cord" tendon2="string"/>', r"cord and tendon string.*elbow, lid"),
    ],
)
def test_an_equality_of_another_kind_is_refused_until_nothing_moves_it(mjcf, tie, told):
    path = mjcf(more=TENDONS + TIE.format(tie))
    with pytest.raises(InputError, match=told):
        load(path, "palm")
    if "elbow" not in told:
        assert load(path, "palm", locked=("lid", "shoulder")).joint_names() == ["elbow"]
    elif "lid" not in told:
        free = load(path, "thumb", locked=("shoulder", "elbow"))
        assert free.joint_names() == ["thumb"]


# --- OpenSim --------------------------------------------------------------------------------------


def opensim_arm(**changes: str) -> str:
    """An arm as OpenSim 4 writes it: offset frames, three oblique axes, a spline, a coupler."""

    def frame(name: str, parent: str, place: str, turn: str = "0 0 0") -> str:
        return (
            f'<PhysicalOffsetFrame name="{name}"><socket_parent>{parent}</socket_parent>'
            f"<translation>{place}</translation><orientation>{turn}</orientation>"
            "</PhysicalOffsetFrame>"
        )

    def coordinate(name: str, low: float, high: float, start: float, more: str = "") -> str:
        return (
            f'<Coordinate name="{name}"><default_value>{start}</default_value>'
            f"<range>{low} {high}</range>{more}</Coordinate>"
        )

    def axis(which: str, direction: str, of: str, function: str) -> str:
        return (
            f'<TransformAxis name="{which}"><coordinates>{of}</coordinates>'
            f"<axis>{direction}</axis>{function}</TransformAxis>"
        )

    line = '<LinearFunction name="function"><coefficients> {} {}</coefficients></LinearFunction>'
    fixed = '<Constant name="function"><value>{}</value></Constant>'
    spline = '<SimmSpline name="function"><x>-0.5 0 1 2.5</x><y>0 0.01 0.015 0.03</y></SimmSpline>'
    shoulder = (
        axis("rotation1", "0.1 0.9 0.2", "turn", line.format(1, 0))
        + axis("rotation2", "-0.998 0.0023 0.06", "lift", line.format(1, 0.2))
        + axis("rotation3", "0.0048 0.99 -0.08", "roll", line.format(-1, 0))
        + axis("translation1", "1 0 0", "", fixed.format(0.03))
        + axis("translation2", "0 1 0", "", fixed.format(0.0))
        + axis("translation3", "0 0 1", "", fixed.format(-0.02))
    )
    moved = changes.get("function", fixed.format(0.0))
    elbow = (
        axis("rotation1", "0.05 0.04 0.998", "bend", line.format(1, 0))
        + axis("rotation2", "0 1 0", "", fixed.format(0.1))
        + axis("rotation3", "1 0 0", "", fixed.format(0.0))
        + axis("translation1", "1 0 0", changes.get("of", ""), moved)
        + axis("translation2", "0 1 0", "", fixed.format(0.0))
        + axis("translation3", "0 0 1", "", fixed.format(0.0))
    ).replace("SPLINE", spline)

    def body(name: str, mass: float, com: str, moments: str) -> str:
        return (
            f'<Body name="{name}"><mass>{mass}</mass><mass_center>{com}</mass_center>'
            f"<inertia>{moments}</inertia></Body>"
        )

    def custom(name: str, ends: str, coordinates: str, transform: str, at: str) -> str:
        parent, child = ends.split()
        return (
            f'<CustomJoint name="{name}"><socket_parent_frame>{name}_p</socket_parent_frame>'
            f"<socket_child_frame>{name}_c</socket_child_frame>"
            f"<coordinates>{coordinates}</coordinates><frames>"
            + frame(f"{name}_p", f"/bodyset/{parent}", at, "0.1 0 0.2")
            + frame(f"{name}_c", f"/bodyset/{child}", "0 0.02 0", "0 0.1 0")
            + f"</frames><SpatialTransform>{transform}</SpatialTransform></CustomJoint>"
        )

    bodies = (
        body("thorax", 20, "0 0.1 0", "0.3 0.2 0.3 0.01 -0.02 0.005")
        + body("humerus", 2, "0 -0.14 0.01", "0.013 0.002 0.012 0.0005 0 -0.0003")
        + body("radius", 1.2, "0.01 -0.1 0", "0.006 0.001 0.006 0 0 0")
        + body("hand", 0.5, "0 -0.05 0", "0.001 0.0006 0.0012 0 0 0")
    )
    weld = (
        '<WeldJoint name="base"><socket_parent_frame>base_p</socket_parent_frame>'
        "<socket_child_frame>base_c</socket_child_frame><frames>"
        + frame("base_p", "/ground", "0 1.2 0")
        + frame("base_c", "/bodyset/thorax", "0 0 0")
        + "</frames></WeldJoint>"
    )
    wrist = (
        '<UniversalJoint name="wrist"><socket_parent_frame>wrist_p</socket_parent_frame>'
        "<socket_child_frame>wrist_c</socket_child_frame><coordinates>"
        + coordinate("flex", -1, 1, 0.1)
        + coordinate("deviate", -0.5, 0.5, 0.0, changes.get("deviate", ""))
        + "</coordinates><frames>"
        + frame("wrist_p", "/bodyset/radius", "0 -0.25 0", "0 0.3 0")
        + frame("wrist_c", "/bodyset/hand", "0 0 0")
        + "</frames></UniversalJoint>"
    )
    three = coordinate("turn", -1.6, 2.2, 0.3) + coordinate("lift", 0, 3, 0.4)
    three += coordinate("roll", -1.5, 1, -0.2)
    joints = (
        weld
        + custom("shoulder", "thorax humerus", three, shoulder, "0.02 0.3 0.17")
        + custom("elbow", "humerus radius", coordinate("bend", 0, 2.3, 0.5), elbow, "0 -0.28 0")
        + wrist
    )
    marker = (
        '<Marker name="grip"><socket_parent_frame>/bodyset/hand</socket_parent_frame>'
        "<location>0 -0.08 0.02</location></Marker>"
    )
    return (
        '<?xml version="1.0"?><OpenSimDocument Version="40000"><Model name="arm">'
        "<gravity>0 -9.80665 0</gravity>"
        f"<BodySet><objects>{bodies}</objects></BodySet>"
        f"<JointSet><objects>{joints}</objects></JointSet>"
        f"<ConstraintSet><objects>{changes.get('constraints', '')}</objects></ConstraintSet>"
        f"<MarkerSet><objects>{marker}</objects></MarkerSet></Model></OpenSimDocument>"
    )


COUPLER = (
    '<CoordinateCouplerConstraint name="rhythm"><isEnforced>true</isEnforced>'
    "<coupled_coordinates_function><LinearFunction><coefficients> 0.5 0</coefficients>"
    "</LinearFunction></coupled_coordinates_function>"
    "<independent_coordinate_names>bend</independent_coordinate_names>"
    "<dependent_coordinate_name>flex</dependent_coordinate_name></CoordinateCouplerConstraint>"
)
LOCKED = "<locked>true</locked>"


@pytest.fixture
def osim(tmp_path):
    pytest.importorskip("opensim")

    def write(**changes):
        (tmp_path / "arm.osim").write_text(opensim_arm(**changes))
        return tmp_path / "arm.osim"

    return write


@pytest.mark.parametrize(
    ("changes", "moving"),
    [
        ({}, ["turn", "lift", "roll", "bend", "flex", "deviate"]),
        ({"deviate": LOCKED}, ["turn", "lift", "roll", "bend", "flex"]),
    ],
)
def test_an_opensim_arm_has_opensims_mass_matrix(osim, changes, moving):
    import opensim

    from drake_racket.limbs.opensim.importer import Y_UP, import_opensim

    plant = MultibodyPlant(0.0)
    arm = import_opensim(plant, osim(**changes), hand="grip")
    plant.Finalize()
    assert arm.limb.joint_names() == moving
    model = arm.tree.model
    state, context = model.initSystem(), plant.CreateDefaultContext()
    at = [arm.joints[name].velocity_start() for name in moving]
    random = np.random.default_rng(3)
    for _ in range(5):
        for name, made in arm.joints.items():
            low, high = made.position_lower_limits()[0], made.position_upper_limits()[0]
            angle = random.uniform(low, high)
            model.updCoordinateSet().get(name).setValue(state, angle, False)
            made.set_angle(context, angle)
        model.realizeVelocity(state)
        matrix = opensim.Matrix()
        model.getMatterSubsystem().calcM(state, matrix)
        theirs = np.array([[matrix.get(i, j) for j in range(matrix.ncol())]
                           for i in range(matrix.nrow())])[: len(at), : len(at)]  # fmt: skip
        np.testing.assert_allclose(
            plant.CalcMassMatrix(context)[np.ix_(at, at)], theirs, rtol=0, atol=1e-9
        )
        place = model.getMarkerSet().get("grip").getLocationInGround(state)
        mine = arm.limb.hand.CalcPoseInWorld(context).translation()
        np.testing.assert_allclose(
            mine, Y_UP @ np.array([place.get(i) for i in range(3)]), atol=1e-12
        )


def test_what_drake_cannot_move_is_held_and_listed(osim):
    from drake_racket.limbs.opensim.importer import import_opensim

    arm = import_opensim(MultibodyPlant(0.0), osim(of="bend", function="SPLINE"), hand="hand")
    assert arm.left_out.names("joints that Drake cannot move as OpenSim does") == ("elbow",)
    assert (arm.limb.joint_names()[-2:], arm.fixed["bend"]) == (["flex", "deviate"], 0.5)
    coupled = import_opensim(MultibodyPlant(0.0), osim(constraints=COUPLER), hand="hand")
    assert coupled.left_out.names("coordinates that follow others") == ("flex",)
    assert coupled.fixed["flex"] == pytest.approx(0.25)
    assert "flex" in " ".join(coupled.limb.notes)


def test_an_opensim_arm_by_key(osim):
    case = slow(osim(), "hand", base="thorax", stroke=Stroke(speed=0.5, velocity_azimuth_deg=20.0))
    result = simulate(case)
    assert list(result.history.joint.values)[:4] == ["turn", "lift", "roll", "bend"]
    assert result.energy_error < 1e-5


def test_importers_and_finders_agree(osim, mjcf):
    """What carries the hand is the same chain, whoever reads it."""
    for path, hand in ((osim(), "radius"), (mjcf(), "palm"), (mjcf(), "lid")):
        plant = MultibodyPlant(0.0)
        limb = add_limb_model(plant, path, hand)
        again = find_limb(plant, limb.hand)
        assert again.joint_names() == limb.joint_names()
        assert again.others() == limb.others()


@pytest.mark.parametrize(
    ("changes", "words"),
    [({"hand": "foot"}, ("hand", "grip")), ({"base": "pelvis"}, ("base", "thorax"))],
)
def test_names_that_an_opensim_model_lacks(osim, changes, words):
    from drake_racket.limbs.opensim.importer import import_opensim

    with pytest.raises(InputError) as caught:
        import_opensim(MultibodyPlant(0.0), osim(), **({"hand": "hand"} | changes))
    assert all(word in str(caught.value) for word in words)


def test_a_broken_opensim_file(tmp_path):
    pytest.importorskip("opensim")
    (tmp_path / "arm.osim").write_text("<OpenSimDocument")
    with pytest.raises(InputError, match="a model that OpenSim reads") as caught:
        load(tmp_path / "arm.osim")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("name", "library"), [("a.xml", "mujoco"), ("a.OSIM", "opensim")])
def test_a_missing_library_is_named_before_any_work(tmp_path, monkeypatch, name, library):
    (tmp_path / name).write_text("<x/>")
    monkeypatch.setattr("drake_racket.io.extras.has_library", lambda module: module != library)
    with pytest.raises(InputError, match=rf"limb\.model.*drake-racket\[{library}\]"):
        resolve(striking(tmp_path / name, "hand"))
