"""The state of a limb for a stroke: exact poses and velocities, refusals, what is left free."""

from __future__ import annotations

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BallRpyJoint, FixedOffsetFrame

from drake_racket.io.errors import InputError
from drake_racket.io.yaml_files import load_text
from drake_racket.limbs import stroke_position
from drake_racket.limbs.limb import Limb
from drake_racket.limbs.stroke import Stroke, StrokeState, apply_stroke, solve_stroke
from drake_racket.limbs.stroke_position import HandKinematics
from drake_racket.parameters.grip import load_grip
from drake_racket.parameters.racket import load_racket
from drake_racket.parameters.stroke import PoseTarget, face_angles, face_rotation
from drake_racket.plant.grip import add_grip
from drake_racket.plant.racket import add_racket

# name, axis, offset of the joint from the one before (m), range (degrees)
ARM_7 = [
    ("plane", "0 0 1", (0.0, -0.2, 1.4), (-150.0, 100.0)),
    ("elevation", "0 1 0", (0.0, 0.0, 0.0), (-80.0, 120.0)),
    ("axial", "1 0 0", (0.0, 0.0, 0.0), (-110.0, 110.0)),
    ("elbow", "0 0 1", (0.31, 0.0, 0.0), (-5.0, 145.0)),
    ("pronation", "1 0 0", (0.26, 0.0, 0.0), (-90.0, 90.0)),
    ("flexion", "0 1 0", (0.0, 0.0, 0.0), (-75.0, 75.0)),
    ("deviation", "0 0 1", (0.0, 0.0, 0.0), (-35.0, 35.0)),
]
ARM_6 = [ARM_7[i] for i in (0, 1, 3, 4, 5, 6)]
PLANAR = [
    ("one", "0 0 1", (0.0, 0.0, 1.0), (-180.0, 180.0)),
    ("two", "0 0 1", (0.3, 0.0, 0.0), (-150.0, 150.0)),
    ("three", "0 0 1", (0.25, 0.0, 0.0), (-90.0, 90.0)),
]
# the racket goes across the hand, its strings face along the forearm
HAND = RigidTransform(
    RotationMatrix(np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]]))
    @ RollPitchYaw(0.2, -0.1, 0.15).ToRotationMatrix(),
    [0.08, 0.01, -0.02],
)
FULL = {"angular_velocity": [1.0, -8.0, 12.0], "speed": 25.0}


def arm_sdf(
    joints: list, *, effort: float = 0.0, damping: float = 0.0, rate: float = math.inf
) -> str:
    """An arm whose links lie along x in the zero posture."""
    lines = ['<?xml version="1.0"?><sdf version="1.9"><model name="arm">']
    before, place = "world", np.zeros(3)
    for name, axis, offset, (low, high) in joints:
        place = place + np.array(offset)
        pose = " ".join(repr(float(x)) for x in place)
        limit = "" if math.isinf(rate) else f"<velocity>{rate}</velocity>"
        lines.append(
            f'<link name="{name}_link"><pose>{pose} 0 0 0</pose><inertial>'
            "<pose>0.12 0.01 0.02 0 0 0</pose><mass>1.2</mass><inertia><ixx>0.004</ixx>"
            "<iyy>0.011</iyy><izz>0.012</izz><ixy>0.001</ixy><ixz>0</ixz><iyz>0</iyz></inertia>"
            f'</inertial></link><joint name="{name}" type="revolute"><parent>{before}</parent>'
            f"<child>{name}_link</child><axis><xyz>{axis}</xyz><limit><lower>{math.radians(low)}"
            f"</lower><upper>{math.radians(high)}</upper><effort>{effort}</effort>{limit}</limit>"
            f"<dynamics><damping>{damping}</damping></dynamics></axis></joint>"
        )
        before = f"{name}_link"
    return "".join([*lines, "</model></sdf>"])


