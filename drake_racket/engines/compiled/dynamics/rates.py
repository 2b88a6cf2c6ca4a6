"""Computes the rates of a model's state: positions, velocities, and what is lost on the way.

The state y is [q; v; elements; totals]: two elements for each contact surface; no totals, nine of
`laws.totals`, or twelve with a limb.
"""

from __future__ import annotations

import math
from typing import Any

from drake_racket.engines.compiled.dynamics import layout as at
from drake_racket.engines.compiled.dynamics.bed import bent_string_forces
from drake_racket.engines.compiled.dynamics.forces import (
    bushing_forces,
    contact_force,
    joint_forces,
    limit_forces,
    strike_force,
    string_forces,
)
from drake_racket.engines.compiled.dynamics.layout import VEL
from drake_racket.engines.compiled.dynamics.motion import back, move_leaves, move_nodes
from drake_racket.engines.compiled.dynamics.solve import leaves_in, leaves_out, nodes_in, nodes_out
from drake_racket.engines.compiled.dynamics.surface import is_surface, surface_contact
from drake_racket.laws.compilation import compilable
from drake_racket.laws.contact import CONTACT, contact_powers
from drake_racket.laws.limits import limit_losses
from drake_racket.laws.phases import AT_BALL, CB, DB, PHASE
from drake_racket.laws.totals import (
    COUPLE,
    GRIP,
    IMPULSE,
    LOST_BALL,
    LOST_FRICTION,
    LOST_JOINT,
    LOST_JOINTS,
    LOST_LIMITS,
    LOST_STRINGS,
    TORQUE_WORK,
    TOTALS,
)

IMPULSE_AT = IMPULSE.start


@compilable
def set_origin(model: Any, y: Any, origin: Any) -> None:
    """Puts the fixed point where the first ball is, if that is free in the world; else 0."""
    nodes, contacts, numbers = model[at.NODE_ROWS], model[at.CONTACT_ROWS], model[at.NODE_NUMBERS]
    for k in range(3):
        origin[k] = 0.0
    if len(contacts) == 0:
        return
    i = contacts[0, at.BALL]
    kind, q = nodes[i, at.KIND], nodes[i, at.Q]
    if kind >= at.FREE_QUATERNION:
        q += 4 if kind == at.FREE_QUATERNION else 3
        n = numbers[i]
        for k in range(3):
            origin[k] = n[at.P_PF + k]
            for j in range(3):
                origin[k] += n[3 * k + j] * y[q + j]


@compilable
def move(model: Any, y: Any, nq: int, origin: Any, w: Any, leaves: Any) -> None:
    """Writes the motion of all nodes and point masses into their work rows."""
    set_origin(model, y, origin)
    move_nodes(model[at.NODE_ROWS], model[at.NODE_NUMBERS], model[at.GLOBAL], y, nq, origin, w)
    move_leaves(
        model[at.LEAF_ROWS], model[at.LEAF_NUMBERS], model[at.GLOBAL], y, nq, origin, w, leaves
    )


@compilable
def rates_of_positions(ints: Any, y: Any, nq: int, leaf_ints: Any, f: Any) -> None:
    """Writes q' into f: v where a coordinate is an angle or a length, else Drake's N(q) v."""
    for i in range(len(leaf_ints)):
        f[leaf_ints[i, at.LEAF_Q]] = y[nq + leaf_ints[i, at.LEAF_V]]
    for i in range(len(ints)):
        kind, q, v = ints[i, at.KIND], ints[i, at.Q], nq + ints[i, at.V]
        if kind <= at.SCREW:
            f[q] = y[v]
        elif kind == at.WELD or kind == at.SPIN:
            continue
        else:
            free = kind >= at.FREE_QUATERNION
            first = v if free else v - 2
            w0, w1, w2 = y[first], y[first + 1], y[first + 2]
            if kind == at.QUATERNION or kind == at.FREE_QUATERNION:
                a, b, c, d = y[q], y[q + 1], y[q + 2], y[q + 3]
                f[q] = -0.5 * (b * w0 + c * w1 + d * w2)
                f[q + 1] = 0.5 * (a * w0 + d * w1 - c * w2)
                f[q + 2] = 0.5 * (a * w1 - d * w0 + b * w2)
                f[q + 3] = 0.5 * (a * w2 + c * w0 - b * w1)
                q += 4
            else:
                c1, s1 = math.cos(y[q + 1]), math.sin(y[q + 1])
                c2, s2 = math.cos(y[q + 2]), math.sin(y[q + 2])
                along = (c2 * w0 + s2 * w1) / c1
                f[q] = along
                f[q + 1] = c2 * w1 - s2 * w0
                f[q + 2] = s1 * along + w2
                q += 3
            if free:
                for k in range(3):
                    f[q + k] = y[v + 3 + k]


