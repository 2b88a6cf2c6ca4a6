"""Splits friction off the equations of motion, to be taken implicitly by `steps`.

Where friction is smoothed over a small sliding speed it is stiff, but only in two directions. Over
a step from t_n on, its part of v' is near

    U phi(w, N),    w = V v + d (t - t_n),    N = N_n + N' (t - t_n)

with the rows V (2, nv) that give the sliding velocity of a velocity v, the columns U that give v'
under a unit of friction, phi the law (`laws.contact`), and the rates d and N' at t_n, all frozen
over the step. An additive Runge-Kutta method keeps its order whatever is split off; the better that
is, the less stiff is the rest. A stage is then two equations for w.
"""

from __future__ import annotations

from typing import Any

from drake_racket.engines.compiled.dynamics import layout as at
from drake_racket.engines.compiled.dynamics.forces import ball_motion, relative
from drake_racket.engines.compiled.dynamics.layout import ACC, OWN, POS, SUB, VEL
from drake_racket.engines.compiled.dynamics.motion import back, cross
from drake_racket.engines.compiled.dynamics.solve import solve_free
from drake_racket.laws.compilation import compilable, finds_root
from drake_racket.laws.contact import friction_partials, normal_force, normal_slopes
from drake_racket.laws.phases import AT_BALL, CB, DB, HB, KB, POINT


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
def _rate_of_sliding(
    model: Any, contact: int, i: int, r: Any, v: Any, w: Any, leaves: Any, f: Any
) -> Any:
    """Rate of the ball's velocity relative to the string mass, as seen in the head (m/s^2).

    With Q the ball, v = R^T (v_Q - v_H - n s), v_H the head's point under it: the head's axes turn,
    and the point moves on with the ball. Point mass i is the one in contact.
    """
    c, n = model[at.CONTACT_ROWS][contact], model[at.CONTACT_NUMBERS][contact]
    q0, q1, q2, u0, u1, u2 = ball_motion(n, c[at.BALL], w)
    a = w[c[at.BALL]]
    x0, x1, x2 = cross(a[ACC], a[ACC + 1], a[ACC + 2], q0, q1, q2)
    z0, z1, z2 = cross(a[VEL], a[VEL + 1], a[VEL + 2], u0, u1, u2)
    g0, g1, g2 = a[ACC + 3] + x0 + z0, a[ACC + 4] + x1 + z1, a[ACC + 5] + x2 + z2
    head = model[at.LEAF_ROWS][i, at.PARENT]
    b0, b1, b2 = 0.0, 0.0, 0.0
    if head >= 0:
        a = w[head]
        x0, x1, x2 = cross(a[ACC], a[ACC + 1], a[ACC + 2], q0, q1, q2)
        z0, z1, z2 = cross(a[VEL], a[VEL + 1], a[VEL + 2], u0, u1, u2)
        g0 -= a[ACC + 3] + x0 + z0
        g1 -= a[ACC + 4] + x1 + z1
        g2 -= a[ACC + 5] + x2 + z2
        b0, b1, b2 = back(r, (a[VEL], a[VEL + 1], a[VEL + 2]))
    g0, g1, g2 = back(r, (g0, g1, g2))
    rate = f[model[at.LEAF_ROWS][i, at.LEAF_V]]
    # of v with the string's own rate in it, which has the axis of z
    s = leaves[i, at.RATE]
    x0, x1, x2 = cross(b0, b1, b2, v[0], v[1], v[2] + s)
    return g0 - x0, g1 - x1, g2 - x2 - rate


