"""Settles a limb's joints before `Finalize`: where they start, which are locked, which tied.

A locked joint becomes a weld at its value, on a continuous and on a discrete plant alike.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Joint, WeldJoint

from drake_racket.io.errors import InputError, one_line
from drake_racket.limbs.limb import Limb, Tie

OTHERS = "others"
"""Stands for all joints that are not on the chain, in a list of locked ones."""

LEAST_RATE = 1e-3
"""Rate limits below this (rad/s, m/s) are no joint's: an exporter's placeholder, like 0."""


def settle_joints(
    plant: MultibodyPlant,
    limb: Limb,
    *,
    locked: Sequence[str] = (),
    initial_deg: Mapping[str, float] | None = None,
    key: str = "limb",
) -> Limb:
    """Locks joints of a limb, and sets where its other joints start. Before `Finalize`.

    Joints off the chain start at their model's default, clipped into their range. On a continuous
    plant, which has no constraints, joints off the chain that are tied to each other are locked at
    what the tie gives; a tied joint of the chain is refused unless it is locked.

    Args:
        locked: names of joints; `others` stands for all that are not on the chain.
        initial_deg: where joints start, or are locked, by name (degrees; m at a prismatic joint).

    Returns:
        The limb as it is then.

    Raises:
        InputError: an unknown name, a value outside the joint's range, a joint that cannot be
            locked, or a tie that the plant cannot hold.

    """
    by_name = {joint.name(): joint for joint in (*limb.joints, *limb.others())}
    start = _start(limb, by_name, initial_deg or {}, key)
    names = _locked_names(limb, by_name, locked, key)
    ties, fixed = _settle_ties(plant, limb, names, start, key)
    notes = [*limb.notes, *_rate_notes(limb.joints)]
    if automatic := [name for name in fixed if name not in names]:
        notes.append(
            f"joints tied to others are locked where they start: {', '.join(automatic)}"
            " (a continuous plant has no constraints; time_step above 0 lets them move)"
        )
    for name, value in start.items():
        if name not in fixed and by_name[name].num_positions() == 1:
            by_name[name].set_default_positions([value])
    hand, joints = limb.hand, [j for j in limb.joints if j.name() not in fixed]
    _lock(plant, {name: (by_name[name], start[name]) for name in fixed}, limb.ties, ties, key)
    if not joints:
        raise InputError(f"{key}: locked", list(fixed), "a joint of the chain that stays free")
    return Limb(plant, limb.model_instances, hand, tuple(joints), tuple(ties), tuple(notes))


def with_ties(limb: Limb, ties: Iterable[Tie]) -> Limb:
    """Gives the limb with ties whose leader is on the chain wherever one of a group is."""
    on_chain = {joint.name() for joint in limb.joints}
    result = []
    for group in _groups(ties):
        members: dict[str, tuple[Joint, float, float]] = {}  # q = a q_root + b
        root = next(iter(group)).leader
        members[root.name()] = (root, 1.0, 0.0)
        waiting = list(group)
        while waiting:
            for tie in waiting:
                if tie.leader.name() in members:
                    _, a, b = members[tie.leader.name()]
                    new = (tie.follower, tie.ratio * a, tie.ratio * b + tie.offset)
                elif tie.follower.name() in members and tie.ratio != 0.0:
                    _, a, b = members[tie.follower.name()]
                    new = (tie.leader, a / tie.ratio, (b - tie.offset) / tie.ratio)
                else:
                    continue
                members.setdefault(new[0].name(), new)
                waiting.remove(tie)
                break
            else:
                raise InputError("limb: mimic", waiting[0].follower.name(), "a ratio other than 0")
        lead = next((n for n in members if n in on_chain), root.name())
        leader, a0, b0 = members[lead]
        if a0 == 0.0:
            raise InputError("limb: mimic", lead, "a ratio other than 0")
        for name, (joint, a, b) in members.items():
            if name != lead:
                result.append(Tie(joint, leader, a / a0, b - a * b0 / a0))
    return replace(limb, ties=tuple(result))


def _groups(ties: Iterable[Tie]) -> list[list[Tie]]:
    groups: list[list[Tie]] = []
    for tie in ties:
        names = {tie.leader.name(), tie.follower.name()}
        touching = [
            g for g in groups if any({t.leader.name(), t.follower.name()} & names for t in g)
        ]
        merged = [t for g in touching for t in g] + [tie]
        groups = [g for g in groups if g not in touching] + [merged]
    return groups


def find_joint(name: str, names: Iterable[str], key: str) -> str:
    """Gives the name if it is one of `names`, or a scoped one (`model::name`) of one.

    Raises:
        InputError: naming the near one and some others.

    """
    known = list(names)
    plain = name.rpartition("::")[2]
    if plain in known:
        return plain
    near = difflib.get_close_matches(name, known, n=1)
    some = ", ".join(known[:20]) + (", ..." if len(known) > 20 else "")
    raise InputError(key, name, f"{near[0]} (of {some})" if near else some)


def _start(
    limb: Limb, by_name: Mapping[str, Joint], initial_deg: Mapping[str, float], key: str
) -> dict[str, float]:
    """Where the joints of one freedom start; those off the chain within their ranges."""
    start = {
        n: float(j.default_positions()[0]) for n, j in by_name.items() if j.num_positions() == 1
    }
    for joint in limb.others():
        if joint.name() in start:
            low, high = joint.position_lower_limits()[0], joint.position_upper_limits()[0]
            start[joint.name()] = float(np.clip(start[joint.name()], low, high))
    for given, value in initial_deg.items():
        where = f"{key}: initial_deg.{given}"
        name = find_joint(given, by_name, where)
        if name not in start:
            raise InputError(where, value, "a joint of one degree of freedom")
        joint = by_name[name]
        low, high = joint.position_lower_limits()[0], joint.position_upper_limits()[0]
        slides = joint.type_name() == "prismatic"
        one, unit = (1.0, "m") if slides else (math.radians(1.0), "degrees")
        if not (math.isfinite(value) and low <= one * value <= high):
            allowed = f"the joint's range, {low / one:.6g} to {high / one:.6g} {unit}"
            raise InputError(where, value, allowed)
        start[name] = one * float(value)
    return start


def _locked_names(
    limb: Limb, by_name: Mapping[str, Joint], locked: Sequence[str], key: str
) -> list[str]:
    names: list[str] = []
    for given in locked:
        if given == OTHERS:
            names += [joint.name() for joint in limb.others()]
        else:
            names.append(find_joint(given, [*by_name, OTHERS], f"{key}: locked"))
    for name in names:
        if by_name[name].num_positions() != 1:
            allowed = "joints of one degree of freedom"
            raise InputError(f"{key}: locked", name, allowed)
    return list(dict.fromkeys(names))


def _settle_ties(
    plant: MultibodyPlant, limb: Limb, locked: list[str], start: dict[str, float], key: str
) -> tuple[list[Tie], list[str]]:
    """The ties that stay, and the names of all joints to lock; tied ones start where they must."""
    kept: list[Tie] = []
    fixed = list(locked)
    on_chain = {joint.name() for joint in limb.joints}
    for group in _groups(limb.ties):
        leader = group[0].leader.name()
        members = [leader, *(tie.follower.name() for tie in group)]
        held = [name for name in members if name in locked]
        free = [name for name in members if name in on_chain and name not in locked]
        if not held and free and plant.time_step() == 0.0:
            raise InputError(
                f"{key}: joint {group[0].follower.name()}",
                f"tied to {leader} (mimic), of the chain to the hand",
                "time_step above 0 (a continuous plant has no constraints), or"
                f" locked: [{free[0]}], which locks all that are tied to it",
            )
        if held:  # the value of the one that is named decides
            tie = next((t for t in group if t.follower.name() == held[0]), None)
            if tie is not None and tie.ratio != 0.0:
                start[leader] = (start[held[0]] - tie.offset) / tie.ratio
        for tie in group:
            start[tie.follower.name()] = tie.ratio * start[leader] + tie.offset
        if held or plant.time_step() == 0.0:
            fixed += [name for name in members if name not in fixed]
        else:
            kept += group
    return kept, fixed


def _lock(
    plant: MultibodyPlant,
    joints: Mapping[str, tuple[Joint, float]],
    before: Sequence[Tie],
    kept: Sequence[Tie],
    key: str,
) -> None:
    """Replaces joints by welds. Constraints stand in the way of that, and are made anew."""
    if not joints:
        return
    if plant.num_constraints() > len(before):
        raise InputError(
            f"{key}: locked",
            list(joints),
            f"no locks in a plant with constraints of its own ({plant.num_constraints()})",
        )
    for identity in plant.GetConstraintIds():
        plant.RemoveConstraint(identity)
    indices = {joint.index() for joint, _ in joints.values()}
    for index in list(plant.GetJointActuatorIndices()):
        actuator = plant.get_joint_actuator(index)
        if actuator.joint().index() in indices:
            plant.RemoveJointActuator(actuator)
    for name, (joint, value) in joints.items():
        frames = joint.frame_on_parent(), joint.frame_on_child()
        X_FM = displacement(joint, value, f"{key}: locked")
        try:
            plant.RemoveJoint(joint)
        except RuntimeError as error:
            reason = one_line(str(error), 160)
            allowed = f"no locks in a model with joint springs or bushings ({reason})"
            raise InputError(f"{key}: locked", name, allowed) from None
        plant.AddJoint(WeldJoint(name, *frames, X_FM))
    for tie in kept:
        plant.AddCouplerConstraint(tie.follower, tie.leader, tie.ratio, tie.offset)


def displacement(joint: Joint, value: float, key: str) -> RigidTransform:
    """Gives X_FM of a joint of one freedom at `value` (rad or m)."""
    kind = joint.type_name()
    if kind == "revolute":
        axis = joint.revolute_axis()
        return RigidTransform(_about(axis, value), [0.0, 0.0, 0.0])
    if kind == "prismatic":
        return RigidTransform(value * joint.translation_axis())
    if kind == "screw":
        axis = joint.screw_axis()
        travel = joint.screw_pitch() * value / (2.0 * math.pi)
        return RigidTransform(_about(axis, value), travel * np.asarray(axis))
    raise InputError(key, f"{joint.name()} ({kind})", "a revolute, prismatic or screw joint")


def _about(axis: np.ndarray, angle: float) -> RotationMatrix:
    from pydrake.common.eigen_geometry import AngleAxis

    return RotationMatrix(AngleAxis(angle, axis / np.linalg.norm(axis)))


def _rate_notes(joints: Sequence[Joint]) -> list[str]:
    unknown = [joint.name() for joint in joints if unknown_rates(joint)]
    if not unknown:
        return []
    return [f"rate limits of 0 (or nearly) are taken as unknown: {', '.join(unknown)}"]


def unknown_rates(joint: Joint) -> bool:
    """Tells whether a joint's rate limits are a placeholder, and bound nothing."""
    most = joint.velocity_upper_limits()
    least = joint.velocity_lower_limits()
    return bool(np.all(np.maximum(np.abs(most), np.abs(least)) < LEAST_RATE))
