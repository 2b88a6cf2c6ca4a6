"""Tells how string masses and springs of a bed hang together: a grid of points inside a rim.

A bed of 3 x 3 points, seen from +z with the tip up, so that +y is on the left::

              tip-1   tip-2   tip-3
                |       |       |
      left-1 -- 1 ----- 2 ----- 3 -- right-3
                |       |       |
      left-4 -- 4 ----- 5 ----- 6 -- right-6
                |       |       |
      left-7 -- 7 ----- 8 ----- 9 -- right-9
                |       |       |
            throat-7 throat-8 throat-9

Every bed is numbered and named like this one: points row by row from the tip, and the springs after
their ends, mains first, each line from the tip or from the left.
"""

from __future__ import annotations

import functools
import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

FEWEST, MOST = 2, 15
"""Columns or rows of a bed."""


@dataclass(frozen=True, eq=False)
class BedTopology:
    """The topology says which points a bed has, and which spring ends where, in read-only arrays.

    Attributes:
        columns, rows: of points; columns run along x (the mains), rows along y (the crosses).
        places: (n, 2) x, y of the points from the centre, in spacings.
        names: of the m springs.
        first, second: (m,) 0-based points at a spring's ends; second is -1 for the rim.
        directions: (m, 2) unit vectors x, y from the first end to the second.
        incidence: (m, n) A with dz = A z: +1 at a spring's first point, -1 at its second.

    """

    columns: int
    rows: int
    places: Floats
    names: tuple[str, ...]
    first: Indices
    second: Indices
    directions: Floats
    incidence: Floats

    @property
    def points(self) -> tuple[int, ...]:
        """Lists the numbers of the points, 1 to n."""
        return tuple(range(1, len(self.places) + 1))

    @property
    def ends(self) -> Indices:
        """Gives (2, m) `first` and `second`, as the compiled loops take them."""
        return np.stack([self.first, self.second])


def grid_topology(columns: int = 3, rows: int = 3) -> BedTopology:
    """Gives the bed of `rows` rows of `columns` points, one object for each pair of numbers.

    The default is that of Glynn et al. 2011.
    """
    return _grid(columns, rows)


@functools.cache
def _grid(columns: int, rows: int) -> BedTopology:
    grid = np.arange(1, rows * columns + 1).reshape(rows, columns)
    springs: list[tuple[str, int, int, tuple[float, float]]] = []
    for lines, start, end, (x, y) in (
        (grid.T, "tip", "throat", (-1.0, 0.0)),
        (grid, "left", "right", (0.0, -1.0)),
    ):
        for line in lines.tolist():
            springs.append((f"{start}-{line[0]}", line[0], 0, (-x, -y)))
            springs += [(f"{a}-{b}", a, b, (x, y)) for a, b in itertools.pairwise(line)]
            springs.append((f"{end}-{line[-1]}", line[-1], 0, (x, y)))
    names, first, second, directions = zip(*springs, strict=True)
    ends = np.array([first, second], dtype=np.int64) - 1
    incidence = np.zeros((len(names), grid.size))
    inside = np.flatnonzero(ends[1] >= 0)
    incidence[np.arange(len(names)), ends[0]] = 1.0
    incidence[inside, ends[1, inside]] = -1.0
    along = 0.5 * (rows - 1) - np.arange(rows)
    across = 0.5 * (columns - 1) - np.arange(columns)
    places = np.array([(x, y) for x in along for y in across])
    arrays = places, ends[0].copy(), ends[1].copy(), np.array(directions) + 0.0, incidence
    for array in arrays:
        array.setflags(write=False)
    return BedTopology(columns, rows, arrays[0], names, *arrays[1:])


def named_topology(names: Sequence[str]) -> BedTopology | None:
    """Gives the bed whose springs have these names, in this order; None if no bed has."""
    columns, rows = (sum(n.startswith(side) for n in names) for side in ("tip-", "left-"))
    if not (FEWEST <= columns <= MOST and FEWEST <= rows <= MOST):
        return None
    bed = grid_topology(columns, rows)
    return bed if bed.names == tuple(names) else None


POINT_NUMBERS = grid_topology().points
"""The paper's bed has the points 1 to 9, at which its experiments are run."""


def rest_lengths(
    bed: BedTopology, spacing: float, rim_semi_axis_x: float, rim_semi_axis_y: float
) -> Floats:
    """Computes the springs' rest lengths (m); rim springs run along x or y to the rim ellipse.

    Args:
        spacing: m, of the points.  rim_semi_axis_x, rim_semi_axis_y: m, of the rim.

    """
    lengths = np.full(len(bed.names), spacing)
    for row in np.flatnonzero(bed.second < 0):
        x, y = spacing * bed.places[bed.first[row]]
        if bed.directions[row, 0]:
            lengths[row] = rim_semi_axis_x * np.sqrt(1 - (y / rim_semi_axis_y) ** 2) - abs(x)
        else:
            lengths[row] = rim_semi_axis_y * np.sqrt(1 - (x / rim_semi_axis_x) ** 2) - abs(y)
    return lengths


@functools.cache
def spring_formula(formula: str) -> tuple[int, int] | None:
    """Reads `k4` or `p6*k4` as 0-based (k, p), with p = -1 for none; None if it is neither."""
    pattern = r"(?:p([1-9]\d{0,2})\*)?k([1-9]\d{0,2})"
    match = re.fullmatch(pattern, formula.replace(" ", ""), re.ASCII)
    if match is None:
        return None
    return int(match[2]) - 1, int(match[1]) - 1 if match[1] else -1
