"""The free racket and a ball that has a radius and spins, after ``free_racket``'s equations.

The ball is a sphere of moment of inertia ``inertia`` about its centre; three speeds more, its
angular velocity, and the two numbers s of the spring between its surface and the strings, in the
axes of B.

*Bed.* A deflection that is given at the nine masses and 0 at the rim is interpolated along x and
along y by straight lines (np.interp over rim, masses, rim: a basis function is the product of two
of them); with the place at touch this gives the weights W, which stay. The ball's lowest point is
pressed into the bed by x = W.z + R - n.(p_Q - p_GSC); N = (kb + hb x) x + (cb + db x) x'.

*Contact point* C = p_Q - (R - chi x) n (x > 0). The head's point there moves with J_C u,
J_C = J_throat - [(C - p_T) x] Jw_B; the ball's with v_Q + w_Q x (C - p_Q). g is the difference in
the plane of B. While it grips s' = g and F = -(kt s + ct g); while it slides |F| = mu N against
kt s + ct g, and s' follows from F = -(kt s + ct s').

*Kane.* N n + F on the ball at C and the opposite on the bed at C, of which the mass i has the share
W_i (its point C moves with J_C u + n z_i') and the rim the rest:

    M u' = (rhs without contact) + J_Q^T f - J_C^T f - sum_i W_i (n.f) e_i,
    I w_Q' = (C - p_Q) x f.

Units: SI, radians.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import solve_ivp  # type: ignore[import-untyped, unused-ignore]

from .clamped_impact import FloatArray
from .free_impact import pack, unpack
from .free_kinematics import (
    TY,
    TZ,
    Z0,
    FreeRacketParams,
    FreeRacketState,
    Q,
    V,
    W,
    kinematics,
    mass_matrix,
    skew,
)
from .free_racket import accelerations as free_accelerations


@dataclass(frozen=True)
class SpinningBall:
    """Numbers of the ball's surface, and of the rim: semi-axes along x and y."""

    radius: float
    chi: float
    kt: float
    ct: float
    inertia: float
    rim: tuple[float, float]
    mu: FloatArray  # (9,)


@dataclass(frozen=True)
class State:
    """Racket and ball's centre, and what the ball has beside. ``in_contact`` is the racket's."""

    racket: FreeRacketState
    spin: FloatArray  # (3,) in the world
    shear: FloatArray  # (2,) in B
    weights: FloatArray  # (9,) frozen at touch
    mu: float
    grips: bool


@dataclass(frozen=True)
class Rates:
    """What ``rates`` gives: accelerations, the spring's rate, and the forces in B."""

    speeds: FloatArray  # (20,)
    spin: FloatArray  # (3,)
    shear: FloatArray  # (2,)
    normal: float
    friction: FloatArray  # (2,)
    margin: float  # mu N less what a gripping ball would need


def weights_at(par: FreeRacketParams, ball: SpinningBall, x: float, y: float) -> FloatArray:
    """Nine weights: rows of three along y, from the tip, each from +y."""
    rows, columns = par.grid_xy[::3, 0][::-1], par.grid_xy[:3, 1][::-1]
    end_x = ball.rim[0] * np.sqrt(1.0 - (y / ball.rim[1]) ** 2)
    end_y = ball.rim[1] * np.sqrt(1.0 - (x / ball.rim[0]) ** 2)
    over_x = [np.interp(x, [-end_x, *rows, end_x], [0.0, *e, 0.0]) for e in np.eye(3)]
    over_y = [np.interp(y, [-end_y, *columns, end_y], [0.0, *e, 0.0]) for e in np.eye(3)]
    return np.outer(over_x[::-1], over_y[::-1]).ravel()


def friction_at(par: FreeRacketParams, ball: SpinningBall, x: float, y: float) -> float:
    """Mu between the masses, and as at the nearest line outside of them."""
    rows, columns = par.grid_xy[::3, 0][::-1], par.grid_xy[:3, 1][::-1]
    mu = ball.mu.reshape(3, 3)[::-1, ::-1]
    return float(np.interp(x, rows, [np.interp(y, columns, row) for row in mu]))


