"""Has the string-bed's law, point masses joined by springs. `bed` says which ends where.

Law (Glynn et al. 2011, in-text equation for T_i): a spring of rest length L0 whose ends differ in
height by dz carries the tension

    T = T0 + k (L - L0) + c dL/dt,        L = sqrt(L0^2 + dz^2)          [N]

and pulls its ends together across the plane with T dz / L. The damping c (N s/m) is not in the
paper's equation; its default is 0. The masses move along the head's z only, so L >= L0 and no
spring can go slack (that would need L < L0 - T0/k).

Where a frame of several segments bends between the masses' plane and the rim that a spring ends on,
angles q of its joints change the spring's height and fold the frame under it:

    dz = A z + B q,    L = sqrt(L0^2 + dz^2 - q^T F q),

q^T F q / (2 L0) being how much nearer the rim comes. So a frame that the strings follow costs them
nothing: what tension stiffens, the compression of the frame that carries it takes away.

The springs act between bodies of the head. By virtual work the bed is one vector of generalized
forces on the masses' prismatic joints; what the strings pull on the rim in the plane cancels in the
head, and what they push across it reaches the head through the prismatic joints.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drake_racket.laws.compilation import compilable


@compilable
def spring_law(dz: Any, rate: Any, k: Any, slack: Any, length2: Any, c: Any) -> Any:
    """Computes slope dz/L (1) and tension T (N) of springs; the module has the equation.

    Args:
        dz, rate: height of one end above the other (m) and its rate (m/s).
        k, slack, length2, c: k (N/m); T0 - k L0 (N); L0^2 (m^2); c (N s/m).

    """
    length = np.sqrt(dz * dz + length2)
    slope = dz / length
    return slope, slack + k * length + c * slope * rate


@compilable
def spring_partials(dz: Any, rate: Any, k: Any, slack: Any, length2: Any, c: Any) -> Any:
    """Gives the transverse force F = T dz/L (N) of springs, and its six partial derivatives.

    With L_z = dz/L, slope_z = L0^2/L^3 and T_z = k L_z + c slope_z rate,
    F_z = T_z dz/L + T slope_z; the others likewise.

    Returns:
        F and its derivatives with respect to the six arguments of `spring_law`, in their order.

    """
    slope, tension = spring_law(dz, rate, k, slack, length2, c)
    length = np.sqrt(dz * dz + length2)
    slope_z = length2 / (length * length * length)
    by_dz = (k * slope + c * slope_z * rate) * slope + tension * slope_z
    half = 0.5 / length  # dL / d(L0^2)
    slope_l = -slope * half / length
    by_length2 = (k * half + c * slope_l * rate) * slope + tension * slope_l
    square = slope * slope
    return tension * slope, by_dz, c * square, length * slope, slope, by_length2, square * rate


@compilable
def spring_energy(dz: Any, k: Any, slack: Any, length2: Any) -> Any:
    """Computes the energy (J) above the flat spring, T0 (L - L0) + k (L - L0)^2 / 2."""
    length0 = np.sqrt(length2)
    # L - L0 without cancellation, since dz is small beside L0
    stretch = dz * dz / (np.sqrt(dz * dz + length2) + length0)
    return (slack + k * length0) * stretch + 0.5 * k * stretch * stretch


def _stretch(z: Any, zdot: Any, constants: Any, incidence: Any) -> Any:
    """Slope dz/L and tension T (N) of each spring; arguments as for `tensions`."""
    k, slack, length2, c = constants
    return spring_law(incidence @ z, incidence @ zdot, k, slack, length2, c)


def tensions(z: Any, zdot: Any, constants: Any, incidence: Any) -> Any:
    """Tensions (N) of the m springs.

    Args:
        z, zdot: (n,) deflection (m) and its rate (m/s) of the masses along the head's z.
        constants: (4, m) by spring: k (N/m); T0 - k L0 (N); L0^2 (m^2); c (N s/m).
        incidence: (m, n) A of the bed's topology, dz = A z.

    """
    return _stretch(z, zdot, constants, incidence)[1]


def generalized_forces(z: Any, zdot: Any, constants: Any, incidence: Any) -> Any:
    """Computes the forces (N) on the masses' prismatic joints, -A^T (T dz/L), (n,)."""
    slope, tension = _stretch(z, zdot, constants, incidence)
    return -(tension * slope) @ incidence


