"""Cuts a racket's frame into segments: how its mass lies along it, and how its joints bend.

*Mass.* Of slices of the densities in `laws.densities`.

*Joints.* Between segments with midpoints a and b lies a joint with the compliance of the beam
between them, 1/k = (1/s) integral of dx/g(x) from a to b; g is the shape of its stiffness EI(x) or
GJ(x), and s the scale that gives a wanted fundamental frequency. Where a second frequency is wanted
too, the compliances are multiplied by exp(t (e2 - e1)), e1 and e2 the shares that the joints have
in the energy of the first and of the second mode.

*Bending.* A chain of rigid segments with small joint angles q moves by

    w(x) = w0 + p0 x + sum over the joints at x_j < x of q_j (x - x_j).

Lengths in m, masses in kg, moments in kg m^2, stiffness in N m/rad, frequencies in Hz.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_racket.laws.densities import Density

Array = NDArray[np.float64]

MOST_TILT = 0.5
"""Of `tilted_stiffness`: the compliance of no joint changes by more than a factor of 1.65."""


@dataclass(frozen=True)
class Slice:
    """A slice is the mass of a frame between two places along it.

    Attributes:
        start, end: m from the butt.
        mass: kg.  com, com_y: its centre of mass, from the butt and from the long axis (m).
        xx, yy, zz, xy: integrals of x^2, y^2, z^2 and x y over its mass about its centre (kg m^2).

    """

    start: float
    end: float
    mass: float
    com: float
    com_y: float
    xx: float
    yy: float
    zz: float
    xy: float

    def moments(self) -> tuple[float, float, float]:
        """Gives the moments about its centre along x, y and z."""
        return self.yy + self.zz, self.xx + self.zz, self.xx + self.yy


@dataclass(frozen=True)
class PartMass:
    """Says how the mass of a part lies.

    Attributes:
        start, length: m from the butt; m.
        density: along x from `start`.
        com_y, slope: its mean place across the racket is com_y + slope (x - com) (m, 1).
        com: m from `start`.
        yy, zz: integrals of y^2 and z^2 about that mean (kg m^2).
        width: half-width (m) at x by which y^2 is shared out beside the mass; None: by mass alone.

    """

    start: float
    length: float
    density: Density
    com: float
    com_y: float
    slope: float
    yy: float
    zz: float
    width: Callable[[Array], Array] | None = None

    def slices(self, places: Sequence[float]) -> list[Slice | None]:
        """Gives what of the part lies between neighbours of `places`; None for nothing.

        Args:
            places: m from the butt; all of the part lies between them.

        """
        found = [self._between(a, b) for a, b in itertools.pairwise(places)]
        shares = [0.0 if points is None else self._spread(*points) for points in found]
        mass = sum(float(np.sum(points[1])) for points in found if points is not None)
        return [
            None if points is None else self._slice(*points, share / sum(shares), mass)
            for points, share in zip(found, shares, strict=True)
        ]

    def _between(self, start: float, end: float) -> tuple[Array, Array] | None:
        """Places from `self.start` and masses of points that stand for the part's mass there."""
        low, high = max(start - self.start, 0.0), min(end - self.start, self.length)
        if high <= low:
            return None
        x, m = self.density(low, high)
        return (x, m) if np.sum(m) > 0.0 else None

    def _slice(self, x: Array, m: Array, shared: float, whole: float) -> Slice:
        mass = float(np.sum(m))
        com = float(x @ m) / mass
        xx = float((x - com) ** 2 @ m)
        return Slice(
            start=self.start,
            end=self.start + self.length,
            mass=mass,
            com=self.start + com,
            com_y=self.com_y + self.slope * (com - self.com),
            xx=xx,
            yy=self.yy * shared + self.slope**2 * xx,
            zz=self.zz * mass / whole,
            xy=self.slope * xx,
        )

    def _spread(self, x: Array, m: Array) -> float:
        return float(np.sum(m) if self.width is None else self.width(x) ** 2 @ m)


def joined(slices: Sequence[Slice]) -> Slice:
    """Puts neighbouring slices together."""
    mass = sum(s.mass for s in slices)
    x, y = (sum(s.mass * getattr(s, n) for s in slices) / mass for n in ("com", "com_y"))
    arms = [(s, s.com - x, s.com_y - y) for s in slices]
    return Slice(
        start=slices[0].start,
        end=slices[-1].end,
        mass=mass,
        com=x,
        com_y=y,
        xx=sum(s.xx + s.mass * dx * dx for s, dx, _ in arms),
        yy=sum(s.yy + s.mass * dy * dy for s, _, dy in arms),
        zz=sum(s.zz for s in slices),
        xy=sum(s.xy + s.mass * dx * dy for s, dx, dy in arms),
    )


def cut(parts: Sequence[PartMass], places: Sequence[float]) -> list[Slice]:
    """Cuts a frame at `places` (m from the butt, its two ends among them).

    Raises:
        ValueError: no mass lies between two of them.

    """
    slices = []
    rows = zip(*(part.slices(places) for part in parts), strict=True)
    for (start, end), found in zip(itertools.pairwise(places), rows, strict=True):
        pieces = [s for s in found if s is not None]
        if not pieces:
            raise ValueError(f"no mass between {start:g} and {end:g} m")
        slices.append(dataclasses.replace(joined(pieces), start=start, end=end))
    return slices