def make_case(
    joints: list, hold: str = "weld", held_at: str = "grip", gravity=None, **options
) -> SimpleNamespace:
    """Plant, limb and racket; `hold` is weld, grip (a bushing) or ball (a ball joint)."""
    plant = MultibodyPlant(0.0)
    (instance,) = Parser(plant).AddModelsFromString(arm_sdf(joints, **options), "sdf")
    last = plant.GetFrameByName(f"{joints[-1][0]}_link", instance)
    hand = plant.AddFrame(FixedOffsetFrame("hand", last, HAND))
    parent = hand if hold == "weld" else None
    racket = add_racket(plant, load_racket("tour"), parent=parent, held_at=held_at)
    grip = add_grip(plant, racket, hand, load_grip()) if hold == "grip" else None
    if hold == "ball":
        plant.AddJoint(BallRpyJoint("hold", hand, racket.frame("grip")))
    if gravity is not None:
        plant.mutable_gravity_field().set_gravity_vector(gravity)
    plant.Finalize()
    found = tuple(plant.GetJointByName(j[0], instance) for j in joints)
    limb = Limb(plant, (instance,), hand, found)
    return SimpleNamespace(
        plant=plant, limb=limb, racket=racket, grip=grip, gsc=racket.frame("gsc")
    )


CASES = {
    (count, hold): make_case(joints, hold)
    for count, joints, hold in (
        (7, ARM_7, "weld"),
        (7, ARM_7, "grip"),
        (7, ARM_7, "ball"),
        (6, ARM_6, "weld"),
        (3, PLANAR, "weld"),
    )
}


def solve(case: SimpleNamespace, stroke: Stroke) -> StrokeState:
    return solve_stroke(
        case.plant, case.limb, case.gsc, stroke, held_frame=case.racket.frame("grip")
    )


def applied(case: SimpleNamespace, state: StrokeState):
    """A Context that was in another state, with the stroke in it."""
    context = case.plant.CreateDefaultContext()
    rng = np.random.default_rng(3)
    case.plant.SetVelocities(context, rng.normal(size=case.plant.num_velocities()))
    for joint in (*case.racket.string_joints, case.racket.in_plane, case.racket.out_of_plane):
        q = case.plant.GetPositions(context)
        q[joint.position_start()] = 0.01
        case.plant.SetPositions(context, q)
    apply_stroke(case.plant, context, case.limb, case.racket, state)
    return context


def in_range(joints: list, shares) -> np.ndarray:
    low, high = np.radians(np.array([j[3] for j in joints])).T
    return low + np.array(shares) * (high - low)


def moved(joints: list, q: np.ndarray, v: np.ndarray):
    """Pose and velocity of the string-bed of a limb in state (q, v)."""
    welded = CASES[len(joints), "weld"]
    context = welded.plant.CreateDefaultContext()
    apply_stroke(
        welded.plant,
        context,
        welded.limb,
        welded.racket,
        StrokeState(tuple(j[0] for j in joints), q, v, q, v, 0, 0, 0),
    )
    return welded.gsc.CalcPoseInWorld(context), welded.gsc.CalcSpatialVelocityInWorld(context)


def stroke_of(joints: list, q: np.ndarray, v: np.ndarray):
    """The whole stroke that a limb in state (q, v) makes, as R, p and V of the string-bed."""
    X, V = moved(joints, q, v)
    closed, azimuth, tip = np.degrees(face_angles(X.rotation().matrix()))
    assume(abs(closed) <= 89.0)  # a coach's angles have no azimuth beyond
    left = np.cross([0.0, 0.0, 1.0], X.rotation().matrix()[:, 2])
    speed = float(np.linalg.norm(V.translational()))
    stroke = Stroke(
        position=[float(x) for x in X.translation()],
        face_closed_deg=float(closed),
        face_azimuth_deg=float(azimuth),
        tip_elevation_deg=float(tip),
        tip_side="left" if left @ X.rotation().matrix()[:, 0] > 0.0 else "right",
        speed=speed,
        velocity_elevation_deg=math.degrees(math.asin(V.translational()[2] / speed)),
        velocity_azimuth_deg=math.degrees(math.atan2(V.translational()[1], V.translational()[0])),
        angular_velocity=[float(x) for x in V.rotational()],
    )
    return stroke, X, V


def postures(count: int):
    return st.tuples(
        st.lists(st.floats(0.05, 0.95), min_size=count, max_size=count),
        st.lists(st.floats(-12.0, 12.0), min_size=count, max_size=count).filter(
            lambda v: np.linalg.norm(v) > 1.0
        ),
    )