@compilable
def _limb_powers(model: Any, y: Any, nq: int, f: Any, first: int) -> None:
    """Powers of the limb's torques, lost in its joints, and at their limits."""
    limits, rows = model[at.LIMIT_PLACES], model[at.LIMIT_NUMBERS]
    limb, damping, torques = model[at.LIMB_PLACES], model[at.LIMB_DAMPING], model[at.TORQUES]
    work, lost, ended = 0.0, 0.0, 0.0
    for i in range(len(limb)):
        rate = y[nq + limb[i]]
        work += torques[limb[i]] * rate
        lost += damping[i] * rate * rate
    for i in range(len(limits)):
        n = rows[i]
        q = y[limits[i, 0]]
        if n[0] < q < n[1]:
            continue
        ended += limit_losses(q, y[nq + limits[i, 1]], n[0], n[1], n[2], n[3])
    f[first + TORQUE_WORK], f[first + LOST_JOINTS] = work, lost
    f[first + LOST_LIMITS] = ended


@compilable
def rates(
    model: Any,
    y: Any,
    records: Any,
    origin: Any,
    w: Any,
    leaves: Any,
    tau: Any,
    f: Any,
) -> None:
    """Writes the rates of the state y into f.

    Args:
        model: tables of `layout.open_model`.
        records: (contacts, 17) of `laws.phases`.
        origin, w, leaves, tau: work: (5,), of nodes, of leaves, and one number per velocity.

    """
    nodes, leaf_ints = model[at.NODE_ROWS], model[at.LEAF_ROWS]
    nq, nv = model[at.HEAD][at.POSITIONS], model[at.HEAD][at.VELOCITIES]
    first = nq + nv + model[at.HEAD][at.ELEMENTS]
    audit = len(y) > first
    move(model, y, nq, origin, w, leaves)
    joint_forces(nodes, model[at.NODE_NUMBERS], y, nq, model[at.TORQUES], tau)
    limit_forces(model[at.LIMIT_PLACES], model[at.LIMIT_NUMBERS], y, nq, tau)
    if len(model[at.RIM_ROWS]) or len(model[at.FOLD_ROWS]):
        lost_in_strings = bent_string_forces(
            leaf_ints,
            model[at.LEAF_NUMBERS],
            model[at.SPRING_ENDS],
            model[at.SPRING_NUMBERS],
            model[at.RIM_ROWS],
            model[at.RIM_ARMS],
            model[at.FOLD_ROWS],
            model[at.FOLD_SIZES],
            y,
            nq,
            tau,
        )
    else:
        lost_in_strings = string_forces(
            leaf_ints,
            model[at.LEAF_NUMBERS],
            model[at.SPRING_ENDS],
            model[at.SPRING_NUMBERS],
            y,
            nq,
            tau,
        )
    taken = bushing_forces(
        model[at.BUSHING_ENDS],
        model[at.BUSHING_NUMBERS],
        w,
        origin,
        model[at.HEAD][at.GRIP_BUSHING],
        model[at.HEAD][at.WRIST_BUSHING],
    )
    if len(model[at.STRIKE_ROWS]):
        strike_force(
            model[at.STRIKE_ROWS],
            model[at.STRIKE_NUMBERS],
            model[at.PULSE_NUMBERS],
            origin[at.CLOCK],
            w,
        )
    for k in range(nq + nv, len(y)):
        f[k] = 0.0
    for i in range(len(model[at.CONTACT_ROWS])):
        if records[i, PHASE] != CONTACT:
            continue
        if is_surface(model, i):
            surface_contact(model, i, y, records[i], w, leaves, f, audit and i == 0)
            continue
        c, n, record = model[at.CONTACT_ROWS][i], model[at.CONTACT_NUMBERS][i], records[i]
        head = leaf_ints[c[at.LEAF_0], 0]
        p, v, force, on_ball, r = contact_force(c, n, head, w, leaves, record)
        if audit and i == 0:
            turning = (0.0, 0.0, 0.0)
            if head >= 0 and record[AT_BALL] < 0.5:
                a = w[head]
                turning = back(r, (a[VEL], a[VEL + 1], a[VEL + 2]))
            # in contact until the event, whatever sign a stage past it has: the rate stays smooth
            ball_damping = record[CB] - record[DB] * p[2]
            pushing = (force[0], force[1], max(force[2], 1e-300))
            lost_ball, lost_friction, couple = contact_powers(p, v, pushing, ball_damping, turning)
            f[first + LOST_BALL], f[first + LOST_FRICTION] = lost_ball, lost_friction
            f[first + COUPLE] = couple
            for k in range(3):
                f[first + IMPULSE_AT + k] = on_ball[k]
    leaves_in(leaf_ints, model[at.LEAF_NUMBERS], w, leaves, tau)
    nodes_in(nodes, model[at.NODE_NUMBERS], w, tau)
    nodes_out(nodes, model[at.NODE_NUMBERS], w, tau, f[nq : nq + nv])
    leaves_out(leaf_ints, model[at.LEAF_NUMBERS], w, leaves, f[nq : nq + nv])
    rates_of_positions(nodes, y, nq, leaf_ints, f)
    if audit:
        losses, damping = model[at.FRAME_PLACES], model[at.FRAME_DAMPING]
        for i in range(len(losses)):
            rate = y[nq + losses[i]]
            f[first + LOST_JOINT] += damping[i] * rate * rate
        f[first + LOST_STRINGS] = lost_in_strings
        f[first + GRIP] = taken
        if len(y) > first + TOTALS:
            _limb_powers(model, y, nq, f, first + TOTALS)