def rates(par: FreeRacketParams, ball: SpinningBall, state: State) -> Rates:
    """Solve the equations of the module."""
    st = state.racket
    kin = kinematics(par, st)
    free = free_accelerations(par, replace(st, in_contact=False))
    speeds = np.zeros(20)
    speeds[W], speeds[V], speeds[TZ], speeds[TY] = (
        free.alpha_WH,
        free.a_WHo,
        free.theta_z_ddot,
        free.theta_y_ddot,
    )
    speeds[Z0 : Z0 + 9], speeds[Q] = free.z_ddot, free.a_WQ
    if not st.in_contact:
        return Rates(speeds, np.zeros(3), np.zeros(2), 0.0, np.zeros(2), 0.0)
    n = kin.R_WB[:, 2]
    gsc = kin.p_throat + kin.R_WB[:, 0] * par.gsc
    head_at = lambda p: kin.J_throat - skew(p - kin.p_throat) @ kin.Jw[1]  # noqa: E731
    x = float(state.weights @ st.z + ball.radius - n @ (st.p_WQ - gsc))
    x_dot = float(state.weights @ st.z_dot - n @ (st.v_WQ - head_at(st.p_WQ) @ kin.u))
    normal = par.normal_force(x, x_dot)
    down = -(ball.radius - ball.chi * max(x, 0.0)) * n
    J_C = head_at(st.p_WQ + down)
    g = kin.R_WB[:, :2].T @ (st.v_WQ + np.cross(state.spin, down) - J_C @ kin.u)
    need = ball.kt * state.shear + ball.ct * g
    size, most = float(np.hypot(*need)), state.mu * normal
    friction = -need if state.grips else -most * need / size
    f = normal * n + kin.R_WB[:, :2] @ friction
    push = np.zeros(20)
    push[Q] = f
    push -= J_C.T @ f
    push[Z0 : Z0 + 9] -= state.weights * (n @ f)
    matrix = mass_matrix(kin)
    scale = 1.0 / np.sqrt(np.diag(matrix))
    speeds += scale * np.linalg.solve(matrix * np.outer(scale, scale), scale * push)
    shear = -(friction + ball.kt * state.shear) / ball.ct
    return Rates(speeds, np.cross(down, f) / ball.inertia, shear, normal, friction, most - size)


def impact(
    par: FreeRacketParams, ball: SpinningBall, state: State, rtol: float = 1e-11
) -> tuple[State, float, float]:
    """From touch to release: the state there, its time, and the time spent sliding."""

    def at(y: FloatArray) -> State:
        return replace(state, racket=unpack(y[:46], state.racket), spin=y[46:49], shear=y[49:51])

    def derivative(_t: float, y: FloatArray) -> FloatArray:
        now = at(y)
        s, a = now.racket, rates(par, ball, now)
        v = a.speeds
        turning = (skew(s.w_WH) @ s.R_WH).ravel()
        first = [*turning, *s.v_WHo, s.theta_z_dot, s.theta_y_dot, *s.z_dot, *s.v_WQ]
        second = [*v[W], *v[V], v[TZ], v[TY], *v[Z0 : Z0 + 9], *v[Q]]
        return np.array([*first, *second, *a.spin, *a.shear])

    def release(_t: float, y: FloatArray) -> float:
        return rates(par, ball, at(y)).normal

    def turn(_t: float, y: FloatArray) -> float:
        margin = rates(par, ball, at(y)).margin
        return margin if state.grips else -margin

    for event in (release, turn):
        event.terminal, event.direction = True, -1.0  # type: ignore[attr-defined]
    time, slid = 0.0, 0.0
    y = np.concatenate([pack(state.racket), state.spin, state.shear])
    for _ in range(20):
        run = solve_ivp(
            derivative,
            (time, time + 0.05),
            y,
            method="DOP853",
            rtol=rtol,
            atol=1e-13,
            events=(release, turn),
        )
        slid += 0.0 if state.grips else run.t[-1] - time
        time, y = float(run.t[-1]), run.y[:, -1]
        if len(run.t_events[0]):
            return at(y), time, slid
        state = replace(state, grips=not state.grips)
    raise RuntimeError("more turns than any ball makes")
