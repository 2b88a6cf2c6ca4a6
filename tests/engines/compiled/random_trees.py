"""Makes plants of random trees: all joints that the compiled engine covers, all its forces."""

from __future__ import annotations

import math

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BallRpyJoint,
    LinearBushingRollPitchYaw,
    PlanarJoint,
    PrismaticJoint,
    PrismaticSpring,
    QuaternionFloatingJoint,
    RevoluteJoint,
    RevoluteSpring,
    RpyFloatingJoint,
    ScrewJoint,
    SpatialInertia,
    UnitInertia,
    UniversalJoint,
)

KINDS = (
    "weld",
    "revolute",
    "prismatic",
    "screw",
    "universal",
    "planar",
    "ball",
    "quaternion",
    "rpy",
    "free",
)
REVERSIBLE = ("weld", "revolute", "prismatic")


def _pose(rng) -> RigidTransform:
    return RigidTransform(RollPitchYaw(rng.uniform(-1.0, 1.0, 3)), rng.uniform(-0.4, 0.4, 3))


def _inertia(rng) -> SpatialInertia:
    moments = rng.uniform(0.01, 0.05, 3)
    unit = UnitInertia(*(moments + moments.max()))
    about_com = SpatialInertia(rng.uniform(0.1, 2.0), np.zeros(3), unit)
    return about_com.ReExpress(RollPitchYaw(rng.uniform(-1, 1, 3)).ToRotationMatrix()).Shift(
        rng.uniform(-0.2, 0.2, 3)
    )


def _joint(kind, name, a, b, rng):
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    damping = float(rng.uniform(0.0, 0.5))
    if kind == "revolute":
        return RevoluteJoint(name, a, b, axis, -math.inf, math.inf, damping)
    if kind == "prismatic":
        return PrismaticJoint(name, a, b, axis, -math.inf, math.inf, damping)
    if kind == "screw":
        return ScrewJoint(name, a, b, axis, float(rng.uniform(-0.3, 0.3)), damping)
    if kind == "universal":
        return UniversalJoint(name, a, b, damping)
    if kind == "planar":
        return PlanarJoint(name, a, b, rng.uniform(0.0, 0.5, 3))
    if kind == "ball":
        return BallRpyJoint(name, a, b, damping)
    if kind == "quaternion":
        return QuaternionFloatingJoint(name, a, b, damping, float(rng.uniform(0.0, 0.5)))
    return RpyFloatingJoint(name, a, b, damping, float(rng.uniform(0.0, 0.5)))


def make_tree(kinds, parents, reverse, seed) -> MultibodyPlant:
    """A finalized plant: body i + 1 hangs on body `parents[i]` by a joint of `kinds[i]`.

    Args:
        reverse: by body, the joint's parent is the outer body.

    """
    rng = np.random.default_rng(seed)
    plant = MultibodyPlant(0.0)
    bodies = [plant.world_body()]
    for i, (kind, parent) in enumerate(zip(kinds, parents, strict=True)):
        body = plant.AddRigidBody(f"body_{i}", _inertia(rng))
        inner, outer = bodies[parent % len(bodies)], body
        bodies.append(body)
        if kind == "free":
            continue
        if reverse[i] and kind in REVERSIBLE:
            inner, outer = outer, inner
        a = plant.AddFrame(_frame(f"a_{i}", inner, rng))
        b = plant.AddFrame(_frame(f"b_{i}", outer, rng))
        if kind == "weld":
            plant.WeldFrames(a, b, _pose(rng))
            continue
        joint = plant.AddJoint(_joint(kind, f"joint_{i}", a, b, rng))
        if kind == "revolute":
            plant.AddForceElement(RevoluteSpring(joint, *rng.uniform(0.1, 5.0, 2)))
        if kind == "prismatic":
            plant.AddForceElement(PrismaticSpring(joint, *rng.uniform(0.1, 5.0, 2)))
        if kind in ("revolute", "prismatic", "screw") and rng.random() < 0.5:
            actuator = plant.AddJointActuator(f"motor_{i}", joint)
            actuator.set_default_rotor_inertia(float(rng.uniform(0.0, 0.1)))
            actuator.set_default_gear_ratio(float(rng.uniform(1.0, 3.0)))
    for _ in range(2):
        first, second = rng.choice(len(bodies), 2, replace=False) if len(bodies) > 1 else (0, 0)
        a = plant.AddFrame(_frame(f"c_{plant.num_frames()}", bodies[first], rng))
        c = plant.AddFrame(_frame(f"d_{plant.num_frames()}", bodies[second], rng))
        plant.AddForceElement(LinearBushingRollPitchYaw(a, c, *rng.uniform(0.0, 3.0, (4, 3))))
    plant.mutable_gravity_field().set_gravity_vector(rng.uniform(-9.81, 9.81, 3))
    plant.Finalize()
    return plant


def _frame(name, body, rng):
    from pydrake.multibody.tree import FixedOffsetFrame

    return FixedOffsetFrame(name, body.body_frame(), _pose(rng))


def random_state(plant: MultibodyPlant, rng, spread: float = 0.6) -> np.ndarray:
    """[q; v] with unit quaternions, away from where roll, pitch and yaw are not unique."""
    state = rng.uniform(-spread, spread, plant.num_multibody_states())
    for joint in (plant.get_joint(i) for i in plant.GetJointIndices()):
        if joint.type_name() == "quaternion_floating":
            q = rng.normal(size=4)
            start = joint.position_start()
            state[start : start + 4] = q / np.linalg.norm(q)
    return state
