"""Computes the forces on a model's nodes and point masses: bushings, strings, limits, contacts.

The laws are the package's own (`laws/`), compiled here from the same source; only Drake's bushing
is written again, after the documentation of `LinearBushingRollPitchYaw`.
"""

from __future__ import annotations

import math
from typing import Any

from drake_racket.engines.compiled.dynamics import layout as at
from drake_racket.engines.compiled.dynamics.layout import FORCE, ROT, VEL
from drake_racket.engines.compiled.dynamics.motion import back, cross, nine, placed, product, turn
from drake_racket.laws.compilation import compilable
from drake_racket.laws.contact import contact_law
from drake_racket.laws.limits import limit_torques
from drake_racket.laws.phases import AT_BALL, CONSTANTS, POINT
from drake_racket.laws.strings import spring_law


@compilable
def add_force(w: Any, i: int, m0: Any, m1: Any, m2: Any, f0: Any, f1: Any, f2: Any) -> None:
    """Lets a force f and its moment m about the fixed point act on node i; the world is -1."""
    if i < 0:
        return
    a, k = w[i], FORCE
    a[k] -= m0
    a[k + 1] -= m1
    a[k + 2] -= m2
    a[k + 3] -= f0
    a[k + 4] -= f1
    a[k + 5] -= f2


@compilable
def joint_forces(ints: Any, numbers: Any, y: Any, nq: int, torques: Any, tau: Any) -> None:
    """Writes the forces on all joints of nodes: constant torques, springs and dampers."""
    for k in range(len(tau)):
        tau[k] = torques[k]
    for i in range(len(ints)):
        kind, v = ints[i, at.KIND], ints[i, at.V]
        if kind == at.WELD:
            continue
        count = 6 if kind >= at.FREE_QUATERNION else 1
        for k in range(count):
            tau[v + k] -= numbers[i, at.DAMPING + k] * y[nq + v + k]
        if numbers[i, at.SPRING] != 0.0:
            tau[v] -= numbers[i, at.SPRING] * (y[ints[i, at.Q]] - numbers[i, at.NOMINAL])


@compilable
def limit_forces(ints: Any, numbers: Any, y: Any, nq: int, tau: Any) -> None:
    """Adds the torques at the ends of joints' ranges; law: `laws.limits`."""
    for i in range(len(ints)):
        n, v = numbers[i], ints[i, 1]
        q, rate = y[ints[i, 0]], y[nq + v]
        if n[0] < q < n[1]:
            continue
        tau[v] += limit_torques(q, rate, n[0], n[1], n[2], n[3])


@compilable
def string_forces(
    ints: Any, numbers: Any, ends: Any, springs: Any, y: Any, nq: int, tau: Any
) -> float:
    """Adds the strings' forces on the point masses; law: `laws.strings`.

    Returns:
        what is lost in the springs (W), the sum of c (dL/dt)^2.

    """
    lost = 0.0
    for i in range(len(ints)):
        tau[ints[i, at.LEAF_V]] -= numbers[i, at.LEAF_DAMPING] * y[nq + ints[i, at.LEAF_V]]
    for s in range(ends.shape[1]):
        i, j = ends[0, s], ends[1, s]
        dz, rate = y[ints[i, at.LEAF_Q]], y[nq + ints[i, at.LEAF_V]]
        if j >= 0:
            dz -= y[ints[j, at.LEAF_Q]]
            rate -= y[nq + ints[j, at.LEAF_V]]
        slope, tension = spring_law(
            dz, rate, springs[0, s], springs[1, s], springs[2, s], springs[3, s]
        )
        pull = tension * slope
        tau[ints[i, at.LEAF_V]] -= pull
        if j >= 0:
            tau[ints[j, at.LEAF_V]] += pull
        stretching = slope * rate
        lost += springs[3, s] * stretching * stretching
    return lost


@compilable
def frame_end(w: Any, i: int, n: Any, rotation: int, place: int, origin: Any) -> Any:
    """Rotation (9), place (3) and velocity (6, about the fixed point) of a bushing's frame."""
    own, p = nine(n, rotation), (n[place], n[place + 1], n[place + 2])
    if i < 0:
        p = (p[0] - origin[0], p[1] - origin[1], p[2] - origin[2])
        return own, p, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    a, k = w[i], VEL
    r = product(nine(a, ROT), own)
    return r, placed(a, p), (a[k], a[k + 1], a[k + 2]), (a[k + 3], a[k + 4], a[k + 5])


