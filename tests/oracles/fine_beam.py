"""A racket's frame as a fine beam of cubic elements, out of its plane, with strings, ball and hand.

Euler's and Bernoulli's beam with rotatory inertia, in Hermite's elements: deflection w and slope at
each node. Mass a line density m'(x) and a rotatory one j'(x), stiffness EI(x), damping EI times a
time. A string mass has its own height z; a string's end on the rim has the beam's height there. A
beam that bends brings the ends of the strings along it nearer, by half of the integral of w'^2:
what pulls the strings straight presses the beam. The ball is a mass on a spring-damper. Impacts are
integrated in the beam's lowest modes.

Densities are derived here by other means than the package's: the maximum-entropy one by a root
search on adaptive integrals, the hoop by a sum over many points of the ellipse.

numpy and scipy only; SI.
"""

import itertools
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq, fsolve


def smooth(mass, length, com, second):
    """m'(x) = exp(a + b x + c x^2) of the given mass, centre and integral (x - com)^2 dm."""

    def density(x, b, c):
        u = x / length - 0.5
        return np.exp(b * u + c * u * u)

    def moment(n, b, c):
        return quad(lambda x: (x - com) ** n * density(x, b, c), 0.0, length, epsabs=1e-14)[0]

    def left(coefficients):
        whole = moment(0, *coefficients)
        return [
            moment(1, *coefficients) / whole / length,
            (moment(2, *coefficients) / whole - second / mass) / length**2,
        ]

    b, c = fsolve(left, [0.0, 4.0], xtol=1e-13)
    scale = mass / moment(0, b, c)
    return lambda x: scale * density(x, b, c)


def exponential(mass, length, com):
    """m'(x) = exp(a + b x) of the given mass and centre."""

    def left(b):
        whole = quad(lambda x: np.exp(b * x / length), 0.0, length)[0]
        return quad(lambda x: x * np.exp(b * x / length), 0.0, length)[0] / whole - com

    b = brentq(left, -40.0, 40.0, xtol=1e-13)
    scale = mass / quad(lambda x: np.exp(b * x / length), 0.0, length)[0]
    return lambda x: scale * np.exp(b * x / length)


def hoop(mass, length, com, centre, a, b, points=400_000):
    """Places and masses of many points on the part of an ellipse within [0, length]."""
    t = (np.arange(points) + 0.5) * np.pi / points
    x, weight = centre + a * np.cos(t), np.hypot(a * np.sin(t), b * np.cos(t))
    x, weight = x[(x > 0.0) & (x < length)], weight[(x > 0.0) & (x < length)]
    tilt = brentq(lambda k: np.sum(weight * np.exp(k * x) * (x - com)), -80.0, 80.0, xtol=1e-12)
    m = weight * np.exp(tilt * x)
    return x, mass * m / np.sum(m)


@dataclass
class FineBeam:
    """Nodes at x; mass matrix M, and K for EI = 1, in (w, slope) of every node."""

    x: np.ndarray
    M: np.ndarray = field(init=False)
    K: np.ndarray = field(init=False)

    def __post_init__(self):
        n = 2 * len(self.x)
        self.M, self.K = np.zeros((n, n)), np.zeros((n, n))
        for i, h in enumerate(np.diff(self.x)):
            at = slice(2 * i, 2 * i + 4)
            self.K[at, at] += (
                np.array(
                    [
                        [12.0, 6.0 * h, -12.0, 6.0 * h],
                        [6.0 * h, 4.0 * h * h, -6.0 * h, 2.0 * h * h],
                        [-12.0, -6.0 * h, 12.0, -6.0 * h],
                        [6.0 * h, 2.0 * h * h, -6.0 * h, 4.0 * h * h],
                    ]
                )
                / h**3
            )

    def row(self, place, derivative=False):
        """The deflection (or slope) at a place, as a row over all freedoms."""
        i = int(np.clip(np.searchsorted(self.x, place) - 1, 0, len(self.x) - 2))
        h = self.x[i + 1] - self.x[i]
        s = (place - self.x[i]) / h
        own = [
            1.0 - 3.0 * s**2 + 2.0 * s**3,
            h * (s - 2.0 * s**2 + s**3),
            3.0 * s**2 - 2.0 * s**3,
            h * (s**3 - s**2),
        ]
        if derivative:
            own = [
                (-6.0 * s + 6.0 * s**2) / h,
                1.0 - 4.0 * s + 3.0 * s**2,
                (6.0 * s - 6.0 * s**2) / h,
                3.0 * s**2 - 2.0 * s,
            ]
        row = np.zeros(2 * len(self.x))
        row[2 * i : 2 * i + 4] = own
        return row

    def add_points(self, places, masses, rotatory):
        """Point masses, and rotatory inertia (kg m^2) beside each."""
        for x, m, j in zip(places, masses, rotatory, strict=True):
            w, p = self.row(x), self.row(x, derivative=True)
            self.M += m * np.outer(w, w) + j * np.outer(p, p)

    def add_density(self, start, length, density, rotatory_share):
        """A line density over [start, start + length], by five Gauss points an element."""
        nodes, weights = np.polynomial.legendre.leggauss(5)
        edges = np.unique(np.clip(self.x, start, start + length))
        for a, b in itertools.pairwise(edges):
            x = 0.5 * (a + b) + 0.5 * (b - a) * nodes
            m = 0.5 * (b - a) * weights * density(x - start)
            self.add_points(x, m, rotatory_share * m)

    def modes(self, stiffness, held=()):
        """Squares (rad/s)^2 and shapes with `held` freedoms fixed."""
        free = np.setdiff1d(np.arange(len(self.M)), held)
        squares, found = scipy.linalg.eigh(
            stiffness * self.K[np.ix_(free, free)], self.M[np.ix_(free, free)]
        )
        shapes = np.zeros((len(self.M), len(free)))
        shapes[free] = found
        return np.clip(squares, 0.0, None), shapes

    def stiffness_for(self, frequency):
        """EI with which the free beam's fundamental is `frequency` (Hz)."""
        squares, _ = self.modes(1.0)
        return (2.0 * np.pi * frequency) ** 2 / squares[2]

    def nodes_of(self, shape):
        """Places where a shape is zero."""
        x = np.linspace(self.x[0], self.x[-1], 4001)
        w = np.array([self.row(place) @ shape for place in x])
        at = np.flatnonzero(w[1:] * w[:-1] < 0.0)
        return x[at] + (x[1] - x[0]) * w[at] / (w[at] - w[at + 1])


