"""The free racket a second time, from positions alone: d'Alembert's principle on particles.

Each rigid part is replaced by six particles on its principal axes with the part's mass, centre of
mass and inertia (an axis with integral S of x^2 over the mass m gets two particles of m / 6 at
+-sqrt(3 S / m)). With the string masses and the ball, every place r is a function of twenty
coordinates q = (rotation vector, butt, theta_z, theta_y, z_0..z_8, ball), the handle being turned
by exp(rotation vector) from where it is. At a rotation vector of zero its first and second rates
are the handle's angular velocity and acceleration. Then

    sum m (r'' - g).dr/dq = Q

with dr/dq and r' by complex steps, and the part of r'' without q'' by central differences of r'
along q + q' t. No Jacobian, angular velocity or centrifugal term is written down anywhere. The
force on the ball is an input; ``contact_numbers`` gives its ingredients by the same means.
"""

import numpy as np
from numpy.typing import NDArray

from .clamped_impact import FloatArray
from .free_racket import FreeRacketParams, FreeRacketState

ComplexArray = NDArray[np.complex128]
TINY = 1e-30
STEP = 2e-4  # s, of the central differences
STENCIL = ((1, 4 / 5), (2, -1 / 5), (3, 4 / 105), (4, -1 / 280))  # eighth order


def _exp_skew(phi: ComplexArray) -> ComplexArray:
    """Rotation of a small vector by its power series (holomorphic)."""
    K = np.array([[0, -phi[2], phi[1]], [phi[2], 0, -phi[0]], [-phi[1], phi[0], 0]])
    term = total = np.eye(3, dtype=np.complex128)
    for m in range(1, 16):
        term = term @ K / m
        total = total + term
    return total


def _joint(theta_z: np.complex128, theta_y: np.complex128) -> ComplexArray:
    """Rz Ry as a product of the two elementary matrices."""
    cz, sz, cy, sy = np.cos(theta_z), np.sin(theta_z), np.cos(theta_y), np.sin(theta_y)
    Rz = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    Ry = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    product: ComplexArray = Rz @ Ry
    return product


def _particles(par: FreeRacketParams) -> tuple[FloatArray, FloatArray]:
    """Masses (12,) and body-fixed places (12, 3): six of the handle, six of the head."""
    masses, places = [], []
    for m, c, inertia in (
        (par.handle_mass, par.handle_com, par.handle_inertia),
        (par.head_mass, par.head_com, par.head_inertia),
    ):
        second = inertia.sum() / 2.0 - inertia  # integrals of x^2, y^2, z^2
        for axis in range(3):
            arm = np.sqrt(3.0 * second[axis] / m) * np.eye(3)[axis]
            for sign in (1.0, -1.0):
                masses.append(m / 6.0)
                places.append(np.array([c, 0.0, 0.0]) + sign * arm)
    return np.array(masses), np.array(places)


def _head(
    q: ComplexArray, par: FreeRacketParams, st: FreeRacketState
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """R_WH, R_WB and the place of the throat joint."""
    R = _exp_skew(q[0:3]) @ st.R_WH
    return R, R @ _joint(q[6], q[7]), q[3:6] + par.handle_length * R[:, 0]


def _positions(q: ComplexArray, par: FreeRacketParams, st: FreeRacketState) -> ComplexArray:
    """Places (22, 3): 12 particles, 9 string masses, ball."""
    R, R_WB, throat = _head(q, par, st)
    places = _particles(par)[1]
    bed = np.column_stack([par.gsc + par.grid_xy[:, 0], par.grid_xy[:, 1], q[8:17]])
    return np.vstack(
        [q[3:6] + places[:6] @ R.T, throat + places[6:] @ R_WB.T, throat + bed @ R_WB.T, q[17:20]]
    )


def _ball_in_string_body(
    q: ComplexArray, par: FreeRacketParams, st: FreeRacketState
) -> ComplexArray:
    """Return the ball's place (3,) from the touched string mass, in the axes of the head."""
    _, R_WB, _ = _head(q, par, st)
    place: ComplexArray = R_WB.T @ (q[17:20] - _positions(q, par, st)[12 + par.contact_index])
    return place


def _coordinates(st: FreeRacketState) -> tuple[FloatArray, FloatArray]:
    q = np.r_[np.zeros(3), st.p_WHo, st.theta_z, st.theta_y, st.z, st.p_WQ]
    u = np.r_[st.w_WH, st.v_WHo, st.theta_z_dot, st.theta_y_dot, st.z_dot, st.v_WQ]
    return q, u


def contact_numbers(
    par: FreeRacketParams, st: FreeRacketState
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Ball from string mass in the head: place (3,), its rate (3,), and R_WB."""
    q, u = _coordinates(st)
    place = _ball_in_string_body(q + 1j * TINY * u, par, st)
    return place.real, place.imag / TINY, _head(q.astype(np.complex128), par, st)[1].real


def particle_accelerations(
    par: FreeRacketParams, st: FreeRacketState, gravity: FloatArray, on_ball: FloatArray
) -> FloatArray:
    """alpha_WH, a_WHo, theta_z'', theta_y'', z'', a_WQ in one vector (20,)."""
    q, u = _coordinates(st)

    def velocity(t: float) -> FloatArray:
        return _positions(q + u * t + 1j * TINY * u, par, st).imag / TINY

    drift = np.zeros((22, 3))
    for m, weight in STENCIL:
        drift += weight / STEP * (velocity(m * STEP) - velocity(-m * STEP))
    turned = [q + 1j * TINY * e for e in np.eye(20)]
    dr = np.stack([_positions(c, par, st).imag / TINY for c in turned], axis=-1)
    mass = np.r_[_particles(par)[0], [par.string_mass] * 9, par.ball_mass]

    rhs = np.einsum("p,pi,pij->j", mass, gravity - drift, dr)
    rhs[6] -= par.k_z * st.theta_z + par.c_z * st.theta_z_dot
    rhs[7] -= par.k_y * st.theta_y + par.c_y * st.theta_y_dot
    z, z_dot = np.append(st.z, 0.0), np.append(st.z_dot, 0.0)
    for i, j, k, L0 in zip(par.spring_i, par.spring_j, par.spring_k, par.spring_L0, strict=True):
        dz, L = z[j] - z[i], np.hypot(L0, z[j] - z[i])
        tension = par.T0 + k * (L - L0) + par.string_damping * dz / L * (z_dot[j] - z_dot[i])
        if i >= 0:
            rhs[8 + i] += tension * dz / L
        if j >= 0:
            rhs[8 + j] -= tension * dz / L

    rhs[17:20] += on_ball
    touched = dr[12 + par.contact_index]
    if par.reaction_at == "ball":  # the point of the string body where the ball is now
        fixed = _ball_in_string_body(q.astype(np.complex128), par, st).real
        touched = np.stack(
            [
                (_positions(c, par, st)[12 + par.contact_index] + _head(c, par, st)[1] @ fixed).imag
                / TINY
                for c in turned
            ],
            axis=-1,
        )
    rhs -= on_ball @ touched
    solution: FloatArray = np.linalg.solve(np.einsum("p,pij,pik->jk", mass, dr, dr), rhs)
    return solution
