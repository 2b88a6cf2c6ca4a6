"""Brings the skeleton of an OpenSim model into a Drake plant.

Bodies, joints, coordinates and their ranges go over exactly; muscles and all else are left out, and
listed. A coordinate becomes a joint of its name; a joint with several hangs on massless links. What
Drake cannot move as OpenSim does (splines, couplers, ball joints with quaternions) stays where the
model has it at the start, and is listed too.

OpenSim's y is up: its ground is turned so that x stays forward and z is up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Frame,
    Joint,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    RotationalInertia,
    SpatialInertia,
    WeldJoint,
)

from drake_racket.io.errors import InputError
from drake_racket.limbs.chain import Graph
from drake_racket.limbs.left_out import LeftOut, LeftOutItem, short_list
from drake_racket.limbs.limb import Limb
from drake_racket.limbs.opensim.model import (
    Coordinate,
    OpenSimBody,
    OpenSimJoint,
    OpenSimTree,
    Step,
    read_model,
)

Y_UP = RigidTransform(RotationMatrix.MakeXRotation(0.5 * math.pi), [0.0, 0.0, 0.0])
"""Pose of OpenSim's ground in a world whose z is up."""


@dataclass(frozen=True)
class OpenSimLimb:
    """Holds a limb from OpenSim.

    Attributes:
        limb: the handles that the rest of the package takes.
        left_out: what the model has and the plant does not.
        bodies: by OpenSim's name.
        joints: those with a degree of freedom, by the coordinate's name, in the order of the tree;
            the limb has those that lead to the hand.
        fixed: the value of each coordinate without one (rad or m).
        gravity: (3,) of the model, in the plant's world (m/s^2). The plant's own acts.
        tree: what was read.

    """

    limb: Limb
    left_out: LeftOut
    bodies: dict[str, RigidBody]
    joints: dict[str, Joint]
    fixed: dict[str, float]
    gravity: NDArray[np.float64]
    tree: OpenSimTree


def import_opensim(
    plant: MultibodyPlant,
    model: str | Path,
    *,
    hand: str,
    base: str | None = None,
    name: str = "limb",
    X_WB: RigidTransform | None = None,
) -> OpenSimLimb:
    """Adds the bodies of an OpenSim model. Before `Finalize`.

    Args:
        model: path of an .osim file.
        hand: name of the body, frame or marker on which the racket's grip frame lies.
        base: the body from which on the model is taken, with its own joint; None for all of it.
        name: of the new model instance.
        X_WB: where the base is at the start, its y then up; None: where the model has it.

    Raises:
        InputError: the plant is finalized, the name is taken, `opensim` is missing, a name is
            unknown, or a body that no rigid body can be.

    """
    if plant.is_finalized():
        raise InputError("import_opensim: plant", "finalized", "a plant before Finalize()")
    if plant.HasModelInstanceNamed(name):
        raise InputError("import_opensim: name", name, "a name that the plant does not have yet")
    tree = read_model(model)
    joints = _from(tree, base)
    built = _Built(plant, plant.AddModelInstance(name), tree)
    body, X_BH = tree.points.get(hand, ("", RigidTransform()))
    if body not in {joint.child for joint in joints}:
        known = [n for n, (b, _) in tree.points.items() if b in {j.child for j in joints}]
        raise InputError("import_opensim: hand", hand, short_list(known, 20))
    built.build(joints, base, X_WB)
    H = built.frame("hand", built.bodies[body].body_frame(), X_BH)
    chain = {int(joint.index()) for joint in Graph(plant).path(H.body())}
    on_chain = tuple(joint for joint in built.joints.values() if int(joint.index()) in chain)
    listed = _left_out(tree, joints, built)
    notes = tuple(
        f"{item.kind}, {item.fate}: {short_list(item.names, 4)}"
        for item in listed.items
        if item.kind in _WORTH_A_NOTE
    )
    return OpenSimLimb(
        limb=Limb(plant, (built.instance,), H, on_chain, notes=notes),
        left_out=listed,
        bodies=built.bodies,
        joints=built.joints,
        fixed=built.fixed,
        gravity=Y_UP.rotation() @ tree.gravity,
        tree=tree,
    )


def _from(tree: OpenSimTree, base: str | None) -> list[OpenSimJoint]:
    if base is None or base == "ground":
        return list(tree.joints)
    if base not in tree.bodies:
        raise InputError("import_opensim: base", base, short_list(tree.bodies, 20))
    found: list[OpenSimJoint] = []
    inside: set[str] = set()
    for joint in tree.joints:
        if joint.child == base or joint.parent in inside:
            found.append(joint)
            inside.add(joint.child)
    return found


