"""Numbers, state and kinematics of the free racket: Jacobians written out point by point.

Bodies: handle H (frame at the butt, x to the tip, z normal to the strings), head B (origin at
the throat joint), nine string point masses that slide along the head's z, the ball Q (a point).
All vectors are in world axes. The twenty generalized speeds are

    u = (w, v, tz', ty', z_0'..z_8', v_Q),

w and v being the handle's angular velocity and the velocity of the butt origin.

s = R_WH (l1, 0, 0) leads from the butt to the throat joint T, hz is the handle's z axis,
hy = R_WH Rz(tz) e_y, R_WB = R_WH Rz(tz) Ry(ty), n = R_WB e_z.

    v_T = v + w x s                         a0_T = w x (w x s)
    w_B = w + tz' hz + ty' hy               al0_B = tz' w x hz + ty' (w + tz' hz) x hy

since hz turns with w and hy with w + tz' hz. For a point r from T on the head, sliding at rate z'
(zero for the centre of mass):

    v_P = v_T + w_B x r + z' n              a0_P = a0_T + al0_B x r + w_B x (w_B x r) + 2 z' w_B x n

The coefficients of u are the Jacobians (a x b being linear in a), the terms without u' are a0.

Units: SI, radians.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from .clamped_impact import FloatArray, IntArray

# Columns of the Jacobians.
W, V, TZ, TY, Q = slice(0, 3), slice(3, 6), 6, 7, slice(17, 20)
Z0, NU = 8, 20
EYE3 = np.eye(3)


@dataclass(frozen=True)
class FreeRacketParams:
    """Numbers of the model. Inertias are (Ix, Iy, Iz) about the part's own centre of mass."""

    handle_mass: float
    handle_length: float  # butt to throat joint
    handle_com: float  # from the butt, along x of H
    handle_inertia: FloatArray  # (3,) in the axes of H
    head_mass: float  # without the nine string masses
    head_com: float  # from the throat joint, along x of B
    head_inertia: FloatArray  # (3,) in the axes of B
    k_z: float  # N m/rad, rotation about z (in-plane bending)
    c_z: float
    k_y: float  # rotation about y (out-of-plane bending)
    c_y: float
    gsc: float  # string-bed centre from the throat joint, along x of B
    grid_xy: FloatArray  # (9, 2) about the string-bed centre
    string_mass: float  # each of the nine
    spring_i: IntArray  # (24,) point index or -1 for the rim
    spring_j: IntArray  # (24,)
    spring_k: FloatArray  # (24,)
    spring_L0: FloatArray  # (24,)
    T0: float
    ball_mass: float
    kb: float
    cb: float
    mu: float
    contact_index: int  # 0..8
    string_damping: float = 0.0
    eps_v: float = 1e-3  # m/s
    eps_d: float = 1e-5  # m
    friction: Literal["velocity", "displacement"] = "velocity"
    reaction_at: Literal["string_mass", "ball"] = "ball"
    hb: float = 0.0  # N/m^2, rise of kb with compression
    db: float = 0.0  # N s/m^2, rise of cb

    def normal_force(self, x: float, x_dot: float) -> float:
        """The force of a compression and its rate, before it is clamped."""
        return (self.kb + self.hb * x) * x + (self.cb + self.db * x) * x_dot


@dataclass(frozen=True)
class FreeRacketState:
    """Positions and velocities, all vectors in world axes."""

    R_WH: FloatArray  # (3, 3)
    p_WHo: FloatArray  # (3,)
    theta_z: float
    theta_y: float
    z: FloatArray  # (9,)
    p_WQ: FloatArray  # (3,)
    w_WH: FloatArray  # (3,)
    v_WHo: FloatArray  # (3,)
    theta_z_dot: float
    theta_y_dot: float
    z_dot: FloatArray  # (9,)
    v_WQ: FloatArray  # (3,)
    in_contact: bool = False
    offset: tuple[float, float] = (0.0, 0.0)  # x, y of p in B, latched at touch


