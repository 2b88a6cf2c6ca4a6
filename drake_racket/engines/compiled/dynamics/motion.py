"""Computes where the nodes of a model are, how fast they move, and what their own inertia asks for.

All spatial vectors are about one point of the world, in the world's axes, rotational part first:
nothing is shifted from body to body. The point is at each evaluation where the ball is, so that
small bodies far from the world's origin keep their digits.
"""

from __future__ import annotations

import math
from typing import Any

from drake_racket.engines.compiled.dynamics import layout as at
from drake_racket.engines.compiled.dynamics.layout import (
    ART,
    BIAS,
    FORCE,
    OWN,
    POS,
    ROT,
    SUB,
    VEL,
)
from drake_racket.laws.compilation import compilable


@compilable
def cross(a0: Any, a1: Any, a2: Any, b0: Any, b1: Any, b2: Any) -> Any:
    """Gives a x b."""
    return a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0


@compilable
def nine(a: Any, k: int) -> Any:
    """Gives nine numbers of a row from k on: a rotation by rows."""
    return a[k], a[k + 1], a[k + 2], a[k + 3], a[k + 4], a[k + 5], a[k + 6], a[k + 7], a[k + 8]


@compilable
def product(a: Any, b: Any) -> Any:
    """Gives the rotation (9) A B."""
    return (
        a[0] * b[0] + a[1] * b[3] + a[2] * b[6],
        a[0] * b[1] + a[1] * b[4] + a[2] * b[7],
        a[0] * b[2] + a[1] * b[5] + a[2] * b[8],
        a[3] * b[0] + a[4] * b[3] + a[5] * b[6],
        a[3] * b[1] + a[4] * b[4] + a[5] * b[7],
        a[3] * b[2] + a[4] * b[5] + a[5] * b[8],
        a[6] * b[0] + a[7] * b[3] + a[8] * b[6],
        a[6] * b[1] + a[7] * b[4] + a[8] * b[7],
        a[6] * b[2] + a[7] * b[5] + a[8] * b[8],
    )


@compilable
def turn(r: Any, x: Any) -> Any:
    """Gives R x."""
    return (
        r[0] * x[0] + r[1] * x[1] + r[2] * x[2],
        r[3] * x[0] + r[4] * x[1] + r[5] * x[2],
        r[6] * x[0] + r[7] * x[1] + r[8] * x[2],
    )


@compilable
def back(r: Any, x: Any) -> Any:
    """Gives R^T x."""
    return (
        r[0] * x[0] + r[3] * x[1] + r[6] * x[2],
        r[1] * x[0] + r[4] * x[1] + r[7] * x[2],
        r[2] * x[0] + r[5] * x[1] + r[8] * x[2],
    )


@compilable
def placed(a: Any, x: Any) -> Any:
    """Gives the place (3) of a point fixed on a node, x (3) in its axes; `a` is the node's row."""
    p = turn(nine(a, ROT), x)
    return a[POS] + p[0], a[POS + 1] + p[1], a[POS + 2] + p[2]


@compilable
def from_quaternion(a: Any, b: Any, c: Any, d: Any) -> Any:
    """Gives the rotation (9) of a quaternion, w first, of any length."""
    s = 2.0 / (a * a + b * b + c * c + d * d)
    return (
        1.0 - s * (c * c + d * d),
        s * (b * c - a * d),
        s * (b * d + a * c),
        s * (b * c + a * d),
        1.0 - s * (b * b + d * d),
        s * (c * d - a * b),
        s * (b * d - a * c),
        s * (c * d + a * b),
        1.0 - s * (b * b + c * c),
    )


@compilable
def from_rpy(roll: Any, pitch: Any, yaw: Any) -> Any:
    """Gives the rotation (9) Rz(yaw) Ry(pitch) Rx(roll)."""
    s0, c0 = math.sin(roll), math.cos(roll)
    s1, c1 = math.sin(pitch), math.cos(pitch)
    s2, c2 = math.sin(yaw), math.cos(yaw)
    return (
        c2 * c1,
        c2 * s1 * s0 - s2 * c0,
        c2 * s1 * c0 + s2 * s0,
        s2 * c1,
        s2 * s1 * s0 + c2 * c0,
        s2 * s1 * c0 - c2 * s0,
        -s1,
        c1 * s0,
        c1 * c0,
    )


