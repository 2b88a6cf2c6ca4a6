"""The string-bed: nine point masses and 24 springs. `string_bed` has the LeafSystem.

Topology (seen from +z, tip up, +y on the left)::

              tip-1   tip-2   tip-3
                |       |       |
      left-1 -- 1 ----- 2 ----- 3 -- right-3
                |       |       |
      left-4 -- 4 ----- 5 ----- 6 -- right-6
                |       |       |
      left-7 -- 7 ----- 8 ----- 9 -- right-9
                |       |       |
            throat-7 throat-8 throat-9

Law (Glynn et al. 2011, in-text equation for T_i): a spring of rest length L0 whose ends differ in
height by dz carries the tension

    T = T0 + k (L - L0) + c dL/dt,        L = sqrt(L0^2 + dz^2)          [N]

and pulls its ends together across the plane with T dz / L. The damping c (N s/m) is not in the
paper's equation; its default is 0. The masses move along the head's z only, so L >= L0 and no
spring can go slack (that would need L < L0 - T0/k).

The springs act between bodies of the head. By virtual work the bed is one vector of generalized
forces on the nine prismatic joints; what the strings pull on the rim in the plane cancels in the
head, and what they push across it reaches the head through the prismatic joints.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.laws.compilation import compilable

POINTS: dict[int, tuple[int, int]] = {
    number: (1 - (number - 1) % 3, 1 - (number - 1) // 3) for number in range(1, 10)
}
"""Point -> (column, row) in spacings from the centre: +1 column is +y (left), +1 row is the tip."""

POINT_NUMBERS = tuple(POINTS)
"""1 to 9."""

_MAINS = [(1, 4, 7), (2, 5, 8), (3, 6, 9)]
_CROSSES = [(1, 2, 3), (4, 5, 6), (7, 8, 9)]


def _springs() -> dict[str, tuple[int, int]]:
    """Name -> (point, point or 0 for the rim), mains first, each line from tip or left."""
    springs: dict[str, tuple[int, int]] = {}
    for lines, first, last in ((_MAINS, "tip", "throat"), (_CROSSES, "left", "right")):
        for a, b, c in lines:
            springs[f"{first}-{a}"] = (a, 0)
            springs[f"{a}-{b}"] = (a, b)
            springs[f"{b}-{c}"] = (b, c)
            springs[f"{last}-{c}"] = (c, 0)
    return springs


SPRINGS = _springs()
SPRING_NAMES = tuple(SPRINGS)
FIRST = np.array([i - 1 for i, _ in SPRINGS.values()])
SECOND = np.array([j - 1 for _, j in SPRINGS.values()])  # -1 for the rim


def incidence() -> NDArray[np.float64]:
    """The (24, 9) matrix A with dz = A z: +1 at a spring's first point, -1 at its second."""
    matrix = np.zeros((24, 9))
    for row, (i, j) in enumerate(SPRINGS.values()):
        matrix[row, i - 1] = 1.0
        if j:
            matrix[row, j - 1] = -1.0
    return matrix


INCIDENCE = incidence()


def spring_formula(formula: str) -> tuple[int, int] | None:
    """Reads `k4` or `p6*k4` as 0-based (k, p), with p = -1 for none; None if it is neither."""
    match = re.fullmatch(r"(?:p([1-9]\d?)\*)?k([1-9]\d?)", formula.replace(" ", ""), re.ASCII)
    if match is None:
        return None
    return int(match[2]) - 1, int(match[1]) - 1 if match[1] else -1


def rest_lengths(
    spacing: float, rim_semi_axis_x: float, rim_semi_axis_y: float
) -> NDArray[np.float64]:
    """Rest lengths (m) of the 24 springs; rim springs run along x or y to the rim ellipse."""
    lengths = np.full(24, spacing)
    for row, (name, (i, j)) in enumerate(SPRINGS.items()):
        if j:
            continue
        y, x = (spacing * n for n in POINTS[i])
        if name.startswith(("tip", "throat")):
            lengths[row] = rim_semi_axis_x * np.sqrt(1 - (y / rim_semi_axis_y) ** 2) - abs(x)
        else:
            lengths[row] = rim_semi_axis_y * np.sqrt(1 - (x / rim_semi_axis_x) ** 2) - abs(y)
    return lengths


@compilable
def spring_law(dz: Any, rate: Any, k: Any, slack: Any, length2: Any, c: Any) -> Any:
    """Slope dz/L (1) and tension T (N) of springs, one or many alike. Equation: module docstring.

    Args:
        dz, rate: height of one end above the other (m) and its rate (m/s).
        k, slack, length2, c: k (N/m); T0 - k L0 (N); L0^2 (m^2); c (N s/m).

    """
    length = np.sqrt(dz * dz + length2)
    slope = dz / length
    return slope, slack + k * length + c * slope * rate


@compilable
def spring_partials(dz: Any, rate: Any, k: Any, slack: Any, length2: Any, c: Any) -> Any:
    """The transverse force F = T dz/L (N) of springs, and its six partial derivatives.

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
    """Energy (J) above the flat spring, T0 (L - L0) + k (L - L0)^2 / 2; as `spring_law`."""
    length0 = np.sqrt(length2)
    # L - L0 without cancellation, since dz is small beside L0
    stretch = dz * dz / (np.sqrt(dz * dz + length2) + length0)
    return (slack + k * length0) * stretch + 0.5 * k * stretch * stretch


@compilable
def _stretch(z: Any, zdot: Any, constants: Any) -> Any:
    """Slope dz/L and tension T (N) of each spring; arguments as for `tensions`."""
    return spring_law(
        INCIDENCE @ z, INCIDENCE @ zdot, constants[0], constants[1], constants[2], constants[3]
    )


def tensions(z: Any, zdot: Any, constants: Any) -> Any:
    """Tension T (N) of each spring, (24,). Equation: module docstring.

    Args:
        z, zdot: (9,) deflection (m) and its rate (m/s) of the masses along the head's z.
        constants: (4, 24) by spring: k (N/m); T0 - k L0 (N); L0^2 (m^2); c (N s/m).

    """
    return _stretch(z, zdot, constants)[1]


def generalized_forces(z: Any, zdot: Any, constants: Any) -> Any:
    """Forces (N) on the nine prismatic joints, -A^T (T dz/L), (9,). Arguments: `tensions`."""
    slope, tension = _stretch(z, zdot, constants)
    return -(tension * slope) @ INCIDENCE


def add_generalized_forces(
    state: Any, q: Any, v: Any, constants: Any, force: Any, rows: Any
) -> None:
    """`generalized_forces` into rows of a vector, spring by spring: what is fast when compiled.

    Args:
        state: of the plant.  q, v: (9,) where heights and rates of the masses are in it.
        constants: as for `tensions`.
        force: forces on all coordinates.  rows: (9,) those of the masses, which are written.

    """
    for i in range(9):
        force[rows[i]] = 0.0
    for s in range(24):
        i, j = FIRST[s], SECOND[s]
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


def stored_energy(z: Any, constants: Any) -> Any:
    """Energy (J) above the flat bed: sum of T0 (L - L0) + k (L - L0)^2 / 2."""
    return np.sum(spring_energy(INCIDENCE @ z, constants[0], constants[1], constants[2]))


def dissipated_power(z: Any, zdot: Any, constants: Any) -> Any:
    """Power (W) lost in the springs' dampers: sum of c (dL/dt)^2."""
    dz = INCIDENCE @ z
    rate = dz * (INCIDENCE @ zdot) / np.sqrt(dz * dz + constants[2])
    return np.sum(constants[3] * rate * rate)
