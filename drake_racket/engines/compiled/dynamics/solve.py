"""Solves for the accelerations of a model: Featherstone's articulated-body algorithm.

R. Featherstone, Rigid Body Dynamics Algorithms (2008), chapter 7, with all vectors about one point
of the world, and every joint as a chain of single axes. One axis S after the other is taken out of
the inertia I and the bias force p of a node,

    U = I S,  D = S.U + rotor,  u = tau - S.p,    I - U U^T / D,    p + U u / D

and what is left goes to its parent, with I c added to p (c the bias of the node's acceleration). A
free node leaves nothing, a weld all. A point mass m on a prismatic joint along n leaves
m (1 - n n^T), and of its force what is across n.
"""

from __future__ import annotations

from typing import Any

from drake_racket.engines.compiled.dynamics import layout as at
from drake_racket.engines.compiled.dynamics.layout import (
    ACC,
    ART,
    BIAS,
    FORCE,
    POS,
    SUB,
    VEL,
)
from drake_racket.engines.compiled.dynamics.motion import cross
from drake_racket.laws.compilation import compilable

XX, XY, XZ, YY, YZ, ZZ = range(ART, ART + 6)
"""The rotational block; then 9 of the mixed block by rows, then six of the translational block."""
MIXED, LOWER = ART + 6, ART + 15


@compilable
def inertia_times(a: Any, s0: Any, s1: Any, s2: Any, t0: Any, t1: Any, t2: Any) -> Any:
    """Gives I x of a work row's inertia and x = [s; t]."""
    b, c = MIXED, LOWER
    return (
        (a[XX] * s0 + a[XY] * s1 + a[XZ] * s2) + (a[b] * t0 + a[b + 1] * t1 + a[b + 2] * t2),
        (a[XY] * s0 + a[YY] * s1 + a[YZ] * s2) + (a[b + 3] * t0 + a[b + 4] * t1 + a[b + 5] * t2),
        (a[XZ] * s0 + a[YZ] * s1 + a[ZZ] * s2) + (a[b + 6] * t0 + a[b + 7] * t1 + a[b + 8] * t2),
        (a[b] * s0 + a[b + 3] * s1 + a[b + 6] * s2) + (a[c] * t0 + a[c + 1] * t1 + a[c + 2] * t2),
        (a[b + 1] * s0 + a[b + 4] * s1 + a[b + 7] * s2)
        + (a[c + 1] * t0 + a[c + 3] * t1 + a[c + 4] * t2),
        (a[b + 2] * s0 + a[b + 5] * s1 + a[b + 8] * s2)
        + (a[c + 2] * t0 + a[c + 4] * t1 + a[c + 5] * t2),
    )


@compilable
def add_leaf_inertia(a: Any, leaf: Any, m: float) -> None:
    """Adds what a point mass m on its axis is to its parent: m (1 - n n^T)."""
    r0, r1, r2, n0, n1, n2 = leaf[0], leaf[1], leaf[2], leaf[3], leaf[4], leaf[5]
    u0, u1, u2 = cross(r0, r1, r2, n0, n1, n2)
    square = m * (r0 * r0 + r1 * r1 + r2 * r2)
    a[XX] += square - m * (r0 * r0 + u0 * u0)
    a[XY] -= m * (r0 * r1 + u0 * u1)
    a[XZ] -= m * (r0 * r2 + u0 * u2)
    a[YY] += square - m * (r1 * r1 + u1 * u1)
    a[YZ] -= m * (r1 * r2 + u1 * u2)
    a[ZZ] += square - m * (r2 * r2 + u2 * u2)
    b, c = MIXED, LOWER
    a[b] -= m * u0 * n0
    a[b + 1] -= m * (r2 + u0 * n1)
    a[b + 2] += m * (r1 - u0 * n2)
    a[b + 3] += m * (r2 - u1 * n0)
    a[b + 4] -= m * u1 * n1
    a[b + 5] -= m * (r0 + u1 * n2)
    a[b + 6] -= m * (r1 + u2 * n0)
    a[b + 7] += m * (r0 - u2 * n1)
    a[b + 8] -= m * u2 * n2
    a[c] += m * (1.0 - n0 * n0)
    a[c + 1] -= m * n0 * n1
    a[c + 2] -= m * n0 * n2
    a[c + 3] += m * (1.0 - n1 * n1)
    a[c + 4] -= m * n1 * n2
    a[c + 5] += m * (1.0 - n2 * n2)