@compilable
def linearise(
    model: Any,
    contact: int,
    record: Any,
    w: Any,
    leaves: Any,
    f: Any,
    columns: Any,
    rows: Any,
    law: Any,
) -> None:
    """Writes what is split off of a contact at the state of the last `rates`.

    Args:
        f: (nv,) v' there.
        columns, rows: (2, nv) U^T and V.
        law: (9,) w_n (2); d (2); N and N'; the last three are not written.

    """
    ints, leaf_ints, numbers = model[at.NODE_ROWS], model[at.LEAF_ROWS], model[at.NODE_NUMBERS]
    c, n = model[at.CONTACT_ROWS][contact], model[at.CONTACT_NUMBERS][contact]
    i = c[at.LEAF_0] + int(record[POINT]) - 1
    leaf, head = leaves[i], leaf_ints[i, 0]
    p, v, r = relative(n, c[at.BALL], head, w, leaf)
    a0, a1, a2 = _rate_of_sliding(model, contact, i, r, v, w, leaves, f)
    q0, q1, q2, _, _, _ = ball_motion(n, c[at.BALL], w)
    place = (q0, q1, q2)
    for axis in range(2):
        e = (r[axis], r[3 + axis], r[6 + axis])
        for k in range(len(rows[axis])):
            rows[axis, k] = 0.0
        _add_row(ints, numbers, w, c[at.BALL], 1.0, e, place, rows[axis])
        _add_row(ints, numbers, w, head, -1.0, e, place, rows[axis])
    law[0], law[1], law[2], law[3] = v[0], v[1], a0, a1
    for axis in range(2):
        for k in range(len(f)):
            law[2 + axis] -= rows[axis, k] * f[k]
    kb, cb, hb, db = record[KB], record[CB], record[HB], record[DB]
    kx, cx = normal_slopes(-p[2], -v[2], kb, cb, hb, db)
    law[4] = normal_force(-p[2], -v[2], kb, cb, hb, db)
    law[5] = -kx * v[2] - cx * a2
    for axis in range(2):
        e = (r[axis], r[3 + axis], r[6 + axis])
        for k in range(len(ints)):
            for j in range(6):
                w[k, OWN + j] = 0.0
        _load(w, c[at.BALL], 1.0, e, place)
        if record[AT_BALL] > 0.5:
            _load(w, head, -1.0, e, place)
        else:
            _load(w, head, -1.0, e, (leaf[0], leaf[1], leaf[2]))
        _respond(ints, numbers, leaf_ints, w, leaves, columns[axis])


@compilable
def friction_at(x0: float, x1: float, normal: float, constants: Any) -> Any:
    """Gives friction (N) at a sliding velocity under a normal force, and its derivative (2, 2)."""
    load = max(normal, 0.0)
    load = constants[0] * (load / constants[0])  # rounded as it has always been
    _, _, ex, ey, share = friction_partials(x0, x1, load, constants)
    return (
        -share * x0,
        -share * x1,
        -share * (1.0 - ex * ex),
        share * ex * ey,
        -share * (1.0 - ey * ey),
    )


@compilable
def _closer(
    x0: float, x1: float, s0: float, s1: float, h: float, inner: Any, normal: float, constants: Any
) -> Any:
    """One step of Newton's method towards w = s + h E phi(w), and its length (2)."""
    f0, f1, a, b, d = friction_at(x0, x1, normal, constants)
    r0 = x0 - s0 - h * (inner[0, 0] * f0 + inner[0, 1] * f1)
    r1 = x1 - s1 - h * (inner[1, 0] * f0 + inner[1, 1] * f1)
    m00 = 1.0 - h * (inner[0, 0] * a + inner[0, 1] * b)
    m01 = -h * (inner[0, 0] * b + inner[0, 1] * d)
    m10 = -h * (inner[1, 0] * a + inner[1, 1] * b)
    m11 = 1.0 - h * (inner[1, 0] * b + inner[1, 1] * d)
    determinant = m00 * m11 - m01 * m10
    d0, d1 = (m11 * r0 - m01 * r1) / determinant, (m00 * r1 - m10 * r0) / determinant
    return x0 - d0, x1 - d1, d0, d1


@finds_root
@compilable
def _root(s0: float, s1: float, h: float, inner: Any, normal: float, constants: Any) -> Any:
    """The root w of w = s + h E phi(w)."""
    # from rest: the law bends towards its limit there, and Newton's method comes up from below
    x0, x1 = 0.0, 0.0
    size = constants[5]
    for _ in range(50):
        x0, x1, d0, d1 = _closer(x0, x1, s0, s1, h, inner, normal, constants)
        if abs(d0) + abs(d1) <= 1e-14 * (size + abs(x0) + abs(x1)):
            break
    return x0, x1


@compilable
def solve_sliding(s0: float, s1: float, h: float, inner: Any, normal: float, constants: Any) -> Any:
    """Solves w = s + h E phi(w) for the sliding velocity w of a stage, by Newton's method.

    Returns:
        phi(w) (N) and w (m/s), two numbers each.

    """
    x0, x1 = _root(s0, s1, h, inner, normal, constants)
    x0, x1, _, _ = _closer(x0, x1, s0, s1, h, inner, normal, constants)
    f0, f1, _, _, _ = friction_at(x0, x1, normal, constants)
    return f0, f1, x0, x1
