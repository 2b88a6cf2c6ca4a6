"""Has the contact law, ball against string mass; `ball_contact` has the LeafSystem.

With Q the ball's centre, S the string mass in contact, B the head's axes (z normal to the strings)
and p = p_SQ_B, v = the velocity of Q relative to S as seen in B:

    compression   x = -p_z,   x' = -v_z                                   [m, m/s]
    normal force  N = max(0, (kb + hb x) x + (cb + db x) x')   on the ball, along +z [N]
    friction      F = -mu N v_t / sqrt(|v_t|^2 + s_v^2)      reading "velocity"
                  F = -mu N d / sqrt(|d|^2 + s_d^2)          reading "displacement"
                  a sheared spring and damper, cut at mu N   reading "element": `laws.surface`

v_t is the tangential part of v, d the tangential part of p since touch. Glynn et al. (2011) take
the direction of F from the vector string mass -> ball ("displacement"); both agree while the ball
slides outward. s_v and s_d are numerical scales that keep F smooth where sliding starts or stops.

The reaction to N and F acts on the string mass's body: by default at the point where the ball is
("ball"), so that action and reaction share a line; or at the string mass itself ("string_mass"),
which is the literal reading of forces between two particles. Once the ball has slid by p, the
latter is a couple p x f that makes angular momentum and energy from nowhere.

The normal law is a choice of the ball. `linear`, the paper's: hb = db = 0, and kb and cb are linear
in the normal approach speed at first touch, held at their end values outside the speeds for which
they were identified. `hunt_crossley`: stiffness and damping grow with compression and not with
speed, after Hunt & Crossley (1975), Journal of Applied Mechanics 42:440-445, whose law is that with
cb = 0: no force at touch, and restitution that falls with speed.

Contact starts when x rises through 0 within the rim and ends when N returns to 0. What
compression is left then is given up: the ball regains its shape off the strings. The law knows the
ball from the +z side only.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drake_racket.laws.compilation import compilable, compiled

NORMAL_LAWS = ("linear", "hunt_crossley")
"""Laws of the ball's normal force; the first is the paper's."""
FRICTION_READINGS = ("velocity", "displacement", "element")
REACTION_POINTS = ("string_mass", "ball")

FREE, CONTACT, PASSED = 0.0, 1.0, 2.0
"""Phases: in front of the strings; in contact; behind them without force (between release and
leaving the strings, or having gone past outside the rim)."""


@compilable
def ball_constants(v: Any, speed_low: Any, speed_high: Any, low: Any, growth: Any) -> Any:
    """Gives the constant kb (N/m) or cb (N s/m) at the normal approach speed `v` (m/s).

    low * (1 + growth * (v - speed_low) / (speed_high - speed_low)), v held within the range.
    """
    held = min(max(v, speed_low), speed_high)
    return low * (1.0 + growth * (held - speed_low) / (speed_high - speed_low))


@compilable
def normal_force(x: Any, rate: Any, kb: Any, cb: Any, hb: Any, db: Any) -> Any:
    """Gives N (N) before it is clamped, at a compression x (m) and its rate (m/s).

    Args:
        kb, cb, hb, db: N/m, N s/m, N/m^2, N s/m^2.

    """
    return kb * x + cb * rate + x * (hb * x + db * rate)


@compilable
def normal_slopes(x: Any, rate: Any, kb: Any, cb: Any, hb: Any, db: Any) -> Any:
    """Gives dN/dx (N/m) and dN/dx' (N s/m) of `normal_force`."""
    return kb + (2.0 * hb * x + db * rate), cb + db * x


@compilable
def stored_energy(x: Any, kb: Any, hb: Any) -> Any:
    """Gives the energy (J) in a ball that is compressed by x (m): kb x^2 / 2 + hb x^3 / 3."""
    return 0.5 * kb * x * x + hb * x * x * x / 3.0


@compilable
def contact_law(p: Any, v: Any, constants: Any) -> Any:
    """Gives the force on the ball in the head's axes; equations in the module's docstring.

    Args:
        p, v: p_SQ_B (m) and v_SQ_B (m/s), three components each.
        constants: kb (N/m), cb (N s/m), mu (1), tangential offset of p at touch x, y (m), scale
            (s_v in m/s or s_d in m), friction reading (0 velocity, 1 displacement), hb (N/m^2),
            db (N s/m^2).

    Returns:
        F_x, F_y, N (N), and N before it is clamped.

    """
    raw = normal_force(-p[2], -v[2], constants[0], constants[1], constants[7], constants[8])
    normal = raw if raw > 0.0 else 0.0 * raw
    if constants[6] > 0.5:
        tx, ty = p[0] - constants[3], p[1] - constants[4]
    else:
        tx, ty = v[0], v[1]
    share = -constants[2] * normal / (tx * tx + ty * ty + constants[5] * constants[5]) ** 0.5
    return share * tx, share * ty, normal, raw