@compilable
def _frame(w: Any, i: int, p: int, turned: int, numbers: Any, origin: Any) -> Any:
    """Rotation (9) and place (3) of the frame F of node i, on its parent p."""
    n, k = numbers[i], at.P_PF
    place = n[k], n[k + 1], n[k + 2]
    if p < 0:
        at_origin = place[0] - origin[0], place[1] - origin[1], place[2] - origin[2]
        return nine(n, at.R_PF), at_origin
    r = nine(w[p], ROT)
    if turned:
        r = product(r, nine(n, at.R_PF))
    return r, placed(w[p], place)


@compilable
def _set_rotation(w: Any, i: int, r: Any) -> None:
    for k in range(9):
        w[i, ROT + k] = r[k]


@compilable
def _set_free(w: Any, i: int, kind: int, r: Any, place: Any, y: Any, q: int, v: int) -> None:
    """Pose and velocity of a node that is free in the world."""
    if kind == at.FREE_QUATERNION:
        _set_rotation(w, i, product(r, from_quaternion(y[q], y[q + 1], y[q + 2], y[q + 3])))
        q += 4
    else:
        _set_rotation(w, i, product(r, from_rpy(y[q], y[q + 1], y[q + 2])))
        q += 3
    x0, x1, x2 = y[q], y[q + 1], y[q + 2]
    a, b = w[i], v
    for k in range(3):
        r0, r1, r2 = r[3 * k], r[3 * k + 1], r[3 * k + 2]
        a[POS + k] = place[k] + r0 * x0 + r1 * x1 + r2 * x2
        a[VEL + k] = r0 * y[b] + r1 * y[b + 1] + r2 * y[b + 2]
        a[VEL + 3 + k] = r0 * y[b + 3] + r1 * y[b + 4] + r2 * y[b + 5]
    d0, d1, d2 = cross(a[POS], a[POS + 1], a[POS + 2], a[VEL], a[VEL + 1], a[VEL + 2])
    # the bias: what the acceleration about the fixed point has beside that of the node's origin
    a[BIAS], a[BIAS + 1], a[BIAS + 2] = a[VEL + 3], a[VEL + 4], a[VEL + 5]
    a[VEL + 3] += d0
    a[VEL + 4] += d1
    a[VEL + 5] += d2


@compilable
def _turn_about(a: Any, axis: int, angle: Any) -> None:
    """Turns a work row's rotation about one of its own axes."""
    c, s = math.cos(angle), math.sin(angle)
    i = ROT + axis + 1 if axis < 2 else ROT
    j = ROT + axis - 1 if axis > 0 else ROT + 2
    for k in range(3):
        x0, x1 = a[3 * k + i], a[3 * k + j]
        a[3 * k + i] = c * x0 + s * x1
        a[3 * k + j] = c * x1 - s * x0


@compilable
def _set_run(
    ints: Any, numbers: Any, w: Any, i: int, count: int, r: Any, place: Any, y: Any, nq: int
) -> None:
    """Writes axes, and the motion of the last node, of a run of revolute axes through one point.

    With the velocity u of that point as one of the parent, and w_i what turns an axis e_i, the
    biases sum up to b = sum of w_i x e_i q_i', and u x (sum of e_i q_i') + place x b.
    """
    p, last = ints[i, at.PARENT], i + count - 1
    a = w[last]
    p0, p1, p2 = place[0], place[1], place[2]
    _set_rotation(w, last, r)
    a[POS], a[POS + 1], a[POS + 2] = p0, p1, p2
    w0, w1, w2, u0, u1, u2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if p >= 0:
        b = w[p]
        w0, w1, w2, u0, u1, u2 = b[VEL], b[VEL + 1], b[VEL + 2], b[VEL + 3], b[VEL + 4], b[VEL + 5]
    g0, g1, g2, j0, j1, j2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(i, last + 1):
        if k > i and ints[k, at.TURNED]:
            _set_rotation(w, last, product(nine(a, ROT), nine(numbers[k], at.R_PF)))
        axis, rate, own = ints[k, at.AXIS], y[nq + ints[k, at.V]], w[k]
        e0, e1, e2 = a[ROT + axis], a[ROT + 3 + axis], a[ROT + 6 + axis]
        t0, t1, t2 = cross(p0, p1, p2, e0, e1, e2)
        own[SUB], own[SUB + 1], own[SUB + 2] = e0, e1, e2
        own[SUB + 3], own[SUB + 4], own[SUB + 5] = t0, t1, t2
        e0, e1, e2 = e0 * rate, e1 * rate, e2 * rate
        x0, x1, x2 = cross(w0 + j0, w1 + j1, w2 + j2, e0, e1, e2)
        g0, g1, g2, j0, j1, j2 = g0 + x0, g1 + x1, g2 + x2, j0 + e0, j1 + e1, j2 + e2
        _turn_about(a, axis, y[ints[k, at.Q]])
    t0, t1, t2 = cross(p0, p1, p2, j0, j1, j2)
    a[VEL], a[VEL + 1], a[VEL + 2] = w0 + j0, w1 + j1, w2 + j2
    a[VEL + 3], a[VEL + 4], a[VEL + 5] = u0 + t0, u1 + t1, u2 + t2
    t0, t1, t2 = cross(w0, w1, w2, p0, p1, p2)
    x0, x1, x2 = cross(u0 + t0, u1 + t1, u2 + t2, j0, j1, j2)
    z0, z1, z2 = cross(p0, p1, p2, g0, g1, g2)
    a[BIAS], a[BIAS + 1], a[BIAS + 2] = g0, g1, g2
    a[BIAS + 3], a[BIAS + 4], a[BIAS + 5] = x0 + z0, x1 + z1, x2 + z2


