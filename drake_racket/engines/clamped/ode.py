"""A ball on a string-bed whose head is clamped: the equations of motion, and their derivatives.

The laws of the Drake systems (`strings.spring_law`, `contact.contact_law`) in an ODE of 24 states
y: heights z (0-8) and rates (9-17) of the string masses, position (18-20) and velocity (21-23) of
the ball, all in the head:

    m_s z_i'' = -sum of +-(T dL/ddz) over the springs at mass i, - raw if the ball is on it
    m_b p''   = F, the contact force; raw = kb x + cb x' is its part along z

T dL/ddz is what `spring_law` gives as tension and slope; dz is the height of a spring's first mass
over its second, or over the rim.

Sensitivities s = dy/dtheta (24, n) follow s' = (df/dy) s + df/dtheta.
"""

from __future__ import annotations

from typing import Any

from drake_racket.laws.compilation import compilable
from drake_racket.laws.contact import contact_law, contact_partials
from drake_racket.laws.strings import FIRST, SECOND, spring_law, spring_partials


@compilable
def relative(y: Any, p: int) -> Any:
    """p_SQ and v_SQ in the head."""
    return (y[18], y[19], y[20] - y[p]), (y[21], y[22], y[23] - y[9 + p])


@compilable
def heights(y: Any, g: Any) -> None:
    """Height dz and rate of the 24 springs into the rows 0 and 1 of g (7, 24)."""
    for r in range(24):
        i, j = FIRST[r], SECOND[r]
        dz, rate = y[i], y[9 + i]
        if j >= 0:
            dz -= y[j]
            rate -= y[9 + j]
        g[0, r], g[1, r] = dz, rate


@compilable
def rates(y: Any, touching: bool, p: int, bed: Any, ball: Any, mass: Any, g: Any, f: Any) -> None:
    """Rates y' into f. `mass`: of the ball, of a string mass; `ball`: contact_law's constants."""
    heights(y, g)
    per_mass = 1.0 / mass[1]
    for r in range(24):  # no scatter here: this loop becomes vector instructions
        slope, tension = spring_law(g[0, r], g[1, r], bed[0, r], bed[1, r], bed[2, r], bed[3, r])
        g[2, r] = tension * slope * per_mass
    for i in range(9):
        f[i] = y[9 + i]
        f[9 + i] = 0.0
    for r in range(24):
        f[9 + FIRST[r]] -= g[2, r]
        if SECOND[r] >= 0:
            f[9 + SECOND[r]] += g[2, r]
    f[18], f[19], f[20] = y[21], y[22], y[23]
    f[21] = f[22] = f[23] = 0.0
    if touching:
        at, moving = relative(y, p)
        # raw, not N: the stages of the step that ends at the release may look past it
        fx, fy, _, raw = contact_law(at, moving, ball)
        f[21], f[22], f[23] = fx / mass[0], fy / mass[0], raw / mass[0]
        f[9 + p] -= raw * per_mass


@compilable
def force_by_theta(y: Any, s: Any, a: int, p: int, ball: Any, by_ball: Any) -> Any:
    """d(kb x + cb x')/dtheta_a."""
    at, moving = relative(y, p)
    return (
        -ball[0] * (s[20, a] - s[p, a])
        - ball[1] * (s[23, a] - s[9 + p, a])
        - at[2] * by_ball[0, a]
        - moving[2] * by_ball[1, a]
    )


@compilable
def tangent_rates(
    y: Any,
    s: Any,
    touching: bool,
    p: int,
    bed: Any,
    ball: Any,
    mass: Any,
    by_bed: Any,
    by_ball: Any,
    g: Any,
    f: Any,
) -> None:
    """Rates s' into f, (24, n). `by_bed` (4, 24, n), `by_ball` (3, n): d constants/dtheta."""
    count = s.shape[1]
    for i in range(9):
        for a in range(count):
            f[i, a] = s[9 + i, a]
            f[9 + i, a] = 0.0
    heights(y, g)
    per_mass = 1.0 / mass[1]
    for r in range(24):
        _, by_dz, by_rate, by_k, by_slack, by_length2, by_c = spring_partials(
            g[0, r], g[1, r], bed[0, r], bed[1, r], bed[2, r], bed[3, r]
        )
        g[2, r], g[3, r], g[4, r] = by_k, by_slack, by_length2
        g[0, r], g[1, r], g[5, r] = by_dz, by_rate, by_c
    for r in range(24):
        i, j = FIRST[r], SECOND[r]
        for a in range(count):
            d_dz, d_rate = s[i, a], s[9 + i, a]
            if j >= 0:
                d_dz -= s[j, a]
                d_rate -= s[9 + j, a]
            pull = per_mass * (
                g[0, r] * d_dz
                + g[1, r] * d_rate
                + g[2, r] * by_bed[0, r, a]
                + g[3, r] * by_bed[1, r, a]
                + g[4, r] * by_bed[2, r, a]
                + g[5, r] * by_bed[3, r, a]
            )
            f[9 + i, a] -= pull
            if j >= 0:
                f[9 + j, a] += pull
    for a in range(count):
        for i in range(3):
            f[18 + i, a] = s[21 + i, a]
            f[21 + i, a] = 0.0
    if not touching:
        return
    at, moving = relative(y, p)
    _, _, normal, ux, uy, ex, ey, share = contact_partials(at, moving, ball)
    for a in range(count):
        dn = force_by_theta(y, s, a, p, ball, by_ball)
        dtx, dty = s[21, a], s[22, a]
        if ball[6] > 0.5:
            dtx, dty = s[18, a], s[19, a]
        along = ex * dtx + ey * dty
        d_mu = normal * by_ball[2, a]
        f[21, a] = (ux * dn - ex * d_mu - share * (dtx - ex * along)) / mass[0]
        f[22, a] = (uy * dn - ey * d_mu - share * (dty - ey * along)) / mass[0]
        f[23, a] = dn / mass[0]
        f[9 + p, a] -= dn * per_mass
