"""Builds a tree read from MuJoCo in a Drake plant: bodies, massless links, joints, frames."""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BallRpyJoint,
    FixedOffsetFrame,
    Frame,
    Joint,
    ModelInstanceIndex,
    PrismaticJoint,
    PrismaticSpring,
    RevoluteJoint,
    RevoluteSpring,
    RigidBody,
    RotationalInertia,
    SpatialInertia,
    WeldJoint,
)

from drake_racket.io.errors import InputError, one_line
from drake_racket.limbs.mujoco.tree import Tree, TreeBody, TreeJoint


class Builder:
    """Adds bodies, links, joints and frames to one model instance."""

    def __init__(self, plant: MultibodyPlant, instance: ModelInstanceIndex) -> None:
        self.plant, self.instance = plant, instance
        self.bodies: dict[int, RigidBody] = {}
        self.joints: dict[str, Joint] = {}

    def build(self, tree: Tree, carrier: Frame, X_PF: RigidTransform) -> None:
        """Adds all of a tree; F, the body that carries it, is at X_PF on the carrier P."""
        self._names = {body.name for body in tree.bodies} | {joint.name for joint in tree.joints()}
        mount = self.frame("mount", carrier, X_PF)
        for body in tree.bodies:
            added = self.plant.AddRigidBody(body.name, self.instance, spatial_inertia(body))
            parent = self.bodies[body.parent].body_frame() if body.parent in self.bodies else mount
            self.bodies[body.id] = added
            self._hang(body, added, parent)

    def frame(self, name: str, base: Frame, X_BF: RigidTransform) -> Frame:
        """Gives a frame of the limb, on any body."""
        named = self._unused(name)
        return self.plant.AddFrame(FixedOffsetFrame(named, base, X_BF, self.instance))

    def _hang(self, body: TreeBody, added: RigidBody, parent: Frame) -> None:
        """Connects a body: joint by joint, locked ones folded into the frames between."""
        before, X_before = parent, body.X_PB
        moving = [joint for joint in body.joints if not joint.locked]
        for joint in body.joints:
            if joint.locked:
                X_before = X_before @ joint.displacement(joint.value)
            elif joint is not moving[-1]:
                link = self.plant.AddRigidBody(
                    self._unused(f"{joint.name}_link"), self.instance, SpatialInertia.Zero()
                )
                self._join(joint, before, X_before, link.body_frame(), RigidTransform())
                before, X_before = link.body_frame(), RigidTransform()
            else:
                X_after = RigidTransform()
                for later in body.joints[body.joints.index(joint) + 1 :]:
                    X_after = X_after @ later.displacement(later.value)
                self._join(joint, before, X_before, added.body_frame(), X_after.inverse())
        if not moving:
            weld = WeldJoint(
                self._unused(f"{body.name}_weld"), before, added.body_frame(), X_before
            )
            self.plant.AddJoint(weld)

    def _join(
        self,
        joint: TreeJoint,
        before: Frame,
        X_before: RigidTransform,
        after: Frame,
        X_after: RigidTransform,
    ) -> None:
        """One joint between the body's frame before it, in `before`, and after it, in `after`.

        Drake's zero is where the two frames of a joint lie on each other: with the parent's moved
        back by qpos0 the position is MuJoCo's own.
        """
        anchor = RigidTransform(joint.anchor)
        on_parent = X_before @ joint.displacement(0.0) @ anchor
        frames = (
            self.frame(f"{joint.name}_parent", before, on_parent),
            self.frame(f"{joint.name}_child", after, X_after @ anchor),
        )
        if joint.kind == "ball":
            self.joints[joint.name] = self.plant.AddJoint(
                BallRpyJoint(joint.name, *frames, damping=joint.damping)
            )
            return
        lower, upper = joint.limits or (-np.inf, np.inf)
        kind = RevoluteJoint if joint.kind == "hinge" else PrismaticJoint
        made = self.plant.AddJoint(
            kind(joint.name, *frames, joint.axis, lower, upper, joint.damping)
        )
        made.set_default_positions([joint.value])
        if joint.stiffness:
            spring = RevoluteSpring if joint.kind == "hinge" else PrismaticSpring
            self.plant.AddForceElement(spring(made, joint.spring_at, joint.stiffness))
        if joint.armature:
            actuator = self.plant.AddJointActuator(joint.name, made)
            actuator.set_default_rotor_inertia(joint.armature)
            actuator.set_default_gear_ratio(1.0)
        self.joints[joint.name] = made

    def _unused(self, name: str) -> str:
        while name in self._names:
            name += "_"
        self._names.add(name)
        return name


def spatial_inertia(body: TreeBody) -> SpatialInertia:
    """Gives a body's inertia; a body without mass has none.

    Raises:
        InputError: no rigid body has these moments.

    """
    if body.mass == 0.0:
        return SpatialInertia.Zero()
    I = body.I_BBcm_B
    try:
        about_com = RotationalInertia(I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2])
        return SpatialInertia.MakeFromCentralInertia(body.mass, body.p_BBcm, about_com)
    except RuntimeError:
        raise InputError(
            f"import_mujoco: inertia of {body.name}", one_line(str(I.tolist())), "a rigid body's"
        ) from None
