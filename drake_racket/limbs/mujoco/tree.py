"""Reads a compiled MuJoCo model's tree of bodies and joints, as plain data.

MuJoCo places body B by a constant pose in its parent, then applies the body's joints in order, each
in the frame that the ones before it leave: a rotation about the line through `jnt_pos` along
`jnt_axis` by q - qpos0, or a slide along `jnt_axis` by q - qpos0 (MuJoCo documentation,
XML reference, "joint"; `mj_kinematics`). A ball's quaternion is taken as it is, whatever qpos0.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform, RotationMatrix

from drake_racket.io.errors import InputError
from drake_racket.limbs.left_out import short_list
from drake_racket.limbs.mujoco.couplings import joint_couplings, joint_values
from drake_racket.limbs.mujoco.model import (
    body_name,
    enabled,
    joint_name,
    mujoco_package,
)

Kind = Literal["hinge", "slide", "ball"]


@dataclass(frozen=True)
class TreeJoint:
    """Holds one joint, in the frame of its body.

    Attributes:
        id: in the MuJoCo model.
        axis: unit vector; of no meaning for a ball.
        anchor: `jnt_pos`, m.
        qpos0: where the body is as drawn, rad or m; 0 for a ball.
        value: where the joint starts or is locked, rad or m; 0 for a ball, which starts unrotated.
        locked: it is a constant pose, without a degree of freedom.
        limits: lowest and highest position if it has a range; None for a ball.
        damping, armature: N m s/rad, kg m^2 (N s/m, kg for a slide).
        stiffness, spring_at: N m/rad (N/m); where that spring is at rest.

    """

    id: int
    name: str
    kind: Kind
    axis: NDArray[np.float64]
    anchor: NDArray[np.float64]
    qpos0: float
    value: float
    locked: bool
    limits: tuple[float, float] | None
    damping: float
    armature: float
    stiffness: float
    spring_at: float

    def displacement(self, value: float) -> RigidTransform:
        """Tells what the joint adds to the body's pose at `value`: the frame after it.

        A ball stays as drawn.
        """
        moved = value - self.qpos0
        if self.kind == "slide":
            return RigidTransform(moved * self.axis)
        if self.kind == "ball":
            return RigidTransform()
        to_anchor = RigidTransform(self.anchor)
        return (
            to_anchor @ RigidTransform(rotation(self.axis, moved), [0, 0, 0]) @ to_anchor.inverse()
        )


@dataclass(frozen=True)
class TreeBody:
    """Holds one body and the joints that move it in its parent.

    Attributes:
        id, parent: in the MuJoCo model; the parent of the first bodies is the mount.
        X_PB: pose in the parent before the joints act.
        mass: kg.
        p_BBcm: centre of mass, m.
        I_BBcm_B: 3x3 inertia about it, kg m^2.

    """

    id: int
    name: str
    parent: int
    X_PB: RigidTransform
    mass: float
    p_BBcm: NDArray[np.float64]
    I_BBcm_B: NDArray[np.float64]
    joints: tuple[TreeJoint, ...]


@dataclass(frozen=True)
class Tree:
    """Holds a subtree of a model.

    Attributes:
        bodies: parents before children.
        mount: the MuJoCo body that carries them (0, the world, for a whole model).
        X_WF: pose of that body in the model's world, its own joints where they start.
        qpos: the model's positions (nq) where all joints start; locked ones stay there.
        tied: names of the model's joints that an active coupling ties to another.

    """

    model: Any
    bodies: tuple[TreeBody, ...]
    mount: int
    X_WF: RigidTransform
    qpos: NDArray[np.float64]
    tied: frozenset[str]

    def joints(self) -> list[TreeJoint]:
        """Gives all joints, locked ones included, in the model's order."""
        return [joint for body in self.bodies for joint in body.joints]


def read_tree(
    model: Any,
    *,
    root: str | None,
    couplings: str,
    locked: Mapping[str, float],
    reference: Mapping[str, float],
) -> Tree:
    """Reads the bodies from `root` on (all for None); the arguments are those of `import_mujoco`.

    Raises:
        InputError: unknown names, values that are not finite, or couplings that no value meets.

    """
    ids = subtree(model, root)
    found = joint_couplings(model)
    values, welded = joint_values(model, found, couplings, locked, reference)
    qpos = np.array(model.qpos0)
    for joint in range(model.njnt):
        if joint_name(model, joint) in values:
            qpos[model.jnt_qposadr[joint]] = values[joint_name(model, joint)]
    bodies = tuple(_read_body(model, i, values, welded) for i in ids)
    mount = 0 if root is None else int(model.body_parentid[ids[0]])
    tied = frozenset(coupling.tied for coupling in found)
    return Tree(model, bodies, mount, _pose_at(model, mount, qpos), qpos, tied)