@compilable
def leaves_in(ints: Any, numbers: Any, w: Any, leaves: Any, tau: Any) -> None:
    """Hands inertia and forces of all point masses to their parents."""
    for i in range(len(ints)):
        a, n = leaves[i], numbers[i]
        m, v = n[at.LEAF_MASS], ints[i, at.LEAF_V]
        p = ints[i, at.PARENT]
        n0, n1, n2 = a[3], a[4], a[5]
        pull = tau[v]
        a[at.PULL] = pull
        f0, f1, f2 = a[at.PUSH], a[at.PUSH + 1], a[at.PUSH + 2]
        if p >= 0:
            b = w[p]
            w0, w1, w2 = b[VEL], b[VEL + 1], b[VEL + 2]
            x0, x1, x2 = cross(w0, w1, w2, a[6], a[7], a[8])
            z0, z1, z2 = cross(w0, w1, w2, n0, n1, n2)
            rate = a[at.RATE]
            f0 -= m * (x0 + rate * z0)
            f1 -= m * (x1 + rate * z1)
            f2 -= m * (x2 + rate * z2)
        along = n0 * f0 + n1 * f1 + n2 * f2
        a[at.DRAG], a[at.DRAG + 1], a[at.DRAG + 2] = f0, f1, f2
        if p < 0:
            continue
        b = w[p]
        add_leaf_inertia(b, a, m)
        f0 -= n0 * (along + pull)
        f1 -= n1 * (along + pull)
        f2 -= n2 * (along + pull)
        x0, x1, x2 = cross(a[0], a[1], a[2], f0, f1, f2)
        b[FORCE] -= x0
        b[FORCE + 1] -= x1
        b[FORCE + 2] -= x2
        b[FORCE + 3] -= f0
        b[FORCE + 4] -= f1
        b[FORCE + 5] -= f2


@compilable
def leaves_out(ints: Any, numbers: Any, w: Any, leaves: Any, vdot: Any) -> None:
    """Writes the accelerations of the point masses along their axes; the nodes have theirs."""
    for i in range(len(ints)):
        a, p, m = leaves[i], ints[i, at.PARENT], numbers[i, at.LEAF_MASS]
        n0, n1, n2 = a[3], a[4], a[5]
        k = at.DRAG
        along = (n0 * a[k] + n1 * a[k + 1] + n2 * a[k + 2] + a[at.PULL]) / m
        if p >= 0:
            b = w[p]
            x0, x1, x2 = cross(b[ACC], b[ACC + 1], b[ACC + 2], a[0], a[1], a[2])
            along -= n0 * (b[ACC + 3] + x0) + n1 * (b[ACC + 4] + x1) + n2 * (b[ACC + 5] + x2)
        vdot[ints[i, at.LEAF_V]] = along


@compilable
def _eliminate(a: Any, s: Any, rotor: float, tau: Any) -> None:
    """Takes one axis, of row s, out of the inertia and the force of row a; writes U, D, u into s."""
    s0, s1, s2, t0, t1, t2 = s[SUB], s[SUB + 1], s[SUB + 2], s[SUB + 3], s[SUB + 4], s[SUB + 5]
    u0, u1, u2, u3, u4, u5 = inertia_times(a, s0, s1, s2, t0, t1, t2)
    d = (s0 * u0 + s1 * u1 + s2 * u2) + (t0 * u3 + t1 * u4 + t2 * u5 + rotor)
    k = FORCE
    drive = tau - (
        (s0 * a[k] + s1 * a[k + 1] + s2 * a[k + 2])
        + (t0 * a[k + 3] + t1 * a[k + 4] + t2 * a[k + 5])
    )
    k = at.GAIN
    s[k], s[k + 1], s[k + 2], s[k + 3], s[k + 4], s[k + 5] = u0, u1, u2, u3, u4, u5
    s[at.PIVOT], s[at.DRIVE] = d, drive
    inverse = 1.0 / d
    share = drive * inverse
    k = FORCE
    a[k] += u0 * share
    a[k + 1] += u1 * share
    a[k + 2] += u2 * share
    a[k + 3] += u3 * share
    a[k + 4] += u4 * share
    a[k + 5] += u5 * share
    e0, e1, e2 = u0 * inverse, u1 * inverse, u2 * inverse
    e3, e4, e5 = u3 * inverse, u4 * inverse, u5 * inverse
    a[XX] -= u0 * e0
    a[XY] -= u0 * e1
    a[XZ] -= u0 * e2
    a[YY] -= u1 * e1
    a[YZ] -= u1 * e2
    a[ZZ] -= u2 * e2
    k = MIXED
    a[k] -= u0 * e3
    a[k + 1] -= u0 * e4
    a[k + 2] -= u0 * e5
    a[k + 3] -= u1 * e3
    a[k + 4] -= u1 * e4
    a[k + 5] -= u1 * e5
    a[k + 6] -= u2 * e3
    a[k + 7] -= u2 * e4
    a[k + 8] -= u2 * e5
    k = LOWER
    a[k] -= u3 * e3
    a[k + 1] -= u3 * e4
    a[k + 2] -= u3 * e5
    a[k + 3] -= u4 * e4
    a[k + 4] -= u4 * e5
    a[k + 5] -= u5 * e5