@compilable
def _between(a: Any, c: Any) -> Any:
    """R_AC = R_WA^T R_WC."""
    return (
        a[0] * c[0] + a[3] * c[3] + a[6] * c[6],
        a[0] * c[1] + a[3] * c[4] + a[6] * c[7],
        a[0] * c[2] + a[3] * c[5] + a[6] * c[8],
        a[1] * c[0] + a[4] * c[3] + a[7] * c[6],
        a[1] * c[1] + a[4] * c[4] + a[7] * c[7],
        a[1] * c[2] + a[4] * c[5] + a[7] * c[8],
        a[2] * c[0] + a[5] * c[3] + a[8] * c[6],
        a[2] * c[1] + a[5] * c[4] + a[8] * c[7],
        a[2] * c[2] + a[5] * c[5] + a[8] * c[8],
    )


@compilable
def _half(r: Any) -> Any:
    """The rotation by half the angle of r about its axis: q with w >= 0, plus one, made a unit."""
    trace = r[0] + r[4] + r[8]
    # the largest of the quaternion's four numbers first
    if trace >= r[0] and trace >= r[4] and trace >= r[8]:
        w, x, y, z = 1.0 + trace, r[7] - r[5], r[2] - r[6], r[3] - r[1]
    elif r[0] >= r[4] and r[0] >= r[8]:
        w, x, y, z = r[7] - r[5], 1.0 + r[0] - r[4] - r[8], r[1] + r[3], r[2] + r[6]
    elif r[4] >= r[8]:
        w, x, y, z = r[2] - r[6], r[1] + r[3], 1.0 + r[4] - r[0] - r[8], r[5] + r[7]
    else:
        w, x, y, z = r[3] - r[1], r[2] + r[6], r[5] + r[7], 1.0 + r[8] - r[0] - r[4]
    size = math.sqrt(w * w + x * x + y * y + z * z)
    if w < 0.0:
        size = -size
    w, x, y, z = w / size + 1.0, x / size, y / size, z / size
    s = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        1.0 - s * (y * y + z * z),
        s * (x * y - w * z),
        s * (x * z + w * y),
        s * (x * y + w * z),
        1.0 - s * (x * x + z * z),
        s * (y * z - w * x),
        s * (x * z - w * y),
        s * (y * z + w * x),
        1.0 - s * (x * x + y * y),
    )


@compilable
def _bushing_torque(n: Any, r: Any, rate: Any) -> Any:
    """Torque on C in A's axes (3), and its power: roll, pitch and yaw of r = R_AC with w_AC_A."""
    c1 = math.sqrt(r[0] * r[0] + r[3] * r[3])
    pitch = math.atan2(-r[6], c1)
    roll, yaw = math.atan2(r[7], r[8]), math.atan2(r[3], r[0])
    c2, s2, t1 = r[0] / c1, r[3] / c1, -r[6] / c1
    roll_rate = (c2 * rate[0] + s2 * rate[1]) / c1
    pitch_rate = c2 * rate[1] - s2 * rate[0]
    yaw_rate = t1 * (c2 * rate[0] + s2 * rate[1]) + rate[2]
    k, d = at.TORQUE_K, at.TORQUE_D
    m0 = -(n[k] * roll + n[d] * roll_rate)
    m1 = -(n[k + 1] * pitch + n[d + 1] * pitch_rate)
    m2 = -(n[k + 2] * yaw + n[d + 2] * yaw_rate)
    along = m0 / c1 + t1 * m2
    power = m0 * roll_rate + m1 * pitch_rate + m2 * yaw_rate
    return c2 * along - s2 * m1, s2 * along + c2 * m1, m2, power


@compilable
def bushing_force(n: Any, a: int, c: int, w: Any, origin: Any) -> Any:
    """Gives what a bushing does to the node of its frame C; to that of A it does the opposite.

    Returns:
        moment about the fixed point (3) and force (3) in the world; and its power on both (W).

    """
    r_a, p_a, w_a, u_a = frame_end(w, a, n, at.R_NA, at.P_NA, origin)
    r_c, p_c, w_c, u_c = frame_end(w, c, n, at.R_NC, at.P_NC, origin)
    r = _between(r_a, r_c)
    rate = back(r_a, (w_c[0] - w_a[0], w_c[1] - w_a[1], w_c[2] - w_a[2]))
    t0, t1, t2, power = _bushing_torque(n, r, rate)
    m0, m1, m2 = turn(r_a, (t0, t1, t2))
    k, d = at.FORCE_K, at.FORCE_D
    if not (n[k] or n[k + 1] or n[k + 2] or n[d] or n[d + 1] or n[d + 2]):
        return m0, m1, m2, 0.0, 0.0, 0.0, power
    half = _half(r)
    x = back(r_a, (p_c[0] - p_a[0], p_c[1] - p_a[1], p_c[2] - p_a[2]))
    x0, x1, x2 = cross(w_c[0], w_c[1], w_c[2], p_c[0], p_c[1], p_c[2])
    z0, z1, z2 = cross(w_a[0], w_a[1], w_a[2], p_c[0], p_c[1], p_c[2])
    g = (
        u_c[0] + x0 - u_a[0] - z0,
        u_c[1] + x1 - u_a[1] - z1,
        u_c[2] + x2 - u_a[2] - z2,
    )
    v = back(r_a, g)
    x0, x1, x2 = cross(rate[0], rate[1], rate[2], x[0], x[1], x[2])
    v = back(half, (v[0] - 0.5 * x0, v[1] - 0.5 * x1, v[2] - 0.5 * x2))
    x = back(half, x)
    f = (
        -(n[k] * x[0] + n[d] * v[0]),
        -(n[k + 1] * x[1] + n[d + 1] * v[1]),
        -(n[k + 2] * x[2] + n[d + 2] * v[2]),
    )
    power += f[0] * v[0] + f[1] * v[1] + f[2] * v[2]
    f0, f1, f2 = turn(r_a, turn(half, f))
    x0, x1, x2 = cross(
        0.5 * (p_a[0] + p_c[0]), 0.5 * (p_a[1] + p_c[1]), 0.5 * (p_a[2] + p_c[2]), f0, f1, f2
    )
    return m0 + x0, m1 + x1, m2 + x2, f0, f1, f2, power


