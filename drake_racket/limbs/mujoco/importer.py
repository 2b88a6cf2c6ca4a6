"""Brings the skeleton of a compiled MuJoCo model into a Drake plant.

Bodies, their inertias, and hinges, slides and balls go over exactly, with damping, armature,
springs and ranges; `left_out` of the result lists the rest. Hinges and slides keep MuJoCo's names,
positions (so q is qpos) and velocities.

- A body with several joints hangs on massless links, one before each joint but the last.
- A hinge's or slide's armature is the reflected inertia of a JointActuator named after the joint:
  it is in Drake's mass matrix as it is in MuJoCo's. Its actuation may stay unconnected (0 N m).
- Springs are RevoluteSpring and PrismaticSpring elements; ranges are joint limits, which a
  discrete plant obeys and a continuous one only carries.
- A ball is a BallRpyJoint, since Drake has no ball with a quaternion alone: q are roll, pitch and
  yaw (singular at a pitch of 90 degrees), v is the angular velocity in the frame before the joint
  where MuJoCo's is in the frame after it. `ImportedLimb.positions` and `velocity_map` translate.

A massless body may end the tree as long as every joint moves some mass or has armature; a degree of
freedom without inertia, which neither engine can accelerate, is refused.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, Joint, RigidBody

from drake_racket.io.errors import InputError
from drake_racket.limbs.chain import Graph
from drake_racket.limbs.left_out import LeftOut, short_list
from drake_racket.limbs.limb import Limb
from drake_racket.limbs.mujoco.build import Builder, spatial_inertia
from drake_racket.limbs.mujoco.loops import check_loops, keyframe_positions
from drake_racket.limbs.mujoco.model import (
    load_model,
)
from drake_racket.limbs.mujoco.report import gravity_of, left_out
from drake_racket.limbs.mujoco.tree import Tree, TreeJoint, pose, read_tree


@dataclass(frozen=True)
class ImportedLimb:
    """Holds a limb from MuJoCo.

    Attributes:
        limb: the handles that the rest of the package takes.
        left_out: what the model has and the plant does not.
        bodies: by MuJoCo's name; massless links between joints are not among them.
        joints: those with degrees of freedom, by MuJoCo's name, in its order; the limb has those
            that lead to the hand.
        locked: the value of each joint without one, rad or m.
        tree: what was read.
        gravity: (3,) of the model, in its world (m/s^2): 0 where its flag switches it off. The
            plant's own acts.

    """

    limb: Limb
    left_out: LeftOut
    bodies: dict[str, RigidBody]
    joints: dict[str, Joint]
    locked: dict[str, float]
    tree: Tree
    gravity: NDArray[np.float64]

    def position_indices(self) -> NDArray[np.int64]:
        """Tells where the positions of `joints` sit in the finalized plant's q, in order."""
        return replace(self.limb, joints=tuple(self.joints.values())).position_indices()

    def velocity_indices(self) -> NDArray[np.int64]:
        """Tells where the velocities of `joints` sit in the finalized plant's v, in order."""
        return replace(self.limb, joints=tuple(self.joints.values())).velocity_indices()

    def moving(self) -> list[tuple[TreeJoint, Joint]]:
        """Gives the joints with degrees of freedom, as read and as built, in order."""
        read = {joint.name: joint for joint in self.tree.joints()}
        return [(read[name], joint) for name, joint in self.joints.items()]

    def positions(self, qpos: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gives the joints' positions (n_q) of `qpos` (rad or m), by `position_indices()`."""
        model = self.tree.model
        parts = []
        for read, _ in self.moving():
            at = int(model.jnt_qposadr[read.id])
            if read.kind == "ball":
                turned = pose(np.zeros(3), qpos[at : at + 4]).rotation()
                parts.append(RollPitchYaw(turned).vector())
            else:
                parts.append(qpos[at : at + 1])
        return np.concatenate(parts) if parts else np.zeros(0)

    def velocity_map(self, qpos: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gives T (nv x n_v) at `qpos` (rad or m): MuJoCo's qvel is T v, v by `velocity_indices()`.

        So its generalized forces on the limb are T' times MuJoCo's, and its mass matrix is T' M T.
        """
        model = self.tree.model
        columns = sum(joint.num_velocities() for joint in self.joints.values())
        result, at = np.zeros((model.nv, columns)), 0
        for read, joint in self.moving():
            row, width = int(model.jnt_dofadr[read.id]), joint.num_velocities()
            block = np.eye(width)
            if read.kind == "ball":
                first = int(model.jnt_qposadr[read.id])
                block = pose(np.zeros(3), qpos[first : first + 4]).rotation().matrix().T
            result[row : row + width, at : at + width] = block
            at += width
        return result


def import_mujoco(
    plant: MultibodyPlant,
    model: Any,
    *,
    root: str | None = None,
    name: str = "limb",
    hand: str | None = None,
    X_BH: RigidTransform | None = None,
    couplings: str = "lock",
    locked: Mapping[str, float] | None = None,
    reference: Mapping[str, float] | None = None,
    keyframe: str | int | None = None,
    parent: Frame | None = None,
    X_PF: RigidTransform | None = None,
) -> ImportedLimb:
    """Adds the bodies of a MuJoCo model from `root` on. Before `Finalize`.

    Args:
        model: a compiled `mujoco.MjModel`, or the path of an .xml or .mjb file.
        root: name of the first body, whose joints come along; None takes the whole model.
        name: of the new model instance.
        hand: name of the body or site that holds the racket; None is the last body of a tree
            without branches.
        X_BH: pose of the hand frame H in it; identity if None.
        couplings: `lock` fixes a joint that an active joint equality ties to another at the value
            which that equality gives it at `reference`; `keep` leaves it free, without the tie.
        locked: further joints to fix (fingers around a grip, say) and their values, rad or m.
        reference: where joints start (the default positions, rad or m) and the ties are read;
            qpos0 if not named.
        keyframe: name or number of a keyframe whose hinges and slides are the reference.
        parent: the frame P that carries the limb; the plant's world if None.
        X_PF: pose in P of F, the MuJoCo body that carries the root (its world for the whole
            model); where the model has it if None, with P for the model's world.

    Raises:
        InputError: the plant is finalized, the name is taken, `mujoco` is missing, a name is
            unknown, or a body or joint has properties that Drake cannot hold.

    """
    if plant.is_finalized():
        raise InputError("import_mujoco: plant", "finalized", "a plant before Finalize()")
    if plant.HasModelInstanceNamed(name):
        raise InputError("import_mujoco: name", name, "a name that the plant does not have yet")
    if not (name.isascii() and name.isidentifier()):
        raise InputError("import_mujoco: name", name, "letters, digits and _ (not first a digit)")
    compiled = load_model(model)
    at = dict(reference or {})
    if keyframe is not None:
        at = keyframe_positions(compiled, keyframe) | at
    tree = read_tree(compiled, root=root, couplings=couplings, locked=locked or {}, reference=at)
    hand_body, X_BS = hand_of(tree, hand)
    _check_tree(tree)
    if couplings != "keep":
        check_loops(tree)
    builder = Builder(plant, plant.AddModelInstance(name))
    carrier = parent if parent is not None else plant.world_frame()
    builder.build(tree, carrier, tree.X_WF if X_PF is None else X_PF)
    H = builder.frame(
        "hand", builder.bodies[hand_body].body_frame(), X_BS @ (X_BH or RigidTransform())
    )
    chain = {int(joint.index()) for joint in Graph(plant).path(H.body())}
    joints = tuple(j for j in builder.joints.values() if int(j.index()) in chain)
    limb = Limb(plant, (builder.instance,), H, joints)
    return ImportedLimb(
        limb=limb,
        left_out=left_out(tree, couplings),
        bodies={body.name: builder.bodies[body.id] for body in tree.bodies},
        joints=builder.joints,
        locked={joint.name: joint.value for joint in tree.joints() if joint.locked},
        tree=tree,
        gravity=gravity_of(compiled),
    )


def _check_tree(tree: Tree) -> None:
    """Refuses what Drake would stop at, before anything is added."""
    for joint in tree.joints():
        for what in ("damping", "armature", "stiffness"):
            value = getattr(joint, what)
            if not 0.0 <= value < np.inf:
                raise InputError(f"import_mujoco: {what} of {joint.name}", value, "0 or more")
    heavy: set[int] = set()
    for body in reversed(tree.bodies):
        if spatial_inertia(body).get_mass() > 0.0:
            heavy.add(body.id)
        for joint in reversed(body.joints):
            if joint.locked:
                continue
            if body.id not in heavy and (joint.armature == 0.0 or joint.kind == "ball"):
                raise InputError(f"import_mujoco: mass that {joint.name} moves", 0.0, "above 0 kg")
        if body.id in heavy:
            heavy.add(body.parent)


def hand_of(tree: Tree, hand: str | None) -> tuple[int, RigidTransform]:
    """Gives the id of the body that holds the racket, and where on it."""
    if hand is None:
        parents = {body.parent for body in tree.bodies}
        ends = [body for body in tree.bodies if body.id not in parents]
        if len(ends) > 1:
            names = short_list(body.name for body in ends)
            raise InputError(
                "import_mujoco: hand", None, f"a body or site; the tree ends in {names}"
            )
        return ends[0].id, RigidTransform()
    for body in tree.bodies:
        if body.name == hand:
            return body.id, RigidTransform()
    model = tree.model
    inside = {body.id for body in tree.bodies}
    sites = {
        str(model.site(i).name): i
        for i in range(model.nsite)
        if int(model.site_bodyid[i]) in inside
    }
    if hand not in sites or not hand:
        bodies = short_list(body.name for body in tree.bodies)
        raise InputError(
            "import_mujoco: hand", hand, f"bodies: {bodies}; sites: {short_list(sites, 6)}"
        )
    site = sites[hand]
    return int(model.site_bodyid[site]), pose(model.site_pos[site], model.site_quat[site])
