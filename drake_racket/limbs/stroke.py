"""Finds the state in which a limb strikes: racket where, and moving as, a user wants it.

Frames, and how a stroke is described: `parameters.stroke`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, Joint, ModelInstanceIndex
from pydrake.systems.framework import Context

from drake_racket.io.errors import InputError
from drake_racket.limbs.chain import chain_shares
from drake_racket.limbs.limb import Limb
from drake_racket.limbs.stroke_position import (
    TOLERANCE,
    HandKinematics,
    Posture,
    find_posture,
)
from drake_racket.limbs.stroke_velocity import JointVelocities, find_joint_velocities
from drake_racket.parameters.stroke import (
    PoseTarget,
    Stroke,
    Vector,
    check_stroke,
    face_angles,
)
from drake_racket.plant.racket import Racket

__all__ = ["Stroke", "StrokeState", "apply_stroke", "check_stroke", "solve_stroke"]

_ANGULAR_JOINTS = ("revolute", "universal", "ball_rpy")


@dataclass(frozen=True)
class StrokeState:
    """Holds the limb's state for a stroke; see `apply_stroke`.

    Attributes:
        names: (n,) of the limb's position coordinates, joint names where a joint has one.
        q, v: joint positions and velocities, in the order of `Limb.position_indices` and
            `velocity_indices` (rad, rad/s).
        pose_residual: errors of the position (m) and face (rad) components that were asked for.
        velocity_residual: errors of the angular (rad/s) and linear (m/s) components asked for.
        pose_freedom, velocity_freedom: degrees of freedom of the limb that the pose and the
            velocity left open; the guess and the least sum of squared joint rates settled them.
        evaluations: of the limb's kinematics outside the optimizer.

    """

    names: tuple[str, ...]
    q: Vector
    v: Vector
    pose_residual: Vector
    velocity_residual: Vector
    pose_freedom: int
    velocity_freedom: int
    evaluations: int


def solve_stroke(
    plant: MultibodyPlant,
    limb: Limb,
    racket_frame: Frame,
    stroke: Stroke,
    *,
    held_frame: Frame | None = None,
    context: Context | None = None,
) -> StrokeState:
    """Finds joint positions and velocities that move `racket_frame` as `stroke` says.

    The racket is rigid: its own joints rest at zero, and so does a joint between it and the hand.
    The posture is the one nearest to the guess (sum of squares), the velocity the one with the
    least sum of squared joint rates within their limits; where other parts of the model hang on
    the chain (a head, another arm), rates of the joints that carry them count for more, by the
    root of all that they move over what of it is on the chain. Equal arguments give equal bits.

    Args:
        plant: finalized, with the limb and the racket.
        racket_frame: C, usually `racket.frame("gsc")`.
        held_frame: G of the racket, usually `racket.frame("grip")`, to lie on the hand frame if no
            joint or weld ties the racket to the hand (a bushing does not); else it does not count.
        context: the plant's, for the positions of joints outside limb and racket; not changed.

    Raises:
        InputError: the stroke is not valid, or the limb cannot meet it within its joint limits: the
            message says what was asked for and how near it gets.

    """
    check_stroke(stroke)
    if not plant.is_finalized():
        raise InputError("solve_stroke: plant", "not finalized", "a plant after Finalize()")
    scratch = plant.CreateDefaultContext()
    if context is not None:
        scratch.SetTimeStateAndParametersFrom(context)
    _rest(plant, scratch, racket_joints(limb, racket_frame.model_instance()))
    X_HC = _racket_in_hand(limb, racket_frame, held_frame, scratch)
    hand = HandKinematics(limb, scratch, X_HC)
    names = coordinate_names(limb)
    posture = _posture(hand, stroke, _guess(hand, names, stroke.guess_deg))
    hand.set_positions(posture.q)
    motion = _motion(hand, stroke)
    return StrokeState(
        names=names,
        q=plant.GetPositions(scratch)[limb.position_indices()],
        v=hand.velocities(motion.v)[limb.velocity_indices()],
        pose_residual=posture.residual,
        velocity_residual=motion.residual,
        pose_freedom=posture.freedom,
        velocity_freedom=motion.freedom,
        evaluations=hand.evaluations,
    )


def apply_stroke(
    plant: MultibodyPlant,
    context: Context,
    limb: Limb,
    racket: Racket,
    state: StrokeState,
    *,
    held_at: str = "grip",
) -> None:
    """Writes a stroke's state into the plant's Context: limb, and racket rigid in the hand.

    The racket's joints, and one between it and the hand, are set to zero, at rest. A racket that is
    a free body is put with its frame `held_at` on the hand frame, and moves with the hand.

    Raises:
        InputError: unknown frame, or a state of another limb.

    """
    if coordinate_names(limb) != state.names:
        raise InputError("apply_stroke: state", state.names, "a state of this limb")
    q, v = plant.GetPositions(context), plant.GetVelocities(context)
    q[limb.position_indices()], v[limb.velocity_indices()] = state.q, state.v
    for tie in limb.ties:
        leader = q[tie.leader.position_start()], v[tie.leader.velocity_start()]
        q[tie.follower.position_start()] = tie.ratio * leader[0] + tie.offset
        v[tie.follower.velocity_start()] = tie.ratio * leader[1]
    plant.SetPositions(context, q)
    plant.SetVelocities(context, v)
    _rest(plant, context, racket_joints(limb, racket.model_instance))
    handle = racket.handle
    if not handle.is_floating_base_body():
        return
    X_HB = racket.frame(held_at).CalcPose(context, handle.body_frame()).inverse()
    X_WH = limb.hand.CalcPoseInWorld(context)
    V_WH = limb.hand.CalcSpatialVelocityInWorld(context)
    plant.SetFreeBodyPose(context, handle, X_WH @ X_HB)
    plant.SetFreeBodySpatialVelocity(
        context, handle, V_WH.Shift(X_WH.rotation() @ X_HB.translation())
    )


def coordinate_names(limb: Limb) -> tuple[str, ...]:
    """Gives (n,) names of the limb's position coordinates: joint names where a joint has one.

    Raises:
        InputError: a joint of the limb whose positions are not angles or lengths.

    """
    allowed = (*_ANGULAR_JOINTS, "prismatic")
    for joint in limb.joints:
        if joint.type_name() not in allowed:
            raise InputError(f"limb: {joint.name()}", joint.type_name(), ", ".join(allowed))
    names = limb.plant.GetPositionNames(add_model_instance_prefix=False, always_add_suffix=False)
    return tuple(names[i] for i in limb.position_indices())


def racket_joints(limb: Limb, racket: ModelInstanceIndex) -> list[Joint]:
    """Lists the racket's joints, and the one that holds it unless it is the limb's."""
    plant, own = limb.plant, {joint.index() for joint in limb.joints}
    joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
    return [
        joint
        for joint in joints
        if joint.child_body().model_instance() == racket
        and joint.index() not in own
        and joint.num_velocities() < 6
    ]


def _rest(plant: MultibodyPlant, context: Context, joints: list[Joint]) -> None:
    q, v = plant.GetPositions(context), plant.GetVelocities(context)
    for joint in joints:
        q[joint.position_start() : joint.position_start() + joint.num_positions()] = 0.0
        v[joint.velocity_start() : joint.velocity_start() + joint.num_velocities()] = 0.0
    plant.SetPositions(context, q)
    plant.SetVelocities(context, v)


def _racket_in_hand(
    limb: Limb, racket_frame: Frame, held_frame: Frame | None, context: Context
) -> RigidTransform:
    """X_HC; from the joints and welds between them, or G on H where there are none."""
    moved = limb.plant.GetBodiesKinematicallyAffectedBy([limb.joints[-1].index()])
    if racket_frame.body().index() in list(moved):
        return racket_frame.CalcPose(context, limb.hand)
    if held_frame is None:
        raise InputError(
            "solve_stroke: racket_frame",
            racket_frame.name(),
            "a frame that the limb carries, or a racket's with its held_frame (a racket in a grip)",
        )
    return racket_frame.CalcPose(context, held_frame)


def _guess(hand: HandKinematics, names: tuple[str, ...], guess_deg: dict[str, float]) -> Vector:
    for name in guess_deg:
        if name not in names:
            raise InputError(f"stroke: guess_deg.{name}", "an unknown joint", ", ".join(names))
    kinds = [j.type_name() for j in hand.joints for _ in range(j.num_positions())]
    start = hand.plant.GetPositions(hand.plant.CreateDefaultContext())[hand.where]
    guess: Vector = np.clip(start, hand.lower, hand.upper)
    own = hand.plant.GetPositionNames(add_model_instance_prefix=False, always_add_suffix=False)
    names = tuple(own[i] for i in hand.where)
    for name in guess_deg:
        if name not in names:
            allowed = f"the joint that it follows (mimic): {', '.join(names)}"
            raise InputError(f"stroke: guess_deg.{name}", "a joint that follows another", allowed)
    for i, (name, kind) in enumerate(zip(names, kinds, strict=True)):
        if name not in guess_deg:
            continue
        guess[i] = guess_deg[name] if kind == "prismatic" else math.radians(guess_deg[name])
        if not hand.lower[i] <= guess[i] <= hand.upper[i]:
            unit = 1.0 if kind == "prismatic" else math.degrees(1.0)
            raise InputError(
                f"stroke: guess_deg.{name}",
                guess_deg[name],
                f"the joint's range, {unit * hand.lower[i]:.6g} to {unit * hand.upper[i]:.6g}",
            )
    return guess


def _posture(hand: HandKinematics, stroke: Stroke, guess: Vector) -> Posture:
    target = stroke.pose_target()
    posture = find_posture(hand, target, guess)
    if posture.error <= TOLERANCE:
        return posture
    X_WC = hand.pose(posture.q)
    p_WC, angles = X_WC.translation(), np.degrees(face_angles(X_WC.rotation().matrix()))
    place = PoseTarget(target.position, np.full(3, math.nan))
    alone = find_posture(hand, place, guess)
    if alone.error > TOLERANCE:
        p_WC = hand.pose(alone.q).translation()
        raise InputError(
            "stroke: position",
            stroke.position,
            f"within the limb's reach and joint limits; nearest found {_text(p_WC)} m, "
            f"{np.linalg.norm(alone.residual):.3g} m away, whatever the face",
        )
    raise InputError(
        "stroke: face_closed_deg, face_azimuth_deg, tip_elevation_deg",
        [stroke.face_closed_deg, stroke.face_azimuth_deg, stroke.tip_elevation_deg],
        f"a face within the limb's joint limits at the position {stroke.position}; nearest found "
        f"{_text(angles)} degrees (tip {stroke.tip_side} asked) at {_text(p_WC)} m",
    )


def _motion(hand: HandKinematics, stroke: Stroke) -> JointVelocities:
    """Joint velocities in the posture that `hand` is in."""
    J, wanted = hand.jacobian(of_rates=False), stroke.velocity_target()
    bounds = (hand.slowest, hand.fastest) if stroke.rate_limits else None
    weights = _weights(hand)
    motion = find_joint_velocities(J, wanted, weights=weights, bounds=bounds)
    if not motion.met:
        linear = np.concatenate([np.full(3, math.nan), wanted[3:]])
        alone = find_joint_velocities(J, linear, weights=weights)
        if not alone.met:
            raise InputError(
                "stroke: speed, velocity_elevation_deg, velocity_azimuth_deg",
                [stroke.speed, stroke.velocity_elevation_deg, stroke.velocity_azimuth_deg],
                f"a velocity that the limb can give in this posture; asked {_text(wanted[3:])}, "
                f"nearest {_text((J @ alone.v)[3:])} m/s",
            )
        raise InputError(
            "stroke: angular_velocity",
            stroke.angular_velocity,
            "one that the limb can give in this posture along with the linear velocity; nearest "
            f"{_text((J @ motion.v)[:3])} rad/s with {_text((J @ motion.v)[3:])} m/s",
        )
    if bounds is not None:
        _check_rates(hand, motion.v)
    return motion


def _weights(hand: HandKinematics) -> Vector:
    """How dear a joint's rate is: the root of what it moves over what of that is on the chain.

    1 in a model without branches. A trunk that carries a second arm and a head turns less.
    """
    share = chain_shares(hand.limb)
    return np.concatenate(
        [np.full(joint.num_velocities(), share[joint.name()] ** 0.5) for joint in hand.joints]
    )


def _check_rates(hand: HandKinematics, rates: Vector) -> None:
    names = hand.plant.GetVelocityNames(add_model_instance_prefix=False, always_add_suffix=False)
    for i, rate, low, high in zip(hand.rates, rates, hand.slowest, hand.fastest, strict=True):
        if not low <= rate <= high:
            raise InputError(
                f"stroke: speed, angular_velocity (rate of joint {names[i]})",
                round(float(rate), 6),
                f"the joint's range of rates, {low:g} to {high:g} (no rates within the joints'"
                " ranges meet the stroke; rate_limits: false ignores them)",
            )


def _text(values: Vector) -> str:
    return "[" + ", ".join(f"{x:.4g}" for x in values) + "]"
