"""The upper limb: numbers against the table, signs, mirror symmetry, and a pendulum's period."""

from __future__ import annotations

import dataclasses
import subprocess
import sys

import numpy as np
import pytest
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator

from drake_racket import LimbSettings
from drake_racket.io.errors import InputError
from drake_racket.io.shipped import data_directory, sdf_directory
from drake_racket.limbs.upper_limb import GRIP_ROTATIONS, add_upper_limb, find_upper_limb
from drake_racket.limbs.upper_limb_sdf import shipped_limb_models
from drake_racket.parameters.limb import (
    JOINTS,
    SEGMENTS,
    check_upper_limb,
    load_upper_limb,
)
from drake_racket.parameters.quantities import Quantity
from studies.upper_limb.posture import set_posture

# de Leva (1996), Table 4, male: mass %, length mm, COM %, radii % (sagittal, transverse, along)
TABLE = {
    "upper_arm": (2.71, 281.7, 57.72, (28.5, 26.9, 15.8)),
    "forearm": (1.62, 268.9, 45.74, (27.6, 26.5, 12.1)),
    "fist": (0.61, 86.2, 79.00, (62.8, 51.3, 40.1)),
}
BODY = 73.0
MIRROR = np.diag([1.0, -1.0, 1.0])
OUT = {"right": -1.0, "left": 1.0}  # the way out of the body along y


def build(step=0.0, **options):
    plant = MultibodyPlant(step)
    limb = add_upper_limb(plant, **options)
    plant.Finalize()
    return limb, plant.CreateDefaultContext()


@pytest.fixture(scope="module")
def pair():
    """Right and left limb in one plant."""
    plant = MultibodyPlant(0.0)
    limbs = {side: add_upper_limb(plant, side=side, name=f"{side}_arm") for side in OUT}
    plant.Finalize()
    return plant, limbs, plant.CreateDefaultContext()


def frame(limb, name, context):
    found = limb.plant.GetFrameByName(name, limb.model_instances[0])
    return found.CalcPoseInWorld(context)


def posture(limb, context, **angles):
    set_posture(limb, context, np.array([angles.get(name, 0.0) for name in JOINTS]))


@pytest.mark.parametrize("side", OUT)
@pytest.mark.parametrize("link", TABLE)
def test_inertia_is_the_tables(pair, side, link):
    plant, limbs, _ = pair
    mass, length, com, radii = TABLE[link]
    mass, length = mass / 100 * BODY, length / 1000
    sagittal, transverse, along = (mass * (r / 100 * length) ** 2 for r in radii)
    # forearm and hand: midway between pronation and supination, palm to the thigh, so that what
    # runs from back to front in the anatomical position (palm forward) runs along y
    xx, yy = (sagittal, transverse) if link == "upper_arm" else (transverse, sagittal)
    body = plant.GetBodyByName(link, limbs[side].model_instances[0])
    inertia = body.default_spatial_inertia()
    assert inertia.get_mass() == pytest.approx(mass, rel=1e-12)
    centre = [0.0, 0.0, -com / 100 * length]
    np.testing.assert_allclose(inertia.get_com(), centre, rtol=0, atol=1e-15)
    about_com = inertia.Shift(inertia.get_com()).CalcRotationalInertia().CopyToFullMatrix3()
    np.testing.assert_allclose(about_com, np.diag([xx, yy, along]), rtol=1e-12, atol=1e-15)


def test_links_without_mass_have_no_inertia_either(pair):
    plant, limbs, _ = pair
    (instance,) = limbs["right"].model_instances
    names = [plant.get_body(i).name() for i in plant.GetBodyIndices(instance)]
    massless = set(names) - set(TABLE)
    assert len(massless) == 5
    for name in massless:
        inertia = plant.GetBodyByName(name, instance).default_spatial_inertia()
        assert inertia.get_mass() == 0.0
        assert not inertia.CalcRotationalInertia().CopyToFullMatrix3().any()