@dataclass
class Strung:
    """A string-bed over the beam: places (x, y) of the masses, springs and their ends.

    ends: (s, 2) numbers of masses, -1 for the rim; rim: (s,) x of the rim ends from the butt.
    """

    mass: float
    places: np.ndarray
    ends: np.ndarray
    rim: np.ndarray
    stiffness: np.ndarray
    lengths: np.ndarray
    tension: float

    def forces(self, z, rim_height, shortening):
        """On the masses, on the rim end of every spring, and T L0 / L of every spring (N).

        shortening: (s,) integrals of w'^2 along the frame between the springs' ends.
        """
        on_mass, on_rim = np.zeros(len(z)), np.zeros(len(self.ends))
        axial = np.zeros(len(self.ends))
        for s, (i, j) in enumerate(self.ends):
            own = self.lengths[s]
            dz = z[i] - (z[j] if j >= 0 else rim_height[s])
            length = np.sqrt(own**2 + dz**2 - own * shortening[s])
            pull = (self.tension + self.stiffness[s] * (length - own)) / length
            axial[s] = pull * own
            on_mass[i] -= pull * dz
            if j >= 0:
                on_mass[j] += pull * dz
            else:
                on_rim[s] = pull * dz
        return on_mass, on_rim, axial


@dataclass
class BeamImpact:
    """What an impact on the beam gives."""

    rebound: float
    hand_force: float
    hand_torque: float


def _slopes(beam, shapes, bed, s):
    """The integral of w'^2 between the ends of a spring, as a matrix of the modes."""
    i, j = bed.ends[s]
    ends = sorted([bed.places[i, 0], bed.places[j, 0] if j >= 0 else bed.rim[s]])
    x = np.linspace(*ends, 41)
    rows = np.array([beam.row(place, derivative=True) @ shapes for place in x])
    weights = np.full(41, (ends[1] - ends[0]) / 40.0)
    weights[[0, -1]] *= 0.5
    return rows.T @ (weights[:, None] * rows)


def impact(
    beam, stiffness, loss, bed, ball, point, speed, *, held=(), hand=None, modes=12, end=0.012
):
    """A ball on a mass of the bed, normal to it, from first touch.

    loss: damping over stiffness (s).  ball: mass, kb, cb.  hand: place, (k, c) of force and torque.
    """
    squares, shapes = beam.modes(stiffness, held)
    squares, shapes = squares[:modes], shapes[:, :modes]
    rims = np.array(
        [
            beam.row(x) @ shapes if j < 0 else np.zeros(modes)
            for x, (_, j) in zip(bed.rim, bed.ends, strict=True)
        ]
    )
    grips = []
    if hand is not None:
        place, force, torque = hand
        grips = [
            (beam.row(place) @ shapes, *force),
            (beam.row(place, derivative=True) @ shapes, *torque),
        ]
    slopes = [_slopes(beam, shapes, bed, s) for s in range(len(bed.ends))]
    n, (mass, kb, cb) = len(bed.places), ball
    each = bed.mass / n

    def rates(_, y):
        q, qv = y[:modes], y[modes : 2 * modes]
        z, zv = y[2 * modes : 2 * modes + n], y[2 * modes + n : 2 * modes + 2 * n]
        b, bv = y[-3], y[-2]
        shortening = np.array([q @ matrix @ q for matrix in slopes])
        on_mass, on_rim, axial = bed.forces(z, rims @ q, shortening)
        generalized = rims.T @ on_rim - squares * (q + loss * qv)
        for pull, matrix in zip(axial, slopes, strict=True):
            generalized += pull * (matrix @ q)
        for row, k, c in grips:
            generalized -= row * (k * (row @ q) + c * (row @ qv))
        x, rate = z[point] - b, zv[point] - bv
        push = kb * x + cb * rate if y[-1] < 0.5 else 0.0
        on_mass[point] -= push
        return np.concatenate([qv, generalized, zv, on_mass / each, [bv, push / mass, 0.0]])

    def release(_, y):
        z, zv = y[2 * modes : 2 * modes + n], y[2 * modes + n : 2 * modes + 2 * n]
        return kb * (z[point] - y[-3]) + cb * (zv[point] - y[-2])

    release.terminal, release.direction = True, -1.0
    start = np.zeros(2 * modes + 2 * n + 3)
    start[-2] = -speed
    options = {"method": "DOP853", "rtol": 1e-8, "atol": 1e-9, "max_step": 5e-5}
    first = solve_ivp(rates, (0.0, end), start, events=release, **options)
    after = first.y[:, -1].copy()
    rebound = after[-2]
    after[-1] = 1.0
    second = solve_ivp(rates, (first.t[-1], end), after, **options)
    states = np.concatenate([first.y, second.y], axis=1)
    peaks = [
        np.max(np.abs(row @ (k * states[:modes] + c * states[modes : 2 * modes])))
        for row, k, c in grips
    ] or [0.0, 0.0]
    return BeamImpact(rebound, *peaks)