def near(joints: list, q: np.ndarray, by_deg: float) -> dict[str, float]:
    """A guess that is off by `by_deg` to alternating sides, within the joints' ranges."""
    low, high = np.array([j[3] for j in joints]).T
    off = np.degrees(q) + by_deg * (-1.0) ** np.arange(len(q))
    return dict(zip([j[0] for j in joints], np.clip(off, low, high).tolist(), strict=True))


def check_recovered(case: SimpleNamespace, joints: list, shares, rates, by_deg: float) -> None:
    q, v = in_range(joints, shares), np.array(rates)
    # in a singular posture one that is off by rounding has another range of velocities
    columns = [moved(joints, q, e)[1].get_coeffs() for e in np.eye(len(q))]
    assume(np.linalg.svd(np.transpose(columns))[1][5] > 1e-4)
    stroke, X, V = stroke_of(joints, q, v)
    state = solve(case, dataclasses.replace(stroke, guess_deg=near(joints, q, by_deg)))
    context = applied(case, state)
    found = case.gsc.CalcPoseInWorld(context)
    np.testing.assert_allclose(found.translation(), X.translation(), rtol=0, atol=1e-8)
    np.testing.assert_allclose(found.rotation().matrix(), X.rotation().matrix(), rtol=0, atol=1e-8)
    moving = case.gsc.CalcSpatialVelocityInWorld(context)
    scale = max(1.0, np.abs(V.get_coeffs()).max())
    np.testing.assert_allclose(moving.get_coeffs(), V.get_coeffs(), rtol=0, atol=1e-8 * scale)
    low, high = np.radians(np.array([j[3] for j in joints])).T
    assert (state.q >= low).all()
    assert (state.q <= high).all()
    assert np.abs(state.pose_residual).max() < 1e-9


@settings(max_examples=15, deadline=None)
@given(postures(7))
def test_seven_joints_give_back_pose_and_velocity(posture):
    check_recovered(CASES[7, "weld"], ARM_7, *posture, by_deg=8.0)


@settings(max_examples=15, deadline=None)
@given(postures(6))
def test_six_joints_give_back_pose_and_velocity(posture):
    check_recovered(CASES[6, "weld"], ARM_6, *posture, by_deg=5.0)


@pytest.mark.parametrize("hold", ["grip", "ball"])
@settings(max_examples=6, deadline=None)
@given(postures(7))
def test_a_racket_that_is_not_welded_moves_as_if_it_were(hold, posture):
    check_recovered(CASES[7, hold], ARM_7, *posture, by_deg=8.0)


STROKE = Stroke(
    position=[0.5, -0.6, 1.1],
    face_closed_deg=5.0,
    face_azimuth_deg=10.0,
    tip_elevation_deg=-8.0,
    speed=22.0,
    velocity_elevation_deg=20.0,
    velocity_azimuth_deg=5.0,
    angular_velocity=[None, None, None],
    guess_deg={"plane": -20.0, "elevation": 35.0, "elbow": 30.0},
)


def test_the_face_points_as_a_coach_says():
    flat = face_rotation(0.0, 0.0, 0.0, "right")  # a right-hander's forehand, racket level
    np.testing.assert_allclose(flat, [[0, 0, 1], [-1, 0, 0], [0, -1, 0]], atol=1e-15)
    backhand = face_rotation(0.0, 0.0, 0.0, "left")
    np.testing.assert_allclose(backhand[:, 0], [0, 1, 0], atol=1e-15)
    closed = face_rotation(math.radians(30.0), 0.0, 0.0, "right")
    np.testing.assert_allclose(closed[:, 2], [math.sqrt(0.75), 0.0, -0.5], atol=1e-15)
    turned = face_rotation(0.0, math.radians(90.0), 0.0, "right")
    np.testing.assert_allclose(turned[:, [0, 2]].T, [[1, 0, 0], [0, 1, 0]], atol=1e-15)
    serve = face_rotation(0.0, 0.0, math.radians(90.0), "right")
    np.testing.assert_allclose(serve[:, 0], [0, 0, 1], atol=1e-15)


