"""The free racket and the ball as one hand-written NumPy right-hand side for SciPy's `solve_ivp`.

Written for speed, as one would for this one model, and on another route than the package's: Kane's
equations in the axes of the head. The twenty speeds are

    u = (w, v, tz', ty'; z'_1..z'_9; v_Q),

w and v being the angular velocity of the head B and the velocity of the throat joint T, in B. For a
string mass at r_i = (x_i, y_i, z_i) from T, the z-row of its own equation,

    m (z_i'' + e_z . a_i) = s_i - f_i,    a_i = v' + w' x r_i + bias,

(s_i what the springs and f_i what the ball does to it) is solved by hand. What remains are eight
equations for (w, v, tz', ty'), in which a string mass has inertia along x and y only, and the head
carries -s_i at (x_i, y_i). Their mass matrix is J^T W J over thirty rows: angular and linear rates
of handle and head, x and y of the nine masses. The ball's three accelerations are force over mass.

State (41): quaternion of B (w, x, y, z), p_WT, tz, ty, z_1..z_9, p_WQ; u with v_Q in the world.
"""

from __future__ import annotations

import numpy as np
from impact_numbers import Numbers
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

QUATERNION, THROAT, ANGLES, Z, BALL = (
    slice(0, 4),
    slice(4, 7),
    slice(7, 9),
    slice(9, 18),
    slice(18, 21),
)
U = slice(21, 29)
W, V, RATES, ZDOT, BALLDOT = (
    slice(21, 24),
    slice(24, 27),
    slice(27, 29),
    slice(29, 38),
    slice(38, 41),
)


