"""Accelerations of the whole diagram against an independently derived free racket (Kane)."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialVelocity

from drake_racket import Scenario, make_impact_diagram
from drake_racket.laws.contact import CONTACT
from tests.conftest import BEDS, free_parameters
from tests.oracles.free_racket import FreeRacketState, accelerations

SPEED = 25.0


def random_state(rng: np.random.Generator, params, contact: bool, offset) -> FreeRacketState:
    """All coordinates and velocities at sizes that an impact reaches."""
    rotation = RotationMatrix(_random_rotation(rng)).matrix()
    butt = rng.normal(0.0, 1.0, 3)
    theta_z, theta_y = rng.normal(0.0, 0.02, 2)
    z = rng.normal(0.0, 0.01, 9)
    # the ball near its string mass, on either side
    head = rotation @ _rotation_hb(theta_z, theta_y)
    throat = butt + rotation @ [params.handle_length, 0.0, 0.0]
    i = params.contact_index
    mass = throat + head @ [
        params.gsc + params.grid_xy[i, 0],
        params.grid_xy[i, 1],
        z[i],
    ]
    ball = mass + head @ np.append(rng.normal(0.0, 0.01, 2), rng.uniform(-0.015, -0.001))
    return FreeRacketState(
        R_WH=rotation,
        p_WHo=butt,
        theta_z=theta_z,
        theta_y=theta_y,
        z=z,
        p_WQ=ball,
        w_WH=rng.normal(0.0, 10.0, 3),
        v_WHo=rng.normal(0.0, 5.0, 3),
        theta_z_dot=rng.normal(0.0, 10.0),
        theta_y_dot=rng.normal(0.0, 10.0),
        z_dot=rng.normal(0.0, 10.0, 9),
        v_WQ=rng.normal(0.0, 10.0, 3) - head @ [0.0, 0.0, 20.0],
        in_contact=contact,
        offset=offset,
    )


def _random_rotation(rng):
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return q if np.linalg.det(q) > 0 else -q


def _rotation_hb(theta_z, theta_y):
    cz, sz, cy, sy = np.cos(theta_z), np.sin(theta_z), np.cos(theta_y), np.sin(theta_y)
    about_z = np.array([[cz, -sz, 0.0], [sz, cz, 0.0], [0.0, 0.0, 1.0]])
    about_y = np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])
    return about_z @ about_y


def set_state(system, root, state: FreeRacketState, params, point: int) -> None:
    plant, racket, ball = system.plant, system.impact.racket, system.impact.ball
    context = plant.GetMyMutableContextFromRoot(root)
    pose = RigidTransform(RotationMatrix(state.R_WH), state.p_WHo)
    plant.SetFreeBodyPose(context, racket.handle, pose)
    plant.SetFreeBodySpatialVelocity(
        context, racket.handle, SpatialVelocity(state.w_WH, state.v_WHo)
    )
    plant.SetFreeBodyPose(context, ball.body, RigidTransform(state.p_WQ))
    plant.SetFreeBodySpatialVelocity(context, ball.body, SpatialVelocity(np.zeros(3), state.v_WQ))
    racket.in_plane.set_angle(context, state.theta_z)
    racket.out_of_plane.set_angle(context, state.theta_y)
    racket.in_plane.set_angular_rate(context, state.theta_z_dot)
    racket.out_of_plane.set_angular_rate(context, state.theta_y_dot)
    for joint, z, rate in zip(racket.string_joints, state.z, state.z_dot, strict=True):
        joint.set_translation(context, z)
        joint.set_translation_rate(context, rate)
    contact = system.impact.contact.GetMyMutableContextFromRoot(root)
    latched = np.zeros(17)
    if state.in_contact:
        displacement = params.friction == "displacement"
        latched[:13] = [
            CONTACT,
            point,
            SPEED,
            params.kb,
            params.cb,
            params.mu,
            *state.offset,
            params.eps_d if displacement else params.eps_v,
            displacement,
            params.hb,
            params.db,
            params.reaction_at == "ball",
        ]
    contact.SetDiscreteState(latched)


@pytest.mark.parametrize("case", range(100))
def test_accelerations_equal_the_oracle(case, systems):
    rng = np.random.default_rng(case)
    racket, tension = BEDS[case % 4]
    contact = case % 5 != 0  # every fifth state flies free
    friction = ("velocity", "displacement")[case % 2]
    reaction_at = ("ball", "string_mass")[(case // 2) % 2]
    point = 1 + case % 9
    params = free_parameters(racket, tension, point, SPEED, friction, reaction_at)
    if case % 3 == 0:
        params = dataclasses.replace(params, hb=2e6, db=1500.0)  # normal law hunt_crossley
    state = random_state(rng, params, contact, tuple(rng.normal(0.0, 0.005, 2)))
    system = systems[racket, tension]
    root = system.create_context(
        Scenario(racket=racket, tension=tension, point=point, friction_reading=friction)
    )
    set_state(system, root, state, params, point)
    expected = accelerations(params, state)

    plant = system.plant
    context = plant.GetMyContextFromRoot(root)
    derivatives = plant.EvalTimeDerivatives(context).get_generalized_velocity().CopyToVector()
    ball = system.impact.ball.body
    racket_handles = system.impact.racket
    start, ball_start = (
        body.floating_velocities_start_in_v() for body in (racket_handles.handle, ball)
    )
    strings = [j.velocity_start() for j in racket_handles.string_joints]
    pairs = {
        "alpha": (derivatives[start : start + 3], expected.alpha_WH),
        "butt": (derivatives[start + 3 : start + 6], expected.a_WHo),
        "in plane": (
            derivatives[racket_handles.in_plane.velocity_start()],
            expected.theta_z_ddot,
        ),
        "out of plane": (
            derivatives[racket_handles.out_of_plane.velocity_start()],
            expected.theta_y_ddot,
        ),
        "strings": (derivatives[strings], expected.z_ddot),
        "ball": (derivatives[ball_start + 3 : ball_start + 6], expected.a_WQ),
    }
    for name, (model, oracle) in pairs.items():
        scale = max(1.0, float(np.max(np.abs(oracle))))
        assert np.max(np.abs(model - oracle)) < 1e-9 * scale, name
    normal = system.impact.contact.GetOutputPort("contact_state").Eval(
        system.impact.contact.GetMyContextFromRoot(root)
    )[4]
    assert normal == pytest.approx(expected.N, rel=1e-10, abs=1e-9)
    assert (expected.N != 0.0) <= contact


@pytest.fixture(scope="module")
def systems():
    return {bed: make_impact_diagram(Scenario(racket=bed[0], tension=bed[1])) for bed in BEDS}