def subtree(model: Any, root: str | None) -> list[int]:
    """Ids of the bodies from `root` on, parents first; the world is not among them.

    Raises:
        InputError: no such body, or nothing in it.

    """
    parents = model.body_parentid
    if root is None:
        if model.nbody < 2:
            raise InputError("import_mujoco: model", "only the world", "a model with a body")
        return list(range(1, model.nbody))
    names = [body_name(model, i) for i in range(1, model.nbody)]
    if root not in names:
        raise InputError("import_mujoco: root", root, short_list(names))
    found = [names.index(root) + 1]
    found += [i for i in range(found[0] + 1, model.nbody) if _is_below(parents, i, found[0])]
    return found


def _is_below(parents: NDArray[np.int32], body: int, ancestor: int) -> bool:
    while body > ancestor:  # a parent's id is lower than its children's
        body = int(parents[body])
    return body == ancestor


def pose(position: NDArray[np.float64], quaternion: NDArray[np.float64]) -> RigidTransform:
    """Makes a pose from MuJoCo's `position` (m) and `quaternion` (w x y z, of unit length)."""
    unit = np.array(quaternion) / np.linalg.norm(quaternion)
    return RigidTransform(RotationMatrix(Quaternion(unit)), np.array(position))


def rotation(axis: NDArray[np.float64], angle: float) -> RotationMatrix:
    """Makes a rotation about a unit vector."""
    half = 0.5 * angle
    return RotationMatrix(Quaternion(np.r_[math.cos(half), math.sin(half) * axis]))


def _pose_at(model: Any, body: int, qpos: NDArray[np.float64]) -> RigidTransform:
    mujoco = mujoco_package()
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    return pose(data.xpos[body], data.xquat[body])


def _read_body(
    model: Any, body: int, values: Mapping[str, float], welded: frozenset[str]
) -> TreeBody:
    mujoco = mujoco_package()
    X_PB = pose(model.body_pos[body], model.body_quat[body])
    first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
    ids = range(first, first + count)
    if count and model.jnt_type[first] == int(mujoco.mjtJoint.mjJNT_FREE):
        at = int(model.jnt_qposadr[first])  # a free joint stands alone; the body stays there
        X_PB = pose(model.qpos0[at : at + 3], model.qpos0[at + 3 : at + 7])
        ids = range(0)
    X_BBcm = pose(model.body_ipos[body], model.body_iquat[body])
    axes = X_BBcm.rotation().matrix()
    return TreeBody(
        id=body,
        name=body_name(model, body),
        parent=int(model.body_parentid[body]),
        X_PB=X_PB,
        mass=float(model.body_mass[body]),
        p_BBcm=X_BBcm.translation(),
        I_BBcm_B=axes @ np.diag(model.body_inertia[body]) @ axes.T,
        joints=tuple(_read_joint(model, i, values, welded) for i in ids),
    )


def _read_joint(
    model: Any, joint: int, values: Mapping[str, float], welded: frozenset[str]
) -> TreeJoint:
    types = mujoco_package().mjtJoint
    kinds: dict[int, Kind] = {
        int(types.mjJNT_HINGE): "hinge",
        int(types.mjJNT_SLIDE): "slide",
        int(types.mjJNT_BALL): "ball",
    }
    kind, name = kinds[int(model.jnt_type[joint])], joint_name(model, joint)
    position, velocity = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
    scalar = kind != "ball"
    limited = scalar and bool(model.jnt_limited[joint]) and enabled(model, "limit")
    spring, damper = (float(enabled(model, what)) for what in ("spring", "damper"))
    return TreeJoint(
        id=joint,
        name=name,
        kind=kind,
        axis=np.array(model.jnt_axis[joint]),
        anchor=np.array(model.jnt_pos[joint]),
        qpos0=float(model.qpos0[position]) if scalar else 0.0,
        value=values[name] if scalar else 0.0,
        locked=name in welded,
        limits=(float(model.jnt_range[joint, 0]), float(model.jnt_range[joint, 1]))
        if limited
        else None,
        damping=damper * float(model.dof_damping[velocity]),
        armature=float(model.dof_armature[velocity]),
        stiffness=spring * float(model.jnt_stiffness[joint]),
        spring_at=float(model.qpos_spring[position]) if scalar else 0.0,
    )