def test_seven_joints_each_with_an_actuator_in_order(pair):
    plant, limbs, _ = pair
    for limb in limbs.values():
        (instance,) = limb.model_instances
        assert limb.joint_names() == list(JOINTS)
        assert plant.num_positions(instance) == plant.num_velocities(instance) == 7
        assert plant.get_actuation_input_port(instance).size() == 7
        joints = [
            plant.get_joint_actuator(i).joint().name()
            for i in plant.GetJointActuatorIndices(instance)
        ]
        assert joints == list(JOINTS)
        assert all(
            np.isinf(plant.get_joint_actuator(i).effort_limit())
            for i in plant.GetJointActuatorIndices(instance)
        )


@pytest.mark.parametrize("side", OUT)
def test_an_actuators_torque_drives_its_joint(side):
    limb, context = build(side=side)
    plant = limb.plant
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
    mass = plant.CalcMassMatrix(context)
    torque = np.array([0.3, -0.2, 0.1, 0.4, 0.01, -0.02, 0.03])
    plant.get_actuation_input_port().FixValue(context, torque)
    acceleration = plant.EvalTimeDerivatives(context).CopyToVector()[7:]
    np.testing.assert_allclose(mass @ acceleration, torque, rtol=1e-9)


@pytest.mark.parametrize("side", OUT)
def test_zero_posture_hangs_straight_with_the_thumb_forward(pair, side):
    _, limbs, context = pair
    limb, out = limbs[side], OUT[side]
    posture(limb, context)
    heights = [frame(limb, f, context).translation() for f in ("elbow", "wrist", "knuckle")]
    down = -np.cumsum([length / 1000 for _, length, _, _ in TABLE.values()])
    np.testing.assert_allclose(heights, np.outer(down, [0, 0, 1]), atol=1e-14)
    X_WH = frame(limb, "hand", context)
    np.testing.assert_allclose(X_WH.translation(), [0.0, -out * 0.03, down[1] - 0.07], atol=1e-14)
    x, y, z = X_WH.rotation().matrix().T
    np.testing.assert_allclose(x, [np.cos(np.pi / 6), 0, -np.sin(np.pi / 6)], atol=1e-14)
    np.testing.assert_allclose(z, [0, -out, 0], atol=1e-14)  # the palm faces the thigh
    np.testing.assert_allclose(np.cross(z, x), y, atol=1e-14)


def directions(out):
    """Joint -> (other joints, what is watched, the way it must go)."""
    forward, outward = np.eye(3)[0], out * np.eye(3)[1]
    return {
        "shoulder_abduction": ({}, "knuckle", outward),
        "shoulder_flexion": ({}, "knuckle", forward),
        "shoulder_rotation": ({"elbow_flexion": np.pi / 2}, "knuckle", -outward),
        "elbow_flexion": ({}, "knuckle", forward),
        "forearm_pronation": ({}, "palm", -forward),
        "wrist_flexion": ({}, "knuckle", -outward),  # the palm faces the thigh
        "wrist_deviation": ({}, "knuckle", forward),  # as the thumb points
    }


@pytest.mark.parametrize("side", OUT)
@pytest.mark.parametrize("joint", JOINTS)
def test_positive_is_the_documented_direction(pair, side, joint):
    _, limbs, context = pair
    limb = limbs[side]
    others, watched, way = directions(OUT[side])[joint]

    def place(angle):
        posture(limb, context, **{**others, joint: angle})
        if watched == "palm":
            return frame(limb, "hand", context).rotation().matrix()[:, 2]
        return frame(limb, watched, context).translation()

    move = place(0.2) - place(0.0)
    assert move @ way > 0.9 * np.linalg.norm(move)
    assert np.linalg.norm(move) > 0.015


@pytest.mark.parametrize("side", OUT)
def test_abducted_arm_flexes_forward_in_the_horizontal_plane(pair, side):
    _, limbs, context = pair
    limb = limbs[side]
    posture(limb, context, shoulder_abduction=np.pi / 2, shoulder_flexion=0.3)
    elbow = frame(limb, "elbow", context).translation()
    expected = 0.2817 * np.array([np.sin(0.3), OUT[side] * np.cos(0.3), 0.0])
    np.testing.assert_allclose(elbow, expected, atol=1e-14)