class NumpyImpact:
    """One normal impact on a racket at rest, from first touch on."""

    def __init__(self, numbers: Numbers) -> None:
        n = self.n = numbers
        self.touching = True
        self.evaluations = 0
        x, y = n.points.T
        self.slack = n.spring_k * n.lengths - n.initial_tension  # tension is k L - slack
        self.lengths2 = n.lengths * n.lengths
        # constant rows: head (angular, linear at its centre of mass), string masses (x, then y)
        self.jacobian = jacobian = np.zeros((30, 8))
        jacobian[6:9, 0:3] = np.eye(3)
        jacobian[9:12, 3:6] = np.eye(3)
        jacobian[10, 2], jacobian[11, 1] = n.head_com, -n.head_com
        jacobian[12:21, 3], jacobian[12:21, 2] = 1.0, -y
        jacobian[21:30, 4], jacobian[21:30, 2] = 1.0, x
        self.weights = np.concatenate(
            [
                n.handle_inertia,
                [n.handle_mass] * 3,
                n.head_inertia,
                [n.head_mass] * 3,
                [n.string_mass] * 18,
            ]
        )
        self.handle_arm = n.handle_com - n.handle_length  # from T, along the handle's x
        self.bias = np.zeros(30)

    def initial_state(self) -> NDArray[np.float64]:
        """The racket at rest, the ball at the string mass that it touches."""
        n = self.n
        state = np.zeros(41)
        state[0] = 1.0
        state[4] = n.handle_length
        state[BALL] = n.handle_length + n.points[n.point, 0], n.points[n.point, 1], 0.0
        state[BALLDOT] = n.ball_velocity
        return state

    def contact(
        self, y: NDArray[np.float64], rotation: NDArray[np.float64]
    ) -> tuple[float, float, float, float, float, float]:
        """Force on the ball in B, and the ball from T in B."""
        n = self.n
        d = (y[BALL] - y[THROAT]) @ rotation
        u = y[BALLDOT] @ rotation
        (w0, w1, w2), (v0, v1, v2) = y[W].tolist(), y[V].tolist()
        d0, d1, d2 = d.tolist()
        u0, u1, u2 = u.tolist()
        s0 = u0 - v0 - (w1 * d2 - w2 * d1)
        s1 = u1 - v1 - (w2 * d0 - w0 * d2)
        s2 = u2 - v2 - (w0 * d1 - w1 * d0) - y[29 + n.point]
        normal = -n.kb * (d2 - y[9 + n.point]) - n.cb * s2
        share = -n.mu * normal / (s0 * s0 + s1 * s1 + n.sliding_speed_scale**2) ** 0.5
        return share * s0, share * s1, normal, d0, d1, d2

    def __call__(self, _time: float, y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Time derivative of the state."""
        n = self.n
        self.evaluations += 1
        rotation = rotation_matrix(y[QUATERNION])
        q0, q1, q2, q3 = y[QUATERNION].tolist()
        w0, w1, w2 = w = y[W].tolist()
        v0, v1, v2 = v = y[V].tolist()
        tz, ty = y[ANGLES].tolist()
        tz1, ty1 = y[RATES].tolist()
        z, zdot = y[Z], y[ZDOT]

        # handle, in its own axes: B_to_H = Rz(tz) Ry(ty), w_H = B_to_H w - tz' e_z - ty' h_y
        cz, sz, cy, sy = np.cos(tz), np.sin(tz), np.cos(ty), np.sin(ty)
        to_handle = np.array(((cz * cy, -sz, cz * sy), (sz * cy, cz, sz * sy), (-sy, 0.0, cy)))
        a0, a1, a2 = (to_handle @ w).tolist()
        h0, h1, h2 = a0 + ty1 * sz, a1 - ty1 * cz, a2 - tz1
        # angular bias: (tz' e_z + ty' h_y) x (B_to_H w) - tz' ty' e_z x h_y, h_y = (-sz, cz, 0)
        r0, r1 = -ty1 * sz, ty1 * cz
        b0 = r1 * a2 - tz1 * a1 + tz1 * ty1 * cz
        b1 = tz1 * a0 - r0 * a2 + tz1 * ty1 * sz
        b2 = r0 * a1 - r1 * a0
        wv = (w1 * v2 - w2 * v1, w2 * v0 - w0 * v2, w0 * v1 - w1 * v0)
        c = self.handle_arm
        jacobian, bias = self.jacobian, self.bias
        jacobian[0:3, 0:3] = jacobian[3:6, 3:6] = to_handle
        jacobian[2, 6], jacobian[0, 7], jacobian[1, 7] = -1.0, sz, -cz
        # arm along x: e_x x: (0, -alpha_z..) gives rows (0, c alpha_z, -c alpha_y)
        jacobian[4, 0:3], jacobian[5, 0:3] = c * to_handle[2], -c * to_handle[1]
        jacobian[4, 6], jacobian[5, 7] = -c, c * cz
        bias[0:3] = b0, b1, b2
        bias[3:6] = to_handle @ wv
        bias[3] -= c * (h1 * h1 + h2 * h2)
        bias[4] += c * (b2 + h0 * h1)
        bias[5] += c * (h0 * h2 - b1)

        # head and string masses, in B
        x, yy = n.points.T
        bias[9] = wv[0] - n.head_com * (w1 * w1 + w2 * w2)
        bias[10] = wv[1] + n.head_com * w0 * w1
        bias[11] = wv[2] + n.head_com * w0 * w2
        wr = w0 * x + w1 * yy + w2 * z
        ww = w0 * w0 + w1 * w1 + w2 * w2
        bias[12:21] = wv[0] + w0 * wr - ww * x + 2.0 * w1 * zdot
        bias[21:30] = wv[1] + w1 * wr - ww * yy - 2.0 * w0 * zdot
        bias_z = wv[2] + w2 * wr - ww * z
        jacobian[12:21, 1], jacobian[21:30, 0] = z, -z

        # forces
        dz = n.incidence @ z
        length = np.sqrt(dz * dz + self.lengths2)
        strings = -((n.spring_k - self.slack / length) * dz) @ n.incidence
        weighted = self.weights[:, None] * jacobian
        rhs = -(bias @ weighted)
        gyro = self.weights[:9] * (h0, h1, h2, 0.0, 0.0, 0.0, w0, w1, w2)
        g0, g1, g2, _, _, _, g3, g4, g5 = gyro.tolist()
        rhs -= (h1 * g2 - h2 * g1, h2 * g0 - h0 * g2, h0 * g1 - h1 * g0) @ jacobian[0:3]
        rhs[0] -= w1 * g5 - w2 * g4 + strings @ yy
        rhs[1] -= w2 * g3 - w0 * g5 - strings @ x
        rhs[2] -= w0 * g4 - w1 * g3
        rhs[5] -= strings.sum()
        rhs[6] -= n.k_z * tz + n.c_z * tz1
        rhs[7] -= n.k_y * ty + n.c_y * ty1
        out = np.empty(41)
        out[BALLDOT] = 0.0
        if self.touching:
            f0, f1, f2, d0, d1, d2 = self.contact(y, rotation)
            px, py = n.points[n.point].tolist()
            rhs[0] -= d1 * f2 - d2 * f1 - py * f2
            rhs[1] -= d2 * f0 - d0 * f2 + px * f2
            rhs[2] -= d0 * f1 - d1 * f0
            rhs[3] -= f0
            rhs[4] -= f1
            out[BALLDOT] = rotation @ (f0, f1, f2) / n.ball_mass
            strings[n.point] -= f2

        acceleration = np.linalg.solve(jacobian.T @ weighted, rhs)
        p0, p1, _, _, _, a_z, _, _ = acceleration.tolist()
        out[U] = acceleration
        out[ZDOT] = strings / n.string_mass - (bias_z + a_z + p0 * yy - p1 * x)
        out[QUATERNION] = (
            0.5 * (-q1 * w0 - q2 * w1 - q3 * w2),
            0.5 * (q0 * w0 + q2 * w2 - q3 * w1),
            0.5 * (q0 * w1 + q3 * w0 - q1 * w2),
            0.5 * (q0 * w2 + q1 * w1 - q2 * w0),
        )
        out[THROAT] = rotation @ v
        out[7:21] = y[27:41]
        return out

    def run(self, method: str, tolerance: float, end: float) -> NDArray[np.float64]:
        """Rebound velocity of the ball: to release, isolated by `solve_ivp`, then on to `end`."""

        def release(_time: float, y: NDArray[np.float64]) -> float:
            return self.contact(y, rotation_matrix(y[QUATERNION]))[2]

        release.terminal = True
        release.direction = -1.0
        settings = {"method": method, "rtol": tolerance, "atol": 1e-3 * tolerance}
        self.touching = True
        self.evaluations = 0
        contact = solve_ivp(self, (0.0, end), self.initial_state(), events=release, **settings)
        self.touching = False
        free = solve_ivp(self, (contact.t[-1], end), contact.y[:, -1], **settings)
        return free.y[BALLDOT, -1]


def rotation_matrix(q: NDArray[np.float64]) -> NDArray[np.float64]:
    """R_WB of a quaternion (w, x, y, z) that the integration keeps near unit length."""
    a, b, c, d = q.tolist()
    s = 2.0 / (a * a + b * b + c * c + d * d)
    return np.array(
        (
            (1.0 - s * (c * c + d * d), s * (b * c - a * d), s * (b * d + a * c)),
            (s * (b * c + a * d), 1.0 - s * (b * b + d * d), s * (c * d - a * b)),
            (s * (b * d - a * c), s * (c * d + a * b), 1.0 - s * (b * b + c * c)),
        )
    )