@given(st.floats(-80.0, 80.0), st.floats(-179.0, 179.0), st.floats(-0.99, 0.99), st.booleans())
def test_face_angles_invert_face_rotation(closed, azimuth, share, left):
    angles = np.radians([closed, azimuth, share * (90.0 - abs(closed))])
    R = face_rotation(*angles, "left" if left else "right")
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) > 0.0
    np.testing.assert_allclose(face_angles(R), angles, atol=1e-7)
    # left of one who looks along the normal is z x n
    assert (np.cross([0.0, 0.0, 1.0], R[:, 2]) @ R[:, 0] > 0.0) == left


def test_the_asked_stroke_is_what_the_plant_shows():
    case = CASES[7, "grip"]
    context = applied(case, solve(case, STROKE))
    X = case.gsc.CalcPoseInWorld(context)
    np.testing.assert_allclose(X.translation(), STROKE.position, rtol=0, atol=1e-9)
    axis, normal = X.rotation().matrix()[:, 0], X.rotation().matrix()[:, 2]
    assert math.degrees(math.asin(-normal[2])) == pytest.approx(5.0, abs=1e-7)
    assert math.degrees(math.atan2(normal[1], normal[0])) == pytest.approx(10.0, abs=1e-7)
    assert math.degrees(math.asin(axis[2])) == pytest.approx(-8.0, abs=1e-7)
    assert axis[1] < 0.0  # to the right
    velocity = case.gsc.CalcSpatialVelocityInWorld(context).translational()
    assert np.linalg.norm(velocity) == pytest.approx(22.0, abs=1e-9)
    assert math.degrees(math.asin(velocity[2] / 22.0)) == pytest.approx(20.0, abs=1e-8)
    assert math.degrees(math.atan2(velocity[1], velocity[0])) == pytest.approx(5.0, abs=1e-8)


def test_a_racket_can_stand_on_end():
    case = CASES[7, "weld"]
    up = dataclasses.replace(
        STROKE,
        position=[0.4, -0.3, 2.1],
        face_closed_deg=0.0,
        tip_elevation_deg=90.0,
        guess_deg={"elevation": -50.0, "elbow": 20.0},
    )
    R = case.gsc.CalcPoseInWorld(applied(case, solve(case, up))).rotation().matrix()
    np.testing.assert_allclose(R[:, 0], [0.0, 0.0, 1.0], atol=1e-9)


def test_a_gripped_racket_starts_at_rest_in_the_hand():
    case = CASES[7, "grip"]
    context = applied(case, solve(case, dataclasses.replace(STROKE, **FULL)))
    grip_in_hand = case.racket.frame("grip").CalcPose(context, case.limb.hand)
    np.testing.assert_allclose(grip_in_hand.GetAsMatrix4(), np.eye(4), atol=1e-14)
    rate = case.racket.frame("grip").CalcSpatialVelocity(
        context, case.limb.hand, case.plant.world_frame()
    )
    np.testing.assert_allclose(rate.get_coeffs(), 0.0, atol=1e-12)
    force = case.grip.bushing.CalcBushingSpatialForceOnFrameA(context).get_coeffs()
    np.testing.assert_allclose(force, 0.0, atol=1e-8)
    assert np.abs(case.plant.GetVelocities(context)[case.limb.velocity_indices()]).max() > 1.0
    for joint in (*case.racket.string_joints, case.racket.in_plane, case.racket.out_of_plane):
        assert case.plant.GetPositions(context)[joint.position_start()] == 0.0
        assert case.plant.GetVelocities(context)[joint.velocity_start()] == 0.0


def test_how_the_racket_is_held_does_not_change_the_arm():
    weld, *others = (solve(CASES[7, hold], STROKE) for hold in ("weld", "grip", "ball"))
    for other in others:
        np.testing.assert_allclose(other.q, weld.q, rtol=0, atol=1e-6)
        np.testing.assert_allclose(other.v, weld.v, rtol=0, atol=1e-4)


def test_equal_strokes_give_equal_bits():
    first, again = solve(CASES[7, "weld"], STROKE), solve(CASES[7, "weld"], STROKE)
    fresh = solve(make_case(ARM_7), STROKE)
    for other in (again, fresh):
        assert first.q.tobytes() == other.q.tobytes()
        assert first.v.tobytes() == other.v.tobytes()