def test_shoulder_is_regular_held_out_sideways_and_singular_pointing_forward(pair):
    plant, limbs, context = pair
    at = np.ix_(*[limbs["right"].velocity_indices()] * 2)

    def condition(**angles):
        posture(limbs["right"], context, **angles)
        return np.linalg.cond(plant.CalcMassMatrix(context)[at])

    assert condition(shoulder_abduction=np.pi / 2) < 2 * condition()
    assert condition(shoulder_flexion=np.pi / 2) > 1e12


angles = st.lists(st.floats(-3.0, 3.0), min_size=7, max_size=7)


@settings(max_examples=25, deadline=None)
@given(q=angles, v=angles)
def test_left_is_the_mirror_image_of_right(pair, q, v):
    plant, limbs, context = pair
    for limb in limbs.values():
        set_posture(limb, context, np.array(q))
    right, left = limbs["right"], limbs["left"]
    for name in ("upper_arm", "elbow", "wrist", "knuckle", "hand"):
        X_r, X_l = frame(right, name, context), frame(left, name, context)
        np.testing.assert_allclose(X_l.translation(), MIRROR @ X_r.translation(), atol=1e-12)
        # a hand frame is mirrored along x and z, as the racket is; a link's frame in all
        expected = MIRROR @ X_r.rotation().matrix() @ MIRROR
        np.testing.assert_allclose(X_l.rotation().matrix(), expected, atol=1e-12)
    mass = plant.CalcMassMatrix(context)
    gravity = plant.CalcGravityGeneralizedForces(context)
    velocities = np.zeros(14)
    for limb in limbs.values():
        velocities[limb.velocity_indices()] = v
    plant.SetVelocities(context, velocities)
    bias = plant.CalcBiasTerm(context)
    r, l = right.velocity_indices(), left.velocity_indices()
    np.testing.assert_allclose(mass[np.ix_(l, l)], mass[np.ix_(r, r)], atol=1e-12)
    np.testing.assert_allclose(gravity[l], gravity[r], atol=1e-12)
    np.testing.assert_allclose(bias[l], bias[r], atol=1e-10)


@pytest.mark.parametrize("side", OUT)
def test_grips_turn_the_strings_normal_to_the_fingers(side):
    """Eastern forehand: out of the palm. Western: turned by two bevels towards the fingers."""
    for grip, angle in GRIP_ROTATIONS.items():
        limb, context = build(side=side, grip_rotation=angle)
        x, _, z = frame(limb, "hand", context).rotation().matrix().T
        palm = np.array([0.0, -OUT[side], 0.0])
        fingers = np.array([-0.5, 0.0, -np.sqrt(0.75)])  # square to the handle, inclined by 30 deg
        np.testing.assert_allclose(x, [np.sqrt(0.75), 0, -0.5], atol=1e-14)
        expected = np.cos(angle) * palm + np.sin(angle) * fingers
        np.testing.assert_allclose(z, expected, atol=1e-14, err_msg=grip)
    bevels = {name: round(angle / (np.pi / 4)) for name, angle in GRIP_ROTATIONS.items()}
    # one bevel apart each, and a backhand half a turn from the forehand with the same grip
    assert bevels["continental_backhand"] - bevels["continental_forehand"] == 4
    assert bevels["western_forehand"] == bevels["eastern_backhand"] == 2


def test_hanging_arm_swings_as_a_compound_pendulum():
    """About shoulder_flexion, all else locked (which takes a discrete plant)."""
    limb, context = build(step=1e-4)
    for joint in limb.joints:
        if joint.name() != "shoulder_flexion":
            joint.Lock(context)
    inertia = moment = start = 0.0
    for link, (mass, length, com, radii) in TABLE.items():
        mass, length = mass / 100 * BODY, length / 1000
        centre = start + com / 100 * length
        radius = radii[1] if link == "upper_arm" else radii[0]
        inertia += mass * ((radius / 100 * length) ** 2 + centre**2)
        moment += mass * centre
        start += length
    amplitude = 0.05
    g = 9.81  # Drake's default, m/s^2
    expected = 2 * np.pi * np.sqrt(inertia / (moment * g)) * (1 + amplitude**2 / 16)
    posture(limb, context, shoulder_flexion=amplitude)
    simulator = Simulator(limb.plant, context)
    joint = limb.joints[1]
    crossings = []
    before = amplitude
    for t in np.arange(0.0, 1.6, 1e-3)[1:]:
        simulator.AdvanceTo(t)
        now = joint.get_angle(context)
        if before * now < 0:
            crossings.append(t - 1e-3 * now / (now - before))
        before = now
    period = 2 * (crossings[1] - crossings[0])
    assert period == pytest.approx(expected, rel=2e-4)
    assert 1.2 < period < 1.7


