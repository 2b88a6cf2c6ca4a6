"""Motion of the free racket and the ball: ``free_racket`` integrated with DOP853.

State vector (46): R_WH row by row (9), p_WHo (3), theta_z, theta_y, z (9), p_WQ (3), w_WH (3),
v_WHo (3), theta_z', theta_y', z' (9), v_WQ (3). The rotation obeys R' = [w x] R; it is integrated
as nine numbers, which keep R^T R = 1 to the integrator's tolerance, and never re-orthonormalised.

An impact starts at first touch with ``in_contact`` true and stops when N, not cut off, or x falls
to zero. Between those times N >= 0; the integrator sees N without the cut, so that the rate is
smooth through the event.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import solve_ivp  # type: ignore[import-untyped, unused-ignore]

from .clamped_impact import FloatArray
from .free_racket import FreeRacketParams, FreeRacketState, accelerations, contact, skew


@dataclass(frozen=True)
class FreeImpactResult:
    """Samples over the run; the last one is the release, or t_end when nothing is released."""

    t: FloatArray  # (n,)
    states: list[FreeRacketState]  # n
    N: FloatArray  # (n,)
    final: FreeRacketState
    released: bool  # True when contact ended before t_end


def pack(state: FreeRacketState) -> FloatArray:
    """Return the state as 46 numbers."""
    s = state
    return np.concatenate(
        [
            s.R_WH.ravel(),
            s.p_WHo,
            [s.theta_z, s.theta_y],
            s.z,
            s.p_WQ,
            s.w_WH,
            s.v_WHo,
            [s.theta_z_dot, s.theta_y_dot],
            s.z_dot,
            s.v_WQ,
        ]
    )


def unpack(y: FloatArray, like: FreeRacketState) -> FreeRacketState:
    """Return the 46 numbers as a state; ``in_contact`` and ``offset`` are those of ``like``."""
    return replace(
        like,
        R_WH=y[0:9].reshape(3, 3),
        p_WHo=y[9:12],
        theta_z=float(y[12]),
        theta_y=float(y[13]),
        z=y[14:23],
        p_WQ=y[23:26],
        w_WH=y[26:29],
        v_WHo=y[29:32],
        theta_z_dot=float(y[32]),
        theta_y_dot=float(y[33]),
        z_dot=y[34:43],
        v_WQ=y[43:46],
    )


def derivative(
    params: FreeRacketParams,
    state: FreeRacketState,
    gravity: FloatArray | None = None,
    clamp: bool = True,
) -> FloatArray:
    """Rate of the 46 numbers; ``clamp`` as in ``accelerations``."""
    a = accelerations(params, state, gravity, clamp)
    s = state
    return np.concatenate(
        [
            (skew(s.w_WH) @ s.R_WH).ravel(),
            s.v_WHo,
            [s.theta_z_dot, s.theta_y_dot],
            s.z_dot,
            s.v_WQ,
            a.alpha_WH,
            a.a_WHo,
            [a.theta_z_ddot, a.theta_y_ddot],
            a.z_ddot,
            a.a_WQ,
        ]
    )


def simulate(
    params: FreeRacketParams,
    state: FreeRacketState,
    t_end: float,
    gravity: FloatArray | None = None,
    samples: int = 201,
    rtol: float = 1e-11,
    atol: float = 1e-13,
) -> FreeImpactResult:
    """Integrate to release when the state is in contact, otherwise to ``t_end``."""

    def force_event(_t: float, y: FloatArray) -> float:
        c = contact(params, unpack(y, state))
        return params.normal_force(c.x, c.x_dot)

    def compression_event(_t: float, y: FloatArray) -> float:
        return contact(params, unpack(y, state)).x

    events = [force_event, compression_event] if state.in_contact else []
    for event in events:
        event.terminal = True  # type: ignore[attr-defined]
        event.direction = -1.0  # type: ignore[attr-defined]

    run = solve_ivp(
        lambda _t, y: derivative(params, unpack(y, state), gravity, clamp=False),
        (0.0, t_end),
        pack(state),
        method="DOP853",
        rtol=rtol,
        atol=atol,
        dense_output=True,
        events=events or None,
    )
    if not run.success:
        raise RuntimeError(run.message)
    released = bool(run.status == 1)
    t: FloatArray = np.linspace(0.0, float(run.t[-1]), samples)
    states = [unpack(y, state) for y in run.sol(t).T]
    states[-1] = unpack(run.y[:, -1], state)
    forces = np.array([contact(params, s).N for s in states])
    final = replace(states[-1], in_contact=False) if released else states[-1]
    return FreeImpactResult(t, states, forces, final, released)