@compilable
def bushing_forces(ints: Any, numbers: Any, w: Any, origin: Any, grip: int, wrist: int) -> Any:
    """Lets all bushings act; gives the power (W) that goes into those of the grip and the wrist."""
    taken = 0.0
    for i in range(len(ints)):
        a, c = ints[i, 0], ints[i, 1]
        m0, m1, m2, f0, f1, f2, power = bushing_force(numbers[i], a, c, w, origin)
        add_force(w, c, m0, m1, m2, f0, f1, f2)
        add_force(w, a, -m0, -m1, -m2, -f0, -f1, -f2)
        if i in (grip, wrist):
            taken -= power
    return taken


@compilable
def head_axes(n: Any, w: Any, head: int) -> Any:
    """Rotation (9) of the strings' axes in the world."""
    own = nine(n, at.R_HS)
    return own if head < 0 else product(nine(w[head], ROT), own)


@compilable
def ball_motion(n: Any, ball: int, w: Any) -> Any:
    """Place (3) of a ball's centre, and its velocity (3) in the world."""
    a, k = w[ball], at.P_BALL
    p0, p1, p2 = placed(a, (n[k], n[k + 1], n[k + 2]))
    x0, x1, x2 = cross(a[VEL], a[VEL + 1], a[VEL + 2], p0, p1, p2)
    return p0, p1, p2, a[VEL + 3] + x0, a[VEL + 4] + x1, a[VEL + 5] + x2


@compilable
def relative(n: Any, ball: int, head: int, w: Any, leaf: Any) -> Any:
    """Gives p_SQ and v_SQ in the head's axes, ball Q about a point mass S: `relative_motion`."""
    p0, p1, p2, v0, v1, v2 = ball_motion(n, ball, w)
    d0, d1, d2 = p0 - leaf[0], p1 - leaf[1], p2 - leaf[2]
    u0, u1, u2 = v0 - leaf[6], v1 - leaf[7], v2 - leaf[8]
    r = head_axes(n, w, head)
    if head >= 0:
        a = w[head]
        x0, x1, x2 = cross(a[VEL], a[VEL + 1], a[VEL + 2], d0, d1, d2)
        u0, u1, u2 = u0 - x0, u1 - x1, u2 - x2
    return back(r, (d0, d1, d2)), back(r, (u0, u1, u2)), r


@compilable
def contact_force(c: Any, n: Any, head: int, w: Any, leaves: Any, record: Any) -> Any:
    """Lets ball and string mass act on each other; law: `laws.contact`.

    The normal force is kb x + cb x' also where that is negative: the stages of the step that ends
    at the release may look past it.

    Returns:
        p_SQ, v_SQ (3 each); force on the ball in the head's axes (3) and in the world (3);
        rotation (9) of the head's axes.

    """
    leaf = leaves[c[at.LEAF_0] + int(record[POINT]) - 1]
    p, v, r = relative(n, c[at.BALL], head, w, leaf)
    fx, fy, _, raw = contact_law(p, v, record[CONSTANTS])
    f = turn(r, (fx, fy, raw))
    x, y, z = leaf[0], leaf[1], leaf[2]
    d = turn(r, p)
    m0, m1, m2 = cross(x + d[0], y + d[1], z + d[2], f[0], f[1], f[2])
    add_force(w, c[at.BALL], m0, m1, m2, f[0], f[1], f[2])
    for k in range(3):
        leaf[at.PUSH + k] -= f[k]
    if record[AT_BALL] > 0.5:  # at the ball: its moment about the mass goes to the head
        m0, m1, m2 = cross(d[0], d[1], d[2], -f[0], -f[1], -f[2])
        add_force(w, head, m0, m1, m2, 0.0, 0.0, 0.0)
    return p, v, (fx, fy, raw), f, r