@settings(max_examples=15, deadline=None)
@given(mass=st.floats(40.0, 130.0), height=st.floats(1.4, 2.2))
def test_scaling_with_mass_and_height(mass, height):
    limb, shipped = load_upper_limb(mass=mass, height=height), load_upper_limb()
    m, h = mass / BODY, height / 1.741
    for name in SEGMENTS:
        assert limb.mass(name) == pytest.approx(m * shipped.mass(name), rel=1e-12)
        assert limb.com(name) == pytest.approx(h * shipped.com(name), rel=1e-12)
        np.testing.assert_allclose(
            limb.moments(name), m * h**2 * np.array(shipped.moments(name)), rtol=1e-12
        )
    assert limb.grip.distal.value == pytest.approx(h * 0.07)
    assert limb.grip.palmar.value == pytest.approx(h * 0.03)
    assert limb.grip.inclination == shipped.grip.inclination
    assert limb.ranges().tolist() == shipped.ranges().tolist()
    check_upper_limb(limb)
    if height != 1.741:
        assert limb.forearm.length.status == "calculated"
        assert limb.grip.distal.status == "inferred"  # scaling makes nothing known


def test_ranges_hold_the_zero_posture_and_are_the_plants():
    limb, _ = build()
    ranges = load_upper_limb().ranges()
    assert np.all(ranges[:, 0] <= 0)
    assert np.all(ranges[:, 1] > 0)
    lower, upper = limb.plant.GetPositionLowerLimits(), limb.plant.GetPositionUpperLimits()
    np.testing.assert_array_equal(np.column_stack([lower, upper]), ranges)


def test_shipped_files_are_the_writers_and_parse_strictly():
    for name, text in shipped_limb_models().items():
        assert (sdf_directory() / name).read_text(encoding="utf-8") == text, "run make sdf"
        plant = MultibodyPlant(0.0)
        parser = Parser(plant)
        parser.SetStrictParsing()
        (instance,) = parser.AddModels(str(sdf_directory() / name))
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("shoulder", instance))
        plant.Finalize()
        limb = find_upper_limb(plant, instance)
        mass = plant.CalcTotalMass(plant.CreateDefaultContext())
        assert mass == pytest.approx(BODY * (0.0271 + 0.0162 + 0.0061), rel=1e-12)
        side = "left" if "left" in name else "right"
        here, there = build(side=side), (limb, plant.CreateDefaultContext())
        for f in ("upper_arm", "forearm", "fist", "hand"):
            assert frame(*_at(here, f)).IsExactlyEqualTo(frame(*_at(there, f)))


def _at(built, name):
    return built[0], name, built[1]


def test_parent_and_pose():
    plant = MultibodyPlant(0.0)
    X_WP = RigidTransform(RollPitchYaw(0.1, -0.2, 0.7), [0.1, -0.2, 1.4])
    first = add_upper_limb(plant, X_PF=X_WP)
    (instance,) = first.model_instances
    elbow = plant.GetFrameByName("elbow", instance)
    second = add_upper_limb(plant, name="second", parent=elbow, X_PF=X_WP)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    expected = X_WP.multiply(RigidTransform([0.0, 0.0, -0.2817]))
    assert frame(first, "elbow", context).IsNearlyEqualTo(expected, 1e-14)
    assert frame(second, "shoulder", context).IsNearlyEqualTo(expected.multiply(X_WP), 1e-14)
    assert second.velocity_indices().tolist() == list(range(7, 14))