@compilable
def _add_bias(a: Any) -> None:
    """Adds I c to the force of a row: what the bias of its own acceleration asks for."""
    k = BIAS
    x0, x1, x2, x3, x4, x5 = inertia_times(
        a, a[k], a[k + 1], a[k + 2], a[k + 3], a[k + 4], a[k + 5]
    )
    k = FORCE
    a[k] += x0
    a[k + 1] += x1
    a[k + 2] += x2
    a[k + 3] += x3
    a[k + 4] += x4
    a[k + 5] += x5


@compilable
def _factor3(xx: Any, xy: Any, xz: Any, yy: Any, yz: Any, zz: Any) -> Any:
    """Factors a symmetric 3 x 3 matrix, L D L^T: L's three numbers by rows, and D's reciprocals."""
    p = 1.0 / xx
    a, b = xy * p, xz * p
    q = 1.0 / (yy - a * xy)
    rest = yz - b * xy
    c = rest * q
    return a, b, c, p, q, 1.0 / (zz - b * xz - c * rest)


@compilable
def _solve3(f: Any, x0: Any, x1: Any, x2: Any) -> Any:
    """Solves with a factor of _factor3."""
    z1 = x1 - f[0] * x0
    z2 = (x2 - f[1] * x0 - f[2] * z1) * f[5]
    r1 = z1 * f[4] - f[2] * z2
    return x0 * f[3] - f[0] * r1 - f[1] * z2, r1, z2


@compilable
def solve_free(a: Any, g0: Any, g1: Any, g2: Any, g3: Any, g4: Any, g5: Any) -> Any:
    """Solves I x = g for a work row's inertia: the translational block first."""
    k, c = MIXED, LOWER
    f = _factor3(a[c], a[c + 1], a[c + 2], a[c + 3], a[c + 4], a[c + 5])
    x0, x1, x2 = _solve3(f, a[k], a[k + 1], a[k + 2])
    y0, y1, y2 = _solve3(f, a[k + 3], a[k + 4], a[k + 5])
    z0, z1, z2 = _solve3(f, a[k + 6], a[k + 7], a[k + 8])
    h = _factor3(
        a[XX] - (a[k] * x0 + a[k + 1] * x1 + a[k + 2] * x2),
        a[XY] - (a[k] * y0 + a[k + 1] * y1 + a[k + 2] * y2),
        a[XZ] - (a[k] * z0 + a[k + 1] * z1 + a[k + 2] * z2),
        a[YY] - (a[k + 3] * y0 + a[k + 4] * y1 + a[k + 5] * y2),
        a[YZ] - (a[k + 3] * z0 + a[k + 4] * z1 + a[k + 5] * z2),
        a[ZZ] - (a[k + 6] * z0 + a[k + 7] * z1 + a[k + 8] * z2),
    )
    b0, b1, b2 = _solve3(f, g3, g4, g5)
    s0, s1, s2 = _solve3(
        h,
        g0 - (a[k] * b0 + a[k + 1] * b1 + a[k + 2] * b2),
        g1 - (a[k + 3] * b0 + a[k + 4] * b1 + a[k + 5] * b2),
        g2 - (a[k + 6] * b0 + a[k + 7] * b1 + a[k + 8] * b2),
    )
    return (
        s0,
        s1,
        s2,
        b0 - (x0 * s0 + y0 * s1 + z0 * s2),
        b1 - (x1 * s0 + y1 * s1 + z1 * s2),
        b2 - (x2 * s0 + y2 * s1 + z2 * s2),
    )


@compilable
def nodes_in(ints: Any, numbers: Any, w: Any, tau: Any) -> None:
    """Goes from the leaves to the world: what each node leaves to its parent."""
    for i in range(len(ints) - 1, -1, -1):
        p, kind, count = ints[i, at.PARENT], ints[i, at.KIND], int(numbers[i, at.RUN])
        if kind >= at.FREE_QUATERNION or count == 0:
            continue
        last = i + count - 1
        a = w[last]
        if kind != at.WELD:
            for k in range(last, i - 1, -1):
                _eliminate(a, w[k], numbers[k, at.ROTOR], tau[ints[k, at.V]])
        if p < 0:
            continue
        if kind != at.WELD:
            _add_bias(a)
        b = w[p]
        for k in range(ART, ART + 27):
            b[k] += a[k]


