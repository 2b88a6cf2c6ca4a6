"""Accelerations of the free racket and the ball, by Kane's method with explicit Jacobians.

Bodies: handle H (frame at the butt, x to the tip, z normal to the strings), head B (origin at
the throat joint), nine string point masses that slide along the head's z, the ball Q (a point).
All vectors below are in world axes. The twenty generalized speeds are

    u = (w, v, tz', ty', z_0'..z_8', v_Q),

w and v being the handle's angular velocity and the velocity of the butt origin. No component of
the acceleration of the system is propagated from body to body: every velocity is written as
J(q) u, every acceleration as J u' + a0(q, u) (``free_kinematics`` derives them), and Kane's
equations are then one linear system

    [sum_P m J^T J + sum_bodies Jw^T I Jw] u'
        = sum_P J^T (m g + F_P - m a0) - sum_bodies Jw^T (I al0 + w x I w) + tau,

with P over the two centres of mass, the nine string masses and the ball.

*Applied forces.* tau has -k t - c t' on the two joint angles and the springs' transverse forces on
the nine z_i: both act between bodies that the speeds already separate. With p = p_Q - p_S for the
string mass S that is touched,

    v_rel = v_Q - v_S - w_B x p   (velocity of Q seen from the sliding string body),
    x = -n.p,   x' = -n.v_rel     (because n' = w_B x n),
    N = max(0, kb x + cb x'), or with constants that rise by hb x and db x.

Friction F on the ball: with v_t = v_rel + x' n, ``velocity`` takes -mu N v_t / sqrt(v_t^2 + ev^2);
``displacement`` takes -mu N d / sqrt(d^2 + ed^2), d being the x, y components of p in B less those
latched at touch. N n + F acts on the ball at Q. Its reaction acts on the string body: at S, or at
the point of the body that coincides with Q. Only the second is an equal and opposite force on one
line, so only it conserves angular momentum; the first leaves the couple p x (N n + F), and does
work at the rate (N n + F).(w_B x p) beyond that of the ball's spring, damper and sliding.

Units: SI, radians.
"""

from dataclasses import dataclass

import numpy as np

from .clamped_impact import FloatArray, spring_energy, spring_forces
from .free_kinematics import (
    TY,
    TZ,
    Z0,
    FreeRacketParams,
    FreeRacketState,
    Kinematics,
    Q,
    V,
    W,
    kinematics,
    mass_matrix,
    rotation_HB,
    skew,
)

__all__ = [
    "Accelerations",
    "Contact",
    "FreeRacketParams",
    "FreeRacketState",
    "Momenta",
    "accelerations",
    "contact",
    "momenta",
    "potential_energy",
    "rotation_HB",
    "skew",
]


@dataclass(frozen=True)
class Contact:
    """Contact quantities, all zero but x and x_dot when the ball is not in contact."""

    x: float  # compression, m
    x_dot: float  # m/s
    N: float
    F: FloatArray  # (3,) friction on the ball, world


@dataclass(frozen=True)
class Accelerations:
    """Result of ``accelerations``; vectors in world axes."""

    alpha_WH: FloatArray  # (3,)
    a_WHo: FloatArray  # (3,)
    theta_z_ddot: float
    theta_y_ddot: float
    z_ddot: FloatArray  # (9,)
    a_WQ: FloatArray  # (3,)
    x: float
    x_dot: float
    N: float
    F: FloatArray  # (3,) friction on the ball


@dataclass(frozen=True)
class Momenta:
    """Totals of racket, strings and ball; angular momentum about the world origin."""

    linear: FloatArray  # (3,)
    angular: FloatArray  # (3,)
    kinetic_energy: float


def _contact(
    par: FreeRacketParams, st: FreeRacketState, kin: Kinematics, clamp: bool = True
) -> Contact:
    S = 2 + par.contact_index
    n = kin.R_WB[:, 2]
    p = st.p_WQ - kin.p[S]
    v_rel = st.v_WQ - kin.J[S] @ kin.u - skew(kin.w_WB) @ p
    x, x_dot = float(-n @ p), float(-n @ v_rel)
    if not st.in_contact:
        return Contact(x, x_dot, 0.0, np.zeros(3))
    N = par.normal_force(x, x_dot)
    if clamp:
        N = max(0.0, N)
    if par.friction == "velocity":
        slip, eps = v_rel + x_dot * n, par.eps_v
    else:
        d = (kin.R_WB.T @ p)[:2] - np.asarray(st.offset)
        slip, eps = kin.R_WB[:, :2] @ d, par.eps_d
    size = float(np.sqrt(slip @ slip + eps * eps))
    F = -par.mu * N * slip / size if size > 0.0 else np.zeros(3)
    return Contact(x, x_dot, N, F)


