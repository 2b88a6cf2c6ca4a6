"""Reads from a model's states what results are made of: motion of bodies, loads, contact."""

from __future__ import annotations

from typing import Any

import numpy as np

from drake_racket.engines.compiled.dynamics import layout as at
from drake_racket.engines.compiled.dynamics.events import look
from drake_racket.engines.compiled.dynamics.forces import bushing_force, frame_end
from drake_racket.engines.compiled.dynamics.layout import ACC, FORCE, POS, VEL
from drake_racket.engines.compiled.dynamics.motion import back, cross
from drake_racket.engines.compiled.dynamics.rates import move, rates
from drake_racket.engines.compiled.dynamics.solve import inertia_times
from drake_racket.engines.compiled.dynamics.surface import is_surface, see_surface
from drake_racket.laws.compilation import compilable, makes_arrays
from drake_racket.laws.contact import CONTACT, contact_law
from drake_racket.laws.phases import CONSTANTS, PHASE

NODE_ROW = 30
"""Of an observed node: rotation (9), place (3) and spatial velocity (6) and acceleration (6) of its
origin in the world; force (6) that its joint puts on it, about its origin, in the world's axes."""


@compilable
def _see_node(a: Any, inner: Any, origin: Any, row: Any) -> None:
    """Writes the row of a node; what is left of its inertia moves with the accelerations `inner`."""
    for k in range(9):
        row[k] = a[k]
    p0, p1, p2 = a[POS], a[POS + 1], a[POS + 2]
    for k in range(3):
        row[9 + k] = a[POS + k] + origin[k]
        row[12 + k] = a[VEL + k]
        row[18 + k] = a[ACC + k]
    x0, x1, x2 = cross(a[VEL], a[VEL + 1], a[VEL + 2], p0, p1, p2)
    v0, v1, v2 = a[VEL + 3] + x0, a[VEL + 4] + x1, a[VEL + 5] + x2
    row[15], row[16], row[17] = v0, v1, v2
    x0, x1, x2 = cross(a[ACC], a[ACC + 1], a[ACC + 2], p0, p1, p2)
    z0, z1, z2 = cross(a[VEL], a[VEL + 1], a[VEL + 2], v0, v1, v2)
    row[21] = a[ACC + 3] + x0 + z0
    row[22] = a[ACC + 4] + x1 + z1
    row[23] = a[ACC + 5] + x2 + z2
    m0, m1, m2, f0, f1, f2 = inertia_times(a, *inner)
    k = FORCE
    f0, f1, f2 = f0 + a[k + 3], f1 + a[k + 4], f2 + a[k + 5]
    x0, x1, x2 = cross(p0, p1, p2, f0, f1, f2)
    row[24], row[25], row[26] = m0 + a[k] - x0, m1 + a[k + 1] - x1, m2 + a[k + 2] - x2
    row[27], row[28], row[29] = f0, f1, f2


@compilable
def _see_grip(model: Any, i: int, w: Any, origin: Any, load: Any) -> None:
    """Torque and force of bushing i on the node of its frame A, at A, in A's axes."""
    a, c, n = (
        model[at.BUSHING_ENDS][i, 0],
        model[at.BUSHING_ENDS][i, 1],
        model[at.BUSHING_NUMBERS][i],
    )
    m0, m1, m2, f0, f1, f2, _ = bushing_force(n, a, c, w, origin)
    r, p, _, _ = frame_end(w, a, n, at.R_NA, at.P_NA, origin)
    x0, x1, x2 = cross(p[0], p[1], p[2], f0, f1, f2)
    t0, t1, t2 = back(r, (x0 - m0, x1 - m1, x2 - m2))
    g0, g1, g2 = back(r, (-f0, -f1, -f2))
    load[0], load[1], load[2], load[3], load[4], load[5] = t0, t1, t2, g0, g1, g2


@makes_arrays
def observe_motion(
    model: Any, states: Any, records: Any, nodes: Any, leaves_out: Any, loads: Any
) -> None:
    """Writes the motion at m states.

    Args:
        model: tables, of nodes one by one (`layout.one_by_one`).
        states: (m, size) [q; v; elements, ...].  records: (m, contacts, 15).
        nodes: (m, n, NODE_ROW).  leaves_out: (m, leaves, 6) place and velocity in the world.
        loads: (m, 6) on the hand, from the grip's bushing; 0 without one.

    """
    origin, tau = np.zeros(3), np.zeros(model[at.HEAD][at.VELOCITIES])
    w = np.zeros((model[at.HEAD][at.NODES], at.NODE_WORK))
    leaves = np.zeros((model[at.HEAD][at.LEAVES], at.LEAF_WORK))
    size = model[at.HEAD][at.POSITIONS] + model[at.HEAD][at.VELOCITIES]
    y = np.zeros(size + model[at.HEAD][at.ELEMENTS])
    f = np.zeros(len(y))
    grip = model[at.HEAD][at.GRIP_BUSHING]
    for m in range(len(states)):
        for i in range(len(y)):
            y[i] = states[m, i]
        rates(model, y, records[m], origin, w, leaves, tau, f)
        for i in range(len(w)):
            # the load of a joint is asked for after its axis was taken out, but a weld has none
            inner, k = i, ACC
            if model[at.NODE_ROWS][i, at.KIND] < at.WELD:
                inner = model[at.NODE_ROWS][i, at.PARENT]
            moved = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
            if inner >= 0:
                b = w[inner]
                moved = (b[k], b[k + 1], b[k + 2], b[k + 3], b[k + 4], b[k + 5])
            _see_node(w[i], moved, origin, nodes[m, i])
        for i in range(len(leaves)):
            for k in range(3):
                leaves_out[m, i, k] = leaves[i, k] + origin[k]
                leaves_out[m, i, 3 + k] = leaves[i, 6 + k]
        if grip >= 0:
            _see_grip(model, grip, w, origin, loads[m])


@makes_arrays
def observe_contact(model: Any, states: Any, records: Any, out: Any) -> None:
    """Writes what the contact's output `contact_state` has, for the first contact, (m, 9)."""
    origin = np.zeros(3)
    w = np.zeros((model[at.HEAD][at.NODES], at.NODE_WORK))
    leaves = np.zeros((model[at.HEAD][at.LEAVES], at.LEAF_WORK))
    for m in range(len(states)):
        move(model, states[m], model[at.HEAD][at.POSITIONS], origin, w, leaves)
        if is_surface(model, 0):
            out[m, 0] = records[m, 0, PHASE]
            see_surface(model, states[m], records[m, 0], w, leaves, out[m])
            continue
        touching = records[m, 0, PHASE] == CONTACT
        point, p, v = look(model, 0, records[m], w, leaves, not touching)
        fx, fy, normal = 0.0, 0.0, 0.0
        if touching:
            fx, fy, normal, _ = contact_law(p, v, records[m, 0, CONSTANTS])
        row = out[m]
        row[0], row[1], row[2], row[3] = records[m, 0, PHASE], point, -p[2], -v[2]
        row[4], row[5], row[6], row[7], row[8] = normal, fx, fy, v[0], v[1]
