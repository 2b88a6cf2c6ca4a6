"""Has the equations of motion of a ball on a head-clamped bed, and their derivatives.

The laws of the Drake systems (`strings.spring_law`, `contact.contact_law`) in an ODE of 2 n + 6
states y: heights z (0 to n - 1) and rates (n to 2 n - 1) of the n string masses, position (the next
three) and velocity (the last three) of the ball, all in the head:

    m_s z_i'' = -sum of +-(T dL/ddz) over the springs at mass i, - raw if the ball is on it
    m_b p''   = F, the contact force; raw is its part along z, N

T dL/ddz is what `spring_law` gives as tension and slope; dz is the height of a spring's first mass
over its second, or over the rim: `ends` (2, m) says which they are.

Sensitivities s = dy/dtheta (2 n + 6, free) follow s' = (df/dy) s + df/dtheta.
"""

from __future__ import annotations

from typing import Any

from drake_racket.laws.compilation import compilable
from drake_racket.laws.contact import contact_law, contact_partials, normal_slopes
from drake_racket.laws.strings import spring_law, spring_partials


@compilable
def masses(y: Any) -> int:
    """Gives the number n of string masses: y has n heights, n rates and six numbers of the ball."""
    return len(y) // 2 - 3


@compilable
def relative(y: Any, p: int) -> Any:
    """Gives p_SQ and v_SQ in the head, S being the string mass p (0-based)."""
    n = masses(y)
    b = 2 * n
    return (y[b], y[b + 1], y[b + 2] - y[p]), (y[b + 3], y[b + 4], y[b + 5] - y[n + p])


@compilable
def heights(y: Any, ends: Any, g: Any) -> None:
    """Writes height dz and rate of the springs into the rows 0 and 1 of g (7, m)."""
    n = masses(y)
    for r in range(ends.shape[1]):
        i, j = ends[0, r], ends[1, r]
        dz, rate = y[i], y[n + i]
        if j >= 0:
            dz -= y[j]
            rate -= y[n + j]
        g[0, r], g[1, r] = dz, rate


@compilable
def rates(
    y: Any, touching: bool, p: int, ends: Any, bed: Any, ball: Any, mass: Any, g: Any, f: Any
) -> None:
    """Writes rates y' into f. `mass`: of ball and string mass; `ball`: contact_law's constants."""
    heights(y, ends, g)
    n, m = masses(y), ends.shape[1]
    b = 2 * n
    per_mass = 1.0 / mass[1]
    for r in range(m):  # no scatter here: this loop becomes vector instructions
        slope, tension = spring_law(g[0, r], g[1, r], bed[0, r], bed[1, r], bed[2, r], bed[3, r])
        g[2, r] = tension * slope * per_mass
    for i in range(n):
        f[i] = y[n + i]
        f[n + i] = 0.0
    for r in range(m):
        f[n + ends[0, r]] -= g[2, r]
        if ends[1, r] >= 0:
            f[n + ends[1, r]] += g[2, r]
    for i in range(3):
        f[b + i] = y[b + 3 + i]
        f[b + 3 + i] = 0.0
    if touching:
        at, moving = relative(y, p)
        # raw, not N: the stages of the step that ends at the release may look past it
        fx, fy, _, raw = contact_law(at, moving, ball)
        f[b + 3], f[b + 4], f[b + 5] = fx / mass[0], fy / mass[0], raw / mass[0]
        f[n + p] -= raw * per_mass


@compilable
def force_by_theta(y: Any, s: Any, a: int, p: int, ball: Any, by_ball: Any) -> Any:
    """Gives dN/dtheta_a; `by_ball` as of `tangent_rates`."""
    n = masses(y)
    at, moving = relative(y, p)
    kx, cx = normal_slopes(-at[2], -moving[2], ball[0], ball[1], ball[7], ball[8])
    return (
        -kx * (s[2 * n + 2, a] - s[p, a])
        - cx * (s[2 * n + 5, a] - s[n + p, a])
        - at[2] * by_ball[0, a]
        - moving[2] * by_ball[1, a]
    )


@compilable
def tangent_rates(
    y: Any,
    s: Any,
    touching: bool,
    p: int,
    ends: Any,
    bed: Any,
    ball: Any,
    mass: Any,
    by_bed: Any,
    by_ball: Any,
    g: Any,
    f: Any,
) -> None:
    """Writes rates s' into f, as s.

    Args:
        by_bed: (4, m, free) d constants/dtheta.
        by_ball: (5, free) of kb, cb, mu and the tangential offset x, y.

    """
    n, count = masses(y), s.shape[1]
    b = 2 * n
    for i in range(n):
        for a in range(count):
            f[i, a] = s[n + i, a]
            f[n + i, a] = 0.0
    heights(y, ends, g)
    per_mass = 1.0 / mass[1]
    for r in range(ends.shape[1]):
        _, by_dz, by_rate, by_k, by_slack, by_length2, by_c = spring_partials(
            g[0, r], g[1, r], bed[0, r], bed[1, r], bed[2, r], bed[3, r]
        )
        g[2, r], g[3, r], g[4, r] = by_k, by_slack, by_length2
        g[0, r], g[1, r], g[5, r] = by_dz, by_rate, by_c
    for r in range(ends.shape[1]):
        i, j = ends[0, r], ends[1, r]
        for a in range(count):
            d_dz, d_rate = s[i, a], s[n + i, a]
            if j >= 0:
                d_dz -= s[j, a]
                d_rate -= s[n + j, a]
            pull = per_mass * (
                g[0, r] * d_dz
                + g[1, r] * d_rate
                + g[2, r] * by_bed[0, r, a]
                + g[3, r] * by_bed[1, r, a]
                + g[4, r] * by_bed[2, r, a]
                + g[5, r] * by_bed[3, r, a]
            )
            f[n + i, a] -= pull
            if j >= 0:
                f[n + j, a] += pull
    for a in range(count):
        for i in range(3):
            f[b + i, a] = s[b + 3 + i, a]
            f[b + 3 + i, a] = 0.0
    if not touching:
        return
    at, moving = relative(y, p)
    _, _, normal, ux, uy, ex, ey, share = contact_partials(at, moving, ball)
    for a in range(count):
        dn = force_by_theta(y, s, a, p, ball, by_ball)
        dtx, dty = s[b + 3, a], s[b + 4, a]
        if ball[6] > 0.5:
            dtx, dty = s[b, a] - by_ball[3, a], s[b + 1, a] - by_ball[4, a]
        along = ex * dtx + ey * dty
        d_mu = normal * by_ball[2, a]
        f[b + 3, a] = (ux * dn - ex * d_mu - share * (dtx - ex * along)) / mass[0]
        f[b + 4, a] = (uy * dn - ey * d_mu - share * (dty - ey * along)) / mass[0]
        f[b + 5, a] = dn / mass[0]
        f[n + p, a] -= dn * per_mass