def contact(params: FreeRacketParams, state: FreeRacketState) -> Contact:
    """Compression, its rate, and the forces on the ball."""
    return _contact(params, state, kinematics(params, state))


def accelerations(
    params: FreeRacketParams,
    state: FreeRacketState,
    gravity: FloatArray | None = None,
    clamp: bool = True,
) -> Accelerations:
    """Solve Kane's equations.

    ``gravity`` (3,) in world axes acts on every mass (default none). ``clamp=False`` leaves out
    the cut N >= 0, for an integrator that finds the release itself and wants a smooth rate.
    """
    par, st, kin = params, state, kinematics(params, state)
    g = np.zeros(3) if gravity is None else np.asarray(gravity, dtype=np.float64)

    force = kin.mass[:, None] * (g - kin.a0)
    rhs: FloatArray = np.einsum("pij,pi->j", kin.J, force)
    for Jw, inertia, alpha0 in zip(kin.Jw, kin.inertia, kin.alpha0, strict=True):
        w = Jw @ kin.u
        rhs -= Jw.T @ (inertia @ alpha0 + skew(w) @ (inertia @ w))

    rhs[TZ] -= par.k_z * st.theta_z + par.c_z * st.theta_z_dot
    rhs[TY] -= par.k_y * st.theta_y + par.c_y * st.theta_y_dot
    rhs[Z0 : Z0 + 9] += spring_forces(
        st.z,
        st.z_dot,
        par.spring_i,
        par.spring_j,
        par.spring_k,
        par.spring_L0,
        par.T0,
        par.string_damping,
    )

    touch = _contact(par, st, kin, clamp)
    if st.in_contact:
        on_ball = touch.N * kin.R_WB[:, 2] + touch.F
        rhs[Q] += on_ball
        J_reaction = kin.J[2 + par.contact_index]
        if par.reaction_at == "ball":
            J_reaction = kin.J_throat - skew(st.p_WQ - kin.p_throat) @ kin.Jw[1]
            J_reaction[:, Z0 + par.contact_index] = kin.R_WB[:, 2]
        rhs -= J_reaction.T @ on_ball

    a = _solve(mass_matrix(kin), rhs)
    return Accelerations(
        a[W],
        a[V],
        float(a[TZ]),
        float(a[TY]),
        a[Z0 : Z0 + 9],
        a[Q],
        touch.x,
        touch.x_dot,
        touch.N,
        touch.F,
    )


def _solve(matrix: FloatArray, rhs: FloatArray) -> FloatArray:
    """Solve with unit diagonal scaling and one step of iterative refinement."""
    scale = 1.0 / np.sqrt(np.diag(matrix))
    scaled = matrix * np.outer(scale, scale)
    y = np.linalg.solve(scaled, scale * rhs)
    y += np.linalg.solve(scaled, scale * rhs - scaled @ y)
    solution: FloatArray = scale * y
    return solution


def momenta(params: FreeRacketParams, state: FreeRacketState) -> Momenta:
    """Total linear and angular momentum (about the world origin) and kinetic energy."""
    kin = kinematics(params, state)
    linear = kin.mass[:, None] * (kin.J @ kin.u)
    spin = np.einsum("bij,bjk,k->i", kin.inertia, kin.Jw, kin.u)
    angular = np.cross(kin.p, linear).sum(axis=0) + spin
    kinetic = 0.5 * float(kin.u @ mass_matrix(kin) @ kin.u)
    return Momenta(linear.sum(axis=0), angular, kinetic)


def potential_energy(
    params: FreeRacketParams, state: FreeRacketState, gravity: FloatArray | None = None
) -> float:
    """Joint springs, string-bed and gravity (J), without the ball's compression kb x^2 / 2."""
    par, st = params, state
    energy = 0.5 * (par.k_z * st.theta_z**2 + par.k_y * st.theta_y**2)
    energy += spring_energy(st.z, par.spring_i, par.spring_j, par.spring_k, par.spring_L0, par.T0)
    if gravity is not None:
        kin = kinematics(par, st)
        energy -= float(gravity @ (kin.mass @ kin.p))
    return energy
