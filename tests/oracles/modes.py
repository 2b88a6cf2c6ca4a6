"""Small vibrations of the racket from matrices written down by hand (numpy and scipy only).

One transverse plane at a time. The axis moves by

    w(x) = w + (x - l) p1 on the handle,    w + (x - l) p2 on the head,

with the displacement w of the throat joint at x = l and the two bodies' slopes p1, p2. Energies are
sums over bodies, particles and springs, each with its row vector in the coordinates:

    2T = sum m (J v)^2,   2V = sum k (J q)^2,   2D = sum c (J v)^2.

Out of plane there are also the roll r of both bodies about the axis and the nine deflections of the
string masses from the head; a mass at (x, y) moves by w + (x - l) p2 + y r + z.

*Nodes of the free-free mode.* Momentum is zero: m1 (w - d1 p1) + m2 (w + d2 p2) = 0 gives w, and
(two_body) p1 : p2 = -(B + C) : (A + C). The nodes are where w + (x - l) p = 0.

Units: kg, m, s, N.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.polynomial import legendre


def free_free_nodes(m1, l1, c1, I1, m2, c2, I2):
    """Nodes (m from the butt) of two hinged bodies; arguments as two_body.free_free_frequency."""
    d1 = l1 - c1
    mu = m1 * m2 / (m1 + m2)
    a, b, c = I1 + mu * d1**2, I2 + mu * c2**2, mu * d1 * c2
    p1, p2 = -(b + c), a + c
    w = (m1 * d1 * p1 - m2 * c2 * p2) / (m1 + m2)
    return l1 - w / p1, l1 - w / p2


@dataclass
class Plane:
    """Matrices of the small motion; build with `add`."""

    size: int

    def __post_init__(self):
        self.M, self.C, self.K = (np.zeros((self.size, self.size)) for _ in range(3))

    def add(self, matrix, constant, row):
        row = np.asarray(row, dtype=float)
        matrix += constant * np.outer(row, row)

    def frequencies(self):
        """Undamped, Hz, rising; rigid motions give numbers near 0."""
        squares = scipy.linalg.eigvalsh(self.K, self.M)
        return np.sqrt(np.clip(squares, 0.0, None)) / (2.0 * np.pi)

    def eigenvalues(self):
        """Damped, 1/s, those of positive imaginary part by rising size."""
        n = self.size
        top = np.hstack([np.zeros((n, n)), np.eye(n)])
        bottom = -np.linalg.solve(self.M, np.hstack([self.K, self.C]))
        values = np.linalg.eigvals(np.vstack([top, bottom]))
        values = values[values.imag > 1e-3]
        return values[np.argsort(np.abs(values))]


def bending_plane(m1, l1, c1, I1, m2, c2, I2, k, c, *, extra=0):
    """The bare frame in coordinates (w, p1, p2, ...), with `extra` more coordinates."""
    plane = Plane(3 + extra)
    more = [0.0] * extra
    plane.add(plane.M, m1, [1.0, c1 - l1, 0.0, *more])
    plane.add(plane.M, I1, [0.0, 1.0, 0.0, *more])
    plane.add(plane.M, m2, [1.0, 0.0, c2, *more])
    plane.add(plane.M, I2, [0.0, 0.0, 1.0, *more])
    plane.add(plane.K, k, [0.0, -1.0, 1.0, *more])
    plane.add(plane.C, c, [0.0, -1.0, 1.0, *more])
    return plane


def add_grip(plane, l1, place, force, torque):
    """A hand at `place` m from the butt; force and torque are pairs (stiffness, damping)."""
    more = [0.0] * (plane.size - 3)
    for matrix, translation, rotation in (
        (plane.K, force[0], torque[0]),
        (plane.C, force[1], torque[1]),
    ):
        plane.add(matrix, translation, [1.0, place - l1, 0.0, *more])
        plane.add(matrix, rotation, [0.0, 1.0, 0.0, *more])


def string_grid(spacing, a, b):
    """Points ((9, 2) from the bed's centre) and springs (i, j or -1, L0), from geometry alone."""
    points = [(row * spacing, column * spacing) for row in (1, 0, -1) for column in (1, 0, -1)]
    springs = []
    for i, (x, y) in enumerate(points):
        for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            other = [
                j
                for j, (u, v) in enumerate(points)
                if np.allclose((u, v), (x + dx * spacing, y + dy * spacing), atol=1e-9)
            ]
            if other:
                if other[0] > i:
                    springs.append((i, other[0], spacing))
            elif dx:  # along x to the ellipse
                springs.append((i, -1, a * np.sqrt(1.0 - (y / b) ** 2) - abs(x)))
            else:
                springs.append((i, -1, b * np.sqrt(1.0 - (x / a) ** 2) - abs(y)))
    return np.array(points), springs


def string_bed_stiffness(spacing, a, b, t0):
    """K = A^T diag(T0 / L0) A (N/m), (9, 9)."""
    _, springs = string_grid(spacing, a, b)
    incidence = np.zeros((len(springs), 9))
    for row, (i, j, _) in enumerate(springs):
        incidence[row, i] = 1.0
        if j >= 0:
            incidence[row, j] = -1.0
    rates = np.diag([t0 / length for _, _, length in springs])
    return incidence.T @ rates @ incidence


def string_bed_frequencies(spacing, a, b, t0, mass):
    """The nine frequencies (Hz) with the head held still; `mass` of all strings."""
    stiffness = string_bed_stiffness(spacing, a, b, t0)
    squares = scipy.linalg.eigvalsh(stiffness, mass / 9.0 * np.eye(9))
    return np.sqrt(squares) / (2.0 * np.pi)


def strung_out_of_plane(frame, roll_inertia, gsc, spacing, a, b, t0, mass):
    """All out-of-plane and torsional motion: (w, p1, p2, r, z1..z9). `frame`: bending_plane's."""
    plane = bending_plane(*frame, extra=10)
    plane.add(plane.M, roll_inertia, [0.0, 0.0, 0.0, 1.0, *[0.0] * 9])
    points, _ = string_grid(spacing, a, b)
    for i, (x, y) in enumerate(points):
        plane.add(plane.M, mass / 9.0, [1.0, 0.0, gsc + x, y, *np.eye(9)[i]])
    plane.K[4:, 4:] += string_bed_stiffness(spacing, a, b, t0)
    return plane


def strung_in_plane(frame, gsc, spacing, mass):
    """In plane the string masses ride on the head: (w, p1, p2)."""
    plane = bending_plane(*frame)
    points, _ = string_grid(spacing, 10.0 * spacing, 10.0 * spacing)
    for x, y in points:
        plane.add(plane.M, mass / 9.0, [1.0, 0.0, gsc + x])
        plane.add(plane.M, mass / 9.0, [0.0, 0.0, y])
    return plane


def quadratic_landmarks(corners, throat, tip):
    """Zeros and vertex of the quadratic nearest to two straight pieces over [0, tip], L2 norm.

    Legendre's polynomials are orthogonal on [-1, 1]; the coefficients are integrals, which Gauss
    points give exactly on each piece.
    """
    nodes, weights = legendre.leggauss(4)
    coefficients = np.zeros(3)
    for (x0, x1), (w0, w1) in zip(
        ((0.0, throat), (throat, tip)), (corners[:2], corners[1:]), strict=True
    ):
        x = 0.5 * (x0 + x1) + 0.5 * (x1 - x0) * nodes
        w = w0 + (w1 - w0) * (x - x0) / (x1 - x0)
        t = 2.0 * x / tip - 1.0
        for n in range(3):
            basis = legendre.legval(t, np.eye(3)[n])
            integral = np.sum(weights * w * basis) * (x1 - x0) / tip
            coefficients[n] += (2 * n + 1) / 2.0 * integral
    roots = np.sort(legendre.legroots(coefficients).real)
    vertex = legendre.legroots(legendre.legder(coefficients))[0]
    return (0.5 * tip * (1.0 + roots)).tolist(), 0.5 * tip * (1.0 + vertex)