def ellipse_width(centre: float, a: float, b: float) -> Callable[[Array], Array]:
    """Gives the half-width of an ellipse over x; 0 beyond it."""

    def width(x: Array) -> Array:
        inside = np.clip(1.0 - ((x - centre) / a) ** 2, 0.0, None)
        return np.asarray(b * np.sqrt(inside))

    return width


def boundaries(segments: int, length: float, throat: float, grip: float) -> tuple[float, ...]:
    """Gives the places (m from the butt) that N segments lie between, the ends among them.

    Two meet at the throat joint, as in Glynn et al. 2011. Of more, the first ends at the upper edge
    of the grip, so that a hand or a clamp holds one segment, and the others have one length.
    """
    if segments == 2:
        return 0.0, throat, length
    rest = [grip + (length - grip) * i / (segments - 1) for i in range(segments)]
    return (0.0, *rest[:-1], length)


def compliances(places: Sequence[float], steps: Sequence[float], values: Sequence[float]) -> Array:
    """Gives the integral of dx/g between the midpoints of neighbours, one a joint.

    Args:
        places: `boundaries`.
        steps, values: g is values[0] up to steps[0], then values[1] up to steps[1], and so on.

    """
    middle = [0.5 * (a + b) for a, b in itertools.pairwise(places)]
    ends = [-np.inf, *steps[: len(values) - 1], np.inf]
    found = []
    for a, b in itertools.pairwise(middle):
        pieces = zip(ends, ends[1:], values, strict=False)
        found.append(sum(max(0.0, min(b, high) - max(a, low)) / g for low, high, g in pieces))
    return np.array(found)


def chain_mass(slices: Sequence[Slice], plane: str) -> Array:
    """Gives the mass matrix of small motion in coordinates (w0, p0, q_1, ...) of one plane.

    Args:
        plane: `in_plane` or `out_of_plane`; `torsion`: (roll of the first, q_1, ...).

    """
    count = len(slices)
    if plane == "torsion":
        rows = np.tril(np.ones((count, count)))
        return rows.T @ np.diag([s.moments()[0] for s in slices]) @ rows
    com, mass, ends = (np.array([getattr(s, n) for s in slices]) for n in ("com", "mass", "end"))
    inertia = np.array([s.moments()[2 if plane == "in_plane" else 1] for s in slices])
    beyond = np.tri(count, count - 1, -1)
    arms = beyond * (com[:, np.newaxis] - ends[:-1])
    moved = np.column_stack([np.ones(count), com, arms])
    turned = np.column_stack([np.zeros(count), np.ones(count), beyond])
    matrix: Array = moved.T @ (mass[:, np.newaxis] * moved)
    return matrix + turned.T @ (inertia[:, np.newaxis] * turned)


def free_mass(slices: Sequence[Slice], plane: str) -> Array:
    """Gives the mass matrix of the joint angles of a free frame: M_qq - M_qr M_rr^-1 M_rq."""
    matrix = chain_mass(slices, plane)
    rigid = 1 if plane == "torsion" else 2
    r, q = slice(None, rigid), slice(rigid, None)
    freed: Array = matrix[q, q] - matrix[q, r] @ np.linalg.solve(matrix[r, r], matrix[r, q])
    return freed


def free_frequencies(slices: Sequence[Slice], plane: str, stiffness: Array) -> Array:
    """Gives the frequencies (Hz) of a free frame in one plane, rising."""
    import scipy.linalg

    squares = scipy.linalg.eigvalsh(np.diag(stiffness), free_mass(slices, plane))
    return np.sqrt(squares) / (2.0 * np.pi)  # type: ignore[no-any-return]


def joint_stiffness(
    slices: Sequence[Slice], plane: str, compliance: Array, frequency: float
) -> Array:
    """Gives the stiffness of the joints (N m/rad) with which the fundamental is `frequency`."""
    relative = 1.0 / np.asarray(compliance)
    first = float(free_frequencies(slices, plane, relative)[0])
    return relative * (frequency / first) ** 2


def tilted_stiffness(
    slices: Sequence[Slice], plane: str, compliance: Array, frequency: float, second: float
) -> Array:
    """Gives stiffness as `joint_stiffness` with which the second frequency is `second`, too.

    As near to that as a tilt t of at most MOST_TILT comes: few joints may not reach it.
    """
    import scipy.linalg
    import scipy.optimize

    mass = free_mass(slices, plane)

    def squares(compliance: Array) -> Array:
        return np.asarray(scipy.linalg.eigvalsh(np.diag(1.0 / compliance), mass))

    _, modes = scipy.linalg.eigh(np.diag(1.0 / compliance), mass)
    energy = modes[:, :2] ** 2 / compliance[:, np.newaxis]
    shares = energy / energy.sum(axis=0)
    shift = shares[:, 1] - shares[:, 0]
    wanted = (second / frequency) ** 2

    def miss(t: float) -> float:
        first, other = squares(compliance * np.exp(t * shift))[:2]
        return float(other / first - wanted)

    low, high = miss(-MOST_TILT), miss(MOST_TILT)
    if low * high >= 0.0:
        t = -MOST_TILT if abs(low) < abs(high) else MOST_TILT
    else:
        t = scipy.optimize.brentq(miss, -MOST_TILT, MOST_TILT, xtol=1e-13)
    return joint_stiffness(slices, plane, compliance * np.exp(t * shift), frequency)