class _Built:
    """Adds bodies, links, joints and frames to one model instance."""

    def __init__(self, plant: MultibodyPlant, instance: Any, tree: OpenSimTree) -> None:
        self.plant, self.instance, self.tree = plant, instance, tree
        self.bodies: dict[str, RigidBody] = {}
        self.joints: dict[str, Joint] = {}
        self.fixed: dict[str, float] = {}
        self._names: set[str] = set(tree.bodies) | {
            c.name for joint in tree.joints for c in joint.coordinates
        }

    def build(
        self, joints: list[OpenSimJoint], base: str | None, X_WB: RigidTransform | None
    ) -> None:
        """Adds the joints and what they carry; ground, or what carries the base, is the mount."""
        first = joints[0]
        X_WP = Y_UP
        if base not in (None, "ground") and X_WB is not None:
            X_PB = first.X_PF @ first.X_FM @ first.X_BM.inverse()
            X_WP = X_WB @ Y_UP @ X_PB.inverse()
        mount = self.frame("mount", self.plant.world_frame(), X_WP)
        for joint in joints:
            body = self.tree.bodies[joint.child]
            added = self.plant.AddRigidBody(body.name, self.instance, spatial_inertia(body))
            self.bodies[body.name] = added
            inner = self.bodies.get(joint.parent)
            self._hang(joint, added, mount if inner is None else inner.body_frame())

    def frame(self, name: str, base: Frame, X_BF: RigidTransform) -> Frame:
        """Gives a frame of the limb, on any body."""
        named = self._unused(name)
        return self.plant.AddFrame(FixedOffsetFrame(named, base, X_BF, self.instance))

    def _hang(self, joint: OpenSimJoint, added: RigidBody, parent: Frame) -> None:
        """Connects a body step by step; steps that do not move are folded into the frames."""
        by_name = {coordinate.name: coordinate for coordinate in joint.coordinates}
        steps = joint.steps
        free = (
            []
            if steps is None
            else [step for step in steps if step.coordinate and not by_name[step.coordinate].fixed]
        )
        moving = {step.coordinate for step in free}
        self.fixed |= {c.name: c.value for c in joint.coordinates if c.name not in moving}
        if steps is None or not free:
            X_PB = joint.X_PF @ joint.X_FM @ joint.X_BM.inverse()
            weld = WeldJoint(self._unused(f"{joint.name}_weld"), parent, added.body_frame(), X_PB)
            self.plant.AddJoint(weld)
            return
        before, X_before = parent, joint.X_PF
        for i, step in enumerate(steps):
            if step not in free:
                fixed = by_name[step.coordinate].value if step.coordinate else 0.0
                X_before = X_before @ step.pose(fixed)
                continue
            X_before = X_before @ Step(step.kind, step.axis, "", 0.0, step.at).pose()
            after, X_after = added.body_frame(), joint.X_BM
            if step is free[-1]:
                for later in steps[:i:-1]:
                    fixed = by_name[later.coordinate].value if later.coordinate else 0.0
                    X_after = X_after @ later.pose(fixed).inverse()
            else:
                link = self.plant.AddRigidBody(
                    self._unused(f"{step.coordinate}_link"), self.instance, SpatialInertia.Zero()
                )
                after, X_after = link.body_frame(), RigidTransform()
            self._join(step, by_name[step.coordinate], before, X_before, after, X_after)
            before, X_before = after, RigidTransform()
            if step is free[-1]:
                return

    def _join(
        self,
        step: Step,
        coordinate: Coordinate,
        before: Frame,
        X_before: RigidTransform,
        after: Frame,
        X_after: RigidTransform,
    ) -> None:
        frames = (
            self.frame(f"{coordinate.name}_parent", before, X_before),
            self.frame(f"{coordinate.name}_child", after, X_after),
        )
        low, high = coordinate.limits
        if not low < high:
            low, high = -math.inf, math.inf
        kind = RevoluteJoint if step.kind == "turn" else PrismaticJoint
        joint = kind(coordinate.name, *frames, step.sign * step.axis, low, high, 0.0)
        made = self.plant.AddJoint(joint)
        made.set_default_positions([min(max(coordinate.value, low), high)])
        self.joints[coordinate.name] = made

    def _unused(self, name: str) -> str:
        while name in self._names:
            name += "_"
        self._names.add(name)
        return name


def spatial_inertia(body: OpenSimBody) -> SpatialInertia:
    """Gives a body's inertia; a body without mass has none.

    Raises:
        InputError: no rigid body has these moments.

    """
    if body.mass == 0.0:
        return SpatialInertia.Zero()
    try:
        about_com = RotationalInertia(*body.moments)
        return SpatialInertia.MakeFromCentralInertia(body.mass, body.com, about_com)
    except RuntimeError:
        raise InputError(
            f"import_opensim: inertia of {body.name}", body.moments.tolist(), "a rigid body's"
        ) from None


_WORTH_A_NOTE = (
    "joints that Drake cannot move as OpenSim does",
    "coordinates that follow others",
)


def _left_out(tree: OpenSimTree, joints: list[OpenSimJoint], built: _Built) -> LeftOut:
    coordinates = [c for joint in joints for c in joint.coordinates]
    follow = [c.name for c in coordinates if c.fixed.startswith("follows")]
    held = [c.name for c in coordinates if c.fixed and c.name not in follow]
    stiff = [j.name for j in joints if j.steps is None and j.coordinates]
    inside = {joint.child for joint in joints}
    rows = [
        ("bodies outside", "absent", [n for n in tree.bodies if n not in inside]),
        ("joints that Drake cannot move as OpenSim does", "held where they start", stiff),
        ("coordinates that follow others", "held where they start", follow),
        ("coordinates held by the model", "held where they start", held),
        *_elements(tree.model),
    ]
    return LeftOut(tuple(LeftOutItem(k, fate, tuple(names)) for k, fate, names in rows if names))


def _elements(model: Any) -> list[tuple[str, str, list[str]]]:
    def names(of: Any) -> list[str]:
        return [of.get(i).getName() for i in range(of.getSize())]

    muscles = names(model.getMuscles())
    forces = [name for name in names(model.getForceSet()) if name not in muscles]
    return [
        ("muscles", "absent", muscles),
        ("other forces", "absent", forces),
        ("constraints", "absent", names(model.getConstraintSet())),
        ("controllers", "absent", names(model.getControllerSet())),
        ("contact geometries", "absent", names(model.getContactGeometrySet())),
        ("markers", "absent but the hand", names(model.getMarkerSet())),
        ("gravity", "the plant's own acts", [str([model.getGravity().get(i) for i in range(3)])]),
    ]