@dataclass(frozen=True)
class Kinematics:
    """Jacobians and velocity-dependent accelerations of one state.

    Points: 0 handle COM, 1 head COM, 2..10 string masses, 11 ball. Bodies: 0 handle, 1 head.
    """

    u: FloatArray  # (20,)
    R_WB: FloatArray  # (3, 3)
    p_throat: FloatArray  # (3,)
    w_WB: FloatArray  # (3,)
    mass: FloatArray  # (12,)
    p: FloatArray  # (12, 3)
    J: FloatArray  # (12, 3, 20)
    a0: FloatArray  # (12, 3)
    Jw: FloatArray  # (2, 3, 20)
    alpha0: FloatArray  # (2, 3)
    inertia: FloatArray  # (2, 3, 3) about the COMs, world axes
    J_throat: FloatArray  # (3, 20)


def skew(a: FloatArray) -> FloatArray:
    """Matrix of a x."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def rotation_HB(theta_z: float, theta_y: float) -> FloatArray:
    """Rz(theta_z) Ry(theta_y)."""
    cz, sz, cy, sy = np.cos(theta_z), np.sin(theta_z), np.cos(theta_y), np.sin(theta_y)
    return np.array([[cz * cy, -sz, cz * sy], [sz * cy, cz, sz * sy], [-sy, 0.0, cy]])


def kinematics(par: FreeRacketParams, st: FreeRacketState) -> Kinematics:
    """Write every velocity as J u and every acceleration as J u' + a0."""
    w, tz1, ty1 = st.w_WH, st.theta_z_dot, st.theta_y_dot
    u = np.concatenate([w, st.v_WHo, [tz1, ty1], st.z_dot, st.v_WQ])
    R_WB: FloatArray = st.R_WH @ rotation_HB(st.theta_z, st.theta_y)
    hz, hy, n = st.R_WH[:, 2], R_WB[:, 1], R_WB[:, 2]  # Ry leaves the joint's y axis in place

    Jw = np.zeros((2, 3, NU))
    Jw[:, :, W] = EYE3
    Jw[1, :, TZ], Jw[1, :, TY] = hz, hy
    w_WB: FloatArray = Jw[1] @ u
    alpha0 = np.zeros((2, 3))
    alpha0[1] = tz1 * (skew(w) @ hz) + ty1 * (skew(w + tz1 * hz) @ hy)

    s = st.R_WH[:, 0] * par.handle_length
    c = st.R_WH[:, 0] * par.handle_com
    J_throat = np.zeros((3, NU))
    J_throat[:, W], J_throat[:, V] = -skew(s), EYE3
    w_x, wB_x = skew(w), skew(w_WB)
    a0_throat = w_x @ (w_x @ s)
    p_throat: FloatArray = st.p_WHo + s

    p, J, a0 = np.zeros((12, 3)), np.zeros((12, 3, NU)), np.zeros((12, 3))
    p[0], a0[0] = st.p_WHo + c, w_x @ (w_x @ c)
    J[0, :, W], J[0, :, V] = -skew(c), EYE3
    p[11], J[11, :, Q] = st.p_WQ, EYE3

    r_B = np.zeros((10, 3))  # head COM and string masses from the throat, axes of B
    r_B[0, 0] = par.head_com
    r_B[1:, 0] = par.gsc + par.grid_xy[:, 0]
    r_B[1:, 1] = par.grid_xy[:, 1]
    r_B[1:, 2] = st.z
    slide = np.concatenate([[0.0], st.z_dot])
    for m, r in enumerate(r_B @ R_WB.T):
        p[m + 1] = p_throat + r
        J[m + 1] = J_throat - skew(r) @ Jw[1]
        if m > 0:
            J[m + 1, :, Z0 + m - 1] = n
        a0[m + 1] = a0_throat + skew(alpha0[1]) @ r + wB_x @ (wB_x @ r + 2.0 * slide[m] * n)

    mass = np.array([par.handle_mass, par.head_mass, *[par.string_mass] * 9, par.ball_mass])
    inertia = np.stack(
        [(st.R_WH * par.handle_inertia) @ st.R_WH.T, (R_WB * par.head_inertia) @ R_WB.T]
    )
    return Kinematics(u, R_WB, p_throat, w_WB, mass, p, J, a0, Jw, alpha0, inertia, J_throat)


def mass_matrix(kin: Kinematics) -> FloatArray:
    """Sum of m J^T J over the points and of Jw^T I Jw over the bodies."""
    rows = (np.sqrt(kin.mass)[:, None, None] * kin.J).reshape(-1, NU)
    matrix: FloatArray = rows.T @ rows
    for Jw, inertia in zip(kin.Jw, kin.inertia, strict=True):
        matrix = matrix + Jw.T @ inertia @ Jw
    return matrix
