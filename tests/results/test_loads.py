"""The racket's load at any joint of any arm, against its weight and its momentum."""

from __future__ import annotations

import numpy as np
import pytest

from drake_racket import InputError, LimbSettings, Scenario, Stroke, make_impact_diagram, simulate
from drake_racket.results.loads import racket_load
from tests.limbs.arms import HUMANOID, striking

GRAVITY = np.array([0.0, 0.0, -9.81])


@pytest.fixture(scope="module", params=["weld", "torsional"])
def still(request, tmp_path_factory):
    """An arm of a file that holds a racket still under gravity, and its system."""
    path = tmp_path_factory.mktemp("arm") / "arm.urdf"
    path.write_text(HUMANOID)
    case = striking(
        path,
        "right_hand",
        grip_kind=request.param,
        gravity=tuple(GRAVITY),
        joint_torques="carry",
        stroke=Stroke(speed=0.0, guess_deg={"right_elbow": 40.0}),
        after=1e-4,
    )
    system = make_impact_diagram(case)
    return case, system, simulate(case, system).history


@pytest.mark.parametrize("joint", ["right_shoulder", "right_elbow", "waist", "hand"])
def test_at_the_start_a_rigid_grip_bears_the_rackets_weight(still, joint):
    """Torque about a joint: the sum of r x m g over the racket's bodies."""
    case, system, history = still
    load = racket_load(history, joint).isel(time=0)
    if case.grip_kind != "weld":
        return  # a spring that is not strained yet bears nothing; see below
    plant, racket = system.plant, system.impact.racket
    context = plant.GetMyContextFromRoot(system.create_context())
    frame = system.limb.limb.hand
    if joint != "hand":
        frame = plant.GetJointByName(joint).frame_on_child()
    place = frame.CalcPoseInWorld(context).translation()
    force, torque = np.zeros(3), np.zeros(3)
    for body in racket.bodies():
        mass = body.get_mass(context)
        if mass > 0.0:
            com = body.CalcCenterOfMassInBodyFrame(context)
            at = body.EvalPoseInWorld(context) @ com
            force += mass * GRAVITY
            torque += np.cross(at - place, mass * GRAVITY)
    # strings and throat do not carry yet either: the free freedoms fall, and give no load
    np.testing.assert_allclose(load["force"].to_numpy(), force, atol=0.25 * 9.81 * 0.31)
    assert np.dot(load["torque"].to_numpy(), torque) > 0.0


@pytest.mark.parametrize("joint", ["right_shoulder", "waist"])
def test_the_load_is_carried_from_the_hand(still, joint):
    """M_J = M_H + (p_H - p_J) x F, with the hand's load taken into the world by its own pose."""
    _, system, history = still
    plant, trajectory = system.plant, history
    load, at_hand = racket_load(history, joint), racket_load(history)
    context = plant.GetMyContextFromRoot(system.create_context())
    hand = system.limb.limb.hand.CalcPoseInWorld(context)
    first = {key: trajectory[f"hand_{key}"].isel(time=0).to_numpy() for key in ("force", "torque")}
    np.testing.assert_allclose(
        at_hand["force"].isel(time=0).to_numpy(),
        hand.rotation().matrix() @ first["force"],
        atol=1e-9,
    )
    frame = plant.GetJointByName(joint).frame_on_child()
    arm = hand.translation() - frame.CalcPoseInWorld(context).translation()
    force = hand.rotation().matrix() @ first["force"]
    wanted = hand.rotation().matrix() @ first["torque"] + np.cross(arm, force)
    np.testing.assert_allclose(load["torque"].isel(time=0).to_numpy(), wanted, atol=1e-9)
    assert load["torque"].attrs["units"] == "N m"


def test_joints_in_one_place_share_it(still):
    case = Scenario(
        support="limb",
        grip_kind="torsional",
        after=5e-4,
        limb=LimbSettings(
            stroke=Stroke(speed=5.0, guess_deg={"shoulder_flexion": 50.0, "elbow_flexion": 20.0})
        ),
    )
    history = simulate(case).history
    one, other = (
        racket_load(history, "shoulder_rotation"),
        racket_load(history, "shoulder_abduction"),
    )
    np.testing.assert_array_equal(one["torque"], other["torque"])


def test_names_and_histories_without_a_load(still):
    with pytest.raises(InputError, match=r"knee.*right_elbow"):
        racket_load(still[2], "knee")
    with pytest.raises(InputError, match="no load on a hand"):
        racket_load(simulate(Scenario(after=2e-4)).history)
