"""Reads the tree of a plant's bodies: which node carries each of them, axis by axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Joint, RigidBody
from pydrake.systems.framework import Context

from drake_racket.engines.compiled.dynamics import layout as at
from drake_racket.io.errors import InputError

Array = NDArray[np.float64]

_AXES = {
    "revolute": at.REVOLUTE,
    "prismatic": at.PRISMATIC,
    "screw": at.SCREW,
}
_COVERED = (
    "weld",
    *_AXES,
    "universal",
    "planar",
    "ball_rpy",
    "quaternion_floating",
    "rpy_floating",
)


@dataclass
class Node:
    """A node is one axis of a joint, or a body free in the world; fields as in `layout`."""

    parent: int
    kind: int
    carrier: int
    axis: int = 2
    q: int = 0
    v: int = 0
    X_PF: RigidTransform = field(default_factory=RigidTransform)
    pitch: float = 0.0
    joint: Joint | None = None


@dataclass
class Leaf:
    """A leaf is a point mass on a prismatic joint."""

    parent: int
    joint: Joint
    body: RigidBody
    X_PF: RigidTransform
    axis: Array


class Tree:
    """The tree says which node each body of a plant is on, and where on it."""

    def __init__(
        self,
        plant: MultibodyPlant,
        context: Context,
        leaves: Sequence[Joint],
        kept: Sequence[Joint],
    ) -> None:
        self.plant, self.context = plant, context
        self.nodes: list[Node] = []
        self.leaves: list[Leaf] = []
        self.place: dict[int, tuple[int, RigidTransform]] = {0: (-1, RigidTransform())}
        self._as_leaf = {int(joint.index()) for joint in leaves}
        self._kept = {int(joint.index()) for joint in kept}
        self._grow()

    def _grow(self) -> None:
        plant = self.plant
        joints = [plant.get_joint(i) for i in plant.GetJointIndices()]
        for joint in joints:
            _check_joint(joint, self.context)
        waiting = joints
        while waiting:
            later = []
            for joint in waiting:
                parent, child = int(joint.parent_body().index()), int(joint.child_body().index())
                if parent in self.place and child in self.place:
                    raise InputError(f"joint {joint.name()}", "a loop", "a tree of joints")
                if parent in self.place:
                    self._attach(joint, False)
                elif child in self.place:
                    self._attach(joint, True)
                else:
                    later.append(joint)
            if len(later) == len(waiting):
                raise InputError("plant", "bodies that no joint ties to the world", "a whole tree")
            waiting = later

    def _attach(self, joint: Joint, reverse: bool) -> None:
        inner, outer = joint.frame_on_parent(), joint.frame_on_child()
        if reverse:
            inner, outer = outer, inner
        node, X_NB = self.place[int(inner.body().index())]
        X_NF = X_NB @ inner.CalcPoseInBodyFrame(self.context)
        X_MB = outer.CalcPoseInBodyFrame(self.context).inverse()
        body = int(outer.body().index())
        kind = joint.type_name()
        if int(joint.index()) in self._as_leaf:
            axis = X_NF.rotation().matrix() @ _axis_of(joint)
            self.leaves.append(Leaf(node, joint, outer.body(), X_NF, axis))
            self.place[body] = (node, X_NF @ X_MB)
        elif kind == "weld":
            X = joint.X_FM()
            X_FM = X.inverse() if reverse else X
            if int(joint.index()) in self._kept:
                self.nodes.append(Node(node, at.WELD, node, X_PF=X_NF @ X_FM, joint=joint))
                self.place[body] = (len(self.nodes) - 1, X_MB)
            else:
                self.place[body] = (node, X_NF @ X_FM @ X_MB)
        else:
            turn = self._chain(joint, node, X_NF, reverse)
            self.place[body] = (len(self.nodes) - 1, RigidTransform(turn.inverse()) @ X_MB)

    def _add(self, **values: Any) -> int:
        self.nodes.append(Node(**values))
        return len(self.nodes) - 1

    def _chain(self, joint: Joint, parent: int, X: RigidTransform, reverse: bool) -> RotationMatrix:
        """The nodes of a joint; returns how the last one's axes are turned from the joint's."""
        kind = joint.type_name()
        if kind in _AXES or kind in ("universal", "planar"):
            return self._steps(joint, parent, X, reverse)
        q, v = joint.position_start(), joint.velocity_start()
        quaternion, floating = kind == "quaternion_floating", kind != "ball_rpy"
        if floating and parent < 0:
            what = at.FREE_QUATERNION if quaternion else at.FREE_RPY
            self._add(parent=-1, kind=what, carrier=-1, q=q, v=v, X_PF=X, joint=joint)
            return RotationMatrix()
        if floating:
            place = q + (4 if quaternion else 3)
            for k in range(3):
                own = {"kind": at.PRISMATIC, "axis": k, "q": place + k, "v": v + 3 + k}
                parent = self._add(parent=parent, carrier=parent, X_PF=X, joint=joint, **own)
                X = RigidTransform()
        carrier = parent
        for k in range(3):
            last = at.QUATERNION if quaternion else at.RPY
            own = {"kind": last if k == 2 else at.SPIN, "axis": k, "q": q, "v": v + k}
            parent = self._add(parent=parent, carrier=carrier, X_PF=X, joint=joint, **own)
            X = RigidTransform()
        return RotationMatrix()

    def _steps(self, joint: Joint, parent: int, X: RigidTransform, reverse: bool) -> RotationMatrix:
        """The nodes of a joint whose axes follow on each other, along an axis of the node's own.

        Drake reverses joints of one axis only: q stays, and the axis turns round.
        """
        turn = RotationMatrix()
        for k, (kind, axis, pitch) in enumerate(_axes_of(joint)):
            along, to_axis = _axis_and_turn(-axis if reverse else axis)
            parent = self._add(
                parent=parent,
                carrier=parent,
                kind=kind,
                axis=along,
                q=joint.position_start() + k,
                v=joint.velocity_start() + k,
                X_PF=X @ RigidTransform(turn.inverse() @ to_axis),
                pitch=pitch,
                joint=joint,
            )
            turn, X = to_axis, RigidTransform()
        return turn


def _axis_of(joint: Joint) -> Array:
    if joint.type_name() == "revolute":
        return np.array(joint.revolute_axis())
    if joint.type_name() == "prismatic":
        return np.array(joint.translation_axis())
    # a ScrewJoint does not tell its axis in Python: see how it turns
    plant = joint.GetParentPlant()
    context = plant.CreateDefaultContext()
    velocities = np.zeros(plant.num_velocities())
    velocities[joint.velocity_start()] = 1.0
    plant.SetVelocities(context, velocities)
    inner = joint.frame_on_parent()
    return np.array(joint.frame_on_child().CalcSpatialVelocity(context, inner, inner).rotational())


def _axes_of(joint: Joint) -> list[tuple[int, Array, float]]:
    """Kind, axis and pitch of each axis of a joint, from the parent on."""
    kind = joint.type_name()
    if kind == "universal":
        return [(at.REVOLUTE, np.eye(3)[0], 0.0), (at.REVOLUTE, np.eye(3)[1], 0.0)]
    if kind == "planar":
        return [
            (at.PRISMATIC, np.eye(3)[0], 0.0),
            (at.PRISMATIC, np.eye(3)[1], 0.0),
            (at.REVOLUTE, np.eye(3)[2], 0.0),
        ]
    pitch = joint.screw_pitch() / (2.0 * np.pi) if kind == "screw" else 0.0
    return [(_AXES[kind], _axis_of(joint), pitch)]


def _axis_and_turn(axis: Array) -> tuple[int, RotationMatrix]:
    """A number of an axis, and the rotation whose axis of that number is `axis`.

    The rotation is the identity for x, y and z, else z is turned.
    """
    for k in range(3):
        if axis[k] == 1.0:
            return k, RotationMatrix()
    z = axis / np.linalg.norm(axis)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return 2, RotationMatrix(np.stack([x, np.cross(z, x), z], axis=1))


def _check_joint(joint: Joint, context: Context) -> None:
    if joint.type_name() not in _COVERED:
        raise InputError(
            f"compiled engine: joint {joint.name()}", joint.type_name(), ", ".join(_COVERED)
        )
    if joint.num_velocities() and joint.is_locked(context):
        raise InputError(
            f"compiled engine: joint {joint.name()}", "locked", "an unlocked joint (or a weld)"
        )