@compilable
def _set_axis(w: Any, i: int, kind: int, axis: int, pitch: float, r: Any, place: Any) -> None:
    """The motion subspace of a node of one degree of freedom, but not of a revolute one."""
    a = w[i]
    s0, s1, s2 = r[axis], r[3 + axis], r[6 + axis]
    if kind == at.PRISMATIC:
        a[SUB], a[SUB + 1], a[SUB + 2] = 0.0, 0.0, 0.0
        a[SUB + 3], a[SUB + 4], a[SUB + 5] = s0, s1, s2
        return
    t0, t1, t2 = cross(place[0], place[1], place[2], s0, s1, s2)
    a[SUB], a[SUB + 1], a[SUB + 2] = s0, s1, s2
    a[SUB + 3], a[SUB + 4], a[SUB + 5] = t0, t1, t2
    if kind == at.SCREW:
        a[SUB + 3] += pitch * s0
        a[SUB + 4] += pitch * s1
        a[SUB + 5] += pitch * s2


@compilable
def _set_pose(
    w: Any, i: int, kind: int, axis: int, pitch: float, r: Any, place: Any, y: Any, q: int
) -> None:
    """The pose of a node of one degree of freedom, from that of its frame F; not a revolute one."""
    a = w[i]
    for k in range(3):
        a[POS + k] = place[k]
    if kind == at.SCREW:
        _set_rotation(w, i, r)
        _turn_about(a, axis, y[q])
        for k in range(3):
            a[POS + k] += pitch * y[q] * r[3 * k + axis]
    elif kind == at.QUATERNION:
        _set_rotation(w, i, product(r, from_quaternion(y[q], y[q + 1], y[q + 2], y[q + 3])))
    elif kind == at.RPY:
        _set_rotation(w, i, product(r, from_rpy(y[q], y[q + 1], y[q + 2])))
    else:
        _set_rotation(w, i, r)
        if kind == at.PRISMATIC:
            for k in range(3):
                a[POS + k] += y[q] * r[3 * k + axis]


@compilable
def _set_velocity(w: Any, i: int, p: int, carrier: int, rate: Any) -> None:
    """Velocity of node i, and the bias of its acceleration: its axis moves with the carrier."""
    a = w[i]
    for k in range(6):
        a[VEL + k] = a[SUB + k] * rate
    if p >= 0:
        for k in range(6):
            a[VEL + k] += w[p, VEL + k]
    if carrier < 0:
        for k in range(6):
            a[BIAS + k] = 0.0
        return
    b = w[carrier]
    w0, w1, w2, u0, u1, u2 = b[VEL], b[VEL + 1], b[VEL + 2], b[VEL + 3], b[VEL + 4], b[VEL + 5]
    s0, s1, s2, t0, t1, t2 = a[SUB], a[SUB + 1], a[SUB + 2], a[SUB + 3], a[SUB + 4], a[SUB + 5]
    x0, x1, x2 = cross(w0, w1, w2, s0, s1, s2)
    z0, z1, z2 = cross(w0, w1, w2, t0, t1, t2)
    g0, g1, g2 = cross(u0, u1, u2, s0, s1, s2)
    a[BIAS], a[BIAS + 1], a[BIAS + 2] = x0 * rate, x1 * rate, x2 * rate
    a[BIAS + 3], a[BIAS + 4] = (z0 + g0) * rate, (z1 + g1) * rate
    a[BIAS + 5] = (z2 + g2) * rate