def world_jacobian(case: SimpleNamespace, state: StrokeState, h: float = 1e-6) -> np.ndarray:
    """d p_WC / dq by central differences of the plant's kinematics."""
    columns = []
    for step in h * np.eye(len(state.q)):
        ends = [
            case.gsc.CalcPoseInWorld(
                applied(case, dataclasses.replace(state, q=state.q + sign * step))
            ).translation()
            for sign in (1.0, -1.0)
        ]
        columns.append((ends[0] - ends[1]) / (2.0 * h))
    return np.array(columns).T


def test_a_planar_arm_takes_the_nearest_posture_and_the_smallest_rates():
    case = CASES[3, "weld"]
    guess = {"one": -40.0, "two": 50.0, "three": 10.0}
    # the hand is tilted out of the plane: ask for the direction that stays in it
    stroke = Stroke(
        position=[0.7, 0.3, None], speed=9.0, guess_deg=guess, velocity_azimuth_deg=25.0
    )
    state = solve(case, stroke)
    place = case.gsc.CalcPoseInWorld(applied(case, state)).translation()
    np.testing.assert_allclose(place[:2], [0.7, 0.3], rtol=0, atol=1e-9)
    assert (state.pose_freedom, state.velocity_freedom) == (1, 1)
    null = np.linalg.svd(world_jacobian(case, state)[:2])[2][2]
    # on the self-motion manifold the nearest posture's difference to the guess has no part along it
    assert abs(null @ (state.q - np.radians(list(guess.values())))) < 1e-5
    assert abs(null @ state.v) < 1e-7


@settings(max_examples=20, deadline=None)
@given(postures(7), st.lists(st.booleans(), min_size=10, max_size=10))
def test_what_is_left_out_is_free(posture, asked):
    """A guess that meets what is asked is the nearest posture, whatever the free parts are."""
    case = CASES[7, "weld"]
    q, v = in_range(ARM_7, posture[0]), np.array(posture[1])
    stroke, _, V = stroke_of(ARM_7, q, v)
    partial = dataclasses.replace(
        stroke,
        position=[x if a else None for x, a in zip(stroke.position, asked, strict=False)],
        face_closed_deg=stroke.face_closed_deg if asked[3] else None,
        face_azimuth_deg=stroke.face_azimuth_deg if asked[4] else None,
        tip_elevation_deg=stroke.tip_elevation_deg if asked[5] else None,
        speed=stroke.speed if asked[6] else None,
        angular_velocity=[
            x if a else None for x, a in zip(stroke.angular_velocity, asked[7:], strict=True)
        ],
        guess_deg=near(ARM_7, q, 0.0),
    )
    state = solve(case, partial)
    np.testing.assert_allclose(state.q, q, rtol=0, atol=1e-5)
    assert np.linalg.norm(state.v) <= np.linalg.norm(v) * (1.0 + 1e-4) + 1e-6
    assert state.pose_freedom == 7 - sum(asked[:6])
    assert len(state.velocity_residual) == 3 * asked[6] + sum(asked[7:])
    moving = case.gsc.CalcSpatialVelocityInWorld(applied(case, state)).get_coeffs()
    rows = np.array(asked[7:] + [asked[6]] * 3)
    np.testing.assert_allclose(moving[rows], V.get_coeffs()[rows], rtol=0, atol=1e-7)
    if not rows.any():
        assert not state.v.any()


@pytest.mark.parametrize("asked", [(0,), (1,), (2,), (0, 1), (0, 2), (1, 2), (0, 1, 2)])
def test_newton_has_the_right_slopes(asked):
    """Against central differences of the residual, in a posture that meets the target."""
    case = CASES[7, "weld"]
    hand = HandKinematics(
        case.limb,
        case.plant.CreateDefaultContext(),
        case.gsc.CalcPose(case.plant.CreateDefaultContext(), case.limb.hand),
    )
    q = in_range(ARM_7, [0.6, 0.4, 0.55, 0.3, 0.6, 0.45, 0.7])
    X = hand.pose(q)
    angles = face_angles(X.rotation().matrix())
    to_left = np.array([-math.sin(angles[1]), math.cos(angles[1]), 0.0])
    side = "left" if X.rotation().matrix()[:, 0] @ to_left > 0.0 else "right"
    free = [i for i in range(3) if i not in asked]
    angles[free] = math.nan
    target = PoseTarget(np.array([X.translation()[0], math.nan, X.translation()[2]]), angles, side)
    slopes = stroke_position._residual_jacobian(hand, target, q)
    h = 1e-6
    numeric = [
        (
            stroke_position._residual(hand, target, q + step)
            - stroke_position._residual(hand, target, q - step)
        )
        / (2.0 * h)
        for step in h * np.eye(7)
    ]
    np.testing.assert_allclose(slopes, np.array(numeric).T, rtol=0, atol=1e-8)