@compilable
def _free_out(a: Any, r: Any, tau: Any, v: int, vdot: Any) -> None:
    """Acceleration of a free node; r (9) is the rotation of its F in the world."""
    m0 = r[0] * tau[v] + r[1] * tau[v + 1] + r[2] * tau[v + 2]
    m1 = r[3] * tau[v] + r[4] * tau[v + 1] + r[5] * tau[v + 2]
    m2 = r[6] * tau[v] + r[7] * tau[v + 1] + r[8] * tau[v + 2]
    f0 = r[0] * tau[v + 3] + r[1] * tau[v + 4] + r[2] * tau[v + 5]
    f1 = r[3] * tau[v + 3] + r[4] * tau[v + 4] + r[5] * tau[v + 5]
    f2 = r[6] * tau[v + 3] + r[7] * tau[v + 4] + r[8] * tau[v + 5]
    p0, p1, p2 = a[POS], a[POS + 1], a[POS + 2]
    x0, x1, x2 = cross(p0, p1, p2, f0, f1, f2)
    k = FORCE
    s0, s1, s2, t0, t1, t2 = solve_free(
        a,
        m0 + x0 - a[k],
        m1 + x1 - a[k + 1],
        m2 + x2 - a[k + 2],
        f0 - a[k + 3],
        f1 - a[k + 4],
        f2 - a[k + 5],
    )
    k = ACC
    a[k], a[k + 1], a[k + 2], a[k + 3], a[k + 4], a[k + 5] = s0, s1, s2, t0, t1, t2
    # that of the node's origin, whose velocity the bias holds
    x0, x1, x2 = cross(s0, s1, s2, p0, p1, p2)
    z0, z1, z2 = cross(a[VEL], a[VEL + 1], a[VEL + 2], a[BIAS], a[BIAS + 1], a[BIAS + 2])
    t0, t1, t2 = t0 + x0 + z0, t1 + x1 + z1, t2 + x2 + z2
    for k in range(3):
        r0, r1, r2 = r[k], r[3 + k], r[6 + k]
        vdot[v + k] = r0 * s0 + r1 * s1 + r2 * s2
        vdot[v + 3 + k] = r0 * t0 + r1 * t1 + r2 * t2


@compilable
def nodes_out(ints: Any, numbers: Any, w: Any, tau: Any, vdot: Any) -> None:
    """Goes from the world to the leaves: accelerations of all nodes, rates of all velocities."""
    for i in range(len(ints)):
        p, kind, count = ints[i, at.PARENT], ints[i, at.KIND], int(numbers[i, at.RUN])
        if kind >= at.FREE_QUATERNION:
            _free_out(w[i], numbers[i], tau, ints[i, at.V], vdot)
            continue
        if count == 0:
            continue
        a = w[i + count - 1]
        x0, x1, x2, x3, x4, x5 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        if p >= 0:
            b, k = w[p], ACC
            x0, x1, x2, x3, x4, x5 = b[k], b[k + 1], b[k + 2], b[k + 3], b[k + 4], b[k + 5]
        if kind != at.WELD:
            k = BIAS
            x0, x1, x2 = x0 + a[k], x1 + a[k + 1], x2 + a[k + 2]
            x3, x4, x5 = x3 + a[k + 3], x4 + a[k + 4], x5 + a[k + 5]
            for j in range(i, i + count):
                s, k = w[j], at.GAIN
                m = s[k] * x0 + s[k + 1] * x1 + s[k + 2] * x2
                f = s[k + 3] * x3 + s[k + 4] * x4 + s[k + 5] * x5
                rate = (s[at.DRIVE] - (m + f)) / s[at.PIVOT]
                vdot[ints[j, at.V]] = rate
                k = SUB
                x0, x1, x2 = x0 + s[k] * rate, x1 + s[k + 1] * rate, x2 + s[k + 2] * rate
                x3, x4, x5 = x3 + s[k + 3] * rate, x4 + s[k + 4] * rate, x5 + s[k + 5] * rate
        k = ACC
        a[k], a[k + 1], a[k + 2], a[k + 3], a[k + 4], a[k + 5] = x0, x1, x2, x3, x4, x5
