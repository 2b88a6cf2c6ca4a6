"""Has the contact law of a ball with radius and spin, which meets the strings anywhere.

With Q the ball's centre, G the bed's centre, B the head's axes (z normal to the strings),
p = p_GQ_B, v = the velocity of Q relative to the head's point there, omega = the ball's angular
velocity relative to the head, z_i the deflections of the string masses and w_i weights over the
nearest of them:

    compression     x = sum w_i z_i + R - p_z                                        [m]
    normal force    N = (kb + hb x) x + (cb + db x) x'   on the ball, along +z       [N]
    contact point   C = Q - r e_z,   r = R - chi max(x, 0)                           [m]
    velocity at C   v_c = v_t + omega x (-r e_z), its part in the plane              [m/s]
    element         T = kt u + ct v_c
      it grips      while |T| <= mu N:   F = -T,             u' = v_c
      it slides     else:                F = -mu N T / |T|,  u' = (-F - kt u) / ct

u (m, two components, a continuous state) is how far ball and strings are sheared; it is 0 at
touch. F and u' are continuous where gripping turns into sliding, so nothing is smoothed and nothing
creeps. (N e_z + F) acts on the ball at C; -w_i of it on string mass i at C, and the rim's share on
the head at C: action and reaction have one line, so energy and momentum close. Stored: kb x^2 / 2 +
hb x^3 / 3 + kt u^2 / 2; lost: (cb + db x) x'^2 + ct u'^2 in the ball, -F . (v_c - u') to friction.

The weights are bilinear between the grid's lines, and fall from the outermost line to 0 at the rim.
They are frozen at touch: weights that move with the ball would need a force along the bed's slope.
At a point of the grid, with R = 0 and without friction, this is the law of `contact`. With R = chi
= 0 and one mass that is met alone it is the paper's ball, a point without spin, with this friction
in place of the paper's two readings.

kb, cb, hb, db, touch, release and leaving are as in `contact` and `phases`. The record of a contact
is that of `phases` with the numbers below behind it; its OFFSET_X and OFFSET_Y are the place of the
touch.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.laws import contact
from drake_racket.laws.compilation import compilable, compiled, sources_stamp, stamped
from drake_racket.laws.contact import (
    CONTACT,
    FREE,
    PASSED,
    ball_constants,
    normal_force,
    stored_energy,
)
from drake_racket.laws.phases import (
    AT_BALL,
    BY_DISPLACEMENT,
    CB,
    DB,
    GIVEN_UP,
    HB,
    KB,
    MU,
    OFFSET_X,
    OFFSET_Y,
    PHASE,
    POINT,
    RELEASE,
    SIZE,
    SPEED,
    TOUCH,
    TOUCHES,
)
from drake_racket.laws.places import met_weights

CONTACTS = ("paper", "surface")
"""Laws of the contact: a point without spin on one string mass (the default), and this one."""

GRIPS, SLID, SINCE, WEIGHT_0, POINT_0, RADIUS, FLATTENING, KT, CT = (
    17,
    18,
    19,
    20,
    24,
    28,
    29,
    30,
    31,
)
"""Gripping (1) or sliding (0); time spent sliding, and since when it is so (s); four weights, and
the points (from 1) that they are of; R (m), chi, kt (N/m), ct (N s/m) as latched."""
SURFACE_SIZE = 32
assert GRIPS == SIZE

NEARLY = 1e-9
"""Share within which |T| and mu N count as equal, where no event tells them apart."""


@dataclass(frozen=True)
class SurfaceModel:
    """Holds the numbers of a contact of this law, for its system.

    Attributes:
        ball: as of `ContactModel`.
        friction: mu at the n points.
        surface: R (m), chi (1), kt (N/m), ct (N s/m); alone: 0, or which mass is met by itself
            (`places.met_weights`).
        grid: (n, 2) x, y (m) of the points in the head, about the centre.
        rim: semi-axes along x, y (m); a ball outside passes by.

    """

    ball: tuple[float, ...]
    friction: tuple[float, ...]
    surface: tuple[float, float, float, float, float]
    grid: NDArray[np.float64]
    rim: tuple[float, float]


@compilable
def surface_law(p: Any, v: Any, turn: Any, z: Any, rate: Any, u0: Any, u1: Any, record: Any) -> Any:
    """Gives the forces of a contact; equations in the module's docstring.

    N and F are not cut off at N = 0: the last step looks past the release, and stays smooth.

    Args:
        p, v, turn: p_GQ_B (m), v (m/s) and omega (rad/s), three components each.
        z, rate: sum w_i z_i (m) and its rate (m/s).
        u0, u1: the element (m).
        record: what is latched.

    Returns:
        F_x, F_y, N (N); u' (two, m/s); v_c (two, m/s); r (m); x, x'; and what is positive while
        the element goes on as it does (N): mu N - |T| of one that grips, |T| - mu N of one that
        slides.

    """
    x, x_rate = z + record[RADIUS] - p[2], rate - v[2]
    normal = normal_force(x, x_rate, record[KB], record[CB], record[HB], record[DB])
    r = record[RADIUS] - record[FLATTENING] * x if x > 0.0 else record[RADIUS] + 0.0 * x
    c0, c1 = v[0] - r * turn[1], v[1] + r * turn[0]
    kt, ct = record[KT], record[CT]
    t0, t1 = kt * u0 + ct * c0, kt * u1 + ct * c1
    square = t0 * t0 + t1 * t1
    size = square**0.5 if square > 0.0 else 0.0 * square
    limit = record[MU] * normal
    if record[GRIPS] > 0.5:
        return -t0, -t1, normal, c0, c1, c0, c1, r, x, x_rate, limit - size
    share = -limit / size if size > 0.0 else 0.0 * size
    f0, f1 = share * t0, share * t1
    goes_on = size - limit if record[MU] > 0.0 else 1.0 + 0.0 * size
    return f0, f1, normal, (-f0 - kt * u0) / ct, (-f1 - kt * u1) / ct, c0, c1, r, x, x_rate, goes_on


@compilable
def surface_losses(found: Any, record: Any) -> Any:
    """Gives the power (W) lost in the ball and to friction, from what `surface_law` returns."""
    f0, f1, _, s0, s1, c0, c1, _, x, x_rate, _ = found
    damping = record[CB] + record[DB] * x
    in_ball = damping * x_rate * x_rate + record[CT] * (s0 * s0 + s1 * s1)
    return in_ball, -(f0 * (c0 - s0) + f1 * (c1 - s1))


@compilable
def surface_touch(
    record: Any,
    place: Any,
    v: Any,
    turn: Any,
    x_rate: Any,
    time: Any,
    ball: Any,
    friction: Any,
    surface: Any,
    grid: Any,
    rim: Any,
) -> None:
    """Records a touch: weights, mu, and whether it grips at once; kb and cb at the first one.

    Args:
        record: of SURFACE_SIZE numbers.
        place: p_GQ_B (m).  v, turn: as of `surface_law`.  x_rate: rate of compression (m/s).
        time: s.
        ball, friction, surface, grid, rim: as of `SurfaceModel`.

    """
    points, weights, shares = met_weights(grid, rim, place[0], place[1], surface[4])
    if record[TOUCHES] < 0.5:
        record[SPEED], record[TOUCH] = x_rate, time
        record[KB] = ball_constants(x_rate, ball[0], ball[1], ball[2], ball[3])
        record[CB] = ball_constants(x_rate, ball[0], ball[1], ball[4], ball[5])
        record[HB], record[DB] = ball[6], ball[7]
    mu, nearest = 0.0 * place[0], 0
    for i in range(4):
        record[WEIGHT_0 + i], record[POINT_0 + i] = weights[i], float(points[i] + 1)
        mu = mu + shares[i] * friction[points[i]]
        if shares[i] > shares[nearest]:
            nearest = i
    record[PHASE], record[POINT], record[MU] = CONTACT, record[POINT_0 + nearest], mu
    record[OFFSET_X], record[OFFSET_Y] = place[0], place[1]
    # friction follows the element, which is not stiff; the reaction has the action's line
    record[BY_DISPLACEMENT], record[AT_BALL] = 1.0, 1.0
    for i in range(4):
        record[RADIUS + i] = surface[i]
    record[TOUCHES] += 1.0
    record[SINCE] = time
    c0, c1 = v[0] - surface[0] * turn[1], v[1] + surface[0] * turn[0]
    size = surface[3] * (c0 * c0 + c1 * c1) ** 0.5 if c0 != 0.0 or c1 != 0.0 else 0.0 * c0
    limit = mu * record[CB] * x_rate + NEARLY * surface[3] * x_rate
    record[GRIPS] = 1.0 if mu > 0.0 and size <= limit else 0.0


@compilable
def surface_switch(record: Any, time: Any) -> None:
    """Records that a gripping element slides from now on, or a sliding one grips."""
    if record[GRIPS] > 0.5:
        record[GRIPS] = 0.0
    else:
        record[SLID] += time - record[SINCE]
        record[GRIPS] = 1.0
    record[SINCE] = time


@compilable
def surface_release(record: Any, x: Any, u0: Any, u1: Any, time: Any) -> None:
    """Records the end of the force: what compression and shear are left is given up."""
    if record[GRIPS] < 0.5:
        record[SLID] += time - record[SINCE]
    record[PHASE] = PASSED if x > 0.0 else FREE
    record[RELEASE] = time
    record[GIVEN_UP] += stored_energy(x, record[KB], record[HB])
    record[GIVEN_UP] += 0.5 * record[KT] * (u0 * u0 + u1 * u1)


@compilable
def surface_motion(x_h: Any, x_q: Any, v_h: Any, v_q: Any, r_hb: Any, p_hg: Any) -> Any:
    """Gives p, v and omega of `surface_law` from the motions of head and ball.

    Args:
        x_h, x_q: (3, 4) poses of head and ball in the world.  v_h, v_q: (6,) their velocities.
        r_hb, p_hg: (3, 3) axes and (3,) place of the bed's centre in the head's body.

    Returns:
        p, v, omega, and the rotation R_WB by rows (9).

    """
    d = (
        x_q[0, 3] - x_h[0, 3],
        x_q[1, 3] - x_h[1, 3],
        x_q[2, 3] - x_h[2, 3],
    )
    u = (
        v_q[3] - v_h[3] - (v_h[1] * d[2] - v_h[2] * d[1]),
        v_q[4] - v_h[4] - (v_h[2] * d[0] - v_h[0] * d[2]),
        v_q[5] - v_h[5] - (v_h[0] * d[1] - v_h[1] * d[0]),
    )
    w = v_q[0] - v_h[0], v_q[1] - v_h[1], v_q[2] - v_h[2]
    h, e, o = _into(x_h, d), _into(x_h, u), _into(x_h, w)
    h = h[0] - p_hg[0], h[1] - p_hg[1], h[2] - p_hg[2]
    r = (
        _entry(x_h, r_hb, 0, 0),
        _entry(x_h, r_hb, 0, 1),
        _entry(x_h, r_hb, 0, 2),
        _entry(x_h, r_hb, 1, 0),
        _entry(x_h, r_hb, 1, 1),
        _entry(x_h, r_hb, 1, 2),
        _entry(x_h, r_hb, 2, 0),
        _entry(x_h, r_hb, 2, 1),
        _entry(x_h, r_hb, 2, 2),
    )
    return _into(r_hb, h), _into(r_hb, e), _into(r_hb, o), r


@compilable
def _into(r: Any, a: Any) -> Any:
    """R^T a."""
    return (
        r[0, 0] * a[0] + r[1, 0] * a[1] + r[2, 0] * a[2],
        r[0, 1] * a[0] + r[1, 1] * a[1] + r[2, 1] * a[2],
        r[0, 2] * a[0] + r[1, 2] * a[1] + r[2, 2] * a[2],
    )


@compilable
def _entry(a: Any, b: Any, i: int, j: int) -> Any:
    """One number of the product of two matrices."""
    return a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


def surface_forces(
    x_h: Any,
    x_q: Any,
    v_h: Any,
    v_q: Any,
    r_hb: Any,
    p_hg: Any,
    grid: Any,
    heights: Any,
    rates: Any,
    u: Any,
    record: Any,
) -> Any:
    """Gives all of a contact from the motions of head, ball and strings.

    Args:
        x_h to p_hg: as of `surface_motion`.  grid: as of `SurfaceModel`.
        heights, rates: (n,) of the string masses (m, m/s).  u: (2,) the element.

    Returns:
        F_C_W (3,) on the ball; p_QC_W (3,); (4, 3) from the four string masses to C in their axes;
        p_HC_H (3,) of the head's body; (11,) of `surface_law`.

    """
    p, v, turn, r = surface_motion(x_h, x_q, v_h, v_q, r_hb, p_hg)
    z = 0.0 * p[0]
    rate = 0.0 * p[0]
    for i in range(4):
        k = round_place(record[POINT_0 + i])
        z = z + record[WEIGHT_0 + i] * heights[k]
        rate = rate + record[WEIGHT_0 + i] * rates[k]
    found = surface_law(p, v, turn, z, rate, u[0], u[1], record)
    fx, fy, fz, arm = found[0], found[1], found[2], found[7]
    force = np.array(
        (
            r[0] * fx + r[1] * fy + r[2] * fz,
            r[3] * fx + r[4] * fy + r[5] * fz,
            r[6] * fx + r[7] * fy + r[8] * fz,
        )
    )
    down = np.array((-arm * r[2], -arm * r[5], -arm * r[8]))
    k0, k1 = round_place(record[POINT_0]), round_place(record[POINT_0 + 1])
    k2, k3 = round_place(record[POINT_0 + 2]), round_place(record[POINT_0 + 3])
    c = p[2] - arm
    arms = np.array(
        (
            (p[0] - grid[k0, 0], p[1] - grid[k0, 1], c - heights[k0]),
            (p[0] - grid[k1, 0], p[1] - grid[k1, 1], c - heights[k1]),
            (p[0] - grid[k2, 0], p[1] - grid[k2, 1], c - heights[k2]),
            (p[0] - grid[k3, 0], p[1] - grid[k3, 1], c - heights[k3]),
        )
    )
    on_head = np.array(
        (
            p_hg[0] + r_hb[0, 0] * p[0] + r_hb[0, 1] * p[1] + r_hb[0, 2] * c,
            p_hg[1] + r_hb[1, 0] * p[0] + r_hb[1, 1] * p[1] + r_hb[1, 2] * c,
            p_hg[2] + r_hb[2, 0] * p[0] + r_hb[2, 1] * p[1] + r_hb[2, 2] * c,
        )
    )
    return force, down, arms, on_head, np.array(found)


@compilable
def round_place(number: Any) -> int:
    """Gives the place (from 0) of a point whose number (from 1) a record holds as a float."""
    return int(number + 0.5) - 1


COMPILED_SURFACE = stamped(surface_forces, sources_stamp(contact))
COMPILED_SURFACE_MOTION = compiled(surface_motion)