def test_a_free_component_does_not_change_the_answer_when_it_moves():
    """What the racket does in a component that is left free differs from what it would be asked."""
    case = CASES[7, "weld"]
    turned = [0.0, 0.0, 30.0]
    free = applied(case, solve(case, STROKE))
    bound = applied(case, solve(case, dataclasses.replace(STROKE, angular_velocity=turned)))
    w_free = case.gsc.CalcSpatialVelocityInWorld(free).rotational()
    np.testing.assert_allclose(
        case.gsc.CalcSpatialVelocityInWorld(bound).rotational(), turned, atol=1e-8
    )
    assert np.linalg.norm(w_free - turned) > 1.0
    assert np.linalg.norm(case.plant.GetVelocities(free)) < np.linalg.norm(
        case.plant.GetVelocities(bound)
    )


def test_joints_outside_the_limb_stay_where_the_context_has_them():
    case = CASES[7, "weld"]
    arm = Limb(case.plant, case.limb.model_instances, case.limb.hand, case.limb.joints[1:])
    trunk, context = case.limb.joints[0], case.plant.CreateDefaultContext()
    stroke = dataclasses.replace(STROKE, guess_deg={"elevation": 35.0, "elbow": 60.0})
    q = np.full(case.plant.num_positions(), 0.01)  # the racket's joints do not count
    q[trunk.position_start()] = -0.8
    case.plant.SetPositions(context, q)
    state = solve_stroke(case.plant, arm, case.gsc, stroke, context=context)
    np.testing.assert_array_equal(case.plant.GetPositions(context), q)
    assert state.names == tuple(j[0] for j in ARM_7[1:])
    apply_stroke(case.plant, context, arm, case.racket, state)
    assert case.plant.GetPositions(context)[trunk.position_start()] == -0.8
    place = case.gsc.CalcPoseInWorld(context).translation()
    np.testing.assert_allclose(place, stroke.position, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("changes", "key", "says"),
    [
        ({"position": [2.5, -0.6, 1.1]}, "position", "m away"),
        ({"face_azimuth_deg": 170.0}, "face_closed_deg", "nearest found"),
        ({"guess_deg": {"shoulder": 3.0}}, "guess_deg.shoulder", "plane"),
        ({"guess_deg": {"elbow": 146.0}}, "guess_deg.elbow", "-5 to 145"),
        ({"tip_elevation_deg": 86.0}, "tip_elevation_deg", "-85 to 85"),
        ({"face_closed_deg": 90.0}, "face_closed_deg", "-89 to 89"),
        ({"face_azimuth_deg": None, "tip_elevation_deg": 90.0}, "tip_elevation_deg", "to 8"),
        ({"tip_side": "up"}, "tip_side", "left, right"),
        ({"speed": -1.0}, "speed", "0 to 100"),
        ({"speed": math.nan}, "speed", "finite"),
        ({"position": [0.5, 0.0]}, "position", "3 numbers"),
        ({"position": [0.5, 0.0, True]}, "position", "finite"),
        ({"angular_velocity": [0.0, math.inf, None]}, "angular_velocity", "finite"),
        ({"velocity_elevation_deg": 91.0}, "velocity_elevation_deg", "-90 to 90"),
    ],
)
def test_what_cannot_be_is_refused(changes, key, says):
    with pytest.raises(InputError) as error:
        solve(CASES[7, "weld"], dataclasses.replace(STROKE, **changes))
    assert key in error.value.key
    assert says in error.value.allowed


def test_the_distance_out_of_reach_is_right():
    case = CASES[3, "weld"]
    with pytest.raises(InputError, match="stroke: position") as error:
        solve(case, Stroke(position=[1.6, 0.9, None]))
    told = float(error.value.allowed.split(" m away")[0].split()[-1])
    # the reach of a chain of two links and the string-bed's centre, in the plane
    context = case.plant.CreateDefaultContext()
    wrist = case.plant.GetFrameByName("three_link")
    last = np.linalg.norm(case.gsc.CalcPose(context, wrist).translation()[:2])
    assert told == pytest.approx(math.hypot(1.6, 0.9) - 0.3 - 0.25 - last, rel=2e-3)