@compilable
def _set_inertia(w: Any, i: int, n: Any, gravity: Any) -> None:
    """Inertia about the fixed point; what velocity and gravity ask of the node."""
    a = w[i]
    m = n[at.MASS]
    for k in range(6):
        a[OWN + k] = 0.0
    if m == 0.0:  # a massless link, or one of several axes of a joint
        for k in range(27):
            a[ART + k] = 0.0
        return
    r0, r1, r2, r3, r4, r5, r6, r7, r8 = a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8]
    p0, p1, p2 = a[POS], a[POS + 1], a[POS + 2]
    c0, c1, c2 = n[at.COM], n[at.COM + 1], n[at.COM + 2]
    d0 = m * (r0 * c0 + r1 * c1 + r2 * c2)
    d1 = m * (r3 * c0 + r4 * c1 + r5 * c2)
    d2 = m * (r6 * c0 + r7 * c1 + r8 * c2)
    k = at.MOMENTS
    jxx, jyy, jzz, jxy, jxz, jyz = n[k], n[k + 1], n[k + 2], n[k + 3], n[k + 4], n[k + 5]
    # R J, then (R J) R^T
    a0, a1, a2 = r0 * jxx + r1 * jxy + r2 * jxz, r0 * jxy + r1 * jyy + r2 * jyz, 0.0
    a2 = r0 * jxz + r1 * jyz + r2 * jzz
    b0, b1 = r3 * jxx + r4 * jxy + r5 * jxz, r3 * jxy + r4 * jyy + r5 * jyz
    b2 = r3 * jxz + r4 * jyz + r5 * jzz
    e0, e1 = r6 * jxx + r7 * jxy + r8 * jxz, r6 * jxy + r7 * jyy + r8 * jyz
    e2 = r6 * jxz + r7 * jyz + r8 * jzz
    square = m * (p0 * p0 + p1 * p1 + p2 * p2) + 2.0 * (p0 * d0 + p1 * d1 + p2 * d2)
    xx = a0 * r0 + a1 * r1 + a2 * r2 + square - m * p0 * p0 - 2.0 * p0 * d0
    xy = a0 * r3 + a1 * r4 + a2 * r5 - m * p0 * p1 - p0 * d1 - p1 * d0
    xz = a0 * r6 + a1 * r7 + a2 * r8 - m * p0 * p2 - p0 * d2 - p2 * d0
    yy = b0 * r3 + b1 * r4 + b2 * r5 + square - m * p1 * p1 - 2.0 * p1 * d1
    yz = b0 * r6 + b1 * r7 + b2 * r8 - m * p1 * p2 - p1 * d2 - p2 * d1
    zz = e0 * r6 + e1 * r7 + e2 * r8 + square - m * p2 * p2 - 2.0 * p2 * d2
    h0, h1, h2 = m * p0 + d0, m * p1 + d1, m * p2 + d2
    k = ART
    a[k], a[k + 1], a[k + 2], a[k + 3], a[k + 4], a[k + 5] = xx, xy, xz, yy, yz, zz
    a[k + 6], a[k + 7], a[k + 8] = 0.0, -h2, h1
    a[k + 9], a[k + 10], a[k + 11] = h2, 0.0, -h0
    a[k + 12], a[k + 13], a[k + 14] = -h1, h0, 0.0
    a[k + 15], a[k + 16], a[k + 17], a[k + 18], a[k + 19], a[k + 20] = m, 0.0, 0.0, m, 0.0, m
    w0, w1, w2 = a[VEL], a[VEL + 1], a[VEL + 2]
    u0, u1, u2 = a[VEL + 3], a[VEL + 4], a[VEL + 5]
    x0, x1, x2 = cross(h0, h1, h2, u0, u1, u2)
    l0 = xx * w0 + xy * w1 + xz * w2 + x0
    l1 = xy * w0 + yy * w1 + yz * w2 + x1
    l2 = xz * w0 + yz * w1 + zz * w2 + x2
    x0, x1, x2 = cross(w0, w1, w2, h0, h1, h2)
    m0, m1, m2 = m * u0 + x0, m * u1 + x1, m * u2 + x2
    x0, x1, x2 = cross(w0, w1, w2, l0, l1, l2)
    z0, z1, z2 = cross(u0, u1, u2, m0, m1, m2)
    f0, f1, f2 = cross(w0, w1, w2, m0, m1, m2)
    k = at.WEIGHT
    heavy, c0, c1, c2 = n[k], n[k + 1], n[k + 2], n[k + 3]
    h0 = heavy * p0 + r0 * c0 + r1 * c1 + r2 * c2
    h1 = heavy * p1 + r3 * c0 + r4 * c1 + r5 * c2
    h2 = heavy * p2 + r6 * c0 + r7 * c1 + r8 * c2
    g0, g1, g2 = cross(h0, h1, h2, gravity[0], gravity[1], gravity[2])
    a[FORCE], a[FORCE + 1], a[FORCE + 2] = x0 + z0 - g0, x1 + z1 - g1, x2 + z2 - g2
    a[FORCE + 3] = f0 - heavy * gravity[0]
    a[FORCE + 4] = f1 - heavy * gravity[1]
    a[FORCE + 5] = f2 - heavy * gravity[2]