def add_generalized_forces(
    state: Any, q: Any, v: Any, constants: Any, ends: Any, force: Any, rows: Any
) -> None:
    """Adds `generalized_forces` into rows of a vector, spring by spring: fast when compiled.

    Args:
        state: of the plant.  q, v: (n,) where heights and rates of the masses are in it.
        constants: as for `tensions`.  ends: (2, m) of the bed's topology.
        force: forces on all coordinates.  rows: (n,) those of the masses, which are written.

    """
    for i in range(len(rows)):
        force[rows[i]] = 0.0
    for s in range(ends.shape[1]):
        i, j = ends[0, s], ends[1, s]
        dz, rate = state[q[i]], state[v[i]]
        if j >= 0:
            dz -= state[q[j]]
            rate -= state[v[j]]
        slope, tension = spring_law(
            dz, rate, constants[0, s], constants[1, s], constants[2, s], constants[3, s]
        )
        pull = tension * slope
        force[rows[i]] -= pull
        if j >= 0:
            force[rows[j]] += pull


def bent_stretch(dz: Any, rate: Any, sag: Any, flow: Any, constants: Any) -> tuple[Any, Any]:
    """Gives length L (m) and tension T (N) of springs over a frame that bends.

    Args:
        dz, rate: heights (m) and their rates (m/s).
        sag, flow: q^T F q (m^2) and q^T F q' (m^2/s); dL/dt = (dz dz' - q^T F q') / L.
        constants: as for `tensions`.

    """
    k, slack, length2, c = constants
    length = np.sqrt(dz * dz + length2 - sag)
    return length, slack + k * length + c * (dz * rate - flow) / length


def bent_forces(heights: Any, rates: Any, constants: Any, ends: Any, folds: Any) -> Any:
    """Computes the forces (N, N m) on [z; q] of springs over a frame that bends.

    Args:
        heights, rates: (n + j,) [z; q] and their rates.
        constants: as for `tensions`.
        ends: (m, n + j) [A, B].  folds: (m, j, j) F.

    """
    count = folds.shape[1]
    q, qv = heights[-count:], rates[-count:]
    dz, folded = ends @ heights, folds @ q
    length, tension = bent_stretch(
        dz, ends @ rates, np.sum(folded * q, axis=1), np.sum(folded * qv, axis=1), constants
    )
    pull = tension / length
    force = -(pull * dz) @ ends
    force[-count:] = force[-count:] + pull @ folded
    return force


def add_bent_forces(
    state: Any,
    q: Any,
    v: Any,
    constants: Any,
    ends: Any,
    arms: Any,
    folds: Any,
    force: Any,
    rows: Any,
) -> None:
    """Adds `bent_forces` into rows of a vector, spring by spring: fast when compiled.

    Args:
        state, q, v, constants, ends, force, rows: as for `add_generalized_forces`, of the masses,
            then of the j joints.
        arms: (m, j) B.  folds: (m, j, j) F.

    """
    count = arms.shape[1]
    first = len(rows) - count
    for i in range(len(rows)):
        force[rows[i]] = 0.0
    for s in range(ends.shape[1]):
        i, j = ends[0, s], ends[1, s]
        dz, rate = state[q[i]], state[v[i]]
        if j >= 0:
            dz -= state[q[j]]
            rate -= state[v[j]]
        sag = flow = 0.0
        for a in range(count):
            dz += arms[s, a] * state[q[first + a]]
            rate += arms[s, a] * state[v[first + a]]
            for b in range(count):
                fold = folds[s, a, b] * state[q[first + a]]
                sag += fold * state[q[first + b]]
                flow += fold * state[v[first + b]]
        length = np.sqrt(dz * dz + constants[2, s] - sag)
        tension = constants[1, s] + constants[0, s] * length
        pull = (tension + constants[3, s] * (dz * rate - flow) / length) / length
        force[rows[i]] -= pull * dz
        if j >= 0:
            force[rows[j]] += pull * dz
        for a in range(count):
            folded = 0.0
            for b in range(count):
                folded += folds[s, a, b] * state[q[first + b]]
            force[rows[first + a]] -= pull * (dz * arms[s, a] - folded)


def bent_energy(dz: Any, sag: Any, constants: Any) -> Any:
    """Computes the energies (J) of springs over a frame that bends, as `spring_energy`."""
    k, slack, length2, _ = constants
    length0 = np.sqrt(length2)
    stretch = (dz * dz - sag) / (np.sqrt(dz * dz + length2 - sag) + length0)
    return (slack + k * length0) * stretch + 0.5 * k * stretch * stretch


def stored_energy(z: Any, constants: Any, incidence: Any) -> Any:
    """Gives the energy (J) above the flat bed: sum of T0 (L - L0) + k (L - L0)^2 / 2."""
    return np.sum(spring_energy(incidence @ z, constants[0], constants[1], constants[2]))


def dissipated_power(z: Any, zdot: Any, constants: Any, incidence: Any) -> Any:
    """Gives the power (W) lost in the springs' dampers: sum of c (dL/dt)^2."""
    dz = incidence @ z
    rate = dz * (incidence @ zdot) / np.sqrt(dz * dz + constants[2])
    return np.sum(constants[3] * rate * rate)