def test_bad_input_is_named():
    limb, _ = build()
    with pytest.raises(InputError, match="plant: got 'finalized'"):
        add_upper_limb(limb.plant, name="other")
    plant = MultibodyPlant(0.0)
    add_upper_limb(plant)
    for options, text in (
        ({}, "name: got 'upper_limb'"),
        ({"name": "two words"}, "name: got 'two words'"),
        ({"name": "other", "side": "both"}, "side: got 'both'; allowed: right, left"),
        ({"name": "other", "grip_rotation": float("nan")}, "grip_rotation: got nan"),
    ):
        with pytest.raises(InputError, match=text):
            add_upper_limb(plant, **options)
    assert not plant.HasModelInstanceNamed("other")
    with pytest.raises(InputError, match="find_upper_limb"):
        find_upper_limb(plant, plant.world_body().model_instance())
    for size in ({"mass": 0.0}, {"height": -1.0}, {"mass": float("inf")}):
        with pytest.raises(InputError, match=f"load_upper_limb: {next(iter(size))}"):
            load_upper_limb(**size)
    with pytest.raises(InputError, match="limb: got 'leg'"):
        load_upper_limb("leg")
    with pytest.raises(InputError, match="posture"):
        set_posture(limb, limb.plant.CreateDefaultContext(), np.zeros(6))


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("value: 0.5772, ", "value: 1.2, ", "upper_arm.com.value"),
        ("value: 0.0162, unit: \"1\"", "value: 0.0162, unit: kg", "forearm.mass_fraction.unit"),
        ("value: 0.401, ", "value: 0.901, ", r"hand.gyration_\*"),
        ("value: 2.6179938779914944, ", "value: -0.1, ", "joints.elbow_flexion.lower.value"),
        ("value: 0.5235987755982988, unit: rad, status: inferred", "value: 1.6, unit: rad, "
         "status: inferred", "grip.inclination.value"),
        ("limit_damping:", "limit_dampings:", "limit_dampings"),
        ("name: upper_limb", "name: upper limb", "name"),
    ],
)  # fmt: skip
def test_bad_files_are_named(tmp_path, old, new, key):
    text = (data_directory() / "upper_limb.yaml").read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "limb.yaml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError, match=key):
        load_upper_limb(str(path))


def test_parameters_are_checked_before_anything_is_added():
    limb = load_upper_limb()
    bad = dataclasses.replace(
        limb, subject=dataclasses.replace(limb.subject, mass=Quantity(-1.0, "kg", "measured", "me"))
    )
    plant = MultibodyPlant(0.0)
    with pytest.raises(InputError, match=r"subject.mass.value: got -1.0"):
        add_upper_limb(plant, bad)
    assert not plant.HasModelInstanceNamed("upper_limb")


STUDY = "studies.upper_limb"


@pytest.mark.slow
def test_study(tmp_path):
    command = [
        sys.executable,
        "-m",
        STUDY,
        "--out",
        str(tmp_path),
        "--mass",
        "80",
        "--side",
        "left",
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "2.168 kg" in done.stdout  # 2.71 % of 80 kg
    assert (tmp_path / "upper_limb.png").stat().st_size > 20_000
    assert "2.168" in (tmp_path / "segments.csv").read_text()
    with xarray.open_dataset(tmp_path / "posture.nc", engine="h5netcdf") as data:
        assert data["joint"].to_numpy().tolist() == list(JOINTS)
        arm = data["frame_origin"].sel(frame="elbow") - data["frame_origin"].sel(frame="shoulder")
        assert np.linalg.norm(arm) == pytest.approx(0.2817)
        assert all("units" in v.attrs and "long_name" in v.attrs for v in data.variables.values())
    bad = subprocess.run([*command, "--height", "0"], capture_output=True, text=True, check=False)
    assert bad.returncode == 2
    assert bad.stderr.startswith("studies.upper_limb: load_upper_limb: height")


def test_muscles_that_no_file_names_have_no_stiffness():
    joint = dataclasses.replace(
        load_upper_limb().joints.elbow_flexion, active_stiffness=None, active_damping=None
    )
    assert joint.active() == (0.0, 0.0)
    assert LimbSettings().activation == 0.0
    assert LimbSettings(activation=0.004).activation == 0.004
