"""Tells between which string masses a place in the bed lies: weights that a deflection has there.

Between the lines of the grid the weights are bilinear; from the outermost line they fall to 0 at
the rim. They are continuous over the whole bed, and 1 for a mass at its own place.
"""

from __future__ import annotations

from typing import Any

from drake_racket.laws.compilation import compilable
from drake_racket.laws.phases import nearest_point


@compilable
def bed_columns(grid: Any) -> int:
    """Gives the number of points in a row of a grid."""
    columns = 1
    while columns < len(grid) and grid[columns, 0] == grid[0, 0]:
        columns += 1
    return columns


@compilable
def _on_line(grid: Any, axis: int, step: int, count: int, s: Any, end: Any) -> Any:
    """Places s among the falling places grid[k step, axis] of a line whose rim is at +-end.

    Returns:
        the two nearest of the line, the share of the second, and what the rim leaves of both.

    """
    one = 1.0 + 0.0 * s
    first, last = grid[0, axis], grid[(count - 1) * step, axis]
    if s >= first:
        return 0, 0, 0.0 * s, (end - s) / (end - first) if end > s else 0.0 * s
    if s <= last:
        cut = (end + s) / (end + last) if end > -s else 0.0 * s
        return count - 1, count - 1, 0.0 * s, cut
    k = 0
    while grid[(k + 1) * step, axis] > s:
        k += 1
    here, there = grid[k * step, axis], grid[(k + 1) * step, axis]
    return k, k + 1, (here - s) / (here - there), one


@compilable
def _half_chord(s: Any, along: Any, across: Any) -> Any:
    """Half the rim's width along one axis (m) at s on the other; 0 outside."""
    inside = 1.0 - (s / across) * (s / across)
    return along * inside**0.5 if inside > 0.0 else 0.0 * s


@compilable
def bed_weights(grid: Any, rim: Any, x: Any, y: Any) -> Any:
    """Gives the weights over the string masses nearest to a place in the bed.

    Args:
        grid, rim: as of `surface.SurfaceModel`.
        x, y: place from the bed's centre (m).

    Returns:
        four points (from 0), their four weights (their sum is less than 1 between the outermost
        line and the rim, which has the rest), and the shares that mu is interpolated with (sum 1).

    """
    columns = bed_columns(grid)
    rows = len(grid) // columns
    i, j, s, cut_x = _on_line(grid, 0, columns, rows, x, _half_chord(y, rim[0], rim[1]))
    k, m, t, cut_y = _on_line(grid, 1, 1, columns, y, _half_chord(x, rim[1], rim[0]))
    shares = (1.0 - s) * (1.0 - t), (1.0 - s) * t, s * (1.0 - t), s * t
    cut = cut_x * cut_y
    weights = shares[0] * cut, shares[1] * cut, shares[2] * cut, shares[3] * cut
    points = i * columns + k, i * columns + m, j * columns + k, j * columns + m
    return points, weights, shares


@compilable
def met_weights(grid: Any, rim: Any, x: Any, y: Any, alone: Any) -> Any:
    """Gives what `bed_weights` does, or all of it to one mass.

    Args:
        alone: 0: over the nearest masses; a number from 1 on: that mass alone; -1: the nearest one.

    """
    if -0.5 < alone < 0.5:
        return bed_weights(grid, rim, x, y)
    point = (int(alone + 0.5) if alone > 0.0 else nearest_point(grid, x, y)) - 1
    one = 1.0 + 0.0 * x
    zero = 0.0 * x
    return (point, point, point, point), (one, zero, zero, zero), (one, zero, zero, zero)
