"""Reads what one instant of a Drake simulation shows: rows of a trajectory's arrays.

A row is one flat array of floats: thousands of small objects would keep Python's collector busy.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import Context

from drake_racket.engines.drake.leapfrog import brought_to_time
from drake_racket.engines.drake.mechanism import Parts
from drake_racket.engines.trajectory import Motion
from drake_racket.laws.contact import CONTACT
from drake_racket.laws.phases import PHASE, SEEN
from drake_racket.laws.totals import LOST_JOINT, TOTALS

Array = NDArray[np.float64]


class Observer:
    """Reads instants of one Context.

    Args:
        parts: what takes part.
        root: the Context of the Diagram that holds them.

    """

    def __init__(self, parts: Parts, root: Context) -> None:
        self._parts, self._root = parts, root
        plant, limb, contact = parts.plant, parts.limb, parts.impact.contact
        assert contact is not None
        self._plant, self._context = plant, plant.GetMyMutableContextFromRoot(root)
        self._discrete = plant.time_step() > 0.0
        self._ball_contact, self._contact = contact, contact.GetMyMutableContextFromRoot(root)
        meters = [parts.meter, None if limb is None else limb.energy]
        self._meters = [m.GetMyMutableContextFromRoot(root) for m in meters if m is not None]
        self._no_totals = np.full(0 if parts.meter is not None else TOTALS, math.nan)
        racket = parts.impact.racket
        bodies = {i: plant.get_body(BodyIndex(i)) for i in range(1, plant.num_bodies())}
        heavy = {i for i, body in bodies.items() if body.get_mass(self._context) > 0.0}
        # not to be read: the string masses follow from the head, what floats is in the state, and
        # nothing hangs on a massless link of the racket
        left_out = {int(body.index()) for body in racket.bodies()} - heavy
        left_out |= {int(body.index()) for body in racket.string_masses}
        assert parts.impact.ball is not None
        floating = racket.handle, parts.impact.ball.body
        self._floating = [body for body in floating if body.has_quaternion_dofs()]
        left_out |= {int(body.index()) for body in self._floating}
        self._placed = {i: body for i, body in bodies.items() if i not in left_out}
        self._moving = {i: body for i, body in self._placed.items() if i in heavy}
        if parts.grip_load is not None:
            self._grip_load = parts.grip_load.GetMyContextFromRoot(root)
            self._load_port = parts.grip_load.GetOutputPort("hand_load")
        if limb is not None:
            self._selector = limb.torques.selector.GetMyContextFromRoot(root)
            self._torques = limb.torques.selector.get_input_port()
            order = [int(i) for i in plant.GetJointIndices()]
            self._joints = [order.index(int(j.index())) for j in limb.limb.joints]
            self._counts = [j.num_velocities() for j in limb.limb.joints]

    def state(self, *, in_full: bool = True) -> Array:
        """Reads time, state and contact: a row for `states`.

        Args:
            in_full: what the ball does before and after contact too; else only its phase then.

        """
        record = self._contact.get_discrete_state_vector().CopyToVector()
        if in_full or self._discrete or record[PHASE] == CONTACT:
            contact = self._ball_contact.contact_numbers(self._contact, record.copy())
        else:
            contact = [record[PHASE], *_APART]
        plant = self._plant.GetPositionsAndVelocities(self._context)
        meters = [m.get_continuous_state_vector().CopyToVector() for m in self._meters]
        time = [self._root.get_time()]
        element = self._contact.get_continuous_state_vector().CopyToVector()
        return np.concatenate([time, contact, plant, record, element, self._no_totals, *meters])

    def states(self, rows: Array) -> tuple[Array, Array, Array, Array, Array, Array]:
        """Gives time, contact, state, record, element and totals of rows (n, k) or of one (k,)."""
        sizes = [
            1,
            len(_APART) + 1,
            self._plant.num_multibody_states(),
            self._contact.get_discrete_state_vector().size(),
            self._contact.num_continuous_states(),
        ]
        time, contact, plant, record, element, totals = np.split(rows, np.cumsum(sizes), axis=-1)
        return time[..., 0], contact, plant, record, element, totals

    def set_state(self, row: Array) -> None:
        """Writes a row of `state` back, so that any output can be evaluated there."""
        time, _, plant, record, element, totals = self.states(row)
        self._root.SetTime(float(time))
        self._plant.SetPositionsAndVelocities(self._context, plant)
        self._contact.SetDiscreteState(record)
        if len(element):
            self._contact.SetContinuousState(element)
        for meter in reversed(self._meters):
            size = meter.num_continuous_states()
            totals, own = totals[:-size], totals[-size:]
            meter.SetContinuousState(own)

    def ahead(self) -> Array:
        """Gives the row of a discrete plant's next step, if nothing else acts than now."""
        plant, contact = self._plant, self._ball_contact
        here, there = self._root.Clone(), self._root.Clone()
        record = self._contact.get_discrete_state_vector().CopyToVector()
        step = plant.time_step()
        begins = max(self._root.get_time(), record[SEEN] + step)
        begins = self._root.get_time() if math.isnan(record[SEEN]) else begins
        here.SetTime(begins)
        own, new = (plant.GetMyMutableContextFromRoot(root) for root in (here, there))
        if plant.has_sampled_output_ports():
            plant.CalcForcedUnrestrictedUpdate(own, new.get_mutable_state())
        else:
            plant.CalcForcedDiscreteVariableUpdate(own, new.get_mutable_discrete_state())
        acting = contact.latched(contact.GetMyContextFromRoot(here))
        contact.GetMyMutableContextFromRoot(there).SetDiscreteState(acting)
        power = contact.GetOutputPort("power").Eval(contact.GetMyContextFromRoot(there))
        row = self.state(in_full=False)
        _, _, state, latched, _, totals = self.states(row)
        state[:] = plant.GetPositionsAndVelocities(new)
        latched[:] = acting
        totals[:LOST_JOINT] += step * power
        return row

    def bring_to_time(self, rows: Array, after: Array, *, given: bool = True) -> None:
        """Brings velocities and totals of a discrete plant's rows to the instants of the rows.

        Args:
            rows: (n, k) of `state`, changed in place.
            after: `ahead` where the last row was read.
            given: the first row has velocities as somebody gave them, for that instant.

        """
        _, _, plant, record, _, totals = self.states(np.vstack([rows, after]))
        q, v = plant[:, : self._plant.num_positions()], plant[:, self._plant.num_positions() :]
        _, _, state, _, _, lost = self.states(rows)
        found = brought_to_time(q, v, record, totals, given=given)
        state[:, q.shape[1] :], lost[:] = found

    def moving(self) -> Array:
        """Reads poses, velocities and loads that are not in the state: a row for `motion`.

        On a discrete plant accelerations and reactions are NaN: it has none at an instant.
        """
        parts, context = self._parts, self._context
        moving = self._moving.values()
        row = [body.EvalPoseInWorld(context).GetAsMatrix34() for body in self._placed.values()]
        row += [body.EvalSpatialVelocityInWorld(context).get_coeffs() for body in moving]
        if self._discrete:
            row.append(_UNKNOWN)
        else:
            sensed = parts.impact.racket.frame("accelerometer").body()
            row.append(sensed.EvalSpatialAccelerationInWorld(context).get_coeffs())
        if parts.grip_load is not None:
            row.append(self._load_port.Eval(self._grip_load))
        if parts.limb is not None:
            row.append(self._torques.Eval(self._selector))
            if self._discrete:
                row += [_UNKNOWN[:3]] * len(self._joints)
            else:
                forces = self._plant.get_reaction_forces_output_port().Eval(context)
                row += [forces[i].translational() for i in self._joints]
        return np.concatenate(row, axis=None)

    def motion(self, samples: list[int], rows: list[Array], state: Array) -> Motion:
        """Gives the arrays of a trajectory's motion.

        Args:
            samples: numbers of the samples.
            rows: of `moving`, one for each.
            state: (m, nq + nv) the plant's at these samples.

        """
        table, count = np.array(rows), len(samples)
        placed, moving = list(self._placed), list(self._moving)
        shape = count, self._plant.num_bodies()
        poses, velocities = np.zeros((*shape, 3, 4)), np.zeros((*shape, 6))
        poses[:, :, :, :3] = np.eye(3)
        places, speeds, acceleration, rest = np.split(
            table, np.cumsum([12 * len(placed), 6 * len(moving), 6]), axis=1
        )
        poses[:, placed] = places.reshape(count, -1, 3, 4)
        velocities[:, moving] = speeds.reshape(count, -1, 6)
        self._add_floating(poses, velocities, state)
        self._add_strings(poses, velocities, state)
        load = torque = reaction = None
        if self._parts.grip_load is not None:
            load, rest = rest[:, :6], rest[:, 6:]
        if self._parts.limb is not None:
            torque, forces = np.split(rest, [sum(self._counts)], axis=1)
            size = np.linalg.norm(forces.reshape(count, -1, 3), axis=2)
            reaction = np.repeat(size, self._counts, axis=1)
        return Motion(np.array(samples), poses, velocities, acceleration, load, torque, reaction)

    def _add_floating(self, poses: Array, velocities: Array, state: Array) -> None:
        """The bodies that float in the world; rotations as Drake's `RotationMatrix` makes them."""
        first = self._plant.num_positions()
        for body in self._floating:
            i, at = int(body.index()), body.floating_positions_start()
            speeds = first + body.floating_velocities_start_in_v()
            w, x, y, z = state[:, at : at + 4].T
            twice = 2.0 / ((x * x + z * z) + (y * y + w * w))
            sx, sy, sz = twice * x, twice * y, twice * z
            rows = [
                [1.0 - sy * y - sz * z, sy * x - sz * w, sz * x + sy * w],
                [sy * x + sz * w, 1.0 - sx * x - sz * z, sz * y - sx * w],
                [sz * x - sy * w, sz * y + sx * w, 1.0 - sx * x - sy * y],
            ]
            poses[:, i, :, :3] = np.moveaxis(np.array(rows), -1, 0)
            poses[:, i, :, 3] = state[:, at + 4 : at + 7]
            velocities[:, i] = state[:, speeds : speeds + 6]

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
_APART = [math.nan] * 3 + [0.0] * 3 + [math.nan] * 2  # of a contact after its phase: no force