@compilable
def contact_partials(p: Any, v: Any, constants: Any) -> Any:
    """Gives the force of `contact_law` in contact (N > 0), and what its derivatives are made of.

    With t the tangential vector of the friction's reading, s its scale and r = sqrt(|t|^2 + s^2):
    dF = u dN + N du_mu dmu - (mu N / r) (dt - t (t . dt) / r^2), where u = -mu t / r.

    Returns:
        F_x, F_y, N (N); u_x, u_y = F / N; t_x / r, t_y / r; mu N / r (N over the unit of t).

    """
    fx, fy, normal, _ = contact_law(p, v, constants)
    if constants[6] > 0.5:
        tx, ty = p[0] - constants[3], p[1] - constants[4]
    else:
        tx, ty = v[0], v[1]
    ux, uy, ex, ey, share = friction_partials(tx, ty, normal, constants)
    return fx, fy, normal, ux, uy, ex, ey, share


@compilable
def friction_partials(tx: Any, ty: Any, normal: Any, constants: Any) -> Any:
    """Gives the last five of `contact_partials` for a sliding t (its reading's unit) under N."""
    r = (tx * tx + ty * ty + constants[5] * constants[5]) ** 0.5
    ex, ey = tx / r, ty / r
    mu = constants[2]
    return -mu * ex, -mu * ey, ex, ey, mu * normal / r


@compilable
def relative_motion(x_s: Any, x_q: Any, v_s: Any, v_q: Any) -> Any:
    """Gives p_SQ_B (m) and v_SQ_B (m/s), the ball Q about the string mass S as seen in the head B.

    Args:
        x_s, x_q: (3, 4) poses X_WS, X_WQ (the string mass has the head's axes).
        v_s, v_q: (6,) spatial velocities V_WS, V_WQ in the world, rotational part first.

    """
    d0, d1, d2 = x_q[0, 3] - x_s[0, 3], x_q[1, 3] - x_s[1, 3], x_q[2, 3] - x_s[2, 3]
    u0 = v_q[3] - v_s[3] - (v_s[1] * d2 - v_s[2] * d1)
    u1 = v_q[4] - v_s[4] - (v_s[2] * d0 - v_s[0] * d2)
    u2 = v_q[5] - v_s[5] - (v_s[0] * d1 - v_s[1] * d0)
    p = (
        x_s[0, 0] * d0 + x_s[1, 0] * d1 + x_s[2, 0] * d2,
        x_s[0, 1] * d0 + x_s[1, 1] * d1 + x_s[2, 1] * d2,
        x_s[0, 2] * d0 + x_s[1, 2] * d1 + x_s[2, 2] * d2,
    )
    v = (
        x_s[0, 0] * u0 + x_s[1, 0] * u1 + x_s[2, 0] * u2,
        x_s[0, 1] * u0 + x_s[1, 1] * u1 + x_s[2, 1] * u2,
        x_s[0, 2] * u0 + x_s[1, 2] * u1 + x_s[2, 2] * u2,
    )
    return p, v


@compilable
def contact_powers(p: Any, v: Any, force: Any, damping: Any, w: Any) -> Any:
    """Gives the power (W) lost in the ball's damper, lost to friction, and gained from the couple.

    (cb + db x) x'^2 while N > 0, the `damping` (N s/m) in brackets given; -F . v_t; and f . (w x
    p), which is what two opposite forces f do when they act p apart on a head that turns at w. All
    vectors in the head's axes.
    """
    in_ball = damping * v[2] * v[2] if force[2] > 0.0 else 0.0 * v[2]
    in_friction = -(force[0] * v[0] + force[1] * v[1])
    couple = (
        force[0] * (w[1] * p[2] - w[2] * p[1])
        + force[1] * (w[2] * p[0] - w[0] * p[2])
        + force[2] * (w[0] * p[1] - w[1] * p[0])
    )
    return in_ball, in_friction, couple


def contact_forces(x_s: Any, x_q: Any, v_s: Any, v_q: Any, constants: Any) -> Any:
    """Gives all of a contact from two motions; arguments as `relative_motion` and `contact_law`.

    Returns:
        F_Q_W (6,) on the ball; F_S_W (6,) on the string mass; p_SQ_B, v_SQ_B (3,); and the four
        results of `contact_law`.

    """
    p, v = relative_motion(x_s, x_q, v_s, v_q)
    fx, fy, fz, raw = contact_law(p, v, constants)
    f0 = x_s[0, 0] * fx + x_s[0, 1] * fy + x_s[0, 2] * fz
    f1 = x_s[1, 0] * fx + x_s[1, 1] * fy + x_s[1, 2] * fz
    f2 = x_s[2, 0] * fx + x_s[2, 1] * fy + x_s[2, 2] * fz
    zero = 0.0 * fx
    return (
        np.array((zero, zero, zero, f0, f1, f2)),
        np.array((zero, zero, zero, -f0, -f1, -f2)),
        np.array(p),
        np.array(v),
        np.array((fx, fy, fz, raw)),
    )


# compiled here, in the file of all that it calls: numba's cache watches one file
COMPILED_CONTACT = compiled(contact_forces)
COMPILED_MOTION = compiled(relative_motion)