@compilable
def move_nodes(ints: Any, numbers: Any, gravity: Any, y: Any, nq: int, origin: Any, w: Any) -> None:
    """Writes pose, axis, velocity, bias and own inertia of all nodes into w.

    Args:
        ints, numbers: tables of the nodes.  gravity: (3,) m/s^2.
        y: state [q; v, ...].  nq: length of q.
        origin: (3,) the fixed point of all spatial vectors (m).

    """
    for i in range(len(ints)):
        count = int(numbers[i, at.RUN])
        if count == 0:
            continue
        p, kind, q, v = ints[i, at.PARENT], ints[i, at.KIND], ints[i, at.Q], ints[i, at.V]
        r, place = _frame(w, i, p, ints[i, at.TURNED], numbers, origin)
        if kind == at.REVOLUTE:
            _set_run(ints, numbers, w, i, count, r, place, y, nq)
        elif kind >= at.FREE_QUATERNION:
            _set_free(w, i, kind, r, place, y, q, nq + v)
        elif kind == at.WELD:
            _set_rotation(w, i, r)
            for k in range(3):
                w[i, POS + k] = place[k]
            for k in range(6):
                w[i, VEL + k] = w[p, VEL + k] if p >= 0 else 0.0
        else:
            axis, pitch = ints[i, at.AXIS], numbers[i, at.PITCH]
            _set_axis(w, i, kind, axis, pitch, r, place)
            _set_pose(w, i, kind, axis, pitch, r, place, y, q)
            _set_velocity(w, i, p, ints[i, at.CARRIER], y[nq + v])
        last = i + count - 1
        _set_inertia(w, last, numbers[last], gravity)


@compilable
def move_leaves(
    ints: Any, numbers: Any, gravity: Any, y: Any, nq: int, origin: Any, w: Any, leaves: Any
) -> None:
    """Writes place, axis, velocity and weight of all point masses into `leaves`; see move_nodes."""
    for i in range(len(ints)):
        p, n, a = ints[i, at.PARENT], numbers[i], leaves[i]
        q, rate = y[ints[i, at.LEAF_Q]], y[nq + ints[i, at.LEAF_V]]
        e0, e1, e2 = n[at.LEAF_AXIS], n[at.LEAF_AXIS + 1], n[at.LEAF_AXIS + 2]
        x0, x1, x2 = n[0] + q * e0, n[1] + q * e1, n[2] + q * e2
        if p < 0:
            a[0], a[1], a[2] = x0 - origin[0], x1 - origin[1], x2 - origin[2]
            a[3], a[4], a[5] = e0, e1, e2
            a[6], a[7], a[8] = rate * e0, rate * e1, rate * e2
        else:
            b = w[p]
            for k in range(3):
                r0, r1, r2 = b[3 * k], b[3 * k + 1], b[3 * k + 2]
                a[k] = b[POS + k] + r0 * x0 + r1 * x1 + r2 * x2
                a[3 + k] = r0 * e0 + r1 * e1 + r2 * e2
            d0, d1, d2 = cross(b[VEL], b[VEL + 1], b[VEL + 2], a[0], a[1], a[2])
            a[6] = b[VEL + 3] + d0 + rate * a[3]
            a[7] = b[VEL + 4] + d1 + rate * a[4]
            a[8] = b[VEL + 5] + d2 + rate * a[5]
        a[at.RATE] = rate
        heavy = n[at.LEAF_WEIGHT]
        for k in range(3):
            a[at.PUSH + k] = heavy * gravity[k]
