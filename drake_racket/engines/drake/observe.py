"""Reads what one instant of a Drake simulation shows: a row of a trajectory's arrays."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import Context

from drake_racket.engines.drake.mechanism import Parts
from drake_racket.engines.trajectory import Motion
from drake_racket.laws.totals import TOTALS

Array = NDArray[np.float64]


class State(NamedTuple):
    """Says what every sample has."""

    time: float
    plant: Array
    record: Array
    totals: Array
    contact: Array


class Moving(NamedTuple):
    """Says how the bodies move at one sample, and what loads the hand and the limb."""

    poses: list[Array]
    velocities: list[Array]
    handle_acceleration: Array
    hand_load: Array | None
    joint_torque: Array | None
    joint_reaction: list[Array] | None


class Observer:
    """Reads instants of one Diagram's Context."""

    def __init__(self, parts: Parts) -> None:
        self._parts = parts
        plant, limb = parts.plant, parts.limb
        self._plant, self._contact = plant, parts.impact.contact
        self._discrete = plant.time_step() > 0.0
        self._contact_port = self._contact.GetOutputPort("contact_state")  # type: ignore[union-attr]
        racket, context = parts.impact.racket, plant.CreateDefaultContext()
        # the string masses follow from the head, and nothing hangs on a massless link of the racket
        left_out = {int(body.index()) for body in racket.string_masses} | {
            int(body.index()) for body in racket.bodies() if body.get_mass(context) == 0.0
        }
        bodies = [plant.get_body(BodyIndex(i)) for i in range(1, plant.num_bodies())]
        self._bodies = [body for body in bodies if int(body.index()) not in left_out]
        if parts.grip_load is not None:
            self._load_port = parts.grip_load.GetOutputPort("hand_load")
        if limb is not None:
            self._torques = limb.torques.selector.get_input_port()
            order = [int(i) for i in plant.GetJointIndices()]
            self._joints = [order.index(int(j.index())) for j in limb.limb.joints]
            self._counts = [j.num_velocities() for j in limb.limb.joints]

    def state(self, root: Context) -> State:
        """Reads time, state and contact."""
        parts = self._parts
        contact = self._contact.GetMyContextFromRoot(root)  # type: ignore[union-attr]
        totals: Array = np.full(TOTALS, math.nan)
        if parts.meter is not None:
            meter = parts.meter.GetMyContextFromRoot(root)
            totals = meter.get_continuous_state_vector().CopyToVector()
        if parts.limb is not None and parts.limb.energy is not None:
            energy = parts.limb.energy.GetMyContextFromRoot(root)
            totals = np.append(totals, energy.get_continuous_state_vector().CopyToVector())
        return State(
            root.get_time(),
            self._plant.GetPositionsAndVelocities(self._plant.GetMyContextFromRoot(root)).copy(),
            contact.get_discrete_state_vector().CopyToVector(),
            totals,
            self._contact_port.Eval(contact).copy(),
        )

    def set_state(self, root: Context, state: State) -> None:
        """Writes a sample back, so that any output can be evaluated there."""
        parts = self._parts
        root.SetTime(state.time)
        context = self._plant.GetMyMutableContextFromRoot(root)
        self._plant.SetPositionsAndVelocities(context, state.plant)
        self._contact.GetMyMutableContextFromRoot(root).SetDiscreteState(state.record)  # type: ignore[union-attr]
        if parts.meter is not None:
            parts.meter.GetMyMutableContextFromRoot(root).SetContinuousState(state.totals[:TOTALS])
        if parts.limb is not None and parts.limb.energy is not None:
            energy = parts.limb.energy.GetMyMutableContextFromRoot(root)
            energy.SetContinuousState(state.totals[TOTALS:])

    def moving(self, root: Context) -> Moving:
        """Gives the poses and velocities of all bodies but the string masses; and loads."""
        parts, context = self._parts, self._plant.GetMyContextFromRoot(root)
        poses = [body.EvalPoseInWorld(context).GetAsMatrix34() for body in self._bodies]
        velocities = [
            body.EvalSpatialVelocityInWorld(context).get_coeffs() for body in self._bodies
        ]
        acceleration = _UNKNOWN  # a discrete plant has none at an instant
        if not self._discrete:
            handle = parts.impact.racket.handle
            acceleration = handle.EvalSpatialAccelerationInWorld(context).get_coeffs()
        load = torque = reaction = None
        if parts.grip_load is not None:
            system = parts.grip_load
            load = self._load_port.Eval(system.GetMyContextFromRoot(root)).copy()
        if parts.limb is not None:
            selector = parts.limb.torques.selector
            torque = self._torques.Eval(selector.GetMyContextFromRoot(root)).copy()
            reaction = self._reactions(context)
        return Moving(poses, velocities, acceleration, load, torque, reaction)

    def _reactions(self, context: Context) -> list[Array]:
        """The reaction forces (N) of the limb's joints."""
        if self._discrete:
            return [_UNKNOWN[:3]] * len(self._joints)
        forces = self._plant.get_reaction_forces_output_port().Eval(context)
        return [forces[i].translational() for i in self._joints]

    def motion(self, samples: list[int], rows: list[Moving], state: Array) -> Motion:
        """Gives the arrays of a trajectory's motion.

        Args:
            samples: numbers of the samples.
            rows: of `moving`, one for each.
            state: (m, nq + nv) the plant's at these samples.

        """
        count, bodies = len(samples), [int(body.index()) for body in self._bodies]
        shape = count, self._plant.num_bodies()
        poses, velocities = np.zeros((*shape, 3, 4)), np.zeros((*shape, 6))
        poses[:, :, :, :3] = np.eye(3)
        poses[:, bodies] = np.array([row.poses for row in rows])
        velocities[:, bodies] = np.array([row.velocities for row in rows])
        self._add_strings(poses, velocities, state)
        reaction = None
        if rows[0].joint_reaction is not None:
            forces = np.linalg.norm(np.array([row.joint_reaction for row in rows]), axis=2)
            reaction = np.repeat(forces, self._counts, axis=1)
        return Motion(
            samples=np.array(samples),
            poses=poses,
            velocities=velocities,
            handle_acceleration=np.array([row.handle_acceleration for row in rows]),
            hand_load=_stack([row.hand_load for row in rows]),
            joint_torque=_stack([row.joint_torque for row in rows]),
            joint_reaction=reaction,
        )

    def _add_strings(self, poses: Array, velocities: Array, state: Array) -> None:
        """The string masses: each slides along the head's z from its place at rest."""
        racket, first = self._parts.impact.racket, self._plant.num_positions()
        head = int(racket.head.index())
        rotation, origin = poses[:, head, :, :3], poses[:, head, :, 3]
        w, v = velocities[:, head, :3], velocities[:, head, 3:]
        for body, joint in zip(racket.string_masses, racket.string_joints, strict=True):
            place = np.array(joint.frame_on_parent().GetFixedPoseInBodyFrame().translation())
            z = state[:, joint.position_start()]
            rate = state[:, first + joint.velocity_start()]
            arm = rotation @ place + rotation[:, :, 2] * z[:, None]
            i = int(body.index())
            poses[:, i, :, :3], poses[:, i, :, 3] = rotation, origin + arm
            velocities[:, i, :3] = w
            velocities[:, i, 3:] = v + np.cross(w, arm) + rotation[:, :, 2] * rate[:, None]


_UNKNOWN: Array = np.full(6, math.nan)


def _stack(values: list[Array | None]) -> Array | None:
    return None if values[0] is None else np.array(values)