@pytest.mark.parametrize("held", [("two",), ("one", "two", "three")])
def test_the_distance_out_of_reach_with_joints_that_their_limits_hold(held):
    joints = [
        (name, axis, offset, (20.0, 20.0) if name in held else limits)
        for name, axis, offset, limits in PLANAR
    ]
    case = make_case(joints)
    with pytest.raises(InputError, match="stroke: position") as error:
        solve(case, Stroke(position=[1.6, 0.9, None]))
    told = float(error.value.allowed.split(" m away")[0].split()[-1])
    # brute force over the joints that move
    context = case.plant.CreateDefaultContext()
    wrist = case.plant.GetFrameByName("three_link")
    last = complex(*case.gsc.CalcPose(context, wrist).translation()[:2])
    one, three = np.meshgrid(
        *(np.linspace(*np.radians(joints[i][3]), 721) for i in (0, 2)), indexing="ij"
    )
    two = math.radians(20.0)
    reached = np.exp(1j * one) * (0.3 + np.exp(1j * two) * (0.25 + np.exp(1j * three) * last))
    assert told == pytest.approx(np.abs(reached - (1.6 + 0.9j)).min(), rel=2e-3)


def test_a_velocity_that_the_limb_cannot_give_is_refused():
    case = CASES[3, "weld"]
    ask = Stroke(position=[0.7, 0.3, None], speed=9.0, velocity_elevation_deg=30.0)
    with pytest.raises(InputError, match=r"stroke: speed.*nearest") as error:
        solve(case, ask)
    near_it = 9.0 * math.cos(math.radians(30.0))  # its part in the plane
    assert f"nearest [{near_it:.4g}, " in error.value.allowed
    ask = dataclasses.replace(ask, velocity_elevation_deg=0.0, angular_velocity=[1.0, None, None])
    with pytest.raises(InputError, match=r"stroke: angular_velocity.*nearest"):
        solve(case, ask)


def test_a_joint_that_would_have_to_be_too_fast_is_refused():
    slow = make_case(ARM_7, rate=2.0)
    with pytest.raises(InputError, match=r"rate of joint .*-2 to 2"):
        solve(slow, STROKE)
    solve(slow, dataclasses.replace(STROKE, speed=0.5))


def test_a_racket_that_nothing_holds_needs_its_held_frame():
    case = CASES[7, "grip"]
    with pytest.raises(InputError, match="held_frame"):
        solve_stroke(case.plant, case.limb, case.gsc, STROKE)


def test_a_weld_elsewhere_counts_as_it_is():
    """A racket that is welded with its butt in the hand keeps that, whatever frame is named."""
    case = make_case(ARM_7, held_at="butt")
    near_it = dataclasses.replace(STROKE, position=[0.5, -0.7, 1.1])
    context = applied(case, solve(case, near_it))
    place = case.gsc.CalcPoseInWorld(context).translation()
    np.testing.assert_allclose(place, near_it.position, rtol=0, atol=1e-9)


def test_a_state_of_another_limb_is_refused():
    case = CASES[6, "weld"]
    context = case.plant.CreateDefaultContext()
    with pytest.raises(InputError, match="this limb"):
        apply_stroke(case.plant, context, case.limb, case.racket, solve(CASES[7, "weld"], STROKE))


def test_a_stroke_is_read_from_yaml():
    text = """
    position: [0.55, null, 1.1]
    face_closed_deg: 5
    speed: 22
    angular_velocity: [null, -8, 12]
    guess_deg: {elbow: 30}
    """
    stroke = load_text(text, Stroke, where="stroke")
    assert stroke == Stroke(
        position=[0.55, None, 1.1],
        face_closed_deg=5.0,
        speed=22.0,
        angular_velocity=[None, -8.0, 12.0],
        guess_deg={"elbow": 30.0},
    )
    with pytest.raises(InputError, match="face_tilt"):
        load_text("face_tilt: 3", Stroke, where="stroke")
