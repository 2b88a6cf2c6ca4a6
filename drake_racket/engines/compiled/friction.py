"""Linearises friction in contact: how the ball's sliding answers a tangential force, and back.

Where friction is smoothed over a small sliding speed it is stiff, and only in two directions. With
the rows V (2, nv) that give the sliding velocity of a velocity v, the columns U that give v' under a
unit of friction, and G = dF/dv_t of the law, friction's part of dv'/dv is U G V, of rank two.
"""

from __future__ import annotations

from typing import Any

from drake_racket.engines.compiled import layout as at
from drake_racket.engines.compiled.forces import ball_motion, head_axes, relative
from drake_racket.engines.compiled.layout import ACC, OWN, POS, SUB
from drake_racket.engines.compiled.motion import cross
from drake_racket.engines.compiled.solve import solve_free
from drake_racket.laws.compilation import compilable
from drake_racket.laws.contact import contact_partials
from drake_racket.laws.phases import AT_BALL, CONSTANTS, POINT


@compilable
def _add_row(
    ints: Any, numbers: Any, w: Any, node: int, sign: float, e: Any, p: Any, row: Any
) -> None:
    """Adds sign times e . (velocity at p of a node) to a row over all velocities."""
    while node >= 0:
        a, kind, v = w[node], ints[node, at.KIND], ints[node, at.V]
        if kind >= at.FREE_QUATERNION:
            r = numbers[node]
            d0, d1, d2 = p[0] - a[POS], p[1] - a[POS + 1], p[2] - a[POS + 2]
            m0, m1, m2 = cross(d0, d1, d2, e[0], e[1], e[2])
            for k in range(3):
                row[v + k] += sign * (r[k] * m0 + r[3 + k] * m1 + r[6 + k] * m2)
                row[v + 3 + k] += sign * (r[k] * e[0] + r[3 + k] * e[1] + r[6 + k] * e[2])
        elif kind != at.WELD:
            m0, m1, m2 = cross(p[0], p[1], p[2], e[0], e[1], e[2])
            row[v] += sign * (
                a[SUB] * m0
                + a[SUB + 1] * m1
                + a[SUB + 2] * m2
                + a[SUB + 3] * e[0]
                + a[SUB + 4] * e[1]
                + a[SUB + 5] * e[2]
            )
        node = ints[node, at.PARENT]


@compilable
def _load(w: Any, node: int, sign: float, e: Any, p: Any) -> None:
    """Puts a force sign * e at p on a node, among the forces of `_respond`."""
    if node < 0:
        return
    a = w[node]
    m0, m1, m2 = cross(p[0], p[1], p[2], e[0], e[1], e[2])
    k = OWN
    a[k] -= sign * m0
    a[k + 1] -= sign * m1
    a[k + 2] -= sign * m2
    a[k + 3] -= sign * e[0]
    a[k + 4] -= sign * e[1]
    a[k + 5] -= sign * e[2]


@compilable
def _respond(ints: Any, numbers: Any, leaf_ints: Any, w: Any, leaves: Any, vdot: Any) -> None:
    """Writes v' under the forces in OWN alone, with the factors of the last `rates`."""
    for i in range(len(ints) - 1, -1, -1):
        p, kind, a = ints[i, at.PARENT], ints[i, at.KIND], w[i]
        if kind >= at.FREE_QUATERNION:
            continue
        share = 0.0
        if kind != at.WELD:
            drive = 0.0
            for k in range(6):
                drive -= a[SUB + k] * a[OWN + k]
            vdot[ints[i, at.V]] = drive
            share = drive / a[at.PIVOT]
        if p >= 0:
            for k in range(6):
                w[p, OWN + k] += a[OWN + k] + (a[at.GAIN + k] * share if kind != at.WELD else 0.0)
    for i in range(len(ints)):
        p, kind, a = ints[i, at.PARENT], ints[i, at.KIND], w[i]
        v = ints[i, at.V]
        if kind >= at.FREE_QUATERNION:
            k = OWN
            s0, s1, s2, t0, t1, t2 = solve_free(
                a, -a[k], -a[k + 1], -a[k + 2], -a[k + 3], -a[k + 4], -a[k + 5]
            )
            k = ACC
            a[k], a[k + 1], a[k + 2], a[k + 3], a[k + 4], a[k + 5] = s0, s1, s2, t0, t1, t2
            x0, x1, x2 = cross(s0, s1, s2, a[POS], a[POS + 1], a[POS + 2])
            t0, t1, t2 = t0 + x0, t1 + x1, t2 + x2
            r = numbers[i]
            for k in range(3):
                vdot[v + k] = r[k] * s0 + r[3 + k] * s1 + r[6 + k] * s2
                vdot[v + 3 + k] = r[k] * t0 + r[3 + k] * t1 + r[6 + k] * t2
            continue
        for k in range(6):
            a[ACC + k] = w[p, ACC + k] if p >= 0 else 0.0
        if kind == at.WELD:
            continue
        rate = vdot[v]
        for k in range(6):
            rate -= a[at.GAIN + k] * a[ACC + k]
        rate /= a[at.PIVOT]
        vdot[v] = rate
        for k in range(6):
            a[ACC + k] += a[SUB + k] * rate
    for i in range(len(leaf_ints)):
        a, p = leaves[i], leaf_ints[i, at.PARENT]
        along = 0.0
        if p >= 0:
            b = w[p]
            x0, x1, x2 = cross(b[ACC], b[ACC + 1], b[ACC + 2], a[0], a[1], a[2])
            along = a[3] * (b[ACC + 3] + x0) + a[4] * (b[ACC + 4] + x1) + a[5] * (b[ACC + 5] + x2)
        vdot[leaf_ints[i, at.LEAF_V]] = -along


@compilable
def linearise(
    model: Any, contact: int, record: Any, w: Any, leaves: Any, columns: Any, rows: Any, gain: Any
) -> None:
    """Writes U, V and G of a contact at the state of the last `rates`.

    Args:
        columns, rows: (2, nv) U^T and V.  gain: (2, 2) G.

    """
    ints, leaf_ints, numbers = model[0], model[1], model[8]
    c, n = model[4][contact], model[12][contact]
    i = c[at.LEAF_0] + int(record[POINT]) - 1
    leaf, head = leaves[i], leaf_ints[i, 0]
    p, v, r = relative(n, c[at.BALL], head, w, leaf)
    _, _, _, _, _, ex, ey, share = contact_partials(p, v, record[CONSTANTS])
    gain[0, 0], gain[0, 1] = -share * (1.0 - ex * ex), share * ex * ey
    gain[1, 0], gain[1, 1] = share * ex * ey, -share * (1.0 - ey * ey)
    q0, q1, q2, _, _, _ = ball_motion(n, c[at.BALL], w)
    place = (q0, q1, q2)
    for axis in range(2):
        e = (r[axis], r[3 + axis], r[6 + axis])
        for k in range(len(rows[axis])):
            rows[axis, k] = 0.0
        _add_row(ints, numbers, w, c[at.BALL], 1.0, e, place, rows[axis])
        _add_row(ints, numbers, w, head, -1.0, e, place, rows[axis])
        for k in range(len(ints)):
            for j in range(6):
                w[k, OWN + j] = 0.0
        _load(w, c[at.BALL], 1.0, e, place)
        if record[AT_BALL] > 0.5:
            _load(w, head, -1.0, e, place)
        else:
            _load(w, head, -1.0, e, (leaf[0], leaf[1], leaf[2]))
        _respond(ints, numbers, leaf_ints, w, leaves, columns[axis])


__all__ = ["head_axes", "linearise"]
